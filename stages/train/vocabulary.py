"""Makes the word-vector table of the text encoder; run once by a developer, its result is shipped.

Words are the whole words of MiniLM's own vocabulary plus ours; a word's vector is its sentence embedding averaged over
a few contexts, projected on the directions in which words about materials, colours and objects differ, in 8 bits.
Needs the optional extra `vocabulary` (transformers) and a folder with sentence-transformers/all-MiniLM-L6-v2
(Apache-2.0; the SHA-256 of its weights is recorded in the table).
"""

import re
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from stages.core.artifact import Provenance, save_npz, sha256_file
from stages.prior.text import VOCABULARY
from stages.train.substances import COLORS, FINISHES, FINISHES_METAL, HELD_OUT, OBJECTS, SUBSTANCES

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


def make_vocabulary(model_folder: Path, out: Path, size: int = 14000, dims: int = 64) -> None:
    """Write the table.

    Args:
        model_folder: all-MiniLM-L6-v2 as published (model.safetensors, tokenizer.json). size: words to keep, those
        nearest to our topics. dims: length of a vector.
    """
    words = sorted(set(model_words(model_folder)) | set(domain_words()))
    embedded = embed(model_folder, words)  # (W, 384)
    embedded -= embedded.mean(0)
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
    save_npz(out, VOCABULARY, arrays, Provenance({"size": size, "dims": dims}, None, source))


def domain_words() -> list[str]:
    """Every word of our captions and of the list above, sorted."""
    phrases = [name for substance in SUBSTANCES for name in substance.names]
    phrases += [*COLORS, *FINISHES, *FINISHES_METAL, *OBJECTS, *TOPICS, *OWN, *(word for word, _ in HELD_OUT)]
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


def embed(folder: Path, words: list[str]) -> NDArray[np.float32]:
    """Mean sentence embedding of each word over `CONTEXTS`. Returns: (W, 384)."""
    from transformers import AutoModel, AutoTokenizer  # an optional extra, needed here only

    tokenizer, model = AutoTokenizer.from_pretrained(folder), AutoModel.from_pretrained(folder).eval()
    total = np.zeros((len(words), model.config.hidden_size), "f4")
    for context in CONTEXTS:
        phrases = [context.format(word) for word in words]
        for start in range(0, len(words), 512):
            batch = tokenizer(phrases[start : start + 512], padding=True, return_tensors="pt")
            with torch.no_grad():
                hidden = model(**batch).last_hidden_state
            mask = batch["attention_mask"][..., None]
            mean = (hidden * mask).sum(1) / mask.sum(1)
            total[start : start + 512] += torch.nn.functional.normalize(mean, dim=-1).numpy() / len(CONTEXTS)
    return total


if __name__ == "__main__":
    import click

    @click.command()
    @click.argument("model_folder", type=click.Path(exists=True, path_type=Path))
    @click.argument("out", type=click.Path(path_type=Path))
    def main(model_folder: Path, out: Path) -> None:
        """Write the word-vector table OUT from the model in MODEL_FOLDER."""
        make_vocabulary(model_folder, out)

    main()
