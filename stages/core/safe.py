"""Elementary functions that stay finite, in value and in gradient, where the plain ones do not.

Each states its value and its gradient at the edge of its domain. Nothing here adds an epsilon to a denominator:
the input is clamped once, outside the differentiated path, and the clamped region has gradient zero.
"""

import torch
from torch import Tensor


def safe_sqrt(x: Tensor) -> Tensor:
    """Square root of max(x, 0). Differentiable in: x, with gradient 0 where x <= 0."""
    positive = x > 0
    return torch.where(positive, torch.sqrt(torch.where(positive, x, torch.ones_like(x))), torch.zeros_like(x))


def safe_acos(x: Tensor) -> Tensor:
    """Arc cosine of x clamped to [-1, 1]. Differentiable in: x, with gradient 0 where |x| >= 1."""
    inside = x.abs() < 1
    angle = torch.acos(torch.where(inside, x, torch.zeros_like(x)))
    return torch.where(inside, angle, torch.where(x > 0, torch.zeros_like(x), torch.full_like(x, torch.pi)))


def safe_normalize(v: Tensor) -> Tensor:
    """Unit vector along the last axis; a zero (or underflowing) vector stays zero, with gradient zero.

    The vector is scaled by its largest component first, so that neither 1e-30 nor 1e30 loses its direction.

    Args:
        v: (..., D).
    Returns:
        (..., D). Differentiable in: v.
    """
    largest = v.abs().amax(-1, keepdim=True).detach()
    nonzero = largest > 0
    scaled = v / torch.where(nonzero, largest, torch.ones_like(largest))
    length = torch.sqrt(torch.where(nonzero, (scaled * scaled).sum(-1, keepdim=True), torch.ones_like(largest)))
    return torch.where(nonzero, scaled / length, torch.zeros_like(v))
