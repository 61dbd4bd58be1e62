"""Stones: mineral grains, veins, beds, pores, cleavage and pieces."""

from typing import NamedTuple

import numpy as np

from stages.material.heap_kernels import Pieces
from stages.material.look import Look, averaged, each, mix, palette, shade, tint
from stages.material.patterns import (
    PEBBLES,
    STONES,
    Spectrum,
    cells,
    cracks,
    exceeds,
    fading,
    fbm,
    heap,
    lost,
    masked,
    noise,
    pebbles,
    spots,
    threshold,
    warped,
)
from stages.material.place import Place


class Granite(NamedTuple):
    """feldspar, quartz, mica: colours, sRGB. pale: share of feldspar. dark: share of mica. size: of a grain, metres."""

    feldspar: tuple[str, ...] = ("#b4aaa2", "#cfc7bf", "#e0dad4")
    quartz: tuple[str, ...] = ("#85827f", "#9d9a95", "#b3afa9")
    mica: tuple[str, ...] = ("#282829", "#353434", "#514e4b")
    pale: float = 0.5
    dark: float = 0.2
    size: float = 0.007


GRANITES = {
    "grey": Granite(),
    "pink": Granite(("#b3796a", "#c8917f", "#d9ab9a"), ("#8f8884", "#aaa39d", "#c4bdb6"), pale=0.58, dark=0.16, size=0.010),
    "black": Granite(
        ("#3a3b3d", "#4a4b4d", "#5f6061"), ("#2f3031", "#3b3c3d", "#46474a"), ("#282829", "#2a2a2b", "#303032"), 0.3, 0.4, 0.005
    ),
}


CRYSTALS = Pieces(0.9, 0.5, 0.55, 0.0, 1.0, 0.9, 0.5, 0.0)
"""Grown in the melt: flat faces where they were free, cut by their neighbours where not."""


def igneous(at: Place, kind: Granite) -> Look:
    """Interlocking grains: feldspar in blocks, zoned and cleaved; quartz between them, grey and glassy; mica in black nests."""
    size = kind.size
    bent = warped(at, 0.05 * size, 0.5 * size, 1, 3)
    spar, glass = heap(bent, 1.25 * size, CRYSTALS, 2), cells(bent, 0.55 * size, 3)
    flake = heap(bent, 0.42 * size, CRYSTALS._replace(radius=0.75), 4, (1, 1.7, 1))
    show, show_fine = fading(size, at.footprint), fading(0.5 * size, at.footprint)
    cloud = fbm(at, Spectrum(12 * size, size, 0.8), 5)
    grit = fbm(at, Spectrum(0.4 * size, 0.0003, 1.0, tails=0.4, patch=0.4), 6)
    pale = spar.cover * (spar.random(1) < kind.pale / 0.8) * show + kind.pale * (1 - show)
    nest = noise(at, 1.6 * size, 7)
    dark = flake.cover * (flake.random(1) < 2.2 * kind.dark * np.clip(0.75 + 0.6 * nest - 0.25 * pale, 0, 2)) * flake.shown
    dark = np.clip(dark + 1.1 * kind.dark * (1 - flake.shown), 0, 1)
    zone = np.clip(spar.height / size, 0, 1.4) * show  # from the rim inwards
    cleft = fbm(bent.moved(np.stack([spar.random(8), spar.random(9), spar.random(10)]) * np.float32(0.1)),
                Spectrum(0.25 * size, 0.0004, 0.95, (1, 5, 1), 0.3), 8)  # fmt: skip
    feldspar = palette(0.32 + 0.5 * (spar.random(2) - 0.5) * show + 0.22 * zone + 0.1 * cleft, *kind.feldspar)
    feldspar = shade(feldspar, 0.28 * spar.lean + 0.05 * cleft - 0.12 * (spar.nook - 0.2) * show)
    quartz = palette(0.5 + 0.9 * (glass.random(4) - 0.5) * show_fine + 0.12 * grit, *kind.quartz)
    quartz = shade(quartz, 0.1 * (np.clip(glass.border / (0.2 * size), 0, 1) - 0.5) * show_fine)  # clear, darker within
    mica = shade(palette(0.5 + 0.8 * (flake.random(5) - 0.5) * flake.shown, *kind.mica), 0.5 * flake.lean + 0.1 * grit)
    soft = np.clip(0.7 + 0.4 * grit + 0.5 * (flake.random(6) - 0.5), 0.35, 1)  # grains go down into the stone
    color = mix(mix(quartz, feldspar, pale * np.clip(0.9 + 0.1 * zone, 0, 1)), mica, dark * soft)
    color = tint(shade(color, 0.09 * grit + 0.04 * cloud), 0.06 * (glass.random(7) - 0.5) * show_fine * (1 - pale))
    roughness = 0.34 - 0.12 * dark + 0.10 * pale + 0.04 * grit
    return Look(color, np.clip(roughness, 0.1, 1), 0.0, 2e-5 * grit - 6e-5 * (dark - kind.dark) + 4e-5 * (pale - kind.pale))


def granite(at: Place) -> Look:
    """Grey granite, sawn and honed."""
    return igneous(at, GRANITES["grey"])


def pink_granite(at: Place) -> Look:
    """Granite whose feldspar is salmon pink."""
    return igneous(at, GRANITES["pink"])


def black_granite(at: Place) -> Look:
    """Gabbro, which the trade calls black granite: dark grains of much the same tone that glint."""
    return igneous(at, GRANITES["black"])


class Marble(NamedTuple):
    """ground: from clear to cloudy. vein: from faint to strong. veins: share of the borders that hold one. haze: how far a
    vein's colour seeps into the ground, metres.
    """

    ground: tuple[str, ...]
    vein: tuple[str, ...]
    veins: float = 0.45
    haze: float = 0.02


MARBLES = {
    "white": Marble(("#efede9", "#e6e4e0", "#d8d7d4"), ("#b5b4b2", "#868585"), 0.4, 0.03),
    "black": Marble(("#29292b", "#2d2c2d", "#3a3837"), ("#8d8881", "#d9d4cb"), 0.5, 0.004),
    "green": Marble(("#2a3530", "#2e463b", "#486a58"), ("#6f9080", "#c3d1c6"), 0.6, 0.012),
}


def metamorphic(at: Place, kind: Marble) -> Look:
    """Limestone recrystallised under pressure: a cloudy ground of fine crystals and veins that branch, swell and peter out."""
    bent = warped(at, 0.02, 0.35, 1, 4)
    main = cracks(bent, 0.42, 0.009, kind.veins, 3, 2, 0.09, (1, 0.6, 1))
    hair = cracks(bent, 0.13, 0.0022, kind.veins - 0.15, 4, 1, 0.08)
    where = threshold(noise(at, 0.5, 5), -0.5, 0.9)
    cloud = fbm(bent, Spectrum(0.25, 0.004, 0.78, patch=0.4), 6)
    smoke = np.exp(-main.near / kind.haze) * (0.55 + 0.25 * cloud)
    vein = np.clip(main.cover * (0.75 + 0.25 * cloud) + 0.6 * hair.cover * (0.3 + where), 0, 1)
    grain = fbm(at, Spectrum(0.008, 0.0003, 1.12, tails=0.3, patch=0.4), 7)
    color = palette(0.35 + 0.22 * cloud + 0.8 * smoke, *kind.ground)
    color = mix(color, palette(0.5 + 0.25 * cloud + 0.3 * grain, *kind.vein), np.clip(vein + 0.35 * np.clip(smoke, 0, 1), 0, 1))
    color = tint(shade(color, 0.05 * grain), 0.03 * noise(bent, 0.15, 8) + 0.04 * vein)
    return Look(color, 0.13 + 0.14 * vein + 0.015 * abs(grain), 0.0, 4e-6 * grain - 3e-5 * vein)


def marble(at: Place) -> Look:
    """White marble with grey veins, polished."""
    return metamorphic(at, MARBLES["white"])


def black_marble(at: Place) -> Look:
    """Black marble with white calcite veins, polished."""
    return metamorphic(at, MARBLES["black"])


def green_marble(at: Place) -> Look:
    """Serpentine marble: dark green, netted with pale veins."""
    return metamorphic(at, MARBLES["green"])


def bedded(at: Place, wander: float, size: float, seed: int) -> Place:
    """The place with its second axis across the beds, which rise and fall by `wander` over `size`, metres."""
    up = at.upright
    lift = wander * fbm(up, Spectrum(size, size / 8, 0.55, (1, 0.7, 1)), seed)
    return up.moved(np.stack([0 * lift, lift, 0 * lift]).astype(np.float32))


def sandstone(at: Place) -> Look:
    """Sand laid down in beds and cemented with iron: bands of tan, ochre and rust, each worn back by its own hardness."""
    beds = bedded(at, 0.03, 0.5, 1)
    band = fbm(beds, Spectrum(0.16, 0.005, 0.9, (9, 1, 9), patch=0.4), 2)
    seam = np.clip(fbm(beds, Spectrum(0.03, 0.004, 0.9, (12, 1, 12)), 3) - 1.1, 0, 2)
    stain = masked(warped(at, 0.03, 0.1, 4), Spectrum(0.3, 0.004, 0.75, patch=0.4), 0.25, 5, 0.5)
    sand = fbm(at, Spectrum(0.003, 0.0004, 1.05, tails=0.4, skew=-0.15, patch=0.3), 6)
    wear = fbm(at, Spectrum(0.06, 0.002, 0.85, (1.6, 1, 1.6), skew=-0.1, patch=0.3), 7)
    color = palette(0.5 + 0.2 * band + 0.05 * wear, "#9a6a45", "#b98b5c", "#cfa878", "#dcc09a")
    color = mix(color, palette(0.5 + 0.2 * band, "#8f4f2c", "#ad6a3a"), 0.55 * stain)
    color = tint(shade(color, 0.15 * sand + 0.08 * wear - 0.35 * seam), 0.06 * noise(beds, 0.05, 8, (6, 1, 6)))
    return Look(color, 0.88 + 0.04 * sand - 0.03 * stain, 0.0, 2e-4 * sand + 9e-4 * band + 1.2e-3 * wear - 2.5e-3 * seam + 2e-4)


def limestone(at: Place) -> Look:
    """Cream mud full of shells: fossils in section, small pores, a dark stylolite here and there."""
    bent = warped(at, 0.0008, 0.01, 1, 3)
    shell = spots(bent, 0.016, (0.001, 0.005), 0.55, 2, (1.5, 1, 1))
    ring = threshold(abs(shell.inside / np.maximum(shell.radius, 1e-5) - 0.25), 0.16, 0.1)
    fossil = shell.cover
    pore = masked(at, Spectrum(0.008, 0.0008, 0.9, patch=0.5), 0.035, 3, 0.15)
    seam = cracks(bedded(at, 0.008, 0.05, 4), 0.22, 0.0016, 0.35, 5, 1, 0.1, (4, 1, 4)).cover
    cloud = fbm(at, Spectrum(0.3, 0.006, 0.75, (1.5, 1, 1.5), patch=0.4), 6)
    grit = fbm(at, Spectrum(0.004, 0.0004, 1.05, tails=0.3, skew=-0.2, patch=0.4), 7)
    color = palette(0.5 + 0.18 * cloud, "#b5a88f", "#cbc0a8", "#d9d0bb", "#e3dccb")
    color = mix(color, palette(0.4 + 0.5 * ring, "#b3a48a", "#e9e3d5"), 0.7 * fossil)
    color = tint(shade(color, 0.09 * grit - 0.9 * pore - 0.4 * seam), 0.04 * noise(at, 0.03, 8))
    return Look(
        color, 0.72 + 0.05 * grit + 0.12 * pore - 0.08 * fossil, 0.0, 1e-4 * grit + 1.5e-4 * fossil - 9e-4 * pore - 4e-4 * seam
    )


def slate(at: Place) -> Look:
    """Mud pressed into leaves and split along them: terraces with ragged edges, each leaf of its own grey, some plum or green,
    rust where water got in between, a silk along the cleavage."""
    bent = warped(at, 0.004, 0.04, 1, 4)
    leaf = 2.4 * fbm(bent, Spectrum(0.4, 0.003, 0.47, (1.4, 1, 1)), 2)
    step = np.floor(leaf)
    rise = leaf - step
    seen = fading(0.006, at.footprint)
    lip = threshold(0.07 - rise, 0.0, 0.05) * seen  # the broken edge of a leaf catches light, and lies dark below
    under = threshold(rise, 0.86, 0.12) * seen
    tone, hue = np.sin(step * 12.9898 + 4.0), np.sin(step * 7.233 + 1.0)
    lines = fbm(at, Spectrum(0.03, 0.0006, 1.0, (5, 1, 1), tails=0.3, patch=0.5), 3)
    grit = fbm(at, Spectrum(0.003, 0.0004, 1.0, tails=0.4, patch=0.4), 4)
    scar = fbm(bent, Spectrum(0.08, 0.002, 0.85, (2.5, 1, 1), 0.3, patch=0.5), 6)
    rusty = masked(bent, Spectrum(0.16, 0.002, 0.85, patch=0.5), 0.10, 5, 0.6) * np.clip(0.5 + 0.5 * hue + lip, 0, 1)
    color = palette(0.5 + 0.34 * tone + 0.05 * lines + 0.09 * scar, "#34383b", "#474c4f", "#5a5f60", "#72746f")
    color = mix(color, palette(0.5 + 0.2 * grit, "#5b4630", "#85684a"), 0.6 * rusty)
    color = shade(color, 0.09 * grit + 0.06 * lines + 0.07 * scar + 0.7 * lip * np.clip(1 + scar, 0, 2) - 0.5 * under)
    color = tint(color, 0.05 * noise(bent, 0.06, 7) + 0.07 * hue, 0.05 * tone)
    height = 1.6e-3 * (step + np.clip(rise / 0.06, 0, 1)) + 2e-4 * rise + 5e-5 * lines + 1.2e-4 * scar + 3e-5 * grit - 8e-4
    return Look(color, np.clip(0.52 + 0.06 * grit + 0.06 * tone + 0.14 * lip + 0.12 * rusty, 0, 1), 0.0, height)


def travertine(at: Place) -> Look:
    """Lime laid down by springs: wavy cream and beige beds, holes drawn out along them where reeds and gas were, some filled,
    some shallow, dusk in the deep ones."""
    beds = bedded(at, 0.008, 0.25, 1)
    band = fbm(beds, Spectrum(0.09, 0.002, 0.9, (9, 1, 9), patch=0.4), 2)
    porous = threshold(noise(beds, 0.05, 3, (6, 1, 6)), 0.1, 0.7)
    shape = Spectrum(0.011, 0.0006, 0.72, (2.6, 1, 2.6), patch=0.3)
    hidden = lost(beds, shape)
    thick = fbm(beds, shape, 4) + 1.2 * porous
    hole, deep = exceeds(thick, 2.2, 0.12, hidden), exceeds(thick, 2.75, 0.4, hidden)
    rim = exceeds(thick, 1.7, 0.5, hidden) - hole
    filled = threshold(noise(beds, 0.03, 9, (3, 1, 3)), 0.35, 0.15)
    pin = masked(beds, Spectrum(0.003, 0.0004, 0.9, (2, 1, 2), patch=0.8), 0.03, 10, 0.2)
    cloud = fbm(at, Spectrum(0.2, 0.01, 0.8), 5)
    grain = fbm(at, Spectrum(0.008, 0.0003, 1.1, tails=0.3, skew=-0.15, patch=0.4), 6)
    crystal = np.clip(fbm(beds, Spectrum(0.012, 0.001, 0.95, (5, 1, 5), 0.4), 11) - 1.3, 0, 1.5)  # clear calcite in seams
    color = palette(0.52 + 0.17 * band + 0.05 * cloud, "#a98d6b", "#c6ad8b", "#d9c6a8", "#e8dcc6")
    color = mix(color, palette(0.5 + 0.3 * grain, "#dcd3c0", "#f1ebdd"), 0.45 * crystal)
    wall = palette(0.75 - 0.75 * deep + 0.18 * grain + 0.1 * band, "#3b2e20", "#6d563e", "#96795a", "#b79b77")
    wall = mix(wall, palette(0.5 + 0.2 * grain, "#b7a384", "#d2c1a4"), 0.85 * filled)
    color = shade(color, 0.09 * grain - 0.2 * rim * np.clip(0.6 + 0.5 * grain, 0, 1.5) - 0.45 * pin * (1 - hole))
    color = tint(mix(color, wall, 0.95 * hole), 0.06 * noise(beds, 0.04, 7, (5, 1, 5)))
    height = 2e-5 * grain + 3e-5 * band - (5e-4 * hole + 2.4e-3 * deep) * (1 - 0.9 * filled) - 2e-4 * pin + 1.2e-4
    return Look(color, np.clip(0.4 + 0.05 * grain - 0.03 * band + 0.4 * hole * (1 - filled), 0, 1), 0.0, height)


def basalt(at: Place) -> Look:
    """Lava that cooled with gas in it: near black, fine, riddled with round vesicles of all sizes, some filled white."""
    bent = warped(at, 0.0005, 0.005, 1, 3)
    large, small = spots(bent, 0.013, (0.0015, 0.006), 0.85, 2), spots(bent, 0.005, (0.0006, 0.0022), 0.85, 3)
    full = (large.cells.random(5) < 0.03) * fading(0.014, at.footprint)
    hole = np.maximum(large.cover, small.cover)
    depth = np.sqrt(np.clip(np.maximum(large.inside, small.inside), 0, 0.003) / 0.003)
    cloud = fbm(at, Spectrum(0.15, 0.005, 0.8, patch=0.4), 4)
    grit = fbm(at, Spectrum(0.004, 0.0004, 1.0, tails=0.5, skew=0.15, patch=0.4), 5)
    color = palette(0.5 + 0.14 * cloud + 0.1 * grit, "#434345", "#555454", "#686664", "#807c77")
    color = mix(shade(color, 0.14 * grit), palette(0.5 + 0.2 * grit, "#282829", "#363535"), 0.85 * hole)
    color = tint(mix(color, palette(0.5 + 0.3 * grit, "#b8b4aa", "#d6d3ca"), full * hole), 0.05 * noise(at, 0.02, 6))
    height = 1.2e-4 * grit + 6e-4 * cloud - 1.6e-3 * depth * (1 - 0.9 * full) + 4e-4
    return Look(color, 0.82 + 0.05 * grit + 0.07 * hole, 0.0, height)


CHIPS = Pieces(0.85, 0.5, 0.7, 0.0, 1.0, 0.8, 0.5, 0.0)
"""Broken marble, ground flat."""


def terrazzo(at: Place) -> Look:
    """Chips of marble in cement, ground flat and polished: broken pieces of three sizes, veined and clouded, some clear at
    their rims, splinters and sand between."""
    grain = fbm(at, Spectrum(0.003, 0.0004, 1.0, tails=0.4, skew=-0.15, patch=0.4), 1)
    cloud = fbm(at, Spectrum(0.3, 0.01, 0.8), 2)
    color = shade(palette(0.5 + 0.2 * cloud, "#cfc6b8", "#dcd4c8", "#e6e0d6"), 0.06 * grain)
    chip, vein = np.zeros(len(at), np.float32), fbm(at, Spectrum(0.02, 0.001, 0.75, (1, 0.5, 1)), 3)
    for k, (size, radius) in enumerate(((0.0045, 0.75), (0.012, 0.72), (0.028, 0.62))):
        piece = heap(at, size, CHIPS._replace(radius=radius), 4 + k, (1.2, 0.9, 1))
        own = each(
            piece.random(3), piece.shown,
            "#a08c76", "#bda78e", "#cdbaa2", "#e9e2d6", "#f1ece2", "#c8c2b8", "#b4afa7", "#c0937a", "#d8c7b0", "#88827a",
        )  # fmt: skip
        mottle = (0.08 * vein + 0.10 * np.exp(-np.square(vein / 0.12))) * (0.3 + 1.4 * piece.random(4))
        own = tint(shade(own, mottle + 0.06 * grain - 0.04), 0.1 * (piece.random(5) - 0.5) * piece.shown)
        clear = np.clip(0.55 + piece.height / (0.5 * size), 0, 1)  # thin rims let the cement through
        here = piece.cover * mix(1.0, clear, (piece.random(6) < 0.4) * piece.shown)
        color, chip = mix(color, own, here), np.maximum(chip, here)
    return Look(color, 0.26 - 0.1 * chip + 0.03 * grain, 0.0, 1.2e-5 * (chip - 0.6) + 4e-6 * grain)


WIDE_BANDS = Spectrum(0.16, 0.01, 0.85, (10, 1, 10))


def onyx(at: Place) -> Look:
    """Banded calcite: thin layers of honey, rust, white and grey-blue, folded as they grew, half translucent."""
    fold = bedded(warped(at, 0.006, 0.15, 1), 0.035, 0.6, 2)
    wide = fbm(fold, WIDE_BANDS, 4)
    thin = fbm(fold, Spectrum(0.02, 0.0005, 1.0, (16, 1, 16), tails=0.3, patch=0.5), 5)
    line_ = np.clip(fbm(fold, Spectrum(0.03, 0.003, 0.9, (14, 1, 14)), 6) - 1.2, 0, 1.5)
    grain = fbm(at, Spectrum(0.008, 0.0003, 1.1, tails=0.4, patch=0.4), 7)
    hidden = 0.23 * lost(fold, WIDE_BANDS)
    color = averaged(
        0.5 + 0.23 * wide + 0.07 * thin,
        hidden,
        "#6f7c86",
        "#a3a9aa",
        "#d9d2c3",
        "#e6d6b4",
        "#c58f4d",
        "#a9662a",
        "#dcc08c",
        "#efe6d2",
    )
    color = mix(color, palette(0.5 + 0.3 * thin, "#f0e9dc", "#fbf6ec"), np.clip(line_, 0, 1) * 0.8)
    color = tint(shade(color, 0.12 * thin + 0.09 * grain), 0.05 * noise(fold, 0.03, 8, (6, 1, 6)))
    return Look(color, 0.14 + 0.03 * abs(thin) + 0.02 * grain, 0.0, 6e-6 * thin)


def rock(at: Place) -> Look:
    """Weathered cliff: broken faces, cracks that branch, ledges, lichen grey and rusty where water stood."""
    beds = bedded(at, 0.015, 0.5, 1)
    bent = warped(beds, 0.006, 0.12, 2, 5)
    block = cells(bent, 0.16, 3, 1.0, (1.7, 0.8, 1.3))
    tilt = (block.offset[0] * (block.random(1) - 0.5) + block.offset[1] * (block.random(2) - 0.5)) * 0.35 + 0.02 * (
        block.random(3) - 0.5
    )
    torn = fbm(bent, Spectrum(0.12, 0.0012, 0.82, (1.8, 1, 1.8), tails=0.2, skew=-0.15, patch=0.5), 4)
    crack = cracks(beds, 0.3, 0.006, 0.55, 5, 3, 0.07, (1.6, 0.9, 1))
    grit = fbm(at, Spectrum(0.006, 0.0006, 1.0, tails=0.4, patch=0.5), 6)
    stain = masked(bent, Spectrum(0.25, 0.003, 0.85, patch=0.4), 0.2, 7, 0.5)
    color = palette(0.5 + 0.12 * torn + 0.35 * (block.random(4) - 0.5), "#6a6560", "#878179", "#9d978e", "#b3aea5")
    color = mix(color, palette(0.5 + 0.2 * grit, "#7c6047", "#9c7c5b"), 0.5 * stain)
    color = shade(color, 0.12 * grit + 0.14 * torn + 1.5 * tilt - 0.5 * np.exp(-crack.near / 0.004))
    color = tint(mix(color, palette(0.5 + 0.2 * grit, "#2c2a28", "#3d3a36"), 0.85 * crack.cover), 0.06 * noise(bent, 0.08, 8))
    height = tilt + 5e-3 * torn + 4e-4 * grit - 8e-3 * crack.cover
    return Look(color, np.clip(0.84 + 0.05 * grit + 0.05 * crack.cover, 0, 1), 0.0, height)


def fieldstone(at: Place, size: float, gap: float, corner: float, stretch: float, mortar: tuple[str, ...]) -> Look:
    """Stones found, not cut, laid in mortar: each of another rock, its face rough and rounded to the joint."""
    flat = at.flat
    bent = warped(flat, 0.02 * size, 0.3 * size, 1, 5)
    stone = pebbles(bent, size, gap, corner, 2, 0.85, (stretch, 1, 1), 0.0)
    bed = stone.cells
    own = flat.moved(np.stack([0 * bed.near, 0 * bed.near, bed.random(1) * 9]))  # no grain runs on from stone to stone
    face = fbm(own, Spectrum(0.5 * size, 0.001, 0.85, (1.5, 1, 1), tails=0.2, skew=-0.15, patch=0.5), 3)
    grit = fbm(flat, Spectrum(0.006, 0.0006, 1.0, tails=0.4, patch=0.5), 4)
    rock_color = each(
        0.9 * bed.random(2) + 0.05 + 0.012 * face,
        stone.shown,
        "#5d5a56",
        "#7d776e",
        "#93897a",
        "#7f6d58",
        "#a39680",
        "#6b6f72",
        "#87816f",
    )
    rock_color = tint(
        shade(rock_color, 0.14 * face + 0.14 * grit + 0.5 * (bed.random(3) - 0.5) * stone.shown), 0.12 * (bed.random(4) - 0.5)
    )
    joint = shade(palette(0.5 + 0.2 * noise(flat, 0.06, 5), *mortar), 0.16 * grit)
    color = mix(
        joint, shade(rock_color, 0.15 - 0.7 * np.exp(-np.maximum(stone.inside, 0) / (0.05 * size)) * stone.shown), stone.cover
    )
    height = stone.cover * (0.09 * size * stone.dome + 0.014 * size * face) + 3e-4 * grit - 0.055 * size
    return Look(color, np.clip(0.86 + 0.05 * grit - 0.05 * stone.cover, 0, 1), 0.0, height, stone.cover)


def rock_wall(at: Place) -> Look:
    """Rubble masonry: field stones, wider than high, in lime mortar."""
    return fieldstone(at, 0.24, 0.024, 0.35, 1.5, ("#98917f", "#b3ac9b", "#c6bfae"))


def cobblestone(at: Place) -> Look:
    """Round river cobbles set in sand."""
    return fieldstone(at, 0.11, 0.010, 0.8, 1.0, ("#302b25", "#40392f", "#514a3e"))


def pebble_bed(at: Place) -> Look:
    """Beach pebbles, washed smooth, the large among the small: grey, rust, white and speckled, some with a band."""
    grit = fbm(at, Spectrum(0.004, 0.0004, 1.0, tails=0.5, skew=0.2, patch=0.5), 4)
    color, height = shade(palette(0.5 + 0.2 * grit, "#3a342d", "#574f45"), 0.1 * grit), 1e-4 * grit
    for k, shape in enumerate((PEBBLES, PEBBLES._replace(radius=0.7))):
        bed = heap(at, (0.013, 0.030)[k], shape, 2 + k, (1.25, 1, 1))
        rock = each(
            bed.random(1), bed.shown, "#55585b", "#7d7f7f", "#a39f97", "#8b6f58", "#c2b59f", "#6f6a64", "#ddd8cd", "#93705a"
        )
        speckle = 0.16 * grit * bed.random(2)
        band = abs(noise(at, 0.03, 5, (1, 0.4, 1)) - 3 * (bed.random(3) - 0.5)) < 0.14
        rock = mix(rock, palette(bed.random(4), "#cfc9bd", "#ece8df"), 0.6 * band * (bed.random(5) < 0.25) * bed.shown)
        rock = shade(rock, speckle + 0.3 * (bed.random(6) - 0.5) * bed.shown - 1.3 * (bed.nook - 0.15))
        color = mix(color, tint(rock, 0.1 * (bed.random(7) - 0.5) * bed.shown), bed.cover)
        height = mix(height, 0.6 * bed.height + 0.002 * k + 3e-5 * grit, bed.cover)
    return Look(color, np.clip(0.6 + 0.04 * grit, 0, 1), 0.0, height - 0.007)


def gravel(at: Place) -> Look:
    """Crushed stone: sharp pieces of all sizes, wedged into one another, dust on them and between."""
    grit = fbm(at, Spectrum(0.004, 0.0004, 1.0, tails=0.4, patch=0.4), 1)
    dust = fbm(at, Spectrum(0.2, 0.01, 0.8), 2)
    color, height = shade(palette(0.5 + 0.2 * dust, "#57524a", "#6b655c", "#7d776c"), 0.14 * grit), 2e-4 * grit
    for k, shape in enumerate((STONES, STONES._replace(radius=0.62))):
        heap_of = heap(at, (0.0085, 0.021)[k], shape, 3 + k)
        stone = each(heap_of.random(1), heap_of.shown, "#6c6a68", "#8a8782", "#a5a19a", "#7a7169", "#bdb8af", "#918b84")
        speck = (heap_of.random(2) - 0.5) * heap_of.shown
        light = 0.55 * heap_of.lean + 0.4 * speck + 0.16 * grit * (1 + speck) - 1.1 * (heap_of.nook - 0.2)
        dusty = np.clip(0.25 + 0.1 * dust + 0.5 * heap_of.lean, 0, 1)
        stone = tint(shade(stone, light), 0.12 * (heap_of.random(3) - 0.5) * heap_of.shown)
        stone = mix(stone, shade(palette(0 * grit, "#8f897e"), 0.5 * light), 0.4 * dusty)
        color = mix(color, stone, heap_of.cover)
        height = mix(height, 0.9 * heap_of.height + 0.002 * k + 1e-4 * grit, heap_of.cover)
    return Look(tint(color, 0.04 * noise(at, 0.01, 9)), np.clip(0.88 + 0.05 * grit, 0, 1), 0.0, height - 0.006)


def jade(at: Place) -> Look:
    """Felted fibres of nephrite, waxy: pale and spinach green that run into one another at depth, healed hairlines with russet
    beside them, a few dark specks."""
    bent = warped(warped(at, 0.02, 0.12, 1, 2), 0.004, 0.03, 2, 2)
    cloud = fbm(bent, Spectrum(0.13, 0.012, 0.5, (1, 1.6, 1), patch=0.2), 3)
    milk = fbm(bent, Spectrum(0.05, 0.008, 0.5, (1, 2.2, 1), 0.1, 0.1, 0.2), 4)
    felt = fbm(at, Spectrum(0.006, 0.0003, 0.9, (1, 2.2, 1), tails=0.3, patch=0.4), 5)
    seam = np.exp(-np.square(fbm(bent, Spectrum(0.16, 0.02, 0.5), 6) / 0.02)) * np.clip(0.3 + 0.7 * noise(at, 0.08, 7), 0, 1)
    russet = np.exp(-np.square(fbm(bent, Spectrum(0.16, 0.02, 0.5), 6) / 0.16)) * np.clip(0.2 + 0.8 * noise(at, 0.12, 7), 0, 1)
    speck = spots(warped(at, 0.0004, 0.003, 8), 0.012, (0.0001, 0.0007), 0.18, 9).cover
    color = palette(0.5 + 0.20 * cloud + 0.05 * felt, "#2f6b4a", "#43835b", "#5f9d74", "#7fb18a", "#a3c4a1")
    color = mix(color, palette(0.5 + 0.1 * felt, "#bfd6b6", "#dbe7d0"), 0.22 * np.clip(milk, 0, 1.5))
    color = mix(color, palette(0.5 + 0.2 * felt, "#9a7440", "#c1a06a"), 0.35 * russet * np.clip(0.4 + cloud, 0, 1))
    color = tint(shade(color, 0.05 * felt - 0.25 * seam - 0.7 * speck), 0.04 * cloud)
    return Look(color, 0.12 + 0.015 * abs(felt) + 0.02 * seam, 0.0, 1.5e-6 * felt - 3e-6 * seam)


def malachite(at: Place) -> Look:
    """Copper carbonate grown in shells about many centres: rings of light and dark green, cut and polished."""
    bent = warped(at, 0.0035, 0.03, 1, 3)
    growth = cells(bent, 0.055, 2)
    depth = np.stack([growth.near * (1 + 0.3 * growth.random(1)), growth.random(2) * 3, 0 * growth.near]).astype(np.float32)
    shells = Place(depth, at.uv, at.face, at.footprint, seed=at.seed)
    layers = Spectrum(0.012, 0.0006, 0.95, (1, 30, 1), tails=0.2, patch=0.5)
    band = fbm(shells, layers, 3)
    silk = fbm(at, Spectrum(0.004, 0.0003, 1.0, tails=0.4, patch=0.5), 4)
    seam = threshold(0.0012 - growth.border, 0.0, 0.0008)
    color = averaged(0.48 + 0.22 * band, 0.22 * lost(shells, layers), "#1c4434", "#1d5a43", "#1f7a59", "#46a07c", "#86c3a3")
    color = tint(shade(color, 0.05 * silk - 0.35 * seam), 0.05 * noise(bent, 0.03, 5))
    return Look(color, 0.12 + 0.02 * abs(band) + 0.05 * seam, 0.0, 2e-6 * band - 1e-5 * seam)


def lapis(at: Place) -> Look:
    """Lapis lazuli: deep blue grains, clouds of white calcite, flecks of golden pyrite in swarms."""
    bent = warped(at, 0.0012, 0.012, 1, 4)
    depth = Spectrum(0.04, 0.0005, 0.85, patch=0.5)
    cloud = fbm(bent, depth, 2)
    calcite = masked(bent, Spectrum(0.035, 0.0005, 0.85, (1, 2, 1), patch=0.4), 0.08, 3, 0.5)
    swarm = np.clip(0.12 + 0.12 * noise(at, 0.04, 4), 0, 0.4)
    fleck = cells(bent, 0.0016, 5)
    shown = fading(0.0016, at.footprint)
    pyrite = (fleck.random(1) < swarm) * (fleck.near < 0.0011 * fleck.random(2)) * shown + 0.04 * (1 - shown)
    grit = fbm(at, Spectrum(0.003, 0.0003, 1.0, tails=0.4, patch=0.4), 6)
    color = averaged(0.5 + 0.2 * cloud, 0.2 * lost(at, depth), "#1d2a5e", "#22377f", "#2d4c9c", "#5571b4")
    color = mix(color, palette(0.5 + 0.2 * grit, "#8fa3cf", "#d5dbe6"), 0.7 * calcite)
    color = mix(
        tint(shade(color, 0.10 * grit), 0.05 * noise(bent, 0.02, 7)), each(fleck.random(3), shown, "#c7a560", "#e6c987"), pyrite
    )
    return Look(color, 0.14 + 0.04 * calcite + 0.1 * pyrite + 0.015 * grit, 0.9 * pyrite, 5e-6 * (pyrite - calcite))


def lava(at: Place) -> Look:
    """A skin of black rock, ropy and torn, over melt that shows red to yellow in the cracks."""
    bent = warped(at, 0.02, 0.2, 1, 4)
    gap = cracks(bent, 0.5, 0.034, 0.5, 2, 2, 0.06)
    folds = Spectrum(0.06, 0.004, 0.75, (1, 0.5, 1), patch=0.4)
    rope = abs(fbm(bent, folds, 3)) + 0.7 * lost(at, folds)
    grit = fbm(at, Spectrum(0.012, 0.0008, 1.0, tails=0.5, skew=0.15, patch=0.5), 4)
    heat = (
        0.85
        - 0.6 * mix(0.5, np.clip(gap.near / 0.012, 0, 1), fading(0.03, at.footprint))
        + 0.12 * noise(at, 0.2, 5)
        + 0.1 * fbm(bent, Spectrum(0.05, 0.002, 0.9), 6)
    )
    glow = np.exp(-gap.near / 0.012)
    crust = shade(palette(0.4 + 0.25 * rope, "#2a2828", "#3a3736", "#524e4b"), 0.2 * grit)
    crust = mix(crust, palette(0.5 + 0.2 * grit, "#5a1a0c", "#8a2a10"), 0.5 * glow)
    melt = palette(heat, "#6a1407", "#a82208", "#e2500c", "#f98a1c", "#ffc24a")
    color = mix(crust, melt, gap.cover)
    height = (1 - gap.cover) * (0.008 * rope + 8e-4 * grit + 0.012) - 0.014
    return Look(color, np.clip(0.8 + 0.06 * grit - 0.3 * gap.cover, 0, 1), 0.0, height)


LOOKS = {
    "granite": granite, "pink granite": pink_granite, "black granite": black_granite, "marble": marble,
    "black marble": black_marble, "green marble": green_marble, "sandstone": sandstone, "limestone": limestone,
    "slate": slate, "travertine": travertine, "basalt": basalt, "terrazzo": terrazzo, "onyx": onyx, "rock": rock,
    "rock wall": rock_wall, "cobblestone": cobblestone, "pebbles": pebble_bed, "gravel": gravel, "jade": jade,
    "malachite": malachite, "lapis": lapis, "lava": lava,
}  # fmt: skip
METRES = {
    "granite": 0.25, "pink granite": 0.3, "black granite": 0.2, "marble": 1.2, "black marble": 1.2, "green marble": 1.0,
    "sandstone": 0.8, "limestone": 0.4, "slate": 0.6, "travertine": 0.5, "basalt": 0.25, "terrazzo": 0.3, "onyx": 0.6,
    "rock": 1.2, "rock wall": 1.8, "cobblestone": 1.0, "pebbles": 0.4, "gravel": 0.25, "jade": 0.2, "malachite": 0.2,
    "lapis": 0.15, "lava": 1.5,
}  # fmt: skip
