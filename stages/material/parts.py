"""Where a named part lies on a mesh: legs, handle, blade, head, spout and buckles, by the shape of what is there.

A part is found as a mask of its own: pieces that hang together, what lies beyond a plane, or a height. Where the shape does not
show it, nothing is found, and the part lies where words alone put it. """

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, find_objects, label
from scipy.spatial import cKDTree

from stages.material.recipe import Mask
from stages.material.surface import Surface
from stages.material.tops import BACKS, TOPS, backrest, level_part

LEGS = ("leg", "legs", "foot", "feet")
HANDLES = ("handle", "handles", "grip", "hilt", "haft", "shaft", "wrapping", "wrap", "wraps", "binding")
HEADS = ("blade", "blades", "head")
SPOUTS = ("spout",)
GUARDS, POMMELS = ("guard", "crossguard", "cross-guard", "tsuba", "quillons", "bolster"), ("pommel",)
ENDS = ("end",)
WHEELS = ("wheel", "wheels", "rims", "hubcaps", "alloys", "tyre", "tyres", "tire", "tires", "castors", "casters")
SMALL = (
    "buckle", "buckles", "clasp", "clasps", "button", "buttons", "knob", "knobs", "rivet", "rivets", "stud", "studs", "screws",
    "bolts", "nails", "eyelets", "grommets", "eye", "eyes", "hinges", "fittings", "hardware", "latch", "lock", "padlock",
)  # fmt: skip
SHAPED = (*LEGS, *HANDLES, *HEADS, *SPOUTS, *GUARDS, *POMMELS, *ENDS, *WHEELS, *SMALL, *TOPS, "backrest")
"""Names of parts that are looked for in the shape of a thing."""

SAMPLED, NEAR = 3000, 160
"""Points whose thickness is measured, and neighbours among which the other side is looked for."""

LEAST_SHARE = 0.015
"""Share of the surface of the smallest piece that counts."""

WIDE = 0.25
"""Share of the floor plan that one leg may take at most."""

THIN = 0.05
"""Thickness of a thin piece, object sizes."""

FLOOR = 0.03
"""Height within which a piece stands on the floor."""

LONG = 2.2
"""Deviation along the longest direction, as a multiple of the next, of a thing that is long, such as a sword."""

ROUND, OUTSIDE = 0.12, 1.15
"""How far the outline of a round body strays from its radius, and how far out a handle or spout begins, as a multiple of it."""

BINS, SECTORS, CELL = 32, 36, 0.03


def found(mask: Mask, surface: Surface) -> Mask | None:
    """The mask of the part that a mask's word names, settled; None where the surface does not show it.

    Args: surface: evenly spread points, some thousands.
    """
    word = mask.said.split(" ")[-1]
    if len(surface) < BINS * SECTORS:
        return None
    if word in TOPS and mask.kind == "up":
        return level_part(mask, surface)
    if mask.said.endswith(BACKS) and mask.kind == "above":
        return backrest(mask, surface)
    if word in LEGS:
        return _thin_pieces(mask, surface) or _under(mask, surface)
    if word in WHEELS:
        return _wheels(mask, surface)
    if word in ENDS:
        return _at_end(mask, surface)
    if word in GUARDS + POMMELS:
        return _by_handle(mask, surface, word in GUARDS)
    if word in HANDLES + HEADS + SPOUTS:
        end = _end(surface) if word not in SPOUTS else None
        if end is None:
            return None if word in HEADS else _outside(mask, surface, word in SPOUTS)
        axis, level = end
        sign = -1.0 if word in HEADS else 1.0
        return _beyond(mask, sign * axis, sign * level)
    return None


def _beyond(mask: Mask, axis: NDArray, level: float) -> Mask:
    x, y, z = axis.tolist()
    return replace(mask, kind="along", axis=(x, y, z), level=float(level))


def thickness(surface: Surface) -> NDArray:
    """(P,) distance to the other side behind each point, object sizes; 1 where none is near."""
    distance, index = cKDTree(surface.point).query(surface.point, min(NEAR, len(surface)))
    toward = ((surface.point[index] - surface.point[:, None]) * -surface.normal[:, None]).sum(-1)
    other = (surface.normal[index] * surface.normal[:, None]).sum(-1) < -0.5
    behind = other & (toward > 0.6 * distance) & (distance > 0)
    return np.where(behind, distance, 1.0).min(1)


def _thin_pieces(mask: Mask, surface: Surface) -> Mask | None:
    """Pieces that are thin and stand on the floor, where nothing else does."""
    z, step = surface.point[:, 2], max(1, len(surface) // SAMPLED)
    some = surface[::step]
    thin = thickness(some)
    rows = [int(k) for k in np.unique(surface.piece) if k > 0]
    stands = [k for k in rows if z[surface.piece == k].min() < z.min() + FLOOR and (surface.piece == k).mean() > LEAST_SHARE]
    legs = [k for k in stands if np.median(thin[some.piece == k]) < THIN]
    share = np.isin(surface.piece, legs).mean()
    return replace(mask, kind="pieces", pieces=tuple(legs), level=0.5) if legs == stands and 0 < share < 0.6 else None


MOST_SMALL = 0.2
"""Share of the surface that small pieces may have between them; where there are more, the whole is made of them."""


def is_detail(mask: Mask) -> bool:
    """Whether a mask is looked for among small pieces: buckles, and parts of which no table knows where they are."""
    return mask.kind == "details" or mask.said.split(" ")[-1] in SMALL


def small_pieces(mask: Mask, surface: Surface) -> Mask | None:
    """Pieces too small to have directions of their own, beside those that do; None where there are none or nothing else."""
    share = float((surface.piece == 0).mean())
    return replace(mask, kind="pieces", pieces=(0,), level=0.5) if 0 < share < MOST_SMALL else None


ALIKE, FLAT = 0.12, 0.75
"""By how much a wheel's height and length differ at most, as a share, and how thick it is beside them."""


def _wheels(mask: Mask, surface: Surface) -> Mask | None:
    """Pieces that stand on the floor, as long as they are high and less thick than that, two or more."""
    floor = surface.point[:, 2].min() + FLOOR
    wheels = []
    for k in (int(row) for row in np.unique(surface.piece) if row > 0):
        points = surface.point[surface.piece == k]
        across, high = sorted(np.ptp(points[:, :2], 0)), float(np.ptp(points[:, 2]))
        middle = (points.max(0) + points.min(0)) / 2
        radius = np.linalg.norm(np.delete(points - middle, int(np.ptp(points[:, :2], 0).argmin()), 1), axis=1)
        round_ = radius.max() < 0.5 * (1 + ALIKE) * high  # the corners of a box are farther away
        if points[:, 2].min() < floor and abs(across[1] - high) < ALIKE * high and across[0] < FLAT * high and round_:
            wheels.append(k)
    return replace(mask, kind="pieces", pieces=tuple(wheels), level=0.5) if len(wheels) > 1 else None


def _under(mask: Mask, surface: Surface) -> Mask | None:
    """What is below the height at which what stands apart grows together."""
    z = surface.point[:, 2]
    low, high = float(z.min()), float(z.max())
    row = ((z - low) / max(high - low, 1e-9) * (BINS - 1e-3)).astype(int)
    cell = np.floor((surface.point[:, :2] - surface.point[:, :2].min(0)) / CELL).astype(int)
    apart = []
    for k in range(BINS):
        grid = np.zeros(cell.max(0) + 1, bool)
        grid[tuple(cell[row == k].T)] = True
        legs = find_objects(label(binary_dilation(grid, np.ones((3, 3))))[0])
        plan = max((np.prod([side.stop - side.start for side in leg]) for leg in legs), default=grid.size)
        apart.append(len(legs) >= 2 and plan < WIDE * grid.size)
    together = next((k for k in range(BINS - 1) if not (apart[k] or apart[k + 1])), BINS)
    if not all(apart[:2]) or not 2 <= together <= 0.95 * BINS:
        return None
    return replace(mask, kind="below", share=together / BINS, level=-(low + together / BINS * (high - low)))


def _end(surface: Surface) -> tuple[NDArray, float] | None:
    """Of a long thing the direction towards its handle, and where that begins: on one side of a guard or of a head, or where
    it is no longer flat."""
    centre = surface.point.mean(0)
    away = (surface.point - centre).astype(np.float64)
    spread, axes = np.linalg.eigh(away.T @ away / len(away))
    if spread[2] < LONG**2 * spread[1]:
        return None
    t, across, thin = (away @ axes[:, k] for k in (2, 1, 0))
    edges = np.linspace(t.min(), t.max(), BINS + 1)
    row = np.clip(np.searchsorted(edges, t, side="right") - 1, 0, BINS - 1)
    width = np.array([np.ptp(across[row == k]) if (row == k).sum() > 3 else 0.0 for k in range(BINS)])
    depth = np.array([np.ptp(thin[row == k]) if (row == k).sum() > 3 else 0.0 for k in range(BINS)])
    flat = depth / np.maximum(width, 1e-6)
    widest = int(width.argmax())
    if width[widest] > 1.8 * np.median(width):
        wide = np.flatnonzero(width > 0.5 * width[widest])
        first, last = int(wide.min()), int(wide.max()) + 1
        longer_after = BINS - last > first
        rest = flat[last:] if longer_after else flat[:first]
        after = longer_after != bool(len(rest) and np.median(rest) < 0.45)  # a flat rest is a blade
        cut = last if after else first
    else:
        gaps = [abs(np.median(flat[:k]) - np.median(flat[k:])) for k in range(4, BINS - 3)]
        cut = 4 + int(np.argmax(gaps))
        if max(gaps) < 0.25:
            return None
        after = bool(np.median(flat[cut:]) > np.median(flat[:cut]))
    if not 0 < cut < BINS:
        return None
    axis = axes[:, 2] if after else -axes[:, 2]
    return axis, (1 if after else -1) * float(edges[cut]) + float(centre @ axis)


GUARD, POMMEL, END = 0.04, 0.07, 0.25
"""Shares of a long thing's length: of its guard, which lies on the blade's side of the handle, its pommel, and one end."""


def _by_handle(mask: Mask, surface: Surface, guard: bool) -> Mask | None:
    """A guard with all that is beyond it, for the handle lies over that; or the last of a handle."""
    end = _end(surface)
    if end is None:
        return None
    axis, level = end
    along = surface.point @ axis
    length = float(np.ptp(along))
    return _beyond(mask, axis, level - GUARD * length if guard else float(along.max()) - POMMEL * length)


def _at_end(mask: Mask, surface: Surface) -> Mask:
    """The upper end along a thing's longest direction, or the one in front where it lies."""
    away = (surface.point - surface.point.mean(0)).astype(np.float64)
    axis = np.linalg.eigh(away.T @ away)[1][:, 2]
    axis = axis * np.sign(axis[np.argmax(abs(axis))])
    along = surface.point @ axis
    return _beyond(mask, axis, float(along.max()) - END * float(np.ptp(along)))


def _outside(mask: Mask, surface: Surface, spout: bool) -> Mask | None:
    """What stands out of a round body: of two, the handle is what one can reach behind."""
    point = surface.point[:, :2].astype(np.float64)
    centre = (point.min(0) + point.max(0)) / 2
    middle = (np.arange(SECTORS) + 0.5) * (2 * np.pi / SECTORS)
    outward = np.stack([np.cos(middle), np.sin(middle)], 1)
    for _ in range(12):
        away = point - centre
        sector = ((np.arctan2(away[:, 1], away[:, 0]) / (2 * np.pi)) % 1 * SECTORS).astype(int) % SECTORS
        reach = np.zeros(SECTORS)
        np.maximum.at(reach, sector, np.hypot(*away.T))
        radius = float(np.median(reach))
        even = reach < OUTSIDE * radius
        centre = centre + 2 * ((reach - radius)[:, None] * outward)[even].mean(0)
    if (abs(reach / radius - 1) < ROUND).mean() < 0.6 or even.all():
        return None
    groups, count = label(np.concatenate([~even, ~even]))
    runs = {tuple(sorted({int(k) % SECTORS for k in np.flatnonzero(groups == g)})) for g in range(1, count + 1)}
    whole = [r for r in runs if not any(set(r) < set(other) for other in runs) and len(r) < SECTORS / 3]
    if not whole or (spout and len(whole) < 2):
        return None

    def behind(run: tuple[int, ...]) -> tuple[NDArray, float, float]:
        direction = (outward[list(run)] * (reach[list(run)] - radius)[:, None]).sum(0)
        axis = np.array([*direction / np.linalg.norm(direction), 0.0])
        level = 1.04 * radius + float(centre @ axis[:2])
        beyond = surface.point @ axis > level
        return axis, level, float(((surface.normal[beyond] @ axis) < -0.7).mean()) if beyond.any() else 0.0

    options = sorted((behind(run) for run in whole), key=lambda found: found[2])
    axis, level, _ = options[0] if spout else options[-1]
    return _beyond(mask, axis, level)
