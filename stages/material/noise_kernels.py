"""The inner loops of the procedural patterns: hashes of a lattice, and gradient noise on it.

Every kernel takes coordinates in lattice units, float32, one array an axis, and the lattice's period along each axis in whole
units, 0 where it never repeats. Nothing is looked up in a table: a lattice point's numbers are a hash of its coordinates,
which a vector unit computes for many points at once. """

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled

fast = compiled(fastmath={"contract", "reassoc", "nsz", "arcp"})
inline = compiled(inline="always")

UNIT = np.float32(2.0**-23)
GRADIENT_SCALE = np.float32(5.23)
"""Brings gradient noise to a standard deviation of 1 (measured over 10⁷ points)."""


class Period(NamedTuple):
    """Lattice cells after which a pattern repeats, by axis; 0: never."""

    x: float
    y: float
    z: float


@inline
def mixed(h):  # type: ignore[no-untyped-def]
    """A 32-bit hash whose bits all depend on all bits of h. Source: Mueller 2012, by way of Wellons 2018, "Hash
    prospecting"."""
    h = np.uint32((h ^ (h >> np.uint32(16))) * np.uint32(0x7FEB352D))  # the compiler widens products to 64 bits
    h = np.uint32((h ^ (h >> np.uint32(15))) * np.uint32(0x846CA68B))
    return np.uint32(h ^ (h >> np.uint32(16)))


@inline
def corner(x, y, z, seed):  # type: ignore[no-untyped-def]
    """Hash of a lattice point, given as whole float32 numbers."""
    hx = np.uint32(np.uint32(np.int32(x)) * np.uint32(0x8DA6B343))
    hy = np.uint32(np.uint32(np.int32(y)) * np.uint32(0xD8163841))
    hz = np.uint32(np.uint32(np.int32(z)) * np.uint32(0xCB1AB31F))
    return mixed(np.uint32(hx ^ hy ^ hz ^ seed))


@inline
def real(h):  # type: ignore[no-untyped-def]
    """A hash's bits below the sign as float32; vector units convert signed numbers faster."""
    return np.float32(np.int32(h))


@inline
def unit(h):  # type: ignore[no-untyped-def]
    """[0, 1) of a hash."""
    return real(h >> np.uint32(9)) * UNIT


@inline
def wrapped(x, period, inverse):  # type: ignore[no-untyped-def]
    """A lattice coordinate within its period; itself where the period and its inverse are 0."""
    return x - period * np.floor(x * inverse)


@inline
def slope_at(h, x, y, z):  # type: ignore[no-untyped-def]
    """A corner's random gradient, each component -1 ... 1, times the offset from it."""
    ten = np.uint32(1023)
    products = real(h & ten) * x + real((h >> np.uint32(10)) & ten) * y + real((h >> np.uint32(20)) & ten) * z
    return products * np.float32(2 / 1023) - (x + y + z)


@inline
def gradient_at(qx, qy, qz, period, inverse, seed):  # type: ignore[no-untyped-def]
    """Gradient noise at a point, in lattice units. period, inverse: three float32 each, 0 where nothing repeats."""
    one = np.float32(1)
    cx, cy, cz = np.floor(qx), np.floor(qy), np.floor(qz)
    fx, fy, fz = qx - cx, qy - cy, qz - cz
    x0, x1 = wrapped(cx, period[0], inverse[0]), wrapped(cx + one, period[0], inverse[0])
    y0, y1 = wrapped(cy, period[1], inverse[1]), wrapped(cy + one, period[1], inverse[1])
    z0, z1 = wrapped(cz, period[2], inverse[2]), wrapped(cz + one, period[2], inverse[2])
    u = fx * fx * fx * (fx * (fx * np.float32(6) - np.float32(15)) + np.float32(10))
    v = fy * fy * fy * (fy * (fy * np.float32(6) - np.float32(15)) + np.float32(10))
    w = fz * fz * fz * (fz * (fz * np.float32(6) - np.float32(15)) + np.float32(10))
    a = slope_at(corner(x0, y0, z0, seed), fx, fy, fz)
    b = slope_at(corner(x1, y0, z0, seed), fx - one, fy, fz)
    c = slope_at(corner(x0, y1, z0, seed), fx, fy - one, fz)
    d = slope_at(corner(x1, y1, z0, seed), fx - one, fy - one, fz)
    e = slope_at(corner(x0, y0, z1, seed), fx, fy, fz - one)
    f = slope_at(corner(x1, y0, z1, seed), fx - one, fy, fz - one)
    g = slope_at(corner(x0, y1, z1, seed), fx, fy - one, fz - one)
    h = slope_at(corner(x1, y1, z1, seed), fx - one, fy - one, fz - one)
    near = a + u * (b - a) + v * (c + u * (d - c) - a - u * (b - a))
    far = e + u * (f - e) + v * (g + u * (h - g) - e - u * (f - e))
    return (near + w * (far - near)) * GRADIENT_SCALE


@inline
def singles(values):  # type: ignore[no-untyped-def]
    """Three numbers as float32."""
    return np.float32(values[0]), np.float32(values[1]), np.float32(values[2])


@inline
def inverses(period):  # type: ignore[no-untyped-def]
    """One over each of three periods, 0 where nothing repeats."""
    one, none = np.float32(1), np.float32(0)
    return (
        one / period[0] if period[0] > 0 else none,
        one / period[1] if period[1] > 0 else none,
        one / period[2] if period[2] > 0 else none,
    )


class Octave(NamedTuple):
    """One octave of noise. scale: lattice cells a metre along each axis. period: in cells. shift: of the lattice, three
    numbers. seed: uint32. widest: footprint that hides all of it, metres. strength: its deviation."""

    scale: tuple[float, float, float]
    period: Period
    shift: tuple[float, float, float]
    seed: np.uint32
    widest: float
    strength: float


class Shape(NamedTuple):
    """How an octave's values are spread, as in `patterns.Spectrum`."""

    tails: float
    skew: float


@fast
def add_octave(x, y, z, octave, footprint, envelope, shape, total):  # type: ignore[no-untyped-def]
    """Add gradient noise, mean 0, features about one cell across, faded by how little of it a footprint lets be seen
    (`patterns.fading`). Source: Perlin 2002, "Improving noise".

    x, y, z, footprint: (P,) metres. envelope: (P,) by which it is multiplied, or (0,). total:
    (P,).
    """
    none, one, most = np.float32(0), np.float32(1), np.float32(1.01)
    period = singles(octave.period)
    inverse, scale, shift = inverses(period), singles(octave.scale), singles(octave.shift)
    number, scarce, strength = octave.seed, np.float32(1 / octave.widest), np.float32(octave.strength)
    tails, skew = np.float32(shape.tails), np.float32(shape.skew)
    varied = len(envelope) > 0
    for i in range(len(x)):
        qx, qy, qz = x[i] * scale[0] + shift[0], y[i] * scale[1] + shift[1], z[i] * scale[2] + shift[2]
        shown = min(max(most - (footprint[i] * scarce) ** 2, none), one)
        value = gradient_at(qx, qy, qz, period, inverse, number) * shown
        value += tails * value * abs(value) + skew * (value * value - shown * shown)
        total[i] += strength * value * (envelope[i] if varied else one)


def random_numbers(ident: NDArray[np.uint32], number: int) -> NDArray[np.float32]:
    """[0, 1) of hashes, another for each `number`. Args: (P,). Returns: (P,)."""
    out = np.empty(len(ident), np.float32)
    _random(ident, np.uint32(number), out)
    return out


@fast
def _random(ident, number, out):  # type: ignore[no-untyped-def]
    for i in range(len(ident)):
        out[i] = unit(mixed(np.uint32(ident[i] + number * np.uint32(0x9E3779B9))))
