"""What substances are made of: noise with a spectrum, cells, spots, strokes, tiles and threads.

Every pattern is a function of a `Place` and holds nothing finer than its footprint: octaves fade out as they reach it, edges
are averaged over it, and what faded from below a threshold is put back as a softer edge (`threshold`). Lengths are metres.
Where the place repeats, lengths are rounded so that a whole number of them fits its period. """

import math
from dataclasses import replace
from functools import cache
from statistics import NormalDist
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stages.material import heap_kernels as heaps
from stages.material import noise_kernels as kernels
from stages.material import scatter_kernels as scattered
from stages.material.heap_kernels import Pieces
from stages.material.noise_kernels import Octave, Period, Shape
from stages.material.place import Axes, Place
from stages.material.scatter_kernels import Strokes

Array = NDArray[Any]
"""float32, or what it was mixed with."""

SQUARE: Axes = (1.0, 1.0, 1.0)

NONE = np.empty(0, np.float32)
"""No envelope."""


class Spectrum(NamedTuple):
    """How noise is made up, octave by octave.

    size: wavelength of its widest octave, metres. finest: of its narrowest. rise: deviation of an octave, times that of the
    next wider one: 1 is as much contrast at every scale, as real materials have, 0.5 is smooth. stretch: lengths along the
    axes, as multiples. tails: 0 a normal distribution; 0.5 rare strong grains. skew: 0.3 grains are light on dark, −0.3 dark
    on light. patch: how much finer octaves' strength varies from place to place, 0.4 in most materials. """

    size: float
    finest: float
    rise: float = 1.0
    stretch: Axes = SQUARE
    tails: float = 0.0
    skew: float = 0.0
    patch: float = 0.0

    @property
    def octaves(self) -> int:
        return max(1, 1 + math.floor(math.log2(max(self.size / self.finest, 1.0)) + 0.01))

    def strengths(self) -> list[float]:
        """Deviation of each octave; of all together it is 1."""
        raw = [self.rise**k for k in range(self.octaves)]
        total = math.sqrt(sum(a * a for a in raw))
        return [a / total for a in raw]


def seed_of(at: Place, number: int) -> np.uint32:
    """A 32-bit seed of a place and a number of the caller's choice."""
    return np.uint32((at.seed * 0x9E3779B1 + number * 0x85EBCA77 + 0x165667B1) & 0xFFFFFFFF)


WIDEST = 1.65
"""Footprint, in sizes of a structure, over which nothing is left of it: lattice noise varies over almost two of its cells."""


def fading(size: float, footprint: Array) -> Array:
    """How much of a structure of a size is left at a footprint: 0.92 at half of it, 0.64 at the whole, nothing from `WIDEST`
    on.

    A parabola near to what makes 2 x 2 samples most alike the mean over their area, measured on gradient noise (0.93, 0.68,
    0.23 at 1.65): what fades earlier or later looks another way in a texture of another size."""
    return np.clip(np.float32(1.01) - np.square(footprint * np.float32(1 / (WIDEST * size))), 0, 1)


def legible(size: float, stretch: Axes) -> float:
    """The size that counts for `fading`: the shortest; lines, which a footprint averages one way alone, last longer."""
    return min(stretch) * size * (1.35 if max(stretch) > 4 * min(stretch) else 1.0)


def _lattice(at: Place, wavelength: float, stretch: Axes) -> tuple[Axes, Period]:
    """Cells a metre along each axis, and the period in cells, for a lattice of about this wavelength."""
    wanted = [wavelength * s for s in stretch]
    counts = [max(1, round(t / w)) if t else 0 for t, w in zip(at.period, wanted, strict=True)]
    scale = [n / t if n else 1 / w for n, t, w in zip(counts, at.period, wanted, strict=True)]
    return (scale[0], scale[1], scale[2]), Period(*map(float, counts))


def _octave(at: Place, size: float, seed: int, stretch: Axes, strength: float = 1.0) -> Octave:
    """An octave of a wavelength along the axes that are not stretched."""
    number = seed_of(at, seed)
    x, y, z = (float(number >> s & 255) / 256 + 0.37 for s in (0, 8, 16))
    return Octave(*_lattice(at, size, stretch), (x, y, z), number, WIDEST * legible(size, stretch), strength)


def noise(at: Place, size: float, seed: int = 0, stretch: Axes = SQUARE) -> Array:
    """One octave of gradient noise, mean 0, deviation 1 where the footprint lets it be seen. Returns: (P,)."""
    total, octave = np.zeros(len(at), np.float32), _octave(at, size, seed, stretch)
    x, y, z = at.straight(size)
    kernels.add_octave(x, y, z, octave, at.footprint, NONE, Shape(0.0, 0.0), total)
    return total


def fbm(at: Place, spectrum: Spectrum, seed: int = 0) -> Array:
    """Noise of a spectrum, mean 0, deviation 1 where all of it can be seen. Returns: (P,)."""
    t, s = spectrum.tails, spectrum.skew
    spread = math.sqrt(1 + 2 * t * 1.596 + 3 * t * t + 2 * s * s)
    thinnest = float(at.footprint.min()) if len(at) else 1.0
    total, envelope = np.zeros(len(at), np.float32), NONE
    if spectrum.patch:
        envelope = np.exp(np.float32(spectrum.patch) * noise(at, 3 * spectrum.size, seed + 977, spectrum.stretch))
    for k, strength in enumerate(spectrum.strengths()):
        size = spectrum.size / 2**k
        if 1.01 * WIDEST * legible(size, spectrum.stretch) <= thinnest:
            break
        octave = _octave(at, size, seed * 31 + k, spectrum.stretch, strength / spread)
        x, y, z = at.straight(size)
        kernels.add_octave(x, y, z, octave, at.footprint, envelope if k else NONE, Shape(t, s), total)
    return total


def lost(at: Place, spectrum: Spectrum) -> Array:
    """Deviation of what the footprint hides of `fbm`'s noise. Returns: (P,)."""
    variance = np.zeros(len(at), np.float32)
    for k, strength in enumerate(spectrum.strengths()):
        seen = fading(legible(spectrum.size / 2**k, spectrum.stretch), at.footprint)
        variance += np.float32(strength**2) * (1 - seen * seen)
    return np.sqrt(variance)


def threshold(x: Array, level: Array | float, softness: Array | float) -> Array:
    """Share of x above a level: 0 to 1 over `softness` on either side. For noise see `exceeds`. Returns: (P,)."""
    t = np.clip((x - level) / (2 * np.maximum(softness, 1e-4)) + 0.5, 0, 1)
    return (t * t * (3 - 2 * t)).astype(np.float32)


def exceeds(x: Array, level: float, softness: float, hidden: Array) -> Array:
    """Share of noise above a level, of which a part of deviation `hidden` cannot be seen. softness: of the border. Returns:
    (P,)."""
    deviation = np.hypot(np.float32(max(0.6 * softness, 1e-3)), hidden)
    steepness = np.float32(1.702) / deviation  # the logistic curve that is nearest to the normal one
    return (1 / (1 + np.exp(np.clip((level - x) * steepness, -40, 40)))).astype(np.float32)


def masked(at: Place, spectrum: Spectrum, share: float, seed: int = 0, softness: float = 0.05) -> Array:
    """A mask with noisy borders that covers a share of everything; the share stays where the footprint hides the noise."""
    level = NormalDist().inv_cdf(1 - min(max(share, 1e-4), 1 - 1e-4))
    return exceeds(fbm(at, spectrum, seed), level, softness, lost(at, spectrum))


def edge(distance: Array, footprint: Array) -> Array:
    """Share of the footprint that lies at a positive distance from a border. Returns: (P,)."""
    return np.clip(distance / footprint + np.float32(0.5), 0, 1)


def line(distance: Array, half_width: Array | float, footprint: Array) -> Array:
    """Share of the footprint that a line covers whose middle is at a distance. Returns: (P,)."""
    away = abs(distance)
    return edge(half_width - away, footprint) - edge(-half_width - away, footprint)


def warped(at: Place, amount: float, size: float, seed: int = 0, octaves: int = 2) -> Place:
    """The place with its points displaced by noise. amount: deviation, metres. size: wavelength of the displacement."""
    spectrum = Spectrum(size, size / 2 ** (octaves - 1), 0.5)
    axes = 2 if at.level else 3  # what lies along the surface stays on it
    offset = np.zeros((3, len(at)), np.float32)
    for axis in range(axes):
        offset[axis] = np.float32(amount) * fbm(at, spectrum, seed * 3 + axis)
    bend = offset if at.bend is None else offset + at.bend
    return replace(at, p=at.p + offset, bend=bend, reach=max(size, at.reach))


class Cells(NamedTuple):
    """Cells around random points. near, second: (P,) distance to the nearest point and the next, metres. border: (P,)
    distance to the cell's border, metres. ident: (P,) uint32 a hash of the cell. offset: (3, P) from its point, metres. size:
    metres. """

    near: Array
    second: Array
    border: Array
    ident: NDArray[np.uint32]
    offset: Array
    size: float

    def random(self, number: int) -> Array:
        """A number in [0, 1) for each cell, another one for each `number`."""
        return kernels.random_numbers(self.ident, number)


def cells(at: Place, size: float, seed: int = 0, jitter: float = 1.0, stretch: Axes = SQUARE) -> Cells:
    """Worley cells of about this size. jitter: 0 a grid, 1 fully random. stretch: their lengths along the axes, as multiples.

    Cells smaller than the footprint must be faded by the caller, with `fading(size, at.footprint)`.
    """
    scale, period = _lattice(at, size, stretch)
    x, y, z = (np.ascontiguousarray(axis * np.float32(s), np.float32) for axis, s in zip(at.p, scale, strict=True))
    near, second, border = (np.empty(len(at), np.float32) for _ in range(3))
    ident, offset = np.empty(len(at), np.uint32), np.empty((3, len(at)), np.float32)
    scattered.worley(x, y, z, period, jitter, seed_of(at, seed), near, second, border, ident, offset)
    unit = np.float32(size)
    return Cells(near * unit, second * unit, border * unit, ident, offset * unit, size)


class Spots(NamedTuple):
    """Separate spots. inside: (P,) distance to the spot's rim, metres, positive within. cover: (P,) share of the footprint,
    the mean of all where it hides single ones. radius: (P,) of the nearest spot, metres. cells: each holds at most one.
    """

    inside: Array
    cover: Array
    radius: Array
    cells: Cells


def spots(
    at: Place, size: float, radius: tuple[float, float], share: float = 1.0, seed: int = 0, stretch: Axes = SQUARE
) -> Spots:
    """Round spots strewn without overlap. size: mean distance between them. radius: least and largest, metres. share: of cells
    that hold one. Warp the place first for ragged ones."""
    found = cells(at, size, seed, 0.8, stretch)
    low, high = radius
    mine = np.float32(low) + np.float32(high - low) * found.random(1) ** 2
    inside = np.where(found.random(2) < share, mine - found.near, np.float32(-1))
    wide = high - low
    volume = low**3 + low**2 * wide + 0.6 * low * wide**2 + wide**3 / 7  # the mean of mine³
    mean, seen = share * 4.19 * volume / size**3, fading(2 * high, at.footprint)
    return Spots(inside, mean + (edge(inside, at.footprint) - mean) * seen, mine, found)


class Marks(NamedTuple):
    """Strokes: scratches, fibres, blades, hairs. cover: (P,) share of the footprint. across: (P,) −1 … 1 over the width, 9
    where there is none. along: (P,) −1 … 1 from end to end. ident: (P,) uint32. """

    cover: Array
    across: Array
    along: Array
    ident: NDArray[np.uint32]

    def random(self, number: int) -> Array:
        """A number in [0, 1) for each stroke, another one for each `number`."""
        return kernels.random_numbers(self.ident, number)


def marks(
    at: Place, length: float, width: float, count: int, angle: float = 0.0, spread: float = 0.3, seed: int = 0,
    vary: float = 0.7, bend: float = 0.0,
) -> Marks:  # fmt: skip
    """Strokes strewn over the surface (at.uv), the upper hiding the lower, thin towards their ends.

    length, width: of the longest, metres. count: how many begin in a square of edge `length`, 1 to 16. angle: of their
    direction, radians from the first axis of uv. spread: range of angles about it; 2π for any. bend: see `Strokes`.
    """
    flat = at.flat
    scale, period = _lattice(flat, length, SQUARE)
    x, y = (np.ascontiguousarray(axis * np.float32(s), np.float32) for axis, s in zip(at.uv, scale, strict=False))
    half = max(width, 1e-7) / 2 / length
    reach = half + float(at.footprint.max(initial=0)) / length  # a thin stroke is seen a footprint away
    shape = Strokes(count, 0.5, vary, min(reach, 0.45), angle, spread, bend)
    distance, along = np.empty(len(at), np.float32), np.empty(len(at), np.float32)
    ident = np.empty(len(at), np.uint32)
    scattered.strokes(x, y, at.face, period, shape, seed_of(at, seed), distance, along, ident)
    here = distance < 8
    own = np.float32(width / 2) * np.sqrt(np.clip(1 - along * along, 0, 1))
    cover = np.where(here, line(distance * np.float32(length), own, at.footprint), 0)
    across = np.where(here, distance * np.float32(2 * length / width), 9)
    mean = 1 - math.exp(-count * 0.785 * width / length * (1 - vary / 2))
    cover = mean + (cover - mean) * fading(max(width, length / count) / 2, at.footprint)  # wider than the gaps: strokes merge
    return Marks(cover.astype(np.float32), across.astype(np.float32), along, ident)


class Blades(NamedTuple):
    """Blades of grass and the like. cover: (P,) share of the footprint. side: (P,) −1 … 1 over the blade, wide or narrow.
    along: (P,) −1 at the root … 1 at the tip. shadow: (P,) that a blade throws beside itself, 0 … 1. ident: (P,) uint32."""

    cover: Array
    side: Array
    along: Array
    shadow: Array
    ident: NDArray[np.uint32]

    def random(self, number: int) -> Array:
        """A number in [0, 1) for each blade, another one for each `number`."""
        return kernels.random_numbers(self.ident, number)


def blades(
    at: Place, length: float, width: float, count: int, angle: float = 0.0, spread: float = 6.28, seed: int = 0,
    vary: float = 0.5, bend: float = 0.2,
) -> Blades:  # fmt: skip
    """`marks` that are broad near their root and run out into a point, with the shadow that they throw on what lies below."""
    found = _bladed(at, length, width, count, angle, spread, seed, vary, bend)
    shown = fading(0.8 * width, at.footprint)
    if len(at) and shown.min() < 1:
        cover, shadow = _mean_blades(length, width, count, vary, bend)
        found = found._replace(cover=mix_to(cover, found.cover, shown), shadow=mix_to(shadow, found.shadow, shown))
    return found


def mix_to(mean: float, value: Array, shown: Array) -> Array:
    """A value, or its mean where the footprint hides single ones."""
    return (mean + (value - np.float32(mean)) * shown).astype(np.float32)


AROUND_BLADE = 2.2
"""Width of the stroke that holds a blade and its shadow, in widths of the blade."""


def _bladed(at: Place, length: float, width: float, count: int, angle: float, spread: float, seed: int, vary: float,
            bend: float) -> Blades:  # fmt: skip
    """`blades` as if single ones could always be seen."""
    stroke = marks(at, length, AROUND_BLADE * width, count, angle, spread, seed, vary, bend)
    here, t = abs(stroke.across) < 2, np.clip(0.5 + 0.5 * stroke.along, 0, 1)
    half = np.float32(1.5) * np.sqrt(np.sqrt(t + np.float32(0.06))) * (1 - t) ** np.float32(0.7)  # of the blade's half width
    away = np.float32(AROUND_BLADE) * abs(stroke.across)
    cover = here * edge((half - away) * np.float32(width / 2), at.footprint)
    shadow = here * np.exp(-np.maximum(away - half, 0) / np.float32(0.5)) * np.clip(2.0 - away, 0, 1)
    side = np.clip(np.where(here, np.float32(AROUND_BLADE) * stroke.across / np.maximum(half, 0.05), 0), -1, 1)
    return Blades(cover.astype(np.float32), side, np.where(here, stroke.along, 0), shadow.astype(np.float32), stroke.ident)


@cache
def _mean_blades(length: float, width: float, count: int, vary: float, bend: float) -> tuple[float, float]:
    """Mean cover and shadow of `blades`, over 20,000 points."""
    p = np.random.default_rng(0).uniform(0, 40 * length, (3, 20_000)).astype(np.float32)
    probe = Place(p, p[:2], np.zeros(p.shape[1], np.int32), np.full(p.shape[1], 0.01 * width, np.float32))
    found = _bladed(probe, length, width, count, 0.0, 6.28, 0, vary, bend)
    return float(found.cover.mean()), float(found.shadow.mean())


class Tiles(NamedTuple):
    """Tiles of a bond. ident: (P,) uint32. x, y: (P,) from the tile's middle, metres. width, height: of a tile, metres.
    border: (P,) distance to the tile's rim, metres, positive inside. turned: (P,) whether the tile stands across. """

    ident: NDArray[np.uint32]
    x: Array
    y: Array
    width: float
    height: float
    border: Array
    turned: NDArray[np.bool_]

    def random(self, number: int) -> Array:
        """A number in [0, 1) for each tile, another one for each `number`."""
        return kernels.random_numbers(self.ident, number)


def tiles(at: Place, width: float, height: float, bond: str = "running", seed: int = 0) -> Tiles:
    """Rectangular tiles on the surface (at.uv). bond: "running" (half offset), "third", "random", "stack"."""
    (columns, across), (rows, up) = (_fitted(t, s, m) for t, s, m in zip(at.period[:2], (width, height), (1, 2), strict=True))
    u, v = at.uv[0] / np.float32(across), at.uv[1] / np.float32(up)
    row = np.floor(v)
    wrapped_row = row - rows * np.floor(row / rows) if rows else row
    number = seed_of(at, seed)
    lane = kernels.random_numbers(_hash(wrapped_row, at.face, number), 1)
    offset = {"running": 0.5 * (wrapped_row % 2), "third": wrapped_row % 3 / 3, "random": lane, "stack": 0 * u}[bond]
    u = u + offset.astype(np.float32)
    column = np.floor(u)
    wrapped_column = column - columns * np.floor(column / columns) if columns else column
    ident = _hash(wrapped_column + np.float32(7919) * wrapped_row, at.face, number)
    x, y = (u - column - np.float32(0.5)) * np.float32(across), (v - row - np.float32(0.5)) * np.float32(up)
    border = np.minimum(np.float32(across / 2) - abs(x), np.float32(up / 2) - abs(y))
    return Tiles(ident, x, y, across, up, border, np.zeros(len(at), bool))


def _fitted(period: float, size: float, multiple: int) -> tuple[int, float]:
    """How many of a size fit a period, a multiple of `multiple`, and their exact size; 0 and the size without a period."""
    if not period:
        return 0, size
    count = max(multiple, multiple * round(period / size / multiple))
    return count, period / count


def _hash(value: Array, face: NDArray[np.int32], seed: np.uint32) -> NDArray[np.uint32]:
    """A hash of whole numbers. Args: (P,) each."""
    h = np.rint(value).astype(np.int64).astype(np.uint32) * np.uint32(0x8DA6B343)
    return h ^ face.astype(np.uint32) * np.uint32(0xD8163841) ^ seed


class Weave(NamedTuple):
    """Threads over and under. height: (P,) 0 … 1 of the topmost thread's round back. warp: (P,) 1 where a warp thread (up)
    lies on top, 0 where a weft thread does. across: (P,) −1 … 1 over that thread. gap: (P,) 1 where no thread is. ident: (P,)
    uint32 of the thread. seen: (P,) how much of single threads the footprint still shows. """

    height: Array
    warp: Array
    across: Array
    gap: Array
    ident: NDArray[np.uint32]
    seen: Array

    def random(self, number: int) -> Array:
        """A number in [0, 1) for each thread, another one for each `number`."""
        return kernels.random_numbers(self.ident, number)


DRAFTS = {"plain": ((1, 0), (0, 1)), "twill": ((1, 1, 0), (0, 1, 1), (1, 0, 1)), "satin": (
    (0, 1, 1, 1, 1), (1, 1, 0, 1, 1), (1, 1, 1, 1, 0), (1, 0, 1, 1, 1), (1, 1, 1, 0, 1)), "basket": (
    (1, 1, 0, 0), (1, 1, 0, 0), (0, 0, 1, 1), (0, 0, 1, 1)), "twill 3/1": (
    (1, 1, 1, 0), (0, 1, 1, 1), (1, 0, 1, 1), (1, 1, 0, 1)), "twill 2/2": (
    (1, 1, 0, 0), (0, 1, 1, 0), (0, 0, 1, 1), (1, 0, 0, 1))}  # fmt: skip
"""Row by row, whether the warp thread lies on top."""


def weave(at: Place, pitch: float, draft: str = "plain", fill: float = 0.92, seed: int = 0) -> Weave:
    """Woven threads on the surface (at.uv). pitch: distance between threads, metres. fill: width of a thread, of the pitch."""
    table = np.array(DRAFTS[draft], bool)
    n = len(table)
    (columns, across), (rows, up) = (_fitted(t, pitch, n) for t in at.period[:2])
    u, v = at.uv[0] / np.float32(across), at.uv[1] / np.float32(up)
    i, j = np.floor(u), np.floor(v)
    fu, fv = 2 * (u - i) - 1, 2 * (v - j) - 1  # −1 … 1 over each thread
    warp_on_top = table[j.astype(np.int64) % n, i.astype(np.int64) % n]
    over = np.where(warp_on_top, fu, fv) / np.float32(fill)
    along = np.where(warp_on_top, fv, fu)
    other = np.where(warp_on_top, fv, fu) / np.float32(fill)
    round_back = np.sqrt(np.clip(1 - over * over, 0, 1))
    beneath = 0.55 * np.sqrt(np.clip(1 - other * other, 0, 1))
    on = abs(over) < 1
    height = np.where(on, 0.35 + 0.65 * round_back * (1 - 0.35 * along * along), beneath)
    gap = (~on & (abs(other) >= 1)).astype(np.float32)
    shown_warp = np.where(on, warp_on_top, ~warp_on_top)
    i, j = (k - c * np.floor(k / c) if c else k for k, c in ((i, columns), (j, rows)))
    thread = np.where(shown_warp, i, j + 4_000_037)
    seen = fading(0.55 * pitch, at.footprint)
    across_it = np.where(on, over, other)
    return Weave(
        height.astype(np.float32), shown_warp.astype(np.float32), across_it.astype(np.float32), gap,
        _hash(thread, at.face, seed_of(at, seed)), seen.astype(np.float32),
    )  # fmt: skip


class Cracks(NamedTuple):
    """Cracks, joints or veins. cover: (P,) share of the footprint. near: (P,) distance to the middle of the nearest open one,
    metres, larger where it is about to close. ident: (P,) uint32 of the largest piece that they cut out.
    """

    cover: Array
    near: Array
    ident: NDArray[np.uint32]


def cracks(
    at: Place, size: float, width: float, share: float = 0.6, seed: int = 0, levels: int = 2, ragged: float = 0.07,
    stretch: Axes = SQUARE,
) -> Cracks:  # fmt: skip
    """Cracks that branch and peter out: borders of ragged pieces, within them borders of smaller ones, thinner.

    size: of the largest pieces, metres. width: of the widest cracks, metres. share: how much of the borders is open, 0 … 1.
    ragged: how far cracks stray, as a share of the size.
    """
    bent = warped(at, ragged * size, size, seed, 5)
    closed: Array = np.ones(len(at), np.float32)
    nearest: Array = np.full(len(at), 9 * size, np.float32)
    mean_open = float(np.clip(share + 0.5 * NORMAL, 0, 1).mean())
    ident = np.zeros(len(at), np.uint32)
    for level in range(levels):
        scale, widest = size / 2.4**level, width / 1.7**level
        found = cells(bent, scale, seed + 7 * level, 1.0, stretch)
        open_here = np.clip(share + 0.5 * noise(at, 1.3 * scale, seed + 7 * level + 1), 0, 1)
        shown = fading(0.5 * scale * min(stretch), at.footprint)
        mean = min(BORDERS * widest / scale / min(stretch) * mean_open, 1)
        cover = mean + (line(found.border, np.float32(widest / 2) * open_here, at.footprint) - mean) * shown
        closed = closed * (1 - cover)
        nearest = np.minimum(nearest, found.border + np.float32(0.7 * scale) * np.maximum(0.35 - open_here, 0))
        ident = found.ident if level == 0 else ident
    return Cracks(1 - closed, nearest, ident)


BORDERS = 2.8
"""Area of the borders of cells of size 1 in a unit of space (measured)."""

NORMAL = np.array([NormalDist().inv_cdf((k + 0.5) / 64) for k in range(64)])
"""A normal distribution in 64 equal parts."""


class Pebbles(NamedTuple):
    """Rounded pieces side by side. inside: (P,) distance to the piece's rim, metres, positive within. cover: (P,) share of the
    footprint. dome: (P,) 0 at the rim … 1 on the round back. shown: (P,) how much of single pieces the footprint
    shows. cells: the pieces.
    """

    inside: Array
    cover: Array
    dome: Array
    shown: Array
    cells: Cells


def pebbles(
    at: Place, size: float, gap: float = 0.0, corner: float = 0.5, seed: int = 0, jitter: float = 0.8,
    stretch: Axes = SQUARE, depth: float = 1.0,
) -> Pebbles:  # fmt: skip
    """Pieces that fill the ground, from cut stones to round pebbles.

    size: of a piece, metres. gap: between pieces, metres. corner: 0 sharp polygons, 1 round. jitter: 0 rows, 1 fully random.
    depth: how much the third axis counts: 1 pieces strewn through space, as they are cut; 0 stones laid side by side in a face.
    """
    found = cells(at, size, seed, jitter, stretch)
    inside, dome = _piece(found, gap, corner, depth)
    shown = fading(size * min(stretch), at.footprint)
    cover, back = edge(inside, at.footprint), dome
    if len(at) and shown.min() < 1:
        mean_cover, mean_back = _mean_piece(gap / size, corner, jitter, depth)
        cover, back = mean_cover + (cover - mean_cover) * shown, mean_back + (back - mean_back) * shown
    return Pebbles(inside, cover, back, shown, found)


def _piece(found: Cells, gap: float, corner: float, depth: float) -> tuple[Array, Array]:
    """Distance to the rim, metres, and the rise of the back, 0 … 1, of `pebbles`. Returns: (P,), (P,)."""
    x, y, z = found.offset
    straight = found.border - np.float32(gap / 2)
    circle = np.float32(found.size * (1.05 - 0.5 * corner)) - np.sqrt(x * x + y * y + np.float32(depth) * z * z)
    soft = np.float32(0.18 * corner * found.size + 1e-9)  # over which the straight side turns into the round corner
    join = np.clip(0.5 + 0.5 * (circle - straight) / soft, 0, 1)
    inside = circle + (straight - circle) * join - soft * join * (1 - join)
    rise = np.clip(inside / np.float32(0.38 * found.size), 0, 1)
    return inside, np.sqrt(rise * (2 - rise))


@cache
def _mean_piece(gap: float, corner: float, jitter: float, depth: float) -> tuple[float, float]:
    """Share that pieces of size 1 cover, and the mean of their backs, over 20,000 points."""
    p = np.random.default_rng(0).uniform(0, 100, (3, 20_000)).astype(np.float32)
    probe = Place(p, p[:2], np.zeros(p.shape[1], np.int32), np.full(p.shape[1], 1e-3, np.float32))
    inside, dome = _piece(cells(probe, 1.0, 0, jitter), gap, corner, depth)
    return float((inside > 0).mean()), float(dome.mean())


class Heap(NamedTuple):
    """Pieces that lie on and between one another. cover: (P,) share of the footprint that they hide of the ground. height: (P,)
    of what lies on top, metres. nook: (P,) 0 on open faces … 1 where two pieces meet, deep down. lean: (P,) a number of the
    broken face, −0.5 … 0.5. ident: (P,) uint32 of the piece. shown: (P,) how much of single
    pieces the footprint shows. size: metres. """

    cover: Array
    height: Array
    nook: Array
    lean: Array
    ident: NDArray[np.uint32]
    shown: Array
    size: float

    def random(self, number: int) -> Array:
        """A number in [0, 1) for each piece, another one for each `number`."""
        return kernels.random_numbers(self.ident, number)


STONES = Pieces(0.92, 0.5, 0.75, 0.3, 1.6, 0.45, 0.6, 0.5)
"""Crushed: flat faces, all sizes."""

PEBBLES = Pieces(0.85, 0.35, 0.3, 1.0, 1.0, 0.55, 0.5, 0.1)
"""Washed: domes."""


def heap(at: Place, size: float, shape: Pieces = STONES, seed: int = 0, stretch: Axes = SQUARE) -> Heap:
    """Pieces heaped up, the upper hiding the lower, wedged into one another. size: distance between them, metres. The gaps
    between them are what their shapes leave, so no two are alike."""
    top, second, ident, facet = _heaped(at, size, shape, seed, stretch)
    cover, height, nook = _rises(top, second, shape)
    shown = fading(0.7 * size * min(stretch), at.footprint)
    if len(at) and shown.min() < 1:
        means = _mean_heap(shape)
        cover, height, nook = (m + (v - m) * shown for v, m in zip((cover, height, nook), means, strict=True))
    lean = (kernels.random_numbers(facet, 1) - np.float32(0.5)) * shown * (ident > 0)
    return Heap(cover, height * np.float32(size), nook, lean, ident, shown, size)


def _heaped(at: Place, size: float, shape: Pieces, seed: int, stretch: Axes) -> tuple[Array, ...]:
    """Heights of the two uppermost pieces, in cells, and hashes of the uppermost and of its face."""
    scale, period = _lattice(at, size, stretch)
    x, y, z = (np.ascontiguousarray(axis * np.float32(s)) for axis, s in zip(at.p, scale, strict=True))
    top, second = np.empty(len(at), np.float32), np.empty(len(at), np.float32)
    ident, facet = np.empty(len(at), np.uint32), np.empty(len(at), np.uint32)
    heaps.heap(x, y, z, period, shape, seed_of(at, seed), top, second, ident, facet)
    return top, second, ident, facet


def _rises(top: Array, second: Array, shape: Pieces) -> tuple[Array, Array, Array]:
    """Cover, height and nook of a heap, in cells."""
    high = np.float32(shape.thick + 0.5 * shape.lift)
    apart = np.exp((second - top) * np.float32(9))
    deep = np.clip(1 - top / high, 0, 1)
    return (top > 0).astype(np.float32), top, np.clip(0.75 * deep + 0.5 * apart * (0.3 + deep), 0, 1)


@cache
def _mean_heap(shape: Pieces) -> tuple[float, ...]:
    """Means of `_rises` over 20,000 points."""
    p = np.random.default_rng(0).uniform(0, 100, (3, 20_000)).astype(np.float32)
    probe = Place(p, p[:2], np.zeros(p.shape[1], np.int32), np.full(p.shape[1], 1e-3, np.float32))
    top, second, _, _ = _heaped(probe, 1.0, shape, 0, SQUARE)
    return tuple(float(v.mean()) for v in _rises(top, second, shape))


class Ripples(NamedTuple):
    """crest: (P,) −1 in the troughs … 1 on the crests, mean 0. along: (P,) 0 … 1 from one steep side to the next.
    shown: (P,) how much of them the footprint shows.
    """

    crest: Array
    along: Array
    shown: Array


def ripples(at: Place, length: float, wander: float, seed: int = 0) -> Ripples:
    """Ripples across the second axis that wander, fork and end, as wind and waves leave them in sand: one side steep.

    length: from crest to crest, metres. wander: distance between forks, about, metres.
    """
    _, fitted = _fitted(at.period[1], length, 1)
    real, imaginary = noise(at, wander, seed, (1.6, 1, 1)), noise(at, wander, seed + 1, (1.6, 1, 1))
    turns = at.p[1] / np.float32(fitted) + np.arctan2(real, imaginary) / np.float32(2 * math.pi)  # a fork where both are 0
    along = turns - np.floor(turns)
    strength = np.clip(np.hypot(real, imaginary) / 0.6, 0, 1)
    shown = fading(0.55 * length, at.footprint)
    steep = np.float32(0.7)
    crest = np.where(along < steep, -np.cos(math.pi * along / steep), np.cos(math.pi * (along - steep) / (1 - steep)))
    return Ripples((crest * strength * shown).astype(np.float32), along.astype(np.float32), shown)


def repeats(at: Place, length: float, axis: int, multiple: int = 1) -> tuple[Array, Array, float]:
    """Equal lengths one after another along the surface (at.uv).

    Args: length metres. axis 0 across, 1 up. multiple: of how many the period holds a whole number.
    Returns: (P,) −1 … 1 within the length; (P,) its number, a whole one; its exact length, metres.
    """
    count, fitted = _fitted(at.period[axis], length, multiple)
    t = at.uv[axis] / np.float32(fitted)
    number = np.floor(t)
    within = (2 * (t - number) - 1).astype(np.float32)
    return within, number - count * np.floor(number / count) if count else number, fitted


class Loops(NamedTuple):
    """Thread of a knit, rope or wickerwork. height: (P,) 0 in the gaps … 1 on its round back. across: (P,) −1 … 1 over the
    thread. along: (P,) 0 … 1 from end to end of what is seen of it. ident: (P,) uint32 of that piece. seen: (P,) how much
    of single threads the footprint shows. """

    height: Array
    across: Array
    along: Array
    ident: NDArray[np.uint32]
    seen: Array

    def random(self, number: int) -> Array:
        """A number in [0, 1) for each piece, another one for each `number`."""
        return kernels.random_numbers(self.ident, number)


def knit(at: Place, width: float, height: float, seed: int = 0) -> Loops:
    """Stocking stitch on the surface (at.uv): columns of loops, each seen as a V. width, height: of a stitch, metres."""
    x, column, _ = repeats(at, width, 0)
    rows, up = _fitted(at.period[1], height, 1)
    a = abs(x)
    t = at.uv[1] / np.float32(up) - 0.5 * a - 0.5 * a * a  # a leg rises from the middle of its column, ever steeper
    row = np.floor(t)
    across = 2 * (t - row) - 1
    slim = np.clip(2.6 * a + 0.25, 0, 1) * np.clip(2.6 * (1 - a) + 0.25, 0, 1)  # where the leg dives under its neighbours
    back = np.sqrt(np.clip(1 - (across / (0.5 + 0.47 * slim)) ** 2, 0, 1))
    row = row - rows * np.floor(row / rows) if rows else row
    ident = _hash(2 * column + (x > 0) + np.float32(7919) * row, at.face, seed_of(at, seed))
    seen = fading(height / 2, at.footprint)
    return Loops((back * (0.45 + 0.55 * slim)).astype(np.float32), across.astype(np.float32), a, ident, seen)


def laid(at: Place, width: float, lay: float, seed: int = 0) -> Loops:
    """Ropes side by side on the surface (at.uv), along its first axis. width: of a rope, metres. lay: from strand to strand."""
    x, row, _ = repeats(at, width, 1)
    columns, fitted = _fitted(at.period[0], lay, 1)
    t = at.uv[0] / np.float32(fitted) - np.arcsin(np.clip(x, -1, 1)) * np.float32(0.9) + kernels.random_numbers(
        _hash(row, at.face, seed_of(at, seed)), 1
    )
    strand = np.floor(t)
    across = 2 * (t - strand) - 1
    dome = np.sqrt(np.clip(1 - x * x, 0, 1))
    back = np.sqrt(np.clip(1 - across * across, 0, 1))
    strand = strand - columns * np.floor(strand / columns) if columns else strand
    ident = _hash(strand + np.float32(7919) * row, at.face, seed_of(at, seed + 1))
    height, along = (a.astype(np.float32) for a in (dome * (0.55 + 0.45 * back), 0.5 + 0.5 * x))
    return Loops(height, across.astype(np.float32), along, ident, fading(lay / 2, at.footprint))


def wickerwork(at: Place, spacing: float, cane: float, seed: int = 0) -> Loops:
    """Canes woven before and behind upright stakes. spacing: of the stakes, metres. cane: thickness, metres."""
    s, stake, _ = repeats(at, spacing, 0, 2)
    y, row, _ = repeats(at, cane, 1, 2)
    front = np.cos(np.float32(math.pi / 2) * s) * np.where((stake + row) % 2 > 0, 1, -1)  # 1 before a stake, −1 behind one
    back = np.sqrt(np.clip(1 - y * y, 0, 1))
    upright = np.sqrt(np.clip(1 - (s / 0.26) ** 2, 0, 1))
    over = (front < 0) & (upright > 0)
    piece = row * 2 + np.float32(0.0) * stake
    ident = _hash(np.where(over, stake * 2 + 1, piece), at.face, seed_of(at, seed))
    height = np.where(over, 0.3 + 0.35 * upright, back * (0.62 + 0.38 * front))
    along = np.where(over, 0.5 + 0.5 * y, 0.5 + 0.5 * front)
    across = np.where(over, s / 0.26, y)
    return Loops(height.astype(np.float32), across.astype(np.float32), along.astype(np.float32), ident,
                 fading(cane, at.footprint))  # fmt: skip


class Scales(NamedTuple):
    """Scales in rows. across: (P,) −1 … 1 over the scale. along: (P,) 0 at its free tip … 1 where it is overlapped. rim: (P,)
    distance to its free edge, metres. under: (P,) distance from the edge of the scale that lies over it, metres. ident: (P,)
    uint32. seen: (P,) how much of single scales the footprint shows. """

    across: Array
    along: Array
    rim: Array
    under: Array
    ident: NDArray[np.uint32]
    seen: Array

    def random(self, number: int) -> Array:
        """A number in [0, 1) for each scale, another one for each `number`."""
        return kernels.random_numbers(self.ident, number)


def scales(at: Place, width: float, height: float, seed: int = 0) -> Scales:
    """Scales that overlap like shingles, the upper rows over the lower, on the surface (at.uv). height: of a row, metres."""
    (columns, wide), (rows, up) = _fitted(at.period[0], width, 1), _fitted(at.period[1], height, 2)
    u, v = at.uv[0] / np.float32(wide), at.uv[1] / np.float32(up)
    row = np.floor(v)
    t = v - row  # from the row's tips to the next row's
    x = 2 * _within(u + 0.5 * (row % 2)) - 1
    reach = 1 - np.hypot(x, 1 - t)
    behind = reach < 0  # between two tips the row below shows
    mine = row - behind
    x = np.where(behind, 2 * _within(u + 0.5 * (mine % 2)) - 1, x)
    column = np.floor(u + 0.5 * (mine % 2))
    wrapped_row = mine - rows * np.floor(mine / rows) if rows else mine
    column = column - columns * np.floor(column / columns) if columns else column
    half = np.float32(wide / 2)
    rim = half * np.where(behind, 1 - abs(x) + t, reach)
    under = np.where(behind, -reach * half, np.float32(up) * (1.3 - t))
    ident = _hash(column + np.float32(7919) * wrapped_row, at.face, seed_of(at, seed))
    along = (t + behind) / 2
    x, along, rim, under = (a.astype(np.float32) for a in (x, along, rim, under))
    return Scales(x, along, rim, under, ident, fading(0.7 * min(width, height), at.footprint))


def _within(x: Array) -> Array:
    return x - np.floor(x)


class Hexagons(NamedTuple):
    """Honeycomb. border: (P,) distance to the wall's middle, metres. x, y: (P,) from the middle, metres. ident: (P,) uint32.
    seen: (P,) how much of single cells the footprint shows. """

    border: Array
    x: Array
    y: Array
    ident: NDArray[np.uint32]
    seen: Array

    def random(self, number: int) -> Array:
        """A number in [0, 1) for each cell, another one for each `number`."""
        return kernels.random_numbers(self.ident, number)


def hexagons(at: Place, width: float, seed: int = 0) -> Hexagons:
    """Regular hexagons on the surface (at.uv), two sides upright. width: from wall to wall, metres."""
    (columns, wide), (pairs, tall) = _fitted(at.period[0], width, 1), _fitted(at.period[1], math.sqrt(3) * width, 1)
    u, v = at.uv[0] / np.float32(wide), at.uv[1] / np.float32(tall)
    best: Array = np.full(len(at), 9.0, np.float32)
    x = y = column = row = np.zeros(len(at), np.float32)
    for half in (0.0, 0.5):
        i, j = np.floor(u + half) - half + 0.5, np.floor(v + half) - half + 0.5
        dx, dy = (u - i) * np.float32(width), (v - j) * np.float32(math.sqrt(3) * width)
        away = np.hypot(dx, dy)
        closer = away < best
        best, x, y = np.where(closer, away, best), np.where(closer, dx, x), np.where(closer, dy, y)
        column, row = np.where(closer, i, column), np.where(closer, j, row)
    slanted = np.float32(math.sqrt(3) / 2) * abs(y) + abs(x) / 2
    column = column - columns * np.floor(column / columns) if columns else column
    row = row - pairs * np.floor(row / pairs) if pairs else row
    border = np.float32(width / 2) - np.maximum(abs(x), slanted)
    ident = _hash(2 * column + np.float32(7919) * 2 * row, at.face, seed_of(at, seed))
    return Hexagons(border.astype(np.float32), x, y, ident, fading(width / 2, at.footprint))


def strands(at: Place, mark: Marks, width: float, count: float, seed: int = 0) -> Array:
    """Fine lines along strokes, mean 0, deviation 1: hairs of a lock, barbs, fibres. width: of the strokes, metres. count: of
    lines over a stroke's width. Returns: (P,). """
    p = np.stack([np.float32(count / 2) * mark.across, 1.5 * mark.along, 97 * mark.random(seed)]).astype(np.float32)
    lines = Place(p, p[:2], at.face, at.footprint * np.float32(count / width), seed=at.seed)
    return 0.75 * noise(lines, 1.0, seed) + 0.65 * noise(lines, 0.5, seed + 1, (1, 3, 1))
