"""A flat, tiling square of a material: the way to look at one without a mesh."""

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stages.material.evaluate import COLUMNS, layered
from stages.material.place import Place
from stages.material.recipe import Recipe
from stages.material.surface import Array, Surface
from stages.material.uneven import uneven

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
        recipe: settled. size: texels along an edge. supersample: samples along the edge of a texel where texels differ much
        from their neighbours (`uneven`), averaged; of others there is one.
    """
    maps = np.empty((size * size, COLUMNS), np.float32)

    def part(texels: NDArray[np.int64], samples: int) -> None:
        maps[texels] = _sampled(recipe, size, texels, samples)

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(lambda start: part(np.arange(start, min(start + SAMPLES, len(maps))), 1), range(0, len(maps), SAMPLES)))
        if supersample > 1:
            known = np.ones((size, size), np.bool_)
            some = np.flatnonzero(uneven(maps.reshape(size, size, COLUMNS), known, wrap=True))
            count = SAMPLES // supersample**2
            list(pool.map(lambda k: part(some[k : k + count], supersample), range(0, len(some), count)))
    return Swatch(maps.reshape(size, size, COLUMNS))


def _sampled(recipe: Recipe, size: int, texels: NDArray[np.int64], samples: int) -> Array:
    """The material of some texels, (N, 6), each the mean of samples² points. Args: texels: row * size + column."""
    inside = (np.arange(samples, dtype=np.float32) + np.float32(0.5)) / np.float32(samples)
    row, column = (k.astype(np.float32)[:, None, None] for k in divmod(texels, size))
    v, u = np.broadcast_arrays(1 - (row + inside[:, None]) / np.float32(size), (column + inside) / np.float32(size))
    point = np.stack([u.ravel(), v.ravel(), np.zeros(u.size, np.float32)], 1)
    up = np.broadcast_to(np.array([0, 0, 1], np.float32), point.shape)
    surface = Surface.bare(point, up, 1 / (size * samples))
    p = np.ascontiguousarray(point.T)
    world = Place(p, p[:2], np.zeros(len(point), np.int32), surface.footprint, (1.0, 1.0, 0.0), recipe.seed)
    return layered(recipe, surface, world)[0].reshape(len(texels), samples**2, COLUMNS).mean(1)
