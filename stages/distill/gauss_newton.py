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


ROUGHNESS = 3
"""Column of a material's five values."""

HELD = 1e6
"""Damping of a value that must stay."""


def logit_gradient(values: Tensor, goal: Tensor) -> Tensor:
    """Gradient by a sigmoid's values that sends its logits to a goal, as a mean over points. Args: (P, 5) each."""
    return (values - goal) / (values * (1 - values)).clamp(min=LEAST_SLOPE) / len(values)


def proposal(
    transport: Transport, material: Material, response: Response, progress: float, held: int | None = None
) -> Tensor:
    """The damped Gauss-Newton step of every point: (P, 5), each value within `LARGEST`.

    Args:
        transport: P L rows. material: of P points, detached. response: with gradient and curvature (P L, 3).
        progress: of the run, in [0, 1). held: column of a value that stays as it is.
    """
    points = len(material.roughness)
    jacobian = _jacobian(transport, material)  # (P, 3 L, 5)
    by_radiance, curvature = _per_point(response, points)
    gradient = torch.einsum("pn,pnk->pk", by_radiance, jacobian)
    damping = DAMPING_START * (DAMPING_END / DAMPING_START) ** progress
    gradient[:, 3] -= damping * response.plain
    gradient[:, 4] += damping * response.plain
    normal = (jacobian * curvature[..., None]).mT @ jacobian
    damped = normal + torch.diag_embed((damping + DOUBT * misfit(response, points))[:, None].expand(-1, 5))
    if held is not None:
        damped[:, held, held] += HELD
    return -torch.linalg.solve(damped, gradient[..., None])[..., 0].clamp(-LARGEST, LARGEST)


def misfit(response: Response, points: int) -> Tensor:
    """Mean squared residual of every point, as its loss counts it: (P,)."""
    by_radiance, curvature = _per_point(response, points)
    return (by_radiance.square() / curvature.clamp(min=torch.finfo(curvature.dtype).tiny)).sum(1)


def _per_point(response: Response, points: int) -> tuple[Tensor, Tensor]:
    """Gradient and curvature of each point's own loss: (P, 3 L) each."""
    assert response.curvature is not None
    gradient, curvature = (points * t.reshape(points, -1) for t in (response.gradient, response.curvature))
    return gradient, curvature


def _jacobian(transport: Transport, material: Material) -> Tensor:
    """Derivatives of the shown values by a point's material: (P, 3 L, 5)."""
    by = derivatives(transport, material)
    points = len(material.roughness)
    whole = torch.zeros(len(by.albedo), 3, 5, dtype=by.albedo.dtype, device=by.albedo.device)
    for channel in range(3):
        whole[:, channel, channel] = by.albedo[:, channel]
    whole[..., 3], whole[..., 4] = by.roughness, by.metallic
    return whole.view(points, -1, 5)
