"""EXR pictures of lights, as any program writes them: which part, layer and window is the light, and in which colours.

The display window is the picture; what the data window leaves out of it is black, what reaches beyond is cut off. Level 0 of
mipmaps is read. Without chromaticities the colours are Rec. 709, as OpenEXR says.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from stages.core.color import REC709, to_rec709
from stages.core.errors import InputError, one_line
from stages.light.radiance_file import PIXELS_A_BYTE

NAMED = {
    "lin_rec709_scene": REC709,
    "lin_ap0_scene": (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767),
    "lin_ap1_scene": (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767),
    "lin_p3d65_scene": (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329),
    "lin_rec2020_scene": (0.708, 0.292, 0.17, 0.797, 0.131, 0.046, 0.3127, 0.329),
}
"""Linear colour spaces that `colorInteropID` names."""

MAIN = ("", "combined", "beauty", "rgba", "rgb", "color")
"""Names of the layer that is the picture itself, where there are several; the first that is there."""


@dataclass(frozen=True)
class _Layer:
    """Three channels, or one, of a part: their numbers. name: of the layer. part: its number."""

    name: str
    part: int
    channels: tuple[int, ...]


def read_exr_light(path: Path) -> tuple[NDArray[np.float32], NDArray[np.float64] | None]:
    """Read the light of an EXR file.

    Returns:
        (H, W, 3) as stored; the matrix (3, 3) that takes it to linear Rec. 709, or None where it is that.
    Raises: InputError.
    """
    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise InputError(f"{path}: {_unreadable(oiio.geterror())}")
    try:
        layer = _chosen(path, _layers(source))
        source.seek_subimage(layer.part, 0)
        spec = source.spec()
        matrix = _matrix(path, spec)
        _expect_picture(path, spec)
        first, last = min(layer.channels), max(layer.channels) + 1
        pixels = source.read_image(layer.part, 0, first, last, "float")
        if pixels is None:
            raise InputError(f"{path}: {_unreadable(source.geterror())}")
    finally:
        source.close()
    picked = pixels.reshape(spec.height, spec.width, -1)[..., [c - first for c in layer.channels]]
    return _displayed(picked, spec), matrix


def _unreadable(problem: str) -> str:
    if "ubsampled" in problem:
        return "luminance with subsampled colours is not read; export it with channels R, G and B"
    return f"not a readable EXR file ({one_line(problem)}); export it again"


def _layers(source: oiio.ImageInput) -> list[_Layer]:
    """Every R, G and B, and where a part has none, every Y."""
    layers, part = [], 0
    while source.seek_subimage(part, 0):
        spec = source.spec()
        if not spec.deep and spec.format.basetype in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE):
            layers += _layers_of(spec.channelnames, part)
        part += 1
    return layers


def _layers_of(names: Sequence[str], part: int) -> list[_Layer]:
    at: dict[str, dict[str, int]] = {}
    for number, name in enumerate(names):
        layer, _, channel = name.rpartition(".")
        at.setdefault(layer, {})[channel.upper()] = number
    coloured = [_Layer(name, part, tuple(held[c] for c in "RGB")) for name, held in at.items() if {*"RGB"} <= held.keys()]
    grey = [_Layer(name, part, (held["Y"],)) for name, held in at.items() if "Y" in held and not {"RY", "BY"} & held.keys()]
    return coloured or grey


def _chosen(path: Path, layers: list[_Layer]) -> _Layer:
    """The layer that is the picture: of those in colour, where there are any. Raises: InputError."""
    layers = [layer for layer in layers if len(layer.channels) == 3] or layers
    if not layers:
        raise InputError(f"{path}: no channels R, G and B (or Y alone) of half or float in any part; export them")
    for name in MAIN:
        for layer in layers:
            if layer.name.lower().rpartition(".")[2] == name:
                return layer
    if len(layers) > 1:
        names = ", ".join(layer.name for layer in layers)[:80]
        raise InputError(f"{path}: {len(layers)} pictures ({names}), expected one; export that alone")
    return layers[0]


def _matrix(path: Path, spec: oiio.ImageSpec) -> NDArray[np.float64] | None:
    """Raises: InputError."""
    told = spec.getattribute("chromaticities")
    space = spec.getattribute("colorInteropID")
    if told is None and space is not None and space not in (*NAMED, "", "unknown", "data"):
        raise InputError(f"{path}: its colours are '{space[:40]}', expected linear Rec. 709; export it as that")
    told = told or NAMED.get(space or "", REC709)
    if np.allclose(told, REC709, atol=2e-3):
        return None
    try:
        return to_rec709(told)
    except ValueError as error:
        raise InputError(f"{path}: its chromaticities cannot be used: {error}; export it in Rec. 709") from error


def _expect_picture(path: Path, spec: oiio.ImageSpec) -> None:
    """Square pixels, as many as the file may hold, laid out flat. Raises: InputError."""
    aspect = spec.get_float_attribute("PixelAspectRatio", 1.0)
    if abs(aspect - 1) > 0.01:
        raise InputError(f"{path}: pixels {aspect:g} times as wide as high, expected square ones; export it again")
    if spec.full_width * spec.full_height > PIXELS_A_BYTE * path.stat().st_size:
        announced = f"{spec.full_width} x {spec.full_height} pixels"
        raise InputError(f"{path}: its header announces {announced}, too many for so small a file; export it again")
    if spec.get_string_attribute("textureformat").startswith("CubeFace"):
        raise InputError(f"{path}: an environment of cube faces, expected latitude-longitude; reproject it first")


def _displayed(pixels: NDArray[np.float32], spec: oiio.ImageSpec) -> NDArray[np.float32]:
    """The display window, in three colours, black where there is no data. Args: (h, w, 1 or 3)."""
    top, left = spec.y - spec.full_y, spec.x - spec.full_x
    bottom, right = top + spec.height, left + spec.width
    if (top, left, bottom, right) == (0, 0, spec.full_height, spec.full_width):
        return np.ascontiguousarray(np.broadcast_to(pixels, (*pixels.shape[:2], 3)))
    shown = np.zeros((spec.full_height, spec.full_width, 3), np.float32)
    inside = pixels[max(-top, 0) : max(spec.full_height - top, 0), max(-left, 0) : max(spec.full_width - left, 0)]
    shown[max(top, 0) : max(bottom, 0), max(left, 0) : max(right, 0)] = inside
    return shown
