"""Packing charts into the unit square with an exact gutter.

Charts fall like tetrominoes onto a horizon, tall ones first, each in the one of four quarter turns and the column where
it comes to lie lowest; the common scale is the largest at which all fit. Source: Lévy et al. 2002, "Least Squares
Conformal Maps for Automatic Texture Atlas Generation", section 4. Lengths are in cells of a few texels, and a chart
claims every cell that it touches and `padding` more on each side, so that gutters are never narrower than asked for.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled
from stages.prep.topology import edges
from stages.prep.uv import signed_area, uv_vertices

_CELLS = 2048  # most cells across the texture
_PADDINGS = ((16, 0.03), (8, 0.18), (4, 0.3), (2, 1.0))
"""Texels of a texture of 2048, and the share of the charts' scale, beside the last's, that each may take. A padding of 8 keeps
charts apart in all mip levels down to an eighth of the size, 4 to a quarter, 2 to a half."""
_FILL = 0.7  # share of the texture that bounding boxes and gutters may take when the scale is estimated
_STEPS = 9  # bisections of the scale
_MANY = 3000  # charts; more are laid on shelves
_ANGLES = 24  # orientations tried for a chart's bounding rectangle, over a quarter turn


@dataclass(frozen=True)
class _Outlines:
    """Boundary segments of all charts. start, end: (S, 2), each chart's lowest corner at the origin. chart: (S,).
    size: (C, 2)."""

    start: NDArray[np.float64]
    end: NDArray[np.float64]
    chart: NDArray[np.int64]
    size: NDArray[np.float64]


@dataclass(frozen=True)
class Packing:
    """uv: (F, 3, 2) float32 in [0, 1]. texels_per_unit: of length. gutter: least texels between charts."""

    uv: NDArray[np.float32]
    texels_per_unit: float
    gutter: int


def pack(flat: NDArray, triangles: NDArray, chart: NDArray, texture_size: int, padding: int) -> Packing:
    """Lay charts out in the unit square, all at one scale.

    Where there are so many charts that gutters would leave no room, the padding is halved until there is.

    Args:
        flat: (F, 3, 2) each chart unfolded, in units of length. triangles: (F, 3) vertices. chart: (F,) from 0.
        texture_size, padding: texels.
    """
    upright = align(flat, chart)
    outlines = _outlines(upright, triangles, chart)
    while True:
        found = _largest(outlines, texture_size, padding)
        if found is not None:
            break
        padding //= 2
    scale, place, turn, size = found
    moved = turned(upright * scale, size[chart], turn[chart]) + place[chart][:, None]
    uv = np.clip(moved / texture_size, 0.0, 1.0).astype(np.float32)
    return Packing(uv, scale, 2 * padding)


def affordable_padding(flat: NDArray, chart: NDArray, texture_size: int) -> int:
    """The widest padding, texels, that is worth what it takes from the charts' scale.

    Args:
        flat: (F, 3, 2) charts in units of length. chart: (F,) from 0.
    """
    size = np.zeros((int(chart.max()) + 1, 2))
    np.maximum.at(size, np.repeat(chart, 3), align(flat, chart).reshape(-1, 2))
    widths = [max(round(padding * texture_size / 2048), 1) for padding, _ in _PADDINGS]
    scales = [expected_scale(size, texture_size, padding) for padding in widths]
    losses = [1 - scale / scales[-1] for scale in scales]
    return next(padding for padding, loss, (_, most) in zip(widths, losses, _PADDINGS, strict=True) if loss <= most)


def expected_scale(size: NDArray, texture_size: int, padding: int) -> float:
    """Texels per unit at which boxes (C, 2) and gutters fill the texture: sum of (w s + 2 p) (h s + 2 p) = fill * size^2."""
    a, b = float(size.prod(1).sum()), 2 * padding * float(size.sum())
    c = 4 * padding**2 * len(size) - _FILL * texture_size**2
    largest = texture_size / a**0.5
    if c >= 0:
        return largest / 100
    return max((-b + (b * b - 4 * a * c) ** 0.5) / (2 * a), largest / 100)


def align(flat: NDArray, chart: NDArray) -> NDArray[np.float64]:
    """Each chart turned face up and to its smallest bounding rectangle, the lowest corner at the origin."""
    count = int(chart.max()) + 1
    mirror = np.where(np.bincount(chart, signed_area(flat)) < 0, -1.0, 1.0)[chart]
    flat = flat * np.stack([mirror, np.ones_like(mirror)], -1)[:, None]
    owner = np.repeat(chart, 3)
    order = np.argsort(owner, kind="stable")
    points, begins = flat.reshape(-1, 2)[order].astype(np.float64), np.searchsorted(owner[order], np.arange(count))
    best, angle = np.full(count, np.inf), np.zeros(count)
    for candidate in np.arange(_ANGLES) * (np.pi / 2 / _ANGLES):
        tried = points @ _rotation(candidate)
        extent = np.maximum.reduceat(tried, begins) - np.minimum.reduceat(tried, begins)
        better = extent.prod(1) < best * (1 - 1e-9)
        best, angle = np.where(better, extent.prod(1), best), np.where(better, candidate, angle)
    c, s = np.cos(angle[chart])[:, None], np.sin(angle[chart])[:, None]
    x, y = flat[..., 0].astype(np.float64), flat[..., 1].astype(np.float64)
    upright = np.stack([x * c + y * s, y * c - x * s], -1)
    low = np.minimum.reduceat(upright.reshape(-1, 2)[order], begins)
    return upright - low[chart][:, None]


def _rotation(angle: float) -> NDArray[np.float64]:
    """Matrix for row vectors that turns by -angle."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def outline(flat: NDArray, triangles: NDArray) -> NDArray[np.int64]:
    """Half-edges (3 face + corner) that no other face of their chart shares."""
    table = edges(uv_vertices(triangles, flat))
    return np.flatnonzero(table.faces[table.edge] != 2)


def _outlines(upright: NDArray, triangles: NDArray, chart: NDArray) -> _Outlines:
    border = outline(upright, triangles)
    points = upright.reshape(-1, 2)
    owner = np.repeat(chart, 3)
    size = np.zeros((int(chart.max()) + 1, 2))
    np.maximum.at(size, owner, points)
    after = border - border % 3 + (border + 1) % 3
    return _Outlines(points[border], points[after], owner[border], size)


_Layout = tuple[NDArray, NDArray, NDArray]
"""Texels: lowest corners (C, 2), quarter turns (C,), sizes before turning (C, 2)."""


def _largest(outlines: _Outlines, texture_size: int, padding: int) -> tuple[float, NDArray, NDArray, NDArray] | None:
    """The largest scale (texels per unit) at which all charts fit, with their layout; None when there is none."""
    many = len(outlines.size) > _MANY
    high = texture_size / max(float(np.sqrt(outlines.size.prod(1).sum())), float(outlines.size.max()) * 0.7)
    low, best = 0.0, None
    for _ in range(_STEPS):
        middle = (low + high) / 2
        if many:
            trial = shelve(outlines.size * middle, texture_size, padding)
        else:
            trial = _drop(outlines, middle, texture_size, padding)
        if trial is None:
            high = middle
        else:
            low, best = middle, (middle, *trial)
    return best


def shelve(size: NDArray, texture_size: int, padding: int) -> _Layout | None:
    """Bounding boxes (C, 2) upright in rows, tallest first, all in texels: quick for any number. None: do not fit."""
    lying = size[:, 0] > size[:, 1]
    upright = np.where(lying[:, None], size[:, ::-1], size) + 2 * padding
    order = np.lexsort((np.arange(len(size)), -upright[:, 1]))
    right = np.cumsum(upright[order, 0])
    place = np.zeros_like(size)
    begin, row = 0, 0.0
    while begin < len(order):
        left = right[begin - 1] if begin else 0.0
        end = max(int(np.searchsorted(right, left + texture_size, "right")), begin + 1)
        shelf = order[begin:end]
        place[shelf] = np.stack([right[begin:end] - upright[shelf, 0] - left, np.full(end - begin, row)], -1) + padding
        row += upright[shelf[0], 1]
        begin = end
        if row > texture_size or right[end - 1] - left > texture_size:
            return None
    return place, lying.astype(np.int64), size


def _drop(outlines: _Outlines, scale: float, texture_size: int, padding: int) -> _Layout | None:
    """Charts dropped onto the horizon."""
    cell = max(texture_size // _CELLS, 1)
    cells, margin = texture_size // cell, -(-padding // cell)
    extent = np.floor(outlines.size * scale / cell).astype(np.int64) + 1
    if (extent + 2 * margin).prod(1).min() * len(extent) > cells * cells:
        return None
    profiles = _profiles(outlines, scale / cell, extent, margin)
    horizon = np.zeros(cells, np.int64)
    place, turn = np.zeros((len(extent), 2)), np.zeros(len(extent), np.int64)
    for index in np.lexsort((np.arange(len(extent)), -extent.sum(1), -extent.max(1))):
        choice = _lowest(horizon, profiles[index], cells)
        if choice is None:
            return None
        quarter, column, row, top = choice
        horizon[column : column + len(top)] = top
        place[index] = (np.array([column, row]) + margin) * cell
        turn[index] = quarter
    return place, turn, extent.astype(np.float64) * cell


_Profile = tuple[NDArray, NDArray]  # lowest and highest cell (exclusive) of each column


def _lowest(horizon: NDArray, profile: list[_Profile], cells: int) -> tuple[int, int, int, NDArray] | None:
    """Quarter turn, column and row where a chart's top is lowest, and the horizon above it."""
    best, lowest = None, cells + 1
    for quarter, (bottom, top) in enumerate(profile):
        column, row = _landing(horizon, bottom, lowest - int(top.max()))
        if column >= 0:
            lowest = row + int(top.max())
            best = quarter, column, row, row + top
    return best


@compiled
def _landing(horizon, bottom, below):  # type: ignore[no-untyped-def]
    """Column and row where a chart comes to lie lowest on the horizon, under row `below`; -1, -1 where it does not."""
    best, at = below, -1
    for column in range(len(horizon) - len(bottom) + 1):
        row = 0
        for j in range(len(bottom)):
            row = max(row, horizon[column + j] - bottom[j])
            if row >= best:
                break
        if row < best:
            best, at = row, column
    return at, (best if at >= 0 else -1)


def _profiles(outlines: _Outlines, scale: float, extent: NDArray, margin: int) -> list[list[_Profile]]:
    """For each chart and quarter turn, the cells it claims in each column, `margin` included. extent: (C, 2) cells."""
    start, end = outlines.start * scale, outlines.end * scale
    across = _columns(start, end, outlines.chart, extent[:, 0])
    along = _columns(start[:, ::-1], end[:, ::-1], outlines.chart, extent[:, 1])
    result = []
    for index, (width, height) in enumerate(extent):
        b0, t0 = _widened(across[index], margin, height)
        b1, t1 = _widened(along[index], margin, width)
        w, h = width + 2 * margin, height + 2 * margin
        # turned by 0, 90, 180, 270 degrees counter-clockwise: (x, y), (h - y, x), (w - x, h - y), (y, w - x)
        result.append([(b0, t0), (b1[::-1], t1[::-1]), (h - t0[::-1], h - b0[::-1]), (w - t1, w - b1)])
    return result


def _columns(start: NDArray, end: NDArray, chart: NDArray, widths: NDArray) -> list[_Profile]:
    """Lowest and highest cell that outlines touch in each column of each chart."""
    begin = np.cumsum(widths) - widths
    flip = (start[:, 0] > end[:, 0])[:, None]
    a, b = np.where(flip, end, start), np.where(flip, start, end)
    first = np.floor(a[:, 0]).astype(np.int64)
    last = np.minimum(np.floor(b[:, 0]).astype(np.int64), widths[chart] - 1)
    counts = last - first + 1
    segment = np.repeat(np.arange(len(a)), counts)
    column = np.arange(len(segment)) - np.repeat(np.cumsum(counts) - counts, counts) + first[segment]
    run = b[:, 0] - a[:, 0]
    slope = np.divide(b[:, 1] - a[:, 1], run, out=np.zeros(len(a)), where=run > 0)
    ends = []
    for x in (np.maximum(column, a[segment, 0]), np.minimum(column + 1, b[segment, 0])):
        ends.append(a[segment, 1] + (x - a[segment, 0]) * slope[segment])
    steep = run[segment] == 0
    lowest = np.where(steep, np.minimum(a[segment, 1], b[segment, 1]), np.minimum(*ends))
    highest = np.where(steep, np.maximum(a[segment, 1], b[segment, 1]), np.maximum(*ends))
    low, high = np.full(int(widths.sum()), np.iinfo(np.int64).max), np.zeros(int(widths.sum()), np.int64)
    at = begin[chart[segment]] + column
    np.minimum.at(low, at, np.floor(lowest).astype(np.int64))
    np.maximum.at(high, at, np.floor(highest).astype(np.int64) + 1)
    return [(low[s : s + n], high[s : s + n]) for s, n in zip(begin, widths, strict=True)]


def _widened(profile: _Profile, margin: int, height: int) -> _Profile:
    """A profile grown by `margin` cells on every side, counted from its new lowest corner."""
    return _grown(*profile, int(margin), int(height))


@compiled
def _grown(low, high, margin, height):  # type: ignore[no-untyped-def]
    count, reach = len(low), 2 * margin
    bottom, top = np.full(count + reach, height), np.zeros(count + reach, np.int64)
    for i in range(count + reach):
        for j in range(max(i - reach, 0), min(i + 1, count)):
            bottom[i] = min(bottom[i], max(low[j], 0))
            top[i] = max(top[i], min(high[j], height))
        top[i] += reach
    return bottom, top


def turned(points: NDArray, size: NDArray, quarter: NDArray) -> NDArray[np.float64]:
    """Points (F, 3, 2) turned counter-clockwise by quarter turns, the lowest corner back at the origin."""
    x, y = points[..., 0], points[..., 1]
    w, h = size[:, :1], size[:, 1:]
    turns = [(x, y), (h - y, x), (w - x, h - y), (y, w - x)]
    choices = quarter[:, None]
    return np.stack([np.choose(choices, [turn[k] for turn in turns]) for k in range(2)], -1)
