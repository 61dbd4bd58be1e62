"""The preview: clean light, filtered textures, and cameras and light that others can repeat."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion, uniform_filter
from scipy.stats import norm

from stages.bake import preview
from stages.bake.page import pictures
from stages.bake.preview import Look, draw_view, edges, footprint, rougher
from stages.bake.studio import EXPOSURE, FOV_Y, camera, cameras, write_studio
from stages.core.artifact import load_npz
from stages.core.color import luminance, srgb_encode
from stages.core.frames import Y_UP_TO_WORLD, Z_UP_TO_WORLD, camera_rays, project
from stages.core.schemas import PREP
from stages.light.emission import Emission
from stages.light.environment import load_environment, lookup
from stages.light.gbuffer import surface_points
from stages.light.lights import preview_light
from stages.light.lookup import Texture
from stages.light.normal_maps import NormalMap, NormalMaps
from stages.light.scene import Scene
from stages.light.transport import Quality
from tests.bake.examples import cube, save_prep
from tests.light import scenes


def sheet(bumps: NormalMaps | None = None) -> Scene:
    """The square |x|, |y| <= 1/2 at z = 0."""
    vertices = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]], "f4")
    normals = np.broadcast_to(np.array([0, 0, 1], "f4"), (2, 3, 3))
    return Scene(vertices, np.array([[0, 1, 2], [0, 2, 3]], "i4"), normals, bumps)


def sheet_uv(scene: Scene) -> np.ndarray:
    return (scene.vertices[scene.triangles][..., :2] * (1, -1) + 0.5).astype("f4")


def test_a_footprint_is_what_the_next_ray_hits() -> None:
    """On a plane seen at a slant the edge of a patch leads to the neighbouring pixel's hit."""
    scene, size = sheet(), 64
    c2w = camera(scene.vertices.astype(float), 30, 50)
    directions = camera_rays(c2w, FOV_Y, size, size)[1]
    hits = scene.intersect(np.broadcast_to(c2w[:3, 3], directions.shape), directions)
    mask = hits.mask.reshape(size, size)
    points = surface_points(scene, hits, directions, mask)
    across = footprint(scene, points, directions[hits.mask], c2w, 2 * np.tan(FOV_Y / 2) / size)
    corners = scene.vertices[scene.triangles[points.triangle]]
    assert across.sum(2) == pytest.approx(0, abs=1e-6)
    moved = np.einsum("pek,pkd->ped", across, corners)
    index = np.full(mask.shape, -1)
    index[mask] = np.arange(mask.sum())
    right = np.argwhere((index[:, :-1] >= 0) & (index[:, 1:] >= 0))
    here, there = index[right[:, 0], right[:, 1]], index[right[:, 0], right[:, 1] + 1]
    step = points.point[there] - points.point[here]
    assert np.abs(moved[here, 0] - step).max() < 0.03 * np.linalg.norm(step, axis=1).mean()


def worn(scene: Scene, uv: NDArray, maps: NDArray) -> Look:
    """A mesh with one texture set."""
    return Look(scene, uv, [maps], np.zeros(len(uv), "i4"))


def test_edges_lead_as_far_as_their_vectors() -> None:
    """Of vectors in the planes of a ball's triangles; one without area leads nowhere."""
    ball, rng = scenes.sphere(2), np.random.default_rng(0)
    vertices = np.concatenate([ball.vertices, ball.vertices[:1]])
    triangles = np.concatenate([ball.triangles, [[0, 1, len(ball.vertices)]]]).astype("i4")
    scene = Scene(vertices, triangles, np.zeros((len(triangles), 3, 3), "f4"))
    corners = vertices[triangles].astype(float)
    u, v = rng.normal(size=(2, len(triangles), 2, 1))
    across = u * (corners[:, 1] - corners[:, 0])[:, None] + v * (corners[:, 2] - corners[:, 0])[:, None]
    found = edges(scene, np.arange(len(triangles)), across)
    np.testing.assert_allclose(found[:-1], np.concatenate([-u - v, u, v], 2)[:-1], atol=1e-5)
    assert (found[-1] == 0).all()


def test_detail_of_one_texel_does_not_flicker() -> None:
    """A checkerboard of single texels in a small picture is even grey."""
    scene = sheet()
    maps = np.zeros((512, 512, 5), "f4")
    maps[..., :3] = (np.indices((512, 512)).sum(0) % 2)[..., None]
    picture = draw_view(worn(scene, sheet_uv(scene), maps), preview_light(), camera(scene.vertices.astype(float), 20, 60), 24)
    inside = picture.alpha & np.roll(picture.alpha, 1, 0) & np.roll(picture.alpha, -1, 0)
    assert picture.material[inside, 0] == pytest.approx(0.5, abs=0.05)


SEEN = 0.01
"""Weber's threshold: neighbours whose luminance differs by less look alike."""

BESIDE_OTHERS = 10 ** (-35 / 20)
"""Root mean square difference from another renderer at 35 dB, the least that is asked for."""


def test_light_has_no_dots(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ball beside one drawn with thirty times the rays: pixels are off with their neighbours, by as much as they are.

    What a pixel is off by more than the nine around it is a dot: by less than the eye sees on the whole, and no pixel by more
    than chance has it among so many. All noise together takes a tenth at most of the error that other renderers are allowed.
    """
    ball = scenes.sphere(4)
    look = worn(ball, np.full((len(ball.triangles), 3, 2), 0.5, "f4"), np.full((2, 2, 5), 0.5, "f4"))
    view, size = camera(ball.vertices.astype(float), 45, 18), 40
    picture = draw_view(look, preview_light(), view, size)
    monkeypatch.setattr(preview, "RAYS", Quality(lobe=700, light=250, extra=False))
    found, exact = (one.over(np.zeros(3, "f4")) for one in (picture, draw_view(look, preview_light(), view, size)))
    whole = picture.alpha.reshape(size, 2, size, 2).all((1, 3))
    off = np.where(whole, luminance(found) / np.where(whole, luminance(exact), 1) - 1, 0)
    dots = (off - uniform_filter(off, 3))[binary_erosion(whole, np.ones((3, 3)))]
    assert np.sqrt(np.square(dots).mean()) < SEEN
    assert np.abs(dots).max() < SEEN * norm.isf(0.005 / dots.size)
    assert np.square(srgb_encode(found) - srgb_encode(exact))[whole].mean() < BESIDE_OTHERS**2 / 10


def test_bumps_too_fine_to_see_make_the_surface_rougher() -> None:
    """A map of opposite slopes: the mean normal is straight, and what the slopes scattered goes into the roughness."""
    slopes = np.zeros((512, 512, 3), "f4")
    slopes[..., 0] = 0.3 * np.where(np.arange(512) % 2, 1, -1)
    slopes[..., 2] = np.sqrt(1 - 0.09)
    scene = sheet()
    uv, frames = sheet_uv(scene), np.broadcast_to(np.array([1, 0, 0, 1], "f4"), (2, 3, 4))
    bumps = NormalMaps([NormalMap(slopes)], np.zeros(2, "i4"), uv, frames)
    weights = np.full((1, 3), 1 / 3, "f4")
    across = np.array([[[-0.1, 0.1, 0], [0, -0.1, 0.1]]])
    n, length = bumps.filtered(np.array([[0, 0, 1.0]]), np.zeros(1, int), weights, across)
    assert n[0] == pytest.approx([0, 0, 1], abs=0.02)
    assert length[0] == pytest.approx(np.sqrt(1 - 0.09), abs=0.01)
    assert rougher(np.float32([0.2, 0.2]), np.float32([0, 0.05])) == pytest.approx([0.2, 0.1016**0.25], rel=1e-4)
    look = worn(scene.bumped(bumps), uv, np.full((2, 2, 5), 0.5, "f4"))
    flat, bumpy = (draw_view(one, preview_light(), camera(scene.vertices.astype(float), 125, 28), 16).color
                   for one in (replace(look, scene=scene), look))  # fmt: skip
    assert bumpy.max() < 0.9 * flat.max()  # the mirrored sun is spread out


def test_what_shines_is_added_once_and_filtered_by_footprint() -> None:
    """Over the same picture without it: the radiance, exposed; of a glowing checkerboard of single texels, its mean.

    A sample shows some twenty texels along each of its edges, of which one at either end counts in part: a tenth.
    """
    scene = sheet()
    uv, even = sheet_uv(scene), np.array([[[2.0, 0.5, 0.25]]], "f4")
    checks = even * (np.indices((512, 512)).sum(0) % 2)[..., None].astype("f4")
    view = camera(scene.vertices.astype(float), 20, 60)
    dark = draw_view(worn(scene, uv, np.full((2, 2, 5), 0.5, "f4")), preview_light(), view, 16)
    inside = dark.alpha & np.roll(dark.alpha, 1, 0) & np.roll(dark.alpha, -1, 0)
    for image, most in ((even, 1e-5), (checks, 0.1)):
        shining = Scene(scene.vertices, scene.triangles, scene.normals, None, Emission([Texture(image)], np.zeros(2, "i4"), uv))
        picture = draw_view(worn(shining, uv, np.full((2, 2, 5), 0.5, "f4")), preview_light(), view, 16)
        added = picture.color - dark.color
        assert np.abs(added[inside] / (image.mean((0, 1)) * EXPOSURE) - 1).max() < most
        assert (added[~dark.alpha] == 0).all()


def test_only_what_is_told_to_shines() -> None:
    """One triangle of two, and the other's light is as it was: what shines lights nothing else."""
    scene = sheet()
    uv, view = sheet_uv(scene), camera(scene.vertices.astype(float), 20, 60)
    glow = Emission([Texture(np.ones((1, 1, 3), "f4"))], np.array([0, -1], "i4"), uv)
    maps = np.full((2, 2, 5), 0.5, "f4")
    shining = Scene(scene.vertices, scene.triangles, scene.normals, None, glow)
    dark, lit = (draw_view(worn(one, uv, maps), preview_light(), view, 16) for one in (scene, shining))
    directions = camera_rays(view, FOV_Y, 32, 32)[1]
    hits = scene.intersect(np.broadcast_to(view[:3, 3], directions.shape), directions)
    first = (hits.triangle == 0).reshape(32, 32)
    assert (lit.color - dark.color)[first] == pytest.approx(EXPOSURE, abs=1e-5)
    assert (lit.color == dark.color)[~first].all()


@pytest.mark.parametrize("up", (Y_UP_TO_WORLD, Z_UP_TO_WORLD))
def test_cameras_see_the_model_where_the_picture_shows_it(tmp_path: Path, up: np.ndarray) -> None:
    """The corners of a turned, scaled source, brought to glTF's frame, lie in preview.json's view as ours in our own."""
    move = up.copy()
    move[:3, :3] *= 0.25
    move[:3, 3] = (0.1, -0.2, 0.05)
    mesh = load_npz(save_prep(tmp_path / "prep.npz", cube().with_(to_world=move)), PREP)
    assert write_studio(tmp_path, mesh, 64) == ["preview.json", "preview_light.exr"]
    said = json.loads((tmp_path / "preview.json").read_text())
    assert said["bounces"] == 0
    to_gltf = np.eye(4)
    to_gltf[:3, :3] = Y_UP_TO_WORLD[:3, :3].T @ up[:3, :3]
    model = trimesh.transform_points(mesh["source_vertices"], to_gltf)
    for given, own in zip(said["views"], cameras(mesh["vertices"], mesh["triangles"]), strict=True):
        c2w = np.array(given["c2w"])
        assert c2w[:3, :3] @ c2w[:3, :3].T == pytest.approx(np.eye(3), abs=1e-9)
        ours, _ = project(mesh["vertices"], own, FOV_Y, 64, 64)
        assert project(model, c2w, said["fov_y"], 64, 64)[0] == pytest.approx(ours, abs=1e-3)


def test_the_light_is_turned_as_three_and_blender_read_it(tmp_path: Path) -> None:
    """Its middle column lies towards glTF's +x, and u grows from +x to +z."""
    mesh = load_npz(save_prep(tmp_path / "prep.npz", cube()), PREP)
    write_studio(tmp_path, mesh, 64)
    read = load_environment(tmp_path / "preview_light.exr")[0].radiance
    world = np.random.default_rng(0).normal(size=(200, 3))
    world /= np.linalg.norm(world, axis=1, keepdims=True)
    x, y, z = (world @ Y_UP_TO_WORLD[:3, :3]).T  # glTF's
    column = (np.arctan2(z, x) / (2 * np.pi) + 0.5) * read.shape[1]
    row = np.arccos(y) / np.pi * read.shape[0]
    nearest = read[np.clip(row.astype(int), 0, len(read) - 1), column.astype(int) % read.shape[1]]
    assert nearest == pytest.approx(lookup(preview_light().radiance, world), rel=0.2, abs=0.05)


def test_an_outline_is_as_smooth_as_the_object_s() -> None:
    """The share of each pixel that a ball covers, beside 1,024 points a pixel; four points alone are off by 0.1 and more."""
    ball, size = scenes.sphere(4), 32
    view = camera(ball.vertices.astype(float), 45, 18)

    def hits(across: int) -> NDArray:
        origins, directions = camera_rays(view, FOV_Y, across, across)
        return ball.intersect(origins, directions).mask.reshape(size, across // size, size, across // size)

    exact, few = hits(32 * size).mean((1, 3)), hits(2 * size)
    found = preview.covered(ball, few.reshape(2 * size, 2 * size, 1).astype("f4"), view)[..., 0]
    outline = (exact > 0) & (exact < 1) & few.any((1, 3))
    assert outline.sum() > 50
    assert np.sqrt(np.square(few.mean((1, 3)) - exact)[outline].mean()) > 0.08
    assert np.sqrt(np.square(found - exact)[outline].mean()) < 0.03
    assert (found[exact == 1] == 1).all() and (found[exact == 0] == 0).all()


def test_a_large_picture_is_drawn_in_tiles_without_seams(monkeypatch: pytest.MonkeyPatch) -> None:
    ball = scenes.sphere(3)
    look = worn(ball, np.full((len(ball.triangles), 3, 2), 0.5, "f4"), np.full((2, 2, 5), 0.5, "f4"))
    view = camera(ball.vertices.astype(float), 45, 18)
    whole = draw_view(look, preview_light(), view, 40)
    monkeypatch.setattr(preview, "TILE", 32)
    cut = draw_view(look, preview_light(), view, 40)
    assert (whole.alpha == cut.alpha).all()
    assert np.abs(srgb_encode(whole.over(np.zeros(3, "f4"))) - srgb_encode(cut.over(np.zeros(3, "f4")))).max() < 8 / 255


def test_what_the_object_throws_on_itself_is_drawn() -> None:
    """A corner whose floor is red and whose walls are white: with bounces the walls are redder; a sphere draws as before."""
    scene = scenes.box_in_corner()
    uv = np.zeros((len(scene.triangles), 3, 2), "f4")
    flat = np.abs(scene.geometric_normal(np.arange(len(uv)))[:, 2]) > 0.5
    uv[:, :, 0] = np.where(flat, 0.25, 0.75)[:, None]
    maps = np.array([[[0.8, 0.05, 0.05, 0.8, 0], [0.8, 0.8, 0.8, 0.8, 0]]], "f4").repeat(2, 0)
    look, light, c2w = worn(scene, uv, maps), preview_light(), camera(scene.vertices.astype(float), 30, 25)
    direct, bounced = (draw_view(look.under([light], bounces), light, c2w, 48) for bounces in (0, 2))
    walls = direct.alpha & (direct.material[..., 2] > 0.5)
    red, blue = ((bounced.color - direct.color)[walls][:, channel].mean() for channel in (0, 2))
    assert red > 1.3 * blue > 0 and bounced.color.max() < 1.5 * direct.color.max()
    ball = scenes.sphere(3)
    assert worn(ball, np.zeros((len(ball.triangles), 3, 2), "f4"), maps).under([light], 2).thrown is None


def test_pictures_of_the_page_show_what_the_object_throws_on_itself() -> None:
    """A white corner is brighter with bounces under both of the lights, and the same from behind, where it is convex."""
    scene = scenes.box_in_corner()
    maps = np.full((2, 2, 5), (0.8, 0.8, 0.8, 0.8, 0), "f4")
    look = worn(scene, np.zeros((len(scene.triangles), 3, 2), "f4"), maps)
    direct, bounced = (pictures(look, 32, bounces) for bounces in (0, 2))
    grown = {shot.caption: (other.pixels - shot.pixels).mean() for shot, other in zip(direct, bounced, strict=True)}
    assert len(grown) == 4 and all((more > 0.02) if "front" in name else (more == 0) for name, more in grown.items())

