"""Tangent frames by the MikkTSpace rule, by which every client reads a normal map.

Source: Mikkelsen 2008, "Simulation of Wrinkled Surfaces Revisited", and its C code (mikktspace.c, default threshold of
180 degrees), on which glTF 2.0 (section 3.7.2.1), Blender, Unreal, Unity, three.js and Substance agree. Corners of one
vertex (position, normal and UV equal to the bit) share a tangent when a fan of triangles that are wound alike in UV
joins them: the mean of the triangles' own tangents, weighted by the angle at the vertex.

Convention: `w` is the sign of the bitangent, b = w cross(n, t), and b points where v, up, grows.
"""

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled

_TINY = np.finfo(np.float32).tiny


def mikktspace(
    positions: NDArray[np.float32], normals: NDArray[np.float32], uv: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Tangents of triangle corners.

    Args:
        positions, normals: (T, 3, 3), normals unit. uv: (T, 3, 2), v up. All finite.
    Returns:
        (T, 3, 4) unit tangent across the normal, and w, 1 or -1.
    """
    p, n, t = (np.ascontiguousarray(values, np.float32) for values in (positions, normals, uv))
    result = np.zeros((len(p), 3, 4), np.float32)
    if not len(p):
        return result
    bits = np.concatenate([(values.reshape(3 * len(p), -1) + np.float32(0)).view(np.uint32) for values in (p, n, t)], 1)
    vertex = _same_rows(bits).reshape(-1, 3)
    direction, preserving, usable = _face_tangents(p, t)
    thin = (p == np.roll(p, 1, 1)).all(2).any(1)  # two of whose corners are one point
    neighbour = _neighbours(np.where(thin[:, None], -1, vertex))
    _gather(p, n, vertex, direction, preserving, usable, thin, neighbour, result)
    _lend(vertex, thin, result)
    return result


def _same_rows(bits: NDArray[np.uint32]) -> NDArray[np.int64]:
    """One number for equal rows. Args: (N, K). Returns: (N,). By a hash of the rows, which is a tenth of the time."""
    mixed = np.zeros(len(bits), np.uint64)
    for column in bits.T:
        mixed = (mixed ^ column) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    _, first, number = np.unique(mixed, return_index=True, return_inverse=True)
    if (bits[first[number]] == bits).all():
        return number
    return np.unique(bits, axis=0, return_inverse=True)[1].reshape(-1)  # two rows met by chance


def _face_tangents(p: NDArray, uv: NDArray) -> tuple[NDArray[np.float32], NDArray[np.bool_], NDArray[np.bool_]]:
    """Each triangle's own direction of growing u, (T, 3) unit or 0; whether UVs are wound as in space; whether both hold."""
    d1, d2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    t1, t2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area = t1[:, 0] * t2[:, 1] - t1[:, 1] * t2[:, 0]
    sign = np.where(area > 0, 1, -1).astype(np.float32)[:, None]
    along = sign * (t2[:, 1:] * d1 - t1[:, 1:] * d2)
    across = sign * (t1[:, :1] * d2 - t2[:, :1] * d1)
    length_s, length_t = np.linalg.norm(along, axis=1), np.linalg.norm(across, axis=1)
    flat = np.abs(area) <= _TINY
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        usable = ~flat & (length_s / np.abs(area) > _TINY) & (length_t / np.abs(area) > _TINY)
    direction = np.where(((length_s > _TINY) & ~flat)[:, None], along, 0) / np.maximum(length_s, _TINY)[:, None]
    return direction.astype(np.float32), area > 0, usable


def _neighbours(vertex: NDArray[np.int64]) -> NDArray[np.int64]:
    """The triangle across each edge (corner k to k + 1), wound the same way, or -1. Args: (T, 3), -1 for none to be had."""
    start, end = vertex.reshape(-1), np.roll(vertex, -1, 1).reshape(-1)
    low, high = np.minimum(start, end), np.maximum(start, end)
    edges = np.flatnonzero(start >= 0)
    order = edges[np.lexsort((edges, high[edges], low[edges]))]
    result = np.full(len(start), -1, np.int64)
    _pair(order, start, end, low, high, result)
    return result.reshape(-1, 3)


@compiled
def _pair(order, start, end, low, high, result):  # type: ignore[no-untyped-def]
    """Join each edge with the first free one after it that runs the other way."""
    for i in range(len(order)):
        a = order[i]
        if result[a] >= 0:
            continue
        for j in range(i + 1, len(order)):
            b = order[j]
            if low[a] != low[b] or high[a] != high[b]:
                break
            if result[b] < 0 and start[a] == end[b] and end[a] == start[b]:
                result[a], result[b] = b // 3, a // 3
                break


@compiled
def _gather(p, n, vertex, direction, preserving, usable, thin, neighbour, result):  # type: ignore[no-untyped-def]
    """Find the fan of each corner and give its corners their tangent.

    A triangle without UVs of its own joins the first fan that reaches it, and has its winding from then on.
    """
    count = len(p)
    grouped = np.zeros((count, 3), np.bool_)
    winding = preserving.copy()
    fan_face, fan_corner = np.empty(3 * count, np.int64), np.empty(3 * count, np.int64)
    stack = np.empty(6 * count + 2, np.int64)
    for f in range(count):
        if thin[f] or not usable[f]:
            continue
        for k in range(3):
            if grouped[f, k]:
                continue
            size, top = 0, 0
            stack[0], top = f, 1
            while top > 0:
                top -= 1
                g = stack[top]
                c = 0
                while c < 3 and vertex[g, c] != vertex[f, k]:
                    c += 1
                if c == 3 or grouped[g, c]:
                    continue
                if not usable[g] and not (grouped[g, 0] or grouped[g, 1] or grouped[g, 2]):
                    winding[g] = winding[f]
                if winding[g] != winding[f]:
                    continue
                grouped[g, c] = True
                fan_face[size], fan_corner[size] = g, c
                size += 1
                left, right = neighbour[g, c], neighbour[g, (c + 2) % 3]
                if right >= 0:
                    stack[top] = right
                    top += 1
                if left >= 0:
                    stack[top] = left
                    top += 1
            _mean(p, n, direction, usable, fan_face[:size], fan_corner[:size], winding[f], result)


@compiled
def _mean(p, n, direction, usable, face, corner, preserving, result):  # type: ignore[no-untyped-def]
    """The tangent of a fan, by the angles at its vertex, into `result`."""
    normal = n[face[0], corner[0]]
    total = np.zeros(3)
    for i in range(len(face)):
        f, k = face[i], corner[i]
        if not usable[f]:
            continue
        tangent = _across(direction[f], normal)
        to_before = _across(p[f, (k + 2) % 3] - p[f, k], normal)
        to_after = _across(p[f, (k + 1) % 3] - p[f, k], normal)
        cosine = min(max((to_before * to_after).sum(), -1.0), 1.0)
        total += np.arccos(cosine) * tangent
    length = np.sqrt((total * total).sum())
    for i in range(len(face)):
        f, k = face[i], corner[i]
        for d in range(3):
            result[f, k, d] = total[d] / length if length > 0 else 0.0
        result[f, k, 3] = 1.0 if preserving else -1.0


@compiled
def _across(vector, normal):  # type: ignore[no-untyped-def]
    """The part of a vector across a unit normal, made unit; 0 where there is none."""
    v, m = vector.astype(np.float64), normal.astype(np.float64)
    flat = v - (v * m).sum() * m
    length = np.sqrt((flat * flat).sum())
    return flat / length if length > 0 else flat


def _lend(vertex: NDArray, thin: NDArray, result: NDArray[np.float32]) -> None:
    """Corners that no fan reached take the tangent of the first corner of their vertex, else any, in place.

    Args:
        vertex: (T, 3). thin: (T,) triangles without a side. result: (T, 3, 4).
    """
    flat, corner_vertex = result.reshape(-1, 4), vertex.reshape(-1)
    has = flat[:, 3] != 0
    first = np.full(int(corner_vertex.max()) + 1, -1)
    known = np.flatnonzero(has)[::-1]
    first[corner_vertex[known]] = known
    lender = first[corner_vertex]
    borrowed = ~has & np.repeat(thin, 3) & (lender >= 0)
    flat[borrowed] = flat[lender[borrowed]]
    flat[flat[:, 3] == 0] = (1, 0, 0, -1)  # the rule's own default
    flat[(flat[:, :3] == 0).all(1), 0] = 1
