"""Captions: the same material in many wordings, as users write prompts."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from numpy.random import Generator

from stages.prior.names import OBJECTS


@dataclass(frozen=True)
class Words:
    """What a coat is called. substance: "oak"; color: "red" or ""; finish: "worn glossy" or ""; family: "wood"."""

    substance: str
    color: str
    finish: str
    family: str

    def phrase(self, rng: Generator) -> str:
        """"red glossy plastic", "plastic in red, glossy" ..."""
        parts = [part for part in (self.finish, self.color) if part]
        if len(parts) == 2 and rng.random() < 0.4:
            parts.reverse()
        if self.color and rng.random() < 0.06:
            return " ".join([*([self.finish] if self.finish else []), self.substance, "in", self.color])
        if self.finish and rng.random() < 0.12:
            return " ".join([*([self.color] if self.color else []), self.substance]) + f", {self.finish}"
        return " ".join([*parts, self.substance])


PREFIXES = ("a photo of ", "a 3d render of ", "a rendering of ", "a picture of ", "an image of ", "realistic ", "")
SUFFIXES = (", highly detailed", ", 4k", ", realistic", ", photorealistic", ", studio lighting", ", pbr", " texture",
            " material", " surface", ", detailed texture")
VIEWS = (", front view", ", side view", ", back view", ", top view", ", overhead view")

SIMPLE = (
    ("{x}", 0.34), ("a {o} made of {x}", 0.16), ("a {x} {o}", 0.24), ("{o}, {x}", 0.08), ("{o} of {x}", 0.06),
    ("a statue of a {o} in {x}", 0.05), ("{x} {o}", 0.07),
)
COMPOSED = {
    "edges": ("{x} with {y} trim", "{x} with {y} edges", "{x} with {y} trim on the edges", "{x}, {y} borders",
              "{x} edged with {y}", "{x} with worn edges showing {y}", "{x} inlaid with {y}"),
    "top": ("{y} top and {x} base", "{x} base and {y} top", "{x} bottom with {y} top", "{y} on top, {x} below",
            "upper half {y}, lower half {x}", "{x} with a {y} top"),
    "spots": ("{x} with {y} spots", "{x} with {y} dots", "{x} speckled with {y}", "{y} spots on {x}",
              "spotted, {x} and {y}"),
    "stripes": ("{x} with {y} stripes", "striped {x} and {y}", "{y} stripes on {x}", "{x} with {y} bands"),
    "patches": ("{x} with patches of {y}", "{x} partly covered in {y}", "{x} with {y} patches", "{x} stained with {y}",
                "{x} and {y} mixed"),
    "crevices": ("{x} with {y} in the crevices", "{x}, {y} in the grooves", "{x} with {y} in the cracks",
                 "{x} with {y} in recesses"),
}
"""Wordings by where the second substance y lies on the first, x."""


def template_words() -> set[str]:
    """Every word that a caption has beside the names of materials and objects."""
    simple, composed = (text for text, _ in SIMPLE), (text for own in COMPOSED.values() for text in own)
    wordings = [*simple, *composed, *PREFIXES, *SUFFIXES, *VIEWS]
    return {word for text in wordings for word in re.findall("[a-z]+", text.format(x="", y="", o="").lower())}


def pick(rng: Generator, options: Sequence[str]) -> str:
    """One of the options, all alike likely."""
    return options[int(rng.integers(len(options)))]


def pick_weighted(rng: Generator, options: Sequence[tuple[str, float]]) -> str:
    """One of the options, by their shares, which sum to 1."""
    left = rng.random()
    for option, share in options:
        left -= share
        if left < 0:
            return option
    return options[-1][0]


def caption(rng: Generator, base: Words, second: Words | None, kind: str | None) -> str:
    """A caption of one coat, or of two and the way they are laid out."""
    if second is None or kind is None:
        body = pick_weighted(rng, SIMPLE).format(x=base.phrase(rng), o=pick(rng, OBJECTS))
    else:
        body = pick(rng, COMPOSED[kind]).format(x=base.phrase(rng), y=second.phrase(rng))
        if rng.random() < 0.4:
            body = f"a {pick(rng, OBJECTS)}, {body}"
    prefix = pick(rng, PREFIXES) if rng.random() < 0.25 else ""
    suffix = pick(rng, SUFFIXES) if rng.random() < 0.2 else ""
    return prefix + body + suffix + (pick(rng, VIEWS) if rng.random() < 0.3 else "")
