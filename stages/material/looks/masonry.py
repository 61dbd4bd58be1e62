"""Masonry: bricks, blocks, tiles, setts, slates and mosaics in bonds that follow walls and floors, with their joints."""

from typing import NamedTuple

import numpy as np

from stages.material.look import Look, each, mix, palette, shade, tint
from stages.material.patterns import Array, Spectrum, Tiles, fading, fbm, lost, masked, noise, spots, threshold, tiles, warped
from stages.material.place import Place


class Clay(NamedTuple):
    """fired: colours from overburnt to soft. burnt: share of bricks with a black face. worn: how ragged arrises are,
    metres. chips: share of bricks with a broken corner. mortar: colours. joint: its width, metres. bloom: share under white
    salts or old wash.
    """

    fired: tuple[str, ...]
    burnt: float
    worn: float
    chips: float
    mortar: tuple[str, ...]
    joint: float = 0.010
    bloom: float = 0.02


CLAYS = {
    "red": Clay(("#743426", "#93452f", "#a9543a", "#bd6a4b"), 0.18, 0.0011, 0.25, ("#989186", "#aea79b", "#bcb5a8")),
    "old": Clay(
        ("#5a2a22", "#84402f", "#9d5440", "#b57658", "#c29a78"),
        0.35,
        0.0035,
        0.7,
        ("#857a68", "#a0947e", "#b5aa94"),
        0.013,
        0.16,
    ),
    "yellow": Clay(("#a3804d", "#b8975f", "#c8a970", "#d3b988"), 0.1, 0.0013, 0.3, ("#a09a8e", "#b6b0a3", "#c4beb1")),
}


def bricks(at: Place, kind: Clay) -> Look:
    """Fired clay in running bond: every brick its own shade, creased sandy faces, broken arrises, mortar set back."""
    flat = at.flat
    bond = tiles(at, 0.225, 0.075, "running", 1)
    ragged = Spectrum(0.03, 0.0008, 0.75, patch=0.5)
    broken = (bond.random(6) < kind.chips) * np.exp(
        -np.hypot(bond.border, np.minimum(bond.width / 2 - abs(bond.x), 0.05)) / 0.02
    )
    inside = (
        bond.border
        - kind.joint / 2
        + kind.worn * fbm(flat, ragged, 2)
        - 0.012 * broken * np.clip(0.6 + noise(flat, 0.03, 12), 0, 2)
    )
    face = threshold(inside, 0.0, np.maximum(0.0006, 0.5 * at.footprint) + 2.2 * kind.worn * lost(flat, ragged))
    arris = face * np.exp(-np.maximum(inside, 0) / 0.003)
    crease = fbm(flat, Spectrum(0.03, 0.0008, 0.95, (2.2, 1, 1), tails=0.3, skew=-0.3, patch=0.5), 3)
    grit = fbm(flat, Spectrum(0.006, 0.0004, 1.05, tails=0.4, skew=-0.2, patch=0.5), 5)
    fired = 0.5 + 0.12 * noise(flat, 0.08, 4) + 0.04 * crease + 0.85 * (bond.random(1) - 0.5)
    coal = (bond.random(2) < kind.burnt) * np.clip(0.45 + 0.35 * fbm(flat, Spectrum(0.1, 0.003, 0.8), 13), 0, 1)
    pits = spots(flat, 0.014, (0.0006, 0.003), 0.5, 6).cover
    clay = shade(
        palette(fired, *kind.fired),
        0.11 * grit + 0.08 * crease - 0.6 * pits - 0.9 * coal + 0.15 * arris + 0.25 * (bond.random(3) - 0.5),
    )
    clay = tint(clay, 0.10 * (bond.random(4) - 0.5) - 0.3 * coal + 0.03 * crease)
    sand = fbm(flat, Spectrum(0.004, 0.0005, 1.2, tails=0.5, patch=0.3), 7)
    mortar = shade(palette(0.5 + 0.2 * noise(flat, 0.05, 8), *kind.mortar), 0.16 * sand)
    smear = masked(flat, Spectrum(0.16, 0.002, 0.85, patch=0.5), kind.bloom, 9, 0.6) * np.clip(0.5 + 0.4 * crease, 0, 1)
    color = mix(mortar, mix(clay, palette(0.5 + 0.2 * sand, "#b9b1a5", "#d6cfc4"), 0.7 * smear), face)
    height = (
        face * (0.0040 + 0.0012 * (bond.random(5) - 0.5) + 2e-4 * grit + 2.5e-4 * crease - 0.001 * pits - 0.0015 * arris)
        + (1 - face) * 2e-4 * sand
    )
    return Look(
        color,
        np.clip(0.88 + 0.05 * sand * (1 - face) - 0.08 * face + 0.04 * grit * face + 0.05 * smear, 0, 1),
        0.0,
        height - 0.003,
        face,
    )


def brick(at: Place) -> Look:
    """Red facing brick, as new."""
    return bricks(at, CLAYS["red"])


def old_brick(at: Place) -> Look:
    """Hand-made brick of an old house: uneven, chipped, sooty, with remains of wash."""
    return bricks(at, CLAYS["old"])


def yellow_brick(at: Place) -> Look:
    """London stocks: yellow clay, sooty here and there."""
    return bricks(at, CLAYS["yellow"])


def set_in(at: Place, bond: Tiles, joint: float, worn: float, seed: int) -> tuple[Array, Array]:
    """Distance from the joint into a unit, metres, and the share of the footprint inside: rims that wander by `worn`."""
    ragged = Spectrum(0.04, 0.001, 0.75, patch=0.5)
    inside = bond.border - joint / 2 + (worn * fbm(at.flat, ragged, seed) if worn else 0)
    face = threshold(inside, 0.0, np.maximum(0.0004, 0.5 * at.footprint) + 2.2 * worn * lost(at.flat, ragged))
    mean = (1 - joint / bond.width) * (1 - joint / bond.height)
    return inside, mean + (face - mean) * fading(min(bond.width, bond.height), at.footprint)


def own_grain(at: Place, bond: Tiles) -> Place:
    """The surface as each unit sees it: no grain runs on from one unit into the next."""
    return at.flat.moved(np.stack([0 * bond.x, 0 * bond.x, 3 + 9 * bond.random(99)]).astype(np.float32))


def concrete_block(at: Place) -> Look:
    """Pressed concrete blocks in running bond: open grey grain, tool-struck joints, damp stains."""
    bond = tiles(at, 0.40, 0.20, "running", 1)
    inside, face = set_in(at, bond, 0.010, 0.0007, 2)
    own = own_grain(at, bond)
    grain = fbm(own, Spectrum(0.012, 0.0006, 1.12, tails=0.4, skew=-0.25, patch=0.4), 3)
    hole = masked(own, Spectrum(0.008, 0.001, 0.9, patch=0.5), 0.07, 4, 0.15)
    damp = fbm(at.flat, Spectrum(0.8, 0.01, 0.75, (1, 1.8, 1), patch=0.4), 5)
    color = palette(0.5 + 0.1 * damp + 0.35 * (bond.random(1) - 0.5), "#85837e", "#9a9893", "#aeaba5")
    color = tint(shade(color, 0.15 * grain - 0.45 * hole + 0.05 * damp), 0.05 * (bond.random(2) - 0.5))
    joint = shade(palette(0.5 + 0.2 * damp, "#8f8d88", "#a3a09a"), 0.08 * grain - 0.12)
    color = mix(joint, color, face)
    height = (
        face * (0.004 - 0.001 * np.exp(-np.maximum(inside, 0) / 0.003) + 2.5e-4 * grain - 9e-4 * hole)
        + (1 - face) * 1e-4 * grain
    )
    return Look(color, np.clip(0.9 + 0.04 * grain + 0.05 * hole, 0, 1), 0.0, height - 0.0036)


def ashlar(at: Place) -> Look:
    """Squared sandstone in courses: a margin drafted smooth, the middle tooled with slanting strokes, thin lime joints."""
    bond = tiles(at, 0.55, 0.28, "random", 1)
    inside, face = set_in(at, bond, 0.007, 0.0012, 2)
    own = own_grain(at, bond)
    slant = np.float32(0.35) * bond.x
    lift = np.stack([0 * slant, (slant + 0.004 * noise(own, 0.05, 3)) * (1 - 0 * slant), 0 * slant]).astype(np.float32)
    stroke = (
        fbm(
            Place(own.p + lift, at.uv, at.face, at.footprint, seed=at.seed),
            Spectrum(0.014, 0.003, 0.7, (9, 1, 1), patch=0.5),
            4,
        )
        * face
    )
    margin = threshold(0.03 - inside, 0.0, 0.002)
    tooled = stroke * (1 - margin)
    grit = fbm(at.flat, Spectrum(0.012, 0.0006, 1.12, tails=0.4, skew=-0.2, patch=0.4), 5)
    vein = fbm(own, Spectrum(0.12, 0.004, 0.85, (4, 1, 1), patch=0.4), 6)
    soot = masked(at.flat, Spectrum(0.6, 0.006, 0.8, (1, 1.6, 1), patch=0.4), 0.2, 7, 0.8)
    color = palette(0.5 + 0.12 * vein + 0.7 * (bond.random(1) - 0.5), "#9a8565", "#b39d78", "#c7b38e", "#d3c4a4")
    color = tint(
        shade(color, 0.16 * grit + 0.10 * tooled - 0.45 * soot - 0.06 * margin), 0.08 * (bond.random(2) - 0.5) - 0.08 * soot
    )
    color = mix(shade(palette(0.5 + 0.1 * grit, "#b1a893", "#cac2ae"), 0.1 * grit), color, face)
    height = (
        face
        * (
            0.003
            + 0.0012 * tooled * (1 - margin)
            + 0.0008 * (1 - margin)
            + 2e-4 * grit
            - 0.001 * np.exp(-np.maximum(inside, 0) / 0.003)
        )
        - 0.0035
    )
    return Look(color, np.clip(0.84 + 0.05 * grit + 0.04 * soot, 0, 1), 0.0, height, 0.2 + 0.8 * face)


def setts(at: Place) -> Look:
    """Hewn granite setts in rows: each its own grey, its top domed and polished by wheels, sand and dirt between."""
    flat = at.flat
    bent = warped(flat, 0.0035, 0.12, 1, 3)
    bond = tiles(Place(bent.p, bent.p[:2], at.face, at.footprint, at.period, at.seed), 0.12, 0.10, "random", 2)
    own = own_grain(at, bond)
    corner = 0.02 - np.hypot(
        np.maximum(abs(bond.x) - bond.width / 2 + 0.026, 0), np.maximum(abs(bond.y) - bond.height / 2 + 0.026, 0)
    )
    inside = np.minimum(bond.border - 0.005, corner) - 0.004 * bond.random(6) + 0.0016 * fbm(flat, RAGGED, 3)
    top = threshold(inside, 0.0, np.maximum(0.001, 0.5 * at.footprint) + 0.0035 * lost(flat, RAGGED))
    dome = np.clip(np.maximum(inside, 0) / 0.045, 0, 1)
    hewn = fbm(own, Spectrum(0.05, 0.001, 0.8, tails=0.2, skew=-0.2, patch=0.5), 4)
    grit = fbm(flat, Spectrum(0.005, 0.0006, 1.05, tails=0.4, patch=0.4), 5)
    stone = palette(0.5 + 0.06 * hewn + 0.95 * (bond.random(1) - 0.5), "#4e4c4b", "#69655f", "#7d776f", "#8a7b6c", "#9a948b")
    stone = tint(
        shade(stone, 0.19 * grit + 0.08 * hewn - 0.6 * np.exp(-np.maximum(inside, 0) / 0.005)), 0.14 * (bond.random(2) - 0.5)
    )
    dirt = shade(palette(0.5 + 0.2 * grit, "#3a342b", "#4f473b", "#655b4c"), 0.15 * grit)
    height = top * (0.004 + 0.010 * np.sqrt(dome) + 0.0012 * hewn + 0.004 * (bond.random(3) - 0.5)) + 3e-4 * grit - 0.009
    return Look(mix(dirt, stone, top), np.clip(0.86 - 0.22 * dome * top + 0.05 * grit, 0, 1), 0.0, height, top)


RAGGED = Spectrum(0.05, 0.001, 0.75, patch=0.5)


def paving(at: Place) -> Look:
    """Slabs of riven sandstone, laid in rows of random lengths, grey and buff, a little algae in the joints."""
    bond = tiles(at, 0.60, 0.42, "random", 1)
    inside, face = set_in(at, bond, 0.010, 0.002, 2)
    own = own_grain(at, bond)
    riven = fbm(own, Spectrum(0.25, 0.002, 0.75, (1.4, 1, 1), patch=0.5), 3)
    grit = fbm(at.flat, Spectrum(0.014, 0.0006, 1.12, tails=0.4, skew=-0.15, patch=0.4), 4)
    green = np.exp(-np.maximum(inside, 0) / 0.03) * np.clip(0.3 + 0.4 * fbm(at.flat, Spectrum(0.3, 0.004, 0.85), 5), 0, 1)
    color = palette(0.5 + 0.10 * riven + 0.9 * (bond.random(1) - 0.5), "#7b7670", "#8d867b", "#a0937f", "#ad9f8b", "#94918b")
    color = mix(shade(color, 0.18 * grit + 0.06 * riven), palette(0.5 + 0.2 * grit, "#4b4c33", "#65653f"), 0.5 * green)
    color = tint(color, 0.10 * (bond.random(2) - 0.5))
    joint = shade(palette(0.5 + 0.2 * grit, "#4a443b", "#625b4f"), 0.12 * grit)
    height = face * (0.005 + 0.0013 * riven + 2e-4 * grit + 0.002 * (bond.random(3) - 0.5)) - 0.0048
    return Look(mix(joint, color, face), np.clip(0.82 + 0.05 * grit + 0.04 * green, 0, 1), 0.0, height, face)


class Glazed(NamedTuple):
    """width, height: of a tile, metres. bond: see `tiles`. joint: its width, metres. glaze: colours from tile to tile.
    grout: its colours. cushion: how far the rim falls away, metres.
    """

    width: float
    height: float
    bond: str
    joint: float
    glaze: tuple[str, ...]
    grout: tuple[str, ...] = ("#a8a39a", "#bdb9b0")
    cushion: float = 0.0006


GLAZED = {
    "square": Glazed(0.15, 0.15, "stack", 0.003, ("#e3e3e0", "#ebebe8", "#efeeea")),
    "metro": Glazed(0.20, 0.10, "running", 0.003, ("#e6e4dd", "#efeee9", "#f2f1ec"), ("#8d8a84", "#a19d96"), 0.0012),
    "mosaic": Glazed(
        0.025,
        0.025,
        "stack",
        0.0022,
        ("#1d2f5c", "#27427c", "#2f5597", "#4a74ae", "#243763", "#6f93bf"),
        ("#c9c6bf", "#dad7d0"),
        0.0003,
    ),
}


def glazed_tiles(at: Place, kind: Glazed) -> Look:
    """Pressed tiles under a glaze that pools in the middle and thins at the rim, a hair out of line, in cement grout."""
    bond = tiles(at, kind.width, kind.height, kind.bond, 1)
    inside, face = set_in(at, bond, kind.joint, 0.0, 2)
    shown = fading(kind.width, at.footprint)
    rim = np.exp(-np.maximum(inside, 0) / (0.025 * kind.width + 0.0008))
    own = own_grain(at, bond)
    pool = fbm(own, Spectrum(0.7 * kind.width, 0.003, 0.6, patch=0.3), 3)
    fleck = fbm(own, Spectrum(0.006, 0.0003, 1.12, tails=0.5, skew=-0.2, patch=0.5), 4)
    pin = spots(own, 0.05, (0.0002, 0.0008), 0.25, 5).cover
    sand = fbm(at.flat, Spectrum(0.004, 0.0004, 1.0, tails=0.4, patch=0.3), 6)
    dirt = masked(at.flat, Spectrum(0.3, 0.004, 0.8), 0.35, 7, 0.6)
    color = each(bond.random(1), shown, *kind.glaze)
    color = tint(shade(color, 0.02 * pool + 0.022 * fleck - 0.10 * rim - 0.5 * pin), 0.03 * (bond.random(2) - 0.5) * shown)
    grout = shade(palette(0.5 + 0.15 * sand, *kind.grout), 0.12 * sand - 0.3 * dirt)
    tilt = (bond.x * (bond.random(3) - 0.5) + bond.y * (bond.random(4) - 0.5)) * 0.008  # no tile lies quite level
    height = face * (0.0016 - kind.cushion * rim + tilt + 1.2e-5 * pool) + (1 - face) * 6e-5 * sand - 0.0014
    return Look(
        mix(grout, color, face), mix(0.85 + 0.05 * sand, 0.09 + 0.02 * rim + 0.01 * fleck + 0.2 * pin, face), 0.0, height, face
    )


def ceramic_tiles(at: Place) -> Look:
    """White bathroom tiles, square."""
    return glazed_tiles(at, GLAZED["square"])


def metro_tiles(at: Place) -> Look:
    """White tiles of the underground: oblong, half bond, cushioned rims, grey grout."""
    return glazed_tiles(at, GLAZED["metro"])


def pool_mosaic(at: Place) -> Look:
    """Small blue glass tiles of a swimming pool."""
    return glazed_tiles(at, GLAZED["mosaic"])


TESSERAE = (
    ("#cfc3a8", "#e2d9c3", "#ece6d6"),
    ("#7e3a2a", "#a3523a", "#b8694a"),
    ("#b88948", "#cfa35e", "#dcb878"),
    ("#34373b", "#4a5258", "#5d6c70"),
)
"""Pale, red, ochre and dark stones."""


def mosaic(at: Place) -> Look:
    """Roman mosaic: cut cubes of stone, no two alike, in fields of colour, lime between."""
    flat = at.flat
    bent = warped(flat, 0.003, 0.06, 1, 3)
    bond = tiles(Place(bent.p, bent.p[:2], at.face, at.footprint, at.period, at.seed), 0.013, 0.012, "random", 2)
    inside, face = set_in(at, bond, 0.0016, 0.0003, 3)
    shown = fading(0.012, at.footprint)
    inside = inside - 0.0008 * bond.random(7)
    field = 2.2 * noise(flat, 0.22, 4) + 0.25 * noise(flat, 0.07, 5)
    grit = fbm(flat, Spectrum(0.003, 0.0003, 1.0, tails=0.4, patch=0.4), 6)
    pale, red, ochre, dark = (each(bond.random(1), shown, *stones) for stones in TESSERAE)
    ring = 3 * (field / 3 - np.floor(field / 3))  # contours of the field: pale, red, ochre, between them a dark line
    thick, blur = 0.16, 0.04 + 4 * at.footprint
    color = mix(pale, red, threshold(ring, 1.5, blur))
    color = mix(color, ochre, threshold(ring, 2.2, blur))
    color = mix(color, dark, threshold(thick - abs(ring - 1.4), 0.0, blur) + threshold(thick - abs(ring - 2.9), 0.0, blur))
    color = tint(
        shade(color, 0.10 * grit + 0.25 * (bond.random(2) - 0.5) * shown - 0.15 * np.exp(-np.maximum(inside, 0) / 0.0008)),
        0.1 * (bond.random(3) - 0.5),
    )
    lime = shade(palette(0.5 + 0.2 * grit, "#8f8676", "#a89f8e"), 0.1 * grit)
    tilt = (bond.x * (bond.random(4) - 0.5) + bond.y * (bond.random(5) - 0.5)) * 0.06
    height = face * (0.0009 + tilt + 3e-5 * grit) - 0.0007
    return Look(mix(lime, color, face), np.clip(mix(0.85, 0.42 + 0.05 * grit, face), 0, 1), 0.0, height, face)


def terracotta_tiles(at: Place) -> Look:
    """Floor tiles of fired earth: orange to brown within each, darker towards the rim, waxed and walked on, sandy joints."""
    bond = tiles(at, 0.20, 0.20, "stack", 1)
    inside, face = set_in(at, bond, 0.007, 0.0007, 2)
    own = own_grain(at, bond)
    flash = fbm(own, Spectrum(0.16, 0.003, 0.65, patch=0.3), 3)
    grit = fbm(own, Spectrum(0.008, 0.0004, 1.15, tails=0.4, skew=-0.15, patch=0.5), 4)
    pit = spots(own, 0.02, (0.0004, 0.002), 0.5, 5).cover
    rim = np.exp(-np.maximum(inside, 0) / 0.02)
    color = palette(
        0.55 + 0.10 * flash - 0.18 * rim + 0.5 * (bond.random(1) - 0.5), "#7f4124", "#a2562f", "#ba6d3f", "#c98354", "#d69c6d"
    )
    color = tint(shade(color, 0.17 * grit - 0.5 * pit), 0.06 * (bond.random(2) - 0.5) + 0.03 * flash)
    joint = shade(palette(0.5 + 0.2 * grit, "#7a6f61", "#94897a"), 0.12 * grit)
    height = (
        face * (0.003 + 1.2e-4 * grit + 2e-4 * flash - 7e-4 * pit - 0.001 * np.exp(-np.maximum(inside, 0) / 0.003)) - 0.0027
    )
    return Look(
        mix(joint, color, face),
        np.clip(mix(0.9, 0.52 - 0.05 * flash + 0.04 * grit + 0.15 * pit, face), 0, 1),
        0.0,
        height,
        face,
    )


def roof_tiles(at: Place) -> Look:
    """Pantiles of red clay: rolls and troughs, each row lapping over the one below, weathered, with lichen."""
    flat = at.flat
    bond = tiles(at, 0.21, 0.32, "stack", 1)
    own = own_grain(at, bond)
    turn = bond.x / bond.width * 2 * np.pi
    roll = 0.5 + 0.5 * np.cos(turn) * (1 + 0.25 * np.cos(turn)) - 0.11
    down = 0.5 - bond.y / bond.height + 0.02 * noise(own, 0.1, 2)  # 0 beneath the row above … 1 at the tile's nose
    seen = fading(0.15, at.footprint)
    lap = mix(0.06, threshold(0.05 + 0.03 * (bond.random(5) - 0.5) - down, 0.0, 0.02), seen)
    seam = threshold(0.004 - abs(bond.width / 2 - abs(bond.x)), 0.0, np.maximum(0.002, at.footprint))
    grit = fbm(own, Spectrum(0.012, 0.0012, 1.0, tails=0.4, skew=-0.15, patch=0.5), 3)
    fire = fbm(own, Spectrum(0.25, 0.004, 0.75, patch=0.3), 4)
    lichen = masked(warped(flat, 0.006, 0.03, 5, 3), Spectrum(0.06, 0.002, 0.85, patch=0.6), 0.07, 6, 0.15)
    soot = masked(flat, Spectrum(0.5, 0.005, 0.8, (1, 1.6, 1), patch=0.4), 0.25, 7, 0.7)
    color = palette(0.5 + 0.10 * fire + 0.75 * (bond.random(1) - 0.5), "#813b25", "#a04d30", "#b5603d", "#c67850")
    color = shade(color, 0.10 * grit - 0.35 * soot - 0.75 * lap + 0.55 * (roll - 0.5) * seen - 0.4 * seam * seen)
    color = tint(mix(color, palette(0.5 + 0.3 * grit, "#8c8a6f", "#b3ae94"), 0.7 * lichen), 0.08 * (bond.random(2) - 0.5))
    height = 0.045 * roll + 0.016 * down + 3e-4 * grit - 0.004 * lap + 6e-4 * lichen - 0.026
    return Look(color, np.clip(0.82 + 0.05 * grit + 0.08 * lichen, 0, 1), 0.0, height, 1 - 0.7 * lichen)


def shingles(at: Place) -> Look:
    """Roofing slates in half bond: grey leaves with riven faces and ragged noses, each row lapping the one below."""
    bond = tiles(at, 0.25, 0.18, "running", 1)
    own = own_grain(at, bond)
    riven = fbm(own, Spectrum(0.08, 0.002, 0.85, (1, 1.6, 1), patch=0.5), 2)
    nose = bond.y + bond.height / 2 - 0.006 * bond.random(3) - 0.0025 * fbm(own, RAGGED, 3)  # metres above the nose
    under = threshold(-nose, 0.0, np.maximum(0.0008, 0.5 * at.footprint))
    above = bond.height - nose  # metres below the nose of the row above, which shades it
    shadow = np.exp(-np.maximum(above, 0) / 0.008)
    gap = threshold(0.002 + 0.0008 * riven - (bond.width / 2 - abs(bond.x)), 0.0, np.maximum(0.0008, 0.5 * at.footprint))
    deep = np.maximum(under, gap)
    lip = np.exp(-np.maximum(nose, 0) / 0.002) * (1 - deep)
    grit = fbm(own, Spectrum(0.006, 0.0008, 1.0, tails=0.4, patch=0.4), 4)
    lichen = masked(warped(at.flat, 0.004, 0.02, 5, 3), Spectrum(0.05, 0.0015, 0.85, patch=0.6), 0.03, 6, 0.12)
    color = palette(0.5 + 0.09 * riven + 0.9 * (bond.random(1) - 0.5), "#45484d", "#54595e", "#63686b", "#6c6a70", "#7b7d7c")
    color = shade(color, 0.08 * grit + 0.06 * riven + 0.3 * lip - 0.5 * shadow)
    color = mix(color, palette(0.5 + 0.3 * grit, "#9a9a80", "#bdbba2"), 0.7 * lichen * (1 - deep))
    color = tint(mix(color, palette(0.5 + 0.2 * grit, "#2a2a2b", "#343434"), 0.85 * deep), 0.06 * (bond.random(2) - 0.5))
    height = 0.007 * (0.5 - nose / bond.height) + 5e-4 * riven - 0.005 * deep + 4e-4 * lichen + 3e-5 * grit
    return Look(color, np.clip(0.6 + 0.05 * grit + 0.2 * deep + 0.15 * lichen, 0, 1), 0.0, height, 1 - deep)


LOOKS = {
    "brick": brick, "old_brick": old_brick, "yellow_brick": yellow_brick, "concrete_block": concrete_block,
    "ashlar": ashlar, "setts": setts, "paving": paving, "ceramic_tiles": ceramic_tiles, "metro_tiles": metro_tiles,
    "pool_mosaic": pool_mosaic, "mosaic": mosaic, "terracotta_tiles": terracotta_tiles, "roof_tiles": roof_tiles,
    "shingles": shingles,
}  # fmt: skip
METRES = {
    "brick": 1.8, "old_brick": 1.8, "yellow_brick": 1.8, "concrete_block": 1.6, "ashlar": 2.2, "setts": 1.2,
    "paving": 2.4, "ceramic_tiles": 0.9, "metro_tiles": 0.8, "pool_mosaic": 0.3, "mosaic": 0.4, "terracotta_tiles": 1.0,
    "roof_tiles": 1.68, "shingles": 1.5,
}  # fmt: skip
