"""Environment lights in the form that is quick to integrate, several at once.

A light is split into two parts whose sum it is, both on the octahedral square: the *residual*, bounded and prefiltered
in a pyramid, which any ray may look up at the solid angle it stands for; and the *excess*, what rises above the bound
(suns, lamps, bright windows), which is drawn in proportion to its energy, cell by cell.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stages.core.color import luminance
from stages.core.parallel import cores
from stages.light.environment import Environment, directions_of_texels
from stages.light.lamps import Lamps, cluster
from stages.light.octahedral import octahedral, texel_directions

SQUARE = 512
"""Side of the residual's finest level: 4.8e-5 sr a texel, near that of a 1024 x 512 light."""

FINE = 512
"""Side of the excess's square, constant within a texel: 0.4 degrees."""

OVERSAMPLE, OVERSAMPLE_EXCESS = 3, 8
"""Look-ups along each side of a texel; a sun is smaller than a texel, and its energy must come out right."""

LARGEST_CELL, CELLS = 8, 64
"""Cells by which light rays are aimed, along each side of the square: from 25 degrees to 3."""

CUT = 8e-3
"""Share of its environment's excess above which a cell of 1/16 of the side is cut in four; one of half that side is worth four
times as much."""

LEAST_EXCESS = 1e-4
"""An excess of less than this share of the energy is not worth rays of its own."""

BOUND = 4.0
"""The residual's bound, as a multiple of its own mean luminance."""

MAX_LIGHTS = 5
"""Environments that one `LightSet` integrates together; more are taken in turns."""

CHANNELS = 16
"""Floats of a texel: one cache line, enough for MAX_LIGHTS in RGB and one to spare, which the kernels use."""


@dataclass(frozen=True)
class LightSet:
    """Up to MAX_LIGHTS environments, stacked for integration: channels 3 e to 3 e + 2 are environment e.

    pyramid: (texels of all levels, CHANNELS) float32, the residual; level l starts at level_start[l], is SQUARE >> l
    wide and has a border of one texel that continues it across the square's edge.
    fine: (4 N, CHANNELS) float32, the excess in blocks of 2 x 2 texels. block: (FINE / 2, FINE / 2) int32, a block's
    number, or -1 where there is no excess.
    density: (4 N, MAX_LIGHTS) float32, density (1/sr) of directions drawn by the energy of each environment's excess.
    texels: the same, one environment after the other, to be drawn from.
    cells: squares that hold excess, small where it is bright.
    lamps: the excess again, in clusters that are small where it is bright.
    demand: (environments,) how light rays are best shared out: the noise that one ray in each would leave, as a share of the
    environment's mean, for a dim one is exposed longer.
    """

    environments: tuple[Environment, ...]
    pyramid: NDArray[np.float32]
    level_start: NDArray[np.int64]
    fine: NDArray[np.float32]
    block: NDArray[np.int32]
    density: NDArray[np.float32]
    texels: "Texels"
    cells: "Cells"
    lamps: Lamps
    demand: NDArray[np.float64]

    @property
    def has_excess(self) -> NDArray[np.bool_]:
        """Which environments have light rays at all."""
        return np.diff(self.cells.first) > 0


class Texels(NamedTuple):
    """The excess texels of one environment after the other, along a Morton curve, on which every cell is a stretch: T in all.

    lot: (T, 4) float32, of the energy of its cell what lies before a texel on the curve, and its own share; its column and row.
    guide: (T,) int32, the i-th of a cell's n texels holds which one of them is met at i / n of the cell's energy. radiance:
    (T, 3) float32.
    """

    lot: NDArray[np.float32]
    guide: NDArray[np.int32]
    radiance: NDArray[np.float32]


@dataclass(frozen=True)
class Cells:
    """The excess of all environments in coarse cells, environment by environment: K in all.

    direction: (3, K) float32, mean. radius: (K,) float32, radians, of a disc as large as a cell. energy: (K,) float32, share of
    their environment's. begin: (K, 2) int64, range of texels. first: (environments + 1,) int64, where an environment's cells
    begin. number: (environments, CELLS, CELLS) int32, which cell a square belongs to, or -1.
    """

    direction: NDArray[np.float32]
    radius: NDArray[np.float32]
    energy: NDArray[np.float32]
    begin: NDArray[np.int64]
    first: NDArray[np.int64]
    number: NDArray[np.int32]


def light_set(environments: list[Environment]) -> LightSet:
    """Split each light in residual and excess and build the structures that sample them."""
    assert 0 < len(environments) <= MAX_LIGHTS

    def prepare(environment: Environment) -> tuple[NDArray, NDArray]:
        residual, excess = split(environment.radiance)
        return octahedral(residual, SQUARE, OVERSAMPLE), octahedral(excess, FINE, OVERSAMPLE_EXCESS)

    with ThreadPoolExecutor(cores()) as pool:
        squares, peaks = zip(*pool.map(prepare, environments), strict=True)
    pyramid, start = _pyramid(np.concatenate(squares, -1))
    for square, peak in zip(squares, peaks, strict=True):
        if luminance(peak).mean() <= LEAST_EXCESS * luminance(square).mean():
            peak[:] = 0
    energy = np.stack([luminance(peak.astype(np.float64)) for peak in peaks], -1)
    energy /= np.maximum(energy.sum((0, 1)), np.finfo(np.float64).tiny)
    fine, block = _blocks(np.concatenate(peaks, -1))
    density = np.zeros((len(fine), MAX_LIGHTS), np.float32)
    density[:, : len(environments)] = _in_blocks(energy, block >= 0) * (FINE**2 / (4 * np.pi))
    texels, cells = _cells(energy, peaks)
    demand = np.array([_demand(*parts) for parts in zip(squares, peaks, np.moveaxis(energy, -1, 0), strict=True)])
    whole = [luminance(square).mean() + luminance(peak).mean() for square, peak in zip(squares, peaks, strict=True)]
    lamps = cluster(np.stack(peaks), np.array(whole), CHANNELS)
    return LightSet(tuple(environments), pyramid, start, fine, block, density, texels, cells, lamps, demand)


def _demand(residual: NDArray, excess: NDArray, energy: NDArray) -> float:
    """Share of the light that is excess, times how unsure it is which of 32 x 32 squares a ray goes to."""
    energy = energy.reshape(32, FINE // 32, 32, FINE // 32).sum((1, 3))
    bright = float(luminance(excess).mean())
    mean = bright + float(luminance(residual).mean())
    return bright / max(mean, np.finfo(float).tiny) * float(np.sqrt(max(1 - np.square(energy).sum(), 0.0)))


def _cells(energy: NDArray, peaks: Sequence[NDArray]) -> tuple[Texels, Cells]:
    """Texels with energy, and the cells. Args: (FINE, FINE, environments), each of sum 1; the excess, (FINE, FINE, 3) each."""
    side = FINE // CELLS
    x, y, z = texel_directions(FINE)
    texels: list[NDArray] = []
    energies: list[NDArray] = []
    radiance: list[NDArray] = []
    direction: list[list[NDArray]] = []
    radius: list[NDArray] = []
    share: list[NDArray] = []
    begin: list[NDArray] = []
    first = [0]
    number = np.full((energy.shape[-1], CELLS, CELLS), -1, np.int32)
    for e in range(energy.shape[-1]):
        own = energy[..., e].ravel()
        index = np.flatnonzero(own)
        code = _morton(index // FINE, index % FINE)
        order = np.argsort(code, kind="stable")
        index = index[order]
        corner, across = _cut(code[order], own[index])
        begins = np.diff(corner, prepend=-1) != 0
        start = np.flatnonzero(begins)
        if len(start):
            radius.append(np.sqrt(4 / across[start] ** 2))
            share.append(np.add.reduceat(own[index], start))
            direction.append([np.add.reduceat((own * axis.ravel())[index], start) for axis in (x, y, z)])
            begin.append(np.stack([start, np.append(start[1:], len(index))], -1) + sum(map(len, texels)))
            number[e, index // FINE // side, index % FINE // side] = np.cumsum(begins) - 1 + first[-1]
        first.append(first[-1] + len(start))
        texels.append(index)
        energies.append(own[index])
        radiance.append(peaks[e].reshape(-1, 3)[index].astype(np.float32))
    mean = np.concatenate([np.zeros((3, 0)), *direction], 1)
    cells = Cells(
        (mean / np.linalg.norm(mean, axis=0)).astype(np.float32),
        np.concatenate([np.zeros(0), *radius]).astype(np.float32),
        np.concatenate([np.zeros(0), *share]).astype(np.float32),
        np.concatenate([np.zeros((0, 2), np.int64), *begin]),
        np.array(first),
        number,
    )
    before, part = _shares(np.concatenate(energies), cells.begin)
    row, column = np.divmod(np.concatenate(texels), FINE)
    lot = np.stack([before, part, column, row], -1).astype(np.float32)
    return Texels(lot, _guide(before, cells.begin), np.concatenate(radiance)), cells


def _shares(energy: NDArray[np.float64], begin: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Of the energy of their cell, what lies before each texel and its own share: (T,) each."""
    length = begin[:, 1] - begin[:, 0]
    share = energy / np.add.reduceat(energy, begin[:, 0]).repeat(length) if len(energy) else energy
    before = np.cumsum(share) - share
    return (before - before[begin[:, 0]].repeat(length)).clip(0, 1), share


def _cut(code: NDArray[np.int64], energy: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The cell of each texel on the Morton curve: the code that it begins with, and how many such cells lie along a side."""
    size, corner, across = LARGEST_CELL, np.zeros_like(code), np.zeros_like(code)
    uncut = np.ones(len(code), bool)
    while True:
        begin = code // (FINE // size) ** 2 * (FINE // size) ** 2
        corner[uncut], across[uncut] = begin[uncut], size
        if size == CELLS:
            return corner, across
        _, inside = np.unique(begin, return_inverse=True)
        uncut &= np.bincount(inside, energy)[inside] > CUT * (size / 16) ** 2
        size *= 2


def _guide(before: NDArray[np.float64], begin: NDArray[np.int64]) -> NDArray[np.int32]:
    """`Texels.guide`. Source: Chen & Asau 1974, "On Generating Random Variates from an Empirical Distribution"."""
    cell = np.arange(len(begin)).repeat(begin[:, 1] - begin[:, 0])
    start, end = begin[cell].T
    energy = (np.arange(len(start)) - start) / (end - start)
    return (np.searchsorted(cell + before, cell + energy, "right") - 1).clip(start, end - 1).astype(np.int32)


def _blocks(peaks: NDArray) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """The 2 x 2 blocks of a (FINE, FINE, C) image that hold any excess, and where they are."""
    used = np.asarray(peaks.any(-1).reshape(FINE // 2, 2, FINE // 2, 2).any((1, 3)))
    fine = np.zeros((4 * int(used.sum()), CHANNELS), np.float32)
    fine[:, : peaks.shape[-1]] = _in_blocks(peaks, used)
    return fine, np.where(used, np.cumsum(used).reshape(used.shape) - 1, -1).astype(np.int32)


def _in_blocks(image: NDArray, used: NDArray) -> NDArray:
    """The texels of the used 2 x 2 blocks: (4 N, C)."""
    half = FINE // 2
    return image.reshape(half, 2, half, 2, -1).swapaxes(1, 2)[used].reshape(-1, image.shape[-1])


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
    level, used = base.astype(np.float64), base.shape[-1]
    levels, start = [], [0]
    while True:
        levels.append(np.zeros(((len(level) + 2) ** 2, CHANNELS), np.float32))
        levels[-1][:, :used] = bordered(level).reshape(-1, used)
        if len(level) == 1:
            return np.concatenate(levels), np.array(start, np.int64)
        start.append(start[-1] + len(levels[-1]))
        half = len(level) // 2
        level = level.reshape(half, 2, half, 2, used).mean((1, 3))


def bordered(square: NDArray) -> NDArray:
    """One texel added all around: over an edge of the octahedral square the sphere goes on mirrored along that edge."""
    size = len(square)
    result = np.empty((size + 2, size + 2, square.shape[-1]))
    result[1:-1, 1:-1] = square
    result[0, 1:-1], result[-1, 1:-1] = square[0, ::-1], square[-1, ::-1]
    result[1:-1, 0], result[1:-1, -1] = square[::-1, 0], square[::-1, -1]
    result[0, 0], result[0, -1], result[-1, 0], result[-1, -1] = square[-1, -1], square[-1, 0], square[0, -1], square[0, 0]
    return result


def _morton(row: NDArray, column: NDArray) -> NDArray[np.int64]:
    code = np.zeros_like(row)
    for bit in range(12):
        code |= ((column >> bit) & 1) << (2 * bit) | ((row >> bit) & 1) << (2 * bit + 1)
    return code
