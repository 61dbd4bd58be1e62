"""Polygons cut into triangles: by a fan from the first corner, and by ear clipping where a fan would fold over.

Two stages need the same cut (the working mesh, and the source's faces in a format that knows triangles only).
"""

import numpy as np
from numpy.typing import NDArray


def triangulate(loop_start: NDArray, corners: NDArray) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Cut polygons into triangles; a polygon of n corners gives n - 2, in order, wound as it is.

    Args:
        loop_start: (P + 1,) polygon p has corners loop_start[p] .. loop_start[p + 1] - 1, three at least.
        corners: (L, 3) positions.
    Returns:
        loops: (T, 3) rows of `corners`. face: (T,) the polygon of each triangle.
    """
    counts = np.diff(loop_start)
    face = np.repeat(np.arange(len(counts), dtype=np.int32), counts - 2)
    first_triangle = np.cumsum(counts - 2) - (counts - 2)
    step = np.arange(len(face)) - first_triangle[face]
    first = np.asarray(loop_start)[:-1][face]
    loops = np.stack([first, first + step + 1, first + step + 2], -1).astype(np.int32)
    folded = _folded(loops, face, counts, corners)
    if len(folded):
        from stages.core.polygon_kernels import clip_all  # numba takes half a second to import

        starts = np.asarray(loop_start, np.int64)[folded]
        points = np.ascontiguousarray(corners, np.float64)
        clip_all(starts, counts[folded].astype(np.int64), points, first_triangle[folded].astype(np.int64), loops)
    return loops, face


def _folded(loops: NDArray, face: NDArray, counts: NDArray, corners: NDArray) -> NDArray:
    """Polygons with a fan triangle that faces away from the polygon's own normal."""
    many = counts[face] > 3
    with np.errstate(invalid="ignore", over="ignore"):
        a, b, c = (corners[loops[many, k]] for k in range(3))
        cross = np.cross(b - a, c - a)
        normal = np.stack([np.bincount(face[many], cross[:, k], len(counts)) for k in range(3)], -1)
        wrong = (cross * normal[face[many]]).sum(-1) < 0
    return np.unique(face[many][wrong])


def clip_ears(corners: NDArray) -> NDArray[np.int32] | None:
    """Ear clipping of one polygon (n, 3) projected along its normal; None when it has no ear (it crosses itself).

    The plain form of `stages.core.polygon_kernels.clip`, which may choose other ears.
    Source: Meisters 1975, "Polygons Have Ears".
    """
    centred = corners - corners.mean(0)
    normal = np.cross(centred, np.roll(centred, -1, 0)).sum(0)
    if not np.isfinite(normal).all() or not normal.any():
        return None
    axis = int(np.abs(normal).argmax())
    flat = np.roll(centred, -axis - 1, 1)[:, :2] * [1.0, np.sign(normal[axis])]
    ring, triangles = list(range(len(flat))), []
    while len(ring) > 3:
        ear = _find_ear(flat[ring])
        if ear is None:
            return None
        triangles.append((ring[ear - 1], ring[ear], ring[(ear + 1) % len(ring)]))
        del ring[ear]
    # each triangle begins with its lowest corner, so that the order does not depend on where clipping began
    return np.array([np.roll(t, -int(np.argmin(t))) for t in [*triangles, tuple(ring)]], np.int32)


def _find_ear(flat: NDArray) -> int | None:
    """The first convex corner of a counter-clockwise polygon (n, 2) whose triangle holds no other corner."""
    before, after = np.roll(flat, 1, 0), np.roll(flat, -1, 0)
    for i in np.flatnonzero(_side(before, flat, after) > 0):
        a, b, c = before[i], flat[i], after[i]
        others = flat[~((flat == a).all(-1) | (flat == b).all(-1) | (flat == c).all(-1))]
        if not ((_side(a, b, others) >= 0) & (_side(b, c, others) >= 0) & (_side(c, a, others) >= 0)).any():
            return int(i)
    return None


def _side(p: NDArray, q: NDArray, r: NDArray) -> NDArray:
    """Twice the signed area of triangles p, q, r; (..., 2) each."""
    u, v = q - p, r - p
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
