"""Losses on the material itself, beside what a guidance asks of its pictures."""

import torch
from torch import Tensor

from stages.core.color import srgb_encode
from stages.core.shading import Material

REACH = 0.05
"""Standard deviation of the smoothness loss's displacement, world units. Source: Zhang et al. 2024, DreamMat, Section 3.3."""


BANDS = 8
"""Bands of height in which a material's mean is compared with an expected one."""


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


def distance_of_means(material: Material, height: Tensor, expected: Tensor) -> Tensor:
    """Squared distance between mean and mean expected material within bands of height. Differentiable in: material.

    The means alone are held, so that a pattern may still vary from place to place.

    Args:
        height: (P,) over the object's middle, object sizes. expected: (P, 5) sRGB albedo, roughness, metallic.
    """
    values = torch.cat([srgb_encode(material.albedo), material.roughness[:, None], material.metallic[:, None]], 1)
    band = ((height + 0.5) * BANDS).long().clamp(0, BANDS - 1)
    count = torch.bincount(band, minlength=BANDS)
    sums = torch.zeros(BANDS, values.shape[1], device=values.device).index_add(0, band, values - expected)
    return (sums.square().sum(1) / count.clamp(min=1)).sum() / len(values)  # means, by each band's share
