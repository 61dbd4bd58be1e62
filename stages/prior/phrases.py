"""A prompt cut into phrases: what is named, its colour and finish, its wear, and where it lies.

The grammar is that of a buyer's list, not of English: a phrase is a run of words about one substance; "with", "and", "on",
"covered in" join phrases; parts ("sole", "rim") and patterns ("stripes") say where a phrase lies. What no table knows is left
to the reader. """

import re
import unicodedata
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from stages.prior.colors import CHANGES, COLORS, LEANINGS
from stages.prior.names import FINISHES, FINISHES_METAL, SUBSTANCES
from stages.prior.objects import OBJECTS
from stages.prior.places import ANIMALS, FADED, PARTS, SHAPES, WEATHER, WET, Region

FILLER = (
    "a photo of", "a photograph of", "a 3d render of", "a rendering of", "a picture of", "an image of", "a model of", "highly detailed",
    "detailed texture", "detailed", "realistic", "photorealistic", "studio lighting", "physically based", "pbr", "4k", "8k", "texture",
    "material", "surface", "front view", "side view", "back view", "top view", "overhead view", "high quality", "masterpiece",
    "beautiful", "made of", "made from", "made out of", "carved from", "carved out of", "cut from", "built of", "a", "an", "the", "of",
    "is", "in", "its", "some", "very", "all", "from", "entirely", "completely", "colored", "coloured", "color", "colour",
)  # fmt: skip

JOINS = {
    "with": "with", "and": "with", "plus": "with", "has": "with", "having": "with", "featuring": "with",
    "covered in": "cover", "covered with": "cover", "covered by": "cover", "coated in": "cover", "coated with": "cover",
    "overgrown with": "cover", "smothered in": "cover", "caked in": "cover", "under a layer of": "cover",
    "partly covered in": "partly", "partly covered with": "partly", "speckled with": "spots", "dotted with": "spots",
    "stained with": "partly", "mixed with": "partly", "on": "on", "over": "over", "above": "above", "atop": "above",
    "below": "below", "under": "below", "beneath": "below", "peeling off": "peel", "peeling from": "peel", "flaking off": "peel",
    "flaking from": "peel", "chipping off": "peel", "chipped off": "peel", "wearing off": "peel", "showing": "show",
    "revealing": "show", "exposing": "show", "inlaid with": "inlay", "edged with": "edge", "trimmed with": "edge",
    "trimmed in": "edge", "edged in": "edge", "striped with": "stripe", "banded with": "band",
}  # fmt: skip
"""Words between two phrases, and how they join them."""


@dataclass
class Phrase:
    """One run of words. join: how it follows the phrase before it, "" for the first. words: all of them, for the reader.

    substance: a name of `SUBSTANCES`. colors: words that make up its colour. finish: words. weather: of `WEATHER`, `FADED`,
    `WET`. thing: of `OBJECTS`. animal: of `ANIMALS`. region: where it lies, and the word that said so. """

    join: str = ""
    words: list[str] = field(default_factory=list)
    substance: str = ""
    colors: list[str] = field(default_factory=list)
    finish: list[str] = field(default_factory=list)
    weather: list[str] = field(default_factory=list)
    unknown: list[str] = field(default_factory=list)
    thing: str = ""
    animal: str = ""
    region: Region | None = None
    where: str = ""

    @property
    def says_what(self) -> bool:
        """Whether it names a stuff or a colour."""
        return bool(self.substance or self.colors or self.thing or self.animal or self.unknown)


def split(prompt: str) -> list[Phrase]:
    """The phrases of a prompt, in its order; at least one."""
    phrases = [Phrase()]
    for kind, text, value in _tokens(prompt):
        now = phrases[-1]
        if kind == "join" or kind == "comma" or (kind == "substance" and now.substance and not now.region):
            if kind == "join" and value in ("above", "below") and (now.region is None):
                now.region, now.where = _half(value), text  # "gold above, oak below"
            join = value if kind == "join" else "with"
            if now.says_what or now.region:
                phrases.append(Phrase(join))
            elif kind == "join":
                now.join = join if len(phrases) > 1 else ""
            if kind != "substance":
                continue
            now = phrases[-1]
        _take(now, kind, text, value)
    return _merged([p for p in phrases if p.says_what or p.region or p.finish or p.weather]) or [Phrase()]


def _half(side: str) -> Region:
    return Region("above" if side == "above" else "below", 0.5)


def _take(phrase: Phrase, kind: str, text: str, value: Any) -> None:
    """Put a token where it belongs in a phrase."""
    phrase.words.append(text)
    if kind == "substance":
        phrase.substance = text
    elif kind in ("color", "finish", "weather", "unknown"):
        {"color": phrase.colors, "finish": phrase.finish, "weather": phrase.weather, "unknown": phrase.unknown}[kind].append(text)
    elif kind in ("part", "shape") and (phrase.region is None or kind == "part"):
        phrase.region, phrase.where = value, text
    elif kind == "thing":
        phrase.thing = text
    elif kind == "animal":
        phrase.animal = text


def _merged(phrases: list[Phrase]) -> list[Phrase]:
    """Finish and wear that stand alone ("bronze, polished") belong to the phrase before; "worn edges showing brass" lends its
    place."""
    result: list[Phrase] = []
    for phrase in phrases:
        if result and not phrase.says_what and not phrase.region:
            result[-1].finish += phrase.finish
            result[-1].weather += phrase.weather
        elif result and phrase.join == "show":
            place = result[-1]
            if not place.says_what and place.region:
                result.pop()
                phrase.region, phrase.where = place.region._replace(wear=1.0), place.where
            phrase.region = phrase.region or Region("edges", 0.12, 0.06, 1.0)
            result.append(phrase)
        else:
            result.append(phrase)
    return result


def _tokens(prompt: str) -> list[tuple[str, str, Any]]:
    """(kind, words, value) of each known phrase, the longest first, and of each word that none knows."""
    plain = unicodedata.normalize("NFKD", prompt.lower()).encode("ascii", "ignore").decode()
    words = re.findall(r"[a-z]+(?:-[a-z]+)*|[,;.:()]", plain)
    table, longest = _table()
    found: list[tuple[str, str, Any]] = []
    at = 0
    while at < len(words):
        if words[at] in ",;.:()":
            found.append(("comma", ",", None))
            at += 1
            continue
        for length in range(min(longest, len(words) - at), 0, -1):
            text = " ".join(words[at : at + length])
            hit = table.get(text) or table.get(text.replace("-", " ")) or (table.get(singular(text)) if length == 1 else None)
            if hit:
                if hit[0] != "filler":
                    found.append((hit[0], hit[2], hit[1]))
                at += length
                break
        else:
            pieces = words[at].split("-")
            words[at : at + 1] = pieces if len(pieces) > 1 else [words[at]]
            if len(pieces) == 1:
                found.append(("unknown", words[at], None))
                at += 1
    return _resolved(found)


def singular(word: str) -> str:
    """A word without its plural ending."""
    for ending, instead in (("ies", "y"), ("ves", "f"), ("es", ""), ("s", "")):
        if word.endswith(ending) and len(word) > len(ending) + 2:
            return word.removesuffix(ending) + instead
    return word


def _resolved(found: list[tuple[str, str, Any]]) -> list[tuple[str, str, Any]]:
    """A word that is both a colour and a substance is a colour where a substance or a part follows it at once."""
    result = []
    for number, (kind, text, value) in enumerate(found):
        following = found[number + 1][0] if number + 1 < len(found) else ""
        if kind == "substance" and text in COLORS and following in ("substance", "shape"):
            kind = "color"
        if kind == "part" and following == "substance" and text in ("top", "base", "cover", "roof", "frame"):
            kind = "unknown"  # "roof tiles"
        result.append((kind, text, value))
    return [token for token in result if token[0] != "unknown" or token[1] not in ("roof", "cover")]


@cache
def _table() -> tuple[dict[str, tuple[str, Any, str]], int]:
    """Every phrase that is known, as (kind, value, itself), and the most words that one has. Later entries win."""
    table: dict[str, tuple[str, Any, str]] = {}

    def enter(kind: str, entries: dict[str, Any]) -> None:
        for text, value in entries.items():
            table[text] = (kind, value, text)

    enter("thing", {name: thing for name, thing in OBJECTS.items()})
    enter("part", PARTS)
    enter("shape", SHAPES)
    enter("color", {**COLORS, **CHANGES, **LEANINGS})
    enter("finish", {**FINISHES, **FINISHES_METAL})
    enter("weather", {**WEATHER, **FADED, **WET})
    enter("animal", ANIMALS)
    enter("substance", {name: substance for substance in reversed(SUBSTANCES) for name in substance.names})
    enter("join", JOINS)
    enter("part", {f"on {place}": PARTS["top"] for place in ("top", "top of it")} | {"on the bottom": PARTS["bottom"]})
    enter("filler", dict.fromkeys(FILLER))
    return table, max(len(text.split()) for text in table)
