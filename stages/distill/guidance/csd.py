"""Classifier Score Distillation: one function of three noise predictions, shared by all diffusion models."""

from torch import Tensor


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
