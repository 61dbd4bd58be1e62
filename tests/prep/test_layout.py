"""Which layouts are kept: those that give texels to the surface, in whatever way artists lay them out."""

import numpy as np
from numpy.typing import NDArray

from stages.prep.layout import keep, sound, unusable, with_neighbours
from tests.prep.test_uv import grid

GRID = grid(8, 0.1, 0.5).astype(np.float32)  # 128 faces


def apart(uv: NDArray) -> NDArray[np.int64]:
    """(F, 3) vertices of triangles of which none hangs together with another but by its UVs' places."""
    return np.unique(uv.reshape(-1, 2), axis=0, return_inverse=True)[1].reshape(-1, 3)


def told(uv: NDArray, area: NDArray | None = None) -> str | None:
    return unusable(apart(uv), uv.astype(np.float32), np.ones(len(uv)) if area is None else area, np.zeros(len(uv), int))


def stacked(*layouts: NDArray) -> tuple[NDArray, NDArray]:
    """Vertices (F, 3) and UVs of layouts on pieces of their own."""
    parts = [apart(uv) for uv in layouts]
    first = np.cumsum([0, *(int(part.max()) + 1 for part in parts)])
    return np.concatenate([part + start for part, start in zip(parts, first, strict=False)]), np.concatenate(layouts)


def kept(triangles: NDArray, uv: NDArray, missing: NDArray | None = None) -> tuple[NDArray, bool, str]:
    area = np.ones(len(uv))
    assert unusable(triangles, uv, area, np.zeros(len(uv), int)) is None
    found = keep(triangles, uv, area, np.zeros(len(uv), int), np.zeros(len(uv), bool) if missing is None else missing)
    return found.chart, found.shared, "; ".join(found.told)


def test_a_layout_on_the_unit_square_is_kept_without_a_word() -> None:
    chart, shared, words = kept(apart(GRID), GRID)
    assert (set(chart.tolist()), shared, words) == ({0}, False, "kept")


def test_one_tile_up_and_across_a_border_is_told() -> None:
    _, shared, words = kept(apart(GRID), GRID + np.float32((0, 1)))
    assert not shared
    assert words == "kept; 128 of 128 faces outside the unit square, whose textures repeat"
    _, shared, words = kept(apart(GRID), GRID - np.float32((0.3, 0)))
    assert not shared
    assert "64 of 128 faces outside" in words


def test_a_few_faces_without_area_or_uvs_are_told_and_many_a_reason() -> None:
    lost = np.full((2, 3, 2), 0.3, np.float32)
    triangles, uv = stacked(GRID, lost)
    missing = np.arange(130) == 129
    _, shared, words = kept(triangles, uv, missing)
    assert shared
    assert "1 of 130 faces without area in UV" in words
    assert "1 of 130 faces without UVs" in words
    triangles, uv = stacked(GRID, np.full((4, 3, 2), 0.3, np.float32))
    assert told(uv) == "0 of 132 faces have none and 4 no area: 3.03 % of the surface would have no texels"
    assert told(uv, np.where(np.arange(132) < 128, 1, 0.1)) is None
    uv[-2:] = np.nan
    assert told(uv) == "2 of 132 faces have none and 2 no area: 3.03 % of the surface would have no texels"
    assert told(uv * np.nan) == "none in the file"


def test_stacked_and_mirrored_islands_share_and_the_largest_represents() -> None:
    small, mirrored = grid(6, 0.1, 0.3).astype(np.float32), GRID[:, ::-1]
    chart, shared, words = kept(*stacked(small, mirrored, GRID))
    assert shared
    assert chart.reshape(-1).tolist() == [2] * 72 + [0] * 128 + [1] * 128
    assert "100 % of the texels are shared by stacked, mirrored or repeated islands" in words
    _, shared, _ = kept(*stacked(GRID, GRID + np.float32((0.41, 0))))
    assert not shared


def test_a_half_that_is_mirrored_at_its_seam_is_a_chart_of_its_own() -> None:
    """Both halves share the seam's vertices and UVs."""
    x = np.minimum(GRID[..., 0], 0.6 - GRID[..., 0])  # folded at 0.3
    folded = np.stack([x, GRID[..., 1]], -1)
    chart, shared, _ = kept(apart(GRID), folded)
    assert shared
    side = GRID.mean(1)[:, 0] > 0.3
    assert {tuple(pair) for pair in np.stack([chart, side], 1).tolist()} in ({(0, 0), (1, 1)}, {(0, 1), (1, 0)})


def test_a_layout_that_repeats_too_often_is_not_kept() -> None:
    assert told(GRID * 4) is None
    assert told(GRID * 8) == "islands go through 10 tiles each: little of the texture would be a place's own"
    alike = stacked(*[GRID] * 24)
    assert unusable(*alike, np.ones(len(alike[1])), np.zeros(len(alike[1]), int)) is None  # two dozen of one kind
    area = np.repeat(np.geomspace(1, 400, 24), 128)
    assert "of many sizes cover the same texels 24 times" in (unusable(*alike, area, np.zeros(len(area), int)) or "")


def test_polygons_without_uvs_take_one_texel_of_a_neighbour() -> None:
    triangles = np.array([(0, 1, 2), (2, 1, 3), (3, 1, 4), (5, 6, 7)])
    polygon = np.array([0, 1, 1, 2])
    uv = np.random.default_rng(0).random((4, 3, 2)).astype(np.float32)
    holes = uv.copy()
    holes[1:] = np.nan
    filled = with_neighbours(holes, triangles, polygon)
    assert np.array_equal(filled[0], uv[0])
    assert (filled[1:3] == uv[0, 1]).all()  # vertex 1 is the first that the polygon shares
    assert (filled[3] == uv[0, 0]).all()
    one = uv.copy()
    one[1, 2] = np.nan
    assert np.array_equal(with_neighbours(one, triangles, polygon)[1], [uv[1, 0], uv[1, 1], uv[1, 0]])


def test_a_face_at_the_end_of_the_world_is_one_without_uvs() -> None:
    """No copies are made of it, however many tiles it goes through."""
    triangles, uv = stacked(GRID, GRID[:2])
    uv = uv.copy()
    uv[-1, 0], uv[-2, 0] = (3e38, -3e38), (1e5, 1e5)
    assert np.isnan(sound(uv)[-2:]).all()
    assert np.array_equal(sound(uv)[:-2], GRID)
    assert unusable(triangles, uv, np.ones(130), np.zeros(130, int)) is None
    wide = GRID.copy()
    wide[:, 0] += np.float32(40)
    many = np.concatenate([np.tile(wide, (40, 1, 1)), GRID])
    assert "faces go through" in (told(many, np.repeat([1e-12, 1], [5120, 128])) or "")
