"""Makes the word-vector table of the text encoder; run once by a developer, its result is shipped.

Words are the whole words of MiniLM's own vocabulary plus ours. A word's vector is the embedding of the word in a few
contexts and of what a dictionary says of it ("taupe: a greyish brown"), so that a rare word lies near the common ones that
explain it; projected on the directions in which words about materials, colours and objects differ, in 8 bits.
Needs the optional extra `vocabulary` (transformers), a folder with sentence-transformers/all-MiniLM-L6-v2 (Apache-2.0) and
the database files of Princeton WordNet 3.1 (WordNet licence). The SHA-256 of both are recorded in the table.
"""

import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from stages.core.artifact import Provenance, save_npz, sha256_file
from stages.prior.text import VOCABULARY
from stages.train.colors import WORDS
from stages.train.substances import FINISHES, FINISHES_METAL, HELD_OUT, OBJECTS, SUBSTANCES

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


PARTS = ("data.noun", "data.adj")
"""Files of WordNet that are read."""

KINDS = ("27", "07", "00", "20", "06")
"""WordNet's lexicographer files that matter most here: substances, attributes (colours), adjectives, plants, artefacts."""

SENSES = 3
"""Meanings of a word that its vector takes in."""


def make_vocabulary(model_folder: Path, wordnet: Path, out: Path, size: int = 14000, dims: int = 96) -> None:
    """Write the table.

    Args:
        model_folder: all-MiniLM-L6-v2 as published (model.safetensors, tokenizer.json). wordnet: folder with `PARTS`.
        size: words to keep, those nearest to our topics. dims: length of a vector.
    """
    words = sorted(set(model_words(model_folder)) | set(domain_words()))
    embedded = word_vectors(model_folder, wordnet, words)  # (W, 384)
    domain = np.array([words.index(word) for word in domain_words()])
    closeness = (unit(embedded) @ unit(embedded[domain]).T).max(1)
    closeness[domain] = 2.0
    near = np.argsort(-closeness, kind="stable")
    vectors = embedded @ directions(embedded[near[: 4 * len(domain)]], dims)
    keep = np.sort(near[:size])
    vectors = unit(vectors[keep])
    scale = np.abs(vectors).max() / 127
    arrays = {
        "words": np.array([words[i] for i in keep]).astype("S"),
        "vectors": np.round(vectors / scale).astype(np.int8),
        "scale": np.array(scale, "f4"),
    }
    arrays["words"] = np.frombuffer(b"\n".join(arrays["words"].tolist()), np.uint8).copy()
    source = {"model": sha256_file(model_folder / "model.safetensors")}
    source |= {part: sha256_file(wordnet / part) for part in PARTS}
    save_npz(out, VOCABULARY, arrays, Provenance({"size": size, "dims": dims}, None, source))


def word_vectors(model_folder: Path, wordnet: Path, words: list[str]) -> NDArray[np.float32]:
    """(W, 384), about their mean: of the word in `CONTEXTS`, and of its dictionary entry where there is one."""
    contexts = embed(model_folder, [context.format(word) for context in CONTEXTS for word in words])
    alone = centred(contexts.reshape(len(CONTEXTS), len(words), -1).mean(0))
    entries = dictionary(wordnet)
    told = {i: entry(word, entries[word]) for i, word in enumerate(words) if word in entries}
    alone[list(told)] += centred(embed(model_folder, list(told.values())))
    return unit(alone)


def dictionary(wordnet: Path) -> dict[str, list[tuple[str, list[str], str]]]:
    """The meanings of every word: kind, all words of that meaning, and its explanation; those of `KINDS` first."""
    entries = defaultdict(list)
    for part in PARTS:
        for kind, lemmas, gloss in synsets(wordnet / part):
            for word in lemmas:
                entries[word].append((kind, lemmas, gloss))
    rank = {kind: i for i, kind in enumerate(KINDS)}
    return {word: sorted(found, key=lambda e: rank.get(e[0], len(KINDS))) for word, found in entries.items()}


def synsets(path: Path) -> Iterator[tuple[str, list[str], str]]:
    """Each meaning in a file of WordNet, without the examples. Source: WordNet's manual page wndb(5WN)."""
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("  "):  # the licence
            head, gloss = line.split(" | ", 1)
            fields = head.split()
            lemmas = fields[4 : 4 + 2 * int(fields[3], 16) : 2]
            yield fields[1], [w.split("(")[0].replace("_", " ").lower() for w in lemmas], gloss.split('; "')[0].strip()


def entry(word: str, meanings: list[tuple[str, list[str], str]]) -> str:
    """What the dictionary says of a word, its synonyms included, as one text."""
    told = (", ".join(w for w in lemmas if w != word) + " " + gloss for _, lemmas, gloss in meanings[:SENSES])
    return f"{word}: " + ". ".join(told)


def domain_words() -> list[str]:
    """Every word of our captions and of the list above, sorted."""
    phrases = [name for substance in SUBSTANCES for name in substance.names]
    phrases += [*WORDS, *FINISHES, *FINISHES_METAL, *OBJECTS, *TOPICS, *OWN, *(word for word, _ in HELD_OUT)]
    return sorted({word for phrase in phrases for word in re.findall("[a-z]+", phrase.lower())})


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
