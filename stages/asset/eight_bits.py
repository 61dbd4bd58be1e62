"""Maps as the bytes of 8-bit pictures, in one pass over them."""

import numpy as np
from numpy.typing import NDArray

from stages.core.color import srgb_decode
from stages.core.parallel import compiled

SRGB_BINS = 1 << 16
"""Entries of the linear to sRGB table; no bin holds two borders between bytes."""

BAND = 1 << 18
"""Numbers that are dithered together."""


def to_8bit(linear: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Linear [0, 1] to bytes, rounded to nearest."""
    return (np.clip(linear, 0, 1) * np.float32(255) + np.float32(0.5)).astype(np.uint8)


def srgb_8bit(linear: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Linear [0, 1] to sRGB bytes, rounded to nearest: a table, then one comparison with the border it may cross. Args: (H, W,
    C)."""
    borders = srgb_decode((np.arange(256) + 0.5) / 255).astype(np.float32)  # the last one is never crossed
    borders[255] = np.inf
    table = np.searchsorted(borders, np.arange(SRGB_BINS) / np.float32(SRGB_BINS), side="right").astype(np.uint8)
    result = np.empty(linear.shape, np.uint8)
    _srgb(linear, borders, table, result)
    return result


@compiled
def _srgb(linear, borders, table, result):  # type: ignore[no-untyped-def]
    most = np.float32(len(table) - 1)
    for i in range(linear.shape[0]):
        for j in range(linear.shape[1]):
            for c in range(linear.shape[2]):
                value = linear[i, j, c]
                byte = table[np.int32(min(max(value * np.float32(SRGB_BINS), np.float32(0)), most))]
                result[i, j, c] = byte + (value >= borders[byte])


def normal_8bit(normal: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Unit vectors (H, W, 3) to bytes, dithered by at most half a step so that gentle slopes do not turn into terraces.

    Where nothing leans, the bytes are those that every tool takes for flat: 128, 128, 255.
    """
    rng, result = np.random.default_rng(0), np.empty(normal.shape, np.uint8)
    step = max(1, BAND // (3 * normal.shape[1]))
    for first in range(0, len(normal), step):
        rows = slice(first, first + step)
        _dithered(normal[rows], rng.random(normal[rows].shape, np.float32), result[rows])
    return result


@compiled
def _dithered(normal, noise, result):  # type: ignore[no-untyped-def]
    half, one, most = np.float32(127.5), np.float32(1), np.float32(255)
    for i in range(normal.shape[0]):
        for j in range(normal.shape[1]):
            for c in range(3):
                value = (normal[i, j, c] + one) * half + noise[i, j, c]
                result[i, j, c] = np.uint8(min(max(value, np.float32(0)), most))
            if normal[i, j, 0] == 0 and normal[i, j, 1] == 0:
                result[i, j, 0], result[i, j, 1], result[i, j, 2] = 128, 128, 255
