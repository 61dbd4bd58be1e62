"""Polygons cut into triangles cover exactly the polygon."""

from collections.abc import Callable

import numpy as np
import pytest

from stages.core.polygons import clip_ears, triangulate


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


def star(corners: int, seed: int) -> np.ndarray:
    """A polygon whose corners lie at random distances from its centre, in a tilted plane."""
    angle, radius = np.arange(corners) / corners * 2 * np.pi, 0.2 + np.random.default_rng(seed).random(corners)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.3 * radius * np.cos(angle)], -1)


def spiral(corners: int) -> np.ndarray:
    """A band wound round its centre twenty times."""
    angle = np.linspace(0, 40 * np.pi, corners // 2)
    outer, inner = (np.stack([r * np.cos(angle), r * np.sin(angle), 0 * r], -1) for r in (3 + angle, 1 + angle))
    return np.concatenate([outer, inner[::-1]])


@pytest.mark.parametrize("corners", [star(5, 1), star(40, 2), star(300, 3), spiral(400)], ids=len)
def test_the_compiled_form_covers_what_the_plain_one_does(corners: np.ndarray) -> None:
    """Every corner is used, all triangles face one way, and together they have the polygon's area."""
    loops, _ = triangulate(np.array([0, len(corners)]), corners)
    plain = clip_ears(corners)
    assert plain is not None and len(plain) == len(loops) == len(corners) - 2
    for cut in (loops, plain):
        assert (np.unique(cut) == np.arange(len(corners))).all()
        assert (areas(corners, cut) > 0).all() or (areas(corners, cut) < 0).all()
    assert areas(corners, loops).sum() == pytest.approx(areas(corners, plain).sum())


@pytest.mark.parametrize("shape", [lambda: star(20_000, 1), lambda: spiral(20_000)], ids=["star", "spiral"])
def test_polygons_of_many_corners_are_cut(shape: Callable[[], np.ndarray]) -> None:
    corners = shape()
    loops, _ = triangulate(np.array([0, len(corners)]), corners)
    around = np.cross(corners, np.roll(corners, -1, 0))[:, 2].sum() / 2
    assert np.abs(areas(corners, loops)).sum() == pytest.approx(abs(around))


def test_many_concave_polygons_are_cut() -> None:
    """Thirty thousand arrows, each with a corner turned in."""
    arrow = np.array([(0.3, 0.5, 0), (0, 0, 0), (1, 0.5, 0), (0, 1, 0)])
    corners = (arrow + np.arange(30_000)[:, None, None]).reshape(-1, 3)
    loops, _ = triangulate(np.arange(0, 120_001, 4), corners)
    assert (areas(corners, loops) > 0).all() and areas(corners, loops).sum() == pytest.approx(30_000 * 0.35)
