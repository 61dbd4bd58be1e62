"""Metals: rolled, brushed, cast, hammered, machined; scratched, smudged, tarnished and galvanised."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from stages.material.look import Look, Substance, mix, palette, shade, tint
from stages.material.patterns import (
    PEBBLES,
    Array,
    Spectrum,
    cells,
    exceeds,
    fading,
    fbm,
    heap,
    line,
    lost,
    marks,
    masked,
    noise,
    spots,
    warped,
)  # fmt: skip
from stages.material.place import Place


class Metal(NamedTuple):
    """colors: normal reflectance, sRGB, darker to lighter. roughness: mean. tarnish: colours of what dulls it. dull: how
    much."""

    colors: tuple[str, ...]
    roughness: float = 0.28
    tarnish: tuple[str, ...] = ("#5b564e", "#7d766a")
    dull: float = 0.25


METALS = {
    "steel": Metal(("#b8babd", "#c6c8c9", "#d2d3d3")),
    "iron": Metal(("#8f8f90", "#a6a7a8", "#bcbdbe"), 0.45, ("#4a3a30", "#6a5444"), 0.45),
    "aluminium": Metal(("#dfe1e3", "#eceded", "#f5f6f6"), 0.3, ("#a9abad", "#c3c5c6"), 0.15),
    "gold": Metal(("#f2cf80", "#ffdf94", "#ffe8ae"), 0.2, ("#b98a3c", "#cfa04e"), 0.12),
    "silver": Metal(("#ece8e0", "#f7f4ee", "#fcfaf5"), 0.18, ("#5d5348", "#93897a"), 0.22),
    "copper": Metal(("#e8a98e", "#f4bfa6", "#fad1c2"), 0.25, ("#6b3a26", "#a05a3c"), 0.4),
    "brass": Metal(("#d9bc74", "#ecd28a", "#f4e2ae"), 0.25, ("#7a5c28", "#a27e3e"), 0.3),
    "bronze": Metal(("#b08050", "#cc9a66", "#d9a877"), 0.35, ("#4a3722", "#6c5232"), 0.5),
    "titanium": Metal(("#aaa29a", "#bab2a9", "#c6beb6"), 0.35, ("#8a8078", "#a0968c"), 0.15),
    "lead": Metal(("#7f8088", "#9a9ba2", "#b5b5ba"), 0.55, ("#5c5e62", "#84868a"), 0.5),
    "gunmetal": Metal(("#4d5056", "#5f6268", "#6e7176"), 0.35, ("#2e2f32", "#45474b"), 0.3),
}


def worked(at: Place, kind: Metal, roughness: float, height: Array | float, fine: Array) -> Look:
    """Any metal surface: its colour, handling that dulls it in patches, hairline scratches, on a given finish.

    Args: roughness: mean of the finish. height: of it, metres. fine: (P,) its finest structure, deviation 1.
    """
    flat = at.flat
    handled = fbm(warped(at, 0.01, 0.05, 41), Spectrum(0.12, 0.001, 0.8, patch=0.4), 42)
    spotted = masked(at, Spectrum(0.03, 0.0008, 0.9, patch=0.5), 0.12, 43, 0.4)
    scratch = marks(flat, 0.06, 0.00025, 3, 0.4, 6.2, 44, 0.8, 0.03)
    scored = scratch.cover * (0.4 + 0.6 * scratch.random(1))
    dull = np.clip(kind.dull * (0.5 + 0.45 * handled + 0.9 * spotted), 0, 1)
    color = palette(0.5 + 0.22 * fine + 0.12 * handled, *kind.colors)
    color = mix(color, palette(0.5 + 0.3 * fine, *kind.tarnish), 0.3 * dull)
    color = tint(shade(color, 0.03 * fine - 0.12 * dull + 0.1 * scored), 0.015 * noise(at, 0.04, 45))
    rough = roughness * (1 + 0.10 * fine + 0.18 * handled) + 0.22 * dull + 0.1 * scored
    return Look(color, np.clip(rough, 0.02, 1), 1.0 - 0.25 * np.clip(dull - 0.5, 0, 1), height - 4e-6 * scored)


def rolled(at: Place, kind: Metal) -> Look:
    """Plain sheet: faint rolling lines, handling, a few scratches."""
    lines = fbm(at.flat, Spectrum(0.004, 0.0003, 1.0, (30, 1, 1), tails=0.3, patch=0.3), 1)
    grain = fbm(at, Spectrum(0.003, 0.0003, 1.1, tails=0.3), 2)
    fine = 0.6 * lines + 0.8 * grain
    return worked(at, kind, kind.roughness, 1e-6 * fine, fine)


def brushed(at: Place, kind: Metal) -> Look:
    """Fine parallel grooves of all lengths, drawn along the first direction of the surface."""
    flat = at.flat
    long = fbm(flat, Spectrum(0.004, 0.00025, 1.1, (160, 1, 1), tails=0.4, patch=0.3), 1)
    short = fbm(flat, Spectrum(0.002, 0.00025, 1.1, (40, 1, 1), tails=0.5, skew=-0.2), 2)
    fine = 0.75 * long + 0.65 * short
    look = worked(at, kind, 0.34, 3e-6 * fine, fine)
    return look._replace(color=shade(look.color, 0.05 * fine))


def polished(at: Place, kind: Metal) -> Look:
    """A mirror with wipe marks, fingerprints and hairlines."""
    flat = at.flat
    wiped = fbm(warped(flat, 0.01, 0.06, 1), Spectrum(0.05, 0.0006, 0.8, (4, 1, 1), patch=0.5), 2)
    hair = marks(flat, 0.04, 0.00012, 4, 0.0, 6.2, 3, 0.8, 0.06).cover
    dust = spots(at, 0.006, (0.0001, 0.0005), 0.4, 4).cover
    fine = fbm(at, Spectrum(0.002, 0.0003, 1.1, tails=0.5, skew=-0.2, patch=0.7), 5)
    color = palette(0.6 + 0.1 * wiped + 0.15 * fine, *kind.colors)
    color = shade(color, 0.015 * fine - 0.35 * dust - 0.03 * np.clip(wiped, 0, 3) - 0.05 * hair)
    rough = 0.06 + 0.03 * np.clip(wiped, -1.2, 3) + 0.008 * fine + 0.12 * hair + 0.3 * dust
    return Look(color, np.clip(rough, 0.01, 1), 1.0 - 0.6 * dust, -1e-6 * hair + 1e-5 * dust)


def cast(at: Place, kind: Metal) -> Look:
    """Sand-cast skin: pebbly, pitted, dark in the hollows, rubbed on the heights."""
    pebble = fbm(warped(at, 0.0008, 0.003, 1), Spectrum(0.006, 0.0005, 0.95, tails=0.3, skew=0.15, patch=0.4), 2)
    pits = spots(warped(at, 0.0006, 0.002, 3), 0.008, (0.0004, 0.0016), 0.45, 4).cover
    fine = 0.85 * pebble - 0.8 * pits
    look = worked(at, kind._replace(dull=kind.dull + 0.15), 0.48, 9e-5 * pebble - 3e-4 * pits, fine)
    return look._replace(color=shade(look.color, 0.16 * np.clip(pebble, -2, 1.5) - 0.5 * pits))


BLOWS = PEBBLES._replace(radius=0.95, vary=0.25, sharp=0.0, rounding=1.0, slope=0.7, thick=0.66, lift=0.2, tilt=0.1)
"""Round dents, upside down: a heap of balls."""


def hammered(at: Place, kind: Metal) -> Look:
    """Round dents side by side, each a shallow bowl that cut into those before it, a ridge where two meet."""
    dent = heap(at, 0.017, BLOWS, 2)
    depth = dent.height / np.float32(0.017)
    bowl = (0.62 - depth) * dent.shown
    ridge = np.clip(dent.nook - 0.3, 0, 1) * dent.shown
    fine = fbm(at, Spectrum(0.003, 0.0003, 1.1, tails=0.4, patch=0.3), 3)
    struck = (dent.random(3) - 0.5) * dent.shown
    look = worked(at, kind, 0.2, 1.9e-3 * bowl + 4e-6 * fine, 0.5 * fine + 0.9 * bowl)
    rough = np.clip(np.asarray(look.roughness) + 0.08 * struck - 0.06 * ridge, 0.02, 1)
    return look._replace(color=shade(look.color, 0.30 * bowl + 0.10 * ridge + 0.10 * struck), roughness=rough)


def machined(at: Place, kind: Metal) -> Look:
    """Turned or milled: overlapping arcs of the tool at an even feed."""
    u, v = at.flat.p[0], at.flat.p[1]
    pitch = 0.0012 if not at.period[1] else at.period[1] / max(1, round(at.period[1] / 0.0012))
    bend = 0.06 * (u - np.float32(at.period[0] / 2)) ** 2 if not at.period[0] else 0 * u
    phase = (v + bend) / np.float32(pitch)
    groove = 0.5 + (abs(phase - np.floor(phase) - 0.5) * 2 - 0.5) * fading(0.55 * pitch, at.footprint)
    each = fbm(at.flat, Spectrum(0.003, 0.0004, 1.0, (60, 1, 1), tails=0.3), 1)
    fine = 1.1 * (groove - 0.5) + 0.7 * each
    look = worked(at, kind, 0.3, 6e-6 * fine, fine)
    return look._replace(color=shade(look.color, 0.07 * fine))


def galvanised(at: Place, kind: Metal = METALS["aluminium"]) -> Look:
    """Zinc spangle: flat crystals some centimetres wide, each with its own sheen and fern-like growth."""
    spangle = cells(warped(at, 0.0009, 0.006, 1, 3), 0.022, 2, 1.0)
    show = fading(0.02, at.footprint)
    own = spangle.random(1) - 0.5
    angle = spangle.random(2) * np.float32(6.2832)
    along = spangle.offset[0] * np.cos(angle) + spangle.offset[1] * np.sin(angle)
    fern = fbm(at.moved(np.stack([along, along, 0 * along])), Spectrum(0.004, 0.0005, 0.9, patch=0.4), 3)
    fine = fbm(at, Spectrum(0.002, 0.0003, 1.15, tails=0.3), 4)
    bloom = masked(at, Spectrum(0.1, 0.001, 0.9, patch=0.5), 0.04, 5, 0.3)
    color = palette(0.5 + 1.0 * own * show + 0.12 * fern + 0.06 * fine, "#8e9499", "#a9afb3", "#bfc5c8", "#d3d8da")
    color = mix(shade(color, 0.05 * fine), palette(fine, "#d9dcdc", "#e6e8e8"), 0.5 * bloom)
    rough = 0.38 - 0.24 * own * show + 0.05 * fern + 0.03 * fine + 0.25 * bloom
    return Look(color, np.clip(rough, 0.1, 1), 1.0 - 0.7 * bloom, 2e-5 * own * show + 4e-6 * fern)


def foil(at: Place, kind: Metal) -> Look:
    """Thin leaf, crumpled and smoothed: flat facets between sharp creases, at two scales."""
    wide, small = cells(warped(at, 0.004, 0.03, 1), 0.03, 2), cells(warped(at, 0.002, 0.012, 3), 0.009, 4)
    tilt = (wide.random(1) - 0.5) * wide.offset[0] + (wide.random(2) - 0.5) * wide.offset[1]
    tilt_small = (small.random(1) - 0.5) * small.offset[0] + (small.random(2) - 0.5) * small.offset[1]
    crease = line(wide.border, 0.0002, at.footprint) + 0.6 * line(small.border, 0.00012, at.footprint)
    fine = fbm(at, Spectrum(0.002, 0.0003, 1.1, tails=0.4), 5)
    color = palette(0.6 + 30 * tilt + 60 * tilt_small + 0.1 * fine, *kind.colors)
    rough = 0.2 + 0.08 * fine * 0.3 + 0.12 * np.clip(crease, 0, 1) + 0.12 * (small.random(3) - 0.5)
    return Look(shade(color, 0.02 * fine - 0.12 * np.clip(crease, 0, 1)), np.clip(rough, 0.03, 1), 1.0,
                0.03 * tilt + 0.03 * tilt_small - 1e-5 * np.clip(crease, 0, 1))  # fmt: skip


def tarnished(at: Place, kind: Metal) -> Look:
    """Under a film of its own oxide: thick and dark where it gathers, thin and bright where hands have been."""
    film = fbm(warped(at, 0.02, 0.09, 1), Spectrum(0.2, 0.0006, 0.82, tails=0.2, patch=0.5), 2)
    grain = fbm(at, Spectrum(0.003, 0.0003, 1.1, tails=0.4, patch=0.3), 3)
    wiped = masked(warped(at.flat, 0.02, 0.1, 4), Spectrum(0.09, 0.0008, 0.85, (2, 1, 1), patch=0.4), 0.2, 5, 0.35)
    specks = spots(warped(at, 0.001, 0.004, 6), 0.007, (0.0003, 0.0014), 0.35, 7).cover
    thick = np.clip(0.56 + 0.17 * film + 0.06 * grain - 0.42 * wiped + 0.25 * specks, 0, 1)
    dark, light = kind.tarnish
    color = palette(1 - thick, "#1f1712", dark, light, kind.colors[0], kind.colors[-1])
    rough = np.clip(0.2 + 0.34 * thick + 0.05 * grain + 0.1 * specks, 0.05, 1)
    return Look(shade(color, 0.05 * grain), rough, 1.0 - 0.2 * thick, 8e-6 * grain + 1.5e-5 * thick)


def layered(at: Place, kind: Metal = METALS["steel"]) -> Look:
    """Pattern-welded steel, folded, ground and etched: contours of its layers, the softer ones eaten dark."""
    bent = warped(at, 0.004, 0.03, 1)
    depth = 0.013 * fbm(bent, Spectrum(0.075, 0.03, 0.8), 2) + 0.0022 * fbm(bent, Spectrum(0.016, 0.004, 0.9), 3)
    folds = Place(np.stack([depth, 0 * depth, 0 * depth]).astype(np.float32), at.uv, at.face, at.footprint, seed=at.seed)
    sheets = Spectrum(0.0042, 0.0007, 0.75, tails=0.1)
    hard = exceeds(fbm(folds, sheets, 4), 0.0, 0.35, lost(folds, sheets))
    grain = fbm(at, Spectrum(0.002, 0.0003, 1.1, tails=0.3, patch=0.3), 5)
    color = mix(palette(0.5 + 0.3 * grain, "#45484c", "#5a5d61"), palette(0.5 + 0.2 * grain, *kind.colors), hard)
    look = worked(at, kind, 0.3, 1.2e-5 * hard + 2e-6 * grain, 0.4 * grain)
    rough = np.clip(np.asarray(look.roughness) + 0.14 - 0.2 * hard, 0.05, 1)
    return look._replace(color=shade(color, 0.05 * grain), roughness=rough)


TEMPER = ("#cfc6b4", "#dcb56a", "#b36a3c", "#7a4468", "#4a4a98", "#4a7cae", "#8fb4bc")
"""Of steel and titanium under an oxide that grows thicker: straw, brown, purple, blue."""
SHEEN = ("#14161c", "#1c3a44", "#245038", "#5a5a2a", "#64402e", "#5a2a4a", "#34306a", "#1a2646", "#14161c")
"""Of a thin film on black, as it grows thicker."""


def tempered(at: Place, colors: tuple[str, ...] = TEMPER, turns: float = 0.22) -> Look:
    """Metal under a film that interferes with light: its colours follow how hot it was, or how thick the film lies."""
    film = fbm(warped(at, 0.01, 0.06, 1), Spectrum(0.2, 0.0025, 0.45, patch=0.2), 2)
    grain = fbm(at.flat, Spectrum(0.003, 0.0003, 1.1, (12, 1, 1), tails=0.3), 3)
    fine = fbm(at, Spectrum(0.0024, 0.0003, 1.2, tails=0.3, patch=0.3), 4)
    thick = 0.5 + turns * film + 0.03 * grain
    look = worked(at, METALS["titanium"], 0.24, 1e-6 * grain, 0.5 * grain)
    return look._replace(color=shade(palette(thick, *colors), 0.09 * grain + 0.05 * fine))


CAST_IRON = METALS["iron"]._replace(colors=("#58595c", "#6c6d70", "#818284"), tarnish=("#33302e", "#4b443e"), dull=0.55)

FINISHES: dict[str, Callable[..., Look]] = {
    "": rolled, "brushed": brushed, "polished": polished, "cast": cast, "hammered": hammered, "machined": machined,
}  # fmt: skip

LOOKS: dict[str, Substance] = {
    f"{finish} {metal}".strip(): partial(make, kind=kind) for metal, kind in METALS.items() for finish, make in FINISHES.items()
}
LOOKS |= {
    **{f"tarnished {metal}": partial(tarnished, kind=METALS[metal]) for metal in ("copper", "brass", "silver")},
    "cast iron": partial(cast, kind=CAST_IRON), "galvanised steel": galvanised,
    "chrome": partial(polished, kind=METALS["steel"]),
    "damascus steel": layered, "heat tint": tempered, "iridescent": partial(tempered, colors=SHEEN, turns=0.3),
    "gold leaf": partial(foil, kind=METALS["gold"]), "foil": partial(foil, kind=METALS["aluminium"]),
}  # fmt: skip
METRES = dict.fromkeys(LOOKS, 0.35)
