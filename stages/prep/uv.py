"""UVs: the source's per loop, the texels that they cover, and the charts they form. v is up, [0, 1] the unit square."""

import numpy as np
from numpy.typing import NDArray

from stages.core.tiles import signed_area
from stages.prep.source import Source
from stages.prep.topology import face_components

_RASTER, _LEAST = 2048, 256  # texels across, for measuring overlap


def loop_uvs(source: Source) -> NDArray[np.float32]:
    """(L, 2) the source's UVs with v up; NaN where a loop has none. A v that is up already keeps its bits."""
    if not len(source.uv):
        return np.full((len(source.loop_vertex), 2), np.nan, np.float32)
    with np.errstate(over="ignore"):
        uv = source.uv[np.maximum(source.loop_uv, 0)].astype(np.float32)
    if source.v_down:
        uv[:, 1] = (1.0 - uv[:, 1].astype(np.float64)).astype(np.float32)
    uv[source.loop_uv < 0] = np.nan
    return uv


def stretch(corners: NDArray, uv: NDArray) -> float:
    """How unevenly the texture lies on the surface: 1 where all texels are squares of one size, more elsewhere.

    Source: Sander et al. 2001, "Texture Mapping Progressive Meshes", L2 stretch, times its value at one scale.

    Args:
        corners: (F, 3, 3) in space. uv: (F, 3, 2). Triangles without area in either are left out.
    """
    (e1, e2), (u1, u2) = ((x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) for x in (corners.astype(np.float64), uv.astype(np.float64)))
    area, twice = np.linalg.norm(np.cross(e1, e2), axis=1) / 2, u1[:, 0] * u2[:, 1] - u1[:, 1] * u2[:, 0]
    used = (area > 0) & (twice != 0)
    e1, e2, u1, u2, area, twice = (x[used] for x in (e1, e2, u1, u2, area, twice))
    along_u, along_v = e1 * u2[:, 1:] - e2 * u1[:, 1:], e2 * u1[:, :1] - e1 * u2[:, :1]
    squared = ((along_u**2).sum(1) + (along_v**2).sum(1)) / (2 * twice**2)
    return float(np.sqrt((area * squared).sum() * np.abs(twice).sum() / 2) / area.sum()) if len(area) else 1.0


def overlap(uv: NDArray) -> float:
    """Share of covered texels that more than one face covers; 1 when no texel is covered at all."""
    cover = covered(uv)
    once = int((cover > 0).sum())
    return float((cover > 1).sum()) / once if once else 1.0


def covered(uv: NDArray, textures: int = 1) -> NDArray[np.int32]:
    """How many triangles (F, 3, 2) cover the centre of each texel of the unit square.

    Args:
        textures: how many are asked about; the texels of all together stay about as many.
    """
    across = max(_RASTER >> ((textures - 1).bit_length() + 1) // 2, _LEAST)
    return coverage(uv.astype(np.float64) * across, across, across)


def coverage(points: NDArray, height: int, width: int) -> NDArray[np.int32]:
    """How many triangles cover each texel's centre, (height, width); faces that share an edge never both cover a texel.

    Scan conversion by differences: along a row, a face begins (+1) at the first centre right of its left edge and
    ends (-1) at the first right of its right edge. An edge's crossings do not depend on the face, so neighbours meet
    exactly.

    Args:
        points: (F, 3, 2) in texels, row 0 at y = 0.
    """
    return np.cumsum(changes(points, height, width)[:, :-1].astype(np.int32), axis=1, dtype=np.int32)


def changes(points: NDArray, height: int, width: int) -> NDArray:
    """By how much `coverage` changes at each texel from that on its left, (height, width + 1), whole numbers."""
    facing = np.sign(signed_area(points))
    start, end = points.reshape(-1, 2), np.roll(points, -1, 1).reshape(-1, 2)
    upward = (end[:, 1] > start[:, 1])[:, None]
    low, high = np.where(upward, start, end), np.where(upward, end, start)
    first, last = (np.clip(np.ceil(side[:, 1] - 0.5), 0, height).astype(np.int64) for side in (low, high))
    counts = last - first
    edge = np.repeat(np.arange(len(counts)), counts)
    row = np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts) + first[edge]
    slope = np.divide(high[:, 0] - low[:, 0], high[:, 1] - low[:, 1], out=np.zeros(len(low)), where=counts > 0)
    x = low[edge, 0] + (row + 0.5 - low[edge, 1]) * slope[edge]
    column = np.clip(np.ceil(x - 0.5), 0, width).astype(np.int64)
    step = np.where(upward[:, 0], -1.0, 1.0)[edge] * np.repeat(facing, 3)[edge]
    return np.bincount(row * (width + 1) + column, step, height * (width + 1)).reshape(height, width + 1)


def uv_charts(triangles: NDArray, uv: NDArray) -> NDArray[np.int32]:
    """(F,) labels of faces that hang together over edges with the same vertices and UVs on both sides."""
    return face_components(uv_vertices(triangles, uv))


def uv_vertices(triangles: NDArray, uv: NDArray) -> NDArray[np.int64]:
    """(F, 3) one number for each distinct (vertex, UV bits) pair."""
    bits = np.ascontiguousarray(uv.astype(np.float32) + np.float32(0)).view(np.uint32).reshape(-1, 2)
    packed = bits[:, 0].astype(np.uint64) << np.uint64(32) | bits[:, 1]
    _, code = np.unique(packed, return_inverse=True)
    pairs = triangles.reshape(-1).astype(np.int64) * (int(code.max(initial=0)) + 1) + code
    return np.unique(pairs, return_inverse=True)[1].reshape(-1, 3)
