"""Stones: mineral grains, veins, beds and pores."""

import numpy as np

from stages.material.look import Look, mix, palette, shade, tint
from stages.material.patterns import Spectrum, cells, fading, fbm, noise, threshold, warped
from stages.material.place import Place


def granite(at: Place) -> Look:
    """Interlocking grains of three minerals: quartz grey and clear, feldspar pale or pink, mica black and shiny."""
    bent = warped(at, 0.0012, 0.004, 1)
    coarse, fine = cells(bent, 0.006, 2), cells(bent, 0.0025, 3)
    show, show_fine = fading(0.006, at.footprint), fading(0.0025, at.footprint)
    mineral = coarse.random(1)
    cloud = fbm(at, Spectrum(0.06, 0.01, 0.8), 4)
    feldspar = palette(coarse.random(2), "#b9ada6", "#cfc5bd", "#d8cfc8")
    quartz = palette(fine.random(3), "#7d7b79", "#98958f", "#a9a49d")
    mica = palette(fine.random(4), "#1b1b1d", "#2c2b2c", "#454341")
    dark = (fine.random(5) < 0.30 + 0.08 * cloud).astype(np.float32) * show_fine + 0.3 * (1 - show_fine)
    pale = (mineral < 0.52).astype(np.float32) * show + 0.52 * (1 - show)
    color = mix(mix(quartz, feldspar, pale), mica, dark * (1 - 0.45 * pale))
    grit = fbm(at, Spectrum(0.002, 0.0003, 1.1, tails=0.4, patch=0.4), 6)
    color = tint(shade(color, 0.16 * grit + 0.05 * cloud), 0.08 * noise(at, 0.006, 7))
    roughness = 0.42 - 0.14 * dark * (1 - pale) + 0.08 * pale + 0.05 * grit
    return Look(color, roughness, 0.0, 4e-5 * grit - 8e-5 * dark + 6e-5 * pale)


def marble(at: Place) -> Look:
    """White crystalline ground, cloudy, with veins that branch: ridges of warped noise, wide and faint, thin and dark."""
    bent = warped(warped(at, 0.06, 0.35, 1), 0.008, 0.04, 2, 3)
    wide = abs(noise(bent, 0.30, 3, (1, 1.6, 1)))
    thin = abs(fbm(warped(bent, 0.02, 0.1, 4), Spectrum(0.16, 0.08, 0.5, (1, 1.4, 1)), 5))
    where = threshold(noise(at, 0.25, 6), -0.4, 0.8)
    strong = np.exp(-wide / 0.035) + 0.5 * np.exp(-wide / 0.25)
    hair = np.exp(-thin / np.maximum(0.02, 0.05 * where)) * where
    cloud = fbm(bent, Spectrum(0.2, 0.005, 0.75), 7)
    grain = fbm(at, Spectrum(0.006, 0.0002, 1.15, tails=0.3, patch=0.4), 8)
    depth = 0.75 * strong * where + 0.55 * hair + 0.05 * np.clip(cloud, 0, 3)
    color = palette(depth, "#e9e7e3", "#d3d1cd", "#9b9a98", "#63615f")
    color = tint(shade(color, 0.05 * grain - 0.03 * abs(cloud)), 0.05 * noise(bent, 0.1, 9))
    return Look(color, 0.16 + 0.12 * np.clip(depth, 0, 1) + 0.02 * grain, 0.0, 6e-6 * grain - 3e-5 * hair)


LOOKS = {"granite": granite, "marble": marble}
METRES = {"granite": 0.5, "marble": 1.2}
