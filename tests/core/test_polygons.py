"""Polygons cut into triangles cover exactly the polygon."""

import numpy as np
import pytest

from stages.core.polygons import triangulate


def areas(corners: np.ndarray, loops: np.ndarray) -> np.ndarray:
    a, b, c = (corners[loops[:, k]] for k in range(3))
    return np.cross(b - a, c - a)[:, 2] / 2


def test_convex_polygons_become_fans_in_order() -> None:
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
    loops, face = triangulate(np.array([0, 3, 7]), corners)
    assert loops.tolist() == [[0, 1, 2], [3, 4, 5], [3, 5, 6]]
    assert face.tolist() == [0, 1, 1]


@pytest.mark.parametrize("shift", range(6))
@pytest.mark.parametrize("axes", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
def test_a_concave_polygon_is_covered_once(shift: int, axes: tuple[int, int, int]) -> None:
    """An L begun at any corner, in any plane: all triangles face its way and their areas add up to its own."""
    outline = np.array([(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (0, 2, 0)], float)
    corners = np.roll(outline, shift, 0)
    loops, _ = triangulate(np.array([0, 6]), corners[:, axes])
    signed = areas(corners, loops)
    assert (signed > 0).all() and signed.sum() == pytest.approx(3.0)


def test_a_concave_polygon_wound_clockwise_stays_so() -> None:
    corners = np.array([(0, 0, 0), (0, 2, 0), (1, 2, 0), (1, 1, 0), (2, 1, 0), (2, 0, 0)], float)
    loops, _ = triangulate(np.array([0, 6]), corners)
    assert (areas(corners, loops) < 0).all() and areas(corners, loops).sum() == pytest.approx(-3.0)


def test_repeated_corners_and_crossing_outlines_end() -> None:
    """Hundreds of repeated corners, and a bow tie: n - 2 triangles each, of corners of their own polygon."""
    corners = np.concatenate([np.tile([(0.0, 0, 0), (1, 0, 0), (1, 1, 0)], (150, 1)),
                              [(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0)]])  # fmt: skip
    loops, face = triangulate(np.array([0, 450, 454]), corners)
    assert np.bincount(face).tolist() == [448, 2]
    assert loops[face == 0].max() < 450 <= loops[face == 1].min()
