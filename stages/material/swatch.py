"""A flat, tiling square of a material: the way to look at one without a mesh."""

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from stages.material.evaluate import COLUMNS, layered
from stages.material.place import Place
from stages.material.recipe import Recipe
from stages.material.surface import Array, Surface

SAMPLES = 1 << 15
"""Evaluated together: what they need stays in a core's cache."""


class Swatch(NamedTuple):
    """albedo: (H, W, 3) linear. roughness, metallic: (H, W). height: (H, W), edges of the square."""

    albedo: Array
    roughness: Array
    metallic: Array
    height: Array


def swatch(recipe: Recipe, size: int, threads: int, supersample: int = 2) -> Swatch:
    """A square of a material that tiles, seen from above: its rows run down, its left edge continues at its right.

    Args:
        recipe: settled. size: texels along an edge. supersample: samples along the edge of a texel, averaged.
    """
    count = size * supersample
    across = (np.arange(count, dtype=np.float32) + np.float32(0.5)) / np.float32(count)
    maps = np.empty((size, size, COLUMNS), np.float32)
    rows = max(1, SAMPLES // (count * supersample))

    def band(first: int) -> None:
        some = across[first * supersample : (first + rows) * supersample]
        v, u = (a.ravel() for a in np.meshgrid(1 - some, across, indexing="ij"))
        point = np.stack([u, v, np.zeros_like(u)], 1)
        surface = Surface.bare(point, np.broadcast_to(np.array([0, 0, 1], np.float32), point.shape), 1 / count)
        p = np.ascontiguousarray(point.T)
        world = Place(p, p[:2], np.zeros(len(u), np.int32), surface.footprint, (1.0, 1.0, 0.0), recipe.seed)
        values, _ = layered(recipe, surface, world)
        maps[first : first + rows] = values.reshape(-1, supersample, size, supersample, COLUMNS).mean((1, 3))

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(band, range(0, size, rows)))
    return Swatch(maps[..., :3], maps[..., 3], maps[..., 4], maps[..., 5])
