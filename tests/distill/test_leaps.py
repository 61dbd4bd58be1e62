"""Leaps out of a hollow: a roughness that shows nothing of its lobe is left for the one that explains the pictures."""

import torch
from torch import Tensor

from stages.core.shading import KNOTS, Material, Transport, shade
from stages.distill import gauss_newton
from stages.distill.guidance.base import Response
from stages.distill.leaps import leaps
from stages.distill.sampling import Sample

POINTS, LIGHTS, PROGRESS = 400, 5, 0.5


def shaded_mirrors() -> Sample:
    """Points whose mirror image lies in the shade: the narrower the lobe the less it shows, nothing at all below 0.25."""
    g = torch.Generator().manual_seed(0)
    rows = POINTS * LIGHTS
    level, knots = torch.rand(rows, 1, 3, generator=g) + 0.2, torch.tensor(KNOTS)
    A = level * (1e-4 + (knots - 0.25).clamp(min=0))[None, :, None]
    transport = Transport(torch.rand(rows, 3, generator=g) + 0.3, A, 0.02 * A, torch.rand(rows, generator=g) * 0.8 + 0.2)
    zeros = torch.zeros(POINTS, 3)
    return Sample(zeros, zeros, zeros[:, 0], zeros[:, 0].long(), LIGHTS, transport, rows=torch.arange(POINTS))


class Ask:
    """Least squares on the logarithm of radiance."""

    def __init__(self, target: Tensor) -> None:
        self.target = target.view(POINTS, LIGHTS, 3)

    def __call__(self, radiance: Tensor, part: Sample) -> Response:
        assert part.rows is not None
        residual = torch.log(radiance / self.target[part.rows].flatten(0, 1))
        return Response(residual / (radiance * radiance.numel()), 0.0, 1 / (radiance.square() * radiance.numel()))


def dark_and(roughness: float) -> Tensor:
    return torch.tensor([0.006, 0.006, 0.006, roughness, 0.02]).repeat(POINTS, 1)


def descend(sample: Sample, ask: Ask, x: Tensor, steps: int, leaping: bool) -> Tensor:
    g = torch.Generator().manual_seed(1)
    for _ in range(steps):
        answer = ask(shade(sample.transport, Material.of(x)), sample)
        goal = (x + gauss_newton.proposal(sample.transport, Material.of(x), answer, PROGRESS)).clamp(0, 1)
        if leaping:
            rows, elsewhere = leaps(sample, x, answer, ask, PROGRESS, g)
            goal[rows] = elsewhere
        x = goal
    return x


def test_only_leaps_lead_out_of_a_hollow() -> None:
    sample, start = shaded_mirrors(), dark_and(0.1)
    ask = Ask(shade(sample.transport, Material.of(dark_and(0.8))))
    stuck = descend(sample, ask, start.clone(), 60, leaping=False)
    out = descend(sample, ask, start.clone(), 60, leaping=True)
    assert float((stuck[:, 3] < 0.3).float().mean()) > 0.5, "the case must be a hollow"
    assert float((out[:, 3] < 0.3).float().mean()) < 0.01
    assert float((out[:, 3] - 0.8).abs().median()) < 0.02


def test_nothing_leaps_away_from_the_truth() -> None:
    sample, truth = shaded_mirrors(), dark_and(0.8)
    ask = Ask(shade(sample.transport, Material.of(truth)))
    answer = ask(shade(sample.transport, Material.of(truth)), sample)
    rows, _ = leaps(sample, truth, answer, ask, PROGRESS, torch.Generator().manual_seed(0))
    assert len(rows) == 0
