"""Reference guidance: the target is the known material of a textured model of the same shape.

Every pixel is lit once with the true material, and its material is found again from that radiance under all lights at once
(`stages.distill.solve`). Each step then brings the field nearer to what its pixels were found to be of: where many pixels
show one place they vote, each with as much weight as what it saw is worth. This is inverse rendering with a perfect denoiser:
the honest test of shading, and a way to carry textures over to new UVs.
"""

import torch
from torch import Tensor

from stages.core.artifact import sha256_file
from stages.core.errors import InputError
from stages.core.progress import Progress
from stages.core.shading import Material, Transport, shade
from stages.distill.bounces import Bounces
from stages.distill.guidance.base import Budget, Response
from stages.distill.sampling import PixelSampler, Sample
from stages.distill.solve import solved
from stages.light.leaving import OwnLight
from stages.light.textured_model import TexturedModel
from stages.material.recipe import EVEN

PIXELS = 4096
"""Pixels a step for each image of the batch."""

BUDGET = Budget(steps=2000, learning_rate=0.02)

MAX_MISSED = 0.05
"""With a larger share of points off the reference's surface the two are taken for different shapes."""

FLOOR = 0.001
"""Radiance at which the logarithmic scale turns linear, as a share of the light's mean over a view. The target
holds no noise, so that what lies deep in the shade tells as much as what lies in the light."""

FARTHEST = 0.1
"""Distance of a material's value from what was found beyond which the pull grows no more: what is wrong is outvoted."""

LEAST_SLOPE = 1e-4
"""m (1 - m) is taken no smaller when dividing by a sigmoid's slope."""


class ReferenceGuidance:
    """Pulls the material of pixels towards what their radiance on the reference asset says.

    truth, material: (M, 5) of the pool's pixels, as they are and, once begun, as found. Args: own: what the object throws on
    itself.

    Raises: InputError when the asset cannot be read or is of another shape.
    """

    def __init__(self, asset: TexturedModel, sampler: PixelSampler, own: list[OwnLight] | None = None) -> None:
        truth, found = asset.material_at(sampler.points.numpy(), sampler.eyes.numpy())
        if (missed := 1 - found.mean()) > MAX_MISSED:
            raise InputError(
                f"{asset.path}: {missed:.0%} of the seen points are not on its surface; expected the shape, scale and "
                "position of the mesh that was prepared"
            )
        self.sampler = sampler
        self.inputs = {"reference": sha256_file(asset.path)}
        self.identity = {"name": "reference", "asset": asset.path.name}
        self.recipe, self.held, self.looks = EVEN, False, False
        self.budget, self.weights = BUDGET, None
        self.truth, self._own = torch.from_numpy(truth), own
        self._trust = torch.from_numpy(found).half()[:, None, None].repeat(1, 5, 5)
        self.material = torch.zeros(len(truth), 5)

    def begin(self, progress: Progress) -> None:
        """See `Guidance.begin`: solves every pixel of the pool."""
        views = len(self.sampler.seen)
        for view in range(views):
            rows, transport = self.sampler.lit(view, self._own)
            radiance = _radiance(transport, self.truth[rows])
            found = solved(transport, radiance, FLOOR * radiance.mean((0, 2)))
            self.material[rows] = found.material
            self._trust[rows] *= found.trust.half()
            progress("solve", view + 1, views)

    def draw(self, generator: torch.Generator) -> Sample:
        """See `Guidance.draw`."""
        return self.sampler.draw(generator)

    def respond(self, material: Tensor, /, sample: Sample, progress: float, generator: torch.Generator) -> Response:
        """See `Guidance.respond`; the number for the curve is the mean distance, as far as it is trusted."""
        assert sample.rows is not None
        goal, trust = (t[sample.rows].to(material) for t in (self.material, self._trust))
        away = (trust @ (material - goal)[..., None])[..., 0]
        pull = away.clamp(-FARTHEST, FARTHEST) / len(away)
        return Response(pull / (material * (1 - material)).clamp(min=LEAST_SLOPE), float(away.abs().mean()))


ASIDE = 0.01
"""How far from a cell it is looked at, world units."""


def material_of(asset: TexturedModel, cells: Bounces) -> Tensor:
    """The known material of the cells of light between surfaces, (C, 5)."""
    points, eyes = cells.points.numpy(), (cells.points + ASIDE * cells.normals).numpy()
    return torch.from_numpy(asset.material_at(points, eyes)[0])


def _radiance(transport: Transport, material: Tensor) -> Tensor:
    """(P, L, 3) of points with their true material (P, 5)."""
    return shade(transport, Material.of(material)).unflatten(0, (len(material), -1))
