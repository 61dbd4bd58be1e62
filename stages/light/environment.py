"""Environment lights: loading and checking, exact look-up, and the two forms that make them quick to integrate.

Latitude-longitude: u = 0.5 - atan2(y, x) / 2 pi, v = acos(z) / pi, z up; texel centres at +0.5, bilinear, u wraps,
v clamps; linear Rec. 709 radiance.

For integration a light is split into two parts whose sum it is: `Residual`, bounded and prefiltered in an equal-area
octahedral pyramid, and `Excess`, what rises above a bound (suns, lamps, bright windows), held as a list of texels with
their energy, so that it can be sampled in proportion.
"""

import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray

from stages.core.artifact import read_exr, write_exr
from stages.core.color import luminance
from stages.core.errors import InputError
from stages.core.images import read_image

MAX_REPAIRED = 0.01
"""A file of which more than this share of pixels is not usable radiance is refused, not mended."""


@dataclass(frozen=True)
class Environment:
    """A distant light. radiance: (H, 2 H, 3) float32, finite, not negative. name: its file's stem."""

    name: str
    radiance: NDArray[np.float32]


def load_environment(path: Path) -> tuple[Environment, int]:
    """Read a latitude-longitude .hdr or .exr light and mend single bad pixels.

    Negative radiance and NaN become 0, infinity becomes the largest finite value of the file.

    Returns:
        The light, and how many pixels were mended.
    Raises: InputError naming file, finding and expectation.
    """
    pixels = _read_rgb(path)
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
    if not mended.any():
        raise InputError(f"{path}: black everywhere, so no light falls on the object; choose another environment")
    return Environment(path.stem, np.ascontiguousarray(mended, np.float32)), int(bad.sum())


def save_environment(path: Path, environment: Environment) -> None:
    """Write the radiance as a float EXR with channels R, G, B."""
    write_exr(path, {c: environment.radiance[..., i] for i, c in enumerate("RGB")})


def _read_rgb(path: Path) -> NDArray[np.float32]:
    if not path.is_file():
        raise InputError(f"{path}: no such file; expected a .hdr or .exr environment")
    if path.suffix.lower() == ".exr":
        channels = read_exr(path, InputError).channels
        by_name = {name.split(".")[-1].upper(): name for name in channels}
        if not all(c in by_name for c in "RGB"):
            raise InputError(f"{path}: channels {', '.join(sorted(channels))}, expected R, G and B")
        return np.stack([channels[by_name[c]].astype(np.float32) for c in "RGB"], -1)
    if path.suffix.lower() == ".hdr":
        pixels = read_image(path)
        if pixels.shape[-1] < 3:
            raise InputError(f"{path}: {pixels.shape[-1]} channels, expected 3")
        return pixels[..., :3]
    raise InputError(f"{path}: a '{path.suffix}' file, expected .hdr or .exr")


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


@numba.njit(error_model="numpy", cache=True, nogil=True)
def lookup(radiance, directions):  # type: ignore[no-untyped-def]
    """Bilinear radiance along unit directions. Args: (H, W, 3), (N, 3) world. Returns: (N, 3) float64."""
    height, width, _ = radiance.shape
    result = np.empty((len(directions), 3))
    for i in range(len(directions)):
        x, y, z = directions[i, 0], directions[i, 1], directions[i, 2]
        u = (0.5 - math.atan2(y, x) / (2 * math.pi)) * width - 0.5
        v = math.acos(min(max(z, -1.0), 1.0)) / math.pi * height - 0.5
        column, row = math.floor(u), math.floor(v)
        fu, fv = u - column, v - row
        left, right = int(column) % width, (int(column) + 1) % width
        top, bottom = min(max(int(row), 0), height - 1), min(max(int(row) + 1, 0), height - 1)
        for c in range(3):
            above = radiance[top, left, c] * (1 - fu) + radiance[top, right, c] * fu
            below = radiance[bottom, left, c] * (1 - fu) + radiance[bottom, right, c] * fu
            result[i, c] = above * (1 - fv) + below * fv
    return result


# ------------------------------------------------------------------------------- equal-area octahedral square


@numba.njit(inline="always", error_model="numpy", cache=True)
def direction_to_square(x, y, z):  # type: ignore[no-untyped-def]
    """Unit direction to [0, 1]^2, area-preserving. Source: Clarberg 2008, "Fast Equal-Area Mapping", Eq. 8-10."""
    radius = math.sqrt(max(1 - abs(z), 0.0))
    a, b = abs(x), abs(y)
    phi = math.atan2(b, a) * (2 / math.pi)
    v = phi * radius
    u = radius - v
    if z < 0:
        u, v = 1 - v, 1 - u
    u = u if x >= 0 else -u
    v = v if y >= 0 else -v
    return (u + 1) * 0.5, (v + 1) * 0.5


@numba.njit(inline="always", error_model="numpy", cache=True)
def square_to_direction(u, v):  # type: ignore[no-untyped-def]
    """[0, 1]^2 to a unit direction, the inverse of `direction_to_square`."""
    u, v = 2 * u - 1, 2 * v - 1
    a, b = abs(u), abs(v)
    distance = 1 - (a + b)
    radius = 1 - abs(distance)
    phi = ((b - a) / radius + 1) * (math.pi / 4) if radius > 0 else 0.0
    z = 1 - radius * radius
    z = z if distance >= 0 else -z
    scale = radius * math.sqrt(max(2 - radius * radius, 0.0))
    x, y = math.cos(phi) * scale, math.sin(phi) * scale
    return (x if u >= 0 else -x), (y if v >= 0 else -y), z


@numba.njit(error_model="numpy", cache=True, nogil=True)
def _octahedral(radiance, size, oversample):  # type: ignore[no-untyped-def]
    """The light on the octahedral square, each texel the mean of oversample^2 look-ups. Returns: (size, size, 3)."""
    result = np.zeros((size, size, 3))
    w = np.empty((oversample * oversample, 3))
    for row in range(size):
        for column in range(size):
            for a in range(oversample):
                for b in range(oversample):
                    v, u = (row + (a + 0.5) / oversample) / size, (column + (b + 0.5) / oversample) / size
                    i = a * oversample + b
                    w[i, 0], w[i, 1], w[i, 2] = square_to_direction(u, v)
            values = lookup(radiance, w)
            for i in range(len(w)):
                for c in range(3):
                    result[row, column, c] += values[i, c] / len(w)
    return result


# ------------------------------------------------------------------------------------------ the split of a light

SQUARE = 512
"""Side of the residual's finest level: 4.8e-5 sr a texel, near that of a 1024 x 512 light."""

OVERSAMPLE = 3
FINE_ROWS = 1024
"""The excess lives on a FINE_ROWS x 2 FINE_ROWS latitude-longitude grid, constant within a texel."""

BOUND = 4.0
"""The residual's bound, as a multiple of its own mean luminance."""

MAX_LIGHTS = 5
"""Environments that one `LightSet` integrates together; more are taken in turns."""


@dataclass(frozen=True)
class LightSet:
    """Up to MAX_LIGHTS environments, stacked for integration. C = 3 x environments, padded to a multiple of 8.

    pyramid: (texels of all levels, C) float32; level l starts at level_start[l] and is SQUARE >> l wide.
    fine: (FINE_ROWS * 2 FINE_ROWS, environments, 4) float32, excess RGB and its sampling density (1/sr); only where
    `occupied` (FINE_ROWS / 2, FINE_ROWS) says that any is not 0.
    texels, cumulative: per environment, excess texels along a Morton curve and their cumulative share of energy.
    radiance: the untouched lights.
    """

    environments: tuple[Environment, ...]
    pyramid: NDArray[np.float32]
    level_start: NDArray[np.int64]
    fine: NDArray[np.float32]
    occupied: NDArray[np.bool_]
    texels: tuple[NDArray[np.int32], ...]
    cumulative: tuple[NDArray[np.float64], ...]
    excess_share: tuple[float, ...]


def light_set(environments: list[Environment]) -> LightSet:
    """Split each light in residual and excess and build the structures that sample them."""
    assert 0 < len(environments) <= MAX_LIGHTS
    fine = np.zeros((FINE_ROWS, 2 * FINE_ROWS, len(environments), 4), np.float32)

    def prepare(e: int) -> tuple[NDArray, float, NDArray, NDArray]:
        residual, excess = split(environments[e].radiance)
        return _octahedral(residual, SQUARE, OVERSAMPLE), *_excess_grid(excess, environments[e].radiance, fine[:, :, e])

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        squares, shares, texels, cumulative = zip(*pool.map(prepare, range(len(environments))), strict=True)
    pyramid, start = _pyramid(np.concatenate(squares, -1))
    occupied = np.asarray((fine[..., 3] > 0).any(-1).reshape(FINE_ROWS // 2, 2, FINE_ROWS, 2).any((1, 3)))
    return LightSet(
        tuple(environments),
        pyramid,
        start,
        fine.reshape(-1, len(environments), 4),
        occupied,
        texels,
        cumulative,
        shares,
    )


def split(radiance: NDArray) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Residual of bounded luminance and the excess over it; hue is kept and the two add up to the light.

    Returns:
        residual, excess: (H, W, 3).
    """
    light = luminance(radiance.astype(np.float64))
    weight = directions_of_texels(*light.shape)[1][:, None] / (4 * np.pi)
    bound = light.max()
    for _ in range(16):
        bound = min(bound, BOUND * float((np.minimum(light, bound) * weight).sum()))
    kept = np.minimum(1.0, bound / np.maximum(light, np.finfo(np.float64).tiny))
    residual = (radiance * kept[..., None]).astype(np.float32)
    return residual, (radiance - residual).clip(0.0, None)


def _pyramid(base: NDArray) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    count = base.shape[-1]
    padded = np.zeros((*base.shape[:2], (count + 7) // 8 * 8))
    padded[..., :count] = base
    levels, start, size = [], [], 0
    while True:
        start.append(size)
        levels.append(padded.reshape(-1, padded.shape[-1]).astype(np.float32))
        size += len(levels[-1])
        if padded.shape[0] == 1:
            return np.concatenate(levels), np.array(start, np.int64)
        half = padded.shape[0] // 2
        padded = padded.reshape(half, 2, half, 2, -1).mean((1, 3))


def _excess_grid(excess: NDArray, radiance: NDArray, out: NDArray) -> tuple[float, NDArray, NDArray]:
    """Fill one light's part of the fine grid; return its share of energy, texel order and cumulative energy."""
    rows, columns = FINE_ROWS, 2 * FINE_ROWS
    _, row_angle = directions_of_texels(rows, columns)
    resample_average(excess.astype(np.float32), out)
    energy = luminance(out[..., :3].astype(np.float64)) * row_angle[:, None]
    total = energy.sum()
    whole = (luminance(radiance.astype(np.float64)) * directions_of_texels(*radiance.shape[:2])[1][:, None]).sum()
    if total <= 1e-4 * whole:
        out[:] = 0
        return 0.0, np.zeros(0, np.int32), np.zeros(0)
    out[..., 3] = energy / total / row_angle[:, None]
    index = np.flatnonzero(energy).astype(np.int64)
    index = index[np.argsort(_morton(index // columns, index % columns), kind="stable")]
    return float(total / whole), index.astype(np.int32), np.cumsum(energy.ravel()[index]) / total


@numba.njit(error_model="numpy", cache=True, nogil=True)
def resample_average(radiance, out):  # type: ignore[no-untyped-def]
    """Average the bilinear light over each texel of a finer or coarser latitude-longitude grid (midpoints).

    Args:
        radiance: (h, w, 3). out: (H, W, >= 3), written in its first three channels.
    """
    height, width, _ = radiance.shape
    rows, columns, _ = out.shape
    n = max(2, int(math.ceil(2 * height / rows)))
    reach = max(1, int(math.ceil(height / rows)))
    near = np.zeros((height, width), np.bool_)
    for row in range(height):
        for column in range(width):
            if radiance[row, column].max() > 0:
                for a in range(max(row - reach, 0), min(row + reach, height - 1) + 1):
                    for b in range(column - reach, column + reach + 1):
                        near[a, b % width] = True
    for row in range(rows):
        for column in range(columns):
            for c in range(3):
                out[row, column, c] = 0
            if not near[int((row + 0.5) / rows * height), int((column + 0.5) / columns * width)]:
                continue
            for a in range(n):
                v = (row + (a + 0.5) / n) / rows * height - 0.5
                top = int(math.floor(v))
                fv = v - top
                y0, y1 = min(max(top, 0), height - 1), min(max(top + 1, 0), height - 1)
                for b in range(n):
                    u = (column + (b + 0.5) / n) / columns * width - 0.5
                    left = int(math.floor(u))
                    fu = u - left
                    x0, x1 = left % width, (left + 1) % width
                    for c in range(3):
                        above = radiance[y0, x0, c] * (1 - fu) + radiance[y0, x1, c] * fu
                        below = radiance[y1, x0, c] * (1 - fu) + radiance[y1, x1, c] * fu
                        out[row, column, c] += (above * (1 - fv) + below * fv) / (n * n)


def _morton(row: NDArray, column: NDArray) -> NDArray[np.int64]:
    code = np.zeros_like(row)
    for bit in range(12):
        code |= ((column >> bit) & 1) << (2 * bit) | ((row >> bit) & 1) << (2 * bit + 1)
    return code
