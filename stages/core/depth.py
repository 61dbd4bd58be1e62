"""How diffusion models are shown depth: near is bright."""

import math

import torch
from torch import Tensor


def inverse_depth(depth: Tensor, inside: Tensor) -> Tensor:
    """0.3 + 0.7 (inv - min) / (max - min) of inv = 1 / depth over each image's mask; 0 outside. Shapes (B, 1, S, S)."""
    inverse = 1 / torch.where(inside, depth, 1.0)
    low = torch.where(inside, inverse, math.inf).amin((1, 2, 3), keepdim=True)
    high = torch.where(inside, inverse, -math.inf).amax((1, 2, 3), keepdim=True)
    span = torch.where(high > low, high - low, 1.0)
    return torch.where(inside, 0.3 + 0.7 * (inverse - torch.where(low.isfinite(), low, 0.0)) / span, 0.0)
