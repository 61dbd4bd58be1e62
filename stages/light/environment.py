"""Environment lights: loading and checking, saving, exact look-up.

Latitude-longitude: u = 0.5 - atan2(y, x) / 2 pi, v = acos(z) / pi, z up; texel centres at +0.5, bilinear, u wraps,
v clamps; linear Rec. 709 radiance.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.core.artifact import reason, write_exr
from stages.core.errors import InputError
from stages.core.parallel import compiled
from stages.light.radiance_file import read_radiance

MAX_REPAIRED = 0.01
"""A file of which more than this share of pixels is not usable radiance is refused, not mended."""

OUTSIDE = 1e-3
"""A colour counts as outside Rec. 709 when its least component is below minus this share of its largest."""


@dataclass(frozen=True, eq=False)
class Environment:
    """A distant light, equal to itself alone. radiance: (H, 2 H, 3) float32, finite, not negative. name: its file's stem."""

    name: str
    radiance: NDArray[np.float32]


def load_environment(path: Path) -> tuple[Environment, int]:
    """Read a latitude-longitude .hdr or .exr light, bring it to linear Rec. 709, and mend single bad pixels.

    Negative radiance and NaN become 0, infinity becomes the largest finite value of the file, and so does a colour outside
    Rec. 709 lose its negative part.

    Returns:
        The light, and how many pixels were mended.
    Raises: InputError naming file, finding and expectation.
    """
    pixels, to_rec709 = _read(path)
    height, width, _ = pixels.shape
    if width != 2 * height or height < 2:
        raise InputError(
            f"{path}: {width} x {height} pixels, expected width = 2 x height (latitude-longitude); reproject it first"
        )
    finite = np.isfinite(pixels)
    bad = (~finite | (pixels < 0)).any(-1)
    if bad.mean() > MAX_REPAIRED and (~finite).any(-1).mean() > MAX_REPAIRED:
        raise InputError(
            f"{path}: {int((~finite).any(-1).sum())} of {bad.size} pixels are infinite or not a number; "
            "export it again in 32-bit float"
        )
    if (pixels < 0).any(-1).mean() > 0.5:
        raise InputError(f"{path}: most pixels are negative, expected linear radiance; export it again without offset")
    largest = pixels[finite].max(initial=0.0)
    mended = np.nan_to_num(pixels, nan=0.0, posinf=largest, neginf=0.0).clip(0.0, None)
    if to_rec709 is not None:
        mended = (mended @ to_rec709.T).astype(np.float32)
        bad |= (mended < -OUTSIDE * mended.max(-1, keepdims=True)).any(-1)
        mended = mended.clip(0.0, None)
    if not mended.any():
        raise InputError(f"{path}: black everywhere, so no light falls on the object; choose another environment")
    return Environment(path.stem, np.ascontiguousarray(mended, np.float32)), int(bad.sum())


def save_environment(path: Path, environment: Environment) -> None:
    """Write the radiance as a float EXR with channels R, G, B."""
    write_exr(path, {c: environment.radiance[..., i] for i, c in enumerate("RGB")})


def _read(path: Path) -> tuple[NDArray[np.float32], NDArray[np.float64] | None]:
    """Pixels (H, W, 3) as stored, and the matrix to linear Rec. 709 or None. Raises: InputError."""
    from stages.light.exr_light import read_exr_light  # compiled functions keep this module's names, and OpenImageIO minds

    if not path.is_file():
        raise InputError(f"{path}: no such file; expected a .hdr or .exr environment")
    try:
        if path.suffix.lower() == ".exr":
            return read_exr_light(path)
        if path.suffix.lower() in (".hdr", ".pic"):
            return read_radiance(path)
    except OSError as error:
        raise InputError(f"{path}: {reason(error)}; give a .hdr or .exr file that can be read") from error
    raise InputError(f"{path}: a '{path.suffix}' file, expected .hdr or .exr; save it as one of them")


def directions_of_texels(height: int, width: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """World direction of every texel centre and every row's solid angle per texel.

    Returns:
        directions: (H, W, 3) unit. solid_angle: (H,) sr, exact.
    """
    phi = (0.5 - (np.arange(width) + 0.5) / width) * 2 * np.pi
    edges = np.cos(np.arange(height + 1) / height * np.pi)
    theta = (np.arange(height) + 0.5) / height * np.pi
    sin, cos = np.sin(theta)[:, None], np.cos(theta)[:, None]
    directions = np.stack(np.broadcast_arrays(sin * np.cos(phi), sin * np.sin(phi), cos), -1)
    return directions, (edges[:-1] - edges[1:]) * 2 * np.pi / width


@compiled
def lookup(radiance, directions):  # type: ignore[no-untyped-def]
    """Bilinear radiance along unit directions. Args: (H, W, 3), (N, 3) world. Returns: (N, 3) float64."""
    result = np.empty((len(directions), 3))
    for i in range(len(directions)):
        bilinear(radiance, directions[i], result[i])
    return result


@compiled
def bilinear(radiance, direction, found):  # type: ignore[no-untyped-def]
    """Write the bilinear radiance along one unit direction, (3,), into `found`, (3,)."""
    height, width, _ = radiance.shape
    u = (0.5 - math.atan2(direction[1], direction[0]) / (2 * math.pi)) * width
    v = math.acos(min(max(direction[2], -1.0), 1.0)) / math.pi * height
    found[0], found[1], found[2] = bilinear_at(radiance, u, v)


@compiled(inline="always")
def _mixed(rows, left, right, weights, c):  # type: ignore[no-untyped-def]
    above, below = rows
    one, other = above[left, c] * weights[0] + above[right, c] * weights[1], below[left, c] * weights[2]
    return one + other + below[right, c] * weights[3]


@compiled(inline="always")
def bilinear_at(radiance, u, v):  # type: ignore[no-untyped-def]
    """The bilinear radiance at column u, 0 to the width, and row v; texels' centres are at +0.5."""
    height, width, _ = radiance.shape
    u, v = u - 0.5, v - 0.5
    column, row = math.floor(u), math.floor(v)
    fu, fv = u - column, v - row
    left = int(column) if column >= 0 else width - 1
    right = left + 1 if left + 1 < width else 0
    top, bottom = min(max(int(row), 0), height - 1), min(max(int(row) + 1, 0), height - 1)
    weights = (1 - fu) * (1 - fv), fu * (1 - fv), (1 - fu) * fv, fu * fv
    rows = radiance[top], radiance[bottom]
    return _mixed(rows, left, right, weights, 0), _mixed(rows, left, right, weights, 1), _mixed(rows, left, right, weights, 2)
