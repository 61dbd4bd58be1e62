"""A flat, tiling square of a substance: the way to look at one without a mesh."""

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stages.material.look import Substance
from stages.material.place import Place

ROWS = 1 << 15
"""Samples evaluated together: what they need stays in a core's cache."""


class Maps(NamedTuple):
    """albedo: (H, W, 3) linear. roughness, metallic: (H, W). height: (H, W) metres. texel: its edge, metres."""

    albedo: NDArray[np.float32]
    roughness: NDArray[np.float32]
    metallic: NDArray[np.float32]
    height: NDArray[np.float32]
    texel: float


def swatch(substance: Substance, metres: float, size: int, seed: int = 0, supersample: int = 2, threads: int = 2) -> Maps:
    """A square of a substance that tiles. Args: metres: its edge. size: texels along it. supersample: samples along a texel's edge."""
    count = size * supersample
    step = metres / count
    across = (np.arange(count, dtype=np.float32) + np.float32(0.5)) * np.float32(step)
    maps = np.empty((6, size, size), np.float32)

    def rows(first: int) -> None:
        some = across[first * supersample : (first + height) * supersample]
        v, u = (a.ravel() for a in np.meshgrid(np.float32(metres) - some, across, indexing="ij"))
        uv = np.stack([u, v])
        where = np.stack([u, v, np.full_like(u, 0.1234)])
        place = Place(where, uv, np.zeros(len(u), np.int32), np.full(len(u), step, np.float32), (metres, metres, 0.0), seed)
        values = substance(place)
        channels = [*np.clip(values.color, 0, 1), np.clip(values.roughness, 0, 1), np.clip(values.metallic, 0, 1), values.height]
        for k, channel in enumerate(channels):
            full = np.broadcast_to(channel, len(u)).reshape(-1, supersample, size, supersample)
            maps[k, first : first + height] = full.mean((1, 3))

    height = max(1, min(size, ROWS // (count * supersample)))
    while size % height:
        height -= 1
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(rows, range(0, size, height)))
    return Maps(maps[:3].transpose(1, 2, 0), maps[3], maps[4], maps[5], metres / size)
