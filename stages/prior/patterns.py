"""How a material varies in space: scalar functions of the 3-D point, so that no UV and no seam enters.

Each pattern maps points to values around 0, about -1 ... 1, which `recipe.py` turns into colour and roughness. Noise
is a fixed lattice of random values, interpolated smoothly and repeated every 32 units.
"""

import functools
from collections.abc import Callable

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

LATTICE = np.random.default_rng(20240607).uniform(-1, 1, 32**3).astype(np.float32)
"""Random values on a 32³ lattice, flattened."""


def noise(p: NDArray) -> NDArray[np.float32]:
    """Smooth value noise with features about 1 unit across. Args: p (P, 3). Returns: (P,) in [-1, 1]."""
    cell = np.floor(p)
    x = (p - cell).astype(np.float32)
    x = x * x * (3 - 2 * x)
    low = cell.astype(np.int64) & 31
    high = (low + 1) & 31
    z0, z1, y0, y1, x0, x1 = low[:, 2], high[:, 2], low[:, 1] << 5, high[:, 1] << 5, low[:, 0] << 10, high[:, 0] << 10
    fx, fy, fz = x.T

    def along_z(base: NDArray) -> NDArray:
        a = LATTICE[base | z0]
        return a + (LATTICE[base | z1] - a) * fz

    near, far = along_z(x0 | y0), along_z(x1 | y0)
    near += (along_z(x0 | y1) - near) * fy
    far += (along_z(x1 | y1) - far) * fy
    return near + (far - near) * fx


def fbm(p: NDArray, octaves: int = 3) -> NDArray[np.float32]:
    """Octaves of noise, each half as strong; in about [-1, 1]."""
    total = np.zeros(len(p), np.float32)
    for k in range(octaves):
        total += noise(p * 2.0**k + 7.3 * k) * 0.5**k
    return total * 0.9


def plain(p: NDArray) -> NDArray:
    """Nearly nothing: a faint, wide variation."""
    return 0.3 * noise(p)


def smudge(p: NDArray) -> NDArray:
    """Finger marks and wear of metals: wide spots with finer ones inside."""
    return fbm(p, 3)


def blotch(p: NDArray) -> NDArray:
    """Irregular stains."""
    return np.clip(2.2 * fbm(p * 1.5, 4), -1, 1)


def speckle(p: NDArray) -> NDArray:
    """Grains of several kinds, as in granite."""
    grains = noise(p * 8)
    return np.where(grains > 0.25, 1.0, np.where(grains < -0.3, -1.0, 0.25 * noise(p * 16))).astype(np.float32)


def grain(p: NDArray) -> NDArray:
    """Growth rings about an axis, with fibres along it."""
    radius = np.hypot(p[:, 0] + 0.3 * noise(p * 0.6), p[:, 1] + 0.3 * noise(p * 0.6 + 9))
    rings = np.sin(12 * radius + 2 * noise(p * 0.8 + 4))
    fibres = noise(p * np.array([14, 14, 1.2]))
    return (0.65 * rings + 0.45 * fibres).astype(np.float32)


def veins(p: NDArray) -> NDArray:
    """Thin dark lines on a clouded ground, as in marble."""
    ridge = 1 - np.abs(noise(p + 0.9 * noise(p * 2 + 5)[:, None]))
    return 0.25 * fbm(p * 2, 2) - 1.1 * ridge**10


def lightveins(p: NDArray) -> NDArray:
    """Thin light lines."""
    return -veins(p) - 0.2


def strata(p: NDArray) -> NDArray:
    """Layers across the third axis."""
    return np.sin(5 * p[:, 2] + 1.5 * noise(p)) * 0.6 + 0.5 * noise(p * np.array([2, 2, 9]))


def bricks(p: NDArray) -> NDArray:
    """Courses of blocks with joints (-1); each block has its own shade."""
    q = p * 2.2
    course = np.floor(q[:, 2] * 2)
    column = q[:, 0] + q[:, 1] + 0.5 * (course % 2)
    joint = (np.abs((q[:, 2] * 2) % 1 - 0.5) > 0.43) | (np.abs(column % 1 - 0.5) > 0.46)
    shade = noise(np.stack([np.floor(column) * 3.7, course * 5.1, np.zeros_like(course)], 1))
    return np.where(joint, -1.0, 0.6 * shade + 0.3 * noise(p * 12)).astype(np.float32)


def weave(p: NDArray) -> NDArray:
    """Warp and weft with slightly uneven threads."""
    q = p * 22 + 0.5 * noise(p * 2)[:, None]
    threads = np.sin(q[:, 0]) * np.sin(q[:, 1] + 0.7) * np.sin(q[:, 2] + 1.4)
    return (0.8 * threads + 0.3 * noise(p * 3)).astype(np.float32)


def streaks(p: NDArray) -> NDArray:
    """Fine lines along an axis, as brushing leaves them."""
    return noise(p * np.array([24, 24, 0.8])) * 0.8


def cells(p: NDArray) -> NDArray:
    """Pebbled skin: rounded cells with creases between."""
    q = p * 9
    crease = np.sqrt(np.abs(noise(q)) * np.abs(noise(q + 11.5)))
    return (0.4 - 2.2 * crease + 0.3 * noise(p * 2)).astype(np.float32)


PATTERNS: dict[str, Callable[[NDArray], NDArray]] = {
    f.__name__: f
    for f in (plain, smudge, blotch, speckle, grain, veins, lightveins, strata, bricks, weave, streaks, cells)
}


@functools.cache
def average(name: str) -> float:
    """Mean of a pattern."""
    return float(PATTERNS[name](np.random.default_rng(0).uniform(0, 32, (20_000, 3))).mean())


DARK_BELOW = ("veins", "bricks", "cells")
"""Patterns whose negative side is the dark one."""

LEVEL = ("bricks", "strata")
"""Patterns whose courses lie level."""


def placement(rng: Generator, upright: bool) -> tuple[NDArray, NDArray]:
    """A random turn and shift of a pattern: (3, 3) and (3,). upright: it keeps its third axis, so courses lie level."""
    angle = rng.uniform(0, 2 * np.pi)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    if not upright:
        turn = turn[:, rng.permutation(3)]
        tilt = rng.normal(0, 0.25)
        turn = turn @ np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    return turn, rng.uniform(0, 32, 3)
