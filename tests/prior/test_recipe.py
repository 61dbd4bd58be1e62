"""Recipes: what lies where, and that a drawn coat has the mean it was asked for."""

import numpy as np
import pytest
from numpy.random import default_rng

from stages.core.color import srgb_encode
from stages.prior.patterns import PATTERNS
from stages.prior.recipe import LAYOUTS, Layout, Recipe, Surface, coverage, draw_coat, draw_layout

GREY, GOLD = np.array([0.5, 0.5, 0.5, 0.6, 0.0]), np.array([0.95, 0.85, 0.55, 0.2, 1.0])
SPREAD = np.array([0.1, 0.05])


def sphere(count: int = 4000) -> Surface:
    """Of diameter 1, with random convexity and occlusion."""
    rng = default_rng(0)
    direction = rng.normal(size=(count, 3))
    normal = (direction / np.linalg.norm(direction, axis=1, keepdims=True)).astype(np.float32)
    flat = rng.uniform(-0.4, 0.6, count).astype(np.float32), rng.uniform(0, 0.8, count).astype(np.float32)
    return Surface(normal * np.float32(0.5), normal, *flat)


@pytest.mark.parametrize("kind", LAYOUTS[1:])
def test_second_coats_lie_where_the_words_say(kind: str) -> None:
    surface = sphere()
    layout = Layout(kind, 0.5, 1.0, np.array([0.0, 0, 1]), np.zeros(3))
    cover = coverage(layout, surface)
    assert 0.02 < cover.mean() < 0.98 and cover.min() >= 0 and cover.max() <= 1
    on, off = cover > 0.5, cover <= 0.5
    if kind == "top":
        assert surface.point[on, 2].mean() > surface.point[off, 2].mean() + 0.3
    if kind == "edges":
        assert surface.convexity[on].mean() > surface.convexity[off].mean() + 0.2
    if kind == "crevices":
        assert surface.occlusion[on].mean() > surface.occlusion[off].mean()


@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_coat_has_the_mean_and_the_spread_it_was_asked_for(pattern: str) -> None:
    values = np.concatenate([draw_coat(default_rng(s), GREY, SPREAD, pattern).evaluate(sphere()) for s in range(6)])
    color = srgb_encode(values[:, :3])
    assert np.abs(color.mean(0) - GREY[:3]).max() < 0.03 and abs(values[:, 3].mean() - 0.6) < 0.02
    assert 0.01 < color.std(0).mean() < 0.15
    assert np.all(values[:, 4] == 0)


def test_another_seed_is_another_pattern_of_the_same_material() -> None:
    first, again, other = (draw_coat(default_rng(s), GREY, SPREAD, "blotch").evaluate(sphere()) for s in (1, 1, 2))
    assert np.array_equal(first, again)
    assert abs(np.corrcoef(first[:, 0], other[:, 0])[0, 1]) < 0.5


def test_the_second_coat_is_on_top() -> None:
    coats = tuple(draw_coat(default_rng(0), mean, SPREAD, "plain") for mean in (GREY, GOLD))
    surface = sphere()
    metallic = Recipe(coats, draw_layout(default_rng(0), "top")).evaluate(surface)[:, 4]
    height = surface.point[:, 2]
    assert np.all(metallic[height > 0.2] == 1) and np.all(metallic[height < -0.2] == 0)
