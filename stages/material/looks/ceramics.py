"""Ceramics: clay as thrown and fired, bare, under glazes that pool, crackle and run, and glass on iron."""

from typing import NamedTuple

import numpy as np

from stages.material.look import Look, averaged, mix, palette, shade, tint
from stages.material.patterns import (
    Array,
    Spectrum,
    cracks,
    exceeds,
    fading,
    fbm,
    lost,
    masked,
    noise,
    spots,
    threshold,
    warped,
)
from stages.material.place import Place

RINGS = Spectrum(0.014, 0.0035, 0.55, (16, 1, 16), patch=0.3)


def throwing(at: Place, seed: int) -> Array:
    """Rings that the potter's fingers leave around a pot, −2 … 2: uneven, in a slow spiral. Returns: (P,)."""
    return fbm(at.upright, RINGS, seed)


def porcelain(at: Place) -> Look:
    """White kaolin fired to glass under a clear glaze: a cold depth, an orange-peel shine, a speck."""
    depth = fbm(at, Spectrum(0.12, 0.004, 0.7, patch=0.3), 1)
    peel = fbm(at, Spectrum(0.006, 0.0008, 0.9), 2)
    speck = spots(warped(at, 0.0001, 0.001, 3), 0.025, (0.00008, 0.0004), 0.25, 4).cover
    grain = fbm(at, Spectrum(0.002, 0.00015, 1.1, tails=0.4, patch=0.4), 5)
    color = shade(palette(0.5 + 0.06 * depth, "#e6e7e6", "#ededea", "#f1f0ec"), 0.012 * grain + 0.004 * peel)
    color = mix(color, palette(0.5 + 0 * depth, "#8a7c6a"), 0.6 * speck)
    return Look(color, 0.08 + 0.01 * abs(peel) + 0.1 * speck, 0.0, 4e-6 * peel + 3e-6 * grain)


class Glaze(NamedTuple):
    """pool: colours from thin to thick. body: colour where it breaks over ridges. net: how dark its crackle is. mesh: size
    of the crackle, metres. run: how far it runs in streaks, 0 … 1. spots: share under crystals or oil spots, and their
    colours.
    """

    pool: tuple[str, ...]
    body: tuple[str, ...]
    net: float = 0.0
    mesh: float = 0.008
    run: float = 0.3
    spots: float = 0.0
    crystal: tuple[str, ...] = ("#8a5630", "#b07c48")


GLAZES = {
    "glazed": Glaze(("#7fb3ad", "#3f8f92", "#23707c", "#18535f"), ("#a9825a", "#8a6642"), 0.5, 0.011, 0.6),
    "celadon": Glaze(("#c3d0bd", "#a9bfa8", "#8fab95", "#7a9a86"), ("#c9c7b2", "#b9b59b"), 0.4, 0.007, 0.25),
    "tenmoku": Glaze(("#6e3d22", "#3c2620", "#2c2323", "#282426"), ("#a05c2c", "#83481f"), 0.0, 0.008, 1.0, 0.10),
}


def glaze(at: Place, kind: Glaze) -> Look:
    """Coloured glass over thrown clay: thin and pale where the rings stand up, deep where it pools, crazed as it cooled."""
    up = at.upright
    ring = throwing(at, 1)
    streaks = Spectrum(0.03, 0.001, 0.85, (1, 7, 1), patch=0.4)
    run = fbm(warped(up, 0.002, 0.02, 2), streaks, 3)
    pool = fbm(at, Spectrum(0.10, 0.006, 0.7), 4)
    thick = 0.45 - 0.10 * ring + 0.14 * pool + 0.14 * kind.run * run
    hidden = 0.10 * lost(at, RINGS) + 0.14 * kind.run * lost(at, streaks)
    breaks = exceeds(ring - 0.35 * pool + 0.25 * run, 1.8, 0.9, lost(at, RINGS))
    web = cracks(at, kind.mesh, 0.00022, 0.9, 5, 2, 0.05)
    bubble = spots(at, 0.004, (0.0001, 0.0005), 0.5, 6).cover
    fine = fbm(at, Spectrum(0.004, 0.00015, 1.1, tails=0.4, skew=-0.15, patch=0.5), 7)
    fur = Spectrum(0.004, 0.0004, 0.85, (1, 1 + 9 * kind.run, 1), patch=0.5)
    crystal = masked(warped(up, 0.0003, 0.006, 8), fur, max(kind.spots, 1e-4), 9, 0.35) * (kind.spots > 0)
    color = mix(averaged(thick, hidden, *kind.pool), palette(0.5 + 0.2 * fine, *kind.body), 0.4 * breaks)
    color = mix(color, palette(0.5 + 0.3 * fine, *kind.crystal), 0.65 * crystal)
    stain = kind.net * (web.cover + 0.3 * np.exp(-web.near / 0.0003) * fading(0.0012, at.footprint))
    color = tint(shade(color, 0.07 * fine - 0.12 * bubble - stain), 0.05 * noise(at, 0.05, 10) + 0.04 * breaks)
    roughness = 0.09 + 0.16 * breaks + 0.12 * crystal + 0.04 * (kind.net > 0) * web.cover + 0.01 * fine
    return Look(color, np.clip(roughness, 0.04, 1), 0.0, 1.6e-4 * ring + 3e-5 * pool - 4e-6 * web.cover - 1.2e-5 * bubble)


def glazed_ceramic(at: Place) -> Look:
    """Earthenware under a copper-blue glaze, crackled."""
    return glaze(at, GLAZES["glazed"])


def celadon(at: Place) -> Look:
    """Grey-green celadon with a fine crackle."""
    return glaze(at, GLAZES["celadon"])


def tenmoku(at: Place) -> Look:
    """Black iron glaze that breaks to rust on ridges, with streaks like hare's fur."""
    return glaze(at, GLAZES["tenmoku"])


def stoneware(at: Place) -> Look:
    """Oatmeal stoneware under a satin glaze: iron melts through it in brown specks, each in a halo."""
    ring = throwing(at, 1)
    bent = warped(at, 0.0002, 0.0015, 2)
    large, small = spots(bent, 0.007, (0.0004, 0.0019), 0.6, 3), spots(bent, 0.0028, (0.0002, 0.0007), 0.7, 4)
    seen = fading(0.0045, at.footprint)
    iron = np.clip(large.cover + small.cover, 0, 1)
    halo = np.exp(-np.maximum(-np.maximum(large.inside, -0.006), 0) / 0.0007) * seen
    cloud = fbm(at, Spectrum(0.09, 0.004, 0.75, patch=0.3), 5)
    fine = fbm(at, Spectrum(0.004, 0.00015, 1.1, tails=0.4, skew=-0.2, patch=0.4), 6)
    pin = spots(at, 0.012, (0.0001, 0.00035), 0.4, 7).cover
    color = palette(0.5 + 0.13 * cloud - 0.08 * ring, "#a89a84", "#bdb19b", "#cdc2ae", "#d8cfbd")
    color = mix(
        shade(color, 0.05 * fine - 0.3 * pin),
        palette(0.5 + 0.3 * fine, "#a27a52", "#b89066"),
        0.4 * halo * (large.cells.random(5) < 0.6),
    )
    color = mix(color, palette(large.cells.random(6), "#3a2518", "#5b3a22", "#7a5233"), 0.9 * iron)
    return Look(
        tint(color, 0.04 * noise(at, 0.06, 8)),
        np.clip(0.42 + 0.04 * fine - 0.14 * iron + 0.03 * cloud, 0, 1),
        0.0,
        1.6e-4 * ring + 8e-6 * fine - 5e-5 * pin,
    )


def raku(at: Place) -> Look:
    """Pulled red-hot and smoked in sawdust: white glaze in a black crackle, flushes of copper lustre, bare clay."""
    wide, fine_web = cracks(at, 0.026, 0.0009, 0.95, 1, 2, 0.06), cracks(at, 0.007, 0.00025, 0.6, 2, 1, 0.06)
    cloud = fbm(warped(at, 0.006, 0.04, 3), Spectrum(0.14, 0.002, 0.75, patch=0.4), 4)
    fine = fbm(at, Spectrum(0.003, 0.0003, 1.0, tails=0.4, skew=-0.2, patch=0.4), 5)
    shape = Spectrum(0.16, 0.0015, 0.72, patch=0.4)
    field, hidden = fbm(at, shape, 6), lost(at, shape)
    lustre = exceeds(field, 0.9, 0.25, hidden)
    bare = exceeds(-field, 1.35, 0.05, hidden)
    smoke = np.exp(-wide.near / 0.0011)
    color = palette(0.5 + 0.15 * cloud, "#cbbfae", "#ddd4c6", "#e9e3d8")
    sheen = palette(0.5 + 0.25 * cloud + 0.08 * fine, "#7a3f2a", "#a8643b", "#b98d55", "#5f7f7b", "#4d5f86")
    color = mix(color, sheen, 0.85 * lustre)
    color = shade(color, 0.035 * fine - 0.5 * smoke * fading(0.003, at.footprint))
    color = mix(color, palette(0.5 + 0.3 * fine, "#282726", "#353230"), np.clip(0.95 * wide.cover + 0.6 * fine_web.cover, 0, 1))
    color = tint(
        mix(color, palette(0.5 + 0.15 * fine + 0.1 * cloud, "#2b2927", "#3f3a36", "#524b45"), bare), 0.05 * noise(at, 0.04, 7)
    )
    metal = 0.75 * lustre * (1 - bare) * (1 - wide.cover)
    roughness = mix(0.16 + 0.02 * fine + 0.2 * wide.cover + 0.1 * lustre, 0.85 + 0.04 * fine, bare)
    return Look(color, np.clip(roughness, 0, 1), metal, 2e-5 * cloud - 5e-5 * wide.cover - 2.5e-4 * bare + 6e-6 * fine)


def terracotta(at: Place) -> Look:
    """Red clay thrown and fired bare: finger rings, dragged grog, lime specks, a bloom of salts, a flash of the kiln."""
    up = at.upright
    ring = throwing(at, 1)
    drag = fbm(up, Spectrum(0.006, 0.0006, 1.0, (5, 1, 5), tails=0.3, skew=-0.2, patch=0.5), 2)
    grit = fbm(at, Spectrum(0.005, 0.0002, 1.12, tails=0.4, skew=-0.15, patch=0.4), 3)
    grog = spots(warped(at, 0.0003, 0.002, 4), 0.008, (0.0002, 0.0012), 0.5, 5)
    speck = grog.cover
    pit = spots(up, 0.011, (0.0002, 0.001), 0.5, 6, (2.0, 1, 2.0)).cover
    flash = fbm(at, Spectrum(0.25, 0.004, 0.75, patch=0.3), 7)
    bloom = masked(at, Spectrum(0.16, 0.0015, 0.85, (1, 1, 1.3), patch=0.5), 0.10, 8, 1.2)
    color = palette(0.52 + 0.13 * flash + 0.07 * ring + 0.03 * drag, "#97492a", "#b35c38", "#c26c45", "#cf8058")
    color = mix(color, palette(grog.cells.random(9), "#7b3f28", "#d7a784", "#a8603f"), 0.7 * speck)
    color = mix(
        shade(color, 0.11 * grit + 0.035 * drag - 0.5 * pit), palette(0.5 + 0.2 * grit, "#cfa68a", "#dcbda6"), 0.3 * bloom
    )
    color = tint(color, 0.05 * noise(at, 0.05, 10) + 0.02 * drag)
    return Look(
        color,
        np.clip(0.84 + 0.05 * grit + 0.05 * bloom - 0.02 * ring, 0, 1),
        0.0,
        2.2e-4 * ring + 4e-5 * drag + 4e-5 * grit - 3e-4 * pit,
    )


def enamelled(at: Place, base: tuple[str, ...], splash: tuple[str, ...], share: float) -> Look:
    """Glass fused on sheet iron: a thick glossy skin with fine orange peel, splashes, chips with a black and rusty heart."""
    peel = fbm(at, Spectrum(0.005, 0.0008, 0.9, patch=0.3), 1)
    drift = fbm(at, Spectrum(0.15, 0.006, 0.75), 2)
    fine = fbm(at, Spectrum(0.002, 0.0002, 1.1, tails=0.4, skew=-0.2, patch=0.4), 3)
    bent = warped(at, 0.0009, 0.006, 4, 3)
    large, small = spots(bent, 0.011, (0.0005, 0.0042), 0.85, 5), spots(bent, 0.004, (0.0003, 0.0012), 0.7, 6)
    drop = np.maximum(large.cover, small.cover) * (share > 0)
    hit = spots(warped(at, 0.0006, 0.005, 7, 4), 0.045, (0.001, 0.011), 0.5, 8)
    shown = fading(0.03, at.footprint)
    iron, rim = (
        threshold(hit.inside, 0.0005, np.maximum(0.0003, at.footprint)) * shown,
        threshold(hit.inside, -0.0006, 0.0012 + at.footprint) * shown,
    )
    speck = spots(at, 0.009, (0.00006, 0.0003), 0.35, 9).cover
    color = mix(palette(0.5 + 0.06 * drift, *base), palette(0.5 + 0.2 * fine, *splash), drop * share)
    color = shade(color, 0.014 * fine + 0.006 * peel - 0.7 * speck * (share == 0) - 0.3 * rim)
    rust = palette(0.5 + 0.3 * fine - 0.3 * np.clip(hit.inside / 0.003, 0, 1), "#2c2624", "#4e2d1c", "#7d4522")
    color = mix(color, rust, iron)
    roughness = mix(0.09 + 0.01 * abs(peel) + 0.02 * drop, 0.75 + 0.05 * fine, iron)
    return Look(color, np.clip(roughness, 0, 1), 0.0, 8e-6 * peel + 1.5e-5 * drop - 3.5e-4 * iron + 2e-6 * fine, 1 - iron)


def enamel(at: Place) -> Look:
    """White enamel on iron, chipped."""
    return enamelled(at, ("#e2e1db", "#eae9e4", "#f0efea"), ("#9c968a",), 0.0)


def graniteware(at: Place) -> Look:
    """Camp enamel: dark blue with splashes of white."""
    return enamelled(at, ("#23335c", "#2a4072", "#30498a"), ("#c9d2de", "#e6eaf0"), 0.92)


LOOKS = {
    "porcelain": porcelain, "glazed_ceramic": glazed_ceramic, "celadon": celadon, "tenmoku": tenmoku,
    "stoneware": stoneware, "raku": raku, "terracotta": terracotta, "enamel": enamel, "graniteware": graniteware,
}  # fmt: skip
METRES = {
    "porcelain": 0.2, "glazed_ceramic": 0.2, "celadon": 0.15, "tenmoku": 0.15, "stoneware": 0.15, "raku": 0.2,
    "terracotta": 0.25, "enamel": 0.3, "graniteware": 0.2,
}  # fmt: skip
