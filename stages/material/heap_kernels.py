"""Broken or rounded pieces that lie on one another, by compiled loops over a hashed lattice.

Coordinates are in lattice units, float32, one array an axis; see `noise_kernels`. Points of a run that lie in one cell share
what was drawn around it; what a point is told is the same in a run and alone. """

from typing import NamedTuple

import numpy as np

from stages.material.noise_kernels import fast, inline, inverses, mixed, real, singles
from stages.material.scatter_kernels import point_in, run_end

FACETS = 7
"""Planes by which a piece is broken, at most."""


class Pieces(NamedTuple):
    """Of a heap, lengths in cells. radius: of the largest piece, at most 0.95. vary: share by which others are smaller. sharp:
    how deep broken faces cut, as a share of the radius; 0 balls. rounding: 0 sides as flat as they broke … 1 a dome. slope:
    rise of the sides. thick: rise of the top over the rim. lift: range of heights at which pieces lie. tilt: of their tops."""

    radius: float
    vary: float
    sharp: float
    rounding: float
    slope: float
    thick: float
    lift: float
    tilt: float


@inline
def plane(h, j, radius, sharp):  # type: ignore[no-untyped-def]
    """Face j of a piece of hash h: its unit normal and how far from the middle it lies."""
    g, byte, one = mixed(np.uint32(h + np.uint32(j) * np.uint32(0x9E3779B9))), np.uint32(255), np.float32(1)
    x, y, z = (
        real(g & byte) * np.float32(2 / 255) - one,
        real((g >> np.uint32(8)) & byte) * np.float32(2 / 255) - one,
        real((g >> np.uint32(16)) & byte) * np.float32(2 / 255) - one,
    )
    inverse = one / np.sqrt(max(x * x + y * y + z * z, np.float32(1e-3)))
    away = radius * (one - sharp * real(g >> np.uint32(24)) * np.float32(1 / 256))
    return x * inverse, y * inverse, z * inverse, away


@inline
def rise(inside, shape):  # type: ignore[no-untyped-def]
    """Height over the rim of what lies this far within a piece; whether that is on its top."""
    one = np.float32(1)
    t = inside * np.float32(shape.slope / shape.thick)
    return np.float32(shape.thick) * min(t, one) * (one + np.float32(shape.rounding) * (one - min(t, one))), t >= one


@inline
def bedding(h, shape):  # type: ignore[no-untyped-def]
    """How high a piece of hash h lies, and how much its top leans, along the first axis and the second."""
    byte, half = np.uint32(255), np.float32(0.5)
    level = np.float32(shape.lift) * real(h >> np.uint32(16)) * np.float32(1 / 65536)
    lean = np.float32(2 * shape.tilt)
    return (
        level,
        lean * (real(h & byte) * np.float32(1 / 255) - half),
        lean * (real((h >> np.uint32(8)) & byte) * np.float32(1 / 255) - half),
    )


@fast
def heap(x, y, z, period, shape, seed, top, second, ident, facet):  # type: ignore[no-untyped-def]
    """Pieces heaped up, one in each unit cube: what lies on top, and how high what lies beneath it.

    x, y, z: (P,). top, second: (P,) heights of the two uppermost surfaces, in cells, 0 for the ground. ident: (P,) uint32 hash
    of the uppermost piece, 0 for the ground; facet: of its face. """
    top[:], second[:], ident[:], facet[:] = np.float32(0), np.float32(0), np.uint32(0), np.uint32(0)
    start = 0
    while start < len(x):
        end = run_end(x, y, z, start)
        part = slice(start, end)
        _heap_run(x[part], y[part], z[part], period, shape, seed, top[part], second[part], ident[part], facet[part])
        start = end


@fast
def _heap_run(x, y, z, period, shape, seed, top, second, ident, facet):  # type: ignore[no-untyped-def]
    p, inverse, none, one = singles(period), inverses(singles(period)), np.float32(0), np.float32(1)
    cx, cy, cz = np.floor(x[0]), np.floor(y[0]), np.floor(z[0])
    low = (x.min() - cx, y.min() - cy, z.min() - cz)
    high = (x.max() - cx, y.max() - cy, z.max() - cz)
    faces = np.empty((FACETS, 4), np.float32)
    for k in range(27):
        px, py, pz, h = point_in(k, cx, cy, cz, p, inverse, one, seed)
        radius = np.float32(shape.radius) * (one - np.float32(shape.vary) * real(h & np.uint32(0xFFFF)) * np.float32(1 / 65536))
        away = none
        for lower, upper, middle in ((low[0], high[0], px), (low[1], high[1], py), (low[2], high[2], pz)):
            away += max(lower - middle, middle - upper, none) ** 2
        if away >= radius * radius:
            continue
        turned = mixed(np.uint32(h ^ np.uint32(0x5BD1E995)))
        level, lean_x, lean_y = bedding(turned, shape)
        for j in range(FACETS):
            faces[j, 0], faces[j, 1], faces[j, 2], faces[j, 3] = plane(turned, j, radius, np.float32(shape.sharp))
        for i in range(len(x)):
            dx, dy, dz = x[i] - cx - px, y[i] - cy - py, z[i] - cz - pz
            inside, found = radius - np.sqrt(dx * dx + dy * dy + dz * dz), np.uint32(FACETS)
            if inside <= 0:
                continue
            for j in range(FACETS):
                near = faces[j, 3] - (dx * faces[j, 0] + dy * faces[j, 1] + dz * faces[j, 2])
                found = np.uint32(j) if near < inside else found
                inside = min(near, inside)
            if inside <= 0:
                continue
            above, flat = rise(inside, shape)
            height = max(level + above + dx * lean_x + dy * lean_y, np.float32(0.001))
            if height > top[i]:
                second[i], top[i], ident[i] = top[i], height, h
                facet[i] = mixed(np.uint32(h + (np.uint32(FACETS) if flat else found) * np.uint32(0x85EBCA77)))
            else:
                second[i] = max(second[i], height)
