"""The inner loops of the procedural patterns: gradient noise, Worley cells and strokes on hashed lattices.

Every kernel takes coordinates in lattice units, float32, one array an axis, and the lattice's period along each axis in whole
units, 0 where it never repeats. Nothing is looked up in a table: a lattice point's numbers are a hash of its coordinates,
which a vector unit computes for many points at once. """

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

fast = numba.njit(error_model="numpy", cache=True, nogil=True, fastmath={"contract", "reassoc", "nsz", "arcp"})
inline = numba.njit(inline="always", error_model="numpy", cache=True)

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
def unit(h):  # type: ignore[no-untyped-def]
    """[0, 1) of a hash."""
    return np.float32(h >> np.uint32(9)) * UNIT


@inline
def wrapped(x, period, inverse):  # type: ignore[no-untyped-def]
    """A lattice coordinate within its period; itself where the period and its inverse are 0."""
    return x - period * np.floor(x * inverse)


@inline
def slope_at(h, x, y, z):  # type: ignore[no-untyped-def]
    """A corner's random gradient times the offset from it."""
    gx = np.float32(h & np.uint32(1023)) * np.float32(2 / 1023) - np.float32(1)
    gy = np.float32((h >> np.uint32(10)) & np.uint32(1023)) * np.float32(2 / 1023) - np.float32(1)
    gz = np.float32((h >> np.uint32(20)) & np.uint32(1023)) * np.float32(2 / 1023) - np.float32(1)
    return gx * x + gy * y + gz * z


@fast
def gradient_noise(x, y, z, scale, shift, period, seed, out):  # type: ignore[no-untyped-def]
    """Gradient noise of standard deviation 1, features about one unit across. Source: Perlin 2002, "Improving noise".

    x, y, z: (P,); they are multiplied by `scale` and moved by `shift`, three numbers each. seed: uint32. out: (P,).
    """
    one = np.float32(1)
    px, py, pz = np.float32(period.x), np.float32(period.y), np.float32(period.z)
    ix = one / px if px > 0 else np.float32(0)
    iy = one / py if py > 0 else np.float32(0)
    iz = one / pz if pz > 0 else np.float32(0)
    sx, sy, sz = np.float32(scale[0]), np.float32(scale[1]), np.float32(scale[2])
    ax, ay, az = np.float32(shift[0]), np.float32(shift[1]), np.float32(shift[2])
    for i in range(len(x)):
        qx, qy, qz = x[i] * sx + ax, y[i] * sy + ay, z[i] * sz + az
        cx, cy, cz = np.floor(qx), np.floor(qy), np.floor(qz)
        fx, fy, fz = qx - cx, qy - cy, qz - cz
        x0, y0, z0 = wrapped(cx, px, ix), wrapped(cy, py, iy), wrapped(cz, pz, iz)
        x1, y1, z1 = wrapped(cx + one, px, ix), wrapped(cy + one, py, iy), wrapped(cz + one, pz, iz)
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
        out[i] = (near + w * (far - near)) * GRADIENT_SCALE


BLOCK = 128
"""Points that go through the neighbours of their cells together, so that a vector unit takes several at a time."""


@fast
def worley(x, y, z, period, jitter, seed, near, second, border, ident, to_centre):  # type: ignore[no-untyped-def]
    """The two nearest of randomly placed points, one in each unit cube. Source: Worley 1996.

    x, y, z: (P,). jitter: 0 (a grid) ... 1. near, second: (P,) distances to them. border: (P,) distance to the plane between
    the two. ident: (P,) uint32 hash of the nearest. to_centre: (3, P) from the nearest point to here. """
    for start in range(0, len(x), BLOCK):
        part = slice(start, min(start + BLOCK, len(x)))
        _worley_block(
            x[part], y[part], z[part], period, jitter, seed,
            near[part], second[part], border[part], ident[part], to_centre[:, part],
        )  # fmt: skip


@inline
def feature(k, fx, fy, fz, cx, cy, cz, period, inverse, jitter, seed):  # type: ignore[no-untyped-def]
    """Offset to here from the point of neighbour cell k, 0 ... 26, and that point's hash."""
    half, share = np.float32(0.5), np.float32(1 / 65536)
    ax, ay, az = np.float32(k % 3 - 1), np.float32(k // 3 % 3 - 1), np.float32(k // 9 - 1)
    x, y = wrapped(cx + ax, period[0], inverse[0]), wrapped(cy + ay, period[1], inverse[1])
    h = corner(x, y, wrapped(cz + az, period[2], inverse[2]), seed)
    h2 = mixed(np.uint32(h + np.uint32(0x9E3779B9)))
    dx = fx - (ax + half + jitter * (np.float32(h & np.uint32(0xFFFF)) * share - half))
    dy = fy - (ay + half + jitter * (np.float32(h >> np.uint32(16)) * share - half))
    dz = fz - (az + half + jitter * (np.float32(h2 & np.uint32(0xFFFF)) * share - half))
    return dx, dy, dz, h2


@fast
def _worley_block(x, y, z, period, jitter, seed, near, second, border, ident, nearest):  # type: ignore[no-untyped-def]
    one, two = np.float32(1), np.float32(2)
    p = (np.float32(period.x), np.float32(period.y), np.float32(period.z))
    inverse = (
        one / p[0] if p[0] > 0 else np.float32(0),
        one / p[1] if p[1] > 0 else np.float32(0),
        one / p[2] if p[2] > 0 else np.float32(0),
    )
    reach = np.float32(jitter)
    first, then = np.empty(len(x), np.int32), np.empty(len(x), np.int32)
    first[:], then[:] = np.int32(0x7FFFFFFF), np.int32(0x7FFFFFFF)
    for k in range(27):
        for i in range(len(x)):
            cx, cy, cz = np.floor(x[i]), np.floor(y[i]), np.floor(z[i])
            dx, dy, dz, _ = feature(k, x[i] - cx, y[i] - cy, z[i] - cz, cx, cy, cz, p, inverse, reach, seed)
            square = min(dx * dx + dy * dy + dz * dz, np.float32(3.99))
            key = np.int32(np.int32(np.int32(square * np.float32(1 << 23)) * np.int32(32)) + np.int32(k))  # distance, then cell
            then[i] = min(max(first[i], key), then[i])
            first[i] = min(first[i], key)
    for i in range(len(x)):
        cx, cy, cz = np.floor(x[i]), np.floor(y[i]), np.floor(z[i])
        fx, fy, fz = x[i] - cx, y[i] - cy, z[i] - cz
        bx, by, bz, h = feature(first[i] & 31, fx, fy, fz, cx, cy, cz, p, inverse, reach, seed)
        ox, oy, oz, _ = feature(then[i] & 31, fx, fy, fz, cx, cy, cz, p, inverse, reach, seed)
        best, other = bx * bx + by * by + bz * bz, ox * ox + oy * oy + oz * oz
        apart = np.sqrt((bx - ox) ** 2 + (by - oy) ** 2 + (bz - oz) ** 2)
        border[i] = (other - best) / max(two * apart, np.float32(1e-6))
        near[i], second[i], ident[i] = np.sqrt(best), np.sqrt(other), h
        nearest[0, i], nearest[1, i], nearest[2, i] = bx, by, bz


@inline
def sine(x):  # type: ignore[no-untyped-def]
    """Sine of any float32 angle to 2e-4, without a branch."""
    turns = x * np.float32(0.15915494) - np.floor(x * np.float32(0.15915494) + np.float32(0.5))
    y = np.float32(8) * turns - np.float32(16) * turns * abs(turns)
    return y * (np.float32(0.775) + np.float32(0.225) * abs(y))


class Strokes(NamedTuple):
    """number: strokes a cell. length: half of the longest, in cells; with the width at most 1. vary: share by which others are
    shorter. width: half of it, in cells. angle: of their direction, radians from x. spread: range of angles about it.
    bend: how far the ends leave the straight line, as a share of the length.
    """

    number: int
    length: float
    vary: float
    width: float
    angle: float
    spread: float
    bend: float


@fast
def strokes(x, y, face, period, shape, seed, distance, along, ident):  # type: ignore[no-untyped-def]
    """Straight or bent strokes strewn over a plane; where several cross, the one that lies on top of the others.

    x, y: (P,) in cells. face: (P,) int32, each with strokes of its own. distance: (P,) from the topmost stroke's middle line,
    in cells, negative on its right; 9 where there is none. along: (P,) -1 ... 1 from one end to the other. ident: (P,) uint32
    hash. """
    for start in range(0, len(x), BLOCK):
        part = slice(start, min(start + BLOCK, len(x)))
        _strokes_block(x[part], y[part], face[part], period, shape, seed, distance[part], along[part], ident[part])


@fast
def _strokes_block(x, y, face, period, shape, seed, distance, along, ident):  # type: ignore[no-untyped-def]
    one, half, share = np.float32(1), np.float32(0.5), np.float32(1 / 65536)
    px, py = np.float32(period.x), np.float32(period.y)
    ix = one / px if px > 0 else np.float32(0)
    iy = one / py if py > 0 else np.float32(0)
    base, spread, bend = np.float32(shape.angle), np.float32(shape.spread), np.float32(shape.bend)
    longest, vary, width = np.float32(shape.length), np.float32(shape.vary), np.float32(shape.width)
    distance[:], along[:], ident[:] = np.float32(9), np.float32(0), np.uint32(0)
    for k in range(9):
        ax, ay = np.float32(k % 3 - 1), np.float32(k // 3 - 1)
        for j in range(shape.number):
            step = np.uint32(np.uint32(j) * np.uint32(0x9E3779B9))
            for i in range(len(x)):
                cx, cy = np.floor(x[i]), np.floor(y[i])
                cell = corner(wrapped(cx + ax, px, ix), wrapped(cy + ay, py, iy), np.float32(face[i]), seed)
                h = mixed(np.uint32(cell + step))
                h2 = mixed(np.uint32(h ^ np.uint32(0x5BD1E995)))
                dx = x[i] - cx - ax - np.float32(h & np.uint32(0xFFFF)) * share
                dy = y[i] - cy - ay - np.float32(h >> np.uint32(16)) * share
                turn = np.float32(h2 & np.uint32(0xFFFF)) * share - half
                angle = base + spread * turn
                length = longest * (one - vary * np.float32(h2 >> np.uint32(16)) * share)
                c, s = sine(angle + np.float32(1.5707964)), sine(angle)
                t = (dx * c + dy * s) / length
                d = dy * c - dx * s + np.float32(2) * turn * bend * length * (t * t - np.float32(0.3))
                on_top = (abs(t) < one) & (abs(d) < width) & (h > ident[i])
                distance[i] = d if on_top else distance[i]
                along[i] = t if on_top else along[i]
                ident[i] = h if on_top else ident[i]


def random_numbers(ident: NDArray[np.uint32], number: int) -> NDArray[np.float32]:
    """[0, 1) of hashes, another for each `number`. Args: (P,). Returns: (P,)."""
    out = np.empty(len(ident), np.float32)
    _random(ident, np.uint32(number), out)
    return out


@fast
def _random(ident, number, out):  # type: ignore[no-untyped-def]
    for i in range(len(ident)):
        out[i] = unit(mixed(np.uint32(ident[i] + number * np.uint32(0x9E3779B9))))
