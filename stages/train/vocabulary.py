"""Makes the word-vector table of the text encoder; run once by a developer, its result is shipped.

Words are the whole words of MiniLM's own vocabulary plus ours. A word's vector is the embedding of the word in a few
contexts and of what a dictionary says of it, projected on the directions in which words about materials, colours and objects
differ, in 8 bits. Words that are never taught, but that the dictionary explains by taught ones, come with those
(`stages.train.dictionary`).
Needs the optional extra `vocabulary` (transformers), a folder with sentence-transformers/all-MiniLM-L6-v2 (Apache-2.0) and
the database files of Princeton WordNet 3.1 (WordNet licence). The SHA-256 of both are recorded in the table.
"""

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from stages.core.artifact import Provenance, save_npz, sha256_file
from stages.prior.colors import WORDS
from stages.prior.names import FINISHES, FINISHES_METAL, HELD_OUT, OBJECTS, SUBSTANCES
from stages.prior.vocabulary import VOCABULARY
from stages.train.captions import template_words
from stages.train.dictionary import INDEX, PARTS, Explainer, Sense, by_word, senses

CONTEXTS = ("{}", "{} material", "{} colored texture")
TOPICS = ("material", "texture", "surface", "metal", "wood", "stone", "fabric", "plastic", "ceramic", "color", "paint",
          "shiny", "rough", "old", "broken", "furniture", "statue", "animal", "vehicle", "weapon", "building", "food",
          "plant", "clothing", "tool", "edges", "top", "bottom", "spots", "stripes", "trim", "dirty", "photo", "style")
OWN = ("verdigris", "terracotta", "pewter", "gunmetal", "lacquered", "varnished", "corroded", "tarnished", "weathered",
       "rusted", "patina", "inlaid", "inlay", "speckled", "mottled", "striped", "spotted", "crevices", "grooves",
       "handmade", "photorealistic", "pbr", "quilted", "woven", "knitted", "riveted", "enameled", "oxidized",
       "anodised",
       "steampunk", "scifi", "cyberpunk", "teak", "cedar", "redwood", "sycamore", "hickory", "basswood", "plywood",
       "formica", "laminate", "corduroy", "chiffon", "tulle", "suede", "sheepskin", "goatskin", "buckskin", "moleskin",
       "polystyrene", "polycarbonate", "polyurethane", "styrofoam", "perspex", "plexiglass", "bakelite", "celluloid",
       "fiberglass", "kevlar", "cashmere", "mohair", "tweed", "gneiss", "schist", "shale", "tuff", "pumice", "onyx",
       "carnelian", "agate", "citrine", "beryl", "peridot", "moonstone", "aventurine", "rhodonite", "hematite",
       "pyrite",
       "galena", "magnetite", "tungsten", "cobalt", "palladium", "rhodium", "iridium", "pinchbeck", "ormolu", "argent",
       "cerise", "carmine", "puce", "ecru", "fawn", "umber", "sienna", "russet", "saffron", "amaranthine", "viridian",
       "celadon", "pistachio", "avocado", "heliotrope", "mulberry", "aubergine", "eggplant", "tangerine", "cinnamon")


SENSES = 3
"""Meanings of a word that its vector takes in."""

AMBIGUOUS = frozenset(("ash", "elm", "fir", "foliage", "golden", "horn", "jet", "leafy", "leaves", "metallic", "mossy",
                       "painted", "pitch", "plant", "plush", "scales", "shell"))  # fmt: skip
"""Names of substances that a dictionary's text uses in another sense, or of any plant."""


def make_vocabulary(model_folder: Path, wordnet: Path, out: Path, size: int = 14000, dims: int = 96) -> None:
    """Write the table.

    Args:
        model_folder: all-MiniLM-L6-v2 as published (model.safetensors, tokenizer.json). wordnet: with `PARTS` and `INDEX`.
        size: words to keep, those nearest to our topics. dims: length of a vector.
    """
    words = sorted(set(model_words(model_folder)) | set(domain_words()))
    embedded = word_vectors(model_folder, by_word(senses(wordnet)), words)  # (W, 384)
    domain = np.array([words.index(word) for word in domain_words()])
    closeness = (unit(embedded) @ unit(embedded[domain]).T).max(1)
    closeness[domain] = 2.0
    near = np.argsort(-closeness, kind="stable")
    vectors = embedded @ directions(embedded[near[: 4 * len(domain)]], dims)
    keep = np.sort(near[:size])
    vectors = unit(vectors[keep])
    scale = np.abs(vectors).max() / 127
    arrays = {
        "words": as_text(words[i] for i in keep),
        "vectors": np.round(vectors / scale).astype(np.int8),
        "scale": np.array(scale, "f4"),
        "explained": as_text(" ".join((word, *told)) for word, told in explanations(wordnet).items()),
    }
    source = {"model": sha256_file(model_folder / "model.safetensors")}
    source |= {part: sha256_file(wordnet / part) for part in (*PARTS, INDEX)}
    save_npz(out, VOCABULARY, arrays, Provenance({"size": size, "dims": dims}, None, source))


def as_text(lines: Iterable[str]) -> NDArray[np.uint8]:
    """ASCII lines as an array of bytes."""
    return np.frombuffer("\n".join(lines).encode("ascii"), np.uint8).copy()


def word_vectors(model_folder: Path, entries: dict[str, list[Sense]], words: list[str]) -> NDArray[np.float32]:
    """(W, 384), about their mean: of the word in `CONTEXTS`, and of its dictionary entry where there is one."""
    contexts = embed(model_folder, [context.format(word) for context in CONTEXTS for word in words])
    alone = centred(contexts.reshape(len(CONTEXTS), len(words), -1).mean(0))
    told = {i: entry(word, entries[word]) for i, word in enumerate(words) if word in entries}
    alone[list(told)] += centred(embed(model_folder, list(told.values())))
    return unit(alone)


def explanations(wordnet: Path) -> dict[str, tuple[str, ...]]:
    """Words that are never in a caption, and the taught words that say what they mean."""
    names = [name for substance in SUBSTANCES for name in substance.names]
    taught = words_of([*names, *WORDS, *FINISHES, *FINISHES_METAL, *OBJECTS]) | template_words()
    return Explainer(wordnet, {n for n in names if n.isalpha()} - AMBIGUOUS, taught).all()


def entry(word: str, meanings: list[Sense]) -> str:
    """What the dictionary says of a word, its synonyms included, as one text."""
    told = (", ".join(w for w in sense.words if w != word) + " " + sense.gloss for sense in meanings[:SENSES])
    return f"{word}: " + ". ".join(told)


def domain_words() -> list[str]:
    """Every word of our captions and of the list above, sorted."""
    phrases = [name for substance in SUBSTANCES for name in substance.names]
    phrases += [*WORDS, *FINISHES, *FINISHES_METAL, *OBJECTS, *TOPICS, *OWN, *(word for word, _ in HELD_OUT)]
    return sorted(words_of(phrases))


def words_of(phrases: list[str]) -> set[str]:
    """The single words of phrases."""
    return {word for phrase in phrases for word in re.findall("[a-z]+", phrase.lower())}


def model_words(folder: Path) -> list[str]:
    """Whole words in the model's own vocabulary."""
    lines = (folder / "vocab.txt").read_text(encoding="utf-8").splitlines()
    return [line for line in lines if re.fullmatch("[a-z]{3,}", line)]


def directions(embedded: NDArray, dims: int) -> NDArray:
    """Principal directions (384, dims), scaled by their deviation to the power -1/4: rare ones gain some weight."""
    _, deviation, axes = np.linalg.svd(embedded - embedded.mean(0), full_matrices=False)
    return axes[:dims].T * (deviation[:dims] / deviation[0]) ** -0.25


def unit(vectors: NDArray) -> NDArray:
    """Rows at length 1."""
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def centred(vectors: NDArray) -> NDArray:
    """Rows about their mean, at length 1."""
    return unit(vectors - vectors.mean(0))


def embed(folder: Path, texts: list[str]) -> NDArray[np.float32]:
    """Sentence embeddings (T, 384) of unit length."""
    from transformers import AutoModel, AutoTokenizer  # an optional extra, needed here only

    tokenizer, model = AutoTokenizer.from_pretrained(folder), AutoModel.from_pretrained(folder).eval()
    order, parts = np.argsort([len(text) for text in texts]), []  # alike long, little padding
    for rows in np.array_split(order, -(-len(texts) // 256)):
        batch = tokenizer([texts[i] for i in rows], padding=True, truncation=True, return_tensors="pt")
        with torch.no_grad():
            hidden = model(**batch).last_hidden_state
        mask = batch["attention_mask"][..., None]
        parts.append(torch.nn.functional.normalize((hidden * mask).sum(1) / mask.sum(1), dim=-1).numpy())
    return np.concatenate(parts)[np.argsort(order)]


if __name__ == "__main__":
    import click

    @click.command()
    @click.argument("model_folder", type=click.Path(exists=True, path_type=Path))
    @click.argument("wordnet", type=click.Path(exists=True, path_type=Path))
    @click.argument("out", type=click.Path(path_type=Path))
    def main(model_folder: Path, wordnet: Path, out: Path) -> None:
        """Write the word-vector table OUT from the model in MODEL_FOLDER and the dictionary in the folder WORDNET."""
        make_vocabulary(model_folder, wordnet, out)

    main()
