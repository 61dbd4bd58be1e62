"""Losses on the material itself, beside what a guidance asks of its pictures."""

import torch
from torch import Tensor

from stages.core.color import luminance, srgb_decode, srgb_encode
from stages.core.shading import Material

DIM = 0.05
"""Irradiance, and albedo, at which the logarithmic scale turns linear: as a share of the mean light, and absolute."""

REACH = 0.05
"""Standard deviation of the smoothness loss's displacement, world units. Source: Zhang et al. 2024, DreamMat, Section 3.3."""


def displaced(points: Tensor, normals: Tensor, generator: torch.Generator) -> Tensor:
    """Points moved along the surface's tangent plane by a normal distance. Args: (P, 3) each. Returns: (P, 3)."""
    step = REACH * torch.randn(points.shape, generator=generator).to(points)
    return points + step - normals * (normals * step).sum(-1, keepdim=True)


def smoothness(material: Material, nearby: Material) -> Tensor:
    """‖Γ(p) - Γ(p + ε)‖², mean over points. Differentiable in: both."""
    albedo = (material.albedo - nearby.albedo).square().sum(-1)
    rest = (material.roughness - nearby.roughness).square() + (material.metallic - nearby.metallic).square()
    return (albedo + rest).mean()


def bimodality(metallic: Tensor) -> Tensor:
    """m (1 - m), mean over points: zero where a point is metal or not, never both. Differentiable in: metallic."""
    return (metallic * (1 - metallic)).mean()


def encoded(values: Tensor) -> Tensor:
    """Materials (P, 5) with their albedo as sRGB, in which dark colours count. Differentiable in: values."""
    return torch.cat([srgb_encode(values[:, :3]), values[:, 3:]], 1)


def distance(material: Material, expected: Tensor) -> Tensor:
    """Squared distance from an expected material, mean over points. Differentiable in: material.

    Args:
        expected: (P, 5) sRGB albedo, roughness, metallic.
    """
    return (encoded(material.columns()) - expected).square().sum(1).mean()


def baked_light(material: Material, expected: Tensor, irradiance: Tensor) -> Tensor:
    """How much of what departs from an expected albedo follows the light: the variance that log irradiance explains.

    Differentiable in: material.

    Args:
        expected: (P, 5) sRGB albedo, roughness, metallic. irradiance: (P, 3) linear, of any scale.
    """
    departure = torch.log((luminance(material.albedo) + DIM) / (luminance(srgb_decode(expected[:, :3])) + DIM))
    light = luminance(irradiance)
    light = torch.log(light / light.mean().clamp(min=1e-9) + DIM)
    light = light - light.mean()
    return (departure * light).mean().square() / light.square().mean().clamp(min=1e-6)
