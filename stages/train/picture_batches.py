"""The ControlNet's training pictures, read back, and the draws of a run.

A draw is one picture with all that is random about learning it: diffusion time, noise, and what is dropped. It is a function of
seed and number alone, so a run learns the same however its batches are divided over devices, and wherever it was stopped.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import torch
from numpy.random import default_rng
from torch import Tensor

from stages.core import diffusion
from stages.core.artifact import MANIFEST, load_npz, read_manifest, sha256_file
from stages.core.errors import ArtifactError
from stages.sd import profile
from stages.train.options import TrainControlnetOptions
from stages.train.pictures import OBJECT, VIEW, paint

TENSORS = ("picture", "conditions", "t", "noise")


class Pictures:
    """All pictures of the objects that are whole in a folder of `render_pictures`. digest: of all of them.

    Raises: ArtifactError when there are none, or they were made with different options.
    """

    def __init__(self, folder: Path) -> None:
        self.where: list[tuple[Path, int, str]] = []  # a view's file, number of its environment, caption
        self.size = 0
        digest = hashlib.sha256()
        for manifest in sorted((folder / "objects").rglob(MANIFEST)):
            made, files = read_manifest(manifest.parent, OBJECT)
            if made.extra["refused"]:
                continue
            digest.update(sha256_file(manifest).encode())
            if self.size not in (0, made.options["size"]):
                raise ArtifactError(f"{manifest}: of {made.options['size']} pixels, others of {self.size}; make them alike")
            self.size = made.options["size"]
            caption, lights = made.extra["caption"], range(made.extra["lights"])
            self.where += [(manifest.parent / name, light, caption) for name in files for light in lights]
        if not self.where:
            raise ArtifactError(f"{folder}: no training pictures in it; make them with dreammat train pictures")
        self.digest = digest.hexdigest()

    def __len__(self) -> int:
        return len(self.where)

    def __getitem__(self, index: int) -> tuple[Tensor, Tensor, str]:
        """The picture (3, S, S), its conditions (22, S, S), both in [0, 1], and its caption."""
        path, light, caption = self.where[index]
        view = load_npz(path, VIEW)
        mask = torch.from_numpy(view["mask"])
        channels = torch.cat([torch.from_numpy(view["geometry"]), torch.from_numpy(view["light"][light])], 1) / 255
        picture = torch.from_numpy(view["picture"][light]) / 255
        return paint(picture, mask, 1.0), paint(channels, mask, profile.background()), caption


@dataclass(frozen=True)
class Draw:
    """picture: (3, S, S). conditions: (22, S, S). t: () diffusion time. noise: (C, h, w), of the latents."""

    picture: Tensor
    conditions: Tensor
    caption: str
    t: Tensor
    noise: Tensor


@dataclass(frozen=True)
class Batch:
    """B draws: as those, with a first axis B."""

    picture: Tensor
    conditions: Tensor
    captions: list[str]
    t: Tensor
    noise: Tensor


class Draws(torch.utils.data.Dataset):
    """Draw number i of a run. Args: latent: shape (C, h, w) of a picture's latents."""

    def __init__(self, pictures: Pictures, latent: tuple[int, int, int], options: TrainControlnetOptions) -> None:
        self.pictures, self.latent, self.options = pictures, latent, options

    def __getitem__(self, number: int) -> Draw:
        options, rng = self.options, default_rng([self.options.seed, number])
        picture, conditions, caption = self.pictures[int(rng.integers(len(self.pictures)))]
        no_prompt, no_geometry, no_light = rng.random(3) < (options.no_prompt, options.no_geometry, options.no_light)
        conditions = profile.without(conditions[None], geometry=no_geometry, light=no_light)[0]
        t = torch.tensor(int(rng.integers(diffusion.STEPS)))
        noise = torch.from_numpy(rng.standard_normal(self.latent, "f4"))
        return Draw(picture, conditions, "" if no_prompt else caption, t, noise)


def batch_of(draws: list[Draw]) -> Batch:
    """Draws together."""
    picture, conditions, t, noise = (torch.stack([getattr(d, name) for d in draws]) for name in TENSORS)
    return Batch(picture, conditions, [d.caption for d in draws], t, noise)
