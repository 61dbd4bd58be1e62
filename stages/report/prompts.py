"""The fixed prompts that a prior is judged by, each with the material that it truly means.

Of what is taught the truth is read off the tables that teach it; words that are never in a training caption have values
from elsewhere: CSS and dictionary colours, and what a measured sample of such a material shows. Colours are sRGB.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.prior.colors import COLORS, rgb
from stages.prior.names import FINISHES, FINISHES_METAL, SUBSTANCES


@dataclass(frozen=True)
class Meaning:
    """A material on average: sRGB albedo, roughness, metallic."""

    color: tuple[float, float, float]
    roughness: float
    metallic: float

    def row(self) -> NDArray[np.float64]:
        """(5,)."""
        return np.array([*self.color, self.roughness, self.metallic])


@dataclass(frozen=True)
class Prompt:
    """A prompt and its truth. unseen: a word of it was never taught. top: what the upper half is, where that differs."""

    text: str
    meaning: Meaning
    unseen: bool = False
    top: Meaning | None = None


def taught(name: str, color: str = "", finish: str = "") -> Meaning:
    """What the training data mean by a substance, a colour word and a finish word."""
    substances = [s for s in SUBSTANCES if name in s.names and (s.paintable or not color)]
    of = substances[0]
    anchors = [COLORS[color]] if color else of.colors
    low, high = (FINISHES_METAL if of.metallic else FINISHES)[finish] if finish else of.roughness
    red, green, blue = np.mean([rgb(text) for text in anchors], 0).tolist()
    return Meaning((red, green, blue), (low + high) / 2, of.metallic)


def known(color: str, roughness: float, metallic: float = 0.0) -> Meaning:
    """A material from its sRGB hex colour."""
    red, green, blue = rgb(color).tolist()
    return Meaning((red, green, blue), roughness, metallic)


def _seen(text: str, name: str, color: str = "", finish: str = "") -> Prompt:
    return Prompt(text, taught(name, color, finish))


def _new(text: str, color: str, roughness: float, metallic: float = 0.0) -> Prompt:
    return Prompt(text, known(color, roughness, metallic), unseen=True)


def _two(base: str, top: str) -> Prompt:
    return Prompt(f"{base} base and {top} top", taught(base), top=taught(top))


IDENTIFIED = (
    _seen("gold", "gold"), _seen("oak wood", "oak"), _seen("white marble", "marble"), _seen("rust", "rust"),
    _seen("black rubber", "black rubber"), _seen("red plastic", "plastic", "red"), _seen("concrete", "concrete"),
    _seen("chrome", "chrome"), _seen("blue glazed ceramic", "ceramic", "blue"), _seen("green moss", "moss"),
)
"""Ten prompts far apart: each result must lie nearest to its own truth among them."""

PROMPTS = (
    *IDENTIFIED,
    _seen("silver", "silver"), _seen("brass", "brass"), _seen("cast bronze", "bronze"), _seen("wrought iron", "wrought iron"),
    _seen("stainless steel", "steel"), _seen("copper", "copper"), _seen("titanium", "titanium"),
    _seen("aluminium", "aluminium"), _seen("polished brass", "brass", finish="polished"),
    _seen("brushed steel", "steel", finish="brushed"), _seen("walnut wood", "walnut"), _seen("pine wood", "pine"),
    _seen("bamboo", "bamboo"), _seen("granite", "granite"), _seen("sandstone", "sandstone"), _seen("red brick", "brick"),
    _seen("terracotta", "terracotta"), _seen("white porcelain", "porcelain"), _seen("matte black plastic", "plastic", "black",
          "matte"), _seen("glossy yellow plastic", "plastic", "yellow", "glossy"), _seen("brown leather", "leather"),
    _seen("blue denim", "denim"), _seen("gray wool", "wool", "gray"), _seen("burlap", "burlap"),
    _seen("cardboard", "cardboard"), _seen("jade", "jade"),
    _seen("snow", "snow"), _seen("green painted metal", "painted metal", "green"),
    _seen("verdigris", "verdigris"), _seen("slate", "slate"),
    _two("oak", "gold"), _two("marble", "black rubber"), _two("concrete", "copper"), _two("black rubber", "snow"),
    _two("steel", "oak"), _two("terracotta", "porcelain"), _two("brass", "walnut"), _two("rust", "chrome"),
    _new("mahogany", "#6e2c1c", 0.5), _new("teak wood", "#a0703c", 0.55), _new("cedar wood", "#b0744a", 0.65),
    _new("crimson plastic", "#dc143c", 0.33), _new("gilded", "#ffe29b", 0.27, 1.0), _new("black vinyl", "#1c1c1c", 0.35),
    _new("nylon fabric", "#b8b4ac", 0.7), _new("tweed", "#8a7d6a", 0.92), _new("travertine", "#d2c4a8", 0.6),
    _new("quartzite", "#bcb6b0", 0.6), _new("stoneware pottery", "#a48f76", 0.5), _new("corroded iron", "#7a4528", 0.85),
    _new("cobblestone", "#807c76", 0.85), _new("soapstone", "#6c706c", 0.5), _new("neoprene", "#26282a", 0.75),
    _new("electrum", "#f2e0a4", 0.27, 1.0), _new("palladium", "#d9d6d1", 0.25, 1.0),
    _new("vermilion paint", "#e34234", 0.35), _new("cerulean ceramic", "#2a6bb0", 0.15),
    _new("chartreuse plastic", "#9fdc14", 0.33), _new("ultramarine paint", "#2a20a0", 0.35),
    _new("mauve fabric", "#c0a0cc", 0.89),
    _new("auburn leather", "#7a3a20", 0.55), _new("taupe wool", "#8a7c70", 0.94),
)  # fmt: skip
"""All of them: 40 of one taught material, 8 of two, 24 with a word that was never taught."""

LADDER = (*IDENTIFIED, *[p for p in PROMPTS[len(IDENTIFIED) :] if not p.unseen and p.top is None][::2][:14])
"""Those that the model answers by itself: 24 of one taught material, every second after the first ten."""
