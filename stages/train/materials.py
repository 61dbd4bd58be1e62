"""Random materials with captions: a caption is drawn, the reader of prompts says what it means, and chance varies that.

So what the prior is taught of words is what a prompt with these words begins with, give or take what they leave open.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from torch import Tensor

from stages.core.color import srgb_encode
from stages.material.recipe import Coat, Mask, Recipe
from stages.prior.model import VOCABULARY_FILE
from stages.prior.prompt import Reading
from stages.prior.vocabulary import Vocabulary
from stages.train.captions import caption, phrase, substance

COLOR, CHANNEL, ROUGHNESS = 0.03, 0.018, 0.05
"""Deviations of a coat's sRGB colour, of each channel besides, and of its roughness from what words say."""

CONTRAST, METRES, SHARE, SIZE = 0.2, 0.35, 0.2, 0.25
"""Likewise of the logarithms of its contrast, of the object's size, and of a mask's share and size."""


@dataclass(frozen=True)
class RandomMaterial:
    """A recipe, not settled, and a caption for it."""

    caption: str
    recipe: Recipe


class Tables:
    """All that reading a caption takes: its words are in the tables, so no network is asked."""

    def __init__(self) -> None:
        self.vocabulary = Vocabulary.load(VOCABULARY_FILE)

    def read(self, prompts: list[str]) -> Tensor:
        raise AssertionError(f"{prompts}: a caption holds only words that a table knows")


@cache
def tables() -> Tables:
    """Loaded once."""
    return Tables()


def random_material(rng: Generator) -> RandomMaterial:
    """Draw a material."""
    text = caption(rng)
    return RandomMaterial(text, varied(rng, Reading(tables()).recipe(text, int(rng.integers(2**31)))))


def random_coat(rng: Generator) -> tuple[str, Coat]:
    """A phrase of one substance, and what it calls for."""
    text = phrase(rng, substance(rng))
    return text, Reading(tables()).recipe(text, 0).base


def varied(rng: Generator, recipe: Recipe) -> Recipe:
    """A recipe with its numbers moved at random, within what its words mean."""
    metres = np.exp(rng.normal(0, METRES))

    def coat(old: Coat) -> Coat:
        color = None if old.color is None else _near(rng, np.array(old.color))
        rough = None if old.roughness is None else float(np.clip(old.roughness + rng.normal(0, ROUGHNESS), 0, 1))
        contrast = old.contrast * float(np.exp(rng.normal(0, CONTRAST)))
        return replace(old, color=color, roughness=rough, contrast=contrast, metres=float(old.metres * metres))

    def mask(old: Mask) -> Mask:
        share, size = (float(v * np.exp(rng.normal(0, s))) for v, s in ((old.share, SHARE), (old.size, SIZE)))
        return replace(old, share=min(share, max(old.share, 0.95)), size=size)

    layers = (replace(old, coat=coat(old.coat), masks=tuple(map(mask, old.masks))) for old in recipe.layers)
    return replace(recipe, base=coat(recipe.base), layers=tuple(layers))


def _near(rng: Generator, color: NDArray) -> tuple[float, float, float]:
    red, green, blue = np.clip(color + rng.normal(0, COLOR) + rng.normal(0, CHANNEL, 3), 0.02, 0.98).tolist()
    return red, green, blue


def encoded(values: NDArray) -> NDArray[np.float32]:
    """Materials (P, 5) with their albedo as sRGB, the way the model sees them."""
    return np.concatenate([srgb_encode(values[:, :3]), values[:, 3:]], 1).astype(np.float32)
