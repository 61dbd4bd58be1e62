"""Random materials with captions: a recipe, and words that say what it is."""

import functools
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from stages.core.color import srgb_encode
from stages.prior.colors import COLORS, COMMON, draw_named, rgb
from stages.prior.names import FINISHES, FINISHES_METAL, METALS, SUBSTANCES, Substance
from stages.prior.patterns import DARK_BELOW, LEVEL, placement
from stages.prior.recipe import Coat, Recipe, Surface, draw_layout
from stages.train.captions import Words, caption, pick, pick_weighted

SHARES = np.cumsum([s.weight for s in SUBSTANCES])[:-1] / sum(s.weight for s in SUBSTANCES)
"""Upper end of each substance's share of [0, 1), but the last's."""

COARSEST = 0.6
"""Least frequency of spots and stripes."""

SHARED_FINISH = 0.45
"""Share of coats that a finish word describes."""


@dataclass(frozen=True)
class RandomMaterial:
    """A recipe and a caption for it."""

    caption: str
    recipe: Recipe


KINDS = (("edges", 0.18), ("top", 0.32), ("spots", 0.13), ("stripes", 0.13), ("patches", 0.1), ("crevices", 0.14))
"""Ways to lay a second coat, with their shares."""


def random_material(rng: Generator, composed: float = 0.4) -> RandomMaterial:
    """Draw a material. composed: share of materials with two coats."""
    words, base = draw_coat(rng, draw_substance(rng))
    if rng.random() >= composed:
        return RandomMaterial(caption(rng, words, None, None), Recipe((base,)))
    kind = pick_weighted(rng, KINDS)
    second_words, second = draw_coat(rng, second_substance(rng, kind))
    recipe = Recipe((base, second), draw_layout(rng, kind, COARSEST))
    return RandomMaterial(caption(rng, words, second_words, kind), recipe)


def draw_substance(rng: Generator) -> Substance:
    """A substance by its share."""
    return SUBSTANCES[int(np.searchsorted(SHARES, rng.random(), side="right"))]


def second_substance(rng: Generator, kind: str) -> Substance:
    """What lies on top: in crevices mostly what gathers there, on edges mostly metal."""
    if kind == "crevices" and rng.random() < 0.7:
        gathers = [s for s in SUBSTANCES if s.names[0] in ("moss", "rust", "dirt", "verdigris", "snow")]
        return gathers[rng.integers(len(gathers))]
    if kind == "edges" and rng.random() < 0.5:
        return METALS[rng.integers(len(METALS))]
    return draw_substance(rng)


def draw_coat(rng: Generator, substance: Substance) -> tuple[Words, Coat]:
    """Draw a substance's colour, finish and pattern, and the words that tell them."""
    color, color_word = draw_color(rng, substance)
    roughness = rng.uniform(*substance.roughness)
    pattern, contrast, spread, finish = substance.pattern, substance.contrast, 0.08, ""
    if rng.random() < SHARED_FINISH:
        finish, roughness = draw_finish(rng, substance)
        pattern = "streaks" if finish == "brushed" else pattern
    wear = rng.random()
    worn = wear < 0.12
    if worn:
        condition, lift, spread = WORN[rng.integers(len(WORN))]
        roughness, contrast = min(roughness + lift, 1.0), contrast + 0.12
        finish = condition if not finish else f"{condition} {finish}"
    lightness = contrast * rng.uniform(0.5, 1.2) * (0.35 + 0.65 * float(color.mean()))
    second = color - lightness * 0.5 * (1 + rng.normal(0, 0.12, 3)) * (-1 if rng.random() < 0.15 else 1)
    if pattern in DARK_BELOW:
        second = 2 * color - second
    turn, shift = placement(rng, pattern in LEVEL)
    scale = float(np.exp(rng.uniform(np.log(1.5), np.log(6))))
    words = Words(pick(rng, substance.names), color_word, finish, substance.family)
    spread *= rng.uniform(0.2, 1)
    return words, Coat(color, second, roughness, spread, substance.metallic, pattern, scale, turn, shift)


WORN = (
    # word, what it adds to roughness, how much roughness then varies
    ("worn", 0.12, 0.2), ("scratched", 0.08, 0.2), ("old", 0.12, 0.15), ("dusty", 0.25, 0.12), ("weathered", 0.2, 0.18),
    ("dirty", 0.15, 0.2), ("aged", 0.12, 0.15), ("grimy", 0.12, 0.2),
)


def draw_color(rng: Generator, substance: Substance) -> tuple[NDArray, str]:
    """sRGB (3,) and the word for it, empty when it goes without saying."""
    if substance.paintable and rng.random() < 0.8:
        word, color = draw_named(rng)
        return vary(rng, color, 0.035), word
    first, second = pick(rng, substance.colors), pick(rng, substance.colors)
    if substance.paintable:
        return vary(rng, rgb(first), 0.03), nearest_color(first)
    mixed = rgb(first) + (rgb(second) - rgb(first)) * rng.random()
    return vary(rng, mixed, 0.01 if substance.metallic else 0.025), ""


def draw_finish(rng: Generator, substance: Substance) -> tuple[str, float]:
    """A finish word that suits the substance, and the roughness it means."""
    table = FINISHES_METAL if substance.metallic else FINISHES
    words = list(table)
    if substance.family in ("fabric", "paper", "rust"):
        words = [word for word in words if table[word][0] >= 0.35]
    word = pick(rng, words)
    return word, float(rng.uniform(*table[word]))


def vary(rng: Generator, color: NDArray, amount: float) -> NDArray:
    """A colour nearby: lightness and each channel shifted a little."""
    return np.clip(color + rng.normal(0, amount) + rng.normal(0, amount * 0.6, 3), 0.02, 0.98)


@functools.lru_cache(maxsize=1024)
def nearest_color(text: str) -> str:
    """The common colour name whose sRGB is nearest to that of "#rrggbb"."""
    return min(COMMON, key=lambda word: float(((rgb(COLORS[word]) - rgb(text)) ** 2).sum()))


def stand_in(rng: Generator, count: int) -> Surface:
    """Points of a surface that is mostly flat and open, on which the reader of prompts learns."""
    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return Surface(
        rng.uniform(-0.5, 0.5, (count, 3)).astype(np.float32),
        normal.astype(np.float32),
        rng.normal(0, 0.18, count).clip(-1, 1).astype(np.float32),
        np.abs(rng.normal(0, 0.25, count)).clip(0, 1).astype(np.float32),
    )


def encoded(values: NDArray) -> NDArray[np.float32]:
    """Materials (P, 5) with their albedo as sRGB, the way the model sees them."""
    return np.concatenate([srgb_encode(values[:, :3]), values[:, 3:]], 1).astype(np.float32)
