"""Sample sheets: what the ControlNet makes of pictures of the training set, to look at.

A row for each of a few pictures: its normals, its white rough light map, the picture itself, and what is drawn for its caption
and conditions.
"""

from pathlib import Path

import numpy as np
import torch
from numpy.random import default_rng
from numpy.typing import NDArray
from torch import Tensor

from stages.core import diffusion
from stages.core.images import write_png
from stages.core.shading import LIGHT_MAPS
from stages.sd.models import StableDiffusion
from stages.train.picture_batches import Pictures

ROWS = 4

STEPS = 30
"""Of DDIM."""

SCALE = 7.5
"""Of classifier-free guidance. Source: Ho & Salimans 2022, Eq. 6."""

WHITE = slice(4 + 3 * LIGHT_MAPS.index((0, 1.0)), 7 + 3 * LIGHT_MAPS.index((0, 1.0)))
"""The light map of a white rough dielectric."""


def write_samples(path: Path, model: StableDiffusion, data: Pictures, seed: int) -> None:
    """Write a sheet."""
    chosen = default_rng(seed).permutation(len(data))[:ROWS]
    sheet = []
    for picture, conditions, caption in (data[int(i)] for i in chosen):
        drawn = sample(model, conditions[None].to(model.device), caption, seed)[0].cpu()
        sheet.append(torch.cat([conditions[1:4], conditions[WHITE], picture, drawn], 2))
    write_png(path, as_pixels(torch.cat(sheet, 1)))


def sample(model: StableDiffusion, conditions: Tensor, prompt: str, seed: int) -> Tensor:
    """A picture (1, 3, S, S) in [0, 1] for conditions (1, 22, S, S), without gradient."""
    text = model.embed([prompt, ""]).to(model.denoiser.unet.dtype)
    both = conditions.expand(2, -1, -1, -1)
    edge = conditions.shape[-1] // model.files.vae.factor
    shape = (1, model.files.vae["latent_channels"], edge, edge)
    noise = torch.randn(shape, generator=torch.Generator().manual_seed(seed)).to(model.device)

    def predict(x_t: Tensor, t: Tensor) -> Tensor:
        given, alone = model.predict_noise(x_t.expand(2, -1, -1, -1), t.expand(2), text, both, 1.0).split(1)
        return alone + SCALE * (given - alone)

    with torch.no_grad():
        return model.decode(diffusion.ddim(model.alpha_bar, predict, noise, STEPS, (-np.inf, np.inf)))


def as_pixels(picture: Tensor) -> NDArray[np.float32]:
    """(3, H, W) as (H, W, 3)."""
    return picture.movedim(0, -1).numpy()
