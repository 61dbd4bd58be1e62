"""Textiles: true threads, plain, twill and satin, knits, piles and felts, ropes, canes and straw."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from stages.material.look import Look, averaged, each, mix, palette, shade, tint
from stages.material.patterns import (
    Array,
    Loops,
    Spectrum,
    Weave,
    cells,
    edge,
    fading,
    fbm,
    hexagons,
    knit,
    laid,
    line,
    lost,
    marks,
    noise,
    repeats,
    warped,
    weave,
    wickerwork,
)
from stages.material.place import Place


class Cloth(NamedTuple):
    """warp, weft: sRGB colours of threads from dark to light. pitch: from thread to thread, metres. fill: width of a thread, of
    the pitch. slub: how much a thread's thickness and dye vary along it. stray: how far threads leave their line, of the
    pitch. fuzz: of loose fibres. fade: of the whole, wide. depth: of the shade between threads."""

    warp: tuple[str, ...]
    weft: tuple[str, ...]
    pitch: float
    draft: str = "plain"
    fill: float = 0.92
    slub: float = 0.12
    stray: float = 0.25
    fuzz: float = 0.08
    fade: float = 0.05
    depth: float = 0.9
    roughness: float = 0.88


CLOTHS = {
    "denim": Cloth(
        ("#11233f", "#19335a", "#2b4d7b", "#486c97"), ("#4d6080", "#74859e"), 0.0008, "twill 3/1", 0.95, 0.15, fade=0.14
    ),
    "fabric": Cloth(("#9c9483", "#b4ab99", "#c4bcab"), ("#a59c8a", "#bbb2a1", "#cbc4b4"), 0.0007, slub=0.035, stray=0.1,
                    fuzz=0.05, fade=0.02),
    "canvas": Cloth(
        ("#ac9f82", "#c5b899", "#d8cdb2"), ("#b3a688", "#cabd9f", "#ddd3ba"), 0.0012, "basket", 0.94, 0.16, 0.3
    ),
    "linen": Cloth(
        ("#a69472", "#c2b18d", "#d8caa9"), ("#ae9d7b", "#cbbb98", "#e0d4b6"), 0.0006, "plain", 0.86, 0.3, 0.45, 0.1, 0.07
    ),
    "burlap": Cloth(
        ("#71542d", "#977545", "#b9955f"), ("#7a5c33", "#a27f4e", "#c29f6a"), 0.0022, "plain", 0.72, 0.3, 0.4, 0.16, 0.08,
        1.1, 0.95,
    ),
    "wool": Cloth(
        ("#4c4844", "#655f59", "#827b72"), ("#5b5650", "#78716a", "#989086"), 0.0011, "twill 2/2", 0.96, 0.2, 0.35, 0.16, 0.06,
        0.6, 0.95,
    ),
    "silk": Cloth(
        ("#b79a6b", "#cbb083", "#dbc49c"), ("#b79a6b", "#cbb083", "#dbc49c"), 0.00022, "satin", 0.97, 0.06, 0.2, 0.02, 0.05,
        0.16, 0.4,
    ),
}  # fmt: skip


@cache
def usual(pattern: Callable[..., Any], *args: Any) -> dict[str, float]:
    """Means of a pattern's numbers where it can be seen whole. Args: args[0] is its size, metres."""
    p = np.random.default_rng(0).uniform(0, 400 * args[0], (3, 30_000)).astype(np.float32)
    found = pattern(Place(p, p[:2], np.zeros(p.shape[1], np.int32), np.full(p.shape[1], 1e-3 * args[0], np.float32)), *args)
    return {name: float(np.mean(value)) for name, value in found._asdict().items()}


def strayed(flat: Place, pitch: float, amount: float, seed: int) -> Place:
    """A place on the surface (`flat`) whose threads leave their straight line by `amount`, metres."""
    across, up = noise(flat, 24 * pitch, seed, (0.15, 1, 1)), noise(flat, 24 * pitch, seed + 1, (1, 0.15, 1))
    bent = flat.moved(np.float32(amount) * np.stack([across, up, 0 * up]))
    return Place(bent.p, bent.p[:2], flat.face, flat.footprint, flat.period, flat.seed)


def yarn(flat: Place, pitch: float, warp: Array, seed: int) -> tuple[Array, Array]:
    """What varies along threads, and the twisted fibres of them, deviation 1. Args: warp (P,) 1 where threads run up."""
    along = Spectrum(48 * pitch, 6 * pitch, 0.9, (0.06, 1, 1), tails=0.3, patch=0.4)
    up, across = fbm(flat, along, seed), fbm(flat, along._replace(stretch=(1, 0.06, 1)), seed + 1)
    lean = np.where(warp > 0.5, flat.p[1], -flat.p[1])
    fibres = fbm(
        flat.moved(np.stack([lean, 0 * lean, 0 * lean])),
        Spectrum(0.5 * pitch, 0.1 * pitch, 1.0, (1, 4, 1), 0.4, -0.1, 0.4),
        seed + 2,
    )
    return mix(across, up, warp), fibres


def relieved(color: Array, rise: Array, mean: float, depth: float) -> Array:
    """Colours darker between threads, at the same mean. Args: rise (P,) 0 … 1, `mean` where single threads cannot be seen."""
    return color * np.maximum(1 + np.float32(depth) * (rise - np.float32(mean)), 0.04)


def threads(at: Place, kind: Cloth) -> tuple[Weave, Array, Array, Array]:
    """The weave of a cloth; how much of warp is on top; its threads' rise; light and dark along threads. Returns: (P,) each."""
    flat = at.flat
    draw = weave(strayed(flat, kind.pitch, kind.stray * kind.pitch, 1), kind.pitch, kind.draft, kind.fill, 3)
    mean = usual(weave, kind.pitch, kind.draft, kind.fill)
    slub, fibres = yarn(flat, kind.pitch, draw.warp, 4)
    thin = 1 - np.clip(0.5 * kind.slub - 0.8 * kind.slub * slub, 0, 0.4) * draw.across**2
    rise = mean["height"] + ((1 - draw.gap) * draw.height * thin - mean["height"]) * draw.seen
    warp = mean["warp"] + (draw.warp - mean["warp"]) * draw.seen
    return draw, warp, rise, kind.slub * slub + kind.fuzz * fibres


def woven(at: Place, kind: Cloth) -> Look:
    """Threads over and under each other, each with its own dye, thick and thin along its length, of twisted fibres."""
    flat = at.flat
    draw, warp, rise, vary = threads(at, kind)
    mean = usual(weave, kind.pitch, kind.draft, kind.fill)["height"]
    fade = fbm(flat, Spectrum(0.25, 0.006, 0.85, patch=0.4), 7)
    own = 0.5 + 0.45 * (draw.random(1) - 0.5) * draw.seen + vary + kind.fade * fade
    color = mix(palette(own, *kind.weft), palette(own, *kind.warp), warp)
    color = relieved(shade(color, 0.6 * vary + 0.5 * kind.fade * fade), rise, mean, kind.depth)
    color = tint(color, 0.08 * (draw.random(2) - 0.5) * draw.seen + 0.03 * noise(flat, 0.04, 8))
    rough = kind.roughness - 0.12 * (rise - mean) + 0.25 * vary
    return Look(color, np.clip(rough, 0, 1), 0.0, 0.3 * kind.pitch * (rise - mean) + 0.05 * kind.pitch * vary)


def denim(at: Place) -> Look:
    """Twill of indigo warp over a pale weft; threads slub and fade along their length."""
    return woven(at, CLOTHS["denim"])


def fabric(at: Place) -> Look:
    """Plain cotton cloth."""
    return woven(at, CLOTHS["fabric"])


def canvas(at: Place) -> Look:
    """Stout unbleached cotton, two threads over two."""
    return woven(at, CLOTHS["canvas"])


def linen(at: Place) -> Look:
    """Flax: uneven threads, thick and thin, light between them."""
    return woven(at, CLOTHS["linen"])


def burlap(at: Place) -> Look:
    """Sackcloth of jute: coarse, hairy, open threads, dark holes between, loose fibres over them."""
    cloth, flat = woven(at, CLOTHS["burlap"]), at.flat
    hair = marks(at, 0.02, 0.00022, 6, 0.8, 6.28, 9, 0.7, 0.5)
    color = mix(cloth.color, each(hair.random(1), 1.0, "#b39059", "#d0b07a", "#8b6a3c"), 0.6 * hair.cover)
    return cloth._replace(color=tint(color, 0.05 * noise(flat, 0.02, 10)), height=cloth.height + 2e-4 * hair.cover)


def wool(at: Place) -> Look:
    """Woven tweed: twill of mixed grey yarns, flecks of other wools, a haze of hairs."""
    kind = CLOTHS["wool"]
    cloth, flat = woven(at, kind), at.flat
    hair = marks(at, 0.012, 0.00012, 9, 0.8, 6.28, 9, 0.7, 0.6)
    fleck = fbm(flat, Spectrum(0.0022, 0.0005, 1.0, tails=0.6, patch=0.4), 10)
    neps = np.clip(fleck - 2.4, 0, 1) * fading(0.0005, at.footprint)
    color = mix(cloth.color, palette(hair.random(1), "#6a645d", "#b9b1a6"), 0.35 * hair.cover)
    color = mix(tint(color, 0.06 * fleck), palette(noise(flat, 0.004, 11) * 0.4 + 0.5, "#8a5a3a", "#c9bda6", "#4f5d6a"), neps)
    return cloth._replace(color=color, height=cloth.height + 1e-4 * hair.cover)


def silk(at: Place) -> Look:
    """Satin: long floats of fine bright threads, softly moving light, hardly a weave to be seen."""
    flat = at.flat
    cloth = woven(at, CLOTHS["silk"])
    fold = fbm(warped(flat, 0.01, 0.08, 20, 2), Spectrum(0.08, 0.02, 0.5, (0.5, 1.5, 1)), 21)
    streak = fbm(flat, Spectrum(0.03, 0.0005, 0.95, (0.04, 1, 1), tails=0.4, patch=0.5), 22)
    color = shade(cloth.color, 0.14 * np.sin(1.6 * fold) + 0.05 * streak)
    rough = np.clip(0.36 - 0.05 * fold + 0.03 * streak, 0.1, 1)
    return cloth._replace(color=color, roughness=rough, height=cloth.height + 8e-4 * fold)


SETT = (("#7a1a20", 8), ("#1c2a22", 1), ("#7a1a20", 2), ("#1d3b2c", 9), ("#c9a53f", 1), ("#1d3b2c", 9), ("#7a1a20", 2),
        ("#1c2a22", 1), ("#7a1a20", 8), ("#1a2138", 6), ("#d9d4c8", 1), ("#1a2138", 6))  # fmt: skip
"""A tartan's colours and how many threads each runs for, in turn."""


def striped(within: Array, footprint: Array, length: float) -> Array:
    """The sett's colours. Args: within (P,) −1 … 1; length of the sett, metres. Returns: (3, P)."""
    total = sum(count for _, count in SETT)
    color: Array
    x, color, start = (within + 1) / 2 * length, np.zeros((3, len(within)), np.float32), 0.0
    for stop, count in SETT:
        end = start + count / total * length
        middle, half = (start + end) / 2, (end - start) / 2
        share = sum(line(x - middle + shift, half, footprint) for shift in (-length, 0, length))
        color, start = color + palette(np.zeros(1, np.float32), stop) * share, end
    return color


def tartan(at: Place) -> Look:
    """Twill whose warp and weft repeat the same stripes: squares of pure colour where they meet, mixed ones elsewhere."""
    kind = Cloth((), (), 0.0008, "twill 2/2", 0.95, 0.14, 0.2, 0.10, 0.05, 0.7)
    draw, warp, rise, vary = threads(at, kind)
    mean = usual(weave, kind.pitch, kind.draft, kind.fill)["height"]
    bands = [striped(within, at.footprint, fitted) for within, _, fitted in (repeats(at, 0.13, axis) for axis in (0, 1))]
    hair = marks(at, 0.008, 0.00009, 6, 0.8, 6.28, 9, 0.7, 0.6)
    color = shade(mix(bands[1], bands[0], warp), 1.2 * vary + 0.2 * (draw.random(1) - 0.5) * draw.seen)
    color = relieved(color, rise, mean, kind.depth) * (0.95 + 0.4 * hair.cover)
    color = tint(color, 0.06 * (draw.random(2) - 0.5) * draw.seen)
    return Look(color, np.clip(0.9 - 0.12 * (rise - mean) + 0.2 * vary, 0, 1), 0.0, 0.3 * kind.pitch * (rise - mean), 0.3)


def thread_rise(loops: "Loops | Pile", mean: float) -> Array:
    """Rise of loops, their mean where single ones cannot be seen. Returns: (P,)."""
    return mean + (loops.height - mean) * loops.seen


def wool_knit(at: Place) -> Look:
    """Stocking stitch of plied wool: columns of V-shaped loops, three plies twisted, a haze of hairs."""
    flat = at.flat
    bent = warped(flat, 0.0004, 0.02, 1, 2)
    loops = knit(Place(bent.p, bent.p[:2], at.face, at.footprint, at.period, at.seed), 0.0072, 0.0054, 3)
    ply = np.cos(2 * np.pi * (1.1 * loops.across + 4.2 * loops.along)) * fading(0.0018, at.footprint)
    fibre = fbm(warped(flat, 0.0005, 0.003, 4, 2), Spectrum(0.0022, 0.0002, 1.0, (0.5, 1.6, 1), 0.4, 0.1, 0.4), 6)
    hair = marks(at, 0.012, 0.00016, 8, 0.8, 6.28, 9, 0.7, 0.7)
    wide = fbm(flat, Spectrum(0.15, 0.01, 0.8, patch=0.4), 7)
    mean = usual(knit, 0.0072, 0.0054)["height"]
    rise = thread_rise(loops, mean)
    own = 0.5 + 0.35 * (loops.random(1) - 0.5) * loops.seen + 0.10 * wide + 0.14 * fibre
    color = averaged(own, 0.1 * (1 - loops.seen), "#b7a88d", "#cdc1a8", "#ddd4bf")
    color = relieved(shade(color, 0.10 * ply + 0.09 * fibre), rise, mean, 0.95)
    color = mix(color, palette(hair.random(1), "#cfc4ac", "#ece5d6"), 0.35 * hair.cover)
    height = 0.0018 * (rise - mean) + 1.5e-4 * ply + 6e-5 * fibre + 1e-4 * hair.cover
    return Look(
        tint(color, 0.02 * noise(flat, 0.03, 8)), np.clip(0.92 + 0.03 * fibre - 0.08 * (rise - mean), 0, 1), 0.0, height
    )


def felt(at: Place) -> Look:
    """Wool pressed without a thread: heathered grey of white, grey and black fibres that lie every way, soft clouds, fluff."""
    flat = at.flat
    bent = warped(flat, 0.0003, 0.004, 1, 3)
    cloud = fbm(bent, Spectrum(0.022, 0.0012, 0.8, patch=0.3), 2)
    fine = fbm(warped(flat, 0.0003, 0.0012, 3, 2), Spectrum(0.0012, 0.0001, 1.0, tails=0.4, patch=0.3), 4)
    color, height = palette(0.5 + 0.05 * cloud + 0.12 * fine, "#6f6e6b", "#84837f", "#989792"), 4e-5 * cloud + 5e-6 * fine
    lain = Place(bent.p, bent.p[:2], at.face, at.footprint, at.period, at.seed)
    for k, share in enumerate((0.65, 0.55, 0.5)):
        hair = marks(lain, 0.0042, 0.00013, 16, 1.1 * k, 6.28, 6 + k, 0.5, 0.7)
        tone = each(hair.random(1), fading(0.00013, at.footprint), "#4a4947", "#8c8b87", "#7b7a76", "#a7a6a1", "#d6d5d0")
        color, height = mix(color, tone, share * hair.cover), height + 9e-6 * hair.cover
    color = tint(shade(color, 0.04 * cloud + 0.06 * fine), 0.03 * noise(flat, 0.01, 12))
    return Look(color, np.clip(0.95 + 0.03 * fine + 0.01 * cloud, 0, 1), 0.0, height - 5e-5)


def velvet(at: Place) -> Look:
    """Dense upright pile: deep where it faces you, pale where it was stroked the other way, in large soft-edged swathes; close
    up a fine stipple of fibre tips."""
    flat = at.flat
    bent = warped(flat, 0.03, 0.16, 1, 2)
    nap = fbm(bent, Spectrum(0.16, 0.05, 0.45, patch=0.3), 2)
    stroke = fbm(warped(flat, 0.004, 0.03, 5, 2), Spectrum(0.03, 0.006, 0.6, (0.7, 1.4, 1), patch=0.5), 3)
    tip = fbm(flat, Spectrum(0.0010, 0.00012, 1.1, tails=0.4, skew=0.15, patch=0.2), 4)
    turned = 0.42 * np.tanh(1.1 * nap) + 0.10 * stroke
    spectrum = Spectrum(0.0010, 0.00012, 1.1)
    color = averaged(
        0.42 + 0.24 * turned + 0.10 * tip, 0.10 * lost(flat, spectrum), "#3a0812", "#5a0d1c", "#7d1428", "#a62e40", "#c55a66"
    )
    color = tint(shade(color, 0.04 * tip), 0.04 * stroke)
    return Look(color, np.clip(0.76 - 0.08 * turned + 0.04 * tip, 0, 1), 0.0, 3e-4 * nap + 4e-5 * stroke + 5e-6 * tip)


class Pile(NamedTuple):
    """Loops of yarn heaped on one another. height: (P,) 0 … 1.2 of the topmost. tone: (P,) 0 … 1, of its yarn. ply: (P,) −1 … 1
    over its strands. seen: (P,) how much of single loops the footprint shows."""

    height: Array
    tone: Array
    ply: Array
    seen: Array


def pile(at: Place, length: float, width: float, bend: float, seed: int) -> Pile:
    """Loops that flop every way, in four layers. length, width: of a loop, metres. bend: how far it curls."""
    seen = fading(0.7 * width, at.footprint)
    sharp = replace(at, footprint=np.minimum(at.footprint, np.float32(0.05 * width)))  # loops hide one another as they are
    rise, tone, ply = (np.full(len(at), value, np.float32) for value in (0.12, 0.5, 0.0))
    for k in range(4):
        loop = marks(sharp, length, width, 12, 1.9 * k, 6.28, seed + k, 0.45, bend)
        thin = np.sqrt(np.clip(1 - loop.along * loop.along, 1e-3, 1))  # loops narrow towards their ends
        back = np.sqrt(np.clip(1 - np.square(loop.across / thin), 0, 1))
        arch = 0.22 * (k + 1) + 0.34 * back * (0.4 + 0.6 * thin)
        on = (back > 0) & (arch > rise)
        rise, tone = np.where(on, arch, rise), np.where(on, loop.random(1), tone)
        turn = np.cos(2 * np.pi * (1.4 * length / width * loop.along / 2 + 0.5 * loop.across))
        ply = np.where(on, turn, ply)
    return Pile(np.clip(rise, 0, 1.2), 0.5 + (tone - 0.5) * seen, ply * fading(width / 3, at.footprint), seen)


def carpet(at: Place) -> Look:
    """Loops of heathered wool that flop every way, thick two-ply yarn, dark between, shaded where feet trod."""
    flat = at.flat
    loops, mean = pile(flat, 0.0125, 0.0050, 0.6, 1), usual(pile, 0.0125, 0.0050, 0.6, 1)["height"]
    rise = thread_rise(loops, mean)
    fibre = fbm(warped(flat, 0.0006, 0.003, 7, 2), Spectrum(0.0016, 0.0002, 1.0, tails=0.4, skew=-0.1, patch=0.4), 8)
    trod = fbm(warped(flat, 0.02, 0.1, 5, 3), Spectrum(0.3, 0.006, 0.8, patch=0.5), 6)
    wool = 0.5 + 0.8 * (loops.tone - 0.5) + 0.14 * fibre
    color = averaged(wool, 0.25 * (1 - loops.seen), "#6f6257", "#8b7b6c", "#a39281", "#b6a693")
    color = relieved(shade(color, 0.14 * fibre + 0.10 * loops.ply + 0.08 * trod), rise, mean, 1.0)
    height = 0.0042 * (rise - mean) + 1.5e-4 * loops.ply + 8e-5 * fibre + 0.001 * trod
    return Look(color, np.clip(0.95 + 0.03 * fibre - 0.06 * (rise - mean), 0, 1), 0.0, height)


def towel(at: Place) -> Look:
    """Terry: soft white cotton loops that flop every way, in faint rows of the loom, twisted, shaded at their feet."""
    flat = at.flat
    loops, mean = pile(flat, 0.0044, 0.0014, 0.9, 1), usual(pile, 0.0044, 0.0014, 0.9, 1)["height"]
    rise = thread_rise(loops, mean)
    fibre = fbm(warped(flat, 0.0003, 0.0016, 7, 2), Spectrum(0.0014, 0.00012, 1.0, tails=0.4, patch=0.3), 8)
    wide = fbm(flat, Spectrum(0.08, 0.003, 0.9, patch=0.4), 9)
    across, _, pitch = repeats(flat, 0.0034, 0)
    row = np.cos(np.pi * across) * fading(pitch / 2, at.footprint)
    color = palette(0.6 + 0.25 * (loops.tone - 0.5) + 0.10 * fibre, "#d8d6d0", "#e6e4df", "#efede9")
    color = relieved(shade(color, 0.04 * fibre + 0.04 * loops.ply + 0.03 * wide + 0.02 * row), rise, mean, 0.5)
    height = 0.0010 * (rise - mean) + 3e-5 * loops.ply + 2e-5 * fibre + 1e-4 * wide + 1.2e-4 * row
    return Look(tint(color, 0.02 * noise(flat, 0.02, 12)), np.clip(0.96 + 0.03 * fibre, 0, 1), 0.0, height)


def corduroy(at: Place) -> Look:
    """Cotton pile in upright wales, worn paler along their backs, the ground weave in the furrows."""
    flat = at.flat
    bent = strayed(flat, 0.003, 0.0002, 1)
    across, _, pitch = repeats(bent, 0.0032, 0)
    shown = fading(pitch / 2, at.footprint)
    back = (np.sqrt(np.clip(1 - across * across, 0, 1)) - 0.785) * shown
    pile_of = fbm(flat, Spectrum(0.0008, 0.0001, 1.0, (0.9, 1.1, 1), 0.3, 0.1, 0.2), 3)
    cross = fbm(flat, Spectrum(0.0026, 0.0004, 0.9, (1.2, 0.8, 1), 0.2, patch=0.3), 4)
    worn = fbm(flat, Spectrum(0.12, 0.004, 0.8, (1, 1.5, 1), patch=0.5), 5)
    color = palette(
        0.45 + 0.10 * pile_of + 0.03 * cross + 0.04 * worn + 0.12 * back, "#4a3a2a", "#6a543d", "#8a7054", "#a58b6e"
    )
    color = color * np.maximum(1 + 0.95 * back, 0.05)
    color = tint(shade(color, 0.08 * pile_of + 0.02 * cross), 0.04 * noise(flat, 0.02, 6))
    height = 0.0010 * back + 4e-5 * pile_of + 4e-5 * cross
    return Look(color, np.clip(0.9 - 0.12 * back + 0.03 * pile_of, 0, 1), 0.0, height)


def rope(at: Place) -> Look:
    """Hemp rope wound turn by turn: three strands laid round one another, hairy, a dark line between the turns."""
    flat = at.flat
    loops = laid(flat, 0.014, 0.012, 1)
    mean = usual(laid, 0.014, 0.012)["height"]
    rise = thread_rise(loops, mean)
    slanted = flat.moved(np.stack([-flat.p[1], 0 * flat.p[1], 0 * flat.p[1]]))
    fibre = fbm(slanted, Spectrum(0.0032, 0.0002, 1.0, (1, 6, 1), 0.4, -0.15, 0.4), 3)
    hair = marks(at, 0.016, 0.00018, 8, 0.9, 3.0, 4, 0.7, 0.6)
    own = 0.5 + 0.35 * (loops.random(1) - 0.5) * loops.seen + 0.16 * fibre
    color = averaged(own, 0.1 * (1 - loops.seen), "#8a6a3e", "#b08c58", "#cdb07d", "#dec699")
    color = relieved(shade(color, 0.12 * fibre), rise, mean, 1.05)
    color = mix(color, palette(hair.random(1), "#b4935e", "#e0cca2"), 0.45 * hair.cover)
    height = 0.005 * (rise - mean) + 1.5e-4 * fibre + 2e-4 * hair.cover
    return Look(tint(color, 0.05 * noise(flat, 0.03, 5)), np.clip(0.88 + 0.05 * fibre - 0.1 * (rise - mean), 0, 1), 0.0, height)


def wicker(at: Place) -> Look:
    """Peeled willow woven round upright stakes: canes bow out before each and dive behind the next."""
    flat = at.flat
    bent = strayed(flat, 0.004, 0.0004, 1)
    loops = wickerwork(bent, 0.022, 0.0052, 2)
    mean = usual(wickerwork, 0.022, 0.0052)["height"]
    rise = thread_rise(loops, mean)
    grain = fbm(flat, Spectrum(0.0024, 0.0003, 1.0, (8, 0.6, 1), 0.4, -0.2, 0.4), 3)
    stain = fbm(flat, Spectrum(0.04, 0.001, 0.9, (3, 0.6, 1), 0.3, -0.2, 0.5), 4)
    own = 0.5 + 0.5 * (loops.random(1) - 0.5) * loops.seen + 0.14 * stain + 0.08 * grain
    color = averaged(own, 0.14 * (1 - loops.seen), "#76502a", "#9c7140", "#bd925a", "#d3af7a")
    color = relieved(shade(color, 0.08 * grain + 0.05 * stain), rise, mean, 1.25)
    rough = 0.58 - 0.16 * (rise - mean) + 0.04 * grain
    return Look(
        tint(color, 0.1 * (loops.random(2) - 0.5) * loops.seen), np.clip(rough, 0, 1), 0.0, 0.004 * (rise - mean) + 4e-5 * grain
    )


def straw(at: Place) -> Look:
    """Threshed stalks lying over each other every way: hollow, ribbed along, some split, some with a node, dark beneath."""
    flat = at.flat
    grit = fbm(flat, Spectrum(0.004, 0.0004, 1.0, tails=0.4, patch=0.4), 1)
    lean = np.where(noise(flat, 0.03, 20) > 0, flat.p[1], -flat.p[1])
    deep = fbm(flat.moved(np.stack([lean, 0 * lean, 0 * lean])), Spectrum(0.012, 0.0015, 1.0, (0.5, 9, 1), 0.3, patch=0.4), 21)
    color, height = palette(0.42 + 0.2 * deep + 0.05 * grit, "#4f3a17", "#8a6a33", "#b58f4c", "#cda968"), -0.007 + 8e-4 * deep
    for k in range(4):
        stalk = marks(at, 0.12, 0.0048, 9, 0.7 + 0.9 * k, 2.6, 2 + k, 0.5, 0.08)
        inside = abs(stalk.across) < 2
        side = np.clip(np.where(inside, stalk.across, 0), -1, 1)
        rib = np.cos(np.pi * (4 * side + 3 * stalk.random(3))) * fading(0.001, at.footprint)
        node = np.exp(-(((stalk.along - 1.4 * (stalk.random(4) - 0.5)) / 0.012) ** 2)) * (stalk.random(5) < 0.5)
        tone = each(stalk.random(1), 1.0, "#a3803c", "#c39c50", "#d8b568", "#e2c684", "#b58e48", "#ead6a2", "#93743a")
        tone = shade(tone, 0.09 * rib + 0.07 * grit - 0.45 * (side * side - 0.33) + 0.10 * (k - 2.4) - 0.5 * node)
        color = mix(color, tint(tone, 0.1 * (stalk.random(2) - 0.5)), stalk.cover)
        height = mix(height, -0.005 + 0.0028 * k + 0.0016 * np.sqrt(np.clip(1 - side * side, 0, 1)) + 3e-4 * node, stalk.cover)
    return Look(color, np.clip(0.58 + 0.05 * grit - 6 * height, 0, 1), 0.0, height)


def lace(at: Place) -> Look:
    """Cotton lace over a dark lining: a net of hexagons, flowers of close stitching with a corded outline, trailing stems."""
    flat = strayed(at.flat, 0.002, 0.00025, 1)
    net = hexagons(flat, 0.0026, 2)
    mesh = line(net.border, 0.00022, at.footprint)
    mesh = 0.3 + (mesh - 0.3) * net.seen
    bed = cells(flat, 0.046, 3, 0.45, (1, 1, 40))
    x, y, _ = bed.offset
    angle = np.arctan2(y, x) + np.float32(6.28) * bed.random(1)
    away, petals = np.hypot(x, y), np.where(bed.random(2) < 0.5, 5, 6)
    wave = abs(np.cos(0.5 * petals * angle))
    size = np.float32(0.0150) + np.float32(0.0045) * bed.random(3)
    outline = size * (0.52 + 0.48 * wave**0.7) - away
    heart, eye = 0.26 * size - away, abs(away - 0.34 * size)
    stem = abs(fbm(flat, Spectrum(0.05, 0.025, 0.4), 4)) * np.float32(0.011)
    leaf = stem - np.float32(0.0028) * np.clip(fbm(flat, Spectrum(0.012, 0.006, 0.6), 5) - 0.35, 0, 1)
    stitch = weave(flat, 0.0005, "plain", 0.8, 6)
    ridge = (stitch.height - 0.5) * stitch.seen
    cord = np.maximum.reduce([line(outline, 0.00055, at.footprint), line(heart, 0.0004, at.footprint),
                              line(stem, 0.0005, at.footprint) * (outline < 0)])  # fmt: skip
    holes = (abs(eye) < 0.0011) * (np.cos(14 * angle) > 0.1) * fading(0.001, at.footprint)
    close = np.maximum(edge(outline, at.footprint) * (1 - 0.9 * holes), edge(-leaf, at.footprint) * (outline < 0))
    cover = np.maximum.reduce([mesh, cord, 0.93 * close])
    fibre = fbm(flat, Spectrum(0.0012, 0.0001, 1.0, tails=0.3, patch=0.4), 7)
    thread = palette(0.6 + 0.14 * fibre + 0.2 * ridge, "#cfc9ba", "#e2ddd0", "#efebe0", "#f6f3ea")
    thread = shade(thread, 0.05 * fibre + 0.25 * ridge * close - 0.12 * (mesh > close))
    color = mix(palette(0.5 + 0.1 * fibre, "#3c3630", "#4a433c"), thread, cover)
    height = 1.5e-4 * mesh + 2.2e-4 * close * (1 + 0.4 * ridge) + 3e-4 * cord - 2.5e-4
    return Look(color, np.clip(0.86 + 0.03 * fibre, 0, 1), 0.0, height, cover)


LOOKS = {
    "denim": denim, "fabric": fabric, "canvas": canvas, "linen": linen, "burlap": burlap, "wool": wool, "wool knit": wool_knit,
    "felt": felt, "velvet": velvet, "silk": silk, "carpet": carpet, "corduroy": corduroy, "towel": towel, "tartan": tartan,
    "rope": rope, "wicker": wicker, "straw": straw, "lace": lace,
}  # fmt: skip
METRES = {
    "denim": 0.12, "fabric": 0.08, "canvas": 0.12, "linen": 0.08, "burlap": 0.2, "wool": 0.12, "wool knit": 0.15, "felt": 0.06,
    "velvet": 0.25, "silk": 0.08, "carpet": 0.25, "corduroy": 0.12, "towel": 0.12, "tartan": 0.26, "rope": 0.2, "wicker": 0.3,
    "straw": 0.4, "lace": 0.14,
}  # fmt: skip
