"""The texture files: EXR masters and 8-bit PNGs.

Masters are half float, linear: values lie in [0, 1], where a half is off by at most 2.5e-4, a sixteenth of an 8-bit
step, at half the bytes and time of float32. A one-channel EXR is "Y", OpenEXR's name for grey.
glTF conventions: albedo.png is sRGB; orm.png is linear, R occlusion (1: none is baked), G roughness, B metallic.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.core.artifact import write_exr
from stages.core.color import srgb_decode
from stages.core.images import write_png
from stages.core.parallel import in_parallel

MASTERS = {"albedo.exr": {"R": 0, "G": 1, "B": 2}, "roughness.exr": {"Y": 3}, "metallic.exr": {"Y": 4}}
"""File -> EXR channel -> index in the baked maps."""

PNG_LEVEL = 3
"""zlib's level: within 2 % of the bytes of level 6, in two thirds of the time."""

SRGB_BINS = 1 << 16
"""Entries of the linear to sRGB table; no bin holds two borders between bytes."""


def to_8bit(linear: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Linear [0, 1] to bytes, rounded to nearest."""
    return (np.clip(linear, 0, 1) * np.float32(255) + np.float32(0.5)).astype(np.uint8)


def srgb_8bit(linear: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Linear [0, 1] to sRGB bytes, rounded to nearest: a table, then one comparison with the border it may cross."""
    borders = srgb_decode((np.arange(256) + 0.5) / 255).astype(np.float32)  # the last one is never crossed
    borders[255] = np.inf
    table = np.searchsorted(borders, np.arange(SRGB_BINS) / np.float32(SRGB_BINS), side="right").astype(np.uint8)
    byte = table[np.clip(linear * np.float32(SRGB_BINS), 0, SRGB_BINS - 1).astype(np.uint16)]
    return byte + (linear >= borders[byte])


def write_textures(folder: Path, maps: NDArray[np.float32], grey: bool) -> list[str]:
    """Write masters and PNGs, several at a time.

    Args:
        maps: (H, W, 5) albedo, roughness, metallic. grey: also roughness.png and metallic.png, which MTL asks for.
    Returns:
        the files' names.
    """

    def master(name: str) -> Callable[[], None]:
        return lambda: write_exr(folder / name, {c: maps[..., k].astype(np.float16) for c, k in MASTERS[name].items()})

    def picture(name: str, make: Callable[[], NDArray[np.uint8]]) -> Callable[[], None]:
        return lambda: write_png(folder / name, make(), PNG_LEVEL)

    jobs = {
        "albedo.png": picture("albedo.png", lambda: srgb_8bit(maps[..., :3])),
        "orm.png": picture("orm.png", lambda: orm(maps)),
        **{name: master(name) for name in MASTERS},
    }
    if grey:
        jobs["roughness.png"] = picture("roughness.png", lambda: to_8bit(maps[..., 3]))
        jobs["metallic.png"] = picture("metallic.png", lambda: to_8bit(maps[..., 4]))
    in_parallel(lambda job: job(), jobs.values())
    return list(jobs)


def orm(maps: NDArray[np.float32]) -> NDArray[np.uint8]:
    """glTF's packed texture. Args: maps (H, W, 5). Returns: (H, W, 3)."""
    packed = np.full((*maps.shape[:2], 3), 255, np.uint8)
    packed[..., 1:] = to_8bit(maps[..., 3:])
    return packed
