"""Leathers and hides: pebbled grain with furrows, pores and creases, nap, varnish, wear, scales and plates."""

from typing import NamedTuple

import numpy as np

from stages.material.look import Look, averaged, mix, palette, shade, tint
from stages.material.patterns import (
    Spectrum,
    cracks,
    fading,
    fbm,
    lost,
    marks,
    masked,
    noise,
    pebbles,
    repeats,
    scales,
    spots,
    threshold,
    tiles,
    warped,
)
from stages.material.place import Place


class Hide(NamedTuple):
    """colors: from the furrows to the backs of the grain, sRGB. grain: size of a pebble, metres. depth: of the furrows, metres.
    crease: share of creases that are open. pull: how much paler the backs are. roughness: mean; polish: less on the backs."""

    colors: tuple[str, ...] = ("#3f2415", "#5a3520", "#74482c", "#8c5c3a")
    grain: float = 0.0017
    depth: float = 1.4e-4
    crease: float = 0.22
    pull: float = 0.5
    roughness: float = 0.5
    polish: float = 0.14


def hide(at: Place, kind: Hide) -> Look:
    """Skin tanned with its grain: pebbles of many sizes, furrows that run together into creases, pores in the furrows."""
    size = kind.grain
    stretch = warped(at, 0.9 * size, 16 * size, 1, 2)  # the animal's skin was pulled more here than there
    bent = warped(stretch, 0.10 * size, 0.7 * size, 2, 3)
    pebble, small = pebbles(bent, size, 0.10 * size, 0.2, 3, 1.0), pebbles(bent, 0.5 * size, 0.05 * size, 0.3, 4, 1.0)
    crease = cracks(stretch, 12 * size, 0.28 * size, kind.crease, 5, 2, 0.1)
    pore = spots(bent, 1.5 * size, (0.03 * size, 0.10 * size), 0.6, 6).cover
    bump = 0.7 * (pebble.dome - 0.75) + 0.35 * (small.dome - 0.75)
    tone = fbm(warped(at, 0.01, 0.08, 7), Spectrum(0.14, 0.002, 0.85, tails=0.2, patch=0.5), 8)
    fine = fbm(at, Spectrum(0.4 * size, 0.06 * size, 1.0, tails=0.4, skew=-0.15, patch=0.4), 9)
    own = (pebble.cells.random(1) - 0.5) * pebble.shown
    sunk = np.clip(crease.cover + 0.7 * pore, 0, 1)
    color = palette(0.5 + kind.pull * bump + 0.10 * tone + 0.14 * own + 0.07 * fine, *kind.colors)
    color = tint(shade(color, 0.32 * bump + 0.05 * fine - 0.75 * sunk), 0.04 * own + 0.04 * noise(at, 0.05, 10))
    height = kind.depth * (bump + 0.3 * own + 0.06 * fine - 0.7 * sunk) + 1e-4 * tone
    rough = kind.roughness - kind.polish * bump + 0.05 * fine + 0.03 * tone + 0.2 * sunk
    return Look(color, np.clip(rough, 0.05, 1), 0.0, height)


def leather(at: Place) -> Look:
    """Brown cowhide."""
    return hide(at, Hide())


def worn_leather(at: Place) -> Look:
    """An old club chair: finish rubbed off the backs, cracked and scuffed where it was sat on, dark with grease elsewhere."""
    skin = hide(at, Hide(("#2f1c12", "#4c2e1c", "#6a4429", "#84593a"), 0.0019, 1.6e-4, 0.42, 0.4, 0.52))
    use = fbm(warped(at, 0.012, 0.08, 11, 3), Spectrum(0.12, 0.0012, 0.85, tails=0.2, patch=0.5), 12)
    grit = fbm(at, Spectrum(0.002, 0.0002, 1.05, tails=0.5, skew=0.15, patch=0.5), 13)
    back = skin.height / 1.6e-4
    rubbed = threshold(use + 0.8 * back + 0.45 * grit, 0.95, 0.7)
    split = cracks(warped(at, 0.004, 0.02, 14, 2), 0.012, 0.0005, 0.3, 15, 3, 0.09)
    torn = split.cover * np.clip(0.6 + 0.7 * use, 0, 1)
    scuff = marks(at, 0.035, 0.0007, 3, 0.4, 6.28, 16, 0.8, 0.2)
    bare = np.clip(0.75 * rubbed + 0.5 * scuff.cover * (scuff.random(1) < 0.6), 0, 1)
    color = mix(skin.color, palette(0.5 + 0.16 * grit + 0.1 * back, "#704a2f", "#8d6443", "#a9805a"), 0.85 * bare)
    color = mix(shade(color, 0.06 * grit), palette(0.5 + 0.2 * grit, "#6d4c33", "#9a7753", "#20130c"), 0.75 * torn)
    rough = np.asarray(skin.roughness) + 0.25 * bare + 0.2 * torn
    return Look(color, np.clip(rough, 0, 1), 0.0, skin.height - 2e-5 * bare - 1.2e-4 * torn)


def patent_leather(at: Place) -> Look:
    """Black leather under a thick lacquer: a mirror over a faint swell of grain, hairline scratches, dust."""
    swell = fbm(warped(at, 0.004, 0.03, 1, 2), Spectrum(0.02, 0.004, 0.7), 2)
    pebble = pebbles(warped(at, 0.0006, 0.004, 3, 2), 0.0032, 0.0002, 0.4, 4, 1.0)
    fine = fbm(at, Spectrum(0.002, 0.00015, 1.0, tails=0.6, skew=0.2, patch=0.5), 5)
    scratch = marks(at, 0.05, 0.00016, 3, 0.3, 6.28, 6, 0.7, 0.15).cover
    dust = spots(at, 0.0032, (0.00005, 0.0003), 0.35, 7).cover
    haze = masked(at, Spectrum(0.06, 0.001, 0.85, patch=0.5), 0.3, 8, 0.8)
    color = palette(0.4 + 0.10 * swell + 0.16 * (pebble.dome - 0.75) + 0.14 * fine, "#232325", "#2a2a2c", "#323235")
    color = mix(color, palette(0.5 + 0.2 * fine, "#4b4b4e", "#6a6a6c"), np.clip(0.35 * scratch + 0.4 * dust, 0, 1))
    rough = 0.07 + 0.02 * fine + 0.10 * haze + 0.25 * scratch + 0.4 * dust
    return Look(color, np.clip(rough, 0.03, 1), 0.0, 6e-5 * swell + 1.5e-5 * (pebble.dome - 0.75) - 1e-6 * scratch)


def suede(at: Place) -> Look:
    """The flesh side buffed to a nap: short fibres that lie now one way, now another, and show every stroke of a hand."""
    bent = warped(at, 0.006, 0.04, 1, 3)
    nap = fbm(bent, Spectrum(0.06, 0.004, 0.75, (0.8, 1.2, 1), patch=0.6), 2)
    stroke = marks(at, 0.05, 0.006, 3, 0.9, 1.6, 3, 0.6, 0.3)
    swept = (stroke.random(1) - 0.5) * stroke.cover
    spectrum = Spectrum(0.0022, 0.00012, 1.0, (0.8, 1.2, 1), 0.4, 0.1, 0.3)
    fibre = fbm(at, spectrum, 5)
    pill = fbm(at, Spectrum(0.006, 0.0006, 1.0, tails=0.5, skew=-0.15, patch=0.5), 6)
    lay = 0.10 * nap + 0.22 * swept
    color = averaged(
        0.5 + lay + 0.12 * fibre + 0.05 * pill, 0.12 * lost(at, spectrum), "#6d5138", "#8a6b4d", "#a58663", "#bd9f7c"
    )
    color = tint(shade(color, 0.05 * fibre + 0.03 * pill), 0.03 * nap + 0.03 * noise(at, 0.02, 7))
    return Look(color, np.clip(0.93 + 0.03 * fibre - 0.2 * lay, 0, 1), 0.0, 2.5e-5 * fibre + 2e-5 * pill + 5e-5 * nap)


def snake(at: Place) -> Look:
    """Snakeskin: keeled scales in overlapping rows, dark saddles edged in black along a sandy back."""
    flat = at.flat
    bent = warped(flat, 0.0006, 0.03, 1, 2)
    skin = scales(Place(bent.p, bent.p[:2], at.face, at.footprint, at.period, at.seed), 0.0056, 0.0042, 2)
    middle = bent.p[:2] - (np.stack([0.0028 * skin.across, 0.0084 * skin.along - 0.003]) * skin.seen).astype(
        np.float32
    )  # a scale has one colour
    spread = [
        np.cos(np.pi * repeats(Place(bent.p, middle, at.face, at.footprint, at.period), length, axis)[0])
        for axis, length in enumerate((0.055, 0.042))
    ]
    saddle = (
        0.75 * (abs(spread[0]) ** 0.8 * np.sign(spread[0]) + spread[1])
        + 0.4 * noise(bent, 0.03, 4)
        + 0.2 * (skin.random(1) - 0.5) * skin.seen
    )
    fine = fbm(flat, Spectrum(0.0012, 0.00012, 1.0, (0.7, 1.6, 1), 0.4, -0.15, 0.4), 5)
    rim = np.exp(-np.clip(skin.rim, 0, 1) / 0.0003) * skin.seen
    shadow = np.exp(-np.clip(skin.under, 0, 1) / 0.0005) * skin.seen
    keel = np.exp(-((skin.across / 0.10) ** 2)) * skin.seen
    dark, border = threshold(saddle, 0.12, 0.1), np.exp(-(((saddle - 0.12) / 0.16) ** 2))
    tone = 0.5 + 0.25 * (skin.random(2) - 0.5) * skin.seen + 0.10 * fine
    color = mix(palette(tone, "#8d7c58", "#b3a077", "#cdbd97"), palette(tone, "#4a3820", "#6a5030", "#836843"), dark)
    color = mix(color, palette(tone, "#241d14", "#3a2f20"), 0.85 * border)
    color = shade(color, 0.22 * keel + 0.12 * rim - 0.8 * shadow + 0.06 * fine + 0.25 * (0.5 - skin.along) * skin.seen)
    lift = (1 - np.exp(-np.clip(skin.rim, 0, 1) / 0.0005) - 0.8 * skin.along + 0.25 * keel) * skin.seen
    rough = 0.42 + 0.2 * shadow - 0.08 * keel + 0.05 * fine
    return Look(
        tint(color, 0.05 * (skin.random(3) - 0.5) * skin.seen),
        np.clip(rough, 0.05, 1),
        0.0,
        3.5e-4 * (lift - 0.4) + 8e-6 * fine,
    )


def fish_scales(at: Place) -> Look:
    """Scales like a dragon's or a fish's: round, overlapping, ringed by growth, green-blue with paler rims."""
    skin = scales(at.flat, 0.014, 0.0095, 2)
    flat = at.flat
    fine = fbm(flat, Spectrum(0.003, 0.00025, 1.0, (0.8, 1.3, 1), 0.4, -0.15, 0.4), 5)
    wide = fbm(flat, Spectrum(0.12, 0.006, 0.8, patch=0.4), 6)
    ring = np.cos(2 * np.pi * (skin.rim / 0.0009 + 0.5 * skin.random(4))) * fading(0.0009, at.footprint)
    rim = np.exp(-np.clip(skin.rim, 0, 1) / 0.0007) * skin.seen
    shadow = np.exp(-np.clip(skin.under, 0, 1) / 0.0016) * skin.seen
    ray = np.cos(np.pi * 9 * skin.across) * (1 - skin.along) * fading(0.003, at.footprint)
    own = (skin.random(1) - 0.5) * skin.seen
    color = palette(
        0.5 + 0.4 * own + 0.12 * wide + 0.08 * fine - 0.25 * (skin.along - 0.45) * skin.seen,
        "#1f3d38",
        "#2f5f54",
        "#4a8370",
        "#7ba890",
    )
    color = mix(color, palette(0.5 + 0.3 * fine, "#8d9a6a", "#c2c498"), 0.55 * rim)
    color = shade(color, 0.07 * ring + 0.05 * ray + 0.06 * fine - 0.9 * shadow)
    lift = (1 - np.exp(-np.clip(skin.rim, 0, 1) / 0.001) - 0.9 * skin.along) * skin.seen
    rough = 0.3 + 0.05 * fine + 0.25 * shadow + 0.1 * rim + 0.06 * ring
    return Look(
        tint(color, 0.12 * (skin.random(2) - 0.5) * skin.seen, 0.05 * own),
        np.clip(rough, 0.05, 1),
        0.0,
        9e-4 * (lift - 0.4) + 2e-5 * ring + 2e-5 * ray,
    )


def crocodile(at: Place) -> Look:
    """Belly hide: plates in rows, nearly square, domed and glazed, wrinkled at their rims, furrows of fine skin between."""
    flat = at.flat
    bent = warped(warped(flat, 0.0035, 0.06, 11), 0.0008, 0.012, 1, 3)
    size = 0.014
    wide = fbm(flat, Spectrum(0.12, 0.006, 0.85, patch=0.4), 2)
    plate = tiles(Place(bent.p, bent.p[:2], at.face, at.footprint, at.period, at.seed), 0.021, 0.0145, "running", 3)
    shown = fading(size, at.footprint)
    sides = 0.0105 - abs(plate.x), 0.00725 - abs(plate.y)
    near = np.clip(0.0014 - np.log(sum(np.exp(-np.clip(side, 0, 0.02) / 0.0014) for side in sides)) * 0.0014 - 0.0014, 0, 1)
    dome = 0.62 + (np.sqrt(np.clip(1 - (1 - np.clip((near - 0.0006) / 0.0058, 0, 1)) ** 2, 0, 1)) - 0.62) * shown
    cover = 0.86 + (threshold(plate.border, 0.0006, np.maximum(0.0003, 0.5 * at.footprint)) - 0.86) * shown
    own = (plate.random(1) - 0.5) * shown
    wrinkle = cracks(bent, 0.006, 0.00035, 0.45, 4, 2, 0.12)
    fold = wrinkle.cover * np.clip(1.5 - 1.3 * dome, 0, 1)
    skin = pebbles(warped(flat, 0.0002, 0.001, 6, 2), 0.0013, 0.0001, 0.3, 7, 1.0)
    fine = fbm(flat, Spectrum(0.0016, 0.00015, 1.0, tails=0.4, skew=-0.15, patch=0.4), 8)
    pit = spots(bent, 0.011, (0.0002, 0.0005), 0.5, 9).cover * cover
    color = palette(
        0.5 + 0.22 * own + 0.45 * (dome - 0.6) + 0.08 * wide + 0.08 * fine, "#2f1f12", "#4b331d", "#6b4a2b", "#8a6540"
    )
    furrow = palette(0.45 + 0.5 * (skin.dome - 0.75) + 0.1 * fine, "#24180e", "#382616", "#4f3822")
    color = shade(mix(furrow, color, cover), 0.05 * fine - 0.5 * fold - 0.6 * pit)
    height = (
        7e-4 * (dome - 0.6) + 1.0e-4 * own - 1.5e-4 * fold - 1e-4 * pit + 1e-4 * (skin.dome - 0.75) * (1 - cover) + 6e-6 * fine
    )
    rough = 0.30 + 0.05 * fine + 0.25 * (1 - cover) + 0.2 * fold
    return Look(tint(color, 0.06 * own + 0.04 * noise(flat, 0.04, 10)), np.clip(rough, 0.05, 1), 0.0, height)


LOOKS = {
    "leather": leather, "worn leather": worn_leather, "patent leather": patent_leather, "suede": suede, "snakeskin": snake,
    "scales": fish_scales, "crocodile": crocodile,
}  # fmt: skip
METRES = {
    "leather": 0.09,
    "worn leather": 0.12,
    "patent leather": 0.1,
    "suede": 0.1,
    "snakeskin": 0.12,
    "scales": 0.2,
    "crocodile": 0.2,
}
