"""Woods: growth rings about a pith, earlywood and latewood, pores along the grain, rays, knots; boards where words say so."""

from typing import NamedTuple

import numpy as np

from stages.material.look import Look, palette, shade, tint
from stages.material.patterns import Spectrum, cells, fading, fbm, line, noise, threshold, tiles
from stages.material.place import Place


class Timber(NamedTuple):
    """colors: early- to latewood, sRGB. ring: mean width of a ring, metres. contrast: of the rings. pores: how dark they are.
    pore: their width, metres. figure: how far rings wander, metres. roughness: mean. """

    colors: tuple[str, ...]
    ring: float = 0.004
    contrast: float = 0.6
    pores: float = 0.5
    pore: float = 0.0003
    figure: float = 0.012
    roughness: float = 0.55


TIMBERS = {
    "oak": Timber(("#c7a06c", "#b98c56", "#8f6238"), pores=0.9, pore=0.0004),
    "walnut": Timber(("#6d4c33", "#553a27", "#38241a"), figure=0.02, roughness=0.5),
    "pine": Timber(("#e3c18d", "#d6aa6b", "#a86b34"), 0.006, 0.9, 0.1),
}


def timber(at: Place, kind: Timber) -> Look:
    """Wood sawn along its second axis, in space: the sides show rings as they are cut."""
    x, y, z = at.p
    lazy = at.moved(np.stack([0 * y, -0.85 * y, 0 * y])) if not at.period[1] else at  # figure drawn out along the grain
    wander = fbm(lazy, Spectrum(0.12, 0.01, 0.5, (1, 4, 1)), 1)
    radius = np.hypot(x + np.float32(0.04) + kind.figure * wander, z + np.float32(0.11) + kind.figure * fbm(at, Spectrum(0.2, 0.05, 0.5, (1, 4, 1)), 2))
    years = radius / kind.ring + 0.8 * noise(at, 0.03, 3, (1, 8, 1))
    ring = years - np.floor(years)
    season = ring**2 * threshold(1 - ring, 0.06, 0.06)  # slow into latewood, sharp back into spring
    season = season * fading(kind.ring, at.footprint) + 0.33 * (1 - fading(kind.ring, at.footprint))
    fibre = fbm(at, Spectrum(0.003, 0.0002, 1.0, (1, 24, 1), tails=0.4, patch=0.4), 4)
    tone = fbm(at, Spectrum(0.15, 0.02, 0.7, (1, 5, 1)), 5)
    vessels = cells(at, kind.pore * 2.2, 6, 1.0, (1, 16, 1))
    pore = line(vessels.near - 0, kind.pore * (0.4 + 0.5 * vessels.random(1)) * (1 - 0.6 * ring), np.minimum(at.footprint, kind.pore))
    pore = pore * (vessels.random(2) < 0.35 + 0.4 * (ring < 0.35)) * fading(kind.pore * 2.2, at.footprint)
    color = palette(0.15 + kind.contrast * season + 0.1 * tone, *kind.colors)
    color = shade(color, 0.10 * fibre + 0.08 * tone - kind.pores * pore)
    color = tint(color, 0.05 * noise(at, 0.05, 8, (1, 6, 1)))
    roughness = kind.roughness - 0.1 * season + 0.04 * fibre + 0.15 * pore
    return Look(color, roughness, 0.0, 2e-5 * fibre - 1.2e-4 * pore - 4e-5 * season)


def boards(at: Place, kind: Timber, width: float = 0.12, length: float = 1.2) -> Look:
    """Boards side by side, each cut elsewhere, a dark joint between them."""
    bond = tiles(at.swapped(), length, width, "random", 11)
    shift = np.stack([bond.random(1) * 0.3 - 0.15, bond.random(2) * 3, bond.random(3) * 0.2]).astype(np.float32)
    own = np.stack([bond.y, bond.x, 0 * bond.x]) + shift
    look = timber(Place(own, at.uv, at.face, at.footprint, seed=at.seed), kind)
    worn = bond.border + 0.0006 * noise(at.flat, 0.01, 12)
    gap = 1 - threshold(worn, 0.001, np.maximum(0.0005, 0.5 * at.footprint))
    color = shade(look.color, 0.25 * (bond.random(4) - 0.5) - 1.6 * gap)
    color = tint(color, 0.12 * (bond.random(5) - 0.5))
    height = look.height - 0.0015 * gap - 0.0004 * threshold(0.004 - bond.border, 0.0, 0.004)
    return Look(color, np.clip(look.roughness + 0.2 * gap, 0, 1), 0.0, height)


def oak(at: Place) -> Look:
    return timber(at, TIMBERS["oak"])


def walnut(at: Place) -> Look:
    return timber(at, TIMBERS["walnut"])


def oak_boards(at: Place) -> Look:
    return boards(at, TIMBERS["oak"])


LOOKS = {"oak": oak, "walnut": walnut, "oak boards": oak_boards}
METRES = {"oak": 0.6, "walnut": 0.5, "oak boards": 0.96}
