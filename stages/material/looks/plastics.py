"""Plastics, rubber, paint, lacquer, glass and wax: what is poured, moulded or sprayed."""

import numpy as np

from stages.material.look import Look, averaged, mix, palette, shade, tint
from stages.material.patterns import (
    STONES,
    Array,
    Spectrum,
    cells,
    fading,
    fbm,
    heap,
    line,
    lost,
    marks,
    masked,
    noise,
    spots,
    threshold,
    warped,
    weave,
)  # fmt: skip
from stages.material.place import Place


def _handled(at: Place, strength: float = 1.0) -> tuple[Array, Array]:
    """Scuffs, (P,) 0 … 1, and grease or wear in patches, (P,) deviation about 1: what hands do to a smooth thing."""
    flat = at.flat
    long = marks(flat, 0.05, 0.0003, 3, 0.3, 6.2, 61, 0.8, 0.05)
    short = marks(flat, 0.012, 0.0002, 2, 1.9, 6.2, 62, 0.6, 0.02)
    worn = fbm(warped(at, 0.012, 0.06, 63), Spectrum(0.1, 0.0012, 0.75, patch=0.5), 64)
    scuffs = np.maximum(long.cover * long.random(1), short.cover * short.random(1) * (worn > 0.3))
    return np.clip(strength * scuffs, 0, 1), worn


def glossy_plastic(at: Place) -> Look:
    """Injection-moulded, polished tool: flow shimmer, hairline scratches, dust."""
    scuffs, worn = _handled(at, 0.7)
    dust = spots(at, 0.004, (0.00008, 0.0004), 0.5, 1).cover
    flow = fbm(warped(at, 0.02, 0.08, 2), Spectrum(0.06, 0.002, 0.7, (1, 3, 1)), 3)
    fine = fbm(at, Spectrum(0.0015, 0.0002, 1.1, tails=0.5), 4)
    color = palette(0.5 + 0.12 * flow + 0.1 * fine, "#c8c8c8", "#d6d6d6")
    color = shade(color, 0.012 * fine + 0.10 * scuffs + 0.16 * dust)
    rough = 0.14 + 0.035 * np.clip(worn, -1, 3) + 0.012 * fine + 0.25 * scuffs + 0.35 * dust
    return Look(color, np.clip(rough, 0.02, 1), 0.0, 2e-6 * fine + 1e-5 * flow - 6e-6 * scuffs + 2e-5 * dust)


def plastic(at: Place) -> Look:
    """Fine spark-eroded grain, dark in its valleys, shiny where it is rubbed, whitish scuffs."""
    grain = cells(warped(at, 0.0002, 0.0012, 1), 0.0009, 2, 1.0)
    show = fading(0.0009, at.footprint)
    bump = (np.clip(grain.border / grain.size, 0, 0.4) - 0.15) * show
    fine = fbm(at, Spectrum(0.0012, 0.0002, 1.1, tails=0.4, skew=0.2, patch=0.4), 3)
    scuffs, worn = _handled(at)
    color = palette(0.5 + 0.1 * fine + 0.15 * noise(at, 0.08, 4), "#c9c9c9", "#d8d8d8")
    dirt = np.clip(0.35 * scuffs - 0.1 * worn * scuffs, 0, 1)  # what a scuff holds of what rubbed it
    color = shade(color, 0.035 * fine + 0.2 * bump - dirt - 0.03 * worn)
    rough = 0.42 + 0.05 * fine - 0.35 * bump - 0.05 * np.clip(worn, -1, 2.5) + 0.12 * scuffs
    return Look(color, np.clip(rough, 0.05, 1), 0.0, 4e-5 * bump + 8e-6 * fine - 1e-5 * scuffs)


def rubber(at: Place) -> Look:
    """Matt, slightly porous, bloomed grey in patches, scuffed and cracked by age."""
    fine = fbm(at, Spectrum(0.002, 0.0002, 1.15, tails=0.5, skew=0.2, patch=0.4), 1)
    pores = spots(at, 0.0035, (0.0001, 0.0005), 0.5, 2).cover
    bloom = masked(warped(at, 0.01, 0.05, 3), Spectrum(0.08, 0.0012, 0.85, patch=0.5), 0.25, 4, 0.5)
    scuffs, worn = _handled(at)
    perish = cells(warped(at, 0.004, 0.015, 5), 0.02, 6)
    crack = line(perish.border, 0.00012, at.footprint) * (perish.random(1) < 0.3) * (worn > 0.4)
    color = palette(0.5 + 0.15 * fine + 0.12 * worn, "#1b1b1c", "#262627", "#323233")
    color = shade(color, 0.12 * fine - 0.5 * pores - 0.6 * crack + 0.35 * bloom + 0.6 * scuffs)
    rough = 0.74 + 0.06 * fine + 0.12 * bloom - 0.06 * np.clip(worn, -1, 2) + 0.1 * pores
    return Look(tint(color, 0.03 * bloom), np.clip(rough, 0.2, 1), 0.0, 2e-5 * fine - 1e-4 * pores - 1.5e-4 * crack)


def foam(at: Place) -> Look:
    """Expanded beads pressed together, each a round facet, dark in the gaps."""
    bead = cells(warped(at, 0.0004, 0.003, 1), 0.004, 2, 0.75)
    show = fading(0.004, at.footprint)
    gap = line(bead.border, 0.00022 + 0.0003 * (bead.random(1) < 0.12), at.footprint)
    fine = fbm(at, Spectrum(0.0012, 0.0002, 1.1, tails=0.4), 3)
    dome = np.clip(1 - (bead.near / (0.62 * bead.size)) ** 2, 0, 1)
    color = palette(0.6 + 0.5 * (bead.random(2) - 0.5) * show + 0.08 * fine, "#dcdad4", "#ebe9e4", "#f3f1ec")
    color = shade(color, 0.05 * fine - 0.45 * gap + 0.1 * (dome - 0.55) * show)
    return Look(color, 0.9 + 0.05 * fine - 0.06 * dome * show, 0.0, (2.2e-4 * dome - 2e-4 * gap) * show + 1e-5 * fine)


def paint(at: Place) -> Look:
    """Sprayed or rolled enamel on metal: orange peel, dust nibs, thin chips at random, runs of dirt."""
    peel = fbm(at, Spectrum(0.0035, 0.0012, 0.7), 1)
    fine = fbm(at, Spectrum(0.0015, 0.0002, 1.1, tails=0.4), 2)
    scuffs, worn = _handled(at, 0.8)
    nibs = spots(at, 0.012, (0.00015, 0.0005), 0.35, 3).cover
    grime = masked(warped(at, 0.01, 0.06, 4), Spectrum(0.12, 0.001, 0.85, patch=0.5), 0.15, 5, 0.5)
    color = palette(0.5 + 0.2 * worn + 0.08 * fine, "#c4c4c4", "#d0d0d0", "#dadada")
    color = shade(color, 0.03 * fine + 0.05 * peel + 0.12 * scuffs - 0.16 * grime - 0.1 * nibs)
    rough = 0.3 + 0.03 * fine + 0.04 * np.clip(worn, -1, 3) + 0.2 * scuffs + 0.2 * grime
    return Look(color, np.clip(rough, 0.03, 1), 0.0, 1.2e-5 * peel + 3e-6 * fine + 4e-5 * nibs - 8e-6 * scuffs)


def car_paint(at: Place) -> Look:
    """Clear coat over an even red base: deep gloss, faint orange peel, swirls of washing, flakes that glint, a stone chip."""
    flakes = Spectrum(0.0008, 0.0003, 1.0, tails=0.7, skew=0.3)
    flake = fbm(at, flakes, 1)
    peel = fbm(at, Spectrum(0.006, 0.002, 0.6), 2)
    swirl = marks(at.flat, 0.06, 0.00012, 4, 0.0, 6.2, 3, 0.7, 0.35)
    dust = spots(at, 0.009, (0.0001, 0.0003), 0.25, 5).cover
    chip = spots(warped(at, 0.0003, 0.002, 6), 0.11, (0.0004, 0.0018), 0.25, 7)
    color = averaged(0.42 + 0.13 * flake, 0.15 * lost(at, flakes), "#6e0d13", "#8a131b", "#a81d26", "#d06666", "#f0b0ac")
    color = shade(color, 0.03 * swirl.cover + 0.15 * dust)
    core = threshold(chip.inside, 0.0004, np.maximum(0.0002, 0.5 * at.footprint))
    color = mix(color, palette(0.5 + 0.3 * flake, "#8f9295", "#c9cbcc"), chip.cover)
    color = mix(color, palette(0.5 + 0.3 * flake, "#4b4f52", "#6d7072"), core)
    rough = 0.05 + 0.04 * swirl.cover * swirl.random(1) + 0.2 * dust + 0.4 * chip.cover
    height = 1.4e-5 * peel + 1e-5 * dust - 8e-5 * chip.cover
    return Look(color, np.clip(rough, 0.01, 1), 0.0, height, 1 - chip.cover)


def painted_wood(at: Place) -> Look:
    """Brushed gloss over boards' grain: strokes of the brush, grain telegraphing through, hairline cracks along it."""
    flat = at.flat
    stroke = fbm(flat, Spectrum(0.006, 0.0004, 0.95, (1, 40, 1), tails=0.3, patch=0.3), 1)
    grain = fbm(flat, Spectrum(0.02, 0.0008, 0.8, (1, 18, 1), skew=-0.2), 2)
    crack = masked(flat, Spectrum(0.012, 0.0004, 0.8, (0.12, 6, 1)), 0.035, 3, 0.05)
    scuffs, worn = _handled(at)
    grime = masked(at, Spectrum(0.08, 0.0008, 0.9, patch=0.5), 0.15, 4, 0.5)
    color = palette(0.5 + 0.15 * worn + 0.1 * stroke, "#c6c4c0", "#d2d0cc", "#dcdad6")
    color = tint(shade(color, 0.05 * stroke + 0.05 * grain - 1.1 * crack - 0.18 * grime + 0.08 * scuffs), 0.03 * worn)
    rough = 0.5 + 0.05 * stroke + 0.05 * grain + 0.3 * crack + 0.12 * grime
    return Look(color, np.clip(rough, 0.05, 1), 0.0, 1.5e-5 * stroke + 3e-5 * grain - 2.5e-4 * crack)


def glass(at: Place) -> Look:
    """Opaque to the eye of this renderer: smooth, with seeds, swirls of the melt and smears."""
    melt = fbm(warped(at, 0.012, 0.08, 1), Spectrum(0.12, 0.004, 0.55), 3)
    seeds = spots(at, 0.02, (0.0002, 0.0012), 0.5, 4)
    rim = np.exp(-((seeds.inside / 0.00025) ** 2))
    smear = fbm(at.flat, Spectrum(0.03, 0.0006, 0.85, (5, 1, 1), patch=0.5), 5)
    fine = fbm(at, Spectrum(0.0015, 0.0002, 1.1, tails=0.4), 6)
    color = palette(0.5 + 0.12 * melt, "#9abfb9", "#a6c6c0", "#b0cdc8")
    color = shade(color, 0.015 * fine + 0.2 * seeds.cover - 0.25 * rim)
    rough = 0.04 + 0.02 * np.clip(smear, 0, 3) + 0.006 * fine + 0.05 * rim
    return Look(color, np.clip(rough, 0.0, 1), 0.0, 1e-5 * melt + 3e-5 * seeds.cover)


def wax(at: Place) -> Look:
    """Cast and rubbed: soft mottling of crystals, drips smoothed, finger marks, dust pressed in."""
    mottle = fbm(warped(at, 0.003, 0.02, 1), Spectrum(0.03, 0.0008, 0.8, patch=0.4), 2)
    bloom = cells(warped(at, 0.002, 0.006, 3), 0.005, 4)
    white = np.exp(-((bloom.near / 0.0016) ** 2)) * (bloom.random(1) < 0.4) * fading(0.005, at.footprint)
    fine = fbm(at, Spectrum(0.002, 0.0002, 1.1, tails=0.4, patch=0.4), 5)
    scuffs, worn = _handled(at)
    specks = spots(at, 0.01, (0.0001, 0.0004), 0.4, 6).cover
    color = palette(0.5 + 0.12 * mottle, "#dccaa4", "#e6d8b8", "#eee4ca")
    color = shade(color, 0.03 * fine + 0.05 * mottle + 0.08 * white - 0.5 * specks + 0.06 * scuffs)
    rough = 0.44 + 0.05 * mottle + 0.04 * fine + 0.1 * white + 0.12 * scuffs - 0.05 * np.clip(worn, -1, 2)
    return Look(color, np.clip(rough, 0.1, 1), 0.0, 6e-5 * mottle + 1e-5 * fine - 2e-5 * scuffs)


CARBON = ("#0d0d0e", "#1b1b1d", "#333437")


def carbon_fibre(at: Place) -> Look:
    """Twill of flat black tows under clear resin: each crossing catches the light its own way."""
    cloth = weave(at, 0.002, "twill", 0.99, 1)
    strand = fbm(at.flat, Spectrum(0.0006, 0.0001, 1.0, tails=0.3), 2)
    sheen = np.where(cloth.warp > 0.5, 0.55, -0.45)
    scuffs, worn = _handled(at, 0.5)
    lit = 0.5 + 0.6 * sheen * (1 - 0.4 * np.clip(abs(cloth.across), 0, 1)) + 0.1 * strand
    even = np.array([0.76, 0.76, 0.28], np.float32)[:, None] + 0.1 * strand  # two tows of the draft's three lie up
    color = mix(sum(palette(t, *CARBON) for t in even) / 3, palette(lit, *CARBON), cloth.seen)
    sheen = sheen * cloth.seen
    rough = 0.2 + 0.03 * np.clip(worn, -1, 3) - 0.05 * sheen + 0.2 * scuffs + 0.02 * strand
    return Look(shade(color, 0.1 * strand + 0.2 * scuffs), np.clip(rough, 0.03, 1), 0.0, 2e-5 * cloth.height * cloth.seen)


def forged_carbon(at: Place) -> Look:
    """Chopped carbon tow pressed in resin: flat chips lying every way, each striped along its own fibres."""
    chip = heap(warped(at, 0.0012, 0.01, 1), 0.011, CHIPS, 2)
    angle = chip.random(2) * np.float32(np.pi)
    u, v = at.flat.p[0], at.flat.p[1]
    across = (u * np.cos(angle) + v * np.sin(angle) + chip.random(3)).astype(np.float32)
    fibres = Place(np.stack([across, 0 * u, 0 * u]), at.uv, at.face, at.footprint, seed=at.seed)
    strand = fbm(fibres, Spectrum(0.0012, 0.00025, 0.7, tails=0.3), 3)
    sheen = (chip.random(1) - 0.5) * chip.shown
    scuffs, worn = _handled(at, 0.5)
    color = averaged(0.42 + 1.5 * sheen + 0.22 * strand, 0.43 * (1 - chip.shown), *CARBON)
    rough = 0.2 + 0.03 * np.clip(worn, -1, 3) - 0.12 * sheen + 0.2 * scuffs + 0.02 * strand
    return Look(shade(color, 0.1 * strand + 0.2 * scuffs), np.clip(rough, 0.03, 1), 0.0, 8e-6 * sheen)


CHIPS = STONES._replace(radius=0.95, vary=0.5, sharp=0.7, thick=0.1, tilt=0.02)
"""Flat chips of all sizes."""

LOOKS = {
    "glossy plastic": glossy_plastic, "plastic": plastic, "rubber": rubber, "foam": foam, "paint": paint,
    "car paint": car_paint, "painted wood": painted_wood, "glass": glass, "wax": wax, "carbon fibre": carbon_fibre,
    "forged carbon": forged_carbon,
}  # fmt: skip
METRES = {"glossy plastic": 0.2, "plastic": 0.2, "rubber": 0.25, "foam": 0.35, "paint": 0.4, "car paint": 0.35,
          "painted wood": 0.4, "glass": 0.3, "wax": 0.2, "carbon fibre": 0.2, "forged carbon": 0.2}  # fmt: skip
