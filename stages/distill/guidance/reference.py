"""Reference guidance: the target is the known material of a textured model of the same shape.

Every shown pixel is shaded once with the field's material and once with the true one, by the same light transport
under all lights at once, and compared on a logarithmic scale. This is inverse rendering with a perfect denoiser: the
honest test of shading and gradients, and a way to carry textures over to new UVs.
"""


import torch
from torch import Tensor

from stages.core.artifact import sha256_file
from stages.core.errors import InputError
from stages.core.shading import Material, shade
from stages.distill import schedule
from stages.distill.bounces import Bounces
from stages.distill.guidance.base import Budget, Response
from stages.distill.sampling import PixelSampler, Sample
from stages.light.textured_model import TexturedModel
from stages.material.recipe import EVEN

PIXELS = 1024
"""Pixels a step for each image of the batch: many small steps get further in a given time than few large ones."""

BUDGET = Budget(steps=16_000, learning_rate=0.02)

MAX_MISSED = 0.05
"""With a larger share of points off the reference's surface the two are taken for different shapes."""

CHUNK = 16384
"""Pixels whose target is shaded at once."""

HUBER = 0.1
"""Residual, in nepers of radiance, beyond which the loss grows linearly."""

PLAIN = 0.1
"""Step towards a rough dielectric where nothing else is seen. A grey of albedo c < F0 and metallic m looks exactly like its
twin of albedo F0 (1 - m) and metallic 1 - c / F0: a dark dielectric like some metal. Of such twins the duller is taken."""

FLOOR = 0.001
"""Radiance at which the logarithmic scale turns linear, as a share of the light's mean over all seen pixels. The target
holds no noise, so that what lies deep in the shade tells as much as what lies in the light."""


class ReferenceGuidance:
    """Pulls the rendered pixels towards those of the reference asset.

    Raises: InputError when the asset cannot be read or is of another shape.
    """

    def __init__(self, asset: TexturedModel, sampler: PixelSampler) -> None:
        truth, found = asset.material_at(sampler.points.numpy(), sampler.eyes.numpy())
        if (missed := 1 - found.mean()) > MAX_MISSED:
            raise InputError(
                f"{asset.path}: {missed:.0%} of the seen points are not on its surface; expected the shape, scale and "
                "position of the mesh that was prepared"
            )
        self.sampler = sampler
        self.inputs = {"reference": sha256_file(asset.path)}
        self.identity = {"name": "reference", "asset": asset.path.name}
        self.recipe, self.held = EVEN, False
        self.budget, self.weights = BUDGET, None
        self._found = torch.from_numpy(found)
        self._target = _target_radiance(sampler, torch.from_numpy(truth))  # (M, L, 3)
        self._floor = FLOOR * self._target.mean((0, 2))  # (L,)

    def draw(self, generator: torch.Generator) -> Sample:
        """See `Guidance.draw`."""
        return self.sampler.draw(generator)

    def respond(self, radiance: Tensor, sample: Sample, progress: float, generator: torch.Generator) -> Response:
        """See `Guidance.respond`; the number for the curve is the mean absolute residual, in nepers."""
        assert sample.rows is not None
        device = radiance.device
        floor = self._floor.to(device)[:, None]
        shown = radiance.view(-1, sample.lights, 3) + floor
        target = self._target.index_select(0, sample.rows).to(device) + floor
        found = self._found[sample.rows].to(device)[:, None, None]
        residual = torch.log(shown / target) * found
        weight = (HUBER / residual.abs().clamp(min=HUBER)) / residual.numel()  # 1 up to HUBER, then falling
        weight = weight * found
        gradient, curvature = weight * residual / shown, weight / shown.square()
        plain = PLAIN * schedule.plain(progress)
        return Response(gradient.flatten(0, 1), float(residual.abs().mean()), curvature.flatten(0, 1), plain)


ASIDE = 0.01
"""How far from a cell it is looked at, world units."""


def material_of(asset: TexturedModel, cells: Bounces) -> Tensor:
    """The known material of the cells of light between surfaces, (C, 5)."""
    points, eyes = cells.points.numpy(), (cells.points + ASIDE * cells.normals).numpy()
    return torch.from_numpy(asset.material_at(points, eyes)[0])


def _target_radiance(sampler: PixelSampler, truth: Tensor) -> Tensor:
    """Radiance (M, L, 3) of the whole pool with the true material (M, 5), in float32."""
    parts = []
    for rows in torch.arange(len(truth)).split(CHUNK):
        sample, material = sampler.at(rows), truth[rows].to(sampler.device)
        radiance = shade(sample.transport, Material.of(material))
        parts.append(radiance.view(-1, sample.lights, 3).cpu())
    return torch.cat(parts)
