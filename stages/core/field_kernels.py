"""Compiled CPU kernels of the hash grid; `stages.core.field.encode_reference` is the plain form of the same.

Levels own disjoint parts of the table, so threads that take whole levels never meet: the sums are formed in one
order whatever the number of threads. Kernels release the interpreter lock.
"""

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled, in_parallel, slices

POINTS_PER_TASK = 1 << 11
PRIME_Y, PRIME_Z = np.uint32(2654435761), np.uint32(805459861)  # of stages.core.field.HASH_PRIMES

Rows = NDArray[np.int64]
Values = NDArray[np.float32]


def encode(p: Values, table: Values, layout: Rows) -> Values:
    """Features (levels * 2, N) of points p (N, 3); see `stages.core.field.encode_reference`."""
    out = np.empty((2 * len(layout), len(p)), np.float32)
    in_parallel(lambda part: _encode(p[part], table, layout, out[:, part]), slices(len(p), POINTS_PER_TASK))
    return out


def encode_backward(p: Values, gradient: Values, layout: Rows) -> tuple[Rows, Values]:
    """Gradient of the table from the gradient of the features.

    Args:
        p: (N, 3). gradient: (levels * 2, N).
    Returns:
        rows: (R,) ascending, each once. values: (R, 2).
    """

    def level_backward(level: int) -> tuple[Rows, Values]:
        resolution, start, entries = map(int, layout[level])
        sums, touched = np.zeros((entries, 2), np.float32), np.zeros(-(-entries // 64), np.uint64)
        count = _scatter(p, gradient, level, resolution, entries, sums, touched)
        rows, values = np.empty(count, np.int64), np.empty((count, 2), np.float32)
        _collect(sums, touched, start, rows, values)
        return rows, values

    parts = in_parallel(level_backward, range(len(layout)))
    return np.concatenate([rows for rows, _ in parts]), np.concatenate([values for _, values in parts])


@compiled
def _axis(position, resolution):  # type: ignore[no-untyped-def]
    """Cell and fraction of one coordinate, clamped to the box."""
    x = min(max(position + np.float32(0.5), np.float32(0.0)), np.float32(1.0)) * np.float32(resolution)
    cell = min(np.int64(x), resolution - 1)
    return cell, x - np.float32(cell)


@compiled
def _corners(p, resolution, entries, rows, weights):  # type: ignore[no-untyped-def]
    """Rows (8,), within their level, and weights (8,) of the corners of the cell around point p (3,)."""
    x, fx = _axis(p[0], resolution)
    y, fy = _axis(p[1], resolution)
    z, fz = _axis(p[2], resolution)
    side = resolution + 1
    if side * side * side <= entries:
        first = x + side * (y + side * z)
        for c in range(8):
            rows[c] = first + (c & 1) + side * ((c >> 1) & 1) + side * side * (c >> 2)
    else:
        hy, hz = np.uint32(y) * PRIME_Y, np.uint32(z) * PRIME_Z
        for c in range(8):
            h = np.uint32(x + (c & 1)) ^ (hy + PRIME_Y * ((c >> 1) & 1)) ^ (hz + PRIME_Z * (c >> 2))
            rows[c] = h & (entries - 1)
    for c in range(8):
        wx = fx if c & 1 else np.float32(1.0) - fx
        wy = fy if c & 2 else np.float32(1.0) - fy
        wz = fz if c & 4 else np.float32(1.0) - fz
        weights[c] = wx * wy * wz


@compiled
def _encode(p, table, layout, out):  # type: ignore[no-untyped-def]
    rows, weights = np.empty(8, np.int64), np.empty(8, np.float32)
    for level in range(len(layout)):
        resolution, start, entries = layout[level]
        for i in range(len(p)):
            _corners(p[i], resolution, entries, rows, weights)
            a, b = np.float32(0.0), np.float32(0.0)
            for c in range(8):
                a += weights[c] * table[start + rows[c], 0]
                b += weights[c] * table[start + rows[c], 1]
            out[2 * level, i] = a
            out[2 * level + 1, i] = b


@compiled
def _scatter(p, gradient, level, resolution, entries, sums, touched):  # type: ignore[no-untyped-def]
    """Add one level's gradients into `sums` and mark its rows, a bit each. Returns: how many rows were marked."""
    rows, weights = np.empty(8, np.int64), np.empty(8, np.float32)
    count = 0
    for i in range(len(p)):
        _corners(p[i], resolution, entries, rows, weights)
        for c in range(8):
            row = rows[c]
            sums[row, 0] += weights[c] * gradient[2 * level, i]
            sums[row, 1] += weights[c] * gradient[2 * level + 1, i]
            bit = np.uint64(1) << np.uint64(row & 63)
            count += (touched[row >> 6] & bit) == 0
            touched[row >> 6] |= bit
    return count


@compiled
def _collect(sums, touched, start, rows, values):  # type: ignore[no-untyped-def]
    """The marked rows of `sums`, in ascending order."""
    k = 0
    for word in range(len(touched)):
        if touched[word]:
            for row in range(64 * word, min(64 * word + 64, len(sums))):
                if touched[word] >> np.uint64(row & 63) & np.uint64(1):
                    rows[k] = start + row
                    values[k, 0], values[k, 1] = sums[row, 0], sums[row, 1]
                    k += 1
