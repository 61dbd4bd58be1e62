"""Classifier Score Distillation: one function of three noise predictions, shared by all diffusion models.

Classic score distillation is the same sum with other weights: with the guidance weight w of DreamFusion (Section 2),
(1 + w) positive - w null - noise = w (positive - null) + (positive - noise).
"""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from stages.core import diffusion
from stages.distill import schedule
from stages.distill.options import DistillOptions


@dataclass(frozen=True)
class Weights:
    """Weights of the terms of a score. eta1: prompt against no prompt. eta2: no prompt against the negative one, at the
    start and from two thirds of the steps on. posterior: prompt against the noise that was added."""

    eta1: float
    eta2: tuple[float, float]
    posterior: float


CSD = Weights(eta1=1.05, eta2=(1.0, 0.5), posterior=0.0)
"""Source: Zhang et al. 2024, DreamMat, Section 4.1."""

SDS = Weights(eta1=100.0, eta2=(0.0, 0.0), posterior=1.0)
"""Source: Poole et al. 2022, "DreamFusion", guidance weight 100."""


def chosen_weights(options: DistillOptions, own: Weights) -> Weights:
    """The weights that the options name; those they leave open are SDS, or for CSD the guidance's own."""
    given = {name: getattr(options.score, name) for name in ("eta1", "eta2", "posterior")}
    given = {name: value for name, value in given.items() if value is not None}
    return dataclasses.replace(SDS if options.score.loss == "sds" else own, **given)


def distillation_score(
    predict: Callable[[Tensor, Tensor, int], Tensor],
    image: Tensor,
    alpha_bar: Tensor,
    weights: Weights,
    progress: float,
    generator: torch.Generator,
) -> Tensor:
    """The gradient with respect to images: noise them to random times, and weigh by 1 - alpha_bar what is predicted.

    Args:
        predict: (x_t, t, branches) -> noise in x_t, for the prompt, no prompt and the negative prompt, or the first two
        of them: a negative prompt without weight is not asked. Its inputs and result hold the branches one after the other.
        image: (B, C, H, W), what the model denoises. alpha_bar: (1000,). progress: of the run, in [0, 1).
        generator: of the CPU.
    Returns:
        (B, C, H, W).
    """
    low, high = schedule.time_range(progress)
    t = torch.randint(low, high + 1, (len(image),), generator=generator).to(image.device, non_blocking=True)
    noise = torch.randn(image.shape, generator=generator).to(image.device, non_blocking=True)
    x_t = diffusion.add_noise(alpha_bar, image, noise, t)
    eta2 = schedule.eta2(progress, *weights.eta2)
    branches = 3 if eta2 else 2
    positive, null, *rest = predict(x_t.repeat(branches, 1, 1, 1), t.repeat(branches), branches).chunk(branches)
    negative = rest[0] if rest else null
    score = classifier_score(positive, null, negative, weights.eta1, eta2)
    return (1 - diffusion.per_image(alpha_bar, t)) * (score + weights.posterior * posterior_score(positive, noise))


def classifier_score(positive: Tensor, null: Tensor, negative: Tensor, eta1: float, eta2: float) -> Tensor:
    """The gradient direction of CSD; exactly linear, and zero when the three predictions agree.

    Source: Yu et al. 2024, "Text-to-3D with Classifier Score Distillation", Eq. 10; Zhang et al. 2024, DreamMat, Eq. 7:
    eta1 positive + (eta2 - eta1) null - eta2 negative.

    Args:
        positive, null, negative: (B, C, H, W) noise predicted for the prompt, no prompt, and the negative prompt.
        eta1, eta2: weights of the pull towards the prompt and of the push away from the negative prompt.
    Returns:
        (B, C, H, W). Differentiable in: all three.
    """
    return eta1 * (positive - null) + eta2 * (null - negative)


def posterior_score(positive: Tensor, noise: Tensor) -> Tensor:
    """The classic score-distillation residual, which pulls towards what the model holds likely, not only typical of the text.

    Source: Poole et al. 2022, "DreamFusion", Eq. 3 (the weight is left to the caller).

    Args:
        positive: (B, C, H, W) noise predicted for the prompt. noise: (B, C, H, W) the noise that was added.
    """
    return positive - noise
