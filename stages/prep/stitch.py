"""Fewer charts: neighbours unfolded about a common edge, like the sides of a box, where that saves texture.

A gutter of 32 texels round each of a thousand small flat charts leaves no room for the charts. Hinging one chart onto
its neighbour distorts nothing; it pays when the common bounding box, gutter included, is smaller than the two apart.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.prep.overlap import overlapping
from stages.prep.pack import align, expected_scale, outline
from stages.prep.topology import edges, renumber

_ROUNDS = 24  # of joining pairs, each of which looks at most triangles anew:
_EFFORT = 3_000_000  # triangles looked at, after which a large mesh stops; the first rounds save most
_STRETCH = 0.02  # most that the common edge may differ in length between the two charts


@dataclass(frozen=True)
class _Hinges:
    """Candidate joins: chart `moving` onto chart `fixed` about one edge. a, b: (K, 2, 2) its ends in either chart;
    edge: (K,) its number."""

    fixed: NDArray[np.int64]
    moving: NDArray[np.int64]
    a: NDArray[np.float64]
    b: NDArray[np.float64]
    edge: NDArray[np.int64]


def stitch(
    flat: NDArray, triangles: NDArray, chart: NDArray, texture_size: int, padding: int
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Join charts while that saves texture. Returns flat (F, 3, 2) and chart (F,), joined.

    Args:
        flat: (F, 3, 2) charts in units of length. triangles: (F, 3) vertices. texture_size, padding: texels.
    """
    flat, chart = align(flat, chart), renumber(chart)
    pairs = edges(triangles).pairs
    pairs = pairs[chart[pairs[:, 0] // 3] != chart[pairs[:, 1] // 3]]
    rim = outline(flat, triangles)
    refused = np.zeros(len(pairs), bool)
    for _ in range(min(_ROUNDS, 1 + _EFFORT // len(triangles))):
        size = _sizes(flat, chart, rim)
        gutter = 2 * padding / expected_scale(size, texture_size, padding)
        hinges = _hinges(flat, chart, pairs, refused, size)
        chosen = _worthwhile(flat, chart, rim, hinges, size, gutter)
        if not len(chosen):
            break
        rows = np.flatnonzero(np.isin(chart, [hinges.fixed[chosen], hinges.moving[chosen]]))
        joined, label = _fold(flat[rows], triangles[rows], chart[rows], hinges, chosen)
        bad = overlapping(joined, renumber(label))[renumber(label)]
        refused[hinges.edge[chosen[np.isin(hinges.fixed[chosen], label[bad])]]] = True
        rows, joined, label = rows[~bad], joined[~bad], label[~bad]
        if len(rows):
            flat[rows], chart[rows] = align(joined, renumber(label)), label
            chart = renumber(chart)
    return flat, chart


def _sizes(flat: NDArray, chart: NDArray, rim: NDArray) -> NDArray[np.float64]:
    """(C, 2) bounding boxes of charts whose lowest corner is the origin."""
    size = np.zeros((int(chart.max()) + 1, 2))
    np.maximum.at(size, chart[rim // 3], flat[rim // 3, rim % 3])
    return size


def _hinges(flat: NDArray, chart: NDArray, pairs: NDArray, refused: NDArray, size: NDArray) -> _Hinges:
    """The longest edge between each two neighbouring charts whose length both agree on; the smaller chart moves."""
    edge = np.flatnonzero((chart[pairs[:, 0] // 3] != chart[pairs[:, 1] // 3]) & ~refused)
    swap = size.prod(1)[chart[pairs[edge, 0] // 3]] < size.prod(1)[chart[pairs[edge, 1] // 3]]
    near, far = np.where(swap, pairs[edge, 1], pairs[edge, 0]), np.where(swap, pairs[edge, 0], pairs[edge, 1])
    a = np.stack([_corner(flat, near, 0), _corner(flat, near, 1)], 1)
    b = np.stack([_corner(flat, far, 1), _corner(flat, far, 0)], 1)  # neighbours run along an edge in opposite ways
    length = np.linalg.norm(a[:, 1] - a[:, 0], axis=-1), np.linalg.norm(b[:, 1] - b[:, 0], axis=-1)
    agree = np.flatnonzero(np.abs(length[0] - length[1]) < _STRETCH * np.maximum(*length))
    fixed, moving = chart[near[agree] // 3], chart[far[agree] // 3]
    order = np.lexsort((-length[0][agree], moving, fixed))
    first = np.ones(len(order), bool)
    first[1:] = (fixed[order][1:] != fixed[order][:-1]) | (moving[order][1:] != moving[order][:-1])
    rows = agree[order[first]]
    return _Hinges(chart[near[rows] // 3], chart[far[rows] // 3], a[rows], b[rows], edge[rows])


def _corner(flat: NDArray, half_edge: NDArray, end: int) -> NDArray[np.float64]:
    """UV (K, 2) at the beginning (0) or end (1) of half-edges."""
    return flat[half_edge // 3, (half_edge + end) % 3] if end == 0 else flat[half_edge // 3, (half_edge % 3 + 1) % 3]


def _motion(hinges: _Hinges, rows: NDArray) -> tuple[NDArray, NDArray]:
    """Turn (K, 2, 2), for row vectors, and shift (K, 2) that bring the moving chart's edge onto the fixed one's."""
    u, v = hinges.a[rows, 1] - hinges.a[rows, 0], hinges.b[rows, 1] - hinges.b[rows, 0]
    angle = np.arctan2(u[:, 1], u[:, 0]) - np.arctan2(v[:, 1], v[:, 0])
    c, s = np.cos(angle), np.sin(angle)
    turn = np.stack([np.stack([c, s], -1), np.stack([-s, c], -1)], 1)
    shift = hinges.a[rows].mean(1) - (hinges.b[rows].mean(1)[:, None] @ turn)[:, 0]
    return turn, shift


def _worthwhile(
    flat: NDArray, chart: NDArray, rim: NDArray, hinges: _Hinges, size: NDArray, gutter: float
) -> NDArray[np.int64]:
    """Rows of hinges that save room, each chart in one at most, the best first. rim: corners on charts' outlines."""
    order = rim[np.argsort(chart[rim // 3], kind="stable")]
    count = np.bincount(chart[order // 3], minlength=len(size))
    begin = np.cumsum(count) - count
    turn, shift = _motion(hinges, np.arange(len(hinges.edge)))
    many = count[hinges.moving]
    owner = np.repeat(np.arange(len(many)), many)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(many) - many, many)
    corner = order[begin[hinges.moving][owner] + within]
    points = np.einsum("kd,kde->ke", flat[corner // 3, corner % 3], turn[owner]) + shift[owner]
    low, high = np.zeros((len(many), 2)), size[hinges.fixed].copy()
    np.minimum.at(low, owner, points)
    np.maximum.at(high, owner, points)
    cost = (size + gutter).prod(1)
    saved = cost[hinges.fixed] + cost[hinges.moving] - (high - low + gutter).prod(1)
    used, chosen = np.zeros(len(size), bool), []
    for row in np.argsort(-saved, kind="stable"):
        if saved[row] <= 0:
            break
        both = [hinges.fixed[row], hinges.moving[row]]
        if not used[both].any():
            used[both] = True
            chosen.append(row)
    return np.array(chosen, np.int64)


def _fold(
    flat: NDArray, triangles: NDArray, chart: NDArray, hinges: _Hinges, chosen: NDArray
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """flat and chart of the faces concerned with the chosen joins made; corners that meet become one, bit for bit."""
    row = np.full(int(chart.max()) + 1, -1)
    row[hinges.moving[chosen]] = chosen
    row = row[chart]
    moves = row >= 0
    turn, shift = _motion(hinges, np.maximum(row, 0))
    joined = np.where(moves[:, None, None], flat @ turn + shift[:, None], flat)
    label = np.where(moves, hinges.fixed[row], chart).astype(np.int32)
    reach = _STRETCH * np.linalg.norm(hinges.a[row, 1] - hinges.a[row, 0], axis=-1)
    joined = _snap(joined, triangles, label, moves, reach)
    for end in (0, 1):  # the hinge itself, also where the fixed chart has its vertices twice
        on_hinge = moves[:, None] & (flat == hinges.b[row, end][:, None]).all(-1)
        joined = np.where(on_hinge[..., None], hinges.a[row, end][:, None], joined)
    return joined, label


def _snap(joined: NDArray, triangles: NDArray, label: NDArray, moves: NDArray, reach: NDArray) -> NDArray[np.float64]:
    """Corners of moved faces take the exact place of the same vertex in the chart they moved onto, if within reach.

    reach: (F,) the same for all faces of a chart, so that what hung together goes on doing so.
    """
    key = label.astype(np.int64)[:, None] * (int(triangles.max()) + 1) + triangles
    still, first = np.unique(key[~moves], return_index=True)
    place = joined[~moves].reshape(-1, 2)[first]
    at = np.minimum(np.searchsorted(still, key[moves]), len(still) - 1)
    near = np.linalg.norm(place[at] - joined[moves], axis=-1) <= reach[moves, None]
    result = joined.copy()
    result[moves] = np.where(((still[at] == key[moves]) & near)[..., None], place[at], joined[moves])
    return result
