"""Textiles: true threads, plain, twill and satin, knits, piles and felts."""

import numpy as np

from stages.material.look import Look, mix, palette, shade
from stages.material.patterns import Spectrum, fbm, noise, weave
from stages.material.place import Place


def denim(at: Place) -> Look:
    """Twill of indigo warp and undyed weft; threads slub and fade along their length."""
    flat = at.flat
    bent = flat.moved(np.stack([1.2e-4 * noise(flat, 0.02, 1), 1.2e-4 * noise(flat, 0.02, 2), 0 * at.uv[0]]))
    cloth = weave(Place(bent.p, bent.p[:2], at.face, at.footprint, at.period, at.seed), 0.0008, "twill", 0.95, 3)
    slub = fbm(flat, Spectrum(0.02, 0.0004, 1.0, (0.06, 1, 1), tails=0.3, patch=0.4), 4)
    fuzz = fbm(flat, Spectrum(0.001, 0.00015, 1.0, tails=0.4), 5)
    fade = fbm(flat, Spectrum(0.2, 0.004, 0.8, patch=0.4), 6)
    indigo = palette(0.45 + 0.12 * fade + 0.12 * slub + 0.35 * (cloth.random(1) - 0.5), "#1f3350", "#35537c", "#5a7ba3", "#8ba6c2")
    undyed = palette(0.5 + 0.2 * slub, "#b9bdbd", "#d3d5d2")
    lit = 0.75 * (cloth.height - 0.62) * cloth.seen
    warp = cloth.warp * cloth.seen + (1 - cloth.seen) * 0.67
    color = mix(undyed, indigo, warp * 0.9 + 0.08)
    color = shade(color, lit - 0.7 * cloth.gap * cloth.seen + 0.16 * (1 - cloth.seen) + 0.10 * fuzz)
    return Look(color, 0.9 + 0.05 * fuzz, 0.0, 2.2e-4 * cloth.height * cloth.seen + 2e-5 * fuzz)


LOOKS = {"denim": denim}
METRES = {"denim": 0.3}
