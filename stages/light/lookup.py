"""Texture look-up: bilinear at a point, or its mean over the patch of texture that a pixel shows.

The patch is a parallelogram. It is covered with points no farther apart than a texel, each looked up bilinearly: a box
filter over the pixel's footprint, which costs as many look-ups as there are texels to see. v points down.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled

REPEAT, CLAMP, MIRROR = 10497, 33071, 33648
"""How a texture goes on beyond its edge, glTF's (and OpenGL's) numbers."""

MOST = 32
"""Points along each edge of a patch."""


@dataclass(frozen=True)
class Texture:
    """An image (H, W, C), the first row at the top, as a mesh wears it.

    matrix: (2, 3) affine, from the mesh's UVs to the texture's, or None. wrap: glTF's modes along u and v.
    """

    image: NDArray[np.float32]
    matrix: NDArray[np.float64] | None = None
    wrap: tuple[int, int] = (REPEAT, REPEAT)

    def at(self, uv: NDArray, across: NDArray | None = None) -> NDArray[np.float32]:
        """Its values (N, C) at the mesh's UVs. Args: as of `look_up`."""
        if self.matrix is not None:
            uv = uv @ self.matrix[:, :2].T + self.matrix[:, 2]
            across = None if across is None else across @ self.matrix[:, :2].T
        return look_up(self.image, uv, across, self.wrap)


def look_up(
    image: NDArray[np.float32], uv: NDArray, across: NDArray | None = None, wrap: tuple[int, int] = (CLAMP, CLAMP)
) -> NDArray[np.float32]:
    """The texture at some places.

    Args:
        image: (H, W, C), the first row at v = 0. uv: (N, 2), the middle of each patch. across: (N, 2, 2), the patch's two
        edges, in UV; points where None. wrap: modes along u and v.
    Returns:
        (N, C).
    """
    result = np.zeros((len(uv), image.shape[2]), np.float32)
    edges = np.zeros((len(uv), 2, 2)) if across is None else np.asarray(across, np.float64)
    _look_up(np.ascontiguousarray(image, np.float32), np.asarray(uv, np.float64), edges, wrap, result)
    return result


@compiled
def _look_up(image, uv, across, wrap, result):  # type: ignore[no-untyped-def]
    height, width, channels = image.shape
    for n in range(len(uv)):
        first = _count(across[n, 0], width, height)
        second = _count(across[n, 1], width, height)
        for i in range(first):
            for j in range(second):
                a, b = (i + 0.5) / first - 0.5, (j + 0.5) / second - 0.5
                x = (uv[n, 0] + a * across[n, 0, 0] + b * across[n, 1, 0]) * width - 0.5
                y = (uv[n, 1] + a * across[n, 0, 1] + b * across[n, 1, 1]) * height - 0.5
                column, row = math.floor(x), math.floor(y)
                fx, fy = x - column, y - row
                left, right = _wrapped(int(column), width, wrap[0]), _wrapped(int(column) + 1, width, wrap[0])
                top, bottom = _wrapped(int(row), height, wrap[1]), _wrapped(int(row) + 1, height, wrap[1])
                for c in range(channels):
                    above = image[top, left, c] * (1 - fx) + image[top, right, c] * fx
                    below = image[bottom, left, c] * (1 - fx) + image[bottom, right, c] * fx
                    result[n, c] += (above * (1 - fy) + below * fy) / (first * second)


@compiled
def _count(edge, width, height):  # type: ignore[no-untyped-def]
    """Points along an edge of a patch: as many as texels."""
    return min(max(int(math.ceil(math.hypot(edge[0] * width, edge[1] * height))), 1), MOST)


@compiled
def _wrapped(index, size, mode):  # type: ignore[no-untyped-def]
    if mode == CLAMP:
        return min(max(index, 0), size - 1)
    if mode == MIRROR:
        return min(index % (2 * size), 2 * size - 1 - index % (2 * size))
    return index % size
