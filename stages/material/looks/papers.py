"""Papers: fibres felted in a sieve, parchment, print, board with its flutes."""

import numpy as np

from stages.material.look import Look, each, mix, palette, shade, tint
from stages.material.noise_kernels import random_numbers
from stages.material.patterns import (
    Array,
    Spectrum,
    cracks,
    edge,
    exceeds,
    fading,
    fbm,
    lost,
    marks,
    masked,
    noise,
    repeats,
    seed_of,
    spots,
    warped,
)
from stages.material.place import Place


def sheet(at: Place, stops: tuple[str, ...], hairs: tuple[str, ...], strength: float) -> tuple[Array, Array, Array]:
    """Felted fibres. hairs: colours of single ones. Returns: colours (3, P); fine structure; cover by fibres."""
    flat = at.flat
    cloud = fbm(warped(flat, 0.001, 0.006, 1, 2), Spectrum(0.012, 0.0008, 0.9, patch=0.4), 2)
    fine = fbm(flat, Spectrum(0.0016, 0.0001, 1.05, (1.3, 0.8, 1), 0.4, -0.1, 0.4), 3)
    color = palette(0.5 + 0.08 * cloud + 0.14 * fine, *stops)
    cover = np.zeros(len(at), np.float32)
    for k in range(2):
        fibre = marks(at, 0.0042, 0.00010, 7, 1.2 * k, 6.28, 4 + k, 0.7, 0.7)
        color = mix(color, each(fibre.random(1), 1.0, *hairs), strength * fibre.cover)
        cover = np.maximum(cover, fibre.cover)
    return tint(color, 0.02 * cloud), fine, cover


def paper(at: Place) -> Look:
    """Uncoated white paper: cloudy where held to the light, fine fibres, a faint tooth."""
    color, fine, fibre = sheet(at, ("#dfddd5", "#e9e7e0", "#f0efe9"), ("#d8d5cb", "#f4f3ee", "#e2dfd6"), 0.5)
    color = shade(color, 0.012 * fine)
    return Look(color, np.clip(0.9 + 0.03 * fine - 0.03 * fibre, 0, 1), 0.0, 3e-6 * fine + 4e-6 * fibre)


def printed(at: Place, width: float, leading: float, weight: float, seed: int) -> Array:
    """Lines of something like letters: words of hashed stems, bowls and bars. width, leading: of a letter and a line, metres.
    Returns: (P,) share of the footprint that ink covers."""
    x, column, wide = repeats(at, width, 0)
    y, row, tall = repeats(at, leading, 1)

    def dice(number: int, step: float = 0.0) -> Array:
        """A number of the letter at hand."""
        h = (
            (column.astype(np.int64) + int(step)) * 0x8DA6B343
            ^ row.astype(np.int64) * 0xD8163841
            ^ int(seed_of(at, seed))
        )
        return random_numbers((h & 0xFFFFFFFF).astype(np.uint32), number)

    a, b = x * np.float32(wide / 2), y * np.float32(tall / 2)
    stem, high = np.float32(weight / 2), np.float32(0.22 * tall)
    left, right = abs(a + 0.26 * wide), abs(a - 0.26 * wide)
    top, ascends, drops = dice(1), dice(2) < 0.22, dice(3) < 0.12
    upper = np.where(ascends, 1.75 * high, high)
    lower = np.where(drops, 1.7 * high, high)

    def bar(distance: Array, shown: Array) -> Array:
        return edge(stem - distance, at.footprint) * shown

    body = (b < upper) & (b > -lower)
    middle = (abs(b) < high + stem) & (abs(a) < 0.26 * wide + stem)
    ink = np.maximum(bar(left, body & (top < 0.8)), bar(right, (abs(b) < high) & (dice(4) < 0.6)))
    ink = np.maximum(ink, bar(abs(b - high), middle & (dice(5) < 0.55)) * 0.9)
    ink = np.maximum(ink, bar(abs(b + high), middle & (dice(6) < 0.5)) * 0.9)
    ink = np.maximum(ink, bar(abs(b), middle & (dice(7) < 0.35)) * 0.9)
    space = dice(8) < 0.16
    return ink * ~space


INK_SHARE = 0.19
"""Of a column of print (measured)."""


def newspaper(at: Place) -> Look:
    """Newsprint: grey-yellow groundwood, columns of small print, headlines, ink that bled a little and shows from behind."""
    flat = at.flat
    color, fine, fibre = sheet(at, ("#bfb8a6", "#cfc9b8", "#dad5c6"), ("#a79f8c", "#b8ab8f", "#dcd7c9"), 0.55)
    bled = warped(flat, 0.00004, 0.0004, 11, 1)
    place = Place(bled.p, bled.p[:2], at.face, at.footprint, at.period, at.seed)
    across, _, column = repeats(at, 0.048, 0)
    up, _, story = repeats(at, 0.06, 1)
    from_top = (1 - up) * np.float32(story / 2)
    text = edge((1 - abs(across)) * np.float32(column / 2) - 0.002, at.footprint)
    head = (from_top < 0.0115).astype(np.float32)
    rule = edge(0.00012 - abs((1 - abs(across)) * np.float32(column / 2)), at.footprint) * 0.8
    seen = fading(0.0016, at.footprint)
    small = INK_SHARE + (printed(place, 0.00135, 0.0030, 0.00026, 12) - INK_SHARE) * seen
    large = printed(place, 0.0048, 0.012, 0.0010, 13)
    ink = np.clip(text * mix(small, large, head), 0, 1)
    ink = np.maximum(ink * np.clip(0.86 + 0.10 * fine, 0, 1), rule)
    color = mix(shade(color, 0.03 * fine), palette(0.5 + 0.2 * fine, "#2c2b2c", "#3d3c3d"), 0.88 * ink)
    return Look(color, np.clip(0.92 + 0.03 * fine - 0.12 * ink, 0, 1), 0.0, 8e-6 * fine + 8e-6 * fibre)


def parchment(at: Place) -> Look:
    """Calfskin scraped thin: yellowed, clouded, with veins and the points of hairs, soft buckles, brown stains."""
    cloud = fbm(warped(at, 0.008, 0.05, 1, 3), Spectrum(0.12, 0.002, 0.85, tails=0.2, skew=-0.1, patch=0.5), 2)
    fine = fbm(at, Spectrum(0.0024, 0.00015, 1.05, tails=0.5, skew=-0.2, patch=0.5), 3)
    vein = cracks(warped(at, 0.003, 0.02, 4, 2), 0.05, 0.0014, 0.2, 5, 3, 0.12)
    hair = spots(at, 0.0032, (0.00006, 0.00025), 0.6, 6).cover * np.clip(0.6 + 0.5 * noise(at, 0.05, 7), 0, 1)
    stain = masked(warped(at, 0.006, 0.03, 8, 3), Spectrum(0.10, 0.001, 0.85, patch=0.5), 0.12, 9, 0.5)
    fold = fbm(at, Spectrum(0.10, 0.012, 0.6), 10)
    color = palette(0.52 + 0.14 * cloud + 0.07 * fine, "#b08d54", "#cdb07a", "#dfc899", "#ecdcb8")
    color = shade(color, 0.04 * fine - 0.16 * vein.cover - 0.10 * np.exp(-vein.near / 0.002) * 0.6 - 0.4 * hair)
    color = mix(color, palette(0.5 + 0.15 * fine, "#8d6636", "#ab8450"), 0.5 * stain)
    rough = 0.62 + 0.04 * fine + 0.05 * cloud + 0.06 * stain
    return Look(tint(color, 0.04 * cloud), np.clip(rough, 0, 1), 0.0, 6e-4 * fold + 8e-6 * fine + 4e-5 * vein.cover)


KRAFT = ("#9b7448", "#b58c5c", "#c79f6f")


def cardboard(at: Place) -> Look:
    """Brown liner board: long fibres and dark specks of old print, flutes that show faintly through, scuffs."""
    color, fine, fibre = sheet(at, KRAFT, ("#8a6439", "#d0ad80", "#7a5932", "#c49b68"), 0.55)
    flute, _, _ = repeats(at, 0.0075, 0)
    wave = np.cos(np.pi * flute) * fading(0.55 * 0.0075, at.footprint)
    speck = spots(at, 0.006, (0.0001, 0.00045), 0.4, 11).cover
    scuff = masked(warped(at.flat, 0.003, 0.02, 12, 3), Spectrum(0.05, 0.0006, 0.9, patch=0.6), 0.07, 13, 0.4)
    wide = fbm(at.flat, Spectrum(0.2, 0.004, 0.8, (1, 2, 1)), 14)
    color = shade(color, 0.04 * fine + 0.025 * wave + 0.03 * wide - 0.5 * speck)
    color = mix(color, palette(0.5 + 0.2 * fine, "#c09a6c", "#d0ad80"), 0.3 * scuff)
    return Look(
        color,
        np.clip(0.88 + 0.04 * fine - 0.03 * wave + 0.05 * scuff, 0, 1),
        0.0,
        6e-5 * wave + 1e-5 * fine + 1.2e-5 * fibre - 1e-5 * scuff,
    )


def corrugated_cardboard(at: Place) -> Look:
    """A carton's board with its liner half torn off: brown flutes, ridge after ridge with the glue's dark line on each back,
    beside the smooth liner they show through, pale torn fibres between."""
    color, fine, fibre = sheet(at, KRAFT, ("#8a6439", "#d0ad80", "#7a5932", "#c49b68"), 0.5)
    flat = at.flat
    bent = warped(flat, 0.0002, 0.03, 11, 2)
    flute, _, pitch = repeats(Place(bent.p, bent.p[:2], at.face, at.footprint, at.period, at.seed), 0.0075, 0)
    shown = fading(pitch / 2, at.footprint)
    wave = np.cos(np.pi * flute) * shown
    shape = Spectrum(0.09, 0.0006, 0.7, (1, 2.2, 1), patch=0.4)
    tear, hidden = fbm(warped(flat, 0.003, 0.012, 12, 3), shape, 13) + 0.12 * wave, lost(flat, shape)
    liner, ragged = exceeds(tear, 0.0, 0.03, hidden), exceeds(tear, -0.35, 0.15, hidden)
    fluff = (ragged - liner) * np.clip(0.5 + 0.5 * wave, 0, 1)
    dent = masked(warped(flat, 0.002, 0.015, 14, 2), Spectrum(0.06, 0.006, 0.7, (1, 1.5, 1)), 0.05, 15, 0.3)
    glue = np.exp(-np.square(flute / 0.16)) * shown * np.clip(0.7 + 0.4 * fine, 0, 1)
    bare = shade(color, 0.34 * wave + 0.07 * fine - 0.15 * dent - 0.4 * glue * (1 - dent))
    cover = shade(color, 0.03 * wave + 0.05 * fine + 0.08 - 0.1 * dent)
    color = mix(bare, cover, liner)
    color = mix(color, palette(0.5 + 0.25 * fine, "#c7a377", "#dcc19a", "#ead6b5"), 0.7 * fluff)
    height = mix(0.0019 * wave * (1 - 0.6 * dent), 0.0024 + 1e-4 * wave - 3e-4 * dent, liner) - 0.001 + 2e-4 * fluff
    rough = np.clip(0.88 + 0.04 * fine - 0.05 * wave * (1 - liner) + 0.06 * fluff, 0, 1)
    return Look(color, rough, 0.0, height + 1e-5 * fine + 1.2e-5 * fibre)


LOOKS = {
    "paper": paper, "newspaper": newspaper, "parchment": parchment, "cardboard": cardboard,
    "corrugated cardboard": corrugated_cardboard,
}  # fmt: skip
METRES = {"paper": 0.05, "newspaper": 0.24, "parchment": 0.2, "cardboard": 0.1, "corrugated cardboard": 0.12}
