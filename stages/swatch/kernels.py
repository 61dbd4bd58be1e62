"""Two passes over a swatch's maps: normals of its height, with the roughness of what they hide, and what pictures show."""

import math

import numpy as np
from numpy.typing import NDArray

from stages.core.brdf import roughened
from stages.core.parallel import compiled, in_parallel, slices
from stages.material.relief import STEEPEST, bend

BAND = 64
"""Rows of one thread's task."""


def tile_normals(height: NDArray[np.float32], roughness: NDArray[np.float32]) -> NDArray[np.float32]:
    """Tangent-space normals of a tile's height, +Y up.

    Args: height: (H, H) edges of the tile. roughness: (H, H), raised by what normals differ within a texel, see `relief.bend`.
    Returns: (H, H, 3) unit.
    """
    normal = np.empty((*height.shape, 3), np.float32)
    in_parallel(lambda rows: _lean(height, rows.start, rows.stop, normal, roughness), slices(len(height), BAND))
    return normal


@compiled
def _lean(height, first, end, normal, roughness):  # type: ignore[no-untyped-def]
    """Normals of some rows; slopes are bounded as in `relief.gentle`."""
    size = len(height)
    half, most, one = np.float32(size / 2), np.float32(STEEPEST), np.float32(1)
    for i in range(first, end):
        above, below = height[i - 1 if i else size - 1], height[i + 1 if i + 1 < size else 0]
        for j in range(size):
            before, after = j - 1 if j else size - 1, j + 1 if j + 1 < size else 0
            roughness[i, j] = roughened(roughness[i, j], bend(above, height[i], below, (before, j, after), size, size))
            right = (height[i, after] - height[i, before]) * half
            up = (above[j] - below[j]) * half
            length = math.sqrt(right * right + up * up)
            share = min(one, most / max(length, most / 2))
            right, up = right * share, up * share
            scale = one / math.sqrt(right * right + up * up + one)
            normal[i, j, 0], normal[i, j, 1], normal[i, j, 2] = -right * scale, -up * scale, scale


def shrunk(values: NDArray[np.float32], size: int) -> NDArray[np.float32]:
    """A square map (H, H, C) at `size` texels an edge: means of whole blocks, of the nearest where there are more."""
    step = max(1, len(values) // size)
    result = np.empty((size, size, values.shape[2]), np.float32)
    nearest = (np.arange(size) * (len(values) // step)) // size
    _blocks(values, step, nearest, result)
    return result


@compiled
def _blocks(values, step, nearest, result):  # type: ignore[no-untyped-def]
    share = np.float32(1 / step**2)
    total = np.empty(values.shape[2], np.float32)
    for i in range(len(nearest)):
        for j in range(len(nearest)):
            total[:] = 0
            for y in range(step * nearest[i], step * (nearest[i] + 1)):
                for x in range(step * nearest[j], step * (nearest[j] + 1)):
                    for c in range(len(total)):
                        total[c] += values[y, x, c]
            for c in range(len(total)):
                result[i, j, c] = total[c] * share
