"""What distillation begins with: the recipe on the surface that the views show, of the draw that looks least like light."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from stages.core.color import log_correlation
from stages.distill.base import Base, even_surface
from stages.distill.start import DRAWS, least_like_light, random_points, spread_evenly
from stages.distill.views import Views
from stages.material.evaluate import evaluate
from stages.material.recipe import Coat, Layer, Mask, Recipe
from tests.distill.examples import LIGHTS, write_conditions

ROCK = Recipe(Coat("granite", metres=0.05))
GOLD = Coat("gold", metallic=1.0)


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> Views:
    return Views(write_conditions(tmp_path_factory.mktemp("start") / "conditions", size=48))


def seeded(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def gilded(*masks: Mask) -> Recipe:
    return replace(ROCK, layers=(Layer(GOLD, masks),))


def metallic_at(recipe: Recipe, views: Views) -> tuple[torch.Tensor, torch.Tensor]:
    """Points, and how much metal lies there."""
    points, normals, label = random_points(views, views.seen, 2000, seeded(3))
    return points, Base(recipe, views).at(points, normals, torch.full((len(points),), views.pixel_size()), label)[0][:, 4]


def test_points_are_those_of_the_views(views: Views) -> None:
    points, normals, _ = random_points(views, views.seen, 500, seeded())
    assert len(points) >= 500
    torch.testing.assert_close(points, normals * 0.5, rtol=0, atol=2e-3)  # a sphere of diameter 1


@pytest.mark.parametrize("kind", ["patches", "spots", "up", "stripes"])
def test_a_mask_covers_its_share_of_the_surface(views: Views, kind: str) -> None:
    surface = even_surface(views, 4000)
    recipe = Base(gilded(Mask(kind, 0.3, 0.1)), views).recipe
    assert evaluate(recipe, surface)[:, 4].mean() == pytest.approx(0.3, abs=0.07)


def test_what_lies_on_top_does(views: Views) -> None:
    points, metallic = metallic_at(gilded(Mask("above", 0.5, wear=0.0)), views)
    assert float(metallic[points[:, 2] > 0.05].min()) > 0.9 and float(metallic[points[:, 2] < -0.05].max()) == 0


def test_a_base_is_a_function_of_the_place(views: Views) -> None:
    base = Base(gilded(Mask("spots", 0.3)), views)
    points, normals, label = random_points(views, views.seen, 100, seeded())
    footprint = torch.full((len(points),), views.pixel_size())
    order = torch.randperm(len(points), generator=seeded())
    where = (points, normals, footprint, label)
    found, shuffled = base.at(*where), base.at(*(t[order] for t in where))
    assert all(torch.equal(mixed, values[order]) for mixed, values in zip(shuffled, found, strict=True))


def test_of_several_draws_the_one_least_like_light_is_taken(views: Views) -> None:
    """It is one of the best of its set by other points too."""
    points, normals, label = random_points(views, views.seen, 16_000, seeded(5))
    even = spread_evenly(points, 4000, views, seeded(6))
    points, normals, label = points[even], normals[even], label[even]
    light = sum((0.6 + normals.numpy() @ towards[:, None] / 3) * colour for towards, colour in LIGHTS.values())
    footprint = torch.full((len(points),), views.pixel_size())

    def likeness(recipe: Recipe) -> float:
        return abs(log_correlation(Base(recipe, views).at(points, normals, footprint, label)[0][:, :3].numpy(), light))

    cloudy = Recipe(Coat("rust", metres=0.3))
    chosen = least_like_light(cloudy, views, seeded())
    assert chosen == least_like_light(cloudy, views, seeded())
    others = [likeness(replace(cloudy, seed=seed)) for seed in range(DRAWS)]
    assert likeness(chosen) <= np.quantile(others, 0.3)
