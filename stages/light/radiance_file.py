"""Radiance pictures (.hdr): any orientation, flat or either run-length encoding, RGBE and XYZE.

Source: Greg Ward, "Radiance File Formats", and "Real Pixels" (Graphics Gems II, 1991). Header lines that change what the
numbers mean are undone (EXPOSURE, COLORCORR), applied (PRIMARIES) or refused (GAMMA, PIXASPECT); others say nothing of
radiance. XYZE is taken as CIE XYZ with Rec. 709's white, in the file's own unit.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.core.color import REC709, rgb_to_xyz, to_rec709
from stages.core.errors import InputError
from stages.core.parallel import compiled

FORMATS = ("32-bit_rle_rgbe", "32-bit_rle_xyze")
PIXELS_A_BYTE = 1024
"""No light worth its name packs more pixels into one byte of its file."""

_RESOLUTION = re.compile(rb"([-+])([XY])\s+(\d{1,6})\s+([-+])([XY])\s+(\d{1,6})\s*")


@dataclass(frozen=True)
class Header:
    """lines: name -> values in order. axes: "-Y", "+X" for the usual order, slower first. shape: pixels along each."""

    lines: dict[str, list[str]]
    axes: tuple[str, str]
    shape: tuple[int, int]
    end: int  # where the pixels begin


def read_radiance(path: Path) -> tuple[NDArray[np.float32], NDArray[np.float64] | None]:
    """Read a Radiance picture, top row first, left column first.

    Returns:
        (H, W, 3) as stored, exposure undone; the matrix (3, 3) that takes it to linear Rec. 709, or None where it is that.
    Raises: InputError.
    """
    data = path.read_bytes()
    header = _header(path, data)
    slow, fast = header.shape
    if slow * fast > PIXELS_A_BYTE * len(data):
        raise InputError(f"{path}: {len(data)} bytes, but its header announces {slow * fast} pixels; export it again")
    scale, matrix = _scale(path, header.lines), _matrix(path, header.lines)
    texels = np.empty((slow, fast, 4), np.uint8)
    done = _decode(np.frombuffer(data, np.uint8), header.end, texels)
    if done < slow:
        raise InputError(f"{path}: its pixels end, or are damaged, in line {done + 1} of {slow}; export it again")
    powers = np.ldexp(np.float32(1), np.arange(256) - 136).astype(np.float32)
    powers[0] = 0
    pixels = texels[..., :3] * powers[texels[..., 3], None]
    if any(scale != 1.0):
        pixels = (pixels / scale).astype(np.float32)
    return _turned(pixels, header.axes), matrix


def _header(path: Path, data: bytes) -> Header:
    """Raises: InputError."""
    if not data.startswith(b"#?"):
        raise InputError(f"{path}: not a Radiance picture; its first line does not begin with #?; save it as .hdr again")
    lines: dict[str, list[str]] = {}
    position = 0
    for line, position in _lines(data):
        if (found := _RESOLUTION.fullmatch(line)) and found[2] != found[5]:
            axes = (found[1] + found[2]).decode(), (found[4] + found[5]).decode()
            return Header(lines, axes, (int(found[3]), int(found[6])), position)
        name, equals, value = line.decode("latin-1").partition("=")
        if equals and not name.startswith("#"):
            lines.setdefault(name.strip(), []).append(value.strip())
    raise InputError(f"{path}: no line with its resolution, such as -Y 512 +X 1024, in the header; export it again")


def _lines(data: bytes) -> Iterator[tuple[bytes, int]]:
    """Lines of the first 64 KiB, and where the next one begins."""
    begin = 0
    while (end := data.find(b"\n", begin, 1 << 16)) >= 0:
        yield data[begin:end].rstrip(b"\r"), end + 1
        begin = end + 1


def _numbers(path: Path, name: str, text: str, count: int) -> NDArray[np.float64]:
    """Raises: InputError."""
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.zeros(0)
    if len(values) != count or not np.isfinite(values).all():
        numbers = "a number" if count == 1 else f"{count} numbers"
        raise InputError(f"{path}: {name}={text[:40]}, expected {numbers}; mend that line of its header")
    return values


def _scale(path: Path, lines: dict[str, list[str]]) -> NDArray[np.float64]:
    """What the pixels were multiplied by, (3,). Each line adds to those before. Raises: InputError."""
    scale = np.ones(3)
    for name, count in (("EXPOSURE", 1), ("COLORCORR", 3)):
        for text in lines.get(name, []):
            scale *= _numbers(path, name, text, count)
    if not ((scale > 0) & np.isfinite(scale)).all():
        raise InputError(f"{path}: an exposure of {scale[0]:g}, expected more than 0; mend that line of its header")
    for name in ("GAMMA", "PIXASPECT"):
        product = np.prod([_numbers(path, name, text, 1)[0] for text in lines.get(name, [])])
        if abs(product - 1) > 0.01:
            need = "linear radiance" if name == "GAMMA" else "square pixels"
            raise InputError(f"{path}: {name}={product:g}, expected {need}; export it again")
    return scale


def _matrix(path: Path, lines: dict[str, list[str]]) -> NDArray[np.float64] | None:
    """Raises: InputError."""
    form = lines.get("FORMAT", [FORMATS[0]])[-1]
    if form not in FORMATS:
        raise InputError(f"{path}: FORMAT={form[:40]}, expected one of {', '.join(FORMATS)}; export it again")
    if form == FORMATS[1]:
        return np.asarray(np.linalg.inv(rgb_to_xyz(REC709)), np.float64)
    told = [values for text in lines.get("PRIMARIES", []) if (values := _numbers(path, "PRIMARIES", text, 8)).any()]
    if not told or np.allclose(told[-1], REC709, atol=2e-3):  # Photoshop writes eight zeros
        return None
    try:
        return to_rec709(told[-1])
    except ValueError as error:
        raise InputError(f"{path}: its PRIMARIES cannot be used: {error}; export it in Rec. 709") from error


def _turned(pixels: NDArray[np.float32], axes: tuple[str, str]) -> NDArray[np.float32]:
    """Rows from the top, columns from the left."""
    if axes[0][1] == "X":
        pixels, axes = pixels.transpose(1, 0, 2), (axes[1], axes[0])
    pixels = pixels[::-1] if axes[0] == "+Y" else pixels
    return np.ascontiguousarray(pixels[:, ::-1] if axes[1] == "-X" else pixels)


@compiled
def _decode(data, position, texels):  # type: ignore[no-untyped-def]
    """Fill `texels`, (slow, fast, 4) uint8, from the bytes at `position`. Returns: whole lines found."""
    slow, fast, _ = texels.shape
    for line in range(slow):
        if position + 4 > len(data):
            return line
        separate = 8 <= fast <= 32767 and data[position] == 2 and data[position + 1] == 2 and data[position + 2] < 128
        if separate:
            if data[position + 2] * 256 + data[position + 3] != fast:
                return line
            position = _separate(data, position + 4, texels[line])
        else:
            position = _whole(data, position, texels[line])
        if position < 0:
            return line
    return slow


@compiled
def _separate(data, position, row):  # type: ignore[no-untyped-def]
    """One line of the newer encoding: the four components one after the other. Returns: the next position, or -1."""
    for component in range(4):
        at = 0
        while at < len(row):
            if position + 2 > len(data):
                return -1
            count, run = int(data[position]), data[position] > 128
            count = count - 128 if run else count
            if count == 0 or at + count > len(row) or (not run and position + 1 + count > len(data)):
                return -1
            for i in range(count):
                row[at + i, component] = data[position + 1 + (0 if run else i)]
            position += 2 if run else 1 + count
            at += count
    return position


@compiled
def _whole(data, position, row):  # type: ignore[no-untyped-def]
    """One line of whole pixels, where 1 1 1 n repeats the one before n times. Returns: the next position, or -1."""
    at, shift = 0, 0
    while at < len(row):
        if position + 4 > len(data):
            return -1
        if data[position] == 1 and data[position + 1] == 1 and data[position + 2] == 1:
            count = int(data[position + 3]) << shift
            if at == 0 or at + count > len(row):
                return -1
            for i in range(count):
                row[at + i] = row[at - 1]
            at += count
            shift = min(shift + 8, 24)
        else:
            row[at] = data[position : position + 4]
            at += 1
            shift = 0
        position += 4
    return position
