"""At how many points a texel is asked: on its diagonal, and all over it where a border may run through.

A recipe holds nothing finer than what each point stands for, so two points on the diagonal tell a texel's mean nearly; of the
texels beside a border they fall on one side or the other, and these are the ones that differ most from their neighbours. """

import math

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled

STEP = 0.08
"""Difference, of the root of an albedo, of roughness or metallic, from which on a border may lie between: 20 of 255 in a
picture."""

MOST = 1 / 8
"""Share of the texels that are taken at most: of grain that differs everywhere, those that differ most."""


def patterns(supersample: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which of N x N points inside a texel are asked first, and which besides where it is uneven; (N, N) each, rows down."""
    first = np.eye(supersample, dtype=np.bool_)
    return first, ~first


def uneven(maps: NDArray[np.float32], known: NDArray[np.bool_], wrap: bool = False) -> NDArray[np.bool_]:
    """Texels that differ by over `STEP` from one of their four neighbours, at most the share `MOST` of those known.

    Args:
        maps: (H, W, 5 or more) linear albedo, roughness, metallic. known: (H, W) texels that hold something; others are
        nobody's neighbours. wrap: whether the map repeats.
    Returns:
        (H, W).
    """
    apart = np.zeros(known.shape, np.float32)
    _differ(maps, known, wrap, apart)
    result: NDArray[np.bool_] = apart > STEP
    count = np.count_nonzero(known)
    kept = int((1 - MOST) * count)
    if np.count_nonzero(result) > count - kept:
        some = apart[known]
        result = apart > max(STEP, float(np.partition(some, kept)[kept]))
    return result


@compiled
def _differ(maps, known, wrap, apart):  # type: ignore[no-untyped-def]
    """The largest difference of each texel from its neighbours."""
    height, width = known.shape
    rows = np.empty((2, 5, width), np.float32)  # this one and the next, as differences are counted
    _row(maps[0], rows[0])
    for i in range(height):
        below = i + 1 if i + 1 < height else 0
        here, there = rows[i % 2], rows[1 - i % 2]
        _row(maps[below], there)
        _step(here[:, 1:], here[:, :-1], known[i, 1:], known[i, :-1], apart[i, 1:], apart[i, :-1])
        if wrap:
            _step(here[:, :1], here[:, -1:], known[i, :1], known[i, -1:], apart[i, :1], apart[i, -1:])
        if below or wrap:
            _step(here, there, known[i], known[below], apart[i], apart[below])


@compiled
def _row(texels, row):  # type: ignore[no-untyped-def]
    for j in range(len(texels)):
        for c in range(3):
            row[c, j] = math.sqrt(max(texels[j, c], np.float32(0)))
        row[3, j], row[4, j] = texels[j, 3], texels[j, 4]


@compiled
def _step(a, b, a_known, b_known, a_apart, b_apart):  # type: ignore[no-untyped-def]
    """Raise how far apart some texels and their neighbours are."""
    for j in range(a.shape[1]):
        if a_known[j] and b_known[j]:
            step = np.float32(0)
            for c in range(5):
                step = max(step, abs(a[c, j] - b[c, j]))
            a_apart[j], b_apart[j] = max(a_apart[j], step), max(b_apart[j], step)
