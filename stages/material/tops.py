"""Where people sit and lean, and what they put things on: seat and back of a chair, the top of a table, by what lies level."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stages.material.recipe import Mask
from stages.material.surface import Surface

TOPS = ("seat", "seats", "cushion", "cushions", "pad", "tabletop", "desktop", "countertop", "worktop", "benchtop")
"""Names of parts that lie level."""

BACKS = ("backrest", "back rest", "seat back")
"""Names of what one leans on."""

FACING, FLAT, OPEN = 0.7, 0.9, 0.95
"""Least cosine to the vertical of what lies level, of a point and in the mean; most that the object may hide of its sky."""

CELL = 0.03
"""Edge of a cell of the floor plan, object sizes."""

DEEP, LOWEST = 0.14, 0.12
"""Of the object's height: how much a seat may dip or crown, and where the lowest one begins."""

LEAST_PLAN = 0.2
"""Share of the object's floor plan that a level part covers at least."""

NEARLY = 0.98
"""Share of the widest plan that counts as widest, too."""

OWN, THICK, RIM = 0.2, 0.45, 0.05
"""Of a piece that is a seat: its share of the level points; its height beside the object's; and how far under the level its
top may lie for a slat, which has no such share."""

WHOLE = 0.7
"""Share of the level points that such pieces hold at least; else the seat is a part of a larger piece."""

MOST = 0.8
"""Share of the surface that a seat has at most."""


TALL, LEAST_BACK = 0.85, 0.2
"""How far up a backrest reaches; how much of the height is above the seat at least, and how far below it the back may begin,
which stands behind it."""


def level_part(mask: Mask, surface: Surface) -> Mask | None:
    """The mask of what lies level and widest, settled: pieces of their own, or what faces up about one height; None where no
    level part is wide.

    Args: surface: evenly spread points, some thousands.
    """
    level = _level(surface)
    if level is None:
        return None
    z, height = surface.point[level, 2], float(np.ptp(surface.point[:, 2]))
    pieces = _pieces(surface, level, height)
    if pieces and np.isin(surface.piece, pieces).mean() < MOST:
        return replace(mask, kind="pieces", pieces=pieces, level=0.5)
    bottom, top = (float(v) for v in np.quantile(z, (0.01, 0.99)))
    half = 0.5 * (top - bottom) + 0.01 * height
    return replace(mask, kind="level", axis=(0.0, 0.0, 0.5 * (top + bottom)), level=-half)


def backrest(mask: Mask, surface: Surface) -> Mask | None:
    """The mask of what rises from a seat to the top, settled: pieces of their own, or all above the seat; None where nothing
    rises above what lies level. Args: as of `level_part`."""
    level = _level(surface)
    if level is None:
        return None
    z, seat = surface.point[:, 2], float(np.median(surface.point[level, 2]))
    low, height = float(z.min()), float(np.ptp(z))
    if seat > low + (1 - LEAST_BACK) * height:
        return None
    rows = [(int(k), z[surface.piece == k]) for k in np.unique(surface.piece)]
    backs = tuple(k for k, own in rows if own.max() > low + TALL * height and own.min() > seat - LEAST_BACK * height)
    if backs:
        return replace(mask, kind="pieces", pieces=backs, level=0.5)
    return replace(mask, kind="above", level=seat + RIM * height)


def _level(surface: Surface) -> NDArray[np.bool_] | None:
    """Which points lie level at the height at which most of the floor plan does; None where too little does."""
    z = surface.point[:, 2]
    low, height = float(z.min()), float(np.ptp(z))
    flat = (surface.normal[:, 2] > FACING) & (surface.occlusion < OPEN) & (z > low + LOWEST * height)
    if not flat.any():
        return None
    cell = np.unique(np.floor(surface.point[:, :2] / CELL).astype(np.int64), axis=0, return_inverse=True)[1].ravel()
    starts = low + height * np.arange(LOWEST, 1.0, 0.02)
    plans = [len(np.unique(cell[flat & (z >= start) & (z <= start + DEEP * height)])) for start in starts]
    start = starts[np.flatnonzero(np.array(plans) >= NEARLY * max(plans))[-1]]  # what lies under the seat is none of it
    level = flat & (z >= start) & (z <= start + DEEP * height)
    wide = max(plans) >= LEAST_PLAN * (cell.max() + 1)
    return level if wide and surface.normal[level, 2].mean() >= FLAT else None


def _pieces(surface: Surface, level: NDArray[np.bool_], height: float) -> tuple[int, ...]:
    """The pieces that a seat is made of; none where most of it belongs to what is more than a seat."""
    middle, z = float(np.median(surface.point[level, 2])), surface.point[:, 2]
    seats = []
    for k in (int(row) for row in np.unique(surface.piece[level])):
        own = surface.piece == k
        tall = float(np.ptp(z[own])) / height
        cushion = tall < THICK and (surface.piece[level] == k).mean() > OWN
        slat = tall < DEEP and z[own].max() > middle - RIM * height and (level & own).sum() > OWN * own.sum()
        if cushion or slat:
            seats.append(k)
    return tuple(seats) if np.isin(surface.piece[level], seats).mean() > WHOLE else ()
