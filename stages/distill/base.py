"""The recipe on the surface that the views show: what a run begins from, and what is learnt is added to."""

import copy
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from stages.core.shading import Material
from stages.distill.moves import Moves
from stages.distill.sampling import Sample
from stages.distill.views import Views
from stages.material.evaluate import evaluate_coats
from stages.material.masks import settled
from stages.material.recipe import EVEN, Recipe
from stages.material.residual import Residual, combined
from stages.material.surface import Surface
from stages.material.survey import POINTS, Lookup

SETTLE_POINTS = 20_000
"""Survey points on which masks are settled, at the least; a survey has its points face by face, so every few of them."""

PART_POINTS, FEW = 5_000, 400
"""Those on which a part's masks are, at most; a part with few of the even ones takes all that there are on it."""


class Base:
    """A recipe, settled on the object. recipe: as settled. survey: of the object."""

    def __init__(self, recipe: Recipe, views: Views) -> None:
        self.survey: Lookup = views.survey
        pieces = self.survey.survey.pieces
        parts = (replace(p, recipe=settled(p.recipe, part_surface(views, p.labels), pieces)) for p in recipe.parts)
        whole = settled(recipe, even_surface(views, SETTLE_POINTS), pieces)
        self.recipe = replace(whole, parts=tuple(parts))
        self._even = self.recipe == EVEN

    def at(self, points: Tensor, normals: Tensor, footprint: Tensor, label: Tensor) -> tuple[Tensor, Tensor]:
        """Material of points (P, 3) with normals (P, 3), footprints (P,) and labels (P,), world.

        Returns:
            (P, 5) linear albedo, roughness and metallic; (P, K) how much of each point is each coat's.
        """
        if self._even and len(points) > 1:  # one point knows it all
            known = self.at(points[:1], normals[:1], footprint[:1], label[:1])
            return known[0].expand(len(points), -1), known[1].expand(len(points), -1)
        surface = self.survey.surface(*(t.cpu().numpy() for t in (points, normals, footprint, label)))
        values, shares = evaluate_coats(self.recipe, surface, self.survey.survey.pieces)
        both = (torch.from_numpy(np.ascontiguousarray(a)).to(points.device) for a in (values[:, :5], shares))
        return next(both), next(both)

    def of(self, sample: Sample) -> tuple[Tensor, Tensor]:
        """The same of a sample's points."""
        return self.at(sample.points, sample.normals, sample.footprint, sample.label)

    def material(self, residual: Residual, points: Tensor, normals: Tensor, footprint: Tensor, label: Tensor) -> Material:
        """Recipe and residual together."""
        return Material.of(combined(self.at(points, normals, footprint, label)[0], residual(points)))

    def moved(self, moves: Moves) -> "Base":
        """The same surface with the recipe's numbers moved."""
        result = copy.copy(self)
        result.recipe = moves.moved(self.recipe)
        return result


def part_surface(views: Views, labels: tuple[int, ...]) -> Surface:
    """Points of the survey with some labels: evenly spread ones, where there are enough."""
    surface = views.survey.survey.surface()
    mine = np.flatnonzero(np.isin(surface.label, labels))
    even = mine[mine < POINTS]
    rows = even if len(even) >= FEW else mine
    return surface[rows[:: -(-len(rows) // PART_POINTS) or 1]]


def even_surface(views: Views, count: int) -> Surface:
    """Points spread evenly over the object."""
    return views.survey.survey.surface()[: POINTS : max(1, POINTS // count)]
