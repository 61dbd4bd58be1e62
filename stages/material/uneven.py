"""Which texels one sample does not tell: those that differ most from the texel beside them. A border runs through some of them.

A recipe holds nothing finer than the texel that asks, so elsewhere one sample is the texel's mean, nearly; of the texels beside
a border the samples fall on one side or the other. """

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled

STEP = 0.08
"""Difference, of the root of an albedo, of roughness or metallic, from which on a border may lie between: 20 of 255 in a
picture."""

MOST = 1 / 8
"""Share of the texels that are taken at most: of grain that differs everywhere, those that differ most."""


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
    some = apart[known]
    least = np.partition(some, int((1 - MOST) * len(some)))[int((1 - MOST) * len(some))] if len(some) else 0.0
    result: NDArray[np.bool_] = apart > max(STEP, float(least))
    return result


@compiled
def _differ(maps, known, wrap, apart):  # type: ignore[no-untyped-def]
    """The largest difference of each texel from its neighbours."""
    height, width = known.shape
    for i in range(height):
        for j in range(width):
            for down in range(2):
                k, m = i + down, j + 1 - down
                if wrap:
                    k, m = k % height, m % width
                if k < height and m < width and known[i, j] and known[k, m]:
                    step = _difference(maps[i, j], maps[k, m])
                    apart[i, j], apart[k, m] = max(apart[i, j], step), max(apart[k, m], step)


@compiled
def _difference(a, b):  # type: ignore[no-untyped-def]
    step = max(abs(a[3] - b[3]), abs(a[4] - b[4]))
    for c in range(3):
        step = max(step, abs(np.sqrt(max(a[c], np.float32(0))) - np.sqrt(max(b[c], np.float32(0)))))
    return step
