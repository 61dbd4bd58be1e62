"""What shading and its gradient cost in a step of distillation, and how wrong that gradient is.

From the light transport, and by Monte Carlo with 200 + 128 shadowed rays a pixel as the paper does it: time for all
pixels of a view under one environment, and the error of the gradient of each pixel's radiance against float64
quadrature, both at random materials.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.core.brdf import alpha_from_roughness
from stages.core.shading import F0, Material, Transport, shade
from stages.light.environment import Environment, directions_of_texels, lookup
from stages.light.gbuffer import GBuffer
from stages.light.light_set import LightSet
from stages.light.scene import Scene
from stages.light.transport import QUALITY, integrate
from stages.report.monte_carlo import shade_monte_carlo

CHUNK = 2048
"""Pixels that Monte Carlo shades at once."""

TIMED = 16_384
"""Pixels by which Monte Carlo is timed; seconds are scaled to the view."""

PIXELS = 192
ROWS = 512
"""Rows of directions of the quadrature, at least."""

REPEATS = 5

LOWEST_ROUGHNESS = 0.3
"""Of the random materials: lobes that the quadrature's grid resolves."""


@dataclass(frozen=True)
class Step:
    """One way to shade. milliseconds: radiance and gradient of the view's object pixels.

    gradient_error_percent: RMS over pixels, of the gradient by albedo, roughness and metallic, against the RMS gradient.
    """

    shading: str
    environment: str
    milliseconds: float
    gradient_error_percent: float


def measure(scene: Scene, points: GBuffer, lights: LightSet, seed: int) -> list[Step]:
    """Both ways under every environment."""
    generator = np.random.default_rng(seed)
    rows = np.sort(generator.choice(len(points.n), min(PIXELS, len(points.n)), replace=False))
    timed = np.sort(generator.choice(len(points.n), min(TIMED, len(points.n)), replace=False))
    materials = torch.from_numpy(generator.random((len(points.n), 5), np.float32))
    materials[:, 3] = LOWEST_ROUGHNESS + (1 - LOWEST_ROUGHNESS) * materials[:, 3]
    transports = integrate(scene, points, lights, QUALITY["standard"], seed)
    steps = []
    for environment, transport in zip(lights.environments, transports, strict=True):
        exact = exact_gradient(scene, points, environment.radiance, materials[rows], rows)
        whole = Transport(*(t.contiguous() for t in (transport.E, transport.A, transport.B, transport.cosine)))
        gradient, seconds = timed_gradient(partial(from_transport, whole), materials, REPEATS)
        steps.append(Step("from the transport", environment.name, seconds * 1000, error(gradient[rows], exact)))
        by_rays = partial(from_rays, scene, environment, generator)
        seconds = 0.0
        for chunk in np.array_split(timed, -(-len(timed) // CHUNK)):
            seconds += timed_gradient(partial(by_rays, points[chunk]), materials[chunk], 1)[1]
        gradient, _ = timed_gradient(partial(by_rays, points[rows]), materials[rows], 1)
        milliseconds = seconds * len(points.n) / len(timed) * 1000
        steps.append(Step("Monte Carlo, 200 + 128 rays a pixel", environment.name, milliseconds, error(gradient, exact)))
    return steps


def from_transport(transport: Transport, values: Tensor) -> Tensor:
    """Radiance (P, 3) of materials (P, 5)."""
    return shade(transport, Material.of(values))


def from_rays(
    scene: Scene, light: Environment, generator: np.random.Generator, points: GBuffer, values: Tensor
) -> Tensor:
    """Radiance (P, 3) of materials (P, 5)."""
    return shade_monte_carlo(scene, points, light, Material.of(values), generator)


def timed_gradient(shading: Callable[[Tensor], Tensor], materials: Tensor, repeats: int) -> tuple[Tensor, float]:
    """Gradient of the summed radiance by (P, 5) values, and the median seconds of getting it."""
    seconds = []
    for _ in range(repeats):
        values = materials.clone().requires_grad_()
        start = time.perf_counter()
        shading(values).sum().backward()
        seconds.append(time.perf_counter() - start)
    assert values.grad is not None
    return values.grad, float(np.median(seconds))


def error(found: Tensor, exact: Tensor) -> float:
    """RMS of the difference over the RMS of the exact gradient, percent."""
    return float((found.double() - exact).square().mean().sqrt() / exact.square().mean().sqrt()) * 100


def exact_gradient(scene: Scene, points: GBuffer, radiance: NDArray, materials: Tensor, rows: NDArray) -> Tensor:
    """(N, 5) float64: quadrature over every texel of the light, cut if they are few, differentiated as a whole."""
    height, width, _ = radiance.shape
    cells = -(-ROWS // height)
    directions, angle = directions_of_texels(height * cells, width * cells)
    wi = directions.reshape(-1, 3)
    light = lookup(radiance, wi) * np.repeat(angle, width * cells)[:, None]
    gradients = []
    for row, values in zip(rows, materials.double(), strict=True):
        n, wo = points.n[row].astype(np.float64), points.wo[row].astype(np.float64)
        above = np.flatnonzero(wi @ n > 0)
        above = above[~scene.occluded(np.broadcast_to(points.origin[row], (len(above), 3)), wi[above])]
        values = values.clone().requires_grad_()
        _radiance(n, wo, wi[above], torch.from_numpy(light[above]), values).sum().backward()
        gradients.append(values.grad)
    return torch.stack(gradients)  # type: ignore[arg-type]


def _radiance(n: NDArray, wo: NDArray, wi: NDArray, light: Tensor, values: Tensor) -> Tensor:
    c, r, m = values[:3], values[3], values[4]
    wm = wi + wo
    wm /= np.linalg.norm(wm, axis=-1, keepdims=True)
    n_l, n_v = torch.from_numpy(wi @ n), float(wo @ n)
    n_h, s = torch.from_numpy(wm @ n), torch.from_numpy((1 - wm @ wo) ** 5)
    a2 = alpha_from_roughness(r) ** 2  # a tensor of one number
    D = a2 / (np.pi * ((a2 - 1) * n_h**2 + 1) ** 2)
    lambdas = [0.5 * ((1 + a2 * (1 - x**2) / x**2).sqrt() - 1) for x in (n_l, torch.tensor(n_v, dtype=torch.float64))]
    lobe = D / (1 + lambdas[0] + lambdas[1]) / (4 * n_v)
    E = ((1 - F0) * (1 - s) * n_l / np.pi) @ light
    return (1 - m) * c * E + (F0 * (1 - m) + m * c) * (((1 - s) * lobe) @ light) + (s * lobe) @ light
