"""A flat, tiling square of a material: the way to look at one without a mesh."""

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stages.material.evaluate import COLUMNS, layered
from stages.material.place import Place
from stages.material.recipe import Recipe
from stages.material.surface import Array, Surface
from stages.material.uneven import patterns, uneven

SAMPLES = 1 << 15
"""Evaluated together: what they need stays in a core's cache."""


class Swatch(NamedTuple):
    """texels: (H, W, 6), see `COLUMNS`, heights in edges of the square."""

    texels: Array

    @property
    def albedo(self) -> Array:
        """(H, W, 3) linear."""
        return self.texels[..., :3]

    @property
    def roughness(self) -> Array:
        """(H, W)."""
        return self.texels[..., 3]

    @property
    def height(self) -> Array:
        """(H, W)."""
        return self.texels[..., 5]


def swatch(recipe: Recipe, size: int, threads: int, supersample: int = 2) -> Swatch:
    """A square of a material that tiles, seen from above: its rows run down, its left edge continues at its right.

    Args:
        recipe: settled. size: texels along an edge. supersample: N samples on the diagonal of each texel, averaged; N x N in
        those that differ much from their neighbours (`uneven`).
    """
    maps = np.empty((size * size, COLUMNS), np.float32)
    first, others = patterns(supersample)

    def part(texels: NDArray[np.int64]) -> None:
        maps[texels] = _sampled(recipe, size, texels, first)

    def finer(texels: NDArray[np.int64]) -> None:
        maps[texels] += (_sampled(recipe, size, texels, others) - maps[texels]) * np.float32(others.mean())

    with ThreadPoolExecutor(threads) as pool:
        every, count = np.arange(len(maps)), SAMPLES // supersample
        list(pool.map(lambda k: part(every[k : k + count]), range(0, len(every), count)))
        if others.any():
            some = np.flatnonzero(uneven(maps.reshape(size, size, COLUMNS), np.ones((size, size), np.bool_), wrap=True))
            count = SAMPLES // others.sum()
            list(pool.map(lambda k: finer(some[k : k + count]), range(0, len(some), count)))
    return Swatch(maps.reshape(size, size, COLUMNS))


def _sampled(recipe: Recipe, size: int, texels: NDArray[np.int64], pattern: NDArray[np.bool_]) -> Array:
    """The material of some texels, (N, 6), each the mean of some points. Args: texels: row * size + column. pattern: of
    `patterns`."""
    down, across = ((k + np.float32(0.5)) / np.float32(len(pattern)) for k in np.nonzero(pattern))
    row, column = (k.astype(np.float32)[:, None] for k in divmod(texels, size))
    u, v = ((column + across) / np.float32(size)).ravel(), (1 - (row + down) / np.float32(size)).ravel()
    point = np.stack([u, v, np.zeros_like(u)], 1).astype(np.float32)
    up = np.broadcast_to(np.array([0, 0, 1], np.float32), point.shape)
    surface = Surface.bare(point, up, 1 / (size * len(pattern)))
    p = np.ascontiguousarray(point.T)
    world = Place(p, p[:2], np.zeros(len(point), np.int32), surface.footprint, (1.0, 1.0, 0.0), recipe.seed)
    return layered(recipe, surface, world)[0].reshape(len(texels), -1, COLUMNS).mean(1)
