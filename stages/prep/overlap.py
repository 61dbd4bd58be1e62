"""Which charts cover themselves, told by drawing each in a box of its own."""

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled
from stages.prep.pack import shelve, turned
from stages.prep.uv import changes

_TEXELS = 1024
_SLACK = 1  # texels that rounding may leave


def overlapping(flat: NDArray, chart: NDArray) -> NDArray[np.bool_]:
    """(C,) charts some texels of which are covered more than once.

    Args:
        flat: (F, 3, 2) each chart unfolded, in any place. chart: (F,) from 0.
    """
    low, high = (np.full((int(chart.max()) + 1, 2), sign * np.inf) for sign in (1, -1))
    np.minimum.at(low, np.repeat(chart, 3), flat.reshape(-1, 2))
    np.maximum.at(high, np.repeat(chart, 3), flat.reshape(-1, 2))
    scale, layout = _TEXELS / np.sqrt((high - low).prod(1).sum()), None
    while layout is None:
        scale *= 0.9
        layout = shelve((high - low) * scale, _TEXELS, 0)
    place, turn, size = layout
    texels = turned((flat - low[chart][:, None]) * scale, size[chart], turn[chart]) + place[chart][:, None]
    twice = np.zeros((_TEXELS + 1, _TEXELS + 1), np.int32)
    _count_twice(changes(texels, _TEXELS, _TEXELS), twice)
    extent = np.where(turn[:, None] == 1, size[:, ::-1], size)
    x0, y0 = np.clip(np.ceil(place - 0.5), 0, _TEXELS).astype(np.int64).T
    x1, y1 = np.clip(np.ceil(place + extent - 0.5), 0, _TEXELS).astype(np.int64).T
    return twice[y1, x1] - twice[y0, x1] - twice[y1, x0] + twice[y0, x0] > _SLACK


@compiled
def _count_twice(change, twice):  # type: ignore[no-untyped-def]
    """The summed-area table of the texels that are covered more than once. Args: change: of `stages.prep.uv.changes`."""
    for y in range(len(twice) - 1):
        covered, total = 0.0, 0
        for x in range(twice.shape[1] - 1):
            covered += change[y, x]
            total += covered > 1
            twice[y + 1, x + 1] = twice[y, x + 1] + total
