"""Filling: unseen surface from seen surface nearby, and padding to the last texel."""

import numpy as np

from stages.bake.fill import fill_groups, fill_unseen, pad
from stages.bake.raster import Layout, touched_texels
from stages.bake.visibility import Views, is_open, patches, seen_points
from stages.core.frames import look_at
from stages.light.scene import Scene
from tests.bake.examples import cube, grid, prep_arrays, ring_of_cameras


def views(elevation: float, count: int = 8) -> Views:
    return Views(ring_of_cameras(count, elevation), np.full(count, 0.7), 64, 64)


def test_padding_gives_every_texel_the_nearest_chart() -> None:
    """Two charts: within and beyond 16 texels, up to the corners, a texel has the colour of the nearer one."""
    on_chart = np.zeros((96, 128), bool)
    on_chart[40:50, 20:30] = on_chart[60:64, 90:100] = True
    maps = np.zeros((96, 128, 2), "f4")
    maps[40:50, 20:30], maps[60:64, 90:100] = (1, 0), (0, 1)
    pad(on_chart, maps)
    y, x = np.mgrid[:96, :128]

    def distance(top: int, bottom: int, left: int, right: int) -> np.ndarray:
        return np.hypot(np.clip(top - y, 0, None) + np.clip(y - bottom, 0, None),
                        np.clip(left - x, 0, None) + np.clip(x - right, 0, None))  # fmt: skip

    first, second = distance(40, 49, 20, 29), distance(60, 63, 90, 99)
    assert (maps[first < second] == (1, 0)).all()
    assert (maps[second < first] == (0, 1)).all()
    assert (maps.sum(2) == 1).all()


def test_padding_without_any_chart_changes_nothing() -> None:
    maps = np.zeros((4, 4, 1), "f4")
    pad(np.zeros((4, 4), bool), maps)
    assert (maps == 0).all()


def test_unseen_points_take_what_is_near_and_faces_the_same_way() -> None:
    rng = np.random.default_rng(0)
    x = rng.uniform(-0.5, 0.5, (400, 1))
    sheet = np.c_[x, rng.uniform(-0.5, 0.5, (400, 1)), np.zeros((400, 1))].astype("f4")
    above, below = np.tile([0, 0, 1], (400, 1)).astype("f4"), np.tile([0, 0, -1], (400, 1)).astype("f4")
    position, normal = np.concatenate([sheet, sheet - (0, 0, 0.01)]).astype("f4"), np.concatenate([above, below])
    values = np.concatenate([sheet[:, :1] + 10, np.full((400, 1), -10)]).astype("f4")
    wanted = (sheet[:50] + (0.004, 0, -0.005)).astype("f4")
    filled = fill_unseen((position, normal), values, (wanted, above[:50]))
    # neighbours lie within 0.15 of each other; the other side, 20 lower, has a thousandth of the weight, 8 times
    assert np.abs(filled[:, 0] - 10 - wanted[:, 0]).max() < 0.15 + 20 * 8e-3


def test_unseen_points_on_a_seen_one_take_its_value() -> None:
    position = np.array([[0, 0, 0], [1, 0, 0]], "f4")
    normal = np.array([[0, 0, 1], [0, 0, 1]], "f4")
    filled = fill_unseen((position, normal), np.array([[1.0], [2.0]], "f4"), (position, normal))
    np.testing.assert_allclose(filled, [[1], [2]], atol=1e-6)


def test_groups_are_filled_as_their_points_alone_are() -> None:
    """A finely seen sphere and groups of four points each, a hundredth apart, of which one searches for all."""
    rng = np.random.default_rng(0)
    normal = rng.normal(size=(4000, 3)).astype("f4")
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    values = (normal @ rng.normal(size=(3, 5))).astype("f4")
    seen, facing = (0.4 * normal, normal), normal[:200].repeat(4, 0)
    wanted = (0.42 * facing + rng.uniform(-0.005, 0.005, facing.shape)).astype("f4")
    exact = fill_unseen(seen, values, (wanted, facing))
    alone, group = np.arange(800), np.arange(200).repeat(4)
    np.testing.assert_allclose(fill_groups(seen, values, (wanted, facing), alone, alone), exact, atol=1e-5)
    np.testing.assert_allclose(fill_groups(seen, values, (wanted, facing), 4 * np.arange(200), group), exact, atol=1e-5)


def seen_of(example, cameras: Views, size: int = 64):  # type: ignore[no-untyped-def]
    """Triangle and sight of each texel on a chart."""
    arrays = prep_arrays(example)
    touched = touched_texels(Layout.of(arrays["uv"], size))
    surface = touched.where(touched.triangle >= 0)
    scene = Scene(arrays["vertices"], arrays["triangles"], arrays["normals"])
    groups = patches(touched, arrays["charts"])
    seen = seen_points(scene, surface[groups.first], cameras, is_open(arrays["triangles"]))
    return scene, surface, seen[groups.of_texel]


def test_cameras_above_a_cube_see_all_but_its_bottom() -> None:
    scene, surface, seen = seen_of(cube(), views(0.5))
    down = scene.geometric_normal(surface.triangle)[:, 2] < -0.5
    assert down.any() and not seen[down].any()
    assert seen[~down].all()


def test_a_step_hides_what_lies_behind_it() -> None:
    """One low camera on +x; a wall across the sheet hides exactly the shadow that similar triangles give."""
    wall = grid(64, lambda x, y: 0.2 * (np.abs(x - 0.5) < 0.01))
    eye = np.array([[2.0, 0.0, 0.6]])
    camera = Views(look_at(eye, np.zeros(3), np.array([0.0, 0, 1])), np.array([0.9]), 64, 64)
    scene, surface, seen = seen_of(wall, camera, 128)
    point = scene.point(surface.triangle, np.c_[surface.barycentric, 1 - surface.barycentric.sum(1)])
    shadow = 2.0 - 2.0 * 0.6 / (0.6 - 0.2)  # x where the ray over the crest at x = 0 meets the ground: -1
    assert shadow < -0.5  # all of the sheet behind the wall is hidden
    behind, before = point[:, 0] < -0.03, point[:, 0] > 0.03
    assert not seen[behind].any()
    assert seen[before].all()


def test_the_back_of_an_open_sheet_is_seen_from_below() -> None:
    _, _, seen = seen_of(grid(2), views(-0.5))
    assert seen.all()


def test_no_camera_sees_nothing() -> None:
    _, _, seen = seen_of(cube(), views(0.5, count=0))
    assert not seen.any()


def test_open_and_closed_meshes_are_told_apart() -> None:
    assert is_open(prep_arrays(grid(2))["triangles"])
    assert not is_open(prep_arrays(cube())["triangles"])
