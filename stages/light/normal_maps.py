"""Normal maps on a mesh: which way the surface leans at a hit, as a renderer of the model shades it.

A map holds vectors (x, y, z) along tangent, bitangent and normal; the tangent frame is interpolated from the triangle's
corners, as by the MikkTSpace rule (`stages.core.tangents`). Green points where v grows upward (glTF's and OpenGL's +Y).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.light.lookup import REPEAT, Texture

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

    def at(self, uv: NDArray, across: NDArray | None = None) -> NDArray[np.float32]:
        """The mean vectors over patches of the map, of length 1 where all are alike.

        Args:
            uv: (K, 2), v down. across: (K, 2, 2) edges of the patches; points where None.
        Returns:
            (K, 3).
        """
        vector = Texture(self.vectors, self.matrix, self.wrap).at(uv, across)
        length = np.linalg.norm(vector, axis=1, keepdims=True)
        scaled = vector * np.array([self.scale, self.scale, 1], np.float32)
        stretch = np.linalg.norm(scaled, axis=1, keepdims=True)
        kept = np.where(across is None, 1, length.clip(0, 1)) / np.where(stretch > 0, stretch, 1)
        return np.where(stretch > 0, scaled * kept, (0.0, 0.0, 1.0)).astype(np.float32)


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
        return self.filtered(n, triangle, barycentric, None)[0]

    def filtered(
        self, n: NDArray, triangle: NDArray, barycentric: NDArray, across: NDArray | None
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Normals turned as the maps say on average over a patch of the surface around each point.

        Args:
            n: (P, 3) interpolated, unit. triangle: (P,). barycentric: (P, 3). across: (P, 2, 3), the patch's edges in
            barycentric coordinates; points where None.
        Returns:
            (P, 3) unit; (P,) length of the mean of the maps' unit vectors, 1 where they are all alike.
        """
        result, length = np.array(n, np.float32), np.ones(len(n), np.float32)
        row = self.of_triangle[triangle]
        for number, one in enumerate(self.maps):
            mine = np.flatnonzero(row == number)
            at, weights = triangle[mine], barycentric[mine]
            edges = None if across is None else np.einsum("pek,pkd->ped", across[mine], self.uv[at])
            vector = one.at(np.einsum("pk,pkd->pd", weights, self.uv[at]), edges)
            length[mine] = np.linalg.norm(vector, axis=1)
            t, b = frame(result[mine], np.einsum("pk,pkd->pd", weights, self.tangents[at]))
            z = np.maximum(vector[:, 2:], LEAST_Z)
            leaned = vector[:, :1] * t + vector[:, 1:2] * b + z * result[mine]
            result[mine] = leaned / np.linalg.norm(leaned, axis=1, keepdims=True)
        return result, length


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
