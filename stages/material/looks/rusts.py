"""Rust in stages, and patina: what air and water make of metals."""

from statistics import NormalDist

import numpy as np

from stages.material.look import Look, Substance, averaged, mix, over, palette, shade, tint
from stages.material.looks.metals import METALS, Metal, rolled
from stages.material.patterns import (
    Array,
    Spectrum,
    cells,
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


def rust(at: Place) -> Look:
    """Iron rusted through: dark scale, orange bloom, flakes, pits."""
    bent = warped(at, 0.0025, 0.03, 1, 3)
    crust = Spectrum(0.12, 0.0006, 0.85, tails=0.2, patch=0.4)
    age = fbm(bent, crust, 2)
    grit = fbm(at, Spectrum(0.008, 0.0004, 1.1, tails=0.5, patch=0.5), 3)
    bloom = masked(bent, Spectrum(0.05, 0.0006, 0.95, patch=0.5), 0.34, 4, 0.15)
    dark = masked(bent, Spectrum(0.09, 0.0006, 0.9, patch=0.4), 0.28, 5, 0.15)
    pits = spots(warped(at, 0.001, 0.003, 6), 0.005, (0.0003, 0.0016), 0.6, 7).cover * fading(0.003, at.footprint)
    color = palette(0.5 + 0.18 * age, "#4a2415", "#6c3419", "#85421d", "#9c5426")
    color = mix(color, palette(0.5 + 0.25 * grit, "#a85a22", "#c07030", "#d08a48"), bloom * 0.85)
    color = mix(color, palette(0.5 + 0.3 * grit, "#2a1a14", "#3a2318", "#4a2b1c"), dark * 0.85)
    color = tint(shade(color, 0.24 * grit + 0.1 * age - 0.5 * pits), 0.12 * noise(bent, 0.02, 8))
    roughness = 0.86 + 0.05 * grit + 0.06 * bloom - 0.12 * dark
    return Look(color, np.clip(roughness, 0.3, 1), 0.0, 1.2e-4 * grit + 3e-4 * bloom - 2.5e-4 * dark - 4e-4 * pits)


def level_of(share: float) -> float:
    """What noise of deviation 1 exceeds over a share of everything."""
    return NormalDist().inv_cdf(1 - share)


def flash_rust(at: Place) -> Look:
    """Bare steel after a night in the rain: freckles of orange that bloom in swarms, tide marks where drops dried."""
    steel = rolled(at, METALS["iron"]._replace(colors=("#84878a", "#999c9e", "#aeb0b1")))
    bent = warped(at, 0.0006, 0.005, 51, 4)
    swarm = fbm(warped(at, 0.01, 0.06, 52, 3), Spectrum(0.14, 0.002, 0.75, patch=0.4), 53)
    grit = fbm(at, Spectrum(0.003, 0.0003, 1.05, tails=0.5, patch=0.4), 54)
    color, freckled = np.asarray(steel.color), np.zeros(len(at), np.float32)
    for k, (size, radius, share) in enumerate(((0.0016, 0.0006, 0.8), (0.0045, 0.0016, 0.75), (0.013, 0.0042, 0.6))):
        found = spots(bent, size, (0.15 * radius, radius), share, 55 + k)
        halo = np.exp(-np.clip(-found.inside, 0, 1) / (0.6 * radius)) * fading(size, at.footprint)
        here = np.clip(found.cover * threshold(swarm, -0.15 - 0.2 * k, 0.7), 0, 1)
        stain = np.clip(halo * threshold(swarm, -0.15 - 0.2 * k, 0.7), 0, 1)
        color = mix(color, palette(0.5 + 0.2 * grit, "#a5764a", "#b98a58"), 0.6 * stain)
        deep = np.clip(found.inside / radius, 0, 1)
        color = mix(color, palette(0.45 + 0.2 * grit - 0.3 * deep, "#6a3016", "#98491d", "#bf6a2c"), 0.9 * here)
        freckled = np.maximum(freckled, here)
    tide = abs(fbm(warped(at, 0.004, 0.03, 60, 3), Spectrum(0.09, 0.001, 0.6), 61))
    ring = threshold(0.05 - tide, 0.0, 0.05) * threshold(swarm, 0.1, 0.6) * fading(0.004, at.footprint)
    veil = exceeds(swarm, 0.5, 0.6, 0.0 * swarm)
    thin = np.clip(0.45 * ring + 0.35 * veil * (1 - freckled), 0, 1)
    color = mix(color, palette(0.5 + 0.25 * grit, "#8f5630", "#b3703c"), thin)
    rough = steel.roughness + 0.4 * freckled + 0.15 * veil
    metal = steel.metallic * (1 - 0.9 * freckled) * (1 - 0.4 * veil)
    height = steel.height + 5e-5 * freckled * (1 + 0.4 * grit)
    return Look(shade(color, 0.06 * grit), np.clip(rough, 0.1, 1), metal, height, np.clip(freckled + veil, 0, 1))


def rusty_steel(at: Place) -> Look:
    """Plate left outside: blue-grey mill scale, eaten from ragged patches, dark hearts, orange rims, stains run down."""
    scale = rolled(at, METALS["gunmetal"]._replace(colors=("#54585c", "#676b6f", "#7c8083"), dull=0.5))
    bent = warped(at, 0.008, 0.04, 51, 4)
    shape = Spectrum(0.16, 0.0006, 0.78, tails=0.15, patch=0.4)
    spread, hidden = fbm(bent, shape, 52), lost(at, shape)
    up = at.upright
    run = fbm(up, Spectrum(0.3, 0.0012, 0.85, (0.05, 1, 0.05), patch=0.5), 53)
    level = level_of(0.42)
    eaten, heart = exceeds(spread, level, 0.05, hidden), exceeds(spread, level + 0.75, 0.25, hidden)
    stain = exceeds(spread + 0.55 * run, level - 0.25, 0.5, hidden) * (1 - eaten)
    crust = rust(at)
    grit = fbm(at, Spectrum(0.006, 0.0004, 1.05, tails=0.5, patch=0.5), 54)
    rim = eaten * (1 - heart)
    color = mix(np.asarray(crust.color), palette(0.5 + 0.25 * grit, "#8f4a1e", "#b9672a", "#d08a48"), 0.55 * rim)
    color = mix(color, palette(0.5 + 0.3 * grit, "#2c1a13", "#47281a", "#5c3420"), 0.6 * heart)
    scaled = mix(np.asarray(scale.color), palette(0.5 + 0.25 * grit, "#7a4a2c", "#a06a3c"), 0.6 * stain)
    height = crust.height + 1.5e-4 * rim - 2e-4 * heart
    eaten_look = Look(shade(color, 0.14 * grit), crust.roughness, 0.0, height, 1.0)
    kept = scale._replace(color=shade(scaled, 0.05 * grit), roughness=np.clip(scale.roughness + 0.3 * stain, 0, 1), dye=0.0)
    return over(kept._replace(metallic=scale.metallic * (1 - 0.7 * stain)), eaten_look, eaten)


def flaking_rust(at: Place) -> Look:
    """A wreck's plate: rust grown in leaves that lift, curl and break off, dark layers beneath, powder in the steps."""
    bent = warped(at, 0.006, 0.04, 1, 4)
    grown = Spectrum(0.13, 0.0012, 0.5, tails=0.2, patch=0.3)
    leaf = 1.7 * fbm(bent, grown, 2)
    step = np.floor(leaf)
    rise, seen = leaf - step, fading(0.006, at.footprint)
    lip, under = threshold(0.09 - rise, 0.0, 0.05) * seen, threshold(rise, 0.86, 0.14) * seen
    grit = fbm(at, Spectrum(0.006, 0.0004, 1.08, tails=0.5, skew=-0.15, patch=0.5), 3)
    bloom = masked(bent, Spectrum(0.04, 0.0006, 0.9, patch=0.5), 0.3, 4, 0.3)
    split = cracks_of(bent, 5)
    tone = 0.5 + 0.45 * np.sin(step * 12.9898 + 2.0) * seen
    color = palette(0.85 * tone + 0.08 + 0.06 * grit, "#35201a", "#512c1c", "#7a3f1f", "#94542a", "#5f3b2c")
    color = mix(color, palette(0.5 + 0.25 * grit, "#a85a22", "#c57a38", "#d99a58"), 0.6 * bloom * (1 - 0.6 * lip) + 0.25 * lip)
    color = shade(color, 0.2 * grit + 0.25 * lip - 0.75 * under - 0.9 * split)
    height = 1.1e-3 * ((step + np.clip(rise / 0.1, 0, 1)) * seen + 0.5 * rise) + 2.2e-4 * grit + 2e-4 * bloom - 8e-4 * split
    return Look(tint(color, 0.1 * noise(bent, 0.02, 6)), np.clip(0.88 + 0.05 * grit - 0.1 * under, 0.3, 1), 0.0, height - 1e-3)


def cracks_of(bent: Place, seed: int) -> Array:
    """Fine splits of a crust, (P,) 0 … 1."""
    border = cells(bent, 0.022, seed)
    open_here = np.clip(0.2 + 0.6 * noise(bent, 0.03, seed + 1), 0, 1)
    soft = np.maximum(0.0003, 0.5 * bent.footprint)
    return threshold(0.0005 * open_here - border.border, 0.0, soft) * fading(0.006, bent.footprint)


def weathering_steel(at: Place) -> Look:
    """Corten: a dense even rust, grained like suede, orange over brown over purple, faint runs of water."""
    bent = warped(at, 0.004, 0.03, 1, 3)
    cloud = fbm(bent, Spectrum(0.3, 0.0016, 0.82, tails=0.1, patch=0.4), 2)
    grain = fbm(at, Spectrum(0.0035, 0.0003, 1.05, tails=0.35, skew=0.1, patch=0.3), 3)
    up = at.upright
    run = fbm(up, Spectrum(0.5, 0.002, 0.8, (0.05, 1, 0.05), patch=0.5), 4)
    dark = masked(bent, Spectrum(0.05, 0.0006, 0.9, patch=0.5), 0.22, 5, 0.4)
    bright = masked(bent, Spectrum(0.02, 0.0006, 0.95, patch=0.5), 0.2, 6, 0.3)
    color = palette(0.5 + 0.15 * cloud + 0.12 * run + 0.06 * grain, "#5c3020", "#7f4527", "#9a5a30", "#b47440")
    color = mix(color, palette(0.5 + 0.2 * grain, "#46281f", "#5b3427"), 0.55 * dark)
    color = mix(color, palette(0.5 + 0.25 * grain, "#b06a34", "#c78a50"), 0.5 * bright)
    color = tint(shade(color, 0.17 * grain), 0.05 * cloud)
    height = 4e-5 * grain + 3e-5 * bright - 3e-5 * dark
    return Look(color, np.clip(0.8 + 0.05 * grain + 0.05 * bright - 0.08 * dark, 0.3, 1), 0.0, height)


def verdigris(at: Place) -> Look:
    """Copper in the weather: brown-black tarnish, blue-green powder that grew in clumps and ran down in dribbles, pale where
    it is thick, bright metal where it was rubbed."""
    bent = warped(at, 0.006, 0.04, 1, 4)
    up = at.upright
    dribble = Spectrum(0.10, 0.0014, 0.9, (0.07, 1, 0.07), 0.2, patch=0.5)
    run = fbm(warped(up, 0.002, 0.05, 2, 2), dribble, 3)
    source = fbm(warped(up, 0.01, 0.1, 9, 2), Spectrum(0.35, 0.02, 0.7, (1, 0.6, 1)), 10)
    shape = Spectrum(0.09, 0.0006, 0.85, tails=0.15, patch=0.4)
    grit = fbm(at, Spectrum(0.004, 0.0003, 1.06, tails=0.5, skew=0.2, patch=0.5), 5)
    grown = 0.75 * fbm(bent, shape, 4) + 0.5 * run * np.clip(0.7 + 0.5 * source, 0, 1.6) + 0.45 * source
    hidden = np.hypot(0.75 * lost(at, shape), 0.4 * lost(at, dribble))
    steps = ((-0.45, 0.7), (0.1, 0.1), (1.0, 0.3))
    haze, crust, clump = (exceeds(grown + 0.12 * grit, level, soft, hidden) for level, soft in steps)
    rubbed = exceeds(-grown + 0.3 * grit, 1.5, 0.15, hidden)
    clump, rubbed = clump / np.maximum(crust, 0.02), rubbed / np.maximum(1 - crust, 0.02)  # of the crust, of the rest
    clump, rubbed = np.minimum(clump, 1), np.minimum(rubbed, 1)
    tone = fbm(bent, Spectrum(0.03, 0.0008, 0.9, patch=0.4), 6)
    tarnish = palette(0.5 + 0.2 * tone + 0.12 * grit, "#1f1511", "#37261b", "#553724", "#744829")
    tarnish = mix(tarnish, palette(0.5 + 0.2 * grit, "#34483f", "#4c6a5e"), 0.55 * haze)
    powder = averaged(0.42 + 0.16 * tone + 0.10 * grit, 0.2 * lost(at, shape), "#2f7069", "#459088", "#66aca4", "#8cc6bd")
    powder = mix(powder, palette(0.5 + 0.25 * grit, "#9dcfc6", "#c4e3da", "#dfeee6"), 0.75 * clump)
    metal = palette(0.6 + 0.2 * grit, "#b8714f", "#e09a76", "#f2bb9c")
    color = mix(mix(tarnish, metal, 0.8 * rubbed), powder, crust * (0.86 + 0.14 * clump))
    color = tint(shade(color, 0.12 * grit), 0.05 * noise(bent, 0.03, 8), 0.04 * tone)
    height = 7e-5 * grit * (0.3 + crust) + 1.6e-4 * crust + 2.2e-4 * clump - 4e-5 * rubbed - 1.2e-4
    rough = mix(0.5 + 0.08 * tone - 0.22 * rubbed, 0.92 + 0.04 * grit, crust)
    metallic = (0.35 * (1 - haze) + 0.6 * rubbed) * (1 - crust)
    return Look(color, np.clip(rough, 0.15, 1), np.clip(metallic, 0, 1), height, crust)


def patinated(at: Place, kind: Metal) -> Look:
    """A statue's bronze: dark brown, rubbed bright here and there, green where rain stood and ran."""
    metal = rolled(at, kind)
    cast_skin = fbm(warped(at, 0.0008, 0.003, 49), Spectrum(0.006, 0.0005, 0.95, tails=0.3, patch=0.4), 50)
    bent = warped(at, 0.005, 0.03, 51, 4)
    up = at.upright
    run = fbm(up, Spectrum(0.35, 0.0014, 0.85, (0.05, 1, 0.05), 0.2, patch=0.5), 52)
    shape = Spectrum(0.1, 0.0006, 0.85, tails=0.15, patch=0.4)
    spread, hidden = fbm(bent, shape, 53) + 0.6 * run, lost(at, shape)
    grit = fbm(at, Spectrum(0.004, 0.0003, 1.05, tails=0.5, patch=0.5), 54)
    green, edge_of = exceeds(spread, level_of(0.24), 0.2, hidden), exceeds(spread, level_of(0.36), 0.4, hidden)
    color = mix(np.asarray(metal.color), palette(0.5 + 0.2 * grit, "#241c17", "#33281f", "#4a3826"), 0.88)
    color = mix(color, palette(0.5 + 0.25 * grit, "#3f5b49", "#587661"), 0.5 * edge_of)
    color = mix(color, palette(0.5 + 0.25 * grit, "#5f9a86", "#83b7a1", "#a5cdb8"), 0.85 * green)
    rough = np.clip(0.36 + 0.06 * grit + 0.04 * cast_skin + 0.4 * green, 0.1, 1)
    height = 4e-5 * cast_skin + 8e-5 * green
    metallic = 0.75 * (1 - green) * (1 - 0.5 * edge_of)
    return Look(shade(color, 0.08 * grit + 0.06 * cast_skin), rough, metallic, height, 1 - green)


def aged_bronze(at: Place) -> Look:
    """Bronze that has stood outside."""
    return patinated(at, METALS["bronze"])


LOOKS: dict[str, Substance] = {
    "rust": rust, "flash rust": flash_rust, "rusty steel": rusty_steel, "flaking rust": flaking_rust,
    "weathering steel": weathering_steel, "verdigris": verdigris, "aged bronze": aged_bronze,
}  # fmt: skip
METRES = {
    "rust": 0.5, "flash rust": 0.25, "rusty steel": 0.6, "flaking rust": 0.4, "weathering steel": 0.5, "verdigris": 0.5,
    "aged bronze": 0.4,
}  # fmt: skip
