"""The diffusion process: noise schedule, the three ways to say what was predicted, and DDIM.

x_t = sqrt(a) x_0 + sqrt(1 - a) eps,   v = sqrt(a) eps - sqrt(1 - a) x_0,   a = alpha_bar[t],  t = 0 ... STEPS - 1.
"""

import math
from collections.abc import Callable

import torch
from torch import Tensor

STEPS = 1000
"""Length of the noise schedule."""


def cosine_schedule(offset: float = 0.008, largest_beta: float = 0.999) -> Tensor:
    """alpha_bar of every step, (STEPS,) float32, falling. Source: Nichol & Dhariwal 2021, Eq. 17."""
    t = torch.arange(STEPS + 1, dtype=torch.float64) / STEPS
    f = torch.cos((t + offset) / (1 + offset) * math.pi / 2) ** 2
    beta = (1 - f[1:] / f[:-1]).clamp(max=largest_beta)
    return torch.cumprod(1 - beta, 0).float()


def per_image(values: Tensor, t: Tensor) -> Tensor:
    """values[t] shaped (B, 1, 1, 1)."""
    return values[t][:, None, None, None]


def add_noise(alpha_bar: Tensor, x0: Tensor, noise: Tensor, t: Tensor) -> Tensor:
    """x_t. Args: x0, noise (B, C, H, W); t (B,). Differentiable in: x0, noise."""
    a = per_image(alpha_bar, t)
    return a.sqrt() * x0 + (1 - a).sqrt() * noise


def velocity(alpha_bar: Tensor, x0: Tensor, noise: Tensor, t: Tensor) -> Tensor:
    """v, the training target. Source: Salimans & Ho 2022, appendix D."""
    a = per_image(alpha_bar, t)
    return a.sqrt() * noise - (1 - a).sqrt() * x0


def noise_from_velocity(alpha_bar: Tensor, x_t: Tensor, v: Tensor, t: Tensor) -> Tensor:
    """eps from v and x_t."""
    a = per_image(alpha_bar, t)
    return a.sqrt() * v + (1 - a).sqrt() * x_t


def image_from_velocity(alpha_bar: Tensor, x_t: Tensor, v: Tensor, t: Tensor) -> Tensor:
    """x_0 from v and x_t."""
    a = per_image(alpha_bar, t)
    return a.sqrt() * x_t - (1 - a).sqrt() * v


def ddim(
    alpha_bar: Tensor,
    predict: Callable[[Tensor, Tensor], Tensor],
    noise: Tensor,
    steps: int,
    limits: tuple[float, float] = (-1.2, 3.0),
) -> Tensor:
    """Deterministic sampling. Source: Song et al. 2021, Eq. 12 with sigma = 0.

    Args:
        predict: (x_t, t) -> eps. noise: (B, C, H, W). steps: how many of `STEPS` are visited. limits: of x_0; the
        default is for toned pictures.
    """
    x = noise
    times = torch.linspace(STEPS - 1, 0, steps).round().long().tolist()
    for now, then in zip(times, [*times[1:], -1], strict=True):
        t = torch.full((len(x),), now, device=x.device)
        eps = predict(x, t)
        a, b = alpha_bar[now], alpha_bar[then] if then >= 0 else torch.ones_like(alpha_bar[0])
        x0 = (x - (1 - a).sqrt() * eps) / a.sqrt()
        x = b.sqrt() * x0.clamp(*limits) + (1 - b).sqrt() * eps
    return x
