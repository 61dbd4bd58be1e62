"""The words that the prior knows: shipped word vectors.

A word that was never taught is read as the taught words by which a dictionary explains it ("mauve": pale greyish violet).
One that the table lacks takes the vector of its stem, of the two words it is made of, or of the table's words that
are spelt most alike; so every prompt has an embedding, and it is a function of the prompt alone.
"""

import functools
import re
import unicodedata
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stages.core.artifact import Field, Schema, load_npz

if TYPE_CHECKING:
    from torch import Tensor

VOCABULARY = Schema(
    "dreammat.vocabulary",
    2,
    {
        "words": Field("u1", ("B",)),  # ASCII, one word a line, sorted
        "vectors": Field("i1", ("W", "D")),  # unit word vectors divided by scale
        "scale": Field("f4", ()),
        "explained": Field("u1", ("X",)),  # ASCII, a line each: a word, and those that it is read as
    },
)

WEIGHTS_FOLDER = Path(__file__).parent / "weights"
WEIGHTS_FILE = WEIGHTS_FOLDER / "prior.npz"
VOCABULARY_FILE = WEIGHTS_FOLDER / "vocabulary.npz"

MAX_WORDS = 24
"""A prompt's words beyond this are not read."""

SKIPPED = frozenset({"a", "an", "the", "of", "is"})
"""Words that say nothing about a material."""

SUFFIXES = ("s", "es", "ed", "d", "ing", "y", "ish", "en", "er", "like", "ic", "ly", "ized", "ised", "ness")

ALIKE = 0.35
"""Least overlap of character trigrams (Jaccard) for two words to count as spelt alike."""


class Vocabulary:
    """Word vectors by word. words: sorted. vectors: (W, D) float32, unit length. explained: words by what they are read as."""

    def __init__(
        self, words: list[str], vectors: NDArray[np.float32], explained: Mapping[str, Sequence[str]] | None = None
    ) -> None:
        self.index = {word: i for i, word in enumerate(words)}
        self.vectors, self.explained = vectors, explained or {}
        self._known: dict[str, NDArray[np.float32]] = {}

    @classmethod
    def load(cls, path: Path) -> "Vocabulary":
        """Read the shipped table. Raises: ArtifactError."""
        table = load_npz(path, VOCABULARY)
        words, told = (table[name].tobytes().decode("ascii").split("\n") for name in ("words", "explained"))
        explained = {word: rest for word, *rest in map(str.split, told)}
        return cls(words, table["vectors"].astype(np.float32) * table["scale"], explained)

    def read(self, prompt: str) -> list[str]:
        """The words of a prompt as they are read: without articles, each unknown one explained by what is not there yet."""
        words, read = split_words(prompt), list[str]()
        for word in words:
            told = self.explained.get(word) or self.explained.get(word.removesuffix("s")) or [word]
            read += [w for w in told if w == word or w not in words + read]
        return read[:MAX_WORDS]

    def vector(self, word: str) -> NDArray[np.float32]:
        """(D,) of any word; zero for one that resembles nothing in the table."""
        if word not in self._known:
            self._known[word] = self._look_up(word)
        return self._known[word]

    def knows(self, word: str) -> bool:
        """Whether the table has it, its stem or its halves: whether its vector is more than a guess by its letters."""
        return bool(self._exact(word) or self._stem(word) or self._compound(word))

    def _look_up(self, word: str) -> NDArray[np.float32]:
        parts = self._exact(word) or self._stem(word) or self._compound(word)
        if parts:
            return self.vectors[parts].mean(0)
        return self._spelt_alike(word)

    def _exact(self, word: str) -> list[int]:
        return [self.index[word]] if word in self.index else []

    def _stem(self, word: str) -> list[int]:
        for suffix in sorted(SUFFIXES, key=len, reverse=True):
            stem = word.removesuffix(suffix)
            if stem != word and len(stem) >= 3:
                doubled = stem[:-1] if stem[-1] == stem[-2] else stem
                for candidate in (stem, stem + "e", stem + "y", doubled):
                    if candidate in self.index:
                        return [self.index[candidate]]
        return []

    def _compound(self, word: str) -> list[int]:
        for cut in sorted(range(3, len(word) - 2), key=lambda c: abs(2 * c - len(word))):
            if word[:cut] in self.index and word[cut:] in self.index:
                return [self.index[word[:cut]], self.index[word[cut:]]]
        return []

    def _spelt_alike(self, word: str) -> NDArray[np.float32]:
        grams = trigrams(word)
        overlap = {i: len(grams & other) / len(grams | other) for i, other in self._trigrams if grams & other}
        best = sorted(overlap, key=lambda i: (-overlap[i], i))[:3]
        near = [i for i in best if overlap[i] >= ALIKE]
        return self.vectors[near].mean(0) if near else np.zeros_like(self.vectors[0])

    @functools.cached_property
    def _trigrams(self) -> list[tuple[int, frozenset[str]]]:
        return [(i, trigrams(word)) for word, i in self.index.items()]

    def encode(self, prompts: list[str]) -> tuple["Tensor", "Tensor"]:
        """Word vectors of each prompt.

        Returns:
            vectors: (B, MAX_WORDS, D) float32, zero after a prompt's end; present: (B, MAX_WORDS) bool.
        """
        import torch  # here, for what tables know is read without the network

        vectors = np.zeros((len(prompts), MAX_WORDS, self.vectors.shape[1]), np.float32)
        present = np.zeros((len(prompts), MAX_WORDS), bool)
        for i, prompt in enumerate(prompts):
            for k, word in enumerate(self.read(prompt)):
                vectors[i, k], present[i, k] = self.vector(word), True
        return torch.from_numpy(vectors), torch.from_numpy(present)


def split_words(prompt: str) -> list[str]:
    """Lower-case words without accents, digits and articles."""
    plain = unicodedata.normalize("NFKD", prompt.lower()).encode("ascii", "ignore").decode()
    return [word for word in re.findall("[a-z]+", plain) if word not in SKIPPED]


def trigrams(word: str) -> frozenset[str]:
    """Character trigrams of a word with its ends marked."""
    marked = f"^{word}$"
    return frozenset(marked[i : i + 3] for i in range(len(marked) - 2))


class ShippedWords:
    """What knows words, as a `stages.prior.model.Prior` does, of which the network is loaded where no table knows a word."""

    @functools.cached_property
    def vocabulary(self) -> Vocabulary:
        """The shipped table."""
        return Vocabulary.load(VOCABULARY_FILE)

    def read(self, prompts: list[str]) -> "Tensor":
        """See `stages.prior.model.Prior`."""
        from stages.prior.model import load_prior

        return load_prior().read(prompts)
