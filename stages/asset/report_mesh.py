"""The geometry of report.html: model.glb in the world frame, small enough to sit in a page.

Positions are 16-bit steps of the bounding box, normals octahedral, UVs 16-bit steps of the texture. A mesh of more than
TRIANGLES is simplified for the page alone by merging the vertices of each cell of a grid, apart for each UV island.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from stages.asset.read_glb import Primitive, TexturedModel

TRIANGLES = 150_000
"""More are simplified."""

Y_UP_TO_WORLD = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
"""(x, y, z) of glTF's frame becomes (z, x, y), as in `core.frames`."""


@dataclass(frozen=True)
class PageMesh:
    """positions: (N, 3) world, normals: (N, 3) unit, uv: (N, 2) v down, triangles: (T, 3), look: (T,) ascending."""

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    uv: NDArray[np.float32]
    triangles: NDArray[np.int64]
    look: NDArray[np.int64]


def page_mesh(model: TexturedModel, most: int = TRIANGLES) -> tuple[PageMesh, int]:
    """The whole model in one mesh of unit size around the origin. Returns: it, and the triangles that the model has."""
    parts = [(node.matrix, part) for node in model.nodes for part in node.primitives]
    parts.sort(key=lambda pair: pair[1].look)
    placed = [_placed(part, matrix) for matrix, part in parts]
    starts = np.cumsum([0, *(len(mesh.positions) for mesh in placed)])
    whole = PageMesh(
        np.concatenate([mesh.positions for mesh in placed]),
        np.concatenate([mesh.normals for mesh in placed]),
        np.concatenate([mesh.uv for mesh in placed]),
        np.concatenate([mesh.triangles + start for mesh, start in zip(placed, starts, strict=False)]),
        np.concatenate([mesh.look for mesh in placed]),
    )
    used = whole.positions[np.unique(whole.triangles)].astype(np.float64)
    low, high = used.min(0), used.max(0)
    extent = float((high - low).max()) or 1.0
    whole = replace(whole, positions=((whole.positions - (low + high) / 2) / extent).astype(np.float32))
    return simplified(whole, most), len(whole.triangles)


def _placed(part: Primitive, matrix: NDArray[np.float64]) -> PageMesh:
    """A primitive in the world; one without normals gets a flat one at each corner."""
    linear = Y_UP_TO_WORLD @ matrix[:3, :3]
    positions = part.positions @ linear.T + Y_UP_TO_WORLD @ matrix[:3, 3]
    triangles, uv = part.triangles.astype(np.int64), part.uv
    if part.normals is None:
        corners = positions[triangles]
        normals = np.repeat(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), 3, 0)
        positions, uv = corners.reshape(-1, 3), uv[triangles].reshape(-1, 2)
        triangles = np.arange(len(positions)).reshape(-1, 3)
    else:
        normals = part.normals @ np.linalg.pinv(linear)  # by the inverse transpose
    look = np.full(len(triangles), part.look, np.int64)
    return PageMesh(positions.astype(np.float32), _unit(normals), uv, triangles, look)


def simplified(mesh: PageMesh, most: int) -> PageMesh:
    """The mesh itself, or one of at most so many triangles."""
    cells = 768.0
    result = mesh
    while len(result.triangles) > most:
        result = _clustered(mesh, cells)
        cells *= 0.8
    return result


def _clustered(mesh: PageMesh, cells: float) -> PageMesh:
    """One position for each cell of a grid, and there one vertex for each UV island: no crack, no smear over a seam."""
    cell = np.floor((mesh.positions + 0.5) * cells).astype(np.int64)
    _, place = np.unique(cell @ np.array([1 << 40, 1 << 20, 1]), return_inverse=True)
    edges = mesh.triangles[:, [0, 1, 1, 2]].reshape(-1, 2)
    count = len(mesh.positions)
    graph = coo_matrix((np.ones(len(edges), np.int8), edges.T), (count, count))
    island = connected_components(graph, directed=False)[1]
    _, vertex = np.unique(place * (int(island.max()) + 1) + island, return_inverse=True)
    position = _means(mesh.positions, place)
    home = np.zeros(int(vertex.max()) + 1, np.int64)
    home[vertex] = place
    triangles = vertex[mesh.triangles]
    a, b, c = home[triangles].T
    kept = (a != b) & (b != c) & (c != a)
    normals = _unit(_means(mesh.normals, vertex))
    return PageMesh(position[home], normals, _means(mesh.uv, vertex), triangles[kept], mesh.look[kept])


def _means(values: NDArray[np.float32], group: NDArray[np.int64]) -> NDArray[np.float32]:
    """Mean of each group. Args: values (N, C), group (N,). Returns: (G, C)."""
    count = np.bincount(group)
    return np.stack([np.bincount(group, column) / count for column in values.T], 1).astype(np.float32)


def _unit(vectors: NDArray) -> NDArray[np.float32]:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 0, vectors / np.where(length > 0, length, 1), (0, 0, 1)).astype(np.float32)


def steps(values: NDArray[np.float32]) -> NDArray[np.uint16]:
    """[0, 1] in 65535 steps."""
    return (np.clip(values, 0, 1) * np.float64(65535) + 0.5).astype(np.uint16)


def octahedral(n: NDArray[np.float32]) -> NDArray[np.int16]:
    """Unit vectors (N, 3) as two signed 16-bit numbers (N, 2). Source: Cigolle et al. 2014."""
    flat = n[:, :2] / np.abs(n).sum(1, keepdims=True)
    folded = (1 - np.abs(flat[:, ::-1])) * np.where(flat < 0, -1, 1)
    return np.round(np.where(n[:, 2:] < 0, folded, flat) * 32767).astype(np.int16)
