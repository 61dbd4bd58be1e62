"""Captions: what a thing is made of, in many wordings, as users write prompts and `stages.prior.prompt` reads them."""

import re
from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from stages.prior.colors import draw_named
from stages.prior.names import FINISHES, FINISHES_METAL, HELD_OUT, OBJECTS, SUBSTANCES
from stages.prior.objects import OBJECTS as THINGS
from stages.prior.places import GATHERS, ONCE, WEATHER
from stages.prior.stuffs import KNOWN

_KEPT = {word for phrase, _ in HELD_OUT for word in phrase.split() if " " not in phrase}


def taught(names: Sequence[str]) -> list[str]:
    """Those of some names without a word that is kept for tests."""
    return [name for name in names if not _KEPT & set(re.findall("[a-z]+", name.lower()))]


SHARES = np.cumsum([s.weight for s in SUBSTANCES])[:-1] / sum(s.weight for s in SUBSTANCES)
"""Upper end of each substance's share of [0, 1), but the last's."""

MORE = taught(sorted(KNOWN.keys() - {name for s in SUBSTANCES for name in s.names}))
METALS = taught([name for name, found in KNOWN.items() if found[0].metallic])
GATHERING = taught([name for name in (*GATHERS, *ONCE) if name in KNOWN])
PAINTS = taught([name for name, found in KNOWN.items() if found[0].family == "paint"])
MADE = [name for name in taught([*THINGS]) if THINGS[name].made and taught([THINGS[name].made])]

MORE_SHARE, COLORED, FINISHED, WORN, BARE_THING, COMPOSED_SHARE = 0.25, 0.75, 0.4, 0.14, 0.08, 0.4
"""Shares: of substances that only the reading of prompts knows; of those that take colours, a colour; of all, a finish, wear;
of captions, those that name a thing alone, and those of two substances."""

PREFIXES = ("a photo of ", "a 3d render of ", "a rendering of ", "a picture of ", "an image of ", "realistic ", "")
SUFFIXES = (", highly detailed", ", 4k", ", realistic", ", photorealistic", ", studio lighting", ", pbr", " texture",
            " material", " surface", ", detailed texture")
VIEWS = (", front view", ", side view", ", back view", ", top view", ", overhead view")

SIMPLE = (
    ("{x}", 0.34), ("a {o} made of {x}", 0.16), ("a {x} {o}", 0.24), ("{o}, {x}", 0.08), ("{o} of {x}", 0.06),
    ("a statue of a {o} in {x}", 0.05), ("{x} {o}", 0.07),
)
COMPOSED = (
    ("any", 0.5, (
        "{y} top and {x} base", "{x} base and {y} top", "{x} bottom with {y} top", "{y} on top, {x} below",
        "upper half {y}, lower half {x}", "{x} with a {y} top", "{x} with a {y} lid", "{x} with a {y} rim",
        "half {x} half {y}", "{x} fading into {y}", "{x} with {y} spots", "{x} with {y} dots", "{y} spots on {x}",
        "{x} speckled with {y}", "{x} with {y} stripes", "striped {x} and {y}", "{y} stripes on {x}", "{x} with {y} bands",
        "{x} with {y} checks", "{x} with patches of {y}", "{x} with {y} patches", "{x} stained with {y}",
        "{x} streaked with {y}", "{x} mixed with {y}", "{x} with {y} edges",
    )),
    ("metal", 0.2, (
        "{x} with {y} trim", "{x} with {y} trim on the edges", "{x}, {y} borders", "{x} edged with {y}",
        "{x} with worn edges showing {y}", "{x} inlaid with {y}", "{x} with {y} bands", "{x} with {y} veins",
    )),
    ("gathers", 0.2, (
        "{x} with {y} in the crevices", "{x}, {y} in the grooves", "{x} with {y} in the cracks", "{x} with {y} in recesses",
        "{x} covered in {y}", "{x} with {y} on top", "{x} partly covered in {y}", "{y} covered {x}",
    )),
    ("paint", 0.1, ("{y} peeling off {x}", "{y} on {x}", "worn {y} showing {x}", "{x} under peeling {y}")),
)  # fmt: skip
"""What the second substance y is drawn from, its share, and the wordings of what it does on the first, x."""


def template_words() -> set[str]:
    """Every word that a caption has beside the names of materials and objects."""
    simple, composed = (text for text, _ in SIMPLE), (text for *_, texts in COMPOSED for text in texts)
    wordings = [*simple, *composed, *PREFIXES, *SUFFIXES, *VIEWS]
    return {word for text in wordings for word in re.findall("[a-z]+", text.format(x="", y="", o="").lower())}


def pick(rng: Generator, options: Sequence[str]) -> str:
    """One of the options, all alike likely."""
    return options[int(rng.integers(len(options)))]


def substance(rng: Generator) -> str:
    """A name, by the share of what it names."""
    if rng.random() < MORE_SHARE:
        return pick(rng, MORE)
    return pick(rng, SUBSTANCES[int(np.searchsorted(SHARES, rng.random(), side="right"))].names)


def phrase(rng: Generator, name: str) -> str:
    """A substance with the colour, the finish and the wear that it may be asked for with: "red glossy plastic"."""
    stuff = KNOWN[name][0]
    paintable = any(s.paintable for s in KNOWN[name]) and not stuff.metallic
    color = draw_named(rng)[0] if paintable and rng.random() < COLORED else ""
    finish = pick(rng, finishes(name)) if rng.random() < FINISHED else ""
    wear = pick(rng, taught(list(WEATHER))) if rng.random() < WORN else ""
    if color and rng.random() < 0.06:
        return " ".join(filter(None, (wear, finish, name, "in", color)))
    if finish and rng.random() < 0.12:
        return " ".join(filter(None, (wear, color, name))) + f", {finish}"
    parts = [finish, color] if rng.random() < 0.6 else [color, finish]
    return " ".join(filter(None, (wear, *parts, name)))


def finishes(name: str) -> list[str]:
    """Words of finish that suit a substance."""
    stuff = KNOWN[name][0]
    if stuff.metallic:
        return list(FINISHES_METAL)
    dull = stuff.family in ("fabric", "paper", "rust")
    return [word for word, (low, _) in FINISHES.items() if not dull or low >= 0.35]


def caption(rng: Generator) -> str:
    """A caption: of one substance, of two and how the second lies, or of a thing that everybody knows."""
    kind = rng.random()
    if kind < BARE_THING:
        body = f"a {pick(rng, MADE)}"
    elif kind < BARE_THING + COMPOSED_SHARE:
        body = composed(rng)
    else:
        wording = str(rng.choice([text for text, _ in SIMPLE], p=[share for _, share in SIMPLE]))
        body = wording.format(x=phrase(rng, substance(rng)), o=pick(rng, OBJECTS))
    prefix = pick(rng, PREFIXES) if rng.random() < 0.25 else ""
    suffix = pick(rng, SUFFIXES) if rng.random() < 0.2 else ""
    return prefix + body + suffix + (pick(rng, VIEWS) if rng.random() < 0.3 else "")


def composed(rng: Generator) -> str:
    """Of two substances."""
    of, _, wordings = COMPOSED[int(rng.choice(len(COMPOSED), p=[share for _, share, _ in COMPOSED]))]
    names = {"metal": METALS, "gathers": GATHERING, "paint": PAINTS}.get(of)
    second = pick(rng, names) if names else substance(rng)
    body = pick(rng, wordings).format(x=phrase(rng, substance(rng)), y=phrase(rng, second))
    return f"a {pick(rng, OBJECTS)}, {body}" if rng.random() < 0.4 else body
