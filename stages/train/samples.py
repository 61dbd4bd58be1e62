"""Sample sheets: what the prior draws for fixed prompts under tiles of the training set's shapes, to look at."""

from pathlib import Path

import numpy as np
import torch
from numpy.random import default_rng

from stages.core.color import srgb_encode
from stages.core.images import write_png
from stages.prior.model import load_prior
from stages.prior.profile import untone
from stages.train.batches import PictureBatches, Tiles
from stages.train.options import TrainPriorOptions

PROMPTS = (
    "gold", "rusty iron", "oak wood", "white marble", "red plastic", "blue fabric", "concrete", "brown leather",
    "polished chrome", "white porcelain", "red brick", "green paint, glossy", "black rubber", "brushed steel",
    "terracotta with gold trim", "stone with moss in the crevices",
)
"""One column each."""

ROWS = 2


def write_samples(path: Path, weights: Path, tiles: Tiles, options: TrainPriorOptions) -> None:
    """Write a sheet: each row one tile (its lit white surface first), each column one of `PROMPTS`."""
    prior = load_prior(options.device, weights)
    batch = PictureBatches(tiles, 64, options.seed + 1)[0]
    cover = batch.mask.mean((1, 2, 3)).numpy()
    rows = [int(i) for i in default_rng(options.seed).permutation(np.flatnonzero(cover > np.median(cover)))[:ROWS]]
    generator = torch.Generator(prior.device).manual_seed(options.seed)
    sheet = []
    for row in rows:
        conditions = batch.conditions[row : row + 1].expand(len(PROMPTS), -1, -1, -1).to(prior.device)
        pictures = prior.sample(conditions, list(PROMPTS), generator).cpu()
        tiles_in_row = [batch.conditions[row, 10:13], *((picture + 1) / 2 for picture in pictures)]
        sheet.append(np.concatenate([display(tile) for tile in tiles_in_row], 1))
    write_png(path, np.concatenate(sheet))


def display(toned: torch.Tensor) -> np.ndarray:
    """A toned picture (3, S, S) as sRGB (S, S, 3)."""
    return srgb_encode(untone(toned.clamp(0, 1.5))).permute(1, 2, 0).numpy()
