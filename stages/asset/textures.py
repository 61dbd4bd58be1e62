"""The texture files: EXR masters and 8-bit PNGs.

Masters are half float, linear: values lie in [-1, 1], where a half is off by at most 2.5e-4, a sixteenth of an 8-bit
step, at half the bytes and time of float32. Heights are float32, since they are differentiated. A one-channel EXR is
"Y", OpenEXR's name for grey.
glTF conventions: albedo.png is sRGB; orm.png is linear, R occlusion (1 where none is baked), G roughness, B metallic;
normal.png is linear, (n + 1) / 2, +Y up.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.asset.eight_bits import normal_8bit, srgb_8bit, to_8bit
from stages.asset.maps import Maps
from stages.core.artifact import read_exr, write_exr
from stages.core.images import RUNS, write_png
from stages.core.parallel import in_parallel
from stages.core.texture_sets import ONE_SET, TextureSet


def write_textures(folder: Path, maps: Maps, of: TextureSet = ONE_SET, grey: bool = False) -> list[str]:
    """Write the masters and PNGs of the maps there are, several at a time.

    Args:
        of: the set by which files are named. grey: also roughness.png and metallic.png.
    Returns:
        the files' names.
    """
    pngs, exrs = pictures(maps, grey), masters(maps)

    def write(name: str) -> None:
        if name in pngs:
            write_png(folder / of.file(name), pngs[name](), RUNS)
        else:
            write_exr(folder / of.file(name), exrs[name]())

    names = [*pngs, *exrs]
    in_parallel(write, names)
    return [of.file(name) for name in names]


def pictures(maps: Maps, grey: bool) -> dict[str, Callable[[], NDArray[np.uint8]]]:
    """PNG by name, made when called."""
    made: dict[str, Callable[[], NDArray[np.uint8]]] = {
        "albedo.png": lambda: srgb_8bit(maps.albedo),
        "orm.png": lambda: orm(maps),
    }
    normal = maps.normal
    if normal is not None:
        made["normal.png"] = lambda: normal_8bit(normal)
    if grey:
        made |= {"roughness.png": lambda: to_8bit(maps.roughness), "metallic.png": lambda: to_8bit(maps.metallic)}
    return made


def masters(maps: Maps) -> dict[str, Callable[[], dict[str, NDArray]]]:
    """Channels of each EXR by name, made when called."""
    made = {"albedo.exr": lambda: _colour(maps.albedo), "roughness.exr": lambda: _grey(maps.roughness)}
    made["metallic.exr"] = lambda: _grey(maps.metallic)
    normal, height, occlusion = maps.normal, maps.height, maps.occlusion
    if normal is not None:
        made["normal.exr"] = lambda: _colour(normal)
    if occlusion is not None:
        made["occlusion.exr"] = lambda: _grey(occlusion)
    if height is not None:
        made["height.exr"] = lambda: {"Y": height}
    return made


def read_masters(paths: Mapping[str, Path]) -> Maps:
    """The maps that masters hold. Args: paths: by name of the map, "albedo" to "height". Raises: ArtifactError."""
    found = {name: _pixels(path) for name, path in paths.items()}
    material = np.dstack([found["albedo"], found["roughness"], found["metallic"]])
    grey = {name: found[name][..., 0] if name in found else None for name in ("height", "occlusion")}
    return Maps(material, grey["height"], found.get("normal"), grey["occlusion"])


def _pixels(path: Path) -> NDArray[np.float32]:
    """(H, W, C), colours in the order R, G, B."""
    channels = read_exr(path).channels
    return np.stack([channels[name] for name in ("R", "G", "B") if name in channels] or [channels["Y"]], -1).astype(np.float32)


def _colour(values: NDArray) -> dict[str, NDArray]:
    return {channel: values[..., k].astype(np.float16) for k, channel in enumerate("RGB")}


def _grey(values: NDArray) -> dict[str, NDArray]:
    return {"Y": values.astype(np.float16)}


def orm(maps: Maps) -> NDArray[np.uint8]:
    """glTF's packed texture, (H, W, 3)."""
    packed = np.full((*maps.roughness.shape, 3), 255, np.uint8)
    if maps.occlusion is not None:
        packed[..., 0] = to_8bit(maps.occlusion)
    packed[..., 1], packed[..., 2] = to_8bit(maps.roughness), to_8bit(maps.metallic)
    return packed
