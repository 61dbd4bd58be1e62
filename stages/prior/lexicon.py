"""Every phrase that a table knows, as a token, and the longest that a prompt has at a place. Words that say nothing are in
fillers.tsv, those that join phrases in joins.tsv."""

from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any, NamedTuple

from stages.prior.colors import CHANGES, COLORS, COMMON, LEANINGS, LIKENED
from stages.prior.names import FINISHES, FINISHES_METAL
from stages.prior.objects import OBJECTS, rows, words
from stages.prior.places import ANIMALS, FADED, PARTS, SHAPES, WEATHER, WET, Region
from stages.prior.sizes import TIMES
from stages.prior.stuffs import FINISH_LOOKS, KNOWN, LOOK_OF

FILLER = [word for row in rows("fillers.tsv") for word in words(row[0])]
"""Words that say nothing of a material."""

DEGREES = {
    **dict.fromkeys(words(
        "slightly, lightly, a bit, a little bit, a touch, somewhat, mildly, subtly, faintly, barely, gently, "
        "a light dusting of, light dusting of, a dusting of, dusting of, a hint of, hint of, hints of, a touch of, touch of, "
        "touches of, traces of, a trace of, a thin layer of, thin layer of, a thin coat of, thin coat of, "
        "a light coat of, a thin coating of, "
        "sprinkling of, a sprinkling of, small amounts of, a few, a bit of, a little bit of, partly, partially"), 0.55),
    **dict.fromkeys(words(
        "heavily, extremely, badly, severely, thickly, totally, utterly, deeply, fully, completely, thoroughly, "
        "a thick layer of, "
        "thick layer of, a heavy layer of, a thick coat of, thick coat of, lots of, plenty of, a lot of, very"), 1.6),
}  # fmt: skip
"""How much of what follows: factor of the share that it covers."""

DENIALS = words(
    "without, without any, no, not, never, free of, minus, excluding, instead of, rather than, lacking, devoid of, non, "
    "neither, nothing, "
    "other than, than, no longer"
)
"""Words that say that what follows is not there."""

SPARED = words("or, nor")
"""Words that go on with what is denied."""


class Join(NamedTuple):
    """How a phrase and the one before it lie. kind: a key of `JOINED`, or "peel", "show". beneath: the second is beneath."""

    kind: str
    beneath: bool = False


JOINS = {
    word: Join(kind, bool(beneath))
    for kind, beneath, place, told in rows("joins.tsv") if place == "between" for word in words(told)
}  # fmt: skip
"""Words between two phrases, and how these lie."""

POSTFIX = {word: kind for kind, _, place, told in rows("joins.tsv") if place == "after" for word in words(told)}
"""Words after what lies on the thing that follows ("moss-covered stone"), and how it does."""

ASIDE = words("near, beside, beside the, next to, next to the, behind, behind the, in front of, in front of the, "
              "close to, close to the, by the")
"""Words before a thing that only says where another is: "rust streaks beside the tap"."""

PAINTED = ("painted", "lacquer", "enamel", "whitewash", "gilded", "japanned")
"""What is said of a stuff after its name: "iron painted black"."""

DYED = ("colored", "coloured", "tinted", "dyed", "toned", "hued", "color", "colour")
"""Words that make a substance's name that of a colour."""


class Token(NamedTuple):
    """kind: as in `known_words`. text: as the table spells it. value: of the table. article: "a" or "the" before it."""

    kind: str
    text: str
    value: Any = None
    article: str = ""


def alone_word(word: str) -> Token | None:
    """A single word of wear or finish, if it is one."""
    token = known_words()[0].get(word)
    return token if token and token.kind in ("weather", "finish") else None


def longest_known(heard: list[str], at: int) -> tuple[Token | None, int]:
    """The longest phrase that is known at a place, and its length in words."""
    table, longest = known_words()
    for length in range(min(longest, len(heard) - at), 0, -1):
        *before, last = heard[at : at + length]
        plain = plain_forms(last)
        for spelling in (last, last.replace("-", " "), *singulars(last), f"{last}s", *plain):
            text = " ".join([*before, spelling])
            joined = [text.replace(" ", "")] if length == 2 and _compounds(text, table) else []  # "surf board"
            for known in (text, text.replace("-", " "), text.replace("-", ""), text.replace(" ", "-"), *joined):
                if known in table and (spelling not in plain or table[known].kind in COMPARED):
                    return table[known], length
    return None, 1


def _compounds(text: str, table: Mapping[str, Token]) -> bool:
    """Whether two words may be a thing's name that is written as one: neither is a colour, nor a word that joins."""
    known = [table[word].kind for word in text.split(" ") if word in table]
    whole = table.get(text.replace(" ", ""))
    return whole is not None and whole.kind == "thing" and set(known) <= {"thing", "substance", "part", "unknown"}


COMPARED = ("color", "finish", "weather", "size", "degree")
"""Kinds of words that have a comparative: a pitcher is not more pitch."""


def plain_forms(word: str) -> list[str]:
    """What a word may be the comparative or superlative of."""
    stems = [word.removesuffix(end) for end in ("er", "est") if word.endswith(end) and len(word) > len(end) + 3]
    return [plain for stem in stems for plain in (stem, f"{stem}e", f"{stem.removesuffix('i')}y")]


def singulars(word: str) -> list[str]:
    """What a word may be the plural of."""
    endings = (("ies", "y"), ("ves", "f"), ("ves", "fe"), ("es", ""), ("s", ""))
    cut = [(word.removesuffix(e), e, instead) for e, instead in endings if word.endswith(e) and len(word) > len(e) + 2]
    return [stem + instead for stem, end, instead in cut if end != "es" or stem.endswith(HISSING)]  # "tines" are no tins


HISSING = ("s", "x", "z", "ch", "sh", "o", "ss")
"""What stems end with whose plural ends in -es."""

PLACED = words("near, near the, near its, towards the, toward the, on, on the, at, at the, to the, in the, around, "
               "around the, along, along the, on its, in its, over the, "
               "inside the")
"""What may stand before a part to say that something lies there."""


@cache
def known_words() -> tuple[dict[str, Token], int]:
    """Every phrase that is known, and the most words that one has. Later entries win."""
    table: dict[str, Token] = {}

    def enter(kind: str, entries: Mapping[str, Any] | Iterable[str]) -> None:
        values = entries if isinstance(entries, Mapping) else dict.fromkeys(entries)
        table.update({text: Token(kind, text, value) for text, value in values.items()})

    enter("unknown", LOOK_OF)
    enter("substance", KNOWN)
    enter("thing", OBJECTS)
    enter("part", PARTS)
    enter("shape", SHAPES)
    other = {*KNOWN, *OBJECTS, *LIKENED}
    enter("color", [word for word in (*COLORS, *CHANGES, *LEANINGS) if word in COMMON or word not in other])
    enter("finish", {**FINISHES, **FINISHES_METAL, **FINISH_LOOKS})
    enter("weather", {**WEATHER, **FADED, **WET})
    enter("animal", ANIMALS)
    enter("dyed", DYED)
    enter("size", TIMES)
    enter("filler", FILLER)
    enter("degree", DEGREES)
    enter("denial", DENIALS)
    enter("join", {word: Join("and") for word in SPARED})
    enter("postfix", POSTFIX)
    enter("join", JOINS)
    enter("part", {f"{word} {place}": PARTS[place] for word in PLACED for place in PARTS} | {"on top of it": PARTS["top"]})
    enter("filler", [f"{word} {place}" for word in ("from the", "from its", "down from the") for place in PARTS])
    enter("part", {f"up to {the}{place}": Region("below", 0.45) for the in ("", "the ", "its ") for place in PARTS})
    enter("part", {f"up from {the}{place}": Region("below", 0.45) for the in ("", "the ", "its ") for place in PARTS})
    for side, strip in (("base", "below"), ("bottom", "below"), ("top", "above")):
        enter("part", {f"{word} {side}": Region(strip, 0.18) for word in ("along the", "along its")})
    aside = [place for place, region in PARTS.items() if region.kind == "sides"]
    for side in ("left", "right"):
        enter("part", {f"{side} {place}": Region(side, 0.5 * PARTS[place].share) for place in aside})
    enter("part", {"on one half": Region("right", 0.5), "on the other half": Region("left", 0.5)})
    enter("part", {"on one side": Region("right", 0.4), "on the other side": Region("left", 0.4)})
    enter("aside", ASIDE)
    enter("half", ("half", "half of it", "the other half", "other half", "one half", "one side", "the other side", "and half"))
    for known, *others in rows("spellings.tsv"):
        table |= {other: table[known] for other in words(others[0]) if other not in table}
    return table, max(len(text.split()) for text in table)
