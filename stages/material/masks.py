"""Where a layer lies: by height and direction, on edges and in crevices, in spots, stripes and patches.

A mask is a field over the surface and a level: it covers what lies above the level. Fields that are distances (height, stripes,
spots) have borders as sharp as a texel; the others are roughened by noise at every scale, as wear does, so that no border is
a blur. """

from dataclasses import replace

import numpy as np

from stages.material.directions import WHOLE, Pieces, along
from stages.material.parts import found, is_detail, small_pieces
from stages.material.patterns import Spectrum, cells, edge, exceeds, fading, fbm, lost, marks, noise, spots, warped
from stages.material.place import Place
from stages.material.recipe import Layer, Mask, Recipe
from stages.material.surface import Array, Surface

SIDES = ("below", "above", "middle", "front", "back", "left", "right", "sides", "badge", "fade")
"""Kinds that cover a share of the extent, not of the surface."""

DISTANCES = (*SIDES, "along", "level", "pieces", "stripes", "bands", "zigzag", "spots", "dots", "flowers", "checks", "veins")
"""Kinds whose field is a distance from the border, object sizes."""

CENTRED = ("middle", "sides", "badge")
"""Those of them about the middle of what they lie on."""

FACING = 0.4
"""How far what bears a badge must face the front: the cosine."""

LEVEL, ROUNDED = 0.5, np.float32(0.1)
"""Least cosine to the vertical of what lies level, and the radius with which its rim is taken to turn down, object sizes."""

STEEP = 10.0
"""How much farther away what lies behind or faces aside counts."""

LEAST = {"edges": 0.08, "details": 0.08, "crevices": 0.08, "hidden": 0.06, "up": 0.25, "down": 0.25}
"""Least of their fields that counts as an edge, a crease, hidden from the sky, facing up or down: a sphere has none of the
first three, and a box's walls keep no snow."""

CHANCE = ("patches", "streaks", "chips")
"""Kinds whose field is noise of deviation 1."""


def coverage(masks: tuple[Mask, ...], surface: Surface, world: Place) -> Array:
    """Share of each point's footprint where all masks hold, (P,). Args: world: the same points in object sizes."""
    result = np.ones(len(surface), np.float32)
    for number, mask in enumerate(masks):
        if mask.kind != "all":
            own = _cover(mask, surface, _drawn(mask, world.seeded(101 + number)))
            result *= 1 - own if mask.invert else own
    return result


def _drawn(mask: Mask, at: Place) -> Place:
    """Where a mask's chance is drawn."""
    return at if mask.draw < 0 else replace(at, seed=mask.draw * 7919 + 101)


def _cover(mask: Mask, surface: Surface, at: Place) -> Array:
    level = 0.0 if mask.level is None else mask.level
    if mask.kind == "gingham":
        return _gingham(mask, at)
    if mask.kind == "scratches":
        return _scratches(mask, at)
    value = signal(mask, surface, at)
    if mask.kind in DISTANCES:
        rough = Spectrum(max(mask.size, 1e-3), max(mask.size / 64, 2e-4), 0.75)
        ragged = 0.12 * mask.wear * mask.size
        if mask.wear:
            value = value + ragged * fbm(at, rough, 5)
        if mask.kind == "fade":  # the border is as wide as the mask's size, and mottled
            mottled = 0.12 * mask.size * fbm(at, Spectrum(0.5 * mask.size, mask.size / 64, 0.7), 5)
            return edge(value + mottled - level, np.maximum(mask.size, at.footprint))
        soft = np.maximum(0.5 * at.footprint, 1.2 * ragged * lost(at, rough)) if mask.wear else 0.5 * at.footprint
        return edge(value - level, 2 * soft)
    if mask.kind in CHANCE:
        return exceeds(value, level, 0.06 + mask.soft, lost(at, _chance(mask)))
    rough = Spectrum(max(mask.size, 1e-3), max(mask.size / 64, 2e-4), 0.9, patch=0.4)
    amount: Array = np.full(len(at), 0.2 * mask.wear, np.float32)
    if mask.kind in LEAST:  # where there is neither edge nor crease, noise makes none
        amount = amount * np.clip(value / np.float32(max(level, LEAST[mask.kind])), 0.25, 1)
    worn = value + amount * fbm(at, rough, 5) if mask.wear else value
    return exceeds(worn, level, 0.004 + 0.016 * mask.wear + mask.soft, amount * lost(at, rough))


def _chance(mask: Mask) -> Spectrum:
    stretch = (0.16, 0.16, 2.5) if mask.kind == "streaks" else (1.0, 1.0, 1.0)
    rise = 0.55 + 0.35 * mask.wear
    return Spectrum(mask.size, max(mask.size / 128, 2e-4), rise, stretch, patch=0.4 * mask.wear)


def signal(mask: Mask, surface: Surface, at: Place) -> Array:
    """The field of a mask, (P,): larger where the layer lies."""
    x, y, z = at.p
    if mask.kind in CENTRED:
        return _centred(mask, surface, at)
    if mask.kind in SIDES:
        return {"below": -z, "above": z, "fade": z, "front": x, "back": -x, "left": y, "right": -y}[mask.kind]
    if mask.kind == "along":
        return surface.point @ np.array(mask.axis, np.float32)
    if mask.kind == "level":
        height = np.float32(mask.axis[2])
        return np.minimum(-abs(z - height), np.float32(mask.level or 0) + ROUNDED * (surface.normal[:, 2] - np.float32(LEVEL)))
    if mask.kind == "pieces":
        return np.isin(surface.piece, mask.pieces).astype(np.float32)
    if mask.kind in ("edges", "details", "crevices"):
        return surface.convexity if mask.kind != "crevices" else np.maximum(-surface.convexity, 0.8 * surface.occlusion - 0.2)
    if mask.kind in ("up", "down"):
        return surface.normal[:, 2] if mask.kind == "up" else -surface.normal[:, 2]
    if mask.kind == "hidden":
        return surface.occlusion
    if mask.kind in ("stripes", "bands"):
        phase = (z if mask.kind == "bands" else (x + y) * np.float32(0.7071)) / np.float32(mask.size)
        return np.float32(mask.size) * _middle(phase)
    if mask.kind == "checks":
        u, v = at.flat.p[:2] / np.float32(mask.size)
        away = np.minimum(abs(u - np.rint(u)), abs(v - np.rint(v))) * np.float32(mask.size)
        return np.where((np.floor(u) + np.floor(v)) % 2 == 0, away, -away).astype(np.float32)
    if mask.kind == "dots":
        return _dots(mask, at)
    if mask.kind == "flowers":
        return _flowers(mask, at)
    if mask.kind == "zigzag":
        u, v = at.flat.p[:2] / np.float32(mask.size)
        return np.float32(0.7071 * mask.size) * _middle(v + abs(u - np.rint(u)))
    if mask.kind == "spots":
        bent = warped(at, 0.05 * mask.size * (0.3 + mask.wear), 0.5 * mask.size, 3)
        return spots(bent, mask.size, (0.22 * mask.size, 0.42 * mask.size), 1.0, 4).inside
    if mask.kind == "veins":
        return _veins(mask, at)
    if mask.kind == "chips":
        strength = 0.8 * noise(at, 3 * mask.size, 9) + 1.4 * np.clip(surface.convexity, -0.3, 0.6)
        return fbm(at, _chance(mask), 7) + strength
    bent = warped(at, 0.3 * mask.size, mask.size, 3) if mask.kind == "patches" else at
    return fbm(bent, _chance(mask), 7)


def _centred(mask: Mask, surface: Surface, at: Place) -> Array:
    """How far inside of a level band about the middle, or of a squarish badge on the front, at most 0; or how far out to the
    sides. (P,) object sizes."""
    away = at.p - np.array(mask.axis or (0, 0, 0), np.float32)[:, None]
    if mask.kind == "middle":
        return -abs(away[2])
    if mask.kind == "sides":
        return abs(away[1])
    behind = np.float32(STEEP) * (np.maximum(-away[0], 0) + np.maximum(np.float32(FACING) - surface.normal[:, 0], 0))
    return -((away[1] ** 4 + away[2] ** 4) ** np.float32(0.25)) - behind


def _middle(phase: Array) -> Array:
    """0 at whole numbers … 0.5 half-way between them."""
    return np.float32(0.5) - abs(phase - np.floor(phase) - np.float32(0.5))


def _dots(mask: Mask, at: Place) -> Array:
    """Minus the distance to the nearest of equal dots in staggered rows, object sizes."""
    grid = at.flat.p[:2] / np.float32(mask.size)
    half = np.float32(0.5)
    near = (np.hypot(*(grid - np.rint(grid))), np.hypot(*(grid - half - np.rint(grid - half))))
    return -np.float32(mask.size) * np.minimum(*near)


PETALS, HEART = 5, 0.07
"""Of a flower: how many petals, and the radius of the hole in its middle, sizes of the mask."""


def _flowers(mask: Mask, at: Place) -> Array:
    """Distance inward from the border of the nearest flower, each turned by chance, in staggered rows; object sizes."""
    grid = at.flat.p[:2] / np.float32(mask.size)
    best = np.full(len(at), -np.inf, np.float32)
    for shift in (np.float32(0), np.float32(0.5)):
        cell = np.rint(grid - shift)
        across, up = grid - shift - cell
        turn = np.float32(2 * np.pi) * (np.sin(cell[0] * np.float32(12.9898) + cell[1] * np.float32(78.233)) * 437.585 % 1)
        away = np.hypot(across, up)
        petal = 0.23 + 0.08 * np.cos(PETALS * (np.arctan2(up, across) - turn))
        best = np.maximum(best, np.minimum(petal - away, away - HEART))
    return (np.float32(mask.size) * best).astype(np.float32)


def _gingham(mask: Mask, at: Place) -> Array:
    """Dyed threads one way and the other, each half of all: full where both cross, half where one runs over the undyed."""
    dyed = [
        edge(np.float32(mask.size) * (_middle(a / np.float32(mask.size)) - np.float32(0.25)), at.footprint)
        for a in at.flat.p[:2]
    ]
    return (dyed[0] + dyed[1]) * np.float32(0.5)


SCRATCHES = ((3.0, 0.014), (1.0, 0.008), (0.3, 0.004))
"""Length and width of the longest of three sorts of scratches, sizes of the mask; each has a third of its share."""


def _scratches(mask: Mask, at: Place) -> Array:
    """Share of the footprint under strokes that run any way, long and short, in crowds where the surface was handled most."""
    handled = np.clip(1 + 0.6 * noise(at, 2 * mask.size, 9), 0, 2)
    whole = np.ones(len(at), np.float32)
    for sort, (length, width) in enumerate(SCRATCHES):
        # a stroke covers 0.785 of length and width, and the longest ones are longer than the others
        count = mask.share / len(SCRATCHES) * length / width / (0.785 * 0.65)
        most = int(np.clip(np.ceil(2 * count), 1, 16))
        strokes = marks(at, length * mask.size, width * mask.size, most, 0.0, 2 * np.pi, 20 + sort, 0.7, 0.05)
        there = strokes.random(1) < np.float32(count / most) * handled
        seen = fading(width * mask.size, at.footprint)
        whole *= 1 - strokes.cover * (there * seen + (1 - seen) * np.float32(count / most) * handled)
    return 1 - whole


TURN = np.array([[0.8, 0.36, 0.48], [-0.6, 0.48, 0.64], [0.0, -0.8, 0.6]], np.float32)
"""A rotation, so that veins run aslant."""


def _veins(mask: Mask, at: Place) -> Array:
    """Minus the distance to the nearest vein, about, object sizes: long ones where stretched noise crosses zero, and branches
    from them along the borders of cells, which taper off."""
    size = mask.size
    bent = warped(at.moved(TURN @ at.p), 0.08 * size, 0.7 * size, 3, 5)
    # noise of deviation 1 and wavelength w rises by about 4 / w: |noise| w / 4 is the distance to where it is zero
    long = abs(noise(bent, 1.2 * size, 11, (4, 1, 4))) * np.float32(0.3 * size)
    vary = 1 + 0.5 * np.clip(noise(at, 0.5 * size, 12), -1.4, 2)  # thick and thin
    branch, twig = (cells(bent, share * size, seed).border for share, seed in ((0.9, 13), (0.35, 14)))
    near = np.minimum(long * vary, 1.8 * branch + 0.1 * long)
    return -np.minimum(near, 4 * twig + 0.5 * near + np.float32(0.003 * size)).astype(np.float32)


def _quantile(value: Array, weight: Array, share: float) -> float:
    """The least value that a share of all weight does not exceed. Args: (P,) each."""
    order = np.argsort(value, kind="stable")
    below = np.cumsum(weight[order], dtype=np.float64)
    return float(value[order[min(np.searchsorted(below, share * below[-1]), len(order) - 1)]])


def settled(recipe: Recipe, surface: Surface, pieces: Pieces = WHOLE) -> Recipe:
    """The recipe with each mask's level set so that it covers its share of what this surface shows: a vessel's inside, which
    the sky hardly sees, is not where all crevices are. Args: surface: evenly spread points."""
    uv, face = along(pieces, surface.piece, surface.point, surface.normal)
    shown = np.maximum(1 - surface.occlusion, 0.02)
    all_seen = np.full(len(surface), np.float32(1e-4))  # a level is that of the whole noise
    world = Place(np.ascontiguousarray(surface.point.T), uv, face, all_seen, seed=recipe.seed)

    def settle(mask: Mask, place: Place) -> Mask:
        if mask.kind in ("all", "gingham", "scratches") or mask.level is not None:
            return mask
        if mask.kind == "flowers":
            return replace(mask, level=0.0)
        if mask.kind == "dots":  # two in each square
            return replace(mask, level=-mask.size * float(np.sqrt(mask.share / (2 * np.pi))))
        if is_detail(mask):
            if part := small_pieces(mask, surface):
                return part
            mask = replace(mask, kind="edges") if mask.kind == "details" else mask
        if mask.kind in (*SIDES, "up") and mask.said and (part := found(mask, surface)):
            return part
        if mask.draw >= 0:
            mask = replace(mask, draw=31 * recipe.seed + mask.draw)
        if mask.kind in CENTRED:
            x, y, z = ((place.p.min(1) + place.p.max(1)) / 2).tolist()
            tall, wide = np.ptp(place.p[2]), np.ptp(place.p[1])
            if mask.kind == "sides":
                return replace(mask, axis=(x, y, z), level=0.5 * (1 - mask.share) * float(wide))
            reach = 0.5 * mask.share * float(tall if mask.kind == "middle" else min(tall, wide))
            return replace(mask, axis=(x, y, z), level=-reach)
        value = signal(mask, surface, _drawn(mask, place))
        if mask.kind in SIDES:  # a share of the extent, not of the area
            low, high = float(value.min()), float(value.max())
            return replace(mask, level=high - mask.share * (high - low))
        level = _quantile(value, shown, 1 - float(np.clip(mask.share, 0, 1)))
        return replace(mask, level=max(level, LEAST.get(mask.kind, level)))

    def layer(old: Layer, number: int) -> Layer:
        at = world.seeded(number)
        return replace(old, masks=tuple(settle(mask, at.seeded(101 + k)) for k, mask in enumerate(old.masks)))

    return replace(recipe, layers=tuple(layer(old, number) for number, old in enumerate(recipe.layers, 1)))
