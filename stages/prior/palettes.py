"""Lists of three colours and more that share one thing or one pattern: "red, white and blue stripes"."""

from collections.abc import Sequence
from dataclasses import replace

from stages.prior.lexicon import Join, Token
from stages.prior.objects import OBJECTS
from stages.prior.phrases import Phrase, family, is_hue
from stages.prior.places import JOINED, SHAPES, Region
from stages.prior.senses import LENT
from stages.prior.stuffs import KNOWN

Palette = list[list[str]]
"""Colours, each in the words that make it up."""

LEAST = 3
"""Colours of the shortest list; two are a pair (`motifs`)."""

PANELS = ("panel", "panels", "segment", "segments", "gores", "sections", "wedges")
"""Parts that are a pattern where they are of several colours."""


RAINBOW = ("red", "orange", "yellow", "green", "blue", "violet")


def gathered(tokens: Sequence[Token]) -> list[Token]:
    """The tokens, of which each list of colours is its first, whose value is the list."""
    found: list[Token] = []
    at = 0
    while at < len(tokens):
        if tokens[at].text.startswith("rainbow"):
            found.append(Token("color", "red", [[hue] for hue in RAINBOW], tokens[at].article))
            shaped = any(t.kind == "shape" or t.text in PANELS for t in tokens[at + 1 : at + 2])
            found += [] if shaped else [Token("shape", "bands", SHAPES["rainbow"])]
            at += 1
            continue
        palette, after = _listed(tokens, at)
        if len(palette) < LEAST:
            found.append(tokens[at])
            at += 1
            continue
        *changes, hue = palette[0]
        article = tokens[at].article
        found += [Token("color", word, article=article) for word in changes]
        found.append(Token("color", hue, palette, article))
        at = after
    return [_pattern(token, found[:number]) for number, token in enumerate(found)]


def _listed(tokens: Sequence[Token], at: int) -> tuple[Palette, int]:
    """The colours that a place begins to list, and where the list ends: after "and", or with the prompt."""
    palette: Palette = []
    if at and tokens[at - 1].kind in ("color", "finish"):
        return palette, at
    while True:
        end = at
        while end < len(tokens) and tokens[end].kind == "color":
            end += 1
        metal = end == at and end < len(tokens) and tokens[end].text in LENT
        words = [token.text for token in tokens[at : end + metal]]
        if not any(map(is_hue, words)):
            return [], at
        palette += _apart(words)
        end += metal
        if (len(palette) > 1 and tokens[at - 1].text in ("and", "&", "+")) or end == len(tokens):
            return palette, end
        if tokens[end].kind == "comma" and end + 1 < len(tokens) and tokens[end + 1].text in ("and", "&"):
            end += 1
        if tokens[end].text not in (",", "and", "&", "/"):
            return [], at
        at = end + 1


def _apart(words: list[str]) -> Palette:
    """Colours that no comma parts: "red white and blue"."""
    hues = [k for k, word in enumerate(words) if is_hue(word)]
    if len(hues) < 2:
        return [words]
    return [words[(hues[k - 1] + 1 if k else 0) : at + 1] for k, at in enumerate(hues)]


def _pattern(token: Token, before: Sequence[Token]) -> Token:
    """Panels of several colours as a pattern."""
    hues = [t.kind == "color" or t.text in LENT for t in before[-3:]]
    several = (hues == [True, False, True] and before[-2].text in ("and", "&")) or (hues[-1:] == [True] and before[-1].value)
    return Token("shape", "stripes", SHAPES["stripes"]) if several and token.text in PANELS else token


def spread(phrases: list[Phrase]) -> list[Phrase]:
    """The phrases, each that has a list of colours as its ground and the marks on it."""
    result: list[Phrase] = []
    for number, phrase in enumerate(phrases):
        after = phrases[number + 1] if number + 1 < len(phrases) else Phrase()
        laid = after.join.kind == "on" and after.join.beneath
        result += _spread(phrase, after if laid else phrases[0] if number else phrase) if phrase.palette else [phrase]
    return result


SHARED = ("stripes", "bands", "checks", "zigzag", "gingham", "patches")
"""Kinds of patterns that leave nothing of what they lie on."""


PATTERNS = {"stripe": "stripes", "band": "bands", "check": "checks", "patch": "patches"}
"""Joins that say of a pattern what its word does."""


def _spread(phrase: Phrase, whole: Phrase) -> list[Phrase]:
    plaid = bool(phrase.substance) and KNOWN[phrase.substance][0].look == "tartan"
    part = phrase.within
    usual = SHAPES["checks"] if plaid else SHAPES["patches"]
    if phrase.join.kind in PATTERNS and not phrase.region:
        phrase = replace(phrase, region=JOINED[phrase.join.kind], where=PATTERNS[phrase.join.kind])
    region = phrase.region if phrase.region and phrase.where in SHAPES else usual
    ground = replace(phrase, palette=[], colors=phrase.palette[0])
    if phrase.where in SHAPES:
        place = (part.region, part.where) if part else (None, "") if phrase is whole else (Region("all", 1.0), "")
        ground = replace(ground, region=place[0], where=place[1], within=None, placed=False)
    if phrase.region and phrase.where not in SHAPES:
        part = Phrase(phrase.join, region=phrase.region, where=phrase.where)
    stuff = whole.substance or _made(whole)
    bare = stuff and family(stuff) in ("wood", "metal", "stone") and region.kind in ("stripes", "bands")
    own = (any(map(is_hue, whole.colors)) or whole.join.beneath or bare) and phrase is not whole and not part
    grounded = region.kind in SHARED and not own
    hues = phrase.palette[1:] if grounded else phrase.palette
    share = 1.0 if grounded else min(0.9, 1.5 * region.share)
    count = len(phrase.palette) if grounded else len(hues) + 1
    marks = [
        replace(
            ground, join=Join("with"), colors=hue, region=region._replace(share=share * (1 - (k + 1) / count)), thing="",
            where=phrase.where if phrase.where in SHAPES else "patches", within=part, weather=[], animal="",
        )
        for k, hue in enumerate(hues)
    ]  # fmt: skip
    return [*([ground] if grounded else []), *[_lent(mark, whole) for mark in marks]]


def _made(whole: Phrase) -> str:
    """What a thing is usually made of, where it is of one stuff and no colour."""
    made = OBJECTS[whole.thing].made if whole.thing else ""
    return made if made in KNOWN else ""


def _lent(mark: Phrase, whole: Phrase) -> Phrase:
    """A mark in the colour of a metal, which is of it, but on cloth."""
    stuff = mark.substance or whole.substance or _made(whole)
    metal = mark.colors[0] in KNOWN and family(mark.colors[0]) == "metal"
    if metal and not (stuff and family(stuff) in ("fabric", "leather", "organic", "paper", "plastic")):
        return replace(mark, substance=mark.colors[0], colors=[], boards=False)
    return mark
