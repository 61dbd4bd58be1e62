"""The words of a prompt as tokens: each phrase that a table knows, the longest first, and each word that none knows."""

import re
import unicodedata
from collections.abc import Container, Mapping, Sequence

from stages.prior.colors import CHANGES, COLORS, LEANINGS, LIKENED
from stages.prior.lexicon import JOINS, SPARED, Join, Token, alone_word, known_words, longest_known, singulars
from stages.prior.names import FINISHES
from stages.prior.places import GATHERS
from stages.prior.senses import hues_of, resolved, run_of
from stages.prior.similes import BELONGINGS, LIKENESS, SIMILES, WORN_OFF
from stages.prior.spelling import respelt


def tokens_of(prompt: str, explained: Mapping[str, Sequence[str]], real: Container[str] = ()) -> list[Token]:
    """Each known phrase, the longest first, and each word that none knows. Args: real: words that are no slips of the pen."""
    prompt = re.sub(r"\s[-–—]+\s|[–—]", " , ", prompt)  # "rust - a ship"
    plain = unicodedata.normalize("NFKD", prompt.lower()).encode("ascii", "ignore").decode()
    plain = re.sub(rf"\b([a-z]{{3,}}[^s\W])s (?=(?:{BELONGINGS})\b)", r"\1's ", plain)
    plain = re.sub(r"(?:\b([a-z]+) )?\b([a-z-]+)(?:'s|(?<=s)') ([a-z-]+(?: [a-z-]+)?)", _owned, plain)
    for simile, meant in SIMILES:
        plain = re.sub(simile, meant, plain)
    plain = re.sub(LIKENESS, _likened, plain)
    plain = re.sub(WORN_OFF, _worn_off, plain)
    plain = re.sub(r"\b(on|at|along|around|near|over|inside|across) (the|its) ([a-z]+) ([a-z]+)\b", _at_part, plain)
    plain = re.sub(r"(?<![#\w])\d+\w*", " ", plain)  # "4k", "8k", "3d"
    heard = re.findall(r"#[0-9a-f]{6}\b|[a-z]+(?:-[a-z]+)*|[,;.:()/&+]", plain)
    found: list[Token] = []
    at, article = 0, ""
    while at < len(heard):
        if heard[at][0] == "#":
            found.append(Token("color", heard[at]))
            at += 1
            continue
        if not heard[at][0].isalpha():
            found.append(Token("join", heard[at], Join("and")) if heard[at] in "&+/" else Token("comma", heard[at]))
            at += 1
            continue
        degree = bool(found) and found[-1].kind == "degree"
        alone = alone_word(heard[at]) if degree else None  # "slightly rusty | steel"
        token, length = (alone, 1) if alone else longest_known(heard, at)
        if token is None and (again := respelt(heard[at], explained, real)):
            heard[at : at + 1] = again
            found, at, article = [], 0, ""  # for it may belong to words before it: "desert camoflage"
            continue
        if token is None:
            found += [part._replace(article=article) for part in _explained(heard[at], explained)]
        elif token.kind != "filler":
            found.append(token._replace(article=article))
        article = ARTICLES.get(heard[at], "")
        at += length
    return resolved(_indoors(_aside(_dyed(_denied(found)))))


def _owned(found: re.Match[str]) -> str:
    """What somebody has, without him: a frost giant's axe is no frost; but a king's crown, where a table has it, and an egg of
    a robin are."""
    before, owner, owned = found.groups()
    table = known_words()[0]
    kinds = {word: table[word].kind for word in (before, owner, owned, owned.split(" ")[0]) if word in table}
    named = {kinds.get(owned), kinds.get(owned.split(" ")[0])} & {"thing", "size"}
    whose = kinds.get(owner, "thing") in ("thing", "size", "animal") and bool(named)
    if f"{owner} {owned}" in table or f"{owner} {owned.split(' ')[0]}" in table or not whose:
        return " ".join(filter(None, (before, owner, owned)))
    return " ".join(filter(None, ("" if kinds.get(before, "") in ("substance", "thing") else before, owned)))


def _likened(found: re.Match[str]) -> str:
    """What is like a thing has its colour: "a hat like a ripe aubergine"."""
    *_, last = words_of = found[1].split(" ")
    token = known_words()[0].get(" ".join(words_of[-2:])) or known_words()[0].get(last)
    return f" {found[1]} coloured" if token and token.kind == "thing" else found[0]


def _at_part(found: re.Match[str]) -> str:
    """Where something is, without what else the place is: "on the broken edge"."""
    at, the, which, part = found.groups()
    known = known_words()[0].get(which)
    plain = f"{at} {the} {part}" in known_words()[0] and (known is None or known.kind == "filler")
    return f"{at} {the} {part}" if plain and f"{which} {part}" not in known_words()[0] else found[0]


def _worn_off(found: re.Match[str]) -> str:
    """A coat that is gone from a part only: "white paint worn off the armrests"."""
    hue, coat, part = found.groups()
    known = known_words()[0].get(part)
    place = known is not None and known.kind == "part" and known.value.kind not in ("all", "edges", "crevices")
    return f"{hue} {coat}, chipped at the {part}" if place and hue in COLORS else found[0]


ARTICLES = {"a": "a", "an": "a", "the": "the"}



def _dyed(found: list[Token]) -> list[Token]:
    """Names of substances whose colour alone is meant, as colours: "honey coloured glass"."""
    kept: list[Token] = []
    for token, after in zip(found, [*found[1:], Token("end", "")], strict=False):
        if token.kind != "dyed":
            kept.append(token)
        elif after.kind == "color":
            continue  # "shagreen dyed teal"
        elif kept and (kept[-1].kind == "substance" or kept[-1].text in LIKENED):
            kept[-1] = kept[-1]._replace(kind="color", value=None)
        elif kept and kept[-1].kind == "thing":
            kept[-1:] = hues_of(kept[-1].text)
    return kept


OVER_OR_UNDER = ("under", "beneath", "below", "underneath", "above")


def _aside(found: list[Token]) -> list[Token]:
    """What is left without what something only is beside, or "under the tap"."""
    kept: list[Token] = []
    aside = False
    for token, after in zip(found, [*found[1:], Token("end", "")], strict=False):
        thing = after.kind == "thing" and after.article == "the" and any(t.kind == "thing" for t in kept)
        if (token.kind == "aside" and after.kind != "part") or (token.text in OVER_OR_UNDER and thing):
            aside = True
        elif token.kind in ("join", "comma", "postfix", "half"):
            aside = False
        if not aside:
            kept.append(token)
    return kept


def _indoors(found: list[Token]) -> list[Token]:
    """What is left without where a thing is or was: "fresh out of the oven". Snow and mud in which it lies lie on it."""
    kept: list[Token] = []
    at = 0
    while at < len(found):
        token, after = found[at], found[at + 1] if at + 1 < len(found) else Token("end", "")
        there = ("in", "into", "out of", "on") if any(t.kind == "thing" for t in kept) else ("in", "into", "out of")
        place = token.kind == "join" and token.text in there and after.article == "the" and bool(kept)
        if place and after.kind in ("thing", "substance") and not any(t.kind == "part" for t in run_of(found[at + 1 :])):
            if after.text in GATHERS and token.text != "on":
                kept.append(Token("join", "with", JOINS["with"]))
            else:
                at += 1
        elif not (token.text == "out of" and kept and kept[-1].kind == "thing"):  # "a teapot out of amber"
            kept.append(token)
        at += 1
    return kept


GLOSS = 0.3
"""Roughness below which a finish is one of gloss."""


def _denied(found: list[Token]) -> list[Token]:
    """What is left without that which words say is not there: "iron, no rust"; "silver, not gold"; what has no gloss is
    matte. """
    kept: list[Token] = []
    denying = denied = fresh = spare = False
    for token in found:
        if token.kind == "denial":
            denying = fresh = True
            spare = token.text == "than"
        elif token.kind in ("join", "comma", "half") and token.text != "of":
            if denying and not fresh and token.kind == "join" and token.text in SPARED:
                continue
            instead = (denying or denied) and token.text == "but"
            denying, denied = False, denying
            kept.append(Token("comma", ",") if instead else token)  # "not metal, but bone"
        elif not denying:
            denied = False
            kept.append(token)
        elif token.kind == "finish" and sum(FINISHES.get(token.text, (1, 1))) < 2 * GLOSS:
            kept.append(Token("finish", "matte"))
        elif spare:
            denying = False  # "darker than charcoal | rubber"
        fresh = False if token.kind != "denial" else fresh
    return kept


def _explained(word: str, explained: Mapping[str, Sequence[str]]) -> list[Token]:
    """A word that no table knows, as the colours by which a dictionary explains it, or as it is."""
    told = next((explained[w] for w in (word, *singulars(word)) if w in explained), ())
    if told and all(w in COLORS or w in CHANGES or w in LEANINGS for w in told):
        return [Token("color", w) for w in told]
    return [Token("unknown", word)]
