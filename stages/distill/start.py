"""Which draw of a recipe a run begins with: the one whose patterns follow the light least.

Patterns wider than a shadow follow the light by chance, and what follows the light passes for light that was baked in. Seeds
draw other patterns of the same material, so there is a choice. """

from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.core.color import log_correlation
from stages.distill.sampling import even_chance
from stages.distill.views import Views
from stages.material.evaluate import by_part, evaluate
from stages.material.recipe import Recipe

DRAWS, LIT_VIEWS, LIT_POINTS = 24, 12, 6000
"""Draws of a recipe, and the views and points at which they are held against the light."""

FEWEST = 100
"""Points of a part that tell whether it looks like the light."""


def least_like_light(recipe: Recipe, views: Views, generator: torch.Generator) -> Recipe:
    """The recipe with the seed, of `DRAWS` that follow its own, under which its coats look least like the light.

    What lies where the surface says, such as moss in crevices, may follow the light: each coat is judged by itself. Each part
    has a draw of its own.
    """
    chosen = views.seen[:: -(-len(views.seen) // LIT_VIEWS)]
    rows = random_rows(views, chosen, 8 * LIT_POINTS, generator)
    points, normals, labels = surface_at(views, rows)
    light = torch.cat([_irradiance(views, view, some) for view, some in rows])
    even = spread_evenly(points, LIT_POINTS, views, generator)
    point, normal, label, irradiance = (t[even].numpy() for t in (points, normals, labels, light))
    footprint = np.full(len(point), views.pixel_size(), np.float32)
    surface = views.survey.surface(point, normal, footprint, label)

    def drawn(own: Recipe, mine: NDArray[np.int64] | slice) -> Recipe:
        """Of a recipe without parts, on its own points."""
        where, lit = surface[mine], irradiance[mine]

        def likeness(draw: Recipe) -> float:
            coats = (Recipe(coat, seed=draw.seed + 7919 * k) for k, coat in enumerate(draw.coats))
            pieces = views.survey.survey.pieces
            return max(abs(log_correlation(evaluate(coat, where, pieces)[:, :3], lit)) for coat in coats)

        draws = [replace(own, seed=own.seed * DRAWS + k) for k in range(DRAWS)]
        return min(draws, key=likeness) if len(lit) >= FEWEST else draws[0]

    whole, *parts = (drawn(own, mine) for own, mine in by_part(recipe, surface.label))
    return replace(whole, parts=tuple(replace(p, recipe=own) for p, own in zip(recipe.parts, parts, strict=True)))


def _irradiance(views: Views, view: int, rows: Tensor) -> Tensor:
    """(K, 3) of some pixels of a view, under all lights together."""
    return torch.stack([views.transport(view, e).E[rows].float() for e in range(len(views.environments))]).sum(0)


Rows = list[tuple[int, Tensor]]
"""Views with the rows (K,) of some of their object pixels."""


def random_rows(views: Views, chosen: list[int], count: int, generator: torch.Generator) -> Rows:
    """About `count` random pixels of the chosen views."""
    share = -(-count // len(chosen))
    return [(view, torch.randint(len(views.pixels(view)), (share,), generator=generator)) for view in chosen]


def surface_at(views: Views, rows: Rows) -> tuple[Tensor, Tensor, Tensor]:
    """Points and normals (P, 3) at which the material of pixels is asked for, and the labels (P,) there."""
    surfaces = [views.surface(view, chosen.numpy()) for view, chosen in rows]
    points, normals, label = (torch.cat([getattr(s, name) for s in surfaces]) for name in ("shown", "shown_normals", "label"))
    return points, normals, label


def random_points(views: Views, chosen: list[int], count: int, generator: torch.Generator) -> tuple[Tensor, Tensor, Tensor]:
    """`surface_at` of about `count` random pixels of the chosen views."""
    return surface_at(views, random_rows(views, chosen, count, generator))


def spread_evenly(points: Tensor, count: int, views: Views, generator: torch.Generator) -> Tensor:
    """(count,) of the points (P, 3), drawn so that they lie evenly on the surface, however many views saw each part."""
    chance = even_chance(points, 4 * views.pixel_size())
    u = torch.rand(count, generator=generator, dtype=torch.float64)
    return torch.searchsorted(chance, u).clamp(max=len(chance) - 1)
