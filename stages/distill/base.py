"""The recipe on the surface that the views show: what a run begins from, and what the residual is added to."""

import numpy as np
import torch
from torch import Tensor

from stages.core.shading import Material
from stages.distill.sampling import Sample
from stages.distill.views import Views
from stages.material.evaluate import evaluate
from stages.material.masks import settled
from stages.material.recipe import Recipe
from stages.material.residual import Residual, combined
from stages.material.surface import Surface
from stages.material.survey import Lookup

SETTLE_POINTS = 20_000
"""Survey points on which masks are settled: evenly spread, as a survey's first ones are."""


class Base:
    """A recipe, settled on the object. recipe: as settled. survey: of the object."""

    def __init__(self, recipe: Recipe, views: Views) -> None:
        self.survey: Lookup = views.survey
        self.recipe = settled(recipe, even_surface(views, SETTLE_POINTS), self.survey.survey.pieces)

    def at(self, points: Tensor, normals: Tensor, footprint: Tensor) -> Tensor:
        """(P, 5) linear albedo, roughness and metallic of points (P, 3) with normals (P, 3) and footprints (P,), world."""
        surface = self.survey.surface(*(t.cpu().numpy() for t in (points, normals, footprint)))
        values = evaluate(self.recipe, surface, self.survey.survey.pieces)[:, :5]
        return torch.from_numpy(np.ascontiguousarray(values)).to(points.device)

    def of(self, sample: Sample) -> Tensor:
        """The same of a sample's points."""
        return self.at(sample.points, sample.normals, sample.footprint)

    def material(self, residual: Residual, points: Tensor, normals: Tensor, footprint: Tensor) -> Material:
        """Recipe and residual together."""
        return Material.of(combined(self.at(points, normals, footprint), residual(points)))


def even_surface(views: Views, count: int) -> Surface:
    """Points spread evenly over the object."""
    return views.survey.survey.surface()[:count]
