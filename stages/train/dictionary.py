"""WordNet, read for what it says of materials and colours, and the words that it explains by others which we teach.

"mauve" is "a moderate purple", "tweed" is a kind of "fabric": a prompt's word that was never taught is read as the taught
words that explain it. Source of the files' format: WordNet's manual page wndb(5WN).
"""

import re
from collections import defaultdict
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from stages.prior.colors import CHANGES, COLORS, LEANINGS

PARTS, INDEX = ("data.noun", "data.adj"), "index.noun"
"""Files of WordNet that are read: meanings, and every noun's, the most frequent first."""

SUBSTANCE, ATTRIBUTE, ADJECTIVE, PLANT, ARTEFACT = KINDS = ("27", "07", "00", "20", "06")
"""WordNet's lexicographer files that matter here; those of colours are ATTRIBUTE and ADJECTIVE."""

MATTER = (SUBSTANCE, PLANT, ARTEFACT)

LEVELS = 3
"""How far up its kinds a substance is followed."""

WARE = " ware"
"""As in "ceramic ware", of which stoneware is a kind."""

MOST = 4
"""Words of an explanation."""


@dataclass(frozen=True)
class Sense:
    """One meaning. kind: lexicographer file. words: that share it, lower case. gloss: its explanation, without examples.

    above: the meanings of which it is a kind.
    """

    kind: str
    words: tuple[str, ...]
    gloss: str
    above: tuple[str, ...]


def senses(folder: Path) -> dict[str, Sense]:
    """All meanings by an identifier."""
    return {f"{part[-4]}{offset}": sense for part in PARTS for offset, sense in _read(folder / part)}


def _read(path: Path) -> Iterator[tuple[str, Sense]]:
    kind_of_word = "n" if path.suffix == ".noun" else "a"
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("  "):  # the licence
            continue
        head, gloss = line.split(" | ", 1)
        fields = head.split()
        end = 4 + 2 * int(fields[3], 16)
        words = tuple(w.split("(")[0].replace("_", " ").lower() for w in fields[4:end:2])
        pointers = zip(fields[end + 1 :: 4], fields[end + 2 :: 4], strict=False)
        above = tuple(kind_of_word + offset for symbol, offset in pointers if symbol in ("@", "@i"))
        yield fields[0], Sense(fields[1], words, gloss.split('; "')[0].strip(), above)


def first_kinds(folder: Path) -> dict[str, str]:
    """The part of speech and offset, as `senses` has them, of every noun's most frequent meaning."""
    found = {}
    for line in (folder / INDEX).read_text(encoding="utf-8").splitlines():
        if not line.startswith("  "):
            fields = line.split()
            found[fields[0]] = "n" + fields[-int(fields[2])]
    return found


def by_word(meanings: dict[str, Sense]) -> dict[str, list[Sense]]:
    """The meanings of every word, those of the more telling `KINDS` first."""
    found = defaultdict(list)
    for sense in meanings.values():
        for word in dict.fromkeys(sense.words):
            found[word].append(sense)
    rank = {kind: i for i, kind in enumerate(KINDS)}
    return {word: sorted(own, key=lambda s: rank.get(s.kind, len(KINDS))) for word, own in found.items()}


class Explainer:
    """Explains words by taught ones. substances: single words that name one. taught: all that may be met in a caption."""

    def __init__(self, folder: Path, substances: Collection[str], taught: Collection[str]) -> None:
        self._meanings, self._first = senses(folder), first_kinds(folder)
        self._of = by_word(self._meanings)
        self._substances, self._taught = frozenset(substances), frozenset(taught)

    def all(self) -> dict[str, tuple[str, ...]]:
        """Every single word that is not taught and can be explained."""
        plain = sorted(word for word in self._of if re.fullmatch("[a-z]{3,}", word) and word not in self._taught)
        return {word: told for word in plain if (told := self.explain(word))}

    def explain(self, word: str) -> tuple[str, ...]:
        """Taught words that say what a word means, its colour first; none where it means no colour and no substance.

        What a noun most often means decides: "train" is no cloth.
        """
        own = self._of.get(word, [])
        first = self._meanings.get(self._first.get(word, ""))
        usual = first.kind if first else None
        colors = self._color(word, own, usual in KINDS)
        for sense in own if usual == PLANT else [first]:  # a tree's wood is often its second meaning
            if sense and sense.kind in MATTER and (substance := self._substance(sense, word)):
                colors = colors or color_words(sense.gloss if usual != ARTEFACT else "")
                return tuple(dict.fromkeys((*colors, *substance)))[:MOST]
        return colors or (color_words(first.gloss) if first and usual == SUBSTANCE else ())

    def _color(self, word: str, own: list[Sense], noun: bool) -> tuple[str, ...]:
        """Taught colour words: adjectives say best how a thing looks, then come a name's synonyms; a noun's only if asked."""
        looks = [color_words(s.gloss) for s in own if s.kind == ADJECTIVE and "color" in s.gloss]
        names = [s for s in own if s.kind == ATTRIBUTE and noun]
        synonyms = [tuple(w.replace("-", " ").split()) for s in names for w in s.words if w in COLORS]
        candidates = (*looks, *(s for s in synonyms if word not in s), *(color_words(s.gloss) for s in names))
        return next((found for found in candidates if found), ())

    def _substance(self, sense: Sense, word: str) -> tuple[str, ...]:
        """Taught substances: a synonym, those of the explanation, or what it is a kind of.

        A plant's is its wood, an artefact's only that of which it is a kind: it may be made of anything.
        """
        if sense.kind == ARTEFACT:
            kinds = [w for name in sense.above if name in self._meanings for w in self._meanings[name].words]
            return self._known(" ".join(kind.removesuffix(WARE).split()[-1] for kind in kinds), word)
        known = self._known(" ".join(sense.words), word) or self._known(first_clause(sense.gloss), word)
        level = sense.above
        for _ in range(LEVELS):
            near = [self._meanings[name] for name in level if name in self._meanings]
            known = known or self._known(" ".join(w for s in near for w in s.words), word)
            level = tuple(name for s in near for name in s.above)
        return known if sense.kind == SUBSTANCE or "wood" in known else ()

    def _known(self, text: str, word: str) -> tuple[str, ...]:
        found = dict.fromkeys(w for w in re.findall("[a-z]+", text.lower()) if w in self._substances and w != word)
        return tuple(found)[:2]


def first_clause(gloss: str) -> str:
    """An explanation up to its first semicolon, without what stands in brackets."""
    return re.sub(r"\([^)]*\)", " ", gloss).split(";")[0].lower()


def color_words(gloss: str) -> tuple[str, ...]:
    """Taught colour words of an explanation and what changes them, in order; none without a colour."""
    words = [w for w in re.findall("[a-z]+", first_clause(gloss)) if w in COLORS or w in CHANGES or w in LEANINGS]
    return tuple(dict.fromkeys(words)) if any(w in COLORS for w in words) else ()
