"""Lights as other programs write them, made byte by byte: Radiance pictures, and EXR files that our own writer never makes."""

import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import OpenEXR
from numpy.typing import NDArray

AXES = ("-Y +X", "+Y +X", "-Y -X", "+Y -X", "+X -Y", "-X -Y", "+X +Y", "-X +Y")


def rgbe(pixels: NDArray) -> NDArray[np.uint8]:
    """Shared-exponent texels. Args: (H, W, 3). Returns: (H, W, 4)."""
    _, exponent = np.frexp(pixels.max(-1))
    mantissa = np.floor(np.ldexp(pixels, (8 - exponent)[..., None]))
    return np.concatenate([mantissa, (exponent + 128)[..., None]], -1).astype(np.uint8)


def decoded(texels: NDArray[np.uint8]) -> NDArray[np.float32]:
    """What they mean. Source: Bruce Walter's rgbe.c, 1995."""
    return np.ldexp(texels[..., :3].astype(np.float32), texels[..., 3:].astype(int) - 136)


def flat(row: NDArray[np.uint8]) -> bytes:
    """A line, pixel by pixel."""
    return row.tobytes()


def old_runs(row: NDArray[np.uint8]) -> bytes:
    """A line, where 1 1 1 n repeats a pixel; long runs take several such, the lowest byte first."""
    result, at = b"", 0
    while at < len(row):
        run = 1
        while at + run < len(row) and (row[at + run] == row[at]).all():
            run += 1
        result += row[at].tobytes()
        rest = run - 1
        while rest:
            result += bytes([1, 1, 1, rest & 255])
            rest >>= 8
        at += run
    return result


def new_runs(row: NDArray[np.uint8]) -> bytes:
    """A line, component by component, runs of three and more packed."""
    result = bytes([2, 2, len(row) >> 8, len(row) & 255])
    for values in row.T:
        at = 0
        while at < len(values):
            run = 1
            while at + run < len(values) and run < 127 and values[at + run] == values[at]:
                run += 1
            result += bytes([128 + run, values[at]]) if run > 2 else bytes([1, values[at]])
            at += run if run > 2 else 1
    return result


def write_hdr(path: Path, texels: NDArray[np.uint8], axes: str = "-Y +X", line=flat, header: str = "") -> Path:  # type: ignore[no-untyped-def]
    """A Radiance picture whose pixels, seen the right way up, are `texels`; `header` holds further lines."""
    slow, fast = axes.split()
    stored = texels if "+Y" not in axes else texels[::-1]
    stored = stored if "-X" not in axes else stored[:, ::-1]
    stored = stored if slow[1] == "Y" else stored.transpose(1, 0, 2)
    text = f"#?RADIANCE\n# a light\nFORMAT=32-bit_rle_rgbe\n{header}\n{slow} {len(stored)} {fast} {stored.shape[1]}\n"
    path.write_bytes(text.encode() + b"".join(line(np.ascontiguousarray(row)) for row in stored))
    return path


def rgb(pixels: NDArray, layer: str = "") -> dict[str, NDArray]:
    """Channels of (H, W, 3) by name."""
    return {f"{layer}{c}": pixels[..., i].copy() for i, c in enumerate("RGB")}


def write_exr(path: Path, *parts: Mapping[str, NDArray], **header: object) -> Path:
    """An EXR file of several parts, of which each has the channels given, its number as a name and the same header."""
    common = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION, **header}
    if len(parts) == 1:
        OpenEXR.File(common, dict(parts[0])).write(str(path))
    else:
        OpenEXR.File([OpenEXR.Part(dict(common), dict(part), f"part{i}") for i, part in enumerate(parts)]).write(str(path))
    return path


def window(left: int, top: int, right: int, bottom: int) -> tuple[NDArray, NDArray]:
    """A box that ends before `right` and `bottom`."""
    return np.array([left, top], "i4"), np.array([right - 1, bottom - 1], "i4")


def write_sampled(path: Path, channels: Mapping[str, tuple[NDArray[np.float32], int]]) -> Path:
    """An uncompressed EXR file. Args: channels: name -> values, and every how many pixels there is one."""
    height, width = max((values.shape for values, _ in channels.values()))
    listed = b"".join(
        name.encode() + b"\0" + struct.pack("<iBxxxii", 2, 0, step, step) for name, (_, step) in sorted(channels.items())
    )
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    attributes = {
        "channels": ("chlist", listed + b"\0"),
        "compression": ("compression", b"\0"),
        "dataWindow": ("box2i", box),
        "displayWindow": ("box2i", box),
        "lineOrder": ("lineOrder", b"\0"),
        "pixelAspectRatio": ("float", struct.pack("<f", 1)),
        "screenWindowCenter": ("v2f", bytes(8)),
        "screenWindowWidth": ("float", struct.pack("<f", 1)),
    }
    head = b"v/1\x01\x02\0\0\0" + b"".join(
        f"{name}\0{kind}\0".encode() + struct.pack("<I", len(value)) + value for name, (kind, value) in attributes.items()
    )
    lines = []
    for y in range(height):
        held = [values[y // step].tobytes() for _, (values, step) in sorted(channels.items()) if y % step == 0]
        lines.append(struct.pack("<iI", y, sum(map(len, held))) + b"".join(held))
    begin = len(head) + 1 + 8 * height
    offsets = np.cumsum([begin, *map(len, lines[:-1])]).astype("<u8")
    path.write_bytes(head + b"\0" + offsets.tobytes() + b"".join(lines))
    return path
