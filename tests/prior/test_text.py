import gc
import weakref

import numpy as np
import pytest
import torch

from stages.prior.colors import WORDS
from stages.prior.model import VOCABULARY_FILE
from stages.prior.names import OBJECTS, SUBSTANCES
from stages.prior.text import TextEmbedding, TextEncoder
from stages.prior.vocabulary import MAX_WORDS, Vocabulary, split_words
from stages.train.captions import template_words


@pytest.fixture(scope="module")
def vocabulary() -> Vocabulary:
    return Vocabulary.load(VOCABULARY_FILE)


def closeness(vocabulary: Vocabulary, a: str, b: str) -> float:
    u, v = vocabulary.vector(a), vocabulary.vector(b)
    return float(u @ v / (np.linalg.norm(u) * np.linalg.norm(v)))


@pytest.mark.parametrize(
    ("word", "near", "far"),
    [
        ("mahogany", "oak", "silver"),
        ("gilded", "gold", "wool"),
        ("crimson", "red", "gravel"),
        ("denim", "fabric", "granite"),
        ("corroded", "rusty", "velvet"),
        ("porcelain", "ceramic", "leather"),
        ("basalt", "granite", "silk"),
        ("tweed", "wool", "chrome"),
    ],
)
def test_words_lie_nearer_to_their_kin(vocabulary: Vocabulary, word: str, near: str, far: str) -> None:
    assert closeness(vocabulary, word, near) > closeness(vocabulary, word, far) + 0.1


@pytest.mark.parametrize(
    ("unknown", "known"),
    [("mahoganies", "mahogany"), ("porcelainlike", "porcelain"), ("graniteish", "granite"), ("porcelane", "porcelain")],
)
def test_an_unknown_word_takes_the_place_of_the_nearest_spelling(
    vocabulary: Vocabulary, unknown: str, known: str
) -> None:
    assert unknown not in vocabulary.index
    assert closeness(vocabulary, unknown, known) > 0.5


def test_a_word_that_resembles_nothing_is_silent(vocabulary: Vocabulary) -> None:
    assert not vocabulary.vector("qxzvkj").any()


def test_a_vocabulary_is_let_go_with_its_last_reader() -> None:
    words = Vocabulary(["oak", "steel"], np.eye(2, dtype=np.float32))
    assert words.vector("steeel").any()
    gone = weakref.ref(words)
    del words
    gc.collect()
    assert gone() is None


def test_word_vectors_are_unit_and_words_are_sorted(vocabulary: Vocabulary) -> None:
    length = np.linalg.norm(vocabulary.vectors, axis=1)
    assert np.abs(length - 1).max() < 0.03  # 8-bit rounding
    assert list(vocabulary.index) == sorted(vocabulary.index)


def test_prompts_are_split_without_articles_accents_and_case() -> None:
    assert split_words("A Rosé-Gold statue, of the 1st CLASS!") == ["rose", "gold", "statue", "st", "class"]
    assert split_words("") == []


def test_a_word_that_was_never_taught_is_read_as_what_explains_it() -> None:
    told = Vocabulary(["grey", "violet"], np.eye(2, dtype=np.float32), {"mauve": ["grey", "violet"], "violette": ["violet"]})
    assert told.read("A mauve vase") == ["grey", "violet", "vase"]
    assert told.read("mauves, violet") == ["grey", "violet"]  # no word twice
    assert told.read("violette " * 30) == ["violet"]


def test_words_of_captions_are_read_as_they_are(vocabulary: Vocabulary) -> None:
    """The shipped explanations touch no word that training uses, such as "base" or "spots"."""
    names = [name for substance in SUBSTANCES for name in substance.names]
    taught = template_words() | {word for text in (*names, *WORDS, *OBJECTS) for word in split_words(text)}
    assert not taught & set(vocabulary.explained)
    prompt = "oak base and gold top with white spots"
    assert vocabulary.read(prompt) == split_words(prompt)
    assert vocabulary.read("mauve fabric")[-2:] == ["violet", "fabric"]


def test_long_prompts_are_cut(vocabulary: Vocabulary) -> None:
    vectors, present = vocabulary.encode(["gold " * 50, ""])
    assert vectors.shape == (2, MAX_WORDS, vocabulary.vectors.shape[1])
    assert present[0].all() and not present[1].any()


def test_encoder_ignores_what_follows_the_prompt(vocabulary: Vocabulary) -> None:
    torch.manual_seed(0)
    encoder = TextEncoder(vocabulary.vectors.shape[1]).eval()
    vectors, present = vocabulary.encode(["red plastic", ""])
    noisy = vectors + 5 * (~present)[..., None]
    with torch.no_grad():
        clean, other = encoder(vectors, present), encoder(noisy, present)
    assert torch.allclose(clean.pooled, other.pooled, atol=1e-6)
    assert torch.isfinite(clean.tokens).all()


def test_embeddings_expand_and_join() -> None:
    one = TextEmbedding(torch.randn(1, 5, 8), torch.ones(1, 5, dtype=torch.bool), torch.randn(1, 8))
    joined = TextEmbedding.cat([one.expand(2), one])
    assert joined.tokens.shape == (3, 5, 8) and joined.pooled.shape == (3, 8)
    assert torch.equal(joined.tokens[0], joined.tokens[2])
