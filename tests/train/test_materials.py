import numpy as np
import pytest
from numpy.random import default_rng

from stages.material.evaluate import evaluate
from stages.material.masks import settled
from stages.material.recipe import KINDS
from stages.material.surface import Surface
from stages.prior.colors import WORDS
from stages.prior.names import HELD_OUT, SUBSTANCES
from stages.prior.objects import OBJECTS
from stages.prior.prompt import Reading
from stages.prior.vocabulary import split_words
from stages.train import captions, materials


def ball(count: int = 500) -> Surface:
    """Of diameter 1."""
    direction = default_rng(0).normal(size=(count, 3))
    normal = (direction / np.linalg.norm(direction, axis=1, keepdims=True)).astype(np.float32)
    return Surface.bare(0.5 * normal, normal, 0.005)


@pytest.mark.parametrize("seed", range(20))
def test_materials_are_physically_plausible(seed: int) -> None:
    recipe = settled(materials.random_material(default_rng(seed)).recipe, ball())
    values = evaluate(recipe, ball())
    assert values.shape == (500, 6) and np.isfinite(values).all()
    assert values[:, :5].min() >= 0 and values[:, :5].max() <= 1
    assert values[:, :3].min() > 0.0005  # no black hole


def test_metals_are_bright_and_only_metals_are_metallic() -> None:
    for substance in SUBSTANCES:
        assert (substance.metallic == 1) == (substance.family == "metal")
        assert 0 <= substance.roughness[0] < substance.roughness[1] <= 1


def test_a_material_is_what_its_caption_is_read_as() -> None:
    """Give or take: the same stuffs in the same places, colours and roughness nearby."""
    rng, off = default_rng(0), []
    for _ in range(200):
        drawn = materials.random_material(rng)
        read = Reading(materials.tables()).recipe(drawn.caption, drawn.recipe.seed)
        assert [coat.look for coat in read.coats] == [coat.look for coat in drawn.recipe.coats], drawn.caption
        assert [[m.kind for m in layer.masks] for layer in read.layers] == [
            [m.kind for m in layer.masks] for layer in drawn.recipe.layers
        ]
        off += [np.subtract(a.color, b.color) for a, b in zip(read.coats, drawn.recipe.coats, strict=True)]
    assert 0.02 < np.std(off) < 0.05 and abs(np.mean(off)) < 0.01


def test_captions_follow_their_seed_and_every_wording_is_used() -> None:
    assert captions.caption(default_rng(1)) == captions.caption(default_rng(1)) != captions.caption(default_rng(2))
    assert sum(share for _, share, _ in captions.COMPOSED) == pytest.approx(1)
    assert sum(share for _, share in captions.SIMPLE) == pytest.approx(1)
    for wordings in (texts for *_, texts in captions.COMPOSED):
        for wording in wordings:
            recipe = Reading(materials.tables()).recipe(wording.format(x="oak", y="green paint"), 0)
            assert {"oak", "paint"} <= {coat.look for coat in recipe.coats}, wording


def test_things_that_captions_name_are_of_stuffs_that_tables_know() -> None:
    """An astronaut is of white nylon, and nylon is a word that is kept for tests."""
    assert "astronaut" not in captions.MADE and len(captions.MADE) > 1000
    for made in sorted({OBJECTS[name].made for name in captions.MADE}):
        Reading(materials.tables()).recipe(made, 0)


def test_the_words_kept_for_tests_are_never_taught() -> None:
    taught = {word for seed in range(1500) for word in split_words(captions.caption(default_rng(seed)))}
    assert len(taught) > 500
    phrases = [word for word, _ in HELD_OUT if " " not in word]
    assert not taught & set(phrases)
    assert not any(word in name for name in WORDS for word in phrases)


def test_phrases_tell_the_means_of_their_coat() -> None:
    rng = default_rng(0)
    for _ in range(50):
        text, coat = materials.random_coat(rng)
        assert coat.color is not None and coat.roughness is not None and coat.metallic in (0.0, 1.0), text


def test_most_kinds_of_masks_are_taught() -> None:
    rng = default_rng(0)
    recipes = (materials.random_material(rng).recipe for _ in range(500))
    kinds = {mask.kind for recipe in recipes for layer in recipe.layers for mask in layer.masks}
    assert len(kinds & set(KINDS)) >= 16, kinds
