"""Shading by Monte Carlo in every step: what the paper does, kept to be measured against.

Each pixel draws 200 directions from the cosine lobe and 128 from the GGX lobe of its present roughness, traces a shadow
ray along each, looks up the environment and averages, with the same BRDF as everything here. The gradient is that of the
average with the directions held fixed.

Source: Zhang et al. 2024, "DreamMat", sec. 3.3; Hasselgren et al. 2022, "Shape, Light, and Material Decomposition".
"""

import math

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.core.frames import tangent_frame
from stages.core.shading import F0, Material
from stages.light.environment import Environment, lookup
from stages.light.gbuffer import GBuffer
from stages.light.scene import Scene

DIFFUSE, SPECULAR = 200, 128

MIN_ALPHA = 1e-3


def shade_monte_carlo(
    scene: Scene, points: GBuffer, light: Environment, material: Material, generator: np.random.Generator
) -> Tensor:
    """Outgoing radiance (P, 3). Differentiable in: albedo, roughness, metallic."""
    frame = np.stack([*tangent_frame(points.n), points.n], 1).astype(np.float32)  # (P, 3, 3): t, b, n
    wo = torch.from_numpy(np.einsum("pkd,pd->pk", frame, points.wo))
    alpha = material.roughness.square().clamp(min=MIN_ALPHA)
    diffuse = _cosine_directions(len(wo), generator)
    specular = _ggx_directions(wo, alpha.detach(), generator)
    wi = torch.cat([diffuse, specular], 1)  # (P, S, 3) local
    radiance = torch.from_numpy(_incoming(scene, points, light, frame, wi.numpy()))
    f_diffuse, f_specular = _brdf(wo, wi, alpha, material)
    cosine = wi[..., 2].clamp(min=0)
    wm = torch.nn.functional.normalize(wi + wo[:, None], dim=-1)
    pdf = _ggx(wm, alpha.detach()) * wm[..., 2] / (4 * (wm * wo[:, None]).sum(-1)).clamp(min=1e-6)
    first = (f_diffuse * math.pi * radiance)[:, :DIFFUSE].mean(1)
    weight = torch.where(cosine > 0, cosine / pdf.clamp(min=1e-8), torch.zeros_like(cosine))
    second = (f_specular * weight[..., None] * radiance)[:, DIFFUSE:].mean(1)
    return first + second


def _cosine_directions(count: int, generator: np.random.Generator) -> Tensor:
    u = torch.from_numpy(generator.random((count, DIFFUSE, 2), np.float32))
    radius, phi = u[..., 0].sqrt(), 2 * math.pi * u[..., 1]
    return torch.stack([radius * phi.cos(), radius * phi.sin(), (1 - u[..., 0]).sqrt()], -1)


def _ggx_directions(wo: Tensor, alpha: Tensor, generator: np.random.Generator) -> Tensor:
    u = torch.from_numpy(generator.random((len(wo), SPECULAR, 2), np.float32))
    cos2 = (1 - u[..., 0]) / (1 + (alpha[:, None] ** 2 - 1) * u[..., 0])
    sin, phi = (1 - cos2).clamp(min=0).sqrt(), 2 * math.pi * u[..., 1]
    wm = torch.stack([sin * phi.cos(), sin * phi.sin(), cos2.sqrt()], -1)
    return 2 * (wm * wo[:, None]).sum(-1, keepdim=True) * wm - wo[:, None]


def _incoming(scene: Scene, points: GBuffer, light: Environment, frame: NDArray, wi: NDArray) -> NDArray[np.float32]:
    world = np.einsum("psk,pkd->psd", wi, frame).reshape(-1, 3)
    above = wi[..., 2].ravel() > 0
    radiance = np.zeros(world.shape, np.float32)
    origin = np.repeat(points.origin, wi.shape[1], 0)[above]
    radiance[above] = lookup(light.radiance, world[above]) * ~scene.occluded(origin, world[above])[:, None]
    return radiance.reshape(wi.shape)


def _ggx(wm: Tensor, alpha: Tensor) -> Tensor:
    a2 = (alpha**2)[:, None]
    return a2 / (math.pi * ((a2 - 1) * wm[..., 2] ** 2 + 1) ** 2)


def _brdf(wo: Tensor, wi: Tensor, alpha: Tensor, material: Material) -> tuple[Tensor, Tensor]:
    """Diffuse and specular lobes of glTF's metallic-roughness material, without the cosine: (P, S, 3) each."""
    wm = torch.nn.functional.normalize(wi + wo[:, None], dim=-1)
    s = (1 - (wm * wo[:, None]).sum(-1).clamp(0, 1)) ** 5
    a2 = (alpha**2)[:, None]
    cosines = wi[..., 2].clamp(min=1e-4), wo[:, None, 2].clamp(min=1e-4)
    smith = sum(0.5 * ((1 + a2 * (1 - c**2) / c**2).sqrt() - 1) for c in cosines)
    lobe = _ggx(wm, alpha) / (1 + smith) / (4 * cosines[0] * cosines[1])
    m = material.metallic[:, None, None]
    c = material.albedo[:, None]
    fresnel = F0 * (1 - m) + m * c
    diffuse = (1 - m) * c * ((1 - F0) * (1 - s) / math.pi)[..., None]
    return diffuse, (fresnel * (1 - s[..., None]) + s[..., None]) * lobe[..., None]
