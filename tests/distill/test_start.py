"""What distillation begins with: the recipe on the surface that the views show, and a field fitted to it."""

import numpy as np
import pytest
import torch

from stages.core.color import log_correlation
from stages.core.field import FieldConfig, MaterialField
from stages.core.progress import silent
from stages.distill.regularizers import encoded
from stages.distill.start import DRAWS, Start, fit, least_like_light, random_points, spread_evenly
from stages.distill.views import Views
from stages.prior.recipe import Recipe, draw_coat, draw_layout
from tests.distill.examples import LIGHTS, write_conditions

GREY, GOLD = np.array([0.5, 0.5, 0.5, 0.6, 0.0]), np.array([0.95, 0.85, 0.55, 0.2, 1.0])


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> Views:
    return Views(write_conditions(tmp_path_factory.mktemp("start") / "conditions", size=48))


def recipe(layout: str | None = None, seed: int = 0) -> Recipe:
    rng = np.random.default_rng(seed)
    coats = tuple(draw_coat(rng, mean, np.array([0.12, 0.05]), "blotch") for mean in (GREY, GOLD))
    return Recipe(coats, draw_layout(rng, layout)) if layout else Recipe(coats[:1])


def seeded(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def test_points_are_those_of_the_views(views: Views) -> None:
    points, normals = random_points(views, views.seen, 500, seeded())
    assert len(points) >= 500
    torch.testing.assert_close(points, normals * 0.5, rtol=0, atol=2e-3)  # a sphere of diameter 1


def test_the_field_begins_as_the_recipe_has_it(views: Views) -> None:
    start = Start(recipe(), views, seeded())
    field = MaterialField(FieldConfig.for_detail(views.pixel_size()), seeded())
    fit(field, start, views, seeded(), silent)
    points, normals = random_points(views, views.seen, 2000, seeded(9))
    with torch.no_grad():
        found, wanted = encoded(field(points).columns()), encoded(start(points, normals))
    error = (found - wanted).square().mean(0).sqrt()
    assert error.max() < 0.04 and error[:3].max() < 0.5 * wanted[:, :3].std(0).min()


def test_the_same_seed_begins_with_the_same_bytes(views: Views) -> None:
    fields = []
    for _ in range(2):
        field = MaterialField(FieldConfig(levels=4, log2_entries=12), seeded())
        fit(field, Start(recipe(), views, seeded(1)), views, seeded(2), silent)
        fields.append(field.table.detach())
    assert torch.equal(*fields)


@pytest.mark.parametrize("layout", ["edges", "crevices"])
def test_a_round_thing_has_no_gold_edge_or_crevice_of_a_quarter(views: Views, layout: str) -> None:
    start = Start(recipe(layout), views, seeded())
    metallic = start(*random_points(views, views.seen, 2000, seeded(3)))[:, 4]
    assert float(metallic.mean()) < 0.25


def test_crevices_are_found_by_the_shape(views: Views) -> None:
    """A ball seen from within is a hollow."""
    points, normals = random_points(views, views.seen, 2000, seeded(3))
    start = Start(recipe("crevices"), views, seeded())
    assert float(start(points, -normals)[:, 4].mean()) > float(start(points, normals)[:, 4].mean()) + 0.1


def test_what_lies_on_top_does(views: Views) -> None:
    points, normals = random_points(views, views.seen, 2000, seeded())
    metallic, height = Start(recipe("top"), views, seeded())(points, normals)[:, 4], points[:, 2]
    assert float(metallic[height > 0.2].min()) == 1 and float(metallic[height < -0.2].max()) == 0


def test_a_start_is_a_function_of_the_place(views: Views) -> None:
    start = Start(recipe("spots"), views, seeded())
    points, normals = random_points(views, views.seen, 100, seeded())
    order = torch.randperm(len(points), generator=seeded())
    assert torch.equal(start(points[order], normals[order]), start(points, normals)[order])


def test_of_several_draws_the_one_least_like_light_is_taken(views: Views) -> None:
    """Whatever their order, it is one of the best of its set by other points too."""
    points, normals = random_points(views, views.seen, 16_000, seeded(5))
    even = spread_evenly(points, 4000, views, seeded(6))
    points, normals = points[even], normals[even]
    light = sum((0.6 + normals.numpy() @ towards[:, None] / 3) * colour for towards, colour in LIGHTS.values())

    def likeness(chosen: Recipe) -> float:
        return abs(log_correlation(Start(chosen, views, seeded())(points, normals)[:, :3].numpy(), light))

    for first in (0, 100):
        draws = [recipe(seed=first + i) for i in range(DRAWS)]
        chosen = least_like_light(draws, views, seeded())
        assert least_like_light(draws[::-1], views, seeded()) is chosen
        assert likeness(chosen) <= np.quantile([likeness(draw) for draw in draws], 0.25)
