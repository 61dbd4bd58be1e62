"""How large the textures of each set are, and how large pictures show them.

One set is USUAL texels wide. Of several, each has texels by its share of the surface, its edge a power of two, and all together
have no more than MOST: a scan in twenty tiles is not twenty times the work.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stages.core.texture_sets import TextureSet

USUAL, LEAST = 2048, 64
"""Texels along an edge."""

MOST = (2 * USUAL) ** 2
"""Texels of all sets together, where no size is asked for."""

SHOWN = 8192**2
"""Texels of all sets together that pictures are drawn from; of more, the means of blocks."""


def sized(sets: list[TextureSet], size: int | None) -> list[TextureSet]:
    """The sets with their sizes. Args: size: the one that is asked for, or None."""
    if size is not None:
        return [replace(one, size=size) for one in sets]
    largest = max(one.share for one in sets) or 1.0
    steps = [round(math.log2(max(one.share / largest, 1e-9)) / 2) for one in sets]
    for edge in (USUAL >> k for k in range(USUAL.bit_length())):
        edges = [max(int(edge * 2.0**step), LEAST) for step in steps]
        if sum(one**2 for one in edges) <= MOST:
            break
    return [replace(one, size=edge) for one, edge in zip(sets, edges, strict=True)]


def block(sets: list[TextureSet]) -> int:
    """Texels along an edge of the blocks whose means pictures show, a power of two."""
    texels, edge = sum(one.size**2 for one in sets), 1
    while texels > SHOWN * edge**2:
        edge *= 2
    return min(edge, min(one.size for one in sets))


def means(values: NDArray[np.float32], edge: int) -> NDArray[np.float32]:
    """Means of blocks (H, W, C); the same where these are single texels."""
    if edge == 1:
        return values
    height, width, count = values.shape
    return values.reshape(height // edge, edge, width // edge, edge, count).mean((1, 3), dtype=np.float32)
