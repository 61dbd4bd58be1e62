"""Where the pictures want a point's material to go, by damped Gauss-Newton, each point for itself.

Pictures speak of roughness and metallic in a much softer voice than of albedo, and mix the three: a dark metal looks nearly
like a dark dielectric of another roughness. Plain gradients crawl along such valleys. Here the few values that a point
shows (its lights, three channels each) are linearised in the five values of its material, the damped least squares
are solved, and the field is sent to the solution by cross-entropy: its slope by the logit is value minus goal, which does
not die away near 0 and 1 as that of a sigmoid does.

Sources: Levenberg 1944, "A method for the solution of certain non-linear problems in least squares"; Marquardt 1963.
"""

import torch
from torch import Tensor

from stages.core.shading import Material, Transport, derivatives
from stages.distill.guidance.base import Response

DAMPING_START, DAMPING_END = 1e-3, 1e-4
"""Added to the normal matrix's diagonal at the start and at the end of a run, falling by a power law between: curvature
of a point's loss below which a direction counts as not seen."""

DOUBT = 0.1
"""Damping by a point's own squared residual, since a linearisation far from the target is not to be trusted. Source: Fan &
Yuan 2005, "On the quadratic convergence of the Levenberg-Marquardt method without nonsingularity assumption"."""

LARGEST = 0.1
"""Longest step of a material's value."""

LEAST_SLOPE = 1e-4
"""m (1 - m) is taken no smaller when dividing by a sigmoid's slope."""


def material_gradient(
    transport: Transport, material: Material, response: Response, progress: float
) -> tuple[Tensor, Tensor, Tensor]:
    """Gradients that send a sigmoid's logits to each point's Gauss-Newton solution, as a mean over points.

    Args:
        transport: P L rows. material: of P points, detached. response: with gradient and curvature (P L, 3).
        progress: of the run, in [0, 1).
    Returns:
        gradients of albedo (P, 3), roughness (P,) and metallic (P,).
    """
    x = torch.cat([material.albedo, material.roughness[:, None], material.metallic[:, None]], 1)  # (P, 5)
    goal = (x + proposal(transport, material, response, progress)).clamp(0.0, 1.0)
    gradient = (x - goal) / (x * (1 - x)).clamp(min=LEAST_SLOPE) / len(x)
    return gradient[:, :3], gradient[:, 3], gradient[:, 4]


def proposal(transport: Transport, material: Material, response: Response, progress: float) -> Tensor:
    """The damped Gauss-Newton step of every point: (P, 5), each value within `LARGEST`."""
    assert response.curvature is not None
    points = len(material.roughness)
    jacobian = _jacobian(transport, material)  # (P, 3 L, 5)
    by_radiance, curvature = (points * t.reshape(points, -1) for t in (response.gradient, response.curvature))
    gradient = torch.einsum("pn,pnk->pk", by_radiance, jacobian)
    damping = DAMPING_START * (DAMPING_END / DAMPING_START) ** progress
    gradient[:, 3] -= damping * response.plain
    gradient[:, 4] += damping * response.plain
    normal = (jacobian * curvature[..., None]).mT @ jacobian
    squared = (by_radiance.square() / curvature.clamp(min=torch.finfo(curvature.dtype).tiny)).sum(1)  # mean residual²
    identity = torch.eye(5, dtype=normal.dtype, device=normal.device)
    damped = normal + (damping + DOUBT * squared)[:, None, None] * identity
    return -torch.linalg.solve(damped, gradient[..., None])[..., 0].clamp(-LARGEST, LARGEST)


def _jacobian(transport: Transport, material: Material) -> Tensor:
    """Derivatives of the shown values by a point's material: (P, 3 L, 5)."""
    by = derivatives(transport, material)
    points = len(material.roughness)
    whole = torch.zeros(len(by.albedo), 3, 5, dtype=by.albedo.dtype, device=by.albedo.device)
    for channel in range(3):
        whole[:, channel, channel] = by.albedo[:, channel]
    whole[..., 3], whole[..., 4] = by.roughness, by.metallic
    return whole.view(points, -1, 5)
