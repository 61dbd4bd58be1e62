"""Where a distillation begins: what the words alone call for, laid over this very surface.

The diffusion model judges pictures; it does not invent a pattern on a plain grey thing within a few hundred steps. So the
prompt is read as a recipe first (`stages.prior.recipe`), which says what is patterned how and what lies where, the field is
fitted to that, and the model goes on from there. Seeds draw other patterns of the same material.
"""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.core.color import log_correlation
from stages.core.convexity import SurfaceSamples
from stages.core.field import MaterialField
from stages.core.parallel import ahead
from stages.core.progress import Progress
from stages.distill.optimizer import RowAdam
from stages.distill.regularizers import encoded
from stages.distill.sampling import even_chance
from stages.distill.views import Views
from stages.prior.recipe import BOUND, Recipe, Surface

DRAWS, LIT_VIEWS, LIT_POINTS = 24, 12, 6000
"""Draws of a prompt's recipe, and the views and points at which they are held against the light."""

SAMPLES = 16_000
"""Surface points that tell edges from creases."""

RELIEF = 0.07
"""Share of the surface that counts as its edges, and as its creases, where it has none that are sharp."""

SHARP = 0.3
"""Convexity of a sharp edge."""

MOST_GAIN = 4.0
"""How far a rounded edge may be taken for a sharp one."""

STEPS, POINTS, VIEWS = 240, 8192, 4
"""Of the fit, and what each of its steps looks at."""

LEARNING_RATE = 0.02


class Start:
    """A recipe on the surface that some views show."""

    def __init__(self, recipe: Recipe, views: Views, generator: torch.Generator) -> None:
        self._recipe = recipe
        follows_relief = recipe.layout is not None and recipe.layout.kind in ("edges", "crevices")
        self._relief = Relief(views, generator) if follows_relief else None

    def __call__(self, points: Tensor, normals: Tensor) -> Tensor:
        """(P, 5) linear albedo, roughness and metallic of points with normals, (P, 3) each, world."""
        point, normal = points.cpu().numpy(), normals.cpu().numpy()
        flat = np.zeros(len(point), np.float32)
        convexity = flat if self._relief is None else self._relief.convexity(point, normal)
        surface = Surface(point, normal, convexity, occlusion=flat)
        return torch.from_numpy(self._recipe.evaluate(surface)).to(points.device)


class Relief:
    """Edges and creases of what the views show, the rounded ones of a smooth thing taken for sharp."""

    def __init__(self, views: Views, generator: torch.Generator) -> None:
        surface = random_points(views, views.seen, 8 * SAMPLES, generator)
        chosen = spread_evenly(surface[0], SAMPLES, views, generator)
        points, normals = (t[chosen].numpy() for t in surface)
        self._samples = SurfaceSamples(points)
        low, high = np.quantile(self._samples.convexity(points, normals), (RELIEF, 1 - RELIEF))
        self._gain = tuple(float(np.clip(SHARP / max(x, 1e-6), 1, MOST_GAIN)) for x in (-low, high))

    def convexity(self, points: NDArray, normals: NDArray) -> NDArray[np.float32]:
        """(P,) as `SurfaceSamples.convexity`, strengthened."""
        found = self._samples.convexity(points, normals)
        return (found * np.where(found < 0, *self._gain)).astype(np.float32)


def least_like_light(draws: list[Recipe], views: Views, generator: torch.Generator) -> Recipe:
    """Of several draws of a recipe, the one whose patterns follow the light least. Wide ones do by chance, and pass for it.

    What lies where the surface says, such as moss in crevices, may follow the light; there each coat is judged by itself.
    """
    chosen = views.seen[:: -(-len(views.seen) // LIT_VIEWS)]
    rows = random_rows(views, chosen, 8 * LIT_POINTS, generator)
    points, normals = surface_at(views, rows)
    light = torch.cat([_irradiance(views, view, some) for view, some in rows])
    even = spread_evenly(points, LIT_POINTS, views, generator)
    point, normal, irradiance = (t[even].numpy() for t in (points, normals, light))
    flat = np.zeros(len(point), np.float32)
    surface = Surface(point, normal, convexity=flat, occlusion=flat)

    def likeness(recipe: Recipe) -> float:
        bound = recipe.layout is not None and recipe.layout.kind in BOUND
        parts = recipe.coats if bound else (recipe,)
        return max(abs(log_correlation(part.evaluate(surface)[:, :3], irradiance)) for part in parts)

    return min(draws, key=likeness)


def _irradiance(views: Views, view: int, rows: Tensor) -> Tensor:
    """(K, 3) of some pixels of a view, under all lights together."""
    return torch.stack([views.transport(view, e).E[rows].float() for e in range(len(views.environments))]).sum(0)


Rows = list[tuple[int, Tensor]]
"""Views with the rows (K,) of some of their object pixels."""


def random_rows(views: Views, chosen: list[int], count: int, generator: torch.Generator) -> Rows:
    """About `count` random pixels of the chosen views."""
    share = -(-count // len(chosen))
    return [(view, torch.randint(len(views.pixels(view)), (share,), generator=generator)) for view in chosen]


def surface_at(views: Views, rows: Rows) -> tuple[Tensor, Tensor]:
    """Points and normals of pixels, (P, 3) each."""
    surfaces = [views.surface(view, chosen.numpy()) for view, chosen in rows]
    return torch.cat([s.points for s in surfaces]), torch.cat([s.normals for s in surfaces])


def random_points(views: Views, chosen: list[int], count: int, generator: torch.Generator) -> tuple[Tensor, Tensor]:
    """Points and normals of about `count` random pixels of the chosen views, (P, 3) each."""
    return surface_at(views, random_rows(views, chosen, count, generator))


def spread_evenly(points: Tensor, count: int, views: Views, generator: torch.Generator) -> Tensor:
    """(count,) of the points (P, 3), drawn so that they lie evenly on the surface, however many views saw each part."""
    chance = even_chance(points, 4 * views.pixel_size())
    u = torch.rand(count, generator=generator, dtype=torch.float64)
    return torch.searchsorted(chance, u).clamp(max=len(chance) - 1)


def fit(field: MaterialField, start: Start, views: Views, generator: torch.Generator, progress: Progress) -> None:
    """Bring an untrained field to the start, in place."""
    device = field.table.device
    optimizer = RowAdam(dict(field.named_parameters()), tables=frozenset({"table"}))

    def draw(step: int) -> tuple[Tensor, Tensor]:
        some = [views.seen[i] for i in torch.randint(len(views.seen), (VIEWS,), generator=generator).tolist()]
        points, normals = (t.to(device) for t in random_points(views, some, POINTS, generator))
        return points, start(points, normals)

    for step, (points, wanted) in enumerate(ahead(draw, range(STEPS))):
        progress("reading the words", step, STEPS)
        if step == 0:
            field.begin_at(wanted.mean(0))
        found = field(points).columns()
        (encoded(found) - encoded(wanted)).square().sum(1).mean().backward()
        optimizer.step(LEARNING_RATE * (1 - step / STEPS))
    progress("reading the words", STEPS, STEPS)
