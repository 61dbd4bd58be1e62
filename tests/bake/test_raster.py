"""The rasteriser against a slow, obvious form of the same."""

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.bake.raster import Layout, covered_samples, touched_texels

SIZE = 16


def random_triangles(seed: int, count: int = 40) -> NDArray[np.float32]:
    """Triangles (F, 3, 2) in UV: from slivers and dust to ones that cover a third of it, some reaching out and in again."""
    rng = np.random.default_rng(seed)
    scale = 10.0 ** rng.uniform(-3, -0.3, (count, 1, 1))
    return (rng.uniform(-0.05, 1.05, (count, 1, 2)) + scale * rng.normal(0, 1, (count, 3, 2))).astype("f4")


def cross(a: NDArray, b: NDArray) -> NDArray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def holds(triangle: NDArray, p: NDArray) -> NDArray[np.bool_]:
    """Whether triangles (..., 3, 2) hold p, edges included."""
    signs = cross(np.roll(triangle, -1, -2) - triangle, p - triangle)
    return np.asarray((signs >= 0).all(-1) | (signs <= 0).all(-1))


def clipped_area(triangle: NDArray, x: float, y: float) -> float:
    """Area of a triangle (3, 2) inside the unit square at (x, y), by Sutherland and Hodgman."""
    polygon = list(triangle)
    for axis, sign, limit in ((0, 1, x), (0, -1, -(x + 1)), (1, 1, y), (1, -1, -(y + 1))):
        kept = []
        for p, q in zip(polygon, polygon[1:] + polygon[:1], strict=True):
            dp, dq = sign * p[axis] - limit, sign * q[axis] - limit
            if dp >= 0:
                kept.append(p)
            if (dp > 0 > dq) or (dp < 0 < dq):
                kept.append(p + (q - p) * dp / (dp - dq))
        polygon = kept
        if not polygon:
            return 0.0
    corners = np.array(polygon)
    return abs(float(cross(corners, np.roll(corners, -1, 0)).sum())) / 2


def distance(triangle: NDArray, p: NDArray) -> float:
    """From p to a triangle (3, 2)."""
    if holds(triangle, p):
        return 0.0
    edge = np.roll(triangle, -1, 0) - triangle
    s = np.clip(((p - triangle) * edge).sum(1) / (edge**2).sum(1), 0, 1)
    return float(np.linalg.norm(triangle + s[:, None] * edge - p, axis=1).min())


def place(triangles: NDArray, index: int, barycentric: NDArray) -> NDArray:
    weights = np.array([*barycentric, 1 - barycentric.sum()])
    return weights @ triangles[index]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("supersample", [1, 3])
def test_samples_are_covered_as_the_obvious_loop_says(seed: int, supersample: int) -> None:
    uv = random_triangles(seed)
    layout = Layout.of(uv, SIZE)
    found = covered_samples(layout, supersample, range(0, SIZE))
    for i, j in np.ndindex(found.triangle.shape):
        p = (np.array([j, i]) + 0.5) / supersample
        inside = np.flatnonzero(holds(layout.corners, p))
        assert found.triangle[i, j] == (layout.face[inside[0]] if len(inside) else -1)
        if len(inside):
            np.testing.assert_allclose(place(layout.corners, inside[0], found.barycentric[i, j]), p, atol=2e-5)


@pytest.mark.parametrize("seed", range(3))
def test_touched_texels_are_all_those_of_positive_overlap_at_the_nearest_point(seed: int) -> None:
    layout = Layout.of(random_triangles(seed), SIZE)
    found = touched_texels(layout)
    for i, j in np.ndindex(found.triangle.shape):
        centre = np.array([j + 0.5, i + 0.5])
        touching = [f for f, t in enumerate(layout.corners) if clipped_area(t, j, i) > 1e-9]
        assert (found.triangle[i, j] >= 0) == bool(touching)
        if touching:
            copies = np.flatnonzero(layout.face == found.triangle[i, j])
            nearest = min(distance(layout.corners[t], centre) for t in touching)
            points = [place(layout.corners, f, found.barycentric[i, j].astype(float)) for f in copies]
            assert min(np.linalg.norm(point - centre) for point in points) == pytest.approx(nearest, abs=3e-5)


def test_bands_of_rows_agree_with_the_whole() -> None:
    layout = Layout.of(random_triangles(7), SIZE)
    whole = covered_samples(layout, 2, range(0, SIZE))
    parts = [covered_samples(layout, 2, range(a, a + 8)) for a in range(0, SIZE, 8)]
    np.testing.assert_array_equal(whole.triangle, np.concatenate([part.triangle for part in parts]))
    np.testing.assert_array_equal(whole.barycentric, np.concatenate([part.barycentric for part in parts]))


def test_neighbours_leave_no_crack_between_them() -> None:
    """A fan of thin triangles that covers a square covers every sample of it."""
    angle = np.linspace(0, 2 * np.pi, 700)
    rim = np.stack([np.cos(angle), np.sin(angle)], -1) * 0.49 + 0.5
    uv = np.stack([np.full((699, 2), 0.5), rim[:-1], rim[1:]], 1).astype("f4")
    found = covered_samples(Layout.of(uv, 128), 2, range(0, 128))
    y, x = (np.indices((256, 256)) + 0.5) / 256 - 0.5
    assert (found.triangle[np.hypot(x, y) < 0.488] >= 0).all()


def test_triangles_without_area_in_uv_touch_what_no_other_does() -> None:
    """A point and a diagonal line; then a triangle over half of the line."""
    flat = [[[0.1, 0.9]] * 3, [[0.1, 0.1], [0.5, 0.5], [0.9, 0.9]]]
    found = touched_texels(Layout.of(np.array(flat, "f4"), SIZE))
    expected = np.full((SIZE, SIZE), -1)
    expected[1, 1] = 0
    expected[range(1, 15), range(14, 0, -1)] = 1
    assert (found.triangle == expected).all()
    corners = np.array(flat, "f4") * (SIZE, -SIZE) + (0, SIZE)
    for i, j in np.argwhere(expected == 1):
        assert np.abs(place(corners, 1, found.barycentric[i, j]) - (j + 0.5, i + 0.5)).max() < 0.51
    both = touched_texels(Layout.of(np.array([*flat, [[0.5, 0.5], [1, 0], [1, 1]]], "f4"), SIZE)).triangle
    assert (both[:, 8:] != 1).all()
    assert (both[:, :8] == expected[:, :8]).all()
    assert (covered_samples(Layout.of(np.array(flat, "f4"), SIZE), 2, range(0, SIZE)).triangle == -1).all()
