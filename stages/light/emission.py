"""What a mesh's materials emit by themselves, as a camera sees it; it lights nothing else, as in rasterisers."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.light.lookup import Texture


@dataclass(frozen=True)
class Emission:
    """Emission of F triangles. textures: linear radiance, three channels. of_triangle: (F,) row of each triangle's, or -1.

    uv: (F, 3, 2), v down.
    """

    textures: list[Texture]
    of_triangle: NDArray[np.int32]
    uv: NDArray[np.float32]

    def at(self, triangle: NDArray, barycentric: NDArray, across: NDArray) -> NDArray[np.float32]:
        """Radiance (P, 3), the mean over a patch around each point. Args: (P,); (P, 3); (P, 2, 3), edges of the patch."""
        result = np.zeros((len(triangle), 3), np.float32)
        row = self.of_triangle[triangle]
        for number, texture in enumerate(self.textures):
            mine = np.flatnonzero(row == number)
            uv = self.uv[triangle[mine]]
            middle = np.einsum("pk,pkd->pd", barycentric[mine], uv)
            result[mine] = texture.at(middle, np.einsum("pek,pkd->ped", across[mine], uv))
        return result
