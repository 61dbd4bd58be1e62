"""Grounds: sand, soil, mud, what grows and falls on them, snow, ice, salt and what fire leaves."""

import numpy as np

from stages.material.look import Look, averaged, each, mix, palette, shade, tint
from stages.material.patterns import (
    STONES,
    Array,
    Spectrum,
    blades,
    cells,
    cracks,
    edge,
    fading,
    fbm,
    heap,
    marks,
    masked,
    noise,
    pebbles,
    ripples,
    spots,
    threshold,
    warped,
)
from stages.material.place import Place


def grains(at: Place, size: float, seed: int, *stops: str) -> tuple[Array, Array]:
    """Grains of sand, each its own colour. Returns: colours (3, P), height of their round backs 0 … 1 (P,)."""
    grain = cells(at, size, seed)
    shown = fading(size, at.footprint)
    back = np.clip(grain.border / (0.3 * size), 0, 1)
    color = each(grain.random(1), shown, *stops)
    return shade(color, (0.35 * (back - 0.6) + 0.3 * (grain.random(2) - 0.5)) * shown), back * shown


QUARTZ = ("#8a6f4f", "#b39570", "#c9ad86", "#d9c3a0", "#cbb08c", "#e3d5bb", "#a3835e", "#6f5c48", "#d3b792")


def sand(at: Place) -> Look:
    """Dune sand, blown into ripples that wander and fork; coarse dark grains gather in the troughs."""
    flat = at.flat
    bent = flat.moved(
        np.stack([0 * at.uv[0], 0.022 * fbm(flat, Spectrum(0.35, 0.06, 0.6), 1), 0 * at.uv[0]]).astype(np.float32)
    )
    wave = ripples(bent, 0.075, 0.45, 2)
    color, back = grains(at, 0.0012, 3, *QUARTZ)
    drift = fbm(flat, Spectrum(0.4, 0.01, 0.8, patch=0.4), 4)
    grit = fbm(at, Spectrum(0.008, 0.0006, 1.1, tails=0.5, skew=-0.15, patch=0.4), 5)
    heavy = threshold(-wave.crest + 0.3 * grit, 0.75, 0.5) * wave.shown
    color = shade(color, 0.12 * grit + 0.06 * drift + 0.17 * wave.crest - 0.2 * heavy)
    height = 0.0045 * wave.crest + 8e-4 * drift + 1.2e-4 * grit + 1e-4 * back
    return Look(tint(color, 0.05 * noise(flat, 0.1, 6) - 0.08 * heavy), np.clip(0.92 + 0.03 * grit, 0, 1), 0.0, height)


def fine_sand(at: Place) -> Look:
    """Beach sand close by: quartz, feldspar and dark minerals, splinters of shell, small hollows."""
    color, back = grains(at, 0.0011, 1, *QUARTZ)
    lump = fbm(at, Spectrum(0.05, 0.001, 0.85, tails=0.2, patch=0.4), 2)
    grit = fbm(at, Spectrum(0.004, 0.0004, 1.05, tails=0.4, skew=-0.2, patch=0.4), 3)
    splinter = marks(at, 0.006, 0.0022, 1, 0.0, 2 * np.pi, 4, 0.7)
    shell = splinter.cover * (splinter.random(1) < 0.18)
    stone = spots(warped(at, 0.0003, 0.002, 5), 0.012, (0.0006, 0.0024), 0.4, 6)
    color = shade(color, 0.10 * grit + 0.08 * lump)
    color = mix(color, each(stone.cells.random(7), 1.0, "#5d5248", "#8e7c68", "#b6a289", "#77665a"), 0.9 * stone.cover)
    color = mix(color, palette(splinter.random(2), "#d9c9b0", "#f0e7d8", "#dcb9a0"), 0.9 * shell)
    height = 9e-4 * lump + 1.5e-4 * back + 5e-5 * grit + 4e-4 * stone.cover + 3e-4 * shell
    return Look(tint(color, 0.05 * noise(at, 0.03, 8)), np.clip(0.9 + 0.04 * grit - 0.2 * shell, 0, 1), 0.0, height)


def soil(at: Place) -> Look:
    """Dark earth: crumbs of all sizes, roots and straws, small stones, damp in the hollows."""
    flat = at.flat
    lump = fbm(at, Spectrum(0.10, 0.002, 0.85, tails=0.2, patch=0.5), 1)
    grit = fbm(at, Spectrum(0.004, 0.0004, 1.1, tails=0.5, skew=-0.15, patch=0.5), 2)
    color, height = palette(0.42 + 0.14 * lump, "#34281d", "#433326", "#534130", "#624f3c"), 4e-3 * lump + 2e-4 * grit
    for k, (size, share) in enumerate(((0.005, 0.7), (0.012, 0.5), (0.026, 0.3))):
        crumb = pebbles(warped(at, 0.07 * size, 0.5 * size, 3 + k, 3), size, 0.1 * size, 0.75, 6 + k, 1.0)
        here = crumb.cover * ((crumb.cells.random(1) < share) * crumb.shown + share * (1 - crumb.shown))
        tone = each(crumb.cells.random(2), crumb.shown, "#3d2f23", "#4a3929", "#574332", "#46362a", "#634f3c")
        color = mix(color, shade(tone, 0.6 * (np.minimum(crumb.dome, 0.8) - 0.6)), here)
        height = mix(height, 0.3 * height + 0.3 * size * crumb.dome, here)
    stone = spots(warped(at, 0.0012, 0.008, 9), 0.034, (0.0015, 0.008), 0.7, 10)
    color = mix(color, each(stone.cells.random(3), 1.0, "#7d7367", "#968a7a", "#6a6157"), 0.85 * stone.cover)
    root = marks(at, 0.09, 0.0011, 2, 0.0, 2 * np.pi, 11, 0.7, 0.6)
    grown = root.cover * (root.random(2) < 0.35)
    color = mix(color, palette(root.random(1), "#5c4630", "#84694a", "#a48a60"), 0.7 * grown)
    color = tint(shade(color, 0.16 * grit + 0.08 * lump), 0.06 * noise(flat, 0.05, 12))
    height = height + 1.5e-3 * stone.cover + 5e-4 * grown - 2e-3
    return Look(color, np.clip(0.92 + 0.04 * grit - 0.1 * stone.cover + 0.02 * lump, 0, 1), 0.0, height)


def cracked_mud(at: Place) -> Look:
    """A dried lake: plates that shrank apart, curl up at their rims and split again, pale on top, dark between."""
    bent = warped(at, 0.006, 0.07, 1, 5)
    plate = cells(bent, 0.11, 2)
    shown = fading(0.11, at.footprint)
    grit = fbm(at, Spectrum(0.005, 0.0006, 1.05, tails=0.4, skew=-0.2, patch=0.4), 3)
    wide = 0.0018 + 0.0022 * plate.random(1) + 0.0008 * fbm(at, Spectrum(0.03, 0.001, 0.8), 4)
    top = threshold(plate.border - wide, 0.0, np.maximum(0.0008, 0.5 * at.footprint))
    split = cracks(bent, 0.05, 0.0016, 0.4, 5, 2, 0.05)
    rim = np.exp(-np.maximum(plate.border - wide, 0) / 0.010) * shown
    film = fbm(bent, Spectrum(0.10, 0.002, 0.8, patch=0.5), 6)
    flake = masked(bent, Spectrum(0.03, 0.0008, 0.8, patch=0.5), 0.14, 7, 0.08)
    pock = spots(at, 0.012, (0.0004, 0.0016), 0.6, 8).cover
    color = palette(
        0.5 + 0.11 * film + 0.35 * (plate.random(2) - 0.5) * shown + 0.16 * rim, "#8b7660", "#a28c73", "#b6a188", "#c9b79f"
    )
    color = tint(shade(color, 0.08 * grit - 0.10 * flake - 0.3 * pock), 0.06 * (plate.random(3) - 0.5) * shown)
    deep = palette(0.5 + 0.2 * grit, "#37291e", "#4a392b")
    color = mix(mix(color, deep, 0.85 * split.cover), deep, 1 - top)
    tilt = (plate.offset[0] * (plate.random(4) - 0.5) + plate.offset[1] * (plate.random(5) - 0.5)) * 0.05
    height = top * (0.008 + 0.004 * rim + tilt + 1.5e-4 * grit - 4e-4 * flake + 3e-4 * film) - 3e-3 * split.cover * top - 0.008
    return Look(color, np.clip(0.88 + 0.04 * grit + 0.04 * (1 - top), 0, 1), 0.0, height)


def grass(at: Place) -> Look:
    """A lawn from above: pointed blades folded along their rib, one half in the light, straw among them, shade beneath."""
    flat = at.flat
    patch = fbm(flat, Spectrum(0.5, 0.02, 0.8), 1)
    grit = fbm(flat, Spectrum(0.004, 0.0005, 1.0, tails=0.4, patch=0.4), 2)
    color, height = palette(0.45 + 0.2 * grit, "#262d15", "#35401c", "#4c4728"), -0.012 + 1e-3 * grit
    seen = fading(0.004, at.footprint)
    layers = ((0.052, 0.0060, 9, "#2c411a"), (0.048, 0.0054, 8, "#3a5722"), (0.044, 0.0044, 8, "#4c702b"))
    for k, (length, width, count, deep) in enumerate(layers):
        blade = blades(at, length, width, count, 1.2 + 0.7 * k, 5.0, 3 + k, 0.55, 0.3)
        tone = palette(0.4 + 0.12 * patch + 0.6 * (blade.random(2) - 0.5) * seen, deep, "#587d31", "#7a9f44", "#9fba62")
        straw = palette(blade.random(3), "#8d7a45", "#b5a067", "#cdbb86")
        tone = mix(tone, straw, (blade.random(1) < 0.09) * seen + 0.09 * (1 - seen))
        fold = np.tanh(6 * blade.side * (blade.random(4) - 0.5))  # the half that turns to the light
        rib = np.exp(-np.square(blade.side / 0.16))
        tone = shade(tone, (0.24 * fold + 0.14 * rib + 0.25 * blade.along - 0.22) * seen + 0.07 + 0.10 * k + 0.05 * grit)
        color = mix(shade(color, -0.55 * blade.shadow), tone, blade.cover)
        rise = -0.004 + 0.005 * k + (0.005 * blade.along + 0.0005 * (abs(blade.side) - rib)) * seen
        height = mix(height, rise, blade.cover)
    return Look(tint(color, 0.06 * noise(flat, 0.08, 9)), np.clip(0.62 + 0.06 * grit - 0.04 * patch, 0, 1), 0.0, height)


def moss(at: Place) -> Look:
    """Cushions of moss: domes of tiny stars, yellow-green at the tips and dark between, brown where they dry."""
    bent = warped(at, 0.004, 0.03, 1, 3)
    cushion = pebbles(bent, 0.045, 0.001, 0.6, 2, 1.0)
    tuft = fbm(bent, Spectrum(0.018, 0.002, 0.9, patch=0.4), 3)
    star = cells(warped(at, 0.0004, 0.0016, 4), 0.0022, 5)
    shown = fading(0.0022, at.footprint)
    tip = (np.clip(1 - star.near / 0.0016, 0, 1) - 0.4) * shown
    frond = fbm(at, Spectrum(0.003, 0.0003, 1.0, tails=0.6, skew=0.25, patch=0.5), 6)
    dome = cushion.dome
    dry = masked(bent, Spectrum(0.09, 0.002, 0.85, patch=0.5), 0.10, 7, 0.6)
    light = 0.36 + 0.2 * (dome - 0.75) + 0.26 * tip + 0.08 * frond + 0.08 * tuft + 0.2 * (star.random(1) - 0.5) * shown
    color = palette(light, "#232c12", "#3a4a19", "#587022", "#7b9230", "#a3b04a")
    color = mix(color, palette(light + 0.1, "#33281a", "#6a5430", "#9c8148"), 0.7 * dry)
    color = tint(
        shade(color, 0.14 * frond + 0.22 * tip),
        0.12 * (cushion.cells.random(1) - 0.5) * cushion.shown + 0.08 * noise(at, 0.01, 8),
        0.03 * tuft,
    )
    height = 0.010 * (dome - 0.7) + 1.2e-3 * tuft + 7e-4 * tip + 2e-4 * frond
    return Look(color, np.clip(0.93 + 0.03 * frond, 0, 1), 0.0, height)


def leaves(at: Place) -> Look:
    """The floor of a wood in autumn: fallen leaves over one another, midribs and veins, curled rims, holes, mould."""
    flat = at.flat
    grit = fbm(flat, Spectrum(0.006, 0.0006, 1.05, tails=0.4, skew=-0.2, patch=0.5), 1)
    color, height = palette(0.4 + 0.2 * grit, "#2b221b", "#3b2f25", "#52412f"), -0.008 + 4e-4 * grit
    bent = warped(flat, 0.0007, 0.012, 2, 2)
    ragged = Place(bent.p, bent.p[:2], at.face, at.footprint, at.period, at.seed)
    mottle = fbm(flat, Spectrum(0.02, 0.0008, 0.9, tails=0.3, skew=-0.2, patch=0.5), 3)
    seen, whole = fading(0.008, at.footprint), fading(0.05, at.footprint)
    for k in range(4):
        leaf = marks(ragged, 0.085, 0.042, 4, 1.1 * k, 2 * np.pi, 4 + k, 0.5, 0.25)
        inside = abs(leaf.across) < 2
        side, along = np.where(inside, abs(leaf.across), 0), np.where(inside, leaf.along, 0)
        outline = (1 - along * along) * (1.15 - 0.6 * along) * (1 + 0.16 * leaf.random(5) * np.cos(24 * along + 3)) - 0.04
        here = inside * edge((outline - side) * 0.025, at.footprint) * whole + 0.55 * (1 - whole)
        hole = threshold(mottle + 0.6 * (leaf.random(6) - 0.5), 2.7, 0.1)
        rib = np.exp(-side / 0.04) * seen
        vein = np.clip(np.cos(2 * np.pi * (4.5 * along - 2.0 * side)), 0, 1) ** 10 * seen
        curl = np.clip(side + along * along, 0, 1.5) ** 2
        tone = each(
            leaf.random(1),
            whole,
            "#54392a",
            "#7a5136",
            "#94693f",
            "#b18a58",
            "#6a4530",
            "#c2a06c",
            "#a06433",
            "#857462",
            "#8a4a2a",
        )
        tone = shade(tone, 0.12 * mottle + 0.08 * grit + 0.38 * vein + 0.7 * rib - 0.16 * curl + 0.3 * (leaf.random(2) - 0.5))
        tone = tint(tone, 0.2 * (leaf.random(3) - 0.5) - 0.04 * vein)
        under = (
            np.exp(-np.maximum(side - outline, 0) / 0.3) * (abs(leaf.across) < 2) * whole * (0.3 + 1.4 * leaf.random(7))
        )  # the shadow beside an upper leaf: it lies close or stands off
        color = mix(shade(color, -0.3 * under), tone, here * (1 - hole))
        height = mix(
            height, -0.004 + 0.0025 * k + 0.002 * curl * (leaf.random(4) - 0.2) + 4e-4 * rib + 2e-4 * vein, here * (1 - hole)
        )
    return Look(tint(color, 0.04 * noise(flat, 0.04, 9)), np.clip(0.78 + 0.06 * grit, 0, 1), 0.0, height - 0.001)


def snow(at: Place) -> Look:
    """Settled snow: soft drifts, a crust of grains, small pits where it sank, a twig, blue in the hollows."""
    drift = fbm(at, Spectrum(0.5, 0.02, 0.55, (1.5, 1, 1)), 1)
    crust = fbm(warped(at, 0.004, 0.03, 2), Spectrum(0.03, 0.001, 0.9, tails=0.3, skew=0.15, patch=0.4), 3)
    grain = fbm(at, Spectrum(0.006, 0.0003, 1.1, tails=0.4, skew=-0.15, patch=0.4), 4)
    sunk = spots(warped(at, 0.010, 0.05, 5, 3), 0.11, (0.004, 0.030), 0.6, 6, (1.5, 1, 1))
    deep = np.clip(sunk.inside / np.maximum(sunk.radius, 1e-4), 0, 1) * fading(0.02, at.footprint)
    rim = np.exp(-np.square(sunk.inside / 0.005)) * fading(0.010, at.footprint)
    hollow = np.clip(-0.5 * drift - 0.25 * crust + 0.9 * deep, -1, 1.4)
    color = palette(0.58 - 0.30 * hollow + 0.05 * crust, "#b3c2d4", "#ced9e4", "#e3e8ec", "#f3f4f4")
    lee = rim * np.clip(0.5 + sunk.cells.offset[1] / np.maximum(sunk.radius, 1e-3), 0, 1)  # the side that lies in shade
    color = shade(color, 0.03 * grain + 0.015 * crust - 0.38 * lee * np.clip(1 + 0.6 * grain, 0, 2))
    twig = marks(at, 0.07, 0.0022, 2, 0.0, 2 * np.pi, 8, 0.85, 0.5)  # what the wind broke off
    crumb = spots(warped(at, 0.002, 0.006, 9, 3), 0.045, (0.0006, 0.004), 0.45, 10).cover
    fallen = np.clip(twig.cover * (twig.random(1) < 0.07) + 0.9 * crumb, 0, 1)
    color = mix(color, palette(0.5 + 0.2 * grain, "#3a2f26", "#5c4b3c", "#83705c"), 0.85 * fallen)
    rough = np.clip(0.72 + 0.06 * grain + 0.04 * crust, 0.1, 1)
    return Look(color, rough, 0.0, 0.014 * drift + 1.8e-4 * crust + 8e-5 * grain - 0.003 * deep + 4e-4 * fallen)


def ice(at: Place) -> Look:
    """A frozen lake: dark clear ice, white fractures that stand on edge as hazy sheets, bubbles, scratches, frost."""
    bent = warped(at, 0.006, 0.15, 1, 3)
    plane = cells(bent, 0.22, 2)
    main, fine = cracks(bent, 0.24, 0.0024, 0.6, 3, 1, 0.03), cracks(bent, 0.1, 0.0010, 0.05, 4, 2, 0.04)
    cloud = fbm(bent, Spectrum(0.2, 0.002, 0.8, patch=0.6), 5)
    side = 0.02 + 0.05 * plane.random(1) * (plane.random(2) < 0.55)  # the sheet leans under this piece, or away from it
    sheet = np.exp(-main.near / side) * np.clip(0.45 + 0.35 * cloud, 0, 1) * np.clip(0.5 + 0.6 * noise(at, 0.15, 6), 0, 1)
    swarm = np.clip(noise(bent, 0.12, 7), 0, 1.5)
    large, small = spots(at, 0.016, (0.0006, 0.005), 0.75, 8), spots(at, 0.006, (0.0003, 0.0016), 0.8, 9)
    ring = np.exp(-((large.inside / np.maximum(large.radius, 1e-5) - 0.15) ** 2) / 0.03)
    bubble = np.clip((large.cover * (0.35 + 0.65 * ring) + small.cover) * swarm, 0, 1)
    frost = fbm(at, Spectrum(0.01, 0.0006, 1.0, tails=0.4, skew=0.2, patch=0.6), 10)
    scratch = marks(at, 0.25, 0.0009, 3, 0.5, 2 * np.pi, 11, 0.6, 0.15).cover
    white = np.clip(main.cover + 0.75 * fine.cover + 0.55 * sheet + 0.5 * bubble + 0.15 * scratch, 0, 1)
    color = palette(0.42 + 0.14 * cloud + 0.3 * (plane.random(3) - 0.5), "#1d3a44", "#2c5058", "#41696f", "#5e868a")
    color = mix(color, palette(0.6 + 0.15 * frost, "#a9c3c8", "#d3e1e3", "#edf3f3"), white)
    color = tint(shade(color, 0.035 * frost), 0.05 * noise(bent, 0.1, 12))
    return Look(
        color,
        np.clip(0.10 + 0.05 * frost + 0.25 * white + 0.2 * scratch, 0.03, 1),
        0.0,
        1e-4 * cloud + 2e-5 * frost - 4e-4 * main.cover - 1.5e-4 * scratch,
    )


def dust(at: Place) -> Look:
    """A film of house dust: pale powder in faint drifts, lint here and there."""
    drift = fbm(at, Spectrum(0.05, 0.0006, 0.8, patch=0.5), 1)
    powder = fbm(at, Spectrum(0.0025, 0.0002, 1.05, tails=0.5, skew=0.2, patch=0.5), 2)
    lint = marks(at, 0.012, 0.00014, 2, 0.0, 2 * np.pi, 3, 0.6, 0.8)
    color = shade(palette(0.5 + 0.14 * drift + 0.06 * powder, "#8b8479", "#a39a8c", "#b9b1a4"), 0.06 * powder)
    color = mix(color, palette(lint.random(1), "#7d7770", "#d6d0c6"), 0.5 * lint.cover * (lint.random(2) < 0.25))
    return Look(color, np.clip(0.96 + 0.02 * powder, 0, 1), 0.0, 4e-5 * drift + 1.2e-5 * powder)


def grime(at: Place) -> Look:
    """What hands, rain and soot leave: a dark, greasy film, blotched, thicker in specks."""
    tone = fbm(warped(at, 0.004, 0.03, 1, 3), Spectrum(0.06, 0.0008, 0.9, tails=0.3, patch=0.5), 2)
    speck = fbm(at, Spectrum(0.003, 0.0003, 1.05, tails=0.5, skew=-0.3, patch=0.6), 3)
    color = palette(0.5 + 0.18 * tone + 0.08 * speck, "#241f19", "#39332a", "#52493d")
    color = tint(shade(color, 0.10 * speck), 0.06 * noise(at, 0.03, 4))
    return Look(color, np.clip(0.82 - 0.08 * tone + 0.04 * speck, 0, 1), 0.0, 2e-5 * tone + 1e-5 * speck)


def ash(at: Place) -> Look:
    """A cold hearth: pale powder in soft drifts and crumbs, flakes that keep the grain of what burnt, bits of charcoal."""
    bent = warped(at, 0.003, 0.03, 1, 4)
    drift = fbm(bent, Spectrum(0.09, 0.0012, 0.8, tails=0.2, patch=0.4), 2)
    grit = fbm(at, Spectrum(0.003, 0.0002, 1.08, tails=0.5, skew=-0.2, patch=0.5), 3)
    color, height = palette(0.5 + 0.18 * drift, "#7f7c79", "#9a9794", "#b3b0ac", "#cbc9c5"), 8e-4 * drift + 7e-5 * grit
    for k, (size, radius) in enumerate(((0.0035, 0.7), (0.011, 0.55))):
        crumb = heap(bent, size, STONES._replace(radius=radius, rounding=0.8, sharp=0.5, tilt=0.3), 4 + k, (1, 1.5, 1))
        own = 0.5 * (crumb.random(1) - 0.5) * crumb.shown
        tone = palette(0.5 + own + 0.12 * drift, "#908c88", "#b1aeaa", "#cac7c3", "#e2e0dc")
        grain = np.sin(np.float32(2600) * at.p[0] + 6 * crumb.random(3) + grit) * fading(0.0014, at.footprint)
        black = (crumb.random(2) < 0.05 + 0.05 * k) * crumb.shown + (0.05 + 0.05 * k) * (1 - crumb.shown)
        tone = mix(tone, palette(0.5 + 0.25 * grit, "#201f1e", "#343230", "#4a4744"), 0.9 * black)
        soft = np.clip(0.75 + 0.3 * drift, 0.3, 1) * np.maximum(crumb.cover * np.clip(1.3 - crumb.nook, 0, 1), 0)
        color = mix(color, shade(tone, 0.05 * grain + 0.3 * crumb.lean - 0.5 * (crumb.nook - 0.25)), soft)
        height = height + 0.16 * crumb.height * soft
    dust = masked(at, Spectrum(0.012, 0.0004, 0.9), 0.2, 9, 0.4)
    color = shade(mix(color, palette(0.5 + 0.2 * grit, "#aca8a3", "#c4c1bc"), 0.5 * dust), 0.10 * grit)
    return Look(tint(color, 0.04 * noise(at, 0.03, 7)), np.clip(0.95 + 0.03 * grit, 0, 1), 0.0, height - 5e-4)


def charcoal(at: Place) -> Look:
    """Burnt wood: black silk along the fibres, split across and along into blocks, grey ash on the ridges."""
    flat = at.flat
    bent = warped(flat, 0.0012, 0.03, 1, 4)
    block = cells(bent, 0.028, 2, 0.7, (0.8, 1.35, 1))
    shown = fading(0.022, at.footprint)
    fibre = fbm(bent, Spectrum(0.004, 0.0003, 1.0, (1, 12, 1), tails=0.4, skew=-0.15, patch=0.4), 3)
    check = cracks(bent, 0.014, 0.0007, 0.35, 4, 2, 0.06, (0.7, 1.4, 1)).cover
    wide = 0.0012 + 0.0016 * block.random(1)
    gap = 1 - threshold(block.border - wide, 0.0, np.maximum(0.0005, 0.5 * at.footprint))
    back = np.sqrt(np.clip(block.border / 0.009, 0, 1))
    ash_on = masked(bent, Spectrum(0.04, 0.0006, 0.9, patch=0.6), 0.10, 5, 0.5) * np.clip(back + 0.2 * fibre, 0, 1)
    sheen = 0.5 + 0.5 * np.sin(40 * block.random(2) + 25 * block.offset[0] / 0.028)
    color = palette(
        0.45 + 0.16 * fibre + 0.25 * (sheen - 0.5) * shown + 0.15 * (back - 0.7), "#282828", "#2f2f30", "#3c3c3d", "#505052"
    )
    color = mix(color, palette(0.5 + 0.2 * fibre, "#8c8985", "#b0ada8"), 0.6 * ash_on)
    color = mix(shade(color, 0.12 * fibre), palette(0 * gap, "#262525"), np.maximum(0.9 * gap, 0.6 * check))
    height = 0.004 * (back - 0.7) + 1.2e-4 * fibre - 0.003 * gap - 8e-4 * check
    return Look(
        tint(color, 0.03 * noise(bent, 0.03, 6)),
        np.clip(0.55 - 0.08 * fibre - 0.14 * (sheen - 0.5) + 0.3 * ash_on + 0.3 * gap, 0, 1),
        0.0,
        height,
    )


LUMPS = STONES._replace(radius=0.95, vary=0.4, sharp=0.7, rounding=0.0, slope=1.2, thick=0.6, tilt=0.8)
"""Coal breaks flat, along its beds and across them."""


def coal(at: Place) -> Look:
    """Broken bituminous coal: black lumps of all sizes with flat faces, dull ones and bright ones, slack and dust between."""
    grit = fbm(at, Spectrum(0.005, 0.0003, 1.05, tails=0.5, skew=0.2, patch=0.5), 1)
    color, rough, height = palette(0.5 + 0.2 * grit, "#222223", "#353434", "#4a4947"), 0.92 + 0.03 * grit, 3e-4 * grit
    dust = masked(at, Spectrum(0.06, 0.0008, 0.9, patch=0.5), 0.25, 3, 0.5)
    for k, shape in enumerate((LUMPS, LUMPS._replace(radius=0.8))):
        lump = heap(at, (0.011, 0.036)[k], shape, 4 + k)
        bright = 0.3 + 0.75 * lump.lean + 0.35 * (lump.random(1) - 0.5) * lump.shown + 0.06 * grit
        tone = averaged(bright, 0.27 * (1 - lump.shown), "#242425", "#2b2c2d", "#3a3b3d", "#65666a", "#a3a4a8")
        tone = shade(tone, 0.16 * grit - 1.3 * (lump.nook - 0.2))
        tone = mix(tone, palette(0.5 + 0.2 * grit, "#474542", "#5d5a56"), 0.4 * dust * np.clip(1 - bright, 0, 1))
        color, rough = mix(color, tone, lump.cover), mix(rough, 0.7 - 0.5 * bright + 0.05 * grit + 0.15 * dust, lump.cover)
        height = mix(height, 0.8 * lump.height + 0.002 * k + 1e-4 * grit, lump.cover)
    return Look(color, np.clip(rough, 0.12, 1), 0.0, height - 0.012)


def salt(at: Place) -> Look:
    """Coarse salt: cubes and broken corners, glassy white and grey, fine powder between."""
    grit = fbm(at, Spectrum(0.002, 0.0001, 1.1, tails=0.5, skew=-0.2, patch=0.4), 1)
    color, height = shade(palette(0.5 + 0.2 * grit, "#b9bcbf", "#cfd1d2", "#dedfdf"), 0.04 * grit), 5e-5 * grit
    clear = np.zeros(len(at), np.float32)
    for k, (size, share) in enumerate(((0.0016, 0.9), (0.0026, 0.75), (0.0038, 0.5))):
        crystal = pebbles(at.seeded(k + 1), size, 0.06 * size, 0.1, 2 + k, 1.0)
        bed = crystal.cells
        here = crystal.cover * ((bed.random(1) < share) * crystal.shown + share * (1 - crystal.shown))
        tilt = sum(bed.offset[a] * (bed.random(2 + a) - 0.5) for a in (0, 1)) / size
        cloudy = np.clip(0.5 + 0.8 * (bed.random(5) - 0.5) + 0.4 * tilt, 0, 1)
        tone = each(cloudy, crystal.shown, "#a4a8ab", "#c6c9cb", "#e0e1e1", "#eff0ef")
        tone = shade(tone, 0.09 * grit + 0.3 * tilt * crystal.shown + 0.5 * (np.minimum(crystal.dome, 0.7) - 0.62))
        color, height = (
            mix(color, tone, here),
            mix(height, size * (0.35 * crystal.dome + 0.5 * tilt + 0.15 * bed.random(6)), here),
        )
        clear = mix(clear, 0.3 + 0.7 * bed.random(7), here)
    return Look(color, np.clip(0.6 - 0.42 * clear + 0.04 * grit, 0.08, 1), 0.0, height - 0.0012)


LOOKS = {
    "sand": sand, "fine sand": fine_sand, "soil": soil, "cracked mud": cracked_mud, "grass": grass, "moss": moss,
    "leaves": leaves, "snow": snow, "ice": ice, "dust": dust, "grime": grime, "ash": ash, "charcoal": charcoal, "coal": coal,
    "salt": salt,
}  # fmt: skip
METRES = {
    "sand": 1.2, "fine sand": 0.15, "soil": 0.4, "cracked mud": 0.8, "grass": 0.5, "moss": 0.25, "leaves": 0.4,
    "snow": 0.8, "ice": 0.8, "dust": 0.25, "grime": 0.3, "ash": 0.25, "charcoal": 0.2, "coal": 0.3, "salt": 0.06,
}  # fmt: skip
