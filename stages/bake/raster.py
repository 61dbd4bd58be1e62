"""UV rasteriser: which triangle, and where on it, each texel and each sample inside a texel shows.

Texel space: x = u * size to the right, y = (1 - v) * size down; texel (row, column) is the unit square whose centre
lies at +0.5. A triangle *covers* a sample that lies in it, edges included; where several do, the one drawn first wins
(`stages.core.tiles`). A triangle *touches* a texel whose open square it overlaps: that is the conservative coverage of a
chart's rim. One without area in UV is the segment that it has become, and touches what no other does.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled, in_parallel
from stages.core.tiles import INSIDE, drawn

BAND = 64
"""Rows of texels that one task rasterises."""

SMALLEST_AREA = 1e-12
"""Triangles of less area, in texels squared, show nothing: their barycentric coordinates would be noise."""


@dataclass(frozen=True)
class Surface:
    """One surface point per texel or sample: triangle, -1 off the charts, and the first two barycentric coordinates.

    triangle: (...) int32. barycentric: (..., 2) float32.
    """

    triangle: NDArray[np.int32]
    barycentric: NDArray[np.float32]

    def where(self, mask: NDArray[np.bool_]) -> "Surface":
        """The points picked by a mask of the same shape, in row-major order."""
        return Surface(self.triangle[mask], self.barycentric[mask])

    def __getitem__(self, index: NDArray | slice) -> "Surface":
        return Surface(self.triangle[index], self.barycentric[index])

    def interpolate(self, corners: NDArray[np.float32]) -> NDArray[np.float32]:
        """Interpolate a per-corner attribute. Args: corners (F, 3, D). Returns: (N, D), for N points on charts."""
        result = np.empty((len(self.triangle), corners.shape[2]), np.float32)
        _interpolate(self.triangle, self.barycentric, corners, result)
        return result


def joined(parts: list[Surface]) -> Surface:
    """Points (N,) of several, one after the other."""
    triangle = np.concatenate([part.triangle for part in parts])
    return Surface(triangle, np.concatenate([part.barycentric for part in parts]))


@dataclass(frozen=True)
class Layout:
    """Triangles in texel space.

    uv: (F, 3, 2) corners of each, wherever they lie, 0 of those that are on other textures. corners: (D, 3, 2) the copies on
    the texture, in the order in which they are drawn, face (D,) of each, top and bottom (D,). size: of the texture, texels.
    """

    uv: NDArray[np.float64]
    corners: NDArray[np.float64]
    face: NDArray[np.int32]
    top: NDArray[np.float64]
    bottom: NDArray[np.float64]
    size: int

    @staticmethod
    def of(
        uv: NDArray[np.float32], size: int, charts: NDArray[np.int32] | None = None, mine: NDArray[np.bool_] | None = None
    ) -> "Layout":
        """From UVs (F, 3, 2), v up.

        Args:
            charts: (F,) in the order in which they represent what they share; any where None. mine: (F,) which lie on this
            texture; all where None.
        """
        rows = np.flatnonzero(np.ones(len(uv), bool) if mine is None else mine).astype(np.int32)
        copies = drawn(uv[rows], np.zeros(len(rows), np.int32) if charts is None else charts[rows])
        own = np.zeros_like(uv)
        own[rows] = uv[rows]
        corners = in_texels(copies.corners, size)
        a, b, c = corners[:, 0, 1], corners[:, 1, 1], corners[:, 2, 1]
        top, bottom = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
        return Layout(in_texels(own, size), corners, rows[copies.face], top, bottom, size)

    def in_rows(self, rows: range) -> NDArray[np.int64]:
        """Indices, ascending, of the copies whose bounding box meets some rows."""
        return np.flatnonzero((self.top <= rows.stop) & (self.bottom >= rows.start))


def in_texels(uv: NDArray, size: int) -> NDArray[np.float64]:
    """UVs (F, 3, 2), v up, in texel space."""
    corners = uv.astype(np.float64)
    corners[..., 1] = 1 - corners[..., 1]
    return corners * size


def bands(size: int) -> list[range]:
    """Rows 0 … size - 1 in bands of `BAND`."""
    return [range(start, min(start + BAND, size)) for start in range(0, size, BAND)]


def touched_texels(layout: Layout) -> Surface:
    """For every texel that a triangle touches, the surface point nearest to its centre (at it, where it is covered).

    Returns:
        Surface of shape (size, size).
    """
    size = layout.size
    triangle = np.full((size, size), -1, np.int32)
    barycentric = np.zeros((size, size, 2), np.float32)

    def rasterise(rows: range) -> None:
        band = slice(rows.start, rows.stop)
        reached = layout.in_rows(rows)
        _touch(layout.corners, layout.face, reached, rows.start, triangle[band], barycentric[band])
        _touch_flat(layout.corners, layout.face, reached, rows.start, triangle[band], barycentric[band])

    in_parallel(rasterise, bands(size))
    return Surface(triangle, barycentric)


def covered_samples(layout: Layout, supersample: int, rows: range) -> Surface:
    """The surface at a regular grid of samples inside each texel of some rows.

    Args:
        supersample: S samples along each edge of a texel. rows: of texels.
    Returns:
        Surface of shape (len(rows) * S, size * S): sample (i, j) belongs to texel (i // S, j // S).
    """
    shape = (len(rows) * supersample, layout.size * supersample)
    triangle, barycentric = np.full(shape, -1, np.int32), np.zeros((*shape, 2), np.float32)
    reached = layout.in_rows(rows)
    _cover(layout.corners, layout.face, reached, supersample, rows.start * supersample, triangle, barycentric)
    return Surface(triangle, barycentric)


@compiled
def _edges(t):  # type: ignore[no-untyped-def]
    """How the barycentric coordinates change over texel space; infinite or NaN for a triangle without area.

    Returns:
        per corner k, (value at the origin, change along x, change along y); twice the signed area.
    """
    (ax, ay), (bx, by), (cx, cy) = (t[0, 0], t[0, 1]), (t[1, 0], t[1, 1]), (t[2, 0], t[2, 1])
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    x1, y1, x2, y2 = (cy - ay) / area, (ax - cx) / area, (ay - by) / area, (bx - ax) / area
    x0, y0 = -x1 - x2, -y1 - y2
    return (x0, x1, x2), (y0, y1, y2), area


@compiled
def _span(dx, dy, ax, above, reach, low, high):  # type: ignore[no-untyped-def]
    """The x range, within [low, high], where no barycentric coordinate is under -reach.

    dx, dy: changes per texel, three each. ax: x of corner 0. above: y less that of corner 0. reach: three.
    """
    for k in range(3):
        rest = (1.0 if k == 0 else 0.0) + dy[k] * above + reach[k]  # at x = ax
        if dx[k] > 0:
            low = max(low, ax - rest / dx[k])
        elif dx[k] < 0:
            high = min(high, ax - rest / dx[k])
        elif rest < INSIDE:
            high = low - 2
    return low, high


@compiled
def _cover(corners, face, reached, samples, first, triangle, barycentric):  # type: ignore[no-untyped-def]
    """Mark the samples that triangles cover; sample rows start at `first`."""
    rows, columns = triangle.shape
    t = np.empty((3, 2))
    for f in reached:
        t[:] = corners[f]
        t *= samples
        dx, dy, area = _edges(t)
        if not abs(area) > 2 * SMALLEST_AREA * samples * samples:
            continue
        left, right = min(t[0, 0], t[1, 0], t[2, 0]), max(t[0, 0], t[1, 0], t[2, 0])
        y0, y1 = min(t[0, 1], t[1, 1], t[2, 1]), max(t[0, 1], t[1, 1], t[2, 1])
        for i in range(max(int(np.floor(y0 - 0.5)), first), min(int(np.ceil(y1 - 0.5)), first + rows - 1) + 1):
            above = i + 0.5 - t[0, 1]
            low, high = _span(dx, dy, t[0, 0], above, (0.0, 0.0, 0.0), left, right)
            if high < low - 1:
                continue
            for j in range(max(int(low - 0.5), 0), min(int(high + 0.5), columns - 1) + 1):
                across = j + 0.5 - t[0, 0]
                w1, w2 = dx[1] * across + dy[1] * above, dx[2] * across + dy[2] * above
                w0 = 1 - w1 - w2
                if triangle[i - first, j] < 0 and min(w0, w1, w2) >= INSIDE:
                    triangle[i - first, j] = face[f]
                    barycentric[i - first, j, 0] = max(w0, 0.0)
                    barycentric[i - first, j, 1] = max(w1, 0.0)


@compiled
def _touch(corners, face, reached, first, triangle, barycentric):  # type: ignore[no-untyped-def]
    """Mark the texels that triangles touch with the touching point nearest to their centres."""
    rows, columns = triangle.shape
    nearest = np.full((rows, columns), np.inf)
    t = np.empty((3, 2))
    for f in reached:
        t[:] = corners[f]
        dx, dy, area = _edges(t)
        if not abs(area) > 2 * SMALLEST_AREA:
            continue
        half = (0.5 * (abs(dx[0]) + abs(dy[0])), 0.5 * (abs(dx[1]) + abs(dy[1])), 0.5 * (abs(dx[2]) + abs(dy[2])))
        left, right = min(t[0, 0], t[1, 0], t[2, 0]), max(t[0, 0], t[1, 0], t[2, 0])
        y0, y1 = min(t[0, 1], t[1, 1], t[2, 1]), max(t[0, 1], t[1, 1], t[2, 1])
        for i in range(max(int(np.floor(y0)), first), min(int(np.ceil(y1)), first + rows)):
            low, high = _span(dx, dy, t[0, 0], i + 0.5 - t[0, 1], half, left - 0.5, right + 0.5)
            if high < low - 1:
                continue
            start = max(int(np.floor(left)), int(low - 0.5), 0)
            for j in range(start, min(int(np.ceil(right)), int(high + 0.5) + 1, columns)):
                distance, w0, w1 = _nearest(t, dx, dy, half, j + 0.5, i + 0.5)
                if distance < nearest[i - first, j]:
                    nearest[i - first, j] = distance
                    triangle[i - first, j] = face[f]
                    barycentric[i - first, j, 0], barycentric[i - first, j, 1] = w0, w1


@compiled
def _touch_flat(corners, face, reached, first, triangle, barycentric):  # type: ignore[no-untyped-def]
    """Mark the texels that only triangles without area touch, with a point of the longest edge."""
    rows, columns = triangle.shape
    for f in reached:
        t = corners[f]
        if abs(_edges(t)[2]) > 2 * SMALLEST_AREA:
            continue
        p, longest = 0, -1.0
        for k in range(3):
            q = (k + 1) % 3
            length = np.hypot(t[q, 0] - t[k, 0], t[q, 1] - t[k, 1])
            if length > longest:
                p, longest = k, length
        q = (p + 1) % 3
        steps = int(np.ceil(2 * longest)) + 1
        for k in range(steps):
            s = (k + 0.5) / steps
            i, j = int(np.floor(t[p, 1] + s * (t[q, 1] - t[p, 1]))), int(np.floor(t[p, 0] + s * (t[q, 0] - t[p, 0])))
            if 0 <= i - first < rows and 0 <= j < columns and triangle[i - first, j] < 0:
                triangle[i - first, j] = face[f]
                barycentric[i - first, j, 0] = 1 - s if p == 0 else (s if q == 0 else 0.0)
                barycentric[i - first, j, 1] = 1 - s if p == 1 else (s if q == 1 else 0.0)


@compiled
def _nearest(t, dx, dy, half, x, y):  # type: ignore[no-untyped-def]
    """The point of a triangle nearest to a texel's centre (x, y).

    half: how much each barycentric coordinate changes within half a texel.
    Returns:
        squared distance, infinite when the triangle does not touch the texel; two barycentric coordinates.
    """
    across, above = x - t[0, 0], y - t[0, 1]
    w1, w2 = dx[1] * across + dy[1] * above, dx[2] * across + dy[2] * above
    w0 = 1 - w1 - w2
    if min(w0, w1, w2) >= 0:
        return 0.0, w0, w1
    best, u, v = np.inf, 0.0, 0.0
    if min(w0 + half[0], w1 + half[1], w2 + half[2]) <= 0:
        return best, u, v
    for k in range(3):
        p, q = k, (k + 1) % 3
        ex, ey = t[q, 0] - t[p, 0], t[q, 1] - t[p, 1]
        s = min(max(((x - t[p, 0]) * ex + (y - t[p, 1]) * ey) / (ex * ex + ey * ey), 0.0), 1.0)
        distance = (t[p, 0] + s * ex - x) ** 2 + (t[p, 1] + s * ey - y) ** 2
        if distance < best:
            best = distance
            u = 1 - s if p == 0 else (s if q == 0 else 0.0)
            v = 1 - s if p == 1 else (s if q == 1 else 0.0)
    return best, u, v


@compiled
def _interpolate(triangle, barycentric, corners, result):  # type: ignore[no-untyped-def]
    for i in range(len(triangle)):
        f = triangle[i]
        u, v = barycentric[i, 0], barycentric[i, 1]
        w = np.float32(1) - u - v
        for d in range(result.shape[1]):
            result[i, d] = u * corners[f, 0, d] + v * corners[f, 1, d] + w * corners[f, 2, d]
