"""Concrete, plaster, whitewash, mud and asphalt: what is poured, trowelled or rolled and then sets."""

from typing import NamedTuple

import numpy as np

from stages.material.look import Look, each, mix, palette, shade, tint
from stages.material.patterns import (
    Array,
    Spectrum,
    cracks,
    exceeds,
    fbm,
    lost,
    marks,
    masked,
    noise,
    pebbles,
    spots,
    threshold,
    tiles,
    warped,
)
from stages.material.place import Place


def bug_holes(at: Place, seed: int) -> tuple[Array, Array]:
    """Air caught at the shutter: round holes, many small ones and few large. Returns: cover (P,), depth (P,) 0 … 1."""
    bent = warped(at, 0.0006, 0.006, seed, 2)
    few, many = spots(bent, 0.05, (0.0012, 0.006), 0.45, seed + 1), spots(bent, 0.018, (0.0005, 0.002), 0.35, seed + 2)
    cover = np.maximum(few.cover, many.cover)
    return cover, np.sqrt(np.clip(np.maximum(few.inside / 0.006, many.inside / 0.003), 0, 1))


def concrete(at: Place) -> Look:
    """Cast in plywood shutters: panel joints with a fin, tie holes, bug holes, clouds of cement, water stains down the face."""
    flat = at.flat
    panel = tiles(at, 1.2, 0.6, "stack", 1)
    hole, depth = bug_holes(flat, 2)
    cloud = fbm(flat, Spectrum(0.6, 0.006, 0.75, (1, 1.4, 1), patch=0.4), 5)
    run = fbm(flat, Spectrum(0.10, 0.004, 0.85, (1, 9, 1), patch=0.4), 6)
    grit = fbm(flat, Spectrum(0.012, 0.0006, 1.1, tails=0.4, skew=-0.15, patch=0.5), 7)
    fin = threshold(0.0025 + 0.001 * noise(flat, 0.05, 8) - panel.border, 0.0, np.maximum(0.0008, 0.5 * at.footprint))
    halo = np.exp(-panel.border / 0.03)
    tie = np.hypot(abs(panel.x) - 0.32, panel.y)
    cone = threshold(0.014 - tie, 0.0, np.maximum(0.0008, 0.5 * at.footprint))
    ring = np.exp(-abs(tie - 0.016) / 0.003)
    crack = cracks(flat, 0.6, 0.0012, 0.22, 9, 1, 0.06)
    lime = masked(flat, Spectrum(0.25, 0.003, 0.85, (1, 2.5, 1), patch=0.5), 0.06, 10, 0.6)
    color = palette(0.5 + 0.13 * cloud + 0.06 * run + 0.3 * (panel.random(1) - 0.5), "#817f7a", "#96948e", "#a8a69f", "#b8b5ad")
    color = shade(
        color, 0.11 * grit - 0.10 * halo - 0.5 * fin - 0.18 * ring - 0.25 * np.exp(-crack.near / 0.004) * (crack.near < 0.02)
    )
    color = mix(color, palette(0.5 + 0.2 * grit, "#c3c0b8", "#d4d1c9"), 0.45 * lime)
    color = mix(
        color,
        palette(0.5 + 0.2 * grit, "#474540", "#5b5852"),
        np.maximum(np.maximum(0.8 * hole, 0.9 * cone), 0.8 * crack.cover),
    )
    color = tint(color, 0.04 * noise(flat, 0.3, 11) + 0.02 * run)
    height = 3e-4 * cloud + 6e-5 * grit - 1.6e-3 * hole * depth - 0.012 * cone + 8e-4 * fin - 6e-4 * crack.cover
    return Look(color, np.clip(0.74 + 0.05 * grit - 0.04 * cloud + 0.12 * hole + 0.06 * lime, 0, 1), 0.0, height)


def cement(at: Place) -> Look:
    """Cement floated smooth by hand: clouds with arcs of the trowel, a few hair cracks, burnished dark where pressed."""
    flat = at.flat
    bent = warped(flat, 0.02, 0.25, 1, 3)
    cloud = fbm(bent, Spectrum(0.45, 0.003, 0.8, patch=0.5), 2)
    arcs = marks(at, 0.5, 0.09, 3, 0.3, 2.2, 3, 0.5, 0.5)
    sweep = np.where(arcs.across < 2, (arcs.random(1) - 0.5) + 0.5 * np.clip(arcs.across, -1, 1) ** 3, 0) * arcs.cover
    comb = fbm(
        Place(
            np.stack([arcs.along * 0.3, arcs.across * 0.045, 0.01 * arcs.random(2)]), at.uv, at.face, at.footprint, seed=at.seed
        ),
        Spectrum(0.012, 0.001, 0.95, (12, 1, 1), patch=0.4),
        4,
    )
    crack = cracks(flat, 0.25, 0.0007, 0.25, 5, 1, 0.06)
    grit = fbm(flat, Spectrum(0.008, 0.0004, 1.12, tails=0.4, skew=-0.2, patch=0.5), 6)
    color = palette(0.5 + 0.15 * cloud + 0.12 * sweep, "#7d7b77", "#8f8d88", "#a19e98", "#b3b0a9")
    color = tint(shade(color, 0.08 * grit + 0.03 * comb * arcs.cover - 0.6 * crack.cover), 0.03 * noise(bent, 0.2, 7))
    height = 1.5e-4 * sweep + 2.5e-5 * comb * arcs.cover + 2e-5 * grit - 4e-4 * crack.cover
    return Look(color, np.clip(0.52 + 0.08 * cloud + 0.06 * sweep + 0.03 * grit, 0, 1), 0.0, height)


class Coat(NamedTuple):
    """colors: of the coat. lumps: height of the trowel's work, metres. sand: height of grains, metres. cracks: share of
    hair cracks that are open. stains: share that damp or dirt has darkened. peeled: share that has fallen off, down to mud
    or brick dust.
    """

    colors: tuple[str, ...]
    lumps: float
    sand: float
    cracks: float = 0.2
    stains: float = 0.1
    peeled: float = 0.0
    under: tuple[str, ...] = ("#8f7f6a", "#b09d82")


COATS = {
    "plaster": Coat(("#d9d3c7", "#e3ded3", "#eae6dc"), 0.0006, 6e-5, 0.25, 0.12),
    "whitewash": Coat(("#dedbd2", "#e8e6df", "#efede7"), 0.0022, 1.5e-4, 0.25, 0.2, 0.07),
}


def render(at: Place, kind: Coat) -> Look:
    """Lime and sand thrown on and worked with a trowel: strokes with a ridge at one side, sand, hair cracks, stains, losses."""
    flat = at.flat
    strokes = [marks(at, 0.34, 0.11, 3, 0.4, 2 * np.pi, 1 + k, 0.5, 0.35) for k in range(2)]
    press = np.zeros(len(at), np.float32)
    for stroke in strokes:  # pressed in along one side, squeezed up at the other
        side = np.where(stroke.across < 2, np.clip(stroke.across, -1, 1), 0)
        press = mix(press, 0.6 * side + np.exp(-((side - 0.85) ** 2) / 0.01) + 0.6 * (stroke.random(1) - 0.5), stroke.cover)
    drag = fbm(warped(flat, 0.02, 0.15, 3, 1), Spectrum(0.10, 0.003, 0.8, (2.2, 1, 1), patch=0.5), 4)
    sand = fbm(flat, Spectrum(0.010, 0.0005, 1.1, tails=0.5, skew=0.15, patch=0.4), 5)
    crack = cracks(flat, 0.3, 0.0008, kind.cracks, 6, 1, 0.06)
    stain = masked(flat, Spectrum(0.5, 0.004, 0.8, (1, 1.8, 1), patch=0.4), kind.stains, 7, 0.9)
    shape = Spectrum(0.30, 0.002, 0.8, patch=0.4)
    field = fbm(flat, shape, 8)
    level = 1.48 if kind.peeled else 9.0
    bare = exceeds(field, level, 0.03, lost(flat, shape))
    lip = exceeds(field, level - 0.12, 0.1, lost(flat, shape)) - bare
    color = palette(0.5 + 0.12 * press + 0.1 * drag, *kind.colors)
    color = shade(
        color,
        0.03 * press
        + 0.03 * drag
        + 60 * min(kind.sand, 1e-3) * sand
        + 0.075 * sand
        - 0.28 * stain
        - 0.5 * crack.cover
        - 0.12 * lip,
    )
    color = tint(
        mix(color, shade(palette(0.5 + 0.2 * drag, *kind.under), 0.12 * sand), bare), 0.06 * stain + 0.03 * noise(flat, 0.25, 9)
    )
    height = kind.lumps * (0.5 * press + 0.35 * drag) + kind.sand * sand - 5e-4 * crack.cover - 2.5e-3 * bare
    return Look(color, np.clip(0.86 + 0.04 * sand - 0.05 * press + 0.05 * bare, 0, 1), 0.0, height, 1 - bare)


def plaster(at: Place) -> Look:
    """Smooth lime plaster of a room, trowelled."""
    return render(at, COATS["plaster"])


def stucco(at: Place) -> Look:
    """Lime and sand dashed on a wall and knocked down with the trowel: islands with smooth flat tops and torn rims over a
    rough ground, painted warm white, rain dirt in the low places, hair cracks."""
    flat = at.flat
    bent = warped(flat, 0.006, 0.03, 1, 3)
    shape = Spectrum(0.035, 0.0012, 0.72, (1.35, 1, 1), patch=0.3)
    dash, hidden = fbm(bent, shape, 2), lost(flat, shape)
    island, rim = exceeds(dash, 0.15, 0.10, hidden), exceeds(dash, -0.1, 0.18, hidden)
    sand = fbm(flat, Spectrum(0.005, 0.0005, 1.1, tails=0.5, skew=0.15, patch=0.4), 3)
    drag = fbm(flat, Spectrum(0.03, 0.002, 0.8, (3, 1, 1), patch=0.4), 4)
    low = np.clip(0.5 - 0.4 * dash, 0, 1) * (1 - island)
    run = masked(flat, Spectrum(0.25, 0.004, 0.8, (0.5, 2.5, 1), patch=0.4), 0.2, 5, 0.8)
    crack = cracks(flat, 0.3, 0.0008, 0.12, 6, 1, 0.06)
    color = palette(0.5 + 0.10 * drag + 0.08 * sand, "#d3c9b8", "#e0d8c9", "#eae4d8")
    color = shade(color, 0.10 * sand * (1 - 0.6 * island) + 0.05 * island - 0.28 * low - 0.14 * (rim - island))
    color = mix(color, palette(0.5 + 0.2 * sand, "#8d8271", "#aca08d"), 0.35 * run * (0.35 + low))
    color = tint(shade(color, -0.5 * crack.cover), 0.03 * noise(flat, 0.25, 7) + 0.05 * low)
    height = 0.0016 * island + 8e-4 * rim + 3e-4 * sand * (1 - 0.8 * island) + 1.5e-4 * drag - 5e-4 * crack.cover - 0.0012
    return Look(color, np.clip(0.9 + 0.03 * sand - 0.06 * island, 0, 1), 0.0, height)


def whitewash(at: Place) -> Look:
    """Coats of lime brushed on an uneven wall, flaking off the mud beneath."""
    return render(at, COATS["whitewash"])


def adobe(at: Place) -> Look:
    """Mud and chopped straw, smeared by hand and dried: straws catch the light, shrinkage cracks, small stones."""
    flat = at.flat
    smear = fbm(warped(flat, 0.03, 0.2, 1, 3), Spectrum(0.22, 0.003, 0.8, (1.8, 1, 1), patch=0.4), 2)
    straw = [marks(at, 0.045, 0.0022, 3, 0.2, 2 * np.pi, 3 + k, 0.7, 0.3) for k in range(2)]
    on, tone = np.maximum(straw[0].cover, straw[1].cover), np.where(straw[0].cover > 0, straw[0].random(1), straw[1].random(1))
    crack = cracks(flat, 0.14, 0.0025, 0.35, 5, 1, 0.07)
    stone = spots(warped(flat, 0.001, 0.006, 6), 0.03, (0.001, 0.005), 0.4, 7)
    pebble = stone.cover
    grit = fbm(flat, Spectrum(0.006, 0.0006, 1.05, tails=0.4, skew=-0.15, patch=0.4), 8)
    color = palette(0.5 + 0.17 * smear, "#8a6848", "#a17c57", "#b6916a", "#c5a480")
    color = shade(color, 0.10 * grit - 0.3 * np.exp(-crack.near / 0.004) * (crack.near < 0.02))
    color = mix(color, each(stone.cells.random(5), 1.0, "#7d7266", "#a8957c", "#8f7b63"), 0.8 * pebble)
    color = mix(color, palette(tone, "#b08b50", "#d0ad6c", "#dfc48a"), 0.8 * on)
    color = tint(mix(color, palette(0.5 + 0.1 * grit, "#43311f", "#57412b"), 0.85 * crack.cover), 0.05 * noise(flat, 0.1, 9))
    height = 2.5e-3 * smear + 2e-4 * grit + 5e-4 * on + 0.0012 * pebble - 2.5e-3 * crack.cover
    return Look(color, np.clip(0.9 + 0.04 * grit - 0.15 * on, 0, 1), 0.0, height)


def asphalt(at: Place) -> Look:
    """Stones of several sizes in bitumen, rolled flat: tops worn grey, black between, a sealed crack, patches of oil."""
    grit = fbm(at, Spectrum(0.004, 0.0006, 1.05, tails=0.4, skew=-0.15, patch=0.4), 1)
    worn = fbm(at, Spectrum(0.5, 0.01, 0.8, patch=0.3), 2)
    crack = cracks(at, 0.7, 0.006, 0.3, 3, 2, 0.06)
    color, height = palette(0.5 + 0.15 * grit + 0.15 * worn, "#2c2c2c", "#393938", "#484745"), 1e-4 * grit
    for k, (size, share) in enumerate(((0.0045, 0.75), (0.010, 0.55))):
        stone = pebbles(warped(at, 0.04 * size, 0.6 * size, 4 + k), size, 0.16 * size, 0.45, 7 + k, 1.0)
        bare = np.clip(0.62 + 0.12 * worn + 0.5 * (stone.cells.random(1) - 0.5) * stone.shown, 0, 1)
        here = stone.cover * ((stone.cells.random(2) < share) * stone.shown + share * (1 - stone.shown))
        top = each(stone.cells.random(3), stone.shown, "#55544f", "#6d6b66", "#85827b", "#625c55", "#a09c93", "#74716b")
        color = mix(color, shade(top, 0.14 * grit + 0.3 * (stone.dome - 0.7)), here * bare)
        height = mix(height, 0.16 * size * stone.dome, here)
    oil = masked(at, Spectrum(0.3, 0.004, 0.75, patch=0.4), 0.06, 10, 0.8)
    dark = np.maximum(np.exp(-crack.near / 0.004) * (crack.near < 0.03) * 0.6, crack.cover)
    color = mix(shade(color, -0.45 * oil), palette(0.5 + 0.2 * grit, "#282828", "#303030"), 0.9 * dark)
    return Look(
        tint(color, 0.03 * noise(at, 0.2, 11)),
        np.clip(0.86 + 0.05 * grit - 0.18 * oil, 0, 1),
        0.0,
        height - 6e-3 * crack.cover - 7e-4,
    )


LOOKS = {
    "concrete": concrete, "cement": cement, "plaster": plaster, "stucco": stucco, "whitewash": whitewash, "adobe": adobe,
    "asphalt": asphalt,
}  # fmt: skip
METRES = {
    "concrete": 2.4, "cement": 1.2, "plaster": 1.2, "stucco": 0.8, "whitewash": 1.5, "adobe": 0.7, "asphalt": 0.6,
}  # fmt: skip
