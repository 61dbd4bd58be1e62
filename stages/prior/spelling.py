"""Words that no table knows as those that one does: halves of compounds, slips of the pen. Source: Norvig 2007."""

from collections.abc import Container, Iterator
from string import ascii_lowercase

from stages.prior.lexicon import known_words, singulars

ENDINGS = ("ware", "work", "works", "like", "grain", "toned", "look", "ette")
"""What may be grown to the end of a stuff's name: "brassware"."""


def respelt(word: str, explained: Container[str], real: Container[str]) -> list[str]:
    """A word that no table knows as words that one does: its parts, or what it is a slip of the pen for; or nothing."""
    if "-" in word:
        *before, last = word.split("-")
        return ["than", before[-1]] if last == "free" else [*before, last]
    table = known_words()[0]
    if word in explained or len(word) < LEAST_LETTERS:
        return []
    halves = ((word[:cut], word[cut:]) for cut in range(len(word) - 3, 2, -1))
    for first, second in halves:
        whole = second in ENDINGS or any(one in table for one in (second, *singulars(second)))
        if whole and second not in ("red", "bed") and _names_stuff(first):
            return [first, *([] if second in ENDINGS else [second])]
    if any(one in real for one in (word, *singulars(word))):
        return []
    known = {stem for stem in _stems(word) if stem in real}  # "potted" is of a pot
    slips = (slip for slip in _slips(word) if slip[:1] == word[0] and _worth(slip) and not _derived(word, slip))
    return next(([slip] for slip in slips if not known or known & set(_stems(slip))), [])


def _stems(word: str) -> list[str]:
    """What a word may be made of by an ending: "potted" of pot."""
    cut = [word.removesuffix(end) for end in ("ed", "ing", "er", "y", "ly", "s") if word.endswith(end)]
    return [stem for c in cut if len(c) > LEAST_STEM for stem in (c, f"{c}e", c[:-1] if c[-1] == c[-2] else c)]


LEAST_STEM = 2
"""Letters of the shortest stem, less one."""


def _derived(word: str, slip: str) -> bool:
    """Whether a word is no slip but made of another: what was done to a thing, "honed"; what it is like, "glassy", "platen"."""
    return word.startswith(slip) or (word.endswith("ed") and not slip.endswith("ed")) or word == f"{slip}y"


LEAST_LETTERS = 6
"""Letters of the shortest word that is taken for a slip of the pen."""


def _names_stuff(text: str) -> bool:
    token = known_words()[0].get(text)
    return token is not None and token.kind in ("substance", "color")


def _worth(text: str) -> bool:
    token = known_words()[0].get(text)
    short = token is not None and (token.kind == "thing" or (token.kind in ("part", "shape") and len(text) < LONG))
    return token is not None and not short and token.kind not in ("filler", "join", "size", "half")


LONG = 8
"""Letters of the shortest part for which another word may be a slip of the pen."""


def _slips(word: str) -> Iterator[str]:
    """Words that become this one by a letter left out, put in, exchanged with its neighbour or another. Source: Norvig 2007."""
    cuts = [(word[:k], word[k:]) for k in range(len(word) + 1)]
    yield from (a + b[1] + b[0] + b[2:] for a, b in cuts if len(b) > 1)
    yield from (a + b[1:] for a, b in cuts if b)
    yield from (a + letter + b for a, b in cuts for letter in ascii_lowercase)
    yield from (a + letter + b[1:] for a, b in cuts[1:] if b for letter in ascii_lowercase)
