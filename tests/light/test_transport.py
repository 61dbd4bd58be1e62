"""The fast transport against the float64 reference, the white furnace, and lights and views that are hard."""

import numpy as np
import pytest
import torch

from stages.core.brdf import alpha_from_roughness, directional_albedo
from stages.core.color import reinhard
from stages.core.shading import F0, KNOTS, Transport
from stages.light.environment import Environment
from stages.light.gbuffer import GBuffer
from stages.light.light_set import light_set
from stages.light.lights import BUILTIN
from stages.light.reconstruction import Neighbours
from stages.light.reference import reference_transport
from stages.light.scene import Scene
from stages.light.terms import GLTF
from stages.light.transport import QUALITY, Quality, Round, add, light_transport, noisiest, trace
from tests.light import scenes


def stacked(transport: Transport) -> torch.Tensor:
    """E, A and B side by side: (P, 1 + 2 K, 3)."""
    return torch.cat([transport.E[:, None], transport.A, transport.B], 1).double()


def rmse_percent(scene: Scene, points: GBuffer, light: Environment, quality: Quality, subdivision: int) -> float:
    """Tone-mapped RMSE of all terms over up to 48 pixels, in percent."""
    pixels = np.random.default_rng(0).permutation(len(points.n))[:48]
    reference = stacked(reference_transport(scene, points, light, subdivision, pixels))
    fast = stacked(light_transport(scene, points, [light], quality, 0)[0][torch.from_numpy(pixels)])
    return float((reinhard(fast) - reinhard(reference)).square().mean().sqrt() * 100)


@pytest.fixture(scope="module", params=["sphere", "corner"])
def scene(request: pytest.FixtureRequest) -> Scene:
    return scenes.sphere(4) if request.param == "sphere" else scenes.box_in_corner()


def test_agrees_with_the_reference_under_a_sun(scene: Scene) -> None:
    points = scenes.view_of(scene, 24)
    assert rmse_percent(scene, points, scenes.sunny_light(), QUALITY["standard"], 6) < 1.0


def test_error_falls_with_rays() -> None:
    scene = scenes.box_in_corner()
    points = scenes.view_of(scene, 20)
    light = scenes.sunny_light()
    few, many = (rmse_percent(scene, points, light, Quality(n, n // 6), 6) for n in (24, 1536))
    assert many < 0.35 * few


def test_skull_under_a_sun(assets) -> None:  # type: ignore[no-untyped-def]
    import trimesh

    mesh = trimesh.load_mesh(assets / "meshes" / "skull.obj", process=False)
    vertices = mesh.vertices - mesh.bounds.mean(0)
    vertices = (vertices / np.ptp(vertices, axis=0).max())[:, [2, 0, 1]]
    scene = Scene(vertices, mesh.faces, mesh.vertex_normals[:, [2, 0, 1]][mesh.faces])
    points = scenes.view_of(scene, 32)
    assert rmse_percent(scene, points, scenes.sunny_light(), QUALITY["standard"], 6) < 1.0


@pytest.mark.parametrize("cosine", (0.05, 0.1, 0.3, 0.7, 1.0))
def test_white_furnace_at_knots(cosine: float) -> None:
    scene = scenes.sphere(1, 0.01)
    transport = light_transport(scene, scenes.open_point(cosine, 4), [scenes.even_light()], QUALITY["draft"], 1)[0]
    for k, roughness in enumerate(KNOTS):
        if roughness == 0:
            exact = 1.0
        else:
            exact = directional_albedo(np.array([cosine]), alpha_from_roughness(roughness), 700)[0, 1:].sum()
        assert (transport.A[:, k] + transport.B[:, k]).numpy() == pytest.approx(exact, abs=2e-3)


@pytest.mark.parametrize("cosine", (0.05, 0.3, 0.7, 1.0))
def test_dielectric_furnace(cosine: float) -> None:
    """E, and E + F0 A + B as a whole, equal their quadrature; each lobe by itself reflects no more than it receives.

    The sum itself passes 1 towards grazing (1.03 at N·V = 0.5, 1.7 at 0.05 for a mirror): glTF mixes its two lobes by
    the Fresnel weight at V·H, which is small for most of the diffuse lobe when it is large for the specular one.
    """
    points = scenes.open_point(cosine)
    t = light_transport(scenes.sphere(1, 0.01), points, [scenes.even_light()], QUALITY["standard"], 0)[0]
    for k, roughness in enumerate(KNOTS[1:], 1):
        E, A, B = directional_albedo(np.array([cosine]), alpha_from_roughness(roughness), 500)[0]
        assert float(t.E[0, 0] + F0 * t.A[0, k, 0] + t.B[0, k, 0]) == pytest.approx(E + F0 * A + B, abs=2e-3)
    assert float(t.E.max()) <= 1
    assert float((t.A + t.B).max()) <= 1 + 1e-6


def test_same_seed_same_bits_whatever_the_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scenes.box_in_corner()
    points = scenes.view_of(scene, 96)
    results = []
    for threads in (1, 3):
        for module in ("transport", "reconstruction", "light_set"):
            monkeypatch.setattr(f"stages.light.{module}.cores", lambda threads=threads: threads)
        results.append(stacked(light_transport(scene, points, [scenes.sunny_light()], QUALITY["draft"], 7)[0]))
    assert torch.equal(*results)


def test_environments_do_not_influence_each_other_in_the_mean() -> None:
    scene = scenes.sphere(3)
    points = scenes.view_of(scene, 24)
    other = Environment("another sun", 2 * np.roll(scenes.sunny_light().radiance, 50, 1))
    lights = [scenes.sunny_light(), scenes.even_light(), other]
    together = [reinhard(stacked(t)).mean() for t in light_transport(scene, points, lights, QUALITY["high"], 0)]
    apart = [light_transport(scene, points, [light], QUALITY["high"], 1)[0] for light in lights]
    alone = [reinhard(stacked(t)).mean() for t in apart]
    assert [float(t) for t in together] == pytest.approx([float(a) for a in alone], rel=5e-3)


def test_further_rays_serve_the_lights_that_need_them() -> None:
    """The sums of a light that asked for none stay what they were; the noise of the others falls."""
    even = Environment("even", np.ones((8, 16, 3), np.float32))
    scene = scenes.box_in_corner()
    points = scenes.view_of(scene, 64)
    near, more = Neighbours.of(points), Round(0.1, 3.0, 10.0, each=True)
    lights = light_set([even])
    assert not noisiest(trace(scene, points, lights, Quality(8, 4), 0), near, lights, GLTF, more).any()
    lights = light_set([even, scenes.sunny_light()])
    sums = trace(scene, points, lights, Quality(8, 4), 0)
    before = sums.mean.copy()
    wanted = noisiest(sums, near, lights, GLTF, more)
    assert not wanted[:, 0].any()  # it has no light rays
    assert wanted[:, 1].sum() == int(0.1 * len(points.n))
    rows = np.flatnonzero(wanted.any(1))
    found = trace(scene, points[rows], lights, Quality(24, 40), 1, GLTF, wanted[rows])
    add(sums, rows, found, wanted[rows] * np.float32(10))
    assert (sums.mean[..., :3] == before[..., :3]).all()
    truth = trace(scene, points[rows], lights, Quality(800, 800), 2).mean[:, 0, 3:6]
    error = [float(np.square(mean[rows, 0, 3:6] - truth).mean() ** 0.5) for mean in (before, sums.mean)]
    assert error[1] < 0.5 * error[0]
    assert (sums.rays == np.where(wanted, 11, 1)).all()


@pytest.mark.parametrize("make", [scenes.box_in_corner, lambda: scenes.sphere(4)])
def test_occlusion_is_that_there_is_a_hit(make) -> None:  # type: ignore[no-untyped-def]
    """The two trees agree, but for a ray in a million that meets an edge exactly."""
    scene, generator = make(), np.random.default_rng(4)
    origins = generator.uniform(-1, 1, (200_000, 3)).astype(np.float32)
    directions = generator.normal(size=origins.shape).astype(np.float32)
    occluded, hit = scene.occluded(origins, directions), scene.intersect(origins, directions).mask
    assert 0.05 < occluded.mean() < 0.95
    assert (occluded != hit).sum() <= 1


def test_a_narrow_lobe_shows_little_more_than_a_wide_lamp() -> None:
    scene, light = scenes.sphere(4), BUILTIN["studio"]()
    points = scenes.view_of(scene, 64)
    (transport,) = light_transport(scene, points, [light], QUALITY["standard"], 0)
    narrow = transport.A[:, 1] + transport.B[:, 1]  # a white lobe of roughness 0.08
    assert narrow.max() < 1.5 * light.radiance.max()  # 1.37; what light rays add is not divided
