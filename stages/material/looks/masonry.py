"""Masonry: bricks, blocks and tiles in a bond that follows walls and floors, with joints of mortar."""

import numpy as np

from stages.material.look import Look, mix, palette, shade, tint
from stages.material.patterns import Spectrum, fbm, lost, masked, noise, spots, threshold, tiles
from stages.material.place import Place


def brick(at: Place) -> Look:
    """Fired clay in running bond: every brick its own shade, rough faces, chipped arrises, sandy mortar set back."""
    flat = at.flat
    rough_edge = Spectrum(0.02, 0.0008, 0.75, patch=0.5)
    bond = tiles(at, 0.225, 0.075, "running", 1)
    wobble = 0.0016 * fbm(flat, rough_edge, 2)
    corner = 0.004 * (np.hypot(np.maximum(abs(bond.x) / bond.width * 2 - 0.9, 0), np.maximum(abs(bond.y) / bond.height * 2 - 0.8, 0)))
    inside = bond.border - 0.005 + wobble - corner
    face = threshold(inside, 0.0, np.maximum(0.0007, 0.5 * at.footprint) + 0.0016 * lost(flat, rough_edge))
    fired = 0.5 + 0.28 * noise(flat, 0.06, 3) + 0.9 * (bond.random(1) - 0.5)
    clay = palette(fired, "#6e3327", "#8e4631", "#a4543a", "#b9694c")
    burnt = masked(flat, Spectrum(0.08, 0.002, 0.8), 0.12, 4, 0.3) * (bond.random(2) < 0.3)
    grit = fbm(flat, Spectrum(0.006, 0.0004, 1.1, tails=0.4, skew=-0.2, patch=0.5), 5)
    pits = spots(flat, 0.012, (0.0006, 0.003), 0.5, 6).cover
    clay = tint(shade(clay, 0.16 * grit - 0.8 * burnt - 0.5 * pits + 0.2 * (bond.random(3) - 0.5)), 0.12 * (bond.random(4) - 0.5))
    sand = fbm(flat, Spectrum(0.004, 0.0005, 1.2, tails=0.5, patch=0.3), 7)
    mortar = shade(palette(0.5 + 0.2 * noise(flat, 0.05, 8), "#8f887d", "#a8a196", "#b7b0a4"), 0.18 * sand)
    bloom = masked(flat, Spectrum(0.3, 0.003, 0.85), 0.18, 9, 0.5) * 0.35
    color = mix(mix(mortar, clay, face), palette(sand, "#c9c2b8"), bloom)
    height = face * (0.0035 + 0.0008 * (bond.random(5) - 0.5) + 1.6e-4 * grit - 0.001 * pits) + (1 - face) * 2e-4 * sand
    return Look(color, 0.86 + 0.05 * sand * (1 - face) - 0.06 * face + 0.04 * grit * face, 0.0, height - 0.003, face)


LOOKS = {"brick": brick}
METRES = {"brick": 1.8}
