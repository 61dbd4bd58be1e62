"""The words of a prompt as tokens: each phrase that a table knows, the longest first, and each word that none knows."""

import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from itertools import takewhile
from typing import Any, NamedTuple

from stages.prior.colors import CHANGES, COLORS, COMMON, LEANINGS
from stages.prior.names import FINISHES, FINISHES_METAL
from stages.prior.objects import OBJECTS, words
from stages.prior.places import ANIMALS, FADED, PARTS, SHAPES, WEATHER, WET
from stages.prior.sizes import TIMES
from stages.prior.stuffs import FINISH_LOOKS, KNOWN, LOOK_OF

FILLER = words(
    "a photo of, a photograph of, a d render of, d render of, render of, a rendering of, a picture of, an image of, "
    "a model of, highly detailed, detailed texture, detailed, realistic, photorealistic, studio lighting, "
    "physically based, pbr, k, texture, material, "
    "surface, front view, side view, back view, top view, overhead view, high quality, masterpiece, beautiful, made of, "
    "made from, made out of, made in, carved from, carved out of, cut from, built of, built from, a, an, the, is, are, at, "
    "its, some, very, all, from, entirely, completely, slightly, heavily, partly, partially, fully, looks like, made, of it, "
    "texturing, finish, finished, print, pattern, patterned, style, both, each, that, which, it, lots of, bits of, pieces of, "
    "layer of, a bit of, a few, many, thick, thin, small amounts of, around, along, growing, underneath, on it, all over, "
    "everywhere, s, this, their, other, one, simple, nice, piece of, block of, part, piece, parts, half-timbered, out, "
    "coat of, coats of, coating of, splash of, touch of, set of, pair of, sheet of, slab of, lump of, was, were, be, for, as, "
    "tint, hue, tone, sheen, shine, glow, glowing, like"
)
"""Words that say nothing of a material."""


class Join(NamedTuple):
    """How a phrase and the one before it lie. kind: a key of `JOINED`, or "peel", "show". beneath: the second is beneath."""

    kind: str
    beneath: bool = False


def _joins(kind: str, text: str, beneath: bool = False) -> dict[str, Join]:
    return {word: Join(kind, beneath) for word in words(text)}


JOINS = {
    **_joins("with", "with, plus, has, have, having, featuring, including, but with, but, complete with"),
    **_joins("and", "and"),
    **_joins("cover", "covered in, covered with, covered by, coated in, coated with, overgrown with, overgrown by, "
             "smothered in, "
             "caked in, caked with, under a layer of, dusted with, dusted in, encrusted with, topped by a layer of, clad in, "
             "blanketed in, buried in, wrapped in, dipped in, plated in, plated with, draped in, drenched in, "
             "covered over with"),
    **_joins("partly", "partly covered in, partly covered with, partially covered in, partially covered with, stained with, "
             "mixed with, splattered with, spattered with, splashed with, stained by, smeared with, mottled with, "
             "patched with"),
    **_joins("spots", "speckled with, dotted with, flecked with, spotted with, sprinkled with"),
    **_joins("stud", "studded with, riveted with"), **_joins("inlay", "inlaid with, inlaid in, veined with, shot through with"),
    **_joins("edge", "edged with, trimmed with, trimmed in, edged in, bordered with, bordered by, framed in, framed by, "
             "framed with"),
    **_joins("rim", "rimmed with, rimmed in"), **_joins("cap", "capped with, capped in"),
    **_joins("top", "topped with, topped by"),
    **_joins("tip", "tipped with"), **_joins("line", "lined with, lined in"), **_joins("stripe", "striped with, striped in"),
    **_joins("band", "banded with, bound in, hooped with, ringed with, banded in"), **_joins("streak", "streaked with"),
    **_joins("check", "checkered with, chequered with"),
    **_joins("peel", "peeling off, peeling from, peeling away from, flaking off, flaking from, chipping off, chipped off, "
             "wearing off, "
             "coming off, chipping away from, peeling over, flaking over, worn off", beneath=True),
    **_joins("show", "showing, revealing, exposing, worn down to, worn away to, chipped down to, chipped to, rubbed down to, "
             "worn through to, that shows, that reveals, worn to reveal, chipped away to reveal, scraped down to, "
             "peeled back to"),
    **_joins("through", "showing through, shining through, visible through, peeking through, visible under, "
             "visible beneath", True),
    **_joins("fade", "fading into, fading to, fades into, fades to, blending into, blending to, turning into, turning to, "
             "turns into, turns to, becoming, becomes, "
             "transitioning to, transitioning into, gradient to, merging into, melting into, dissolving into, changing into"),
    **_joins("on", "on, onto, atop, upon, across, out of, growing on, growing out of, growing from, emerging from, mounted on, "
             "standing on, sitting on, resting on, lying on, painted on, painted onto, printed on, splashed on", True),
             **_joins("over", "over, on top of, applied to, laid over", True),
    **_joins("above", "above, over top", True), **_joins("below", "below, under, beneath", True),
    **_joins("of", "of"), **_joins("to", "to"), **_joins("in", "in, into, set in, set into, embedded in"),
}  # fmt: skip
"""Words between two phrases, and how these lie."""

POSTFIX = {
    word: kind for kind, text in (
        ("cover", "covered, coated, clad, encrusted, crusted, caked, dusted, wrapped, bound, upholstered"),
        ("partly", "stained, splattered, spattered, splashed, smeared, mottled, patched"),
        ("edge", "trimmed, edged, bordered, framed, piped"), ("spots", "spotted, dotted, speckled, flecked"),
        ("check", "checked, checkered"), ("rim", "rimmed"), ("cap", "capped"), ("tip", "tipped"), ("top", "topped"),
        ("vein", "veined"), ("inlay", "inlaid"), ("stripe", "striped"), ("band", "banded"), ("line", "lined"),
        ("sole", "soled"),
        ("handle", "handled"), ("stud", "studded"), ("streak", "streaked"), ("all", "plated"), ("legs", "legged"),
        ("bottom", "bottomed"),
    ) for word in words(text)
}  # fmt: skip
"""Words after what lies on the thing that follows ("moss-covered stone"), and how it does."""

DYED = ("colored", "coloured", "tinted", "dyed", "toned", "hued", "color", "colour")
"""Words that make a substance's name that of a colour."""


class Token(NamedTuple):
    """kind: as in `_table`. text: as the table spells it. value: of the table. article: whether "a" or "an" stood before it."""

    kind: str
    text: str
    value: Any = None
    article: bool = False


def tokens_of(prompt: str, explained: Mapping[str, Sequence[str]]) -> list[Token]:
    """Each known phrase, the longest first, and each word that none knows."""
    plain = unicodedata.normalize("NFKD", prompt.lower()).encode("ascii", "ignore").decode()
    heard = re.findall(r"[a-z]+(?:-[a-z]+)*|[,;.:()/&+]", plain)
    found: list[Token] = []
    at, article = 0, False
    while at < len(heard):
        if not heard[at][0].isalpha():
            found.append(Token("join", heard[at], Join("and")) if heard[at] in "&+/" else Token("comma", heard[at]))
            at += 1
            continue
        token, length = _longest(heard, at)
        if token is None and "-" in heard[at]:
            heard[at : at + 1] = heard[at].split("-")
            continue
        if token is None:
            found += [part._replace(article=article) for part in _explained(heard[at], explained)]
        elif token.kind != "filler":
            found.append(token._replace(article=article))
        article = heard[at] in ("a", "an")
        at += length
    return _resolved(found)


def _longest(heard: list[str], at: int) -> tuple[Token | None, int]:
    """The longest phrase that is known at a place, and its length in words."""
    table, longest = _table()
    for length in range(min(longest, len(heard) - at), 0, -1):
        *before, last = heard[at : at + length]
        for spelling in (last, last.replace("-", " "), *singulars(last)):
            text = " ".join([*before, spelling])
            if text in table:
                return table[text], length
            if text.replace("-", " ") in table:
                return table[text.replace("-", " ")], length
    return None, 1


def _explained(word: str, explained: Mapping[str, Sequence[str]]) -> list[Token]:
    """A word that no table knows, as the colours by which a dictionary explains it, or as it is."""
    told = next((explained[w] for w in (word, *singulars(word)) if w in explained), ())
    if told and all(w in COLORS or w in CHANGES or w in LEANINGS for w in told):
        return [Token("color", w) for w in told]
    return [Token("unknown", word)]


def singulars(word: str) -> list[str]:
    """What a word may be the plural of."""
    endings = (("ies", "y"), ("ves", "f"), ("ves", "fe"), ("es", ""), ("s", ""))
    return [word.removesuffix(end) + instead for end, instead in endings if word.endswith(end) and len(word) > len(end) + 2]


PLACED = words("on, on the, at, at the, to the, in the, around, around the, along, along the, on its, in its, over the, "
               "inside the")
"""What may stand before a part to say that something lies there."""


def _resolved(found: list[Token]) -> list[Token]:
    """Words that are both a colour and a thing or a substance are colours where another says what has it."""
    result: list[Token] = []
    for number, token in enumerate(found):
        ahead = _run(found[number + 1 :])
        behind = _run(reversed(result))
        names = {t.kind for t in ahead} & {"substance", "thing"}
        if token.text in COLORS and token.kind in ("substance", "thing"):
            shaped = any(t.kind == "shape" or (t.kind == "part" and token.text not in KNOWN) for t in ahead)
            if token.text in KNOWN and KNOWN[token.text][0].family != "gem":
                names -= {"thing"}  # "an ivory comb", but "an emerald car"
            if names or shaped or any(t.kind == "substance" for t in behind):
                token = Token("color", token.text)
        if token.kind == "color" and token.article and not ahead and token.text in OBJECTS:
            token = Token("thing", token.text)  # "an orange"
        elif token.kind == "thing" and token.text in KNOWN and not names:
            token = Token("substance", token.text)
        elif token.kind == "thing" and token.text in PARTS and (result or ahead):
            token = Token("part", token.text, PARTS[token.text])
        result.append(token)
    return result


def _run(tokens: Iterable[Token]) -> list[Token]:
    """The tokens up to what ends a phrase."""
    return list(takewhile(lambda token: token.kind not in ("join", "comma", "half", "postfix"), tokens))


@cache
def _table() -> tuple[dict[str, Token], int]:
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
    enter("color", [w for w in (*COLORS, *CHANGES, *LEANINGS) if w in COMMON or (w not in KNOWN and w not in OBJECTS)])
    enter("finish", {**FINISHES, **FINISHES_METAL, **FINISH_LOOKS})
    enter("weather", {**WEATHER, **FADED, **WET})
    enter("animal", ANIMALS)
    enter("dyed", DYED)
    enter("size", TIMES)
    enter("filler", FILLER)
    enter("postfix", POSTFIX)
    enter("join", JOINS)
    enter("part", {f"{word} {place}": PARTS[place] for word in PLACED for place in PARTS} | {"on top of it": PARTS["top"]})
    enter("half", ("half", "half of it", "the other half", "other half", "one half", "one side", "the other side", "and half"))
    return table, max(len(text.split()) for text in table)
