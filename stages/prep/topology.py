"""Edges of a triangle list and what hangs together over them; `ids` may be vertices, or (vertex, UV) pairs.

Half-edge 3 f + k of face f runs from its corner k to corner (k + 1) % 3.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled


@dataclass(frozen=True)
class Edges:
    """edge: (3 F,) undirected edge of each half-edge. forward: (3 F,) whether it runs from the lower id. faces: (E,)
    how many half-edges share each edge. pairs: (M, 2) the two half-edges of each edge that has exactly two."""

    edge: NDArray[np.int64]
    forward: NDArray[np.bool_]
    faces: NDArray[np.int64]
    pairs: NDArray[np.int64]


def edges(ids: NDArray) -> Edges:
    """Edges of triangles `ids` (F, 3)."""
    start, end = ids.reshape(-1).astype(np.int64), np.roll(ids, -1, 1).reshape(-1).astype(np.int64)
    low, high = np.minimum(start, end), np.maximum(start, end)
    code = low * (high.max(initial=0) + 1) + high
    order = np.argsort(code, kind="stable")
    first = np.flatnonzero(np.diff(code[order], prepend=-1))
    faces = np.diff(first, append=len(code))
    edge = np.empty(len(code), np.int64)
    edge[order] = np.repeat(np.arange(len(first)), faces)
    two = first[faces == 2]
    return Edges(edge, start < end, faces, np.stack([order[two], order[two + 1]], -1))


@compiled
def components(count, links):  # type: ignore[no-untyped-def]
    """Labels (count,) int32 of what is linked, numbered by their first member. Args: links: (K, 2).

    Source: Tarjan & van Leeuwen 1984, "Worst-case Analysis of Set Union Algorithms" (path halving).
    """
    parent = np.arange(count)  # never after its children
    for k in range(len(links)):
        a, b = links[k, 0], links[k, 1]
        while parent[a] != a:
            parent[a] = parent[parent[a]]
            a = parent[a]
        while parent[b] != b:
            parent[b] = parent[parent[b]]
            b = parent[b]
        parent[max(a, b)] = min(a, b)
    labels = np.empty(count, np.int32)
    found = 0
    for i in range(count):
        labels[i] = labels[parent[i]] if parent[i] < i else found
        found += parent[i] == i
    return labels


def renumber(labels: NDArray) -> NDArray[np.int32]:
    """Labels numbered 0, 1, ... in the order of their first appearance."""
    _, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int32)
    rank[np.argsort(first, kind="stable")] = np.arange(len(first), dtype=np.int32)
    return rank[inverse]


def face_components(ids: NDArray) -> NDArray[np.int32]:
    """Labels (F,) of faces that hang together over any shared edge."""
    table = edges(ids)
    order = np.argsort(table.edge, kind="stable")
    same = table.edge[order[1:]] == table.edge[order[:-1]]
    return components(len(ids), np.stack([order[:-1][same], order[1:][same]], -1) // 3)


def corner_links(triangles: NDArray, pairs: NDArray) -> NDArray[np.int64]:
    """(2 M, 2) corners 3 f + k at either end of each edge, across it. pairs: (M, 2) half-edges."""
    face, corner = pairs // 3, pairs % 3
    start, end = 3 * face + corner, 3 * face + (corner + 1) % 3
    vertex = triangles.reshape(-1)
    reverse = vertex[start[:, 0]] != vertex[start[:, 1]]
    across_start = np.where(reverse, end[:, 1], start[:, 1])
    across_end = np.where(reverse, start[:, 1], end[:, 1])
    return np.concatenate([np.stack([start[:, 0], across_start], -1), np.stack([end[:, 0], across_end], -1)])


def pinched_vertices(triangles: NDArray) -> int:
    """Vertices at which more than one fan of faces meets, not counting those of edges with three faces or more."""
    table = edges(triangles)
    fan = components(triangles.size, corner_links(triangles, table.pairs))
    _, first = np.unique(fan, return_index=True)
    vertex = triangles.reshape(-1)
    fans = np.bincount(vertex[first], minlength=int(vertex.max()) + 1)
    crowded = table.faces[table.edge] > 2
    fans[vertex[crowded]] = 0
    fans[np.roll(triangles, -1, 1).reshape(-1)[crowded]] = 0
    return int((fans > 1).sum())
