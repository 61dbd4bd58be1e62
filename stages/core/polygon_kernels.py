"""Compiled ear clipping; `stages.core.polygons.clip_ears` is the plain form of the same."""

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled


@compiled
def _side(px: float, py: float, qx: float, qy: float, rx: float, ry: float) -> float:
    return (qx - px) * (ry - py) - (qy - py) * (rx - px)


@compiled
def _normal(corners: NDArray, axis: int) -> float:
    """One component of a polygon's normal (n, 3), about its first corner."""
    i, j, total = (axis + 1) % 3, (axis + 2) % 3, 0.0
    for k in range(1, len(corners) - 1):
        total += _side(corners[0, i], corners[0, j], corners[k, i], corners[k, j], corners[k + 1, i], corners[k + 1, j])
    return total


@compiled
def _is_ear(x: NDArray, y: NDArray, a: int, b: int, c: int, blunt: NDArray, count: int) -> bool:
    """Whether the triangle a, b, c is convex and holds none of the `count` first corners of `blunt`."""
    px, py, qx, qy, rx, ry = x[a], y[a], x[b], y[b], x[c], y[c]
    if not _side(px, py, qx, qy, rx, ry) > 0:
        return False
    low_x, high_x = min(px, qx, rx), max(px, qx, rx)
    low_y, high_y = min(py, qy, ry), max(py, qy, ry)
    for k in range(count):
        u, v = x[blunt[k]], y[blunt[k]]
        if u < low_x or u > high_x or v < low_y or v > high_y:
            continue
        if (u == px and v == py) or (u == qx and v == qy) or (u == rx and v == ry):
            continue
        if _side(px, py, qx, qy, u, v) >= 0 and _side(qx, qy, rx, ry, u, v) >= 0 and _side(rx, ry, px, py, u, v) >= 0:
            return False
    return True


@compiled
def _is_convex(x: NDArray, y: NDArray, a: int, b: int, c: int) -> bool:
    return _side(x[a], y[a], x[b], y[b], x[c], y[c]) > 0


@compiled
def clip(corners: NDArray, triangles: NDArray) -> bool:
    """Cut one polygon (n, 3) into `triangles` (n - 2, 3), corners of which the lowest comes first.

    Only corners that are not convex can lie in an ear, and one that has become convex stays so; the search for the next
    ear goes on where the last one was. Returns: False where there is no ear (the polygon crosses itself).
    """
    n, axis, largest = len(corners), 0, 0.0
    for k in range(3):
        if abs(_normal(corners, k)) > abs(largest):
            axis, largest = k, _normal(corners, k)
    if largest == 0 or not np.isfinite(largest):
        return False
    x, y = np.empty(n), np.empty(n)
    for i in range(n):
        x[i] = corners[i, (axis + 1) % 3]
        y[i] = corners[i, (axis + 2) % 3] * (1.0 if largest > 0 else -1.0)
    before, after = np.arange(-1, n - 1), np.arange(1, n + 1)
    before[0], after[n - 1] = n - 1, 0
    blunt, place, count = np.empty(n, np.int64), np.full(n, -1), 0
    for i in range(n):
        if not _is_convex(x, y, before[i], i, after[i]):
            blunt[count], place[i] = i, count
            count += 1
    here, failed, made = 0, 0, 0
    while made < n - 3:
        a, c = before[here], after[here]
        if not _is_ear(x, y, a, here, c, blunt, count):
            here, failed = c, failed + 1
            if failed > n - made:
                return False
            continue
        triangles[made, 0], triangles[made, 1], triangles[made, 2] = a, here, c
        made, failed = made + 1, 0
        after[a], before[c] = c, a
        for i in (here, a, c):
            if place[i] >= 0 and (i == here or _is_convex(x, y, before[i], i, after[i])):
                count -= 1
                last = blunt[count]
                blunt[place[i]], place[last], place[i] = last, place[i], -1
        here = c
    triangles[made, 0], triangles[made, 1], triangles[made, 2] = before[here], here, after[here]
    for t in range(n - 2):
        while triangles[t, 0] > min(triangles[t, 1], triangles[t, 2]):
            triangles[t, 0], triangles[t, 1], triangles[t, 2] = triangles[t, 1], triangles[t, 2], triangles[t, 0]
    return True


@compiled
def clip_all(starts: NDArray, counts: NDArray, corners: NDArray, first: NDArray, loops: NDArray) -> None:
    """Cut each polygon, corners starts[k] … starts[k] + counts[k] - 1, into loops[first[k]] and the rows after it, which
    stay as they are where it has no ear."""
    for k in range(len(starts)):
        triangles = np.empty((counts[k] - 2, 3), np.int32)
        if clip(corners[starts[k] : starts[k] + counts[k]], triangles):
            for t in range(counts[k] - 2):
                for corner in range(3):
                    loops[first[k] + t, corner] = triangles[t, corner] + starts[k]
