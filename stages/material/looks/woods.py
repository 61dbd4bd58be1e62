"""Woods: growth rings about a pith, earlywood and latewood, pores along the grain, rays, knots; bark, cork, bamboo, panels;
boards of any of them. The grain is the second axis of p."""

import math
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from stages.material.look import Look, Substance, averaged, each, mix, palette, shade, tint
from stages.material.patterns import (
    Array,
    Spectrum,
    cells,
    cracks,
    edge,
    fading,
    fbm,
    line,
    lost,
    marks,
    masked,
    noise,
    pebbles,
    repeats,
    spots,
    threshold,
    tiles,
    warped,
)
from stages.material.place import Place


class Timber(NamedTuple):
    """colors: early- to latewood, sRGB. ring: mean width of a ring, metres. contrast: of the rings. pores: how dark they are.
    pore: their width, metres. figure: how far rings wander, metres. knots: share of places that hold one. rays: bright flecks
    across the rings. streak: of dark and light bands along the grain. roughness: mean."""

    colors: tuple[str, ...]
    ring: float = 0.004
    contrast: float = 0.6
    pores: float = 0.5
    pore: float = 0.0003
    figure: float = 0.007
    knots: float = 0.0
    rays: float = 0.0
    streak: float = 0.08
    roughness: float = 0.55


TIMBERS = {
    "oak": Timber(("#cba672", "#bb8f59", "#936639"), pores=0.9, pore=0.0004, rays=0.5),
    "walnut": Timber(("#7b583b", "#5c402b", "#38241a"), figure=0.011, streak=0.16, roughness=0.5),
    "pine": Timber(("#ebcd9b", "#dcb37a", "#b37a42"), 0.0065, 0.85, 0.08, knots=0.75),
    "cherry": Timber(
        ("#bd835a", "#a76a43", "#87502f"), 0.0045, 0.45, 0.25, 0.00018, 0.009, rays=0.2, streak=0.1, roughness=0.48
    ),
    "mahogany": Timber(("#8d452c", "#743320", "#522115"), 0.007, 0.3, 0.8, 0.00035, 0.012, streak=0.17, roughness=0.45),
    "maple": Timber(
        ("#ecd8b8", "#e0c6a0", "#c9a77c"), 0.0045, 0.4, 0.12, 0.00016, 0.010, rays=0.35, streak=0.06, roughness=0.5
    ),
    "birch": Timber(("#e6cfa8", "#d8bd90", "#c2a070"), 0.005, 0.3, 0.22, 0.0002, 0.012, knots=0.04, streak=0.07),
    "ebony": Timber(("#383230", "#2a2524", "#1d1a1a"), 0.004, 0.4, 0.3, 0.0002, 0.008, streak=0.22, roughness=0.35),
    "teak": Timber(("#b98a55", "#9c6e3f", "#704a28"), 0.005, 0.55, 0.7, 0.0003, 0.008, streak=0.14),
    "cedar": Timber(("#c98f66", "#b06f48", "#84492e"), 0.0035, 0.6, 0.08, knots=0.25, streak=0.12),
}  # fmt: skip


class Knots(NamedTuple):
    """inside: (P,) 1 within a knot. rim: (P,) 1 on its dark border. near: (P,) distance from its heart, metres. bend: (P,)
    how far the rings around it are pushed aside, metres."""

    inside: Array
    rim: Array
    near: Array
    bend: Array


def knots(at: Place, share: float) -> Knots:
    """Branches that the trunk grew around. share: of cells of 14 by 21 cm that hold one."""
    found = cells(warped(at, 0.002, 0.02, 21, 2), 0.14, 22, 0.9, (1, 1.5, 1))
    radius = (0.012 + 0.026 * found.random(1) ** 2) * (found.random(2) < share)
    outside = found.near - radius
    has = radius > 0
    push = np.where(has, 0.4 * radius * np.exp(-((found.near / np.maximum(1.6 * radius, 1e-4)) ** 2)), 0)
    push = push * threshold(found.border, 0.02, 0.02)  # nothing at the cell's border
    return Knots(edge(-outside, at.footprint) * has, np.exp(-((outside / 0.0012) ** 2)) * has, found.near, push)


def timber(at: Place, kind: Timber) -> Look:
    """Wood sawn along its second axis, in space: the sides show rings as they are cut."""
    x, y, z = at.p
    width = at.period[0]
    if width:  # rings bend back so that the square repeats
        x = np.float32(width / (2 * math.pi)) * np.sin(np.float32(2 * math.pi / width) * x)
    lazy = drawn_out(at, 0.15)
    knot = knots(at, kind.knots) if kind.knots else None
    wander = fbm(lazy, Spectrum(0.12, 0.015, 0.38, (1, 6, 1)), 1)
    deep = fbm(lazy, Spectrum(0.2, 0.05, 0.5, (1, 5, 1)), 2)
    radius = np.hypot(x + np.float32(0.04) + kind.figure * wander, z + np.float32(0.11) + kind.figure * deep)
    radius = radius + (knot.bend if knot else 0)
    years = radius / kind.ring + 0.8 * noise(at, 0.03, 3, (1, 8, 1)) + slant(at)
    ring = years - np.floor(years)
    seen = fading(kind.ring, at.footprint)
    season = 0.31 + (ring**2 * threshold(1 - ring, 0.06, 0.06) - 0.31) * seen  # slow into latewood, sharp back into spring
    fibre = fbm(at, Spectrum(0.003, 0.0002, 1.0, (1, 11, 1), tails=0.4, patch=0.4), 4)
    tone = fbm(at, Spectrum(0.15, 0.02, 0.7, (1, 5, 1)), 5)
    band = fbm(
        at.moved(np.stack([0.3 * (radius - x), 0 * y, 0 * y])), Spectrum(0.03, 0.002, 0.8, (1, 20, 1), tails=0.2, patch=0.4), 9
    )
    vessels = cells(at, kind.pore * 2.2, 6, 1.0, (1, 16, 1))
    pore = line(
        vessels.near, kind.pore * (0.4 + 0.5 * vessels.random(1)) * (1 - 0.6 * ring), np.minimum(at.footprint, kind.pore)
    )
    pore = pore * (vessels.random(2) < 0.35 + 0.4 * (ring < 0.35)) * fading(kind.pore * 2.2, at.footprint)
    color = palette(0.12 + kind.contrast * season + 0.7 * kind.streak * band + 0.07 * tone, *kind.colors)
    color = shade(color, 0.09 * fibre + 0.06 * tone + kind.streak * band - kind.pores * pore)
    rough = kind.roughness - 0.1 * season + 0.04 * fibre + 0.15 * pore
    if kind.rays:
        ray = cells(at, 0.0016, 7, 1.0, (0.8, 9, 1))
        fleck = np.exp(-((ray.near / 0.0006) ** 2)) * (ray.random(1) < 0.4) * fading(0.0012, at.footprint) * (0.6 + 0.4 * tone)
        color, rough = shade(color, 0.35 * kind.rays * (fleck - 0.09)), rough - 0.12 * kind.rays * fleck
    if knot:
        heart = 0.5 + 0.35 * np.cos(knot.near / 0.0022 + 1.5 * noise(at, 0.01, 8)) * fading(0.007, at.footprint) - 0.2 * fibre
        color = mix(color, palette(heart, "#5d3218", "#8a5229", "#b17a45"), 0.9 * knot.inside)
        color = shade(color, -0.9 * knot.rim - 12 * knot.bend)
    color = tint(color, 0.03 * noise(at, 0.05, 8, (1, 6, 1)) + 0.012 * band)
    return Look(color, rough, 0.0, 2e-5 * fibre - 1.2e-4 * pore - 4e-5 * season)


def drawn_out(at: Place, share: float) -> Place:
    """The place with its second axis, the grain, counting for a share of itself: what varies there does so slowly. Where it
    must repeat, it goes to and fro instead."""
    y, length = at.p[1], at.period[1]
    slow = np.float32(share) * y
    if length:
        slow = np.float32(share * length / (2 * math.pi)) * np.sin(np.float32(2 * math.pi / length) * y)
    moved = at.moved(np.stack([0 * y, slow - y, 0 * y]))
    return replace(moved, period=(at.period[0], 0.0, at.period[2]))


TAPER = 11.0, 22.0
"""Rings that a board crosses in a metre along the grain and across it, because trunks taper and saws do not follow them."""


def slant(at: Place) -> Array:
    """Years by which the rings are shifted, (P,): a whole number over a period, so that arches stay open and yet repeat."""
    x, y, _ = at.p
    across, along = at.period[0], at.period[1]
    slope = round(TAPER[0] * along) / along if along else TAPER[0]
    tilt = round(TAPER[1] * across) / across if across else 0.0
    return np.float32(slope) * y + np.float32(tilt) * x


def weathered(at: Place) -> Look:
    """Barn wood after decades: silver grey, spring wood washed out between raised latewood, checks along the grain."""
    bent = warped(at, 0.0006, 0.04, 31, 2)
    wood = timber(bent, Timber(("#a49e94", "#8f897f", "#6d675f"), 0.0048, 0.55, 0.5, 0.0004, 0.012, 0.3, 0, 0.16, 0.85))
    grown = cells(bent, 0.014, 32, 1.0, (1, 16, 1))
    gape = np.clip(0.2 + 0.6 * noise(at, 0.012, 35, (1, 14, 1)), 0, 1)
    shown = fading(0.007, at.footprint)
    check = 0.10 + (line(grown.border, 0.0009 * gape, at.footprint) - 0.10) * shown
    fibre = fbm(at, Spectrum(0.004, 0.0003, 1.0, (1, 30, 1), 0.5, -0.2, 0.5), 33)
    stain = fbm(at, Spectrum(0.2, 0.004, 0.8, (1, 3, 1), patch=0.5), 34)
    grey = np.array([[0.2126, 0.7152, 0.0722]], np.float32) @ wood.color * np.array([[1.03], [1.0], [0.95]], np.float32)
    color = tint(shade(mix(wood.color, grey, 0.75), 0.14 * fibre + 0.08 * stain), 0.03 * stain)
    color = mix(color, palette(0.5 + 0.2 * fibre, "#2b2723", "#3d3833"), 0.92 * check)
    groove = np.exp(-grown.border / 0.0012) * np.clip(2 * gape, 0, 1) * shown
    height = 6 * np.asarray(wood.height) + 9e-5 * fibre - 0.0016 * check - 1.5e-4 * groove + 3e-4 * stain
    return Look(shade(color, -0.12 * groove), np.clip(0.88 + 0.04 * fibre + 0.05 * check, 0, 1), 0.0, height)


def charred(at: Place) -> Look:
    """Timber after a fire: black, split into alligator scales across and along the grain, silver sheen, a little ash."""
    bent = warped(at, 0.0012, 0.03, 1, 4)
    block = pebbles(bent, 0.024, 0.0022, 0.22, 2, 0.45, (0.85, 1.45, 1))
    spectrum = Spectrum(0.004, 0.0003, 1.0, (1, 14, 1), 0.4, -0.2, 0.4)
    fibre = fbm(bent, spectrum, 3)
    split = cracks(bent, 0.013, 0.0008, 0.4, 4, 2, 0.06, (0.8, 1.4, 1)).cover
    own = (block.cells.random(1) - 0.5) * block.shown
    ash = masked(bent, Spectrum(0.05, 0.0006, 0.9, patch=0.6), 0.08, 5, 0.5)
    light = 0.42 + 0.12 * fibre + 0.5 * own + 0.35 * (block.dome - 0.6)
    color = averaged(
        light,
        np.hypot(0.24 * (1 - block.shown), 0.22 * lost(at, spectrum)),
        "#232222",
        "#2c2b2b",
        "#3a3939",
        "#57575a",
        "#6c6c70",
    )
    color = mix(shade(color, 0.14 * fibre), palette(0.5 + 0.2 * fibre, "#7c7974", "#a19d97"), 0.55 * ash)
    color = mix(color, palette(0 * fibre, "#201f1f"), np.maximum(0.92 * (1 - block.cover), 0.45 * split))
    height = 0.0035 * (block.dome - 0.6) + 0.0012 * own + 1.5e-4 * fibre - 0.0022 * (1 - block.cover) - 7e-4 * split
    rough = 0.55 - 0.1 * fibre - 0.25 * own + 0.3 * ash + 0.3 * (1 - block.cover)
    return Look(tint(color, 0.03 * noise(bent, 0.03, 6)), np.clip(rough, 0.1, 1), 0.0, height)


def varnished(at: Place) -> Look:
    """Red-brown wood under a thick gloss varnish: deep colour, pores filled, ripples of the brush."""
    wood = timber(
        at, TIMBERS["mahogany"]._replace(colors=("#a5561f", "#863f14", "#5a240b"), contrast=0.5, pores=0.4, roughness=0.3)
    )
    swell = fbm(at, Spectrum(0.012, 0.002, 0.7, (1, 3, 1)), 31)
    fine = fbm(at, Spectrum(0.0016, 0.0002, 1.0, tails=0.6, skew=0.25, patch=0.6), 32)
    rough = 0.10 + 0.12 * (np.asarray(wood.roughness) - 0.3) + 0.015 * swell + 0.015 * fine
    return Look(wood.color, np.clip(rough, 0.04, 1), 0.0, 0.12 * np.asarray(wood.height) + 1e-5 * swell)


SOLID: dict[str, Substance] = {
    **{name: partial(timber, kind=kind) for name, kind in TIMBERS.items()},
    "weathered wood": weathered, "charred wood": charred, "varnished wood": varnished,
}  # fmt: skip
"""What boards can be sawn of: functions of the position in space alone."""


def boards(at: Place, wood: Substance, width: float = 0.12, length: float = 1.2) -> Look:
    """Boards side by side, each cut elsewhere, a dark joint between them."""
    bond = tiles(at.swapped(), length, width, "random", 11)
    shift = np.stack([bond.random(1) * 0.3 - 0.15, bond.random(2) * 3, bond.random(3) * 0.2]).astype(np.float32)
    own = np.stack([bond.y, bond.x, 0 * bond.x]) + shift
    look = wood(Place(own, at.uv, at.face, at.footprint, seed=at.seed))
    worn = bond.border + 0.0003 * noise(at.flat, 0.01, 12)
    gap = 1 - threshold(worn, 0.001, np.maximum(0.0005, 0.5 * at.footprint))
    color = shade(look.color, 0.38 * (bond.random(4) - 0.5)) * (1 - 0.8 * gap)
    color = tint(color, 0.12 * (bond.random(5) - 0.5))
    height = look.height - 0.0015 * gap - 0.0004 * threshold(0.004 - bond.border, 0.0, 0.004)
    return Look(color, np.clip(look.roughness + 0.2 * gap, 0, 1), 0.0, height)


def bamboo(at: Place) -> Look:
    """Poles side by side: smooth yellow-green culms, pale bloom under each node, a ridge and a scar where a sheath sat."""
    side, pole, width = repeats(at, 0.052, 0)
    plain = np.zeros(len(at), np.float32)
    lane = cells(
        Place(
            np.stack([(pole + 0.5) * np.float32(width), plain, plain]),
            at.uv,
            at.face,
            at.footprint,
            (at.period[0], 0, 0),
            at.seed,
        ),
        width,
        1,
        0.0,
    )
    shifted = Place(at.p, at.uv + np.stack([plain, 0.28 * lane.random(1)]), at.face, at.footprint, at.period)
    node, _, length = repeats(shifted, 0.28, 1)
    away = (1 - abs(node)) * np.float32(length / 2)  # from the nearest node
    above = np.where(node < 0, away, 1)
    below = np.where(node > 0, away, 1)
    flat = at.flat
    fibre = fbm(flat, Spectrum(0.0022, 0.0002, 1.0, (1, 40, 1), 0.4, -0.15, 0.4), 3)
    stain = fbm(flat, Spectrum(0.06, 0.002, 0.85, (0.6, 2.2, 1), 0.3, -0.15, 0.6), 4)
    speck = spots(warped(flat, 0.0006, 0.004, 5), 0.009, (0.0003, 0.0016), 0.35, 6).cover
    dome = np.sqrt(np.clip(1 - side * side, 0, 1))
    shown = fading(width / 2, at.footprint)
    own = lane.random(2) - 0.5
    color = palette(0.5 + 0.5 * own + 0.10 * stain + 0.06 * fibre, "#a58a45", "#bfa45c", "#cfb872", "#b5ad68", "#dcc98e")
    color = mix(color, palette(0.5 + 0.1 * fibre, "#d9d2b4"), 0.35 * np.exp(-below / 0.010))
    color = mix(
        color,
        palette(0.5 + 0.2 * fibre, "#5a4220", "#7c6234"),
        0.75 * np.exp(-(((above - 0.0015) / 0.0014) ** 2)) + 0.35 * np.exp(-above / 0.007),
    )
    color = shade(
        color,
        0.06 * fibre + 0.05 * stain - 0.5 * speck - 0.75 * ((1 - dome) ** 2 - 0.1) * shown - 1.2 * (abs(side) > 0.97) * shown,
    )
    ridge = 0.0016 * np.exp(-((away / 0.004) ** 2)) - 0.0012 * np.exp(-(((above - 0.0015) / 0.0012) ** 2))
    height = (0.011 * (dome - 0.785)) * shown + ridge + 1e-5 * fibre
    return Look(
        tint(color, 0.05 * stain, 0.12 * own), np.clip(0.36 + 0.04 * fibre + 0.04 * stain + 0.2 * speck, 0, 1), 0.0, height
    )


def bark(at: Place) -> Look:
    """An old trunk: long ridges that part and join round deep furrows, split across into plates, flaking, with lichen."""
    bent = warped(at, 0.0032, 0.05, 1, 4)
    ridge = cells(bent, 0.03, 2, 0.9, (1, 4.5, 1))
    shown = fading(0.03, at.footprint)
    layer = fbm(bent, Spectrum(0.016, 0.0008, 0.95, (1, 4.5, 1), 0.3, -0.15, 0.4), 3)
    grit = fbm(at, Spectrum(0.004, 0.0003, 1.05, (1, 2.5, 1), 0.5, -0.2, 0.5), 4)
    away = ridge.border + 0.0016 * layer
    back = np.clip(away / 0.0095, 0, 1) ** 0.7
    back = 0.58 + (back - 0.58) * shown
    plate = cracks(bent, 0.03, 0.0020, 0.22, 5, 2, 0.08, (1.6, 0.9, 1))
    step = (pebbles(bent, 0.011, 0.0, 0.1, 6, 1.0, (1, 2, 1)).cells.random(1) - 0.5) * fading(0.011, at.footprint)
    own = (ridge.random(1) - 0.5) * shown
    lichen = masked(at, Spectrum(0.06, 0.001, 0.9, patch=0.5), 0.07, 7, 0.25) * np.clip(back + 0.2, 0, 1)
    color = palette(
        0.10 + 0.66 * back + 0.10 * layer + 0.10 * step + 0.14 * own, "#2a1d15", "#46352a", "#6b5949", "#8b7b6b", "#a3968a"
    )
    color = shade(color, 0.16 * grit + 0.10 * step - 0.9 * plate.cover * back)
    color = mix(color, palette(0.5 + 0.2 * grit, "#7f8a6c", "#a8ae92", "#c5c8b4"), 0.7 * lichen)
    height = 0.013 * (back - 0.52) + 0.0012 * layer + 0.0009 * step - 0.002 * plate.cover * back + 3e-4 * grit + 4e-4 * lichen
    return Look(
        tint(color, 0.08 * (0.5 - back) + 0.05 * noise(at, 0.04, 8)),
        np.clip(0.9 + 0.03 * grit - 0.05 * back, 0, 1),
        0.0,
        height,
    )


def cork(at: Place) -> Look:
    """Pressed cork: granules of several sizes, each of its own brown, dark skins and crumbs between."""
    grit = fbm(at, Spectrum(0.0016, 0.0002, 1.0, tails=0.5, skew=-0.2, patch=0.4), 1)
    color, height = palette(0.5 + 0.15 * grit, "#7d5733", "#94693f", "#a97c4e"), 2e-5 * grit
    for k, (size, share) in enumerate(((0.0012, 0.9), (0.0023, 0.75), (0.0042, 0.5))):
        grain = pebbles(warped(at, 0.09 * size, 0.6 * size, 2 + k, 3), size, 0.04 * size, 0.15, 5 + k, 1.0)
        here = grain.cover * ((grain.cells.random(1) < share) * grain.shown + share * (1 - grain.shown))
        tone = each(
            grain.cells.random(2), grain.shown, "#a87848", "#c29562", "#b5854f", "#d0a674", "#9c6c3f", "#c79b68", "#8a5c35"
        )
        lean = (
            grain.cells.offset[0] * (grain.cells.random(3) - 0.5) + grain.cells.offset[1] * (grain.cells.random(4) - 0.5)
        ) / size
        color = mix(color, shade(tone, 0.5 * (np.minimum(grain.dome, 0.6) - 0.55) + 0.5 * lean * grain.shown), here)
        height = mix(height, 0.03 * size * (grain.dome - 0.6) + 0.03 * size * lean, here)
    hole = spots(warped(at, 0.0007, 0.003, 9), 0.009, (0.0004, 0.0017), 0.5, 10).cover
    color = shade(color, 0.09 * grit - 1.0 * hole)
    return Look(
        tint(color, 0.04 * noise(at, 0.01, 11)), np.clip(0.85 + 0.04 * grit + 0.08 * hole, 0, 1), 0.0, height - 3e-4 * hole
    )


def panel(at: Place, length: float, width: float, layers: int, *stops: str) -> Look:
    """Flakes of wood pressed with glue, each with its own grain and shade, edges that stand up, dark gaps."""
    flat = at.flat
    grit = fbm(flat, Spectrum(0.004, 0.0004, 1.0, tails=0.5, skew=-0.2, patch=0.4), 1)
    color, height = palette(0.3 + 0.15 * grit, *stops), -2e-4 + 3e-5 * grit
    bent = warped(flat, 0.025 * width, 0.7 * width, 2, 3)
    ragged = Place(bent.p, bent.p[:2], at.face, at.footprint, at.period, at.seed)
    whole = fading(1.5 * width, at.footprint)
    for k in range(layers):
        flake = marks(ragged, length, width, 6, 0.5 + 1.3 * k, 6.28, 3 + k, 0.6, 0.0)
        side = np.where(abs(flake.across) < 2, flake.across, 0)
        here = (abs(flake.across) < 2) * edge((1.02 - flake.along**8 - abs(side)) * 0.5 * width, at.footprint) * whole + 0.6 * (
            1 - whole
        )
        grain = (
            np.sin(9 * side + 5 * flake.random(2) + 0.8 * grit) + np.sin(23 * side + 9 * flake.random(3) + 3 * flake.along)
        ) * fading(0.15 * width, at.footprint)
        tone = shade(each(flake.random(1), whole, *stops), 0.09 * grain + 0.08 * grit)
        shadow = np.exp(-np.clip(1 - abs(side), 0, 1) / 0.2) * whole * flake.random(6)  # some lie flat, some lift at a side
        color = mix(color, tint(shade(tone, -0.2 * shadow), 0.12 * (flake.random(4) - 0.5)), here)
        height = mix(height, 5e-5 * k + 8e-5 * side * (flake.random(5) - 0.5) + 6e-6 * grain + 8e-6 * grit, here)
    return Look(color, np.clip(0.62 + 0.05 * grit, 0, 1), 0.0, height)


def osb(at: Place) -> Look:
    """Oriented strand board: large flakes every way."""
    return panel(at, 0.13, 0.026, 4, "#9b7444", "#b98f57", "#cfa76d", "#dbb985", "#c49a5e", "#e2c795")


def chipboard(at: Place) -> Look:
    """Particle board: small chips and dust."""
    return panel(at, 0.012, 0.0026, 4, "#a1804f", "#bd9a68", "#cfb083", "#d9bf96", "#b08c58", "#8f6c40")


def plywood(at: Place) -> Look:
    """A birch veneer peeled round the log: wide wild figure, boat-shaped patches, fine lathe checks."""
    wide = timber(at, TIMBERS["birch"]._replace(ring=0.02, contrast=0.55, figure=0.05, pores=0.3))
    check = cracks(at, 0.010, 0.0004, 0.12, 31, 2, 0.05, (1, 20, 1)).cover
    patch = marks(at, 0.10, 0.028, 1, math.pi / 2, 0.1, 32, 0.1)
    here = (patch.random(1) < 0.16) * (abs(patch.across) < 2)
    other = timber(at.seeded(5), TIMBERS["birch"]._replace(ring=0.012))
    rim = (np.sqrt(np.clip(1 - patch.along**2, 0, 1)) - abs(patch.across)) * np.float32(0.014)
    seam = here * line(rim, 0.0006, at.footprint)
    color = mix(shade(wide.color, -0.3 * check), other.color, here * patch.cover)
    return Look(
        shade(color, -0.7 * seam),
        np.asarray(wide.roughness) + 0.1 * check,
        0.0,
        np.asarray(wide.height) - 6e-5 * check - 5e-5 * seam,
    )


LOOKS: dict[str, Substance] = {
    **SOLID, **{f"{name} boards": partial(boards, wood=wood) for name, wood in SOLID.items()},
    "bamboo": bamboo, "bark": bark, "cork": cork, "osb": osb, "chipboard": chipboard, "plywood": plywood,
}  # fmt: skip
METRES = {
    **dict.fromkeys(SOLID, 0.45), **{f"{name} boards": 0.96 for name in SOLID},
    "weathered wood": 0.4, "charred wood": 0.3, "bamboo": 0.42,
    "bark": 0.4, "cork": 0.08, "osb": 0.4, "chipboard": 0.06, "plywood": 0.6,
}  # fmt: skip
