"""UV layouts on textures that repeat: the whole tiles that triangles lie in, and whose point a texel shows where they share it.

UVs are v up and may lie anywhere in the plane: a texture repeats, so that (u + 1, v) shows the texel of (u, v). A triangle is
*drawn* once for every tile that it lies in, moved by whole tiles onto the unit square, which a copy may overhang. Where
several cover a place of the texture, the one drawn first *represents* it: the material there is that of its point of the
surface, for all surface that shows it. A triangle without area in UV represents nothing that another covers.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled

EDGE = 1e-5
"""How far beyond a tile a corner may lie and still count as on its edge: 1/50 texel at 2048."""

INSIDE = -1e-9
"""Least barycentric coordinate of a point inside of a triangle: rounding leaves no crack between neighbours."""

MOST_CELLS = 512
"""Along an edge of the grid over the unit square."""

FLAT = 1e-12
"""Area in UV up to which a triangle has none: a hundred-thousandth of a texel at 4096, where rounding leaves as much."""

BESIDE = 1e-3
"""How far from a triangle, in UV, a face without area may lie and still show its texel: two texels at 2048."""


@dataclass(frozen=True)
class Drawn:
    """D copies of triangles on the unit square, those that represent before those that do not.

    face: (D,) rows of the triangles. corners: (D, 3, 2) float64, v up.
    """

    face: NDArray[np.int32]
    corners: NDArray[np.float64]


def drawn(uv: NDArray, charts: NDArray[np.int32]) -> Drawn:
    """The copies of triangles, in the order of their charts, within a chart in that of its tiles.

    Args:
        uv: (F, 3, 2). charts: (F,); of two that share texels the lower represents them.
    """
    low, count = tiles(uv)
    copies = count[:, 0] * count[:, 1]
    face = np.repeat(np.arange(len(uv), dtype=np.int32), copies)
    number = np.arange(len(face)) - np.repeat(np.cumsum(copies) - copies, copies)
    tile = low[face] + np.stack([number % count[face, 0], number // count[face, 0]], -1)
    order = np.lexsort((face, tile[:, 0], tile[:, 1], charts[face]))
    face, tile = face[order], tile[order]
    return Drawn(face, uv[face].astype(np.float64) - tile[:, None])


def tiles(uv: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The lowest tile of each triangle and how many it lies in, along u and v: (F, 2) each."""
    low = np.floor(uv.min(1).astype(np.float64) + EDGE).astype(np.int64)
    high = np.ceil(uv.max(1).astype(np.float64) - EDGE).astype(np.int64)
    return low, np.maximum(high - low, 1)


def flat(uv: NDArray) -> NDArray[np.bool_]:
    """(F,) triangles without area in UV."""
    return np.abs(signed_area(uv)) <= FLAT


def repeats(uv: NDArray) -> bool:
    """Whether any UV (F, 3, 2) lies outside of the unit square, so that textures must repeat."""
    return bool(((uv < -EDGE) | (uv > 1 + EDGE)).any())


def signed_area(uv: NDArray) -> NDArray[np.float64]:
    """(F,) areas in UV, positive when counter-clockwise with v up."""
    a, b, c = (uv[:, k].astype(np.float64) for k in range(3))
    u, v = b - a, c - a
    return (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2


class Representatives:
    """Finds the point of the surface that represents what another shows.

    Args:
        uv: (F, 3, 2), v up. charts: (F,), as for `drawn`. sets: (F,) the texture that each triangle shows, from 0.
    """

    def __init__(self, uv: NDArray, charts: NDArray[np.int32], sets: NDArray[np.int32]) -> None:
        self._uv, self._flat, self._area = uv.astype(np.float64), flat(uv), np.abs(signed_area(uv))
        self._low, count = tiles(uv)
        self._one_tile = (count == 1).all(1)
        self._drawn = drawn(uv, charts)
        corners = self._drawn.corners
        extent = np.prod(np.minimum(np.ptp(corners, axis=1), 1), axis=1).sum()
        cells = np.sqrt((4 * len(corners) + 1e6) / max(extent, 1e-9))
        textures = int(sets.max(initial=0)) + 1
        self._cells = int(np.clip(min(cells, np.sqrt(len(corners))), 1, max(MOST_CELLS / np.sqrt(textures), 1)))
        self._first = sets.astype(np.int64) * self._cells**2  # cell of each triangle's texture
        usable, first = ~self._flat[self._drawn.face], self._first[self._drawn.face]
        self._start, self._content = _gridded(corners, usable, self._cells, first, textures)

    def of(self, triangle: NDArray[np.int32], barycentric: NDArray) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """The representatives of P points of the surface; a point that nothing represents stands for itself.

        Args:
            triangle: (P,). barycentric: (P, 3).
        Returns:
            (P,) and (P, 3), likewise.
        """
        uv = np.einsum("pk,pkd->pd", barycentric, self._uv[triangle])
        uv -= np.where(self._one_tile[triangle, None], self._low[triangle], np.floor(uv))
        found, weights = triangle.astype(np.int32).copy(), np.array(barycentric, np.float64)
        grid = self._cells, self._start, self._content
        flat, first = self._flat[triangle], self._first[triangle]
        _represent(uv, flat, first, grid, self._drawn.corners, self._drawn.face, found, weights)
        return found, weights

    def scale(self, size: NDArray[np.float64], triangle: NDArray[np.int32], found: NDArray[np.int32]) -> NDArray[np.float32]:
        """How many times larger the texture lies on the representatives than on what they stand for, (P,).

        Args:
            size: (F,) areas in space. triangle, found: (P,), given to and by `of`.
        """
        density = np.sqrt(np.divide(size, self._area, out=np.zeros(len(size)), where=~self._flat))
        own, theirs = density[triangle], density[found]
        known = (own > 0) & (theirs > 0)
        return np.where(known, np.clip(theirs / np.where(known, own, 1), 1 / 16, 16), 1).astype(np.float32)


def _gridded(
    corners: NDArray[np.float64], usable: NDArray[np.bool_], cells: int, first: NDArray[np.int64], textures: int
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Triangles by the cells that their boxes meet.

    Args:
        first: the first cell of each triangle's texture.
    Returns:
        (textures cells² + 1,) where each cell's triangles start in the second, which holds them in order.
    """
    low, high = (np.clip(np.floor(edge * cells), 0, cells - 1).astype(np.int64) for edge in (corners.min(1), corners.max(1)))
    width, height = (high - low + 1).T
    count = np.where(usable, width * height, 0)
    owner = np.repeat(np.arange(len(corners), dtype=np.int32), count)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    column, row = low[owner, 0] + number % width[owner], low[owner, 1] + number // width[owner]
    cell = first[owner] + row * cells + column
    start = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=textures * cells * cells))])
    return start, owner[np.argsort(cell, kind="stable")]


@compiled
def _weights(t, x, y):  # type: ignore[no-untyped-def]
    """Barycentric coordinates of a point in a triangle with area."""
    area = (t[1, 0] - t[0, 0]) * (t[2, 1] - t[0, 1]) - (t[1, 1] - t[0, 1]) * (t[2, 0] - t[0, 0])
    w1 = ((x - t[0, 0]) * (t[2, 1] - t[0, 1]) - (y - t[0, 1]) * (t[2, 0] - t[0, 0])) / area
    w2 = ((t[1, 0] - t[0, 0]) * (y - t[0, 1]) - (t[1, 1] - t[0, 1]) * (x - t[0, 0])) / area
    return 1 - w1 - w2, w1, w2


@compiled
def _nearest(t, x, y):  # type: ignore[no-untyped-def]
    """Squared distance from a point outside of a triangle to its edges, and barycentric coordinates of the nearest point."""
    best, b0, b1, b2 = np.inf, 0.0, 0.0, 0.0
    for k in range(3):
        p, q = k, (k + 1) % 3
        ex, ey = t[q, 0] - t[p, 0], t[q, 1] - t[p, 1]
        squared = ex * ex + ey * ey
        s = min(max(((x - t[p, 0]) * ex + (y - t[p, 1]) * ey) / squared, 0.0), 1.0) if squared > 0 else 0.0
        distance = (t[p, 0] + s * ex - x) ** 2 + (t[p, 1] + s * ey - y) ** 2
        if distance < best:
            best = distance
            b0 = 1 - s if p == 0 else (s if q == 0 else 0.0)
            b1 = 1 - s if p == 1 else (s if q == 1 else 0.0)
            b2 = 1 - s if p == 2 else (s if q == 2 else 0.0)
    return best, b0, b1, b2


@compiled
def _represent(uv, flat, first, grid, corners, face, found, weights):  # type: ignore[no-untyped-def]
    """Replace each point by the first drawn that covers it; one of a face without area also by the nearest beside it."""
    cells, start, content = grid
    for i in range(len(uv)):
        x, y = uv[i, 0], uv[i, 1]
        column, row = min(max(int(x * cells), 0), cells - 1), min(max(int(y * cells), 0), cells - 1)
        nearest = BESIDE * BESIDE
        cell = first[i] + row * cells + column
        for k in range(start[cell], start[cell + 1]):
            d = content[k]
            w0, w1, w2 = _weights(corners[d], x, y)
            if min(w0, w1, w2) >= INSIDE:
                if face[d] != found[i] or flat[i]:
                    found[i] = face[d]
                    weights[i, 0], weights[i, 1], weights[i, 2] = w0, w1, w2
                break
            if flat[i]:
                distance, w0, w1, w2 = _nearest(corners[d], x, y)
                if distance < nearest:
                    nearest, found[i] = distance, face[d]
                    weights[i, 0], weights[i, 1], weights[i, 2] = w0, w1, w2
