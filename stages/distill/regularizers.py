"""Losses on the material itself, beside what a guidance asks of its pictures."""

import torch
from torch import Tensor

from stages.core.color import srgb_encode
from stages.core.shading import Material

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


def distance_of_means(material: Material, expected: Tensor) -> Tensor:
    """Squared distance between the points' mean material and an expected one, colours as sRGB, in which a dark one counts too.

    The mean alone is held, so that a composition may still differ from place to place. Differentiable in: material.

    Args:
        expected: (5,) linear albedo, roughness, metallic.
    """
    albedo = srgb_encode(material.albedo).mean(0) - srgb_encode(expected[:3].to(material.albedo))
    rest = torch.stack([material.roughness.mean(), material.metallic.mean()]) - expected[3:].to(material.roughness)
    return albedo.square().sum() + rest.square().sum()
