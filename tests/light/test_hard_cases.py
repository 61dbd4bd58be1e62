"""Lights, views and meshes that break renderers, each with a bound."""

from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from stages.core.albedo import specular_albedo
from stages.core.color import reinhard
from stages.core.shading import KNOTS, light_maps
from stages.light.environment import directions_of_texels, load_environment, lookup
from stages.light.gbuffer import GBuffer
from stages.light.lights import BUILTIN
from stages.light.reference import reference_transport
from stages.light.scene import Scene
from stages.light.transport import QUALITY, light_transport
from stages.prep.options import PrepOptions
from stages.prep.read_obj import read_obj
from stages.prep.repair import repair
from stages.prep.stage import oriented
from stages.prep.stage import prep as run_prep
from tests.light import scenes
from tests.light.test_transport import rmse_percent, stacked

STANDARD = QUALITY["standard"]


def test_mirror_is_exact() -> None:
    """Roughness 0: the light in the mirror direction, where nothing stands in the way, to float32."""
    scene, light = scenes.box_in_corner(), scenes.sunny_light()
    points = scenes.view_of(scene, 48)
    t = light_transport(scene, points, [light], STANDARD, 0)[0]
    n, wo = points.n.astype(np.float64), points.wo.astype(np.float64)
    wi = 2 * (n * wo).sum(-1, keepdims=True) * n - wo
    radiance = lookup(light.radiance, wi) * ~scene.occluded(points.origin, wi)[:, None]
    assert (t.A[:, 0] + t.B[:, 0]).numpy() == pytest.approx(radiance, rel=2e-3, abs=1e-4)


@pytest.mark.parametrize("roughness", (0.5, 1.0))
def test_no_outlier_at_high_roughness(roughness: float) -> None:
    """The largest error anywhere, tone-mapped, stays under 4 %."""
    scene, light = scenes.sphere(5), scenes.sunny_light(65_000.0)
    points = scenes.view_of(scene, 64)
    pixels = np.arange(0, len(points.n), 31)
    exact = reference_transport(scene, points, light, 4, pixels)
    found = light_transport(scene, points, [light], STANDARD, 0)[0][torch.from_numpy(pixels)]
    k = KNOTS.index(roughness)
    error = reinhard(found.A[:, k] + found.B[:, k]) - reinhard(exact.A[:, k] + exact.B[:, k])
    assert float(error.abs().max()) < 0.04


@pytest.mark.parametrize("cosine", (1e-3, 3e-3, 0.02))
def test_furnace_at_grazing_view(cosine: float) -> None:
    """An evenly lit open point reflects its albedo, however flat it is seen: A + B within 0.5 %."""
    t = light_transport(scenes.sphere(1, 0.01), scenes.open_point(cosine, 16), [scenes.even_light()], STANDARD, 0)[0]
    for k, r in enumerate(KNOTS):
        albedo = specular_albedo(torch.tensor([r]), torch.tensor([cosine])).sum() if r else 1.0
        assert float((t.A[:, k] + t.B[:, k]).max()) == pytest.approx(float(albedo), rel=5e-3)


@pytest.mark.parametrize("sun", (65_000.0, 1e6))
def test_sun_on_one_texel(sun: float) -> None:
    scene = scenes.box_in_corner()
    points = scenes.view_of(scene, 32)
    assert rmse_percent(scene, points, scenes.sunny_light(sun, 128), STANDARD, 4) < 1.0


def test_measured_sun(assets: Path) -> None:
    """A photographed sky with a sun of 65,000."""
    light, _ = load_environment(assets / "hdr" / "rooitou_park_1k.hdr")
    scene = scenes.box_in_corner()
    points = scenes.view_of(scene, 40)
    assert rmse_percent(scene, points, light, STANDARD, 1) < 1.0


def test_single_texel_light_does_not_sparkle() -> None:
    """All light in one texel: the rough terms keep within twice the reference's largest value."""
    scene, light = scenes.sphere(4), scenes.single_texel_light()
    points = scenes.view_of(scene, 32)
    t = light_transport(scene, points, [light], STANDARD, 0)[0]
    pixels = np.arange(0, len(points.n), 9)
    reference = reference_transport(scene, points, light, 8, pixels)
    for fast, exact in ((t.E, reference.E), (t.A[:, -1], reference.A[:, -1]), (t.A[:, 5], reference.A[:, 5])):
        assert float(fast.max()) < 2 * float(exact.max())
    assert rmse_percent(scene, points, light, STANDARD, 8) < 1.0


@pytest.mark.parametrize("roughness", range(len(KNOTS)))
def test_finite_at_grazing_view(roughness: int) -> None:
    t = light_transport(
        scenes.sphere(1, 0.01), scenes.open_point(1e-3, 8), [scenes.sunny_light(65000.0)], QUALITY["draft"], 0
    )[0]
    assert bool(t.A[:, roughness].isfinite().all())
    assert bool(t.B[:, roughness].isfinite().all())


def test_view_without_the_object() -> None:
    scene = scenes.sphere(2)
    points = scenes.view_of(scene, 16, eye=(400.0, 300.0, 200.0))
    empty = GBuffer(points.mask & False, points.depth * 0, *(getattr(points, f)[:0] for f in POINT_FIELDS))
    assert len(light_transport(scene, empty, [scenes.even_light()], QUALITY["draft"], 0)[0].E) == 0


POINT_FIELDS = ("point", "origin", "n", "ng", "wo", "triangle", "barycentric")


def test_coarse_smooth_sphere_has_no_black_facets() -> None:
    """Twenty triangles with smooth normals: where the shading normal faces the sun, light arrives."""
    scene, light = scenes.sphere(0), scenes.single_texel_light()
    points = scenes.view_of(scene, 48)
    rows, columns = np.nonzero(light.radiance[..., 0])
    direction = directions_of_texels(*light.radiance.shape[:2])[0][rows[0], columns[0]]
    lit = points.n @ direction > 0.25
    t = light_transport(scene, points, [light], STANDARD, 0)[0]
    assert float((t.E[torch.from_numpy(lit)].amax(1) <= 0).float().mean()) < 0.01


def test_duplicate_faces_do_not_shadow_themselves() -> None:
    base = scenes.sphere(3)
    scene = Scene(base.vertices, np.concatenate([base.triangles] * 2), np.concatenate([base.normals] * 2))
    once, twice = (
        light_transport(s, scenes.view_of(s, 24), [scenes.even_light()], QUALITY["draft"], 0)[0].E for s in (base, scene)
    )
    assert torch.equal(once, twice)


def test_closed_box_lets_no_light_in() -> None:
    import trimesh

    mesh = trimesh.creation.box()
    scene = Scene(mesh.vertices, mesh.faces, scenes.flat_normals(mesh.vertices, mesh.faces))
    points = scenes.view_of(scene, 32, eye=(0.3, 0.2, 0.1))
    t = light_transport(scene, points, [scenes.even_light()], QUALITY["draft"], 0)[0]
    assert float(stacked(t).max()) == 0.0


def test_thin_wall_does_not_leak() -> None:
    """A floor under a roof a ten-thousandth above it gets nothing from above; the roof's top gets all."""
    sheet = scenes.square(2, 0.0, -0.5, 0.5)
    vertices = np.concatenate([sheet, sheet + [0, 0, 1e-4]])
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    scene = Scene(vertices, triangles, scenes.flat_normals(vertices, triangles))
    top = scenes.view_of(scene, 32, eye=(0.4, 0.3, 2.0))
    zeros = np.zeros((16, 3), np.float32)
    centre = np.linspace(-0.2, 0.2, 16)[:, None] * [1, 1, 0]
    up = (zeros + [0, 0, 1]).astype(np.float32)
    floor = GBuffer(
        np.ones((4, 4), bool),
        np.ones((4, 4), np.float32),
        centre.astype(np.float32),
        (centre + [0, 0, 2e-5]).astype(np.float32),
        up,
        up,
        up,
        np.zeros(16, np.int32),
        np.full((16, 3), 1 / 3, np.float32),
    )
    light = scenes.even_light()
    assert float(light_transport(scene, floor, [light], STANDARD, 0)[0].E.max()) < 1e-2
    assert float(light_transport(scene, top, [light], STANDARD, 0)[0].E.min()) > 0.7


def test_needles_are_lit_like_the_surface_they_make_up() -> None:
    """A square of 400 triangles, each a thousand times longer than wide."""
    x = np.linspace(-0.5, 0.5, 201)
    low, high = (np.stack([x, np.full(201, y), np.zeros(201)], -1) for y in (-0.5, 0.5))
    vertices = np.concatenate([low, high])
    i = np.arange(200)
    triangles = np.concatenate([np.stack([i, i + 1, i + 202], -1), np.stack([i, i + 202, i + 201], -1)])
    needles = Scene(vertices, triangles, np.tile(np.array([0.0, 0.0, 1.0]), (400, 3, 1)))
    points = scenes.view_of(needles, 48, eye=(0.6, 0.4, 1.6))
    t = light_transport(needles, points, [scenes.even_light()], STANDARD, 0)[0]
    assert float(t.E.min()) > 0.7  # no triangle shadows another
    assert float(t.E.std()) < 0.05


@pytest.mark.parametrize("scale", (1e-4, 1e4))
def test_scale_of_the_source_does_not_matter(scale: float, tmp_path: Path) -> None:
    scene = scenes.box_in_corner()
    results = []
    for factor in (1.0, scale):
        lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in scene.vertices.astype(np.float64) * factor]
        lines += [f"f {a} {b} {c}" for a, b, c in scene.triangles + 1]
        source = tmp_path / f"{factor:g}.obj"
        source.write_text("\n".join(lines))
        made = tmp_path / f"{factor:g}.npz"
        run_prep(source, made, PrepOptions())
        with np.load(made) as mesh:
            working = Scene(mesh["vertices"], mesh["triangles"], mesh["normals"])
        points = scenes.view_of(working, 48)
        results.append(light_transport(working, points, [scenes.sunny_light()], STANDARD, 0)[0])
    ours, scaled = (reinhard(light_maps(t)) for t in results)
    assert ours.shape == scaled.shape
    assert float((ours - scaled).square().mean().sqrt()) < 2e-3


def of_file(path: Path) -> Scene:
    """A mesh as prep makes it, but for UVs, which light does not see."""
    options, source = PrepOptions(), read_obj(path)
    working = repair(source, options.up, options.weld_tolerance, path)
    normals, _ = oriented(source, working, options.crease_angle)
    return Scene(working.vertices, working.triangles, normals)


def test_low_poly_posts_and_roof_have_no_black_facets(assets: Path) -> None:
    """gazebo.obj under an even light: what faces the sky and sees it is lit."""
    scene = of_file(assets / "meshes" / "gazebo.obj")
    points = scenes.view_of(scene, 96)
    t = light_transport(scene, points, [scenes.even_light()], STANDARD, 0)[0]
    hemisphere = open_share(scene, points)
    dark = (hemisphere > 0.5) & (t.E.numpy().max(-1) < 0.3)
    assert dark.mean() < 1e-3


def open_share(scene: Scene, points: GBuffer) -> NDArray[np.float64]:
    """Cosine-weighted share of the geometric hemisphere that is open, by 256 rays a point."""
    generator = np.random.default_rng(0)
    share = np.zeros(len(points.n))
    for _ in range(256):
        d = generator.normal(size=points.n.shape)
        d = points.ng + d / np.linalg.norm(d, axis=-1, keepdims=True)
        share += ~scene.occluded(points.origin, d.astype(np.float32))
    return share / 256


def test_open_surface_seen_from_behind(assets: Path) -> None:
    """plane_holes.obj: the back of a sheet is shaded as a surface that faces the viewer."""
    scene = of_file(assets / "meshes" / "plane_holes.obj")
    points = scenes.view_of(scene, 96, eye=(-1.5, 2.2, -1.3))
    assert ((points.n * points.wo).sum(-1) > 0).all()
    t = light_transport(scene, points, [scenes.even_light()], STANDARD, 0)[0]
    seen_open = open_share(scene, points) > 0.8
    assert seen_open.any()
    assert float(t.E[torch.from_numpy(seen_open)].min()) > 0.4


def test_a_million_triangles(assets: Path) -> None:
    import trimesh

    mesh = trimesh.load_mesh(assets / "meshes" / "nefertiti_1m.ply", process=False)
    vertices = (mesh.vertices - mesh.bounds.mean(0)) / np.ptp(mesh.bounds, axis=0).max()
    scene = Scene(vertices, mesh.faces, scenes.flat_normals(vertices, mesh.faces))
    points = scenes.view_of(scene, 96)
    few, many = (
        light_maps(light_transport(scene, points, [BUILTIN["studio"]()], QUALITY[q], 0)[0]) for q in ("standard", "high")
    )
    assert float((reinhard(few) - reinhard(many)).square().mean().sqrt()) < 0.015
