"""Points and strokes strewn over a hashed lattice, by compiled loops: Worley cells, and strokes that lie on one another.

Coordinates are in lattice units, float32, one array an axis; see `noise_kernels`. Texels and pixels come row by row, so that
many in a row lie in one cell. For such a run the cell's neighbours are drawn once, and most of them are too far from all of
the run to matter. What a point is told is the same in a run and alone. """

from typing import NamedTuple

import numpy as np

from stages.material.noise_kernels import corner, fast, inline, inverses, mixed, real, singles, wrapped

BLOCK, RUN = 128, 12
"""Most points that go through the cells together, so that a vector unit takes several at a time, and the fewest in one cell
for which it pays to draw its neighbours once."""

FARTHEST = np.float32(3.99)
"""Largest squared distance that is told apart."""


@inline
def run_end(x, y, z, start):  # type: ignore[no-untyped-def]
    """Where the points from `start` on leave its cell, at most BLOCK later."""
    cx, cy, cz = np.floor(x[start]), np.floor(y[start]), np.floor(z[start])
    last = min(start + BLOCK, len(x))
    end = start + 1
    while end < last and np.floor(x[end]) == cx and np.floor(y[end]) == cy and np.floor(z[end]) == cz:
        end += 1
    return end


@inline
def stretch_end(x, y, z, start):  # type: ignore[no-untyped-def]
    """Where a run begins after points that are in none, at most about BLOCK later."""
    end = start
    while end < len(x) and end - start < BLOCK:
        after = run_end(x, y, z, end)
        if after - end >= RUN:
            break
        end = after
    return end


@inline
def next_part(x, y, z, start):  # type: ignore[no-untyped-def]
    """Where the points from `start` on that go together end, and whether they are a run in one cell."""
    end = run_end(x, y, z, start)
    if end - start >= RUN:
        return end, True
    return stretch_end(x, y, z, start), False


@fast
def worley(x, y, z, period, jitter, seed, near, second, border, ident, to_centre):  # type: ignore[no-untyped-def]
    """The two nearest of randomly placed points, one in each unit cube, of those in the 27 cubes around. Source: Worley 1996.

    x, y, z: (P,). jitter: 0 (a grid) ... 1. near, second: (P,) distances to them. border: (P,) distance to the plane between
    the two. ident: (P,) uint32 hash of the nearest. to_centre: (3, P) from the nearest point to here. """
    start = 0
    while start < len(x):
        end, alike = next_part(x, y, z, start)
        part = slice(start, end)
        px, py, pz, found = x[part], y[part], z[part], to_centre[:, part]
        if alike:
            _worley_run(px, py, pz, period, jitter, seed, near[part], second[part], border[part], ident[part], found)
        else:
            _worley_block(px, py, pz, period, jitter, seed, near[part], second[part], border[part], ident[part], found)
        start = end


@inline
def point_in(k, cx, cy, cz, period, inverse, jitter, seed):  # type: ignore[no-untyped-def]
    """Where the point of neighbour cell k, 0 ... 26, lies from this cell's corner, and its hash."""
    half, share, low = np.float32(0.5), np.float32(1 / 65536), np.uint32(0xFFFF)
    ax, ay, az = np.float32(k % 3 - 1), np.float32(k // 3 % 3 - 1), np.float32(k // 9 - 1)
    x, y = wrapped(cx + ax, period[0], inverse[0]), wrapped(cy + ay, period[1], inverse[1])
    h = corner(x, y, wrapped(cz + az, period[2], inverse[2]), seed)
    h2 = mixed(np.uint32(h + np.uint32(0x9E3779B9)))
    px = ax + half + jitter * (real(h & low) * share - half)
    py = ay + half + jitter * (real(h >> np.uint32(16)) * share - half)
    pz = az + half + jitter * (real(h2 & low) * share - half)
    return px, py, pz, h2


@inline
def key_of(dx, dy, dz, k):  # type: ignore[no-untyped-def]
    """A number that orders points by distance, then by cell, and holds the cell in its lowest five bits."""
    square = min(dx * dx + dy * dy + dz * dz, FARTHEST)
    return np.int32(np.int32(np.int32(square * np.float32(1 << 23)) * np.int32(32)) + np.int32(k))


@inline
def told(i, b, o, h, near, second, border, ident, nearest):  # type: ignore[no-untyped-def]
    """Write what point i is told. b, o: to it from the nearest point and the next, three numbers each."""
    best, other = b[0] * b[0] + b[1] * b[1] + b[2] * b[2], o[0] * o[0] + o[1] * o[1] + o[2] * o[2]
    apart = np.sqrt((b[0] - o[0]) ** 2 + (b[1] - o[1]) ** 2 + (b[2] - o[2]) ** 2)
    border[i] = (other - best) / max(np.float32(2) * apart, np.float32(1e-6))
    near[i], second[i], ident[i] = np.sqrt(best), np.sqrt(other), h
    nearest[0, i], nearest[1, i], nearest[2, i] = b


@fast
def _worley_block(x, y, z, period, jitter, seed, near, second, border, ident, nearest):  # type: ignore[no-untyped-def]
    p, inverse, reach = singles(period), inverses(singles(period)), np.float32(jitter)
    first, then = np.empty(len(x), np.int32), np.empty(len(x), np.int32)
    first[:], then[:] = np.int32(0x7FFFFFFF), np.int32(0x7FFFFFFF)
    for k in range(27):
        for i in range(len(x)):
            cx, cy, cz = np.floor(x[i]), np.floor(y[i]), np.floor(z[i])
            px, py, pz, _ = point_in(k, cx, cy, cz, p, inverse, reach, seed)
            key = key_of(x[i] - cx - px, y[i] - cy - py, z[i] - cz - pz, k)
            then[i] = min(max(first[i], key), then[i])
            first[i] = min(first[i], key)
    for i in range(len(x)):
        cx, cy, cz = np.floor(x[i]), np.floor(y[i]), np.floor(z[i])
        fx, fy, fz = x[i] - cx, y[i] - cy, z[i] - cz
        bx, by, bz, h = point_in(first[i] & 31, cx, cy, cz, p, inverse, reach, seed)
        ox, oy, oz, _ = point_in(then[i] & 31, cx, cy, cz, p, inverse, reach, seed)
        told(i, (fx - bx, fy - by, fz - bz), (fx - ox, fy - oy, fz - oz), h, near, second, border, ident, nearest)


@fast
def _worley_run(x, y, z, period, jitter, seed, near, second, border, ident, nearest):  # type: ignore[no-untyped-def]
    """`_worley_block` of points in one cell."""
    p, inverse, reach = singles(period), inverses(singles(period)), np.float32(jitter)
    cx, cy, cz = np.floor(x[0]), np.floor(y[0]), np.floor(z[0])
    low = (x.min() - cx, y.min() - cy, z.min() - cz)
    high = (x.max() - cx, y.max() - cy, z.max() - cz)
    points, hashes, least = np.empty((27, 3), np.float32), np.empty(27, np.uint32), np.empty(27, np.float32)
    close, next_close = np.float32(9), np.float32(9)  # within these every one of the run has a point, and two
    for k in range(27):
        points[k, 0], points[k, 1], points[k, 2], hashes[k] = point_in(k, cx, cy, cz, p, inverse, reach, seed)
        lower, upper = np.float32(0), np.float32(0)
        for c in range(3):
            lower += max(low[c] - points[k, c], points[k, c] - high[c], np.float32(0)) ** 2
            upper += max(abs(low[c] - points[k, c]), abs(high[c] - points[k, c])) ** 2
        least[k] = lower
        next_close = min(max(close, upper), next_close)
        close = min(close, upper)
    limit = next_close * np.float32(1.00001) + np.float32(1e-6) if next_close < np.float32(3.9) else np.float32(99)
    first, then = np.empty(len(x), np.int32), np.empty(len(x), np.int32)
    first[:], then[:] = np.int32(0x7FFFFFFF), np.int32(0x7FFFFFFF)
    for k in range(27):
        if least[k] <= limit:
            px, py, pz = points[k, 0], points[k, 1], points[k, 2]
            for i in range(len(x)):
                key = key_of(x[i] - cx - px, y[i] - cy - py, z[i] - cz - pz, k)
                then[i] = min(max(first[i], key), then[i])
                first[i] = min(first[i], key)
    for i in range(len(x)):
        fx, fy, fz = x[i] - cx, y[i] - cy, z[i] - cz
        f, t = first[i] & 31, then[i] & 31
        b = (fx - points[f, 0], fy - points[f, 1], fz - points[f, 2])
        o = (fx - points[t, 0], fy - points[t, 1], fz - points[t, 2])
        told(i, b, o, hashes[f], near, second, border, ident, nearest)


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
    distance[:], along[:], ident[:] = np.float32(9), np.float32(0), np.uint32(0)
    start = 0
    while start < len(x):
        end, alike = next_part(x, y, face, start)
        part = slice(start, end)
        if alike:
            _strokes_run(x[part], y[part], face[part], period, shape, seed, distance[part], along[part], ident[part])
        else:
            _strokes_block(x[part], y[part], face[part], period, shape, seed, distance[part], along[part], ident[part])
        start = end


@inline
def stroke(k, j, cx, cy, face, period, inverse, shape, seed):  # type: ignore[no-untyped-def]
    """Stroke j of neighbour cell k, 0 ... 8: its middle from this cell's corner, cosine and sine, half length, turn (-0.5 ...
    0.5), hash."""
    half, share, low = np.float32(0.5), np.float32(1 / 65536), np.uint32(0xFFFF)
    ax, ay = np.float32(k % 3 - 1), np.float32(k // 3 - 1)
    cell = corner(wrapped(cx + ax, period[0], inverse[0]), wrapped(cy + ay, period[1], inverse[1]), np.float32(face), seed)
    h = mixed(np.uint32(cell + np.uint32(np.uint32(j) * np.uint32(0x9E3779B9))))
    h2 = mixed(np.uint32(h ^ np.uint32(0x5BD1E995)))
    px, py = ax + real(h & low) * share, ay + real(h >> np.uint32(16)) * share
    turn = real(h2 & low) * share - half
    angle = np.float32(shape.angle) + np.float32(shape.spread) * turn
    length = np.float32(shape.length) * (np.float32(1) - np.float32(shape.vary) * real(h2 >> np.uint32(16)) * share)
    return px, py, sine(angle + np.float32(1.5707964)), sine(angle), length, turn, h


@inline
def lay(i, dx, dy, c, s, length, turn, h, shape, distance, along, ident):  # type: ignore[no-untyped-def]
    """Lay a stroke at point i, which is (dx, dy) from its middle, over what lies there."""
    t = (dx * c + dy * s) / length
    d = dy * c - dx * s + np.float32(2) * turn * np.float32(shape.bend) * length * (t * t - np.float32(0.3))
    on_top = (abs(t) < np.float32(1)) & (abs(d) < np.float32(shape.width)) & (h > ident[i])
    distance[i] = d if on_top else distance[i]
    along[i] = t if on_top else along[i]
    ident[i] = h if on_top else ident[i]


@fast
def _strokes_block(x, y, face, period, shape, seed, distance, along, ident):  # type: ignore[no-untyped-def]
    p, inverse = singles(period), inverses(singles(period))
    for k in range(9):
        for j in range(shape.number):
            for i in range(len(x)):
                cx, cy = np.floor(x[i]), np.floor(y[i])
                px, py, c, s, length, turn, h = stroke(k, j, cx, cy, face[i], p, inverse, shape, seed)
                lay(i, x[i] - cx - px, y[i] - cy - py, c, s, length, turn, h, shape, distance, along, ident)


@fast
def _strokes_run(x, y, face, period, shape, seed, distance, along, ident):  # type: ignore[no-untyped-def]
    """`_strokes_block` of points in one cell; strokes that miss the box around them are left out."""
    p, inverse, half = singles(period), inverses(singles(period)), np.float32(0.5)
    cx, cy = np.floor(x[0]), np.floor(y[0])
    middle_x, middle_y = half * (x.min() + x.max()) - cx, half * (y.min() + y.max()) - cy
    wide, high = half * (x.max() - x.min()), half * (y.max() - y.min())
    for k in range(9):
        for j in range(shape.number):
            px, py, c, s, length, turn, h = stroke(k, j, cx, cy, face[0], p, inverse, shape, seed)
            dx, dy = middle_x - px, middle_y - py
            spare = np.float32(1e-4) + abs(c) * wide + abs(s) * high, np.float32(1e-4) + abs(s) * wide + abs(c) * high
            bent = np.float32(0.7) * abs(np.float32(shape.bend)) * length
            if abs(dx * c + dy * s) > length + spare[0] or abs(dy * c - dx * s) > np.float32(shape.width) + bent + spare[1]:
                continue
            for i in range(len(x)):
                lay(i, x[i] - cx - px, y[i] - cy - py, c, s, length, turn, h, shape, distance, along, ident)
