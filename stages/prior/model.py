"""The embedded prior: its weights on disk, and all that a guidance asks of it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from stages.core import diffusion
from stages.core.artifact import Field, Provenance, Schema, load_npz, save_npz, sha256_file
from stages.core.errors import ArtifactError
from stages.prior import profile
from stages.prior.network import Denoiser
from stages.prior.text import Reader, TextEmbedding, TextEncoder
from stages.prior.vocabulary import VOCABULARY_FILE, WEIGHTS_FILE, Vocabulary

WEIGHTS = Schema("dreammat.prior", 1, {"parameters": Field("f2", ("N",))}, extra=("layout", "training"))
"""All parameters in one row, in the order of `layout`: [name, shape] each. training: what they came from."""

PRECISION = torch.bfloat16
"""Of the denoiser's products."""


class PriorNetwork(nn.Module):
    """Everything that is trained: the denoiser with its text encoder, and the reader of words that no table knows."""

    def __init__(self, dims: int) -> None:
        super().__init__()
        self.denoiser, self.text, self.reader = Denoiser(), TextEncoder(dims), Reader(dims)

    def layout(self) -> list[list[Any]]:
        """Name and shape of each parameter, in order."""
        return [[name, list(parameter.shape)] for name, parameter in self.named_parameters()]

    def flat(self) -> NDArray[np.float32]:
        """All parameters in one row."""
        return torch.cat([p.detach().reshape(-1) for p in self.parameters()]).cpu().numpy()

    def set_flat(self, values: NDArray) -> None:
        """Take all parameters from one row, in place."""
        start, row = 0, torch.from_numpy(np.ascontiguousarray(values, np.float32))
        with torch.no_grad():
            for p in self.parameters():
                p.copy_(row[start : start + p.numel()].view_as(p))
                start += p.numel()


@dataclass(frozen=True)
class Prior:
    """A trained prior on a device. See `load_prior`.

    One call of a guidance, for a batch of exposed renders:

        k = prior.exposure(lights, mask)
        conditions = prior.prepare(depth, normal, height, mask, k * lights)
        x0 = prior.profile_tone(k * radiance)
        eps, material = prior.denoise(x_t, t, conditions, prior.embed(["gold"]).expand(len(x_t)))
    """

    network: PriorNetwork
    vocabulary: Vocabulary
    alpha_bar: Tensor  # (1000,) float32
    identity: dict[str, Any]  # "name", "weights" and "vocabulary" (SHA-256), "training"
    device: torch.device
    size: int = profile.SIZE

    profile_tone = staticmethod(profile.profile_tone)
    exposure = staticmethod(profile.exposure)
    prepare = staticmethod(profile.prepare)

    def embed(self, prompts: list[str]) -> TextEmbedding:
        """Text embeddings of B prompts; "" is the null prompt."""
        vectors, present = self.vocabulary.encode(prompts)
        with torch.no_grad():
            return self.network.text(vectors.to(self.device), present.to(self.device))

    def read(self, prompts: list[str]) -> Tensor:
        """The material that the words of B prompts call for: sRGB albedo, roughness and metallic, (B, 5)."""
        vectors, present = (t.to(self.device) for t in self.vocabulary.encode(prompts))
        with torch.no_grad():
            return self.network.reader.read(vectors, present)

    def no_conditions(self, count: int) -> Tensor:
        """Conditions of which nothing is given, (B, 23, S, S)."""
        return torch.full((count, profile.CHANNELS, self.size, self.size), profile.DROPPED, device=self.device)

    def drop(self, conditions: Tensor, geometry: bool, light: bool) -> Tensor:
        """The same conditions without their geometry, their light, or both: the paper's ablations."""
        flags = (torch.full((len(conditions),), flag, device=conditions.device) for flag in (geometry, light))
        return profile.drop(conditions, *flags)

    def denoise(
        self, x_t: Tensor, t: Tensor, conditions: Tensor | None, text: TextEmbedding
    ) -> tuple[Tensor, Tensor]:
        """The noise in x_t, and the material that the model takes each pixel for.

        Args:
            x_t: (B, 3, S, S). t: (B,) long, 0 ... 999. conditions: (B, 23, S, S), as `prepare` and `drop` return
            them, or None. text: of B prompts.
        Returns:
            (B, 3, S, S) float32; sRGB albedo, roughness and metallic in (0, 1), (B, 5, S, S) float32. No gradient is kept.
        """
        given = self.no_conditions(len(x_t)) if conditions is None else conditions
        a = diffusion.per_image(self.alpha_bar, t)
        with torch.no_grad(), torch.autocast(self.device.type, PRECISION):
            v, material = self.network.denoiser(x_t, t, a, given, text)
        return diffusion.noise_from_velocity(self.alpha_bar, x_t, v, t), material

    def sample(
        self, conditions: Tensor, prompts: list[str], generator: torch.Generator, steps: int = 25, guidance: float = 3.0
    ) -> Tensor:
        """Pictures of the prompts by DDIM with classifier-free guidance: (B, 3, S, S) as the model sees them."""
        noise = torch.randn(len(prompts), 3, self.size, self.size, generator=generator, device=generator.device)
        text = TextEmbedding.cat([self.embed(prompts), self.embed([""] * len(prompts))])
        both = torch.cat([conditions, conditions])

        def predict(x_t: Tensor, t: Tensor) -> Tensor:
            wanted, free = self.denoise(x_t.repeat(2, 1, 1, 1), t.repeat(2), both, text)[0].chunk(2)
            return free + guidance * (wanted - free)

        return diffusion.ddim(self.alpha_bar, predict, noise.to(self.device), steps)


def load_prior(device: str | torch.device = "cpu", weights: Path | None = None) -> Prior:
    """The shipped prior, or one of other weights, ready for inference.

    Raises: ArtifactError when a file is missing, damaged, or of another network.
    """
    device = torch.device(device)
    path = weights or WEIGHTS_FILE
    stored = load_npz(path, WEIGHTS)
    vocabulary = Vocabulary.load(VOCABULARY_FILE)
    words = sha256_file(VOCABULARY_FILE)
    if stored.provenance.inputs.get("vocabulary") != words:
        raise ArtifactError(f"{path}: trained with another {VOCABULARY_FILE.name} than is there; install both together")
    network = PriorNetwork(vocabulary.vectors.shape[1])
    if stored.provenance.extra["layout"] != network.layout():
        raise ArtifactError(f"{path}: weights of another network; train again or install the version they belong to")
    network.set_flat(stored["parameters"])
    network.eval().requires_grad_(False).to(device)
    network.denoiser.to(memory_format=torch.channels_last)  # type: ignore[call-overload]  # as convolutions want it
    for layer in network.denoiser.modules():  # what autocast would do to them in every step
        if isinstance(layer, nn.Conv2d | nn.Linear):
            layer.to(PRECISION)
    identity = {
        "name": "dreammat-prior",
        "weights": sha256_file(path),
        "vocabulary": words,
        "training": stored.provenance.extra["training"],
    }
    return Prior(network, vocabulary, diffusion.cosine_schedule().to(device), identity, device)


def save_weights(path: Path, network: PriorNetwork, values: NDArray, provenance: Provenance, training: dict) -> None:
    """Write a weights file. values: all parameters in a row, as `PriorNetwork.flat`, stored in half precision."""
    extra = {"layout": network.layout(), "training": training}
    stored = Provenance(provenance.options, provenance.seed, provenance.inputs, extra)
    save_npz(path, WEIGHTS, {"parameters": values.astype(np.float16)}, stored)
