"""Whose point of the surface a texel shows, told by a search through all triangles."""

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.core.tiles import Representatives, drawn, flat, repeats, signed_area, tiles


def square(low: tuple[float, float], size: float = 0.4) -> NDArray[np.float32]:
    """(2, 3, 2) a square of two triangles."""
    a, b, c, d = (np.array(low) + size * np.array(corner) for corner in ((0, 0), (1, 0), (1, 1), (0, 1)))
    return np.array([(a, b, c), (a, c, d)], np.float32)


def strewn(uv: NDArray, count: int = 400) -> tuple[NDArray, NDArray]:
    """Random points of the triangles."""
    rng = np.random.default_rng(1)
    return rng.integers(0, len(uv), count).astype(np.int32), rng.dirichlet((1, 1, 1), count)


def at(uv: NDArray, face: NDArray, weights: NDArray) -> NDArray[np.float64]:
    return np.einsum("pk,pkd->pd", weights, uv.astype(np.float64)[face])


def test_a_triangle_is_drawn_once_for_every_tile_that_it_lies_in() -> None:
    uv = np.concatenate([square((0.1, 0.1)), square((0.1, 1.1)), square((-0.2, 0.3)), square((0.6, 0.6), 0.4)])
    low, count = tiles(uv)
    assert low[::2].tolist() == [[0, 0], [0, 1], [-1, 0], [0, 0]]  # the last reaches the edge, and no farther
    assert count[::2].tolist() == [[1, 1], [1, 1], [2, 1], [1, 1]]
    copies = drawn(uv, np.zeros(8, np.int32))
    assert np.bincount(copies.face).tolist() == [1, 1, 1, 1, 2, 2, 1, 1]
    whole = copies.corners - uv[copies.face].astype(np.float64)
    assert (whole == np.rint(whole)).all()
    assert [repeats(part) for part in (uv[:2], uv[6:], uv[2:4], uv[4:6])] == [False, False, True, True]


@pytest.mark.parametrize("seed", range(3))
def test_representatives_against_a_search_through_all(seed: int) -> None:
    """Random triangles over four tiles: the first drawn that covers a point of the square represents it."""
    rng = np.random.default_rng(seed)
    uv = (rng.uniform(-1, 1, (40, 1, 2)) + rng.uniform(-0.4, 0.4, (40, 3, 2))).astype(np.float32)
    charts = rng.integers(0, 9, 40).astype(np.int32)
    face, weights = strewn(uv)
    found, theirs = Representatives(uv, charts, np.zeros(len(uv), np.int32)).of(face, weights)
    place, copies = at(uv, face, weights), drawn(uv, charts)
    for point, own, first in zip(place - np.floor(place), face, found, strict=True):
        t = copies.corners
        edges = np.roll(t, -1, 1) - t
        side = edges[..., 0] * (point[1] - t[..., 1]) - edges[..., 1] * (point[0] - t[..., 0])
        covers = np.flatnonzero((side > 0).all(1) | (side < 0).all(1))
        assert first in (own, copies.face[covers[0]])
        if first == own:
            assert charts[own] <= charts[copies.face[covers]].min()
    apart = at(uv, found, theirs) - place  # the same texel, some whole tiles away
    assert np.abs(apart - np.rint(apart)).max() < 1e-9


def test_a_mirrored_island_is_represented_by_the_other() -> None:
    uv = np.concatenate([square((0.1, 0.1)), square((0.1, 1.1))[:, ::-1]])
    face, weights = strewn(uv)
    found, theirs = Representatives(uv, np.array([1, 1, 0, 0], np.int32), np.zeros(len(uv), np.int32)).of(face, weights)
    assert (found >= 2).all()
    own = face >= 2
    assert (found[own] == face[own]).all()
    np.testing.assert_array_equal(theirs[own], weights[own])
    np.testing.assert_allclose(at(uv, found, theirs)[~own] - [0, 1], at(uv, face, weights)[~own], atol=1e-7)


def test_a_face_without_area_shows_the_texel_that_it_touches() -> None:
    inside, beside, apart = (np.full((1, 3, 2), place, np.float32) for place in ((0.3, 0.2), (0.5005, 0.3), (0.8, 0.8)))
    uv = np.concatenate([inside, beside, apart, square((0.1, 0.1))])
    assert flat(uv).tolist() == [True, True, True, False, False]
    none = np.zeros(5, np.int32)
    found, theirs = Representatives(uv, none, none).of(np.arange(3, dtype=np.int32), np.full((3, 3), 1 / 3))
    assert found[2] == 2
    np.testing.assert_allclose(at(uv, found, theirs), [(0.3, 0.2), (0.5, 0.3), (0.8, 0.8)], atol=1e-6)


def test_the_scale_is_that_of_the_texture_on_the_surface() -> None:
    uv = np.concatenate([square((0.1, 0.1)), square((0.1, 0.1))])
    area = np.abs(signed_area(uv)) * np.array([4, 4, 1, 1])
    found = Representatives(uv, np.array([0, 0, 1, 1], np.int32), np.zeros(len(uv), np.int32))
    face = np.array([2, 3, 0], np.int32)
    assert found.scale(area, face, found.of(face, np.full((3, 3), 1 / 3))[0]).tolist() == [2, 2, 1]


def test_textures_share_no_texels() -> None:
    """Two triangles of one place on textures of their own, and a third that lies on the second's."""
    uv = np.repeat(np.array([[[0.1, 0.1], [0.9, 0.1], [0.1, 0.9]]]), 3, 0)
    sets, middle = np.array([0, 1, 1], np.int32), np.full((3, 3), 1 / 3)
    found, _ = Representatives(uv, np.arange(3, dtype=np.int32), sets).of(np.arange(3, dtype=np.int32), middle)
    assert found.tolist() == [0, 1, 1]
