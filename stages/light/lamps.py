"""The bright spots of lights in clusters, each one direction with a spread: few of them, and small where it is bright.

Source: Walter et al. 2005, "Lightcuts: A Scalable Approach to Illumination" (lights in clusters, cut where it matters).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core.color import luminance
from stages.light.octahedral import texel_directions

COARSE, FINEST = 16, 128
"""Cells along each side of the octahedral square: a cluster is one of at most 13 degrees, and at least 1.5."""

BLUR = 3e-6
"""A cluster is cut in four while its share of the light, times its spread, is above this."""


@dataclass(frozen=True)
class Lamps:
    """Clusters of a light set's excess, K in all.

    direction: (3, K) float32, mean. spread: (K,) float32, mean squared distance of unit directions from it. flux: (K,
    CHANNELS) float32, radiance times solid angle, in the channels of its environment.
    """

    direction: NDArray[np.float32]
    spread: NDArray[np.float32]
    flux: NDArray[np.float32]


def cluster(peaks: NDArray, mean: NDArray, channels: int) -> Lamps:
    """Lamps of the excess on the octahedral square.

    Args:
        peaks: (E, S, S, 3), radiance, S at least FINEST. mean: (E,), luminance of the whole light over the sphere.
        channels: of the result's flux, 3 E or more.
    """
    size = peaks.shape[1]
    some = np.nonzero(peaks.any(-1))  # few texels rise above a light's bound
    bright, directions = peaks[some], np.stack(texel_directions(size), -1)
    share = luminance(bright.astype(np.float64)) / (np.maximum(mean, np.finfo(float).tiny)[some[0]] * size**2)
    columns = np.concatenate([share[:, None] * directions[some[1:]], bright * (4 * np.pi / size**2), share[:, None]], 1)
    cell = np.ravel_multi_index((some[0], *(k * FINEST // size for k in some[1:])), (len(peaks), FINEST, FINEST))
    finest = np.stack([np.bincount(cell, column, len(peaks) * FINEST**2) for column in columns.T], -1)
    levels = [finest.reshape(len(peaks), FINEST, FINEST, -1)]
    while levels[-1].shape[1] > COARSE:
        half = levels[-1].shape[1] // 2
        levels.append(levels[-1].reshape(len(peaks), half, 2, half, 2, -1).sum((2, 4)))
    found = []
    uncut = np.ones((len(peaks), COARSE, COARSE), bool)
    for level in reversed(levels):
        energy = level[..., 6]
        length = np.linalg.norm(level[..., :3], axis=-1) / np.maximum(energy, np.finfo(float).tiny)
        spread = (1 - length**2).clip(0)
        uncut &= energy > 0
        cut = uncut & (energy * spread > BLUR) & (level.shape[1] < FINEST)
        whole = uncut & ~cut
        found.append(np.c_[level[whole], spread[whole], np.nonzero(whole)[0]])
        uncut = cut.repeat(2, 1).repeat(2, 2)
    lamps = np.concatenate(found)
    direction = lamps[:, :3] / np.linalg.norm(lamps[:, :3], axis=1, keepdims=True)
    flux = np.zeros((len(lamps), channels), np.float32)
    np.put_along_axis(flux, 3 * lamps[:, 8:].astype(np.int64) + np.arange(3), lamps[:, 3:6], 1)
    return Lamps(np.ascontiguousarray(direction.T, np.float32), lamps[:, 7].astype(np.float32), flux)
