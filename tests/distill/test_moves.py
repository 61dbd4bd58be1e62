"""The recipe's own numbers: moved by gradients while a run lasts, and the same material when they are in the recipe."""

import numpy as np
import pytest
import torch

from stages.core.shading import Material, shade
from stages.distill.base import Base
from stages.distill.moves import BOUND, PACE, Moves, told
from stages.distill.start import random_points
from stages.distill.views import Views
from stages.material.recipe import EVEN, Coat, Layer, Mask, Recipe
from stages.material.residual import combined
from tests.distill.examples import write_conditions

CLAY = Coat("granite", (0.5, 0.4, 0.3), 0.6, 0.0, metres=0.5, said="clay")
GOLD = Coat("gold", (0.9, 0.8, 0.5), 0.3, 1.0, metres=0.5, said="gold")
TWO = Recipe(CLAY, (Layer(GOLD, (Mask("above", 0.5, wear=0.0),)),))


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> Views:
    return Views(write_conditions(tmp_path_factory.mktemp("moves") / "conditions", size=48))


def values_at(base: Base, views: Views) -> tuple[torch.Tensor, torch.Tensor]:
    points, normals, label = random_points(views, views.seen, 1500, torch.Generator().manual_seed(0))
    return base.at(points, normals, torch.full((len(points),), views.pixel_size()), label)


def test_nothing_moves_before_the_first_step(views: Views) -> None:
    base = Base(TWO, views)
    moves = Moves(base.recipe)
    values, shares = values_at(base, views)
    assert torch.equal(combined(values, moves(values, shares)), combined(values, torch.zeros_like(values)))
    moved = moves.moved(base.recipe)
    for old, new in zip(base.recipe.coats, moved.coats, strict=True):
        assert np.allclose(old.color or (), new.color or (), atol=1e-7) and old.roughness == pytest.approx(new.roughness)
    assert told(base.recipe, moved) == [] and torch.allclose(shares.sum(1), torch.ones(len(shares)))


def test_a_moved_recipe_is_what_its_moves_showed(views: Views) -> None:
    """Colour and roughness as means of each coat; contrast as a factor of its deviation."""
    base = Base(TWO, views)
    moves = Moves(base.recipe)
    moves.offsets.data = torch.tensor([[0.3, -0.3, 0, 0.3, 0.3], [-0.3, 0, 0.3, -0.3, -0.3]]) / PACE  # bounded: 0.23
    values, shares = values_at(base, views)
    shown = combined(values, moves(values, shares).detach())
    kept, _ = values_at(base.moved(moves), views)
    for coat in (0, 1):
        mine = shares[:, coat] > 0.99
        before, during, after = (v[mine] for v in (values, shown, kept))
        assert (during.mean(0) - before.mean(0)).abs().max() > 0.03
        torch.testing.assert_close(during.mean(0), after.mean(0), rtol=0, atol=0.025)
        grown = (during.std(0) / before.std(0))[:3].mean(), (after.std(0) / before.std(0))[:3].mean()
        assert grown[0] == pytest.approx(float(grown[1]), rel=0.2) and (grown[0] > 1.1) == (coat == 0)
    assert "clay: moved colour #" in told(base.recipe, moves.moved(base.recipe))[0]


def test_moves_are_bounded_and_follow_a_gradient_to_the_colour_that_pictures_show(views: Views) -> None:
    base = Base(TWO, views)
    truth = Moves(base.recipe)
    truth.offsets.data = torch.tensor([[0.18, 0.09, -0.15, 0.15, 0.12], [-0.12, 0.06, 0.15, 0.09, 0.0]]) / PACE
    values, shares = values_at(base, views)
    points = len(values)
    transport = views.transport(views.seen[0], 0)[torch.arange(points) % 500]

    def picture(moves: Moves) -> torch.Tensor:
        return shade(transport, Material.of(combined(values, moves(values, shares))))

    wanted, moves = picture(truth).detach(), Moves(base.recipe)
    optimizer = torch.optim.Adam(moves.parameters(), lr=0.01)
    for _ in range(150):
        optimizer.zero_grad()
        (picture(moves) - wanted).square().mean().backward()
        optimizer.step()
    off = (moves.bounded() - truth.bounded()).abs().detach()
    assert off[:, :4].max() < 0.25 * truth.bounded()[:, :4].abs().max()
    moves.offsets.data.fill_(1e6)
    assert float(moves.bounded().detach().max()) <= BOUND + 1e-6


def test_what_is_left_to_a_look_does_not_move(views: Views) -> None:
    moves = Moves(EVEN)
    moves.offsets.data.fill_(3.0)
    assert moves.moved(EVEN).base.color is None and not moves.bounded().any()
