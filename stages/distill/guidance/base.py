"""The guidance contract: from rendered images to the gradient with respect to them.

A guidance knows nothing of the material field, and the loop nothing of diffusion or targets. What a step shows comes
as a `Sample`: object pixels under L lights, with layout, conditions and light transport. A guidance states by its
sampler whether it wants to see square crops, or loose pixels without light: their material is all that it is shown.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import torch
from torch import Tensor

from stages.core.progress import Progress
from stages.distill.guidance.csd import Weights
from stages.distill.sampling import Sample, Sampler
from stages.material.recipe import Recipe


@dataclass(frozen=True)
class Budget:
    """How long to optimise and how fast. steps: of the optimiser. learning_rate: of Adam, at the start."""

    steps: int
    learning_rate: float


@dataclass(frozen=True)
class Response:
    """What a guidance answers to what it is shown. gradient: of its loss by that, scaled to a mean over pixels. loss: a number
    for the curve."""

    gradient: Tensor
    loss: float


class Guidance(Protocol):
    """What an optimisation step asks.

    sampler: draws what this guidance wants to see. identity: name and what identifies its model or target (JSON types).
    inputs: role -> SHA-256 of the files it was made from. recipe: what the words alone call for, to which a run adds what it
    learns. held: whether what is learnt is held near to it. looks: whether it is shown radiance. budget: what it calls for
    where the options leave it open. weights: of its score, or None where it has none. """

    @property
    def sampler(self) -> Sampler: ...

    @property
    def recipe(self) -> Recipe: ...

    @property
    def weights(self) -> Weights | None: ...

    held: bool
    looks: bool
    identity: dict[str, Any]
    inputs: dict[str, str]
    budget: Budget

    def begin(self, progress: Progress) -> None:
        """What takes long, before the first step; a run that is up to date never does."""

    def draw(self, generator: torch.Generator) -> Sample:
        """What a step shows, with all that `respond` needs of it and no field changes. May be called on another thread."""

    def respond(self, shown: Tensor, /, sample: Sample, progress: float, generator: torch.Generator) -> Response:
        """Which way the rendered pixels should go.

        Args:
            shown: radiance (P L, 3), linear, of the sample's points under its lights, or, where the guidance knows materials
            and looks at none, their material (P, 5); detached. progress: in [0, 1).
            generator: a CPU generator, the only source of random numbers.
        """
