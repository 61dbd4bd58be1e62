"""Rust in stages, and patina: what air and water make of metals."""

import numpy as np

from stages.material.look import Look, mix, palette, shade, tint
from stages.material.patterns import Spectrum, fading, fbm, masked, noise, spots, warped
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


LOOKS = {"rust": rust}
METRES = {"rust": 0.5}
