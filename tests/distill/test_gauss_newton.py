"""Damped Gauss-Newton on materials: it lands on the truth, and stays where nothing is seen."""

import pytest
import torch
from torch import Tensor

from stages.core.shading import KNOTS, Material, Transport, shade
from stages.distill import gauss_newton
from stages.distill.guidance.base import Response

POINTS, LIGHTS, PROGRESS = 200, 5, 0.5


def lobes(seed: int = 0) -> Transport:
    """Transport of points under lights whose specular terms fall off with roughness, each at its own rate."""
    g = torch.Generator().manual_seed(seed)
    rows = POINTS * LIGHTS
    rate = 8 * torch.rand(rows, 1, 1, generator=g)
    level = torch.rand(rows, 1, 3, generator=g) + 0.2
    A = level * torch.exp(-rate * torch.tensor(KNOTS)[None, :, None]) + 0.1
    return Transport(torch.rand(rows, 3, generator=g) + 0.3, A, 0.02 * A, torch.rand(rows, generator=g) * 0.8 + 0.2)


def materials(seed: int = 1) -> Tensor:
    return 0.15 + 0.7 * torch.rand(POINTS, 5, generator=torch.Generator().manual_seed(seed))


def as_material(x: Tensor) -> Material:
    return Material(x[:, :3].contiguous(), x[:, 3].contiguous(), x[:, 4].contiguous())


def response(transport: Transport, x: Tensor, target: Tensor, plain: float = 0.0) -> Response:
    """Least squares on the logarithm of radiance."""
    shown = shade(transport, as_material(x))
    residual = torch.log(shown / target)
    return Response(residual / (shown * shown.numel()), 0.0, 1 / (shown.square() * shown.numel()), plain)


def test_steps_lead_to_the_truth_in_all_five_values() -> None:
    transport, truth = lobes(), materials()
    target, x = shade(transport, as_material(truth)), torch.full((POINTS, 5), 0.5)
    for _ in range(40):
        x = (x + gauss_newton.proposal(transport, as_material(x), response(transport, x, target), PROGRESS)).clamp(0, 1)
    assert float((x - truth).abs().median()) < 1e-3
    assert float(((x - truth).abs().amax(1) < 0.02).float().mean()) > 0.9


def test_the_truth_is_where_steps_end_and_no_step_is_longer_than_allowed() -> None:
    transport, truth = lobes(), materials()
    target = shade(transport, as_material(truth))
    there = gauss_newton.proposal(transport, as_material(truth), response(transport, truth, target), PROGRESS)
    assert float(there.abs().max()) < 1e-3
    far = gauss_newton.proposal(transport, as_material(1 - truth), response(transport, 1 - truth, target), PROGRESS)
    assert float(far.abs().max()) <= gauss_newton.LARGEST + 1e-6 and bool(torch.isfinite(far).all())


def test_what_is_not_seen_stays_but_for_the_pull_to_plain_materials() -> None:
    transport, x = lobes(), materials()
    nothing = torch.zeros(POINTS * LIGHTS, 3)
    assert float(gauss_newton.proposal(transport, as_material(x), Response(nothing, 0.0, nothing), PROGRESS).abs().max()) == 0
    pulled = gauss_newton.proposal(transport, as_material(x), Response(nothing, 0.0, nothing, plain=0.03), PROGRESS)
    assert float(pulled[:, :3].abs().max()) == 0 and torch.allclose(pulled[:, 3:], torch.tensor([0.03, -0.03]))


def test_a_held_value_stays_and_the_others_still_find_their_truth() -> None:
    transport, truth = lobes(), materials()
    target, x = shade(transport, as_material(truth)), materials(2)
    x[:, gauss_newton.ROUGHNESS] = truth[:, gauss_newton.ROUGHNESS]
    for _ in range(20):
        answer = response(transport, x, target)
        x = (x + gauss_newton.proposal(transport, as_material(x), answer, PROGRESS, held=gauss_newton.ROUGHNESS)).clamp(0, 1)
    assert float((x - truth)[:, gauss_newton.ROUGHNESS].abs().max()) < 1e-4
    assert float((x - truth).abs().median()) < 1e-3


def test_misfit_is_the_mean_squared_residual_of_a_point() -> None:
    transport, truth = lobes(), materials()
    target, x = shade(transport, as_material(truth)), materials(3)
    residual = torch.log(shade(transport, as_material(x)) / target).view(POINTS, -1)
    found = gauss_newton.misfit(response(transport, x, target), POINTS)
    torch.testing.assert_close(found, residual.square().mean(1))


@pytest.mark.parametrize("value", [0.5, 1e-3, 1 - 1e-3])
def test_the_slope_by_the_logit_is_value_minus_goal(value: float) -> None:
    """Also where the sigmoid is nearly flat."""
    logit = torch.logit(torch.full((POINTS, 5), value)).requires_grad_()
    x, goal = torch.sigmoid(logit), materials()
    (gradient,) = torch.autograd.grad(x, logit, gauss_newton.logit_gradient(x.detach(), goal))
    torch.testing.assert_close(gradient, (x.detach() - goal) / POINTS, rtol=1e-3, atol=1e-8)
