"""A prompt cut into phrases: what is named, its colour and finish, its wear, and where it lies.

The grammar is that of a buyer's list, not of English: a phrase is a run of words about one substance. Words between phrases
join them ("with", "covered in", "peeling off"); parts ("sole", "rim") and patterns ("stripes") say where a phrase lies. What
no table knows, a dictionary may explain by colours; the rest is kept as unknown. """

import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import takewhile
from typing import Any, NamedTuple

from stages.prior.colors import CHANGES, COLORS, COMMON, LEANINGS
from stages.prior.names import FINISHES, FINISHES_METAL
from stages.prior.objects import OBJECTS
from stages.prior.places import ANIMALS, FADED, PARTS, SHAPES, SHOWS, WEATHER, WET, Region
from stages.prior.sizes import TIMES
from stages.prior.stuffs import BOARDS, FINISH_LOOKS, GENERIC, KNOWN, LOOK_OF, PATTERNED, ROOFS

FILLER = (
    "a photo of", "a photograph of", "a 3d render of", "a rendering of", "a picture of", "an image of", "a model of", "highly detailed",
    "detailed texture", "detailed", "realistic", "photorealistic", "studio lighting", "physically based", "pbr", "k", "texture",
    "material", "surface", "front view", "side view", "back view", "top view", "overhead view", "high quality", "masterpiece",
    "beautiful", "made of", "made from", "made out of", "made in", "carved from", "carved out of", "cut from", "built of",
    "built from", "a", "an", "the", "is", "are", "at", "its", "some", "very", "all", "from", "entirely", "completely",
    "slightly", "heavily", "partly", "partially", "fully", "looks like", "made", "of it", "texturing", "finish", "finished", "print",
    "pattern", "patterned", "style", "both", "each", "that", "which", "it", "lots of", "bits of", "pieces of", "layer of",
    "a bit of", "a few", "many", "thick", "thin", "small amounts of", "around", "along", "growing", "flat shaded", "underneath",
    "on it", "all over", "everywhere", "s", "this", "their", "other", "one", "simple", "nice", "piece of", "block of", "part",
    "piece", "parts", "half-timbered", "out", "coat of", "coats of", "coating of", "splash of", "touch of", "set of", "pair of", "sheet of", "slab of", "lump of", "was", "were", "be", "for", "as",
)  # fmt: skip


class Join(NamedTuple):
    """How a phrase and the one before it lie. kind: a key of `JOINED`, or "peel", "show". beneath: the second is beneath."""

    kind: str
    beneath: bool = False


def _joins(kind: str, text: str, beneath: bool = False) -> dict[str, Join]:
    return {word.strip(): Join(kind, beneath) for word in text.split(",")}


JOINS = {
    **_joins("with", "with, plus, has, have, having, featuring, including, but with, but, complete with"), **_joins("and", "and"),
    **_joins("cover", "covered in, covered with, covered by, coated in, coated with, overgrown with, overgrown by, smothered in, "
             "caked in, caked with, under a layer of, dusted with, dusted in, encrusted with, topped by a layer of, clad in, "
             "blanketed in, buried in, wrapped in, dipped in, plated in, plated with, draped in, drenched in, covered over with"),
    **_joins("partly", "partly covered in, partly covered with, partially covered in, partially covered with, stained with, "
             "mixed with, splattered with, spattered with, splashed with, stained by, smeared with, mottled with, patched with"),
    **_joins("spots", "speckled with, dotted with, flecked with, spotted with, sprinkled with"),
    **_joins("stud", "studded with, riveted with"), **_joins("inlay", "inlaid with, inlaid in, veined with, shot through with"),
    **_joins("edge", "edged with, trimmed with, trimmed in, edged in, bordered with, bordered by, framed in, framed by, framed with"),
    **_joins("rim", "rimmed with, rimmed in"), **_joins("cap", "capped with, capped in"), **_joins("top", "topped with, topped by"),
    **_joins("tip", "tipped with"), **_joins("line", "lined with, lined in"), **_joins("stripe", "striped with, striped in"),
    **_joins("band", "banded with, bound in, hooped with, ringed with, banded in"), **_joins("streak", "streaked with"),
    **_joins("check", "checkered with, chequered with"),
    **_joins("peel", "peeling off, peeling from, peeling away from, flaking off, flaking from, chipping off, chipped off, wearing off, "
             "coming off, chipping away from, peeling over, flaking over, worn off", beneath=True),
    **_joins("show", "showing, revealing, exposing, worn down to, worn away to, chipped down to, chipped to, rubbed down to, "
             "worn through to, that shows, that reveals, worn to reveal, chipped away to reveal, scraped down to, peeled back to"),
    **_joins("through", "showing through, shining through, visible through, peeking through, visible under, visible beneath", True),
    **_joins("fade", "fading into, fading to, fades into, fades to, blending into, blending to, turning into, turning to, "
             "transitioning to, transitioning into, gradient to, merging into, melting into, dissolving into, changing into"),
    **_joins("on", "on, onto, atop, upon, across, out of, growing on, growing out of, growing from, emerging from, mounted on, "
             "standing on, sitting on, resting on, lying on, painted on, painted onto, printed on, splashed on", True), **_joins("over", "over, on top of, applied to, laid over", True),
    **_joins("above", "above, over top", True), **_joins("below", "below, under, beneath", True),
    **_joins("of", "of"), **_joins("to", "to"), **_joins("in", "in, into, set in, set into, embedded in"),
}  # fmt: skip
"""Words between two phrases, and how these lie."""

POSTFIX = {
    **dict.fromkeys(("covered", "coated", "clad", "encrusted", "crusted", "caked", "dusted", "wrapped", "bound", "upholstered"), "cover"),
    **dict.fromkeys(("stained", "splattered", "spattered", "splashed", "smeared", "mottled", "patched"), "partly"),
    **dict.fromkeys(("trimmed", "edged", "bordered", "framed", "piped"), "edge"), "rimmed": "rim", "capped": "cap", "tipped": "tip",
    "topped": "top", "veined": "vein", "inlaid": "inlay", "striped": "stripe", "banded": "band", "lined": "line", "soled": "sole",
    "handled": "handle", "studded": "stud", "streaked": "streak", "plated": "all", "legged": "legs", "bottomed": "bottom",
    **dict.fromkeys(("spotted", "dotted", "speckled", "flecked"), "spots"), **dict.fromkeys(("checked", "checkered"), "check"),
}  # fmt: skip
"""Words after what lies on the thing that follows ("moss-covered stone"), and how it does."""

DYED = ("colored", "coloured", "tinted", "dyed", "toned", "hued", "color", "colour")
"""Words that make a substance's name that of a colour."""


@dataclass
class Phrase:
    """One run of words. join: how it and the phrase before lie.

    substance: a name of `KNOWN`. boards: sawn. colors: words that make up its colour, names of substances among them. finish:
    words. weather: of `WEATHER`, `FADED`, `WET`. unknown: words that no table knows. thing: of `OBJECTS`. animal: of `ANIMALS`.
    region: where it lies. where: the word that said so. placed: whether that word came last. shows: what is beneath, where
    it is said. """

    join: Join = Join("")
    substance: str = ""
    boards: bool = False
    colors: list[str] = field(default_factory=list)
    finish: list[str] = field(default_factory=list)
    weather: list[str] = field(default_factory=list)
    unknown: list[str] = field(default_factory=list)
    size: list[str] = field(default_factory=list)
    thing: str = ""
    animal: str = ""
    region: Region | None = None
    where: str = ""
    placed: bool = False
    shows: "Phrase | None" = None

    @property
    def says_what(self) -> bool:
        """Whether it names a stuff or a colour."""
        return bool(self.substance or self.colors or self.thing or self.animal or self.unknown)

    @property
    def color_only(self) -> bool:
        """Whether all it says of the stuff is its colour."""
        return bool(self.colors) and not (self.substance or self.thing or self.animal or self.unknown)

    @property
    def empty(self) -> bool:
        """Whether it says nothing at all."""
        return not (self.says_what or self.region or self.finish or self.weather or self.size)


class Token(NamedTuple):
    """kind: as in `_table`. text: as the table spells it. value: of the table. article: whether "a" or "an" stood before it."""

    kind: str
    text: str
    value: Any = None
    article: bool = False


def split(prompt: str, explained: Mapping[str, Sequence[str]] | None = None) -> list[Phrase]:
    """The phrases of a prompt, in its order; at least one. Args: explained: a dictionary, as `Vocabulary` has."""
    phrases = [Phrase()]
    tokens = _tokens(prompt, explained or {})
    for number, token in enumerate(tokens):
        now, following = phrases[-1], tokens[number + 1] if number + 1 < len(tokens) else Token("end", "")
        join = _join_of(token, now, following)
        if join is None:
            if token.kind == "join" and token.value.kind == "peel" and "peeling" not in now.weather:
                now.weather.append("peeling")
            if token.kind in ("join", "postfix", "comma", "half"):
                continue
            if _begins(token, now):
                now = Phrase(Join("with"))
                phrases.append(now)
            _take(now, token)
        elif now.empty:
            now.join = join if len(phrases) > 1 else now.join
        else:
            if join.kind in ("above", "below") and now.region is None and following.kind in ("comma", "end", "join"):
                now.region, now.where = Region(join.kind, 0.5), token.text  # "gold above, oak below"
                continue
            phrases.append(Phrase(join))
    return _understood([p for p in phrases if not p.empty]) or [Phrase()]


def _join_of(token: Token, now: Phrase, following: Token) -> Join | None:
    """How the next phrase joins, or None where the token joins nothing."""
    if token.kind == "comma":
        return None if now.empty else Join("comma")
    if token.kind == "postfix":
        if now.color_only and now.join.kind in ("and", "comma") and token.text in SHAPES:
            now.region, now.where = SHAPES[token.text], token.text  # "red and white striped canvas"
            return None
        if not now.says_what and token.text in SHAPES:
            now.region, now.where = SHAPES[token.text], token.text  # "striped canvas"
            return None
        if following.kind == "part":  # "leather-wrapped grip"
            return None
        return Join(token.value, True) if now.says_what and not now.animal else None
    if token.kind == "half":
        return None if now.empty else Join("half")
    if token.kind != "join":
        return None
    if token.value.kind in ("peel", "through") and following.kind in ("comma", "end", "join"):
        return None  # "blue paint peeling off, ..."
    if token.value.kind == "of":
        return Join("of", True) if now.region and now.says_what else None
    if token.value.kind == "in":
        return Join("on", True) if now.says_what and now.where in SHAPES else None
    if token.value.kind == "to":
        return Join("fade") if now.says_what else None
    if token.value.kind in ("on", "over") and following.kind == "part" and now.says_what:
        return None  # "moss on the roof"
    return token.value  # type: ignore[no-any-return]


def _begins(token: Token, now: Phrase) -> bool:
    """Whether a token begins a phrase although no word joins it to the one before: "gold rim white porcelain"."""
    if token.kind == "substance":
        return now.placed or bool(now.thing and now.substance)
    return now.placed and (token.kind == "color" or (token.kind == "part" and now.where in PARTS))


def _take(phrase: Phrase, token: Token) -> None:
    """Put a token where it belongs in a phrase."""
    kind, text = token.kind, token.text
    if kind == "substance":
        _name(phrase, text)
    elif kind in ("color", "finish", "weather", "unknown", "size"):
        words = {"color": phrase.colors, "finish": phrase.finish, "weather": phrase.weather, "unknown": phrase.unknown, "size": phrase.size}
        if text not in words[kind]:
            words[kind].append(text)
    elif kind in ("part", "shape") and (phrase.region is None or kind == "part"):
        phrase.region, phrase.where, phrase.placed = token.value, text, phrase.says_what
    elif kind == "thing" and not phrase.thing:
        phrase.thing = text
    elif kind == "animal":
        phrase.animal = text
    elif kind == "dyed" and phrase.substance:
        phrase.colors, phrase.substance = [*phrase.colors, phrase.substance], ""


def _name(phrase: Phrase, text: str) -> None:
    """A substance's name, which may stand after another: "oak planks", "stone bricks", "gold fabric", "pine wood"."""
    old = phrase.substance
    if text.endswith((" wall", " walls")) and phrase.region is None:
        phrase.region, phrase.where = PARTS["walls"], "walls"
    phrase.boards = phrase.boards or text in BOARDS
    if not old:
        phrase.substance = text
    elif text in BOARDS or (text in GENERIC and _family(old) == _family(text)):
        return  # the first says which
    else:
        phrase.substance = text
        if _family(old) != _family(text) or text in PATTERNED:
            phrase.colors = phrase.colors or [old]


def _family(name: str) -> str:
    return KNOWN[name][0].family


def _understood(phrases: list[Phrase]) -> list[Phrase]:
    """What phrases lend each other."""
    for number, phrase in enumerate(phrases):
        if phrase.where.endswith("roof"):
            phrase.substance = ROOFS.get(phrase.substance, phrase.substance)
        if not phrase.says_what and phrase.where in OBJECTS and len(phrases) == 1:
            phrases[number] = replace(phrase, thing=phrase.where, region=None, where="")  # "a tire"
    result: list[Phrase] = []
    for number, phrase in enumerate(phrases):
        before = result[-1] if result else None
        after = phrases[number + 1] if number + 1 < len(phrases) else None
        if before and phrase.join.kind == "show":
            _show(result, phrase)
        elif before and not phrase.says_what and not phrase.region:  # "bronze, polished"
            before.finish += phrase.finish
            before.weather += [word for word in phrase.weather if word not in before.weather]
        elif before and phrase.join.kind == "comma" and _describes(before, phrase, after):
            _describe(before, phrase)
        elif not phrase.says_what and phrase.region and after and after.join.kind == "comma" and after.says_what and not after.region:
            after.region, after.where, after.join = phrase.region, phrase.where, Join("with")  # "trim: copper"
        elif before and not phrase.says_what and not (phrase.weather or phrase.finish):
            _lend(before, phrase, after, result)
        else:
            result.append(phrase)
    return _in_pairs(result)


def _describes(before: Phrase, phrase: Phrase, after: Phrase | None) -> bool:
    """Whether a phrase after a comma says more of the one before: "a jar, glossy blue"; "oak, brown"."""
    if phrase.region or phrase.thing or (after and after.region and after.join.kind == "and" and after.where not in PARTS):
        return False
    bare = before.thing and not (before.substance or before.colors or before.unknown)
    unsaid = phrase.color_only and bool(before.substance) and not before.colors and not before.region
    return bool(bare and (phrase.says_what)) or unsaid


def _describe(before: Phrase, phrase: Phrase) -> None:
    before.substance = before.substance or phrase.substance
    before.boards |= phrase.boards
    before.colors += phrase.colors
    before.finish += phrase.finish
    before.unknown += phrase.unknown
    before.weather += [word for word in phrase.weather if word not in before.weather]


def _lend(before: Phrase, phrase: Phrase, after: Phrase | None, result: list[Phrase]) -> None:
    """A part without a stuff takes that of its neighbour: "gold rim and handle", "rim and handle of gold"."""
    if phrase.join.kind == "and" and before.region and before.says_what:
        result.append(replace(before, region=phrase.region, where=phrase.where, join=phrase.join))
    elif after and after.join.kind == "and" and after.region and after.says_what:
        result.append(replace(after, region=phrase.region, where=phrase.where, join=phrase.join))


def _show(result: list[Phrase], phrase: Phrase) -> None:
    """"worn red paint revealing steel": what is worn shows it; "worn edges showing brass" lends its place."""
    place = result[-1]
    if len(result) > 1 and place.region and not place.says_what:
        result.pop()
        result[-1].weather = [word for word in result[-1].weather if word not in SHOWS] + ["worn"]
        phrase.region, phrase.where = place.region._replace(wear=1.0), place.where
    if not any(word in SHOWS for word in result[-1].weather):
        result[-1].weather.append("worn")
    result[-1].shows = phrase


def _in_pairs(phrases: list[Phrase]) -> list[Phrase]:
    """Colours side by side share what follows: "red and white striped canvas", "white with red and blue stripes"."""
    for number in range(len(phrases) - 2, -1, -1):
        first, second = phrases[number], phrases[number + 1]
        if not first.color_only or first.region or second.join.kind not in ("and", "comma"):
            continue
        first.thing = first.thing or ("" if second.where in PARTS else second.thing)
        said = second.substance and (second.colors or _family(second.substance) not in ("metal", "gem"))
        if said and second.where not in PARTS:
            first.substance, first.boards = second.substance, second.boards
        if number and second.region and second.where in SHAPES:
            share = second.region.share
            first.region, first.where = second.region._replace(share=min(0.8, 1.3 * share)), second.where
            second.region = second.region._replace(share=0.6 * share)  # the second lies within the first
    return phrases


def _tokens(prompt: str, explained: Mapping[str, Sequence[str]]) -> list[Token]:
    """Each known phrase, the longest first, and each word that none knows."""
    plain = unicodedata.normalize("NFKD", prompt.lower()).encode("ascii", "ignore").decode()
    words = re.findall(r"[a-z]+(?:-[a-z]+)*|[,;.:()/&+]", plain)
    found: list[Token] = []
    at, article = 0, False
    while at < len(words):
        if not words[at][0].isalpha():
            found.append(Token("join", words[at], Join("and")) if words[at] in "&+/" else Token("comma", words[at]))
            at += 1
            continue
        token, length = _longest(words, at)
        if token is None and "-" in words[at]:
            words[at : at + 1] = words[at].split("-")
            continue
        if token is None:
            found += [part._replace(article=article) for part in _explained(words[at], explained)]
        elif token.kind != "filler":
            found.append(token._replace(article=article))
        article = words[at] in ("a", "an")
        at += length
    return _resolved(found)


def _longest(words: list[str], at: int) -> tuple[Token | None, int]:
    """The longest phrase that is known at a place, and its length in words."""
    table, longest = _table()
    for length in range(min(longest, len(words) - at), 0, -1):
        text = " ".join(words[at : at + length])
        spellings = [text, text.replace("-", " "), *(" ".join([*words[at : at + length - 1], one]) for one in singulars(words[at + length - 1]))]
        for spelling in spellings:
            if spelling in table:
                return table[spelling], length
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


def _resolved(found: list[Token]) -> list[Token]:
    """Words that are both a colour and a thing or a substance are colours where another says what has it."""
    result: list[Token] = []
    for number, token in enumerate(found):
        ahead = _run(found[number + 1 :])
        behind = _run(reversed(result))
        names = {t.kind for t in ahead} & {"substance", "thing"}
        if token.text in COLORS and token.kind in ("substance", "thing"):
            shaped = any(t.kind == "shape" or (t.kind == "part" and token.kind == "thing") for t in ahead)
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
    enter("part", {f"{word} {place}": PARTS[place] for word in ("on", "on the", "at the", "to the", "in the", "around the", "along the",
                   "on its", "in its", "at", "around", "along", "over the", "inside the") for place in PARTS} | {"on top of it": PARTS["top"]})
    enter("half", ("half", "half of it", "the other half", "other half", "one half", "one side", "the other side", "and half"))
    return table, max(len(text.split()) for text in table)
