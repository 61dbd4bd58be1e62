"""Looks for a better material elsewhere, for some of a step's points.

Gauss-Newton only goes downhill, and roughness has hollows: a lobe so narrow that what it mirrors lies in the shade shows
nothing, and does not feel that a wider one would; brighter albedo makes up for it almost. So some points try another
roughness, taken at random, with the albedo and metallic that go with it, and head for it where it explains the pictures
better. Given its roughness a material's radiance is nearly linear in the rest, so a few steps find the best.
"""

from collections.abc import Callable

import torch
from torch import Tensor

from stages.core.shading import Material, shade
from stages.distill.gauss_newton import ROUGHNESS, misfit, proposal
from stages.distill.guidance.base import Response
from stages.distill.sampling import Sample

SHARE = 0.25
"""Share of a step's points that try another roughness."""

SOLVES = 2
"""Gauss-Newton steps of albedo and metallic after a leap."""

UNTIL = 0.6
"""Share of the run after which nothing leaps any more."""

GAIN = 0.2
"""A leap must bring the squared residual below this share of what it was."""


def leaps(
    sample: Sample,
    values: Tensor,
    response: Response,
    ask: Callable[[Tensor, Sample], Response],
    progress: float,
    generator: torch.Generator,
) -> tuple[Tensor, Tensor]:
    """Points that had better be elsewhere, and where.

    Args:
        values: (P, 5) albedo, roughness and metallic of the sample's points, detached. response: to what they show.
        ask: the guidance's response to the radiance (Q L, 3) of a sample of Q points. progress: of the run, in [0, 1).
    Returns:
        rows (Q,) of the sample and their new values (Q, 5).
    """
    rows = torch.randperm(len(values), generator=generator)[: int(SHARE * len(values))].to(values.device)
    part = sample.at(rows)
    tried = values[rows]
    tried[:, ROUGHNESS] = torch.rand(len(rows), generator=generator).to(values)
    for _ in range(SOLVES):
        found = ask(shade(part.transport, Material.of(tried)), part)
        tried = (tried + proposal(part.transport, Material.of(tried), found, progress, held=ROUGHNESS)).clamp(0.0, 1.0)
    after = misfit(ask(shade(part.transport, Material.of(tried)), part), len(rows))
    better = after < GAIN * misfit(response, len(values))[rows]
    return rows[better], tried[better]
