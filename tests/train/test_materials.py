import numpy as np
import pytest
from numpy.random import default_rng

from stages.prior.colors import WORDS
from stages.prior.names import HELD_OUT, SUBSTANCES
from stages.prior.recipe import LAYOUTS
from stages.prior.text import split_words
from stages.train import materials
from stages.train.captions import COMPOSED, Words, caption
from tests.prior.test_recipe import sphere


@pytest.mark.parametrize("seed", range(30))
def test_materials_are_physically_plausible(seed: int) -> None:
    material = materials.random_material(default_rng(seed))
    values = material.recipe.evaluate(sphere(500))
    assert values.shape == (500, 5) and np.isfinite(values).all()
    assert values.min() >= 0 and values.max() <= 1
    assert values[:, :3].min() > 0.0005 and values[:, :3].max() < 0.98  # neither a black hole nor a mirror of all light
    if material.recipe.layout is None:
        assert set(np.unique(values[:, 4])) <= {0.0, 1.0}  # metal or not, nothing between


def test_metals_are_bright_and_only_metals_are_metallic() -> None:
    for substance in SUBSTANCES:
        assert (substance.metallic == 1) == (substance.family == "metal")
        assert 0 <= substance.roughness[0] < substance.roughness[1] <= 1


def test_captions_name_both_substances_and_follow_their_seed() -> None:
    base, second = Words("oak", "", "polished", "wood"), Words("plastic", "red", "", "plastic")
    for kind in COMPOSED:
        text = caption(default_rng(1), base, second, kind)
        assert "oak" in text and "plastic" in text and "red" in text and "polished" in text
        assert text == caption(default_rng(1), base, second, kind)


def test_the_words_kept_for_tests_are_never_taught() -> None:
    captions = [materials.random_material(default_rng(seed)).caption for seed in range(1500)]
    taught = {word for text in captions for word in split_words(text)}
    assert len(taught) > 250
    phrases = [word for word, _ in HELD_OUT if " " not in word]
    assert not taught & set(phrases)
    assert not any(word in name for name in WORDS for word in phrases)


def test_every_substance_can_be_drawn_and_its_points_tell_it() -> None:
    rng = default_rng(0)
    for substance in SUBSTANCES:
        _, coat = materials.draw_coat(rng, substance)
        values = materials.encoded(coat.evaluate(materials.stand_in(rng, 96)))
        assert values.shape == (96, 5) and np.all(values[:, 4] == substance.metallic)
        assert np.abs(values[:, :3].mean(0) - coat.color).max() < 0.25


def test_every_layout_is_taught() -> None:
    rng = default_rng(0)
    layouts = [materials.random_material(rng, composed=1.0).recipe.layout for _ in range(200)]
    assert {layout.kind for layout in layouts if layout} == set(LAYOUTS) - {"none"}
