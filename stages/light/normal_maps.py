"""Normal maps on a mesh: which way the surface leans at a hit, as a renderer of the model shades it.

A map holds vectors (x, y, z) along tangent, bitangent and normal; the tangent frame is interpolated from the triangle's
corners, as by the MikkTSpace rule (`stages.core.tangents`). Green points where v grows upward (glTF's and OpenGL's +Y).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

REPEAT, CLAMP, MIRROR = 10497, 33071, 33648
"""How a texture goes on beyond its edge, glTF's (and OpenGL's) numbers."""

LEAST_Z = 1e-3
"""A mapped normal leans by less than 90 degrees; one that leans further is held at this cosine."""


@dataclass(frozen=True)
class NormalMap:
    """One map.

    vectors: (H, W, 3), the first row at the top. scale: glTF's factor of x and y. matrix: (2, 3) affine, from the
    mesh's UVs (v down) to the texture's. wrap: glTF's modes along u and v.
    """

    vectors: NDArray[np.float32]
    scale: float = 1.0
    matrix: NDArray[np.float64] | None = None
    wrap: tuple[int, int] = (REPEAT, REPEAT)

    def at(self, uv: NDArray) -> NDArray[np.float32]:
        """The unit vectors at uv (K, 2), v down, bilinear. Returns: (K, 3)."""
        if self.matrix is not None:
            uv = uv @ self.matrix[:, :2].T + self.matrix[:, 2]
        height, width, _ = self.vectors.shape
        x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
        column, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
        fx, fy = (x - column)[:, None], (y - row)[:, None]
        (left, right), (top, bottom) = (
            (_wrapped(first, size, mode), _wrapped(first + 1, size, mode))
            for first, size, mode in zip((column, row), (width, height), self.wrap, strict=True)
        )
        upper = self.vectors[top, left] * (1 - fx) + self.vectors[top, right] * fx
        lower = self.vectors[bottom, left] * (1 - fx) + self.vectors[bottom, right] * fx
        vector = (upper * (1 - fy) + lower * fy) * [self.scale, self.scale, 1.0]
        length = np.linalg.norm(vector, axis=1, keepdims=True)
        return np.where(length > 0, vector / np.where(length > 0, length, 1), (0.0, 0.0, 1.0)).astype(np.float32)


def _wrapped(index: NDArray[np.int64], size: int, mode: int) -> NDArray[np.int64]:
    if mode == CLAMP:
        return np.clip(index, 0, size - 1)
    if mode == MIRROR:
        return np.minimum(index % (2 * size), 2 * size - 1 - index % (2 * size))
    return index % size


@dataclass(frozen=True)
class NormalMaps:
    """The maps of a mesh of F triangles.

    maps: by row. of_triangle: (F,) row of each triangle's map, or -1. uv: (F, 3, 2), v down. tangents: (F, 3, 4) world,
    w the sign of the bitangent w cross(n, t).
    """

    maps: list[NormalMap]
    of_triangle: NDArray[np.int32]
    uv: NDArray[np.float32]
    tangents: NDArray[np.float32]

    def leaning(self, n: NDArray, triangle: NDArray, barycentric: NDArray) -> NDArray[np.float32]:
        """Normals turned as the maps say. Args: n (P, 3) interpolated, unit; (P,); (P, 3). Returns: (P, 3) unit."""
        result = np.array(n, np.float32)
        row = self.of_triangle[triangle]
        for number, one in enumerate(self.maps):
            mine = np.flatnonzero(row == number)
            at, weights = triangle[mine], barycentric[mine]
            vector = one.at(np.einsum("pk,pkd->pd", weights, self.uv[at]))
            t, b = frame(result[mine], np.einsum("pk,pkd->pd", weights, self.tangents[at]))
            z = np.maximum(vector[:, 2:], LEAST_Z)
            leaned = vector[:, :1] * t + vector[:, 1:2] * b + z * result[mine]
            result[mine] = leaned / np.linalg.norm(leaned, axis=1, keepdims=True)
        return result


def frame(n: NDArray, tangent: NDArray) -> tuple[NDArray, NDArray]:
    """Tangent and bitangent beside a normal, as shaders make them of interpolated ones.

    Args:
        n: (P, 3) unit. tangent: (P, 4), interpolated.
    Returns:
        unit (P, 3) each, or 0 where there is none.
    """
    t = _unit(tangent[:, :3])
    return t, np.where(tangent[:, 3:] < 0, -1, 1) * _unit(np.cross(n, t))


def _unit(vectors: NDArray) -> NDArray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 1e-6, vectors / np.where(length > 1e-6, length, 1), 0)
