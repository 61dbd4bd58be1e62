"""Losses on the material itself, beside what a guidance asks of its pictures."""

import torch
from torch import Tensor

from stages.core.color import luminance
from stages.core.shading import Material

DIM = 0.05
"""Irradiance, and albedo, at which the logarithmic scale turns linear: as a share of the mean light, and absolute."""

SLOPE = 0.25
"""Steepest slope of a sigmoid: how far a material's value moves for one unit of its logit."""

REACH = 0.05
"""Standard deviation of the smoothness loss's displacement, world units. Source: Zhang et al. 2024, DreamMat, Section 3.3."""


def displaced(points: Tensor, normals: Tensor, generator: torch.Generator) -> Tensor:
    """Points moved along the surface's tangent plane by a normal distance. Args: (P, 3) each. Returns: (P, 3)."""
    step = REACH * torch.randn(points.shape, generator=generator).to(points)
    return points + step - normals * (normals * step).sum(-1, keepdim=True)


def smoothness(residual: Tensor, nearby: Tensor) -> Tensor:
    """‖Γ(p) - Γ(p + ε)‖² of what was learnt, mean over points. Args: (P, 5) logits. Differentiable in: both."""
    return (residual - nearby).square().sum(-1).mean() * SLOPE**2


def bimodality(metallic: Tensor) -> Tensor:
    """m (1 - m), mean over points: zero where a point is metal or not, never both. Differentiable in: metallic."""
    return (metallic * (1 - metallic)).mean()


def hold(residual: Tensor) -> Tensor:
    """Squared norm of what was learnt, mean over points, on the scale of the material. Args: (P, 5). Differentiable in: it."""
    return residual.square().sum(-1).mean() * SLOPE**2


def baked_light(material: Material, even: Tensor, irradiance: Tensor) -> Tensor:
    """How much of what varies within the coats follows the light: the variance of log albedo that log irradiance explains.

    Also what patterns have in common with the light by chance: to an eye it is baked in. Where coats lie is left alone, since
    moss in crevices may follow it.

    Differentiable in: material.

    Args:
        even: (P, 3) linear albedo if each coat were of one colour. irradiance: (P, 3) linear, of any scale.
    """
    departure = torch.log((luminance(material.albedo) + DIM) / (luminance(even) + DIM))
    light = luminance(irradiance)
    light = torch.log(light / light.mean().clamp(min=1e-9) + DIM)
    light = light - light.mean()
    return (departure * light).mean().square() / light.square().mean().clamp(min=1e-6)
