"""The guidance contract: from rendered images to the gradient with respect to them.

A guidance knows nothing of the material field, and the loop nothing of diffusion or targets. What a step shows comes
as a `Sample`: object pixels under L lights, with layout, conditions and light transport. A guidance states by its
sampler whether it wants to see square crops (L = 1) or loose pixels (L = all environments).
"""

from dataclasses import dataclass
from typing import Any, Protocol

import torch
from torch import Tensor

from stages.distill.guidance.csd import Weights
from stages.distill.sampling import Sample, Sampler
from stages.distill.start import Start


@dataclass(frozen=True)
class Budget:
    """How long to optimise and how fast. steps: of the optimiser. learning_rate: of Adam, at the start."""

    steps: int
    learning_rate: float


@dataclass(frozen=True)
class Response:
    """What a guidance answers to rendered pixels.

    gradient: (P L, 3) of its loss, scaled to a mean over pixels. loss: a number for the curve. curvature: (P L, 3) second
    derivative of the loss by each value, scaled alike, where the loss is one of least squares: the material is then
    stepped by `stages.distill.gauss_newton`. plain: with a curvature, how far a step takes metallic down and roughness up
    where the pictures leave them open. expected: (P, 5) sRGB albedo, roughness and metallic that the words alone call for at
    each point.
    """

    gradient: Tensor
    loss: float
    curvature: Tensor | None = None
    plain: float = 0.0
    expected: Tensor | None = None


class Guidance(Protocol):
    """What an optimisation step asks.

    sampler: draws what this guidance wants to see. identity: name and what identifies its model or target (JSON types).
    inputs: role -> SHA-256 of the files it was made from. start: from which the field had best begin, or None where it makes
    no difference. budget: what it calls for where the options leave it open. weights: of its score, or None where it has
    none.
    """

    @property
    def sampler(self) -> Sampler: ...

    @property
    def start(self) -> Start | None: ...

    @property
    def weights(self) -> Weights | None: ...

    identity: dict[str, Any]
    inputs: dict[str, str]
    budget: Budget

    def draw(self, generator: torch.Generator) -> Sample:
        """What a step shows, with all that `respond` needs of it and no field changes. May be called on another thread."""

    def respond(self, radiance: Tensor, sample: Sample, progress: float, generator: torch.Generator) -> Response:
        """Which way the rendered pixels should go.

        Args:
            radiance: (P L, 3) linear, of the sample's points under its lights; detached. progress: in [0, 1).
            generator: a CPU generator, the only source of random numbers.
        """
