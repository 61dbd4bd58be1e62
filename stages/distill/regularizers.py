"""Losses on the material itself, beside what a guidance asks of its pictures."""

import torch
from torch import Tensor

from stages.core.shading import F0, Material

REACH = 0.05
"""Standard deviation of the smoothness loss's displacement, world units. Source: Zhang et al. 2024, DreamMat, Section 3.3."""

PULL = 0.002
TWIN_PULL = 0.1
TWIN_NEAR, TWIN_FAR = 0.15, 0.35
"""Weights of `plainness` and the window of its stronger pull. A residual of reference.HUBER weighs 0.03."""


def displaced(points: Tensor, normals: Tensor, generator: torch.Generator) -> Tensor:
    """Points moved along the surface's tangent plane by a normal distance. Args: (P, 3) each. Returns: (P, 3)."""
    step = REACH * torch.randn(points.shape, generator=generator).to(points)
    return points + step - normals * (normals * step).sum(-1, keepdim=True)


def smoothness(material: Material, nearby: Material) -> Tensor:
    """‖Γ(p) - Γ(p + ε)‖², mean over points. Differentiable in: both."""
    albedo = (material.albedo - nearby.albedo).square().sum(-1)
    rest = (material.roughness - nearby.roughness).square() + (material.metallic - nearby.metallic).square()
    return (albedo + rest).mean()


def plainness(material: Material) -> Tensor:
    """What pictures leave open is taken for a rough dielectric; mean over points. Differentiable in: roughness, metallic.

    A grey of albedo c <= F0 and metallic m looks exactly like its twin of albedo F0 (1 - m) and metallic 1 - c / F0. So
    a dark dielectric's twin is a metal whose albedo is F0, whatever the dielectric's own: such a metal is pulled most.
    Bright rough surfaces differ little whether metal or not, and unlit ones whether rough or not; there a slight pull
    on all points is enough, which evidence overrules.
    """
    off = (material.albedo.detach() / F0 - 1).abs().amax(-1)  # relative distance of the albedo from F0
    twin = ((TWIN_FAR - off) / (TWIN_FAR - TWIN_NEAR)).clamp(0.0, 1.0)
    return (material.metallic * (PULL + TWIN_PULL * twin) + PULL * (1 - material.roughness)).mean()


def bimodality(metallic: Tensor) -> Tensor:
    """m (1 - m), mean over points: zero where a point is metal or not, never both. Differentiable in: metallic."""
    return (metallic * (1 - metallic)).mean()


def distance_of_means(material: Material, expected: Tensor) -> Tensor:
    """Squared distance between the points' mean material and an expected one. Differentiable in: material.

    The mean alone is held, so that a composition may still differ from place to place.

    Args:
        expected: (5,) linear albedo, roughness, metallic.
    """
    mean = torch.cat([material.albedo.mean(0), material.roughness.mean()[None], material.metallic.mean()[None]])
    return (mean - expected.to(mean)).square().sum()
