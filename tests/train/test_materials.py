import numpy as np
import pytest
from numpy.random import default_rng

from stages.prior.text import LAYOUTS, SHARES, split_words
from stages.train import materials
from stages.train.captions import COMPOSED, Words, caption
from stages.train.colors import WORDS
from stages.train.patterns import LATTICE, PATTERNS, noise
from stages.train.substances import HELD_OUT, SUBSTANCES


def sphere(count: int = 500) -> materials.Surface:
    rng = default_rng(0)
    direction = rng.normal(size=(count, 3))
    normal = (direction / np.linalg.norm(direction, axis=1, keepdims=True)).astype(np.float32)
    flat = rng.uniform(-0.4, 0.6, count).astype(np.float32), rng.uniform(0, 0.8, count).astype(np.float32)
    return materials.Surface(normal * np.float32(0.5), normal, *flat)


@pytest.mark.parametrize("seed", range(30))
def test_materials_are_physically_plausible(seed: int) -> None:
    material = materials.random_material(default_rng(seed))
    values = material.evaluate(sphere())
    assert values.shape == (500, 5) and np.isfinite(values).all()
    assert values.min() >= 0 and values.max() <= 1
    assert values[:, :3].min() > 0.0005 and values[:, :3].max() < 0.98  # neither a black hole nor a mirror of all light
    if material.layout is None:
        assert set(np.unique(values[:, 4])) <= {0.0, 1.0}  # metal or not, nothing between


def test_metals_are_bright_and_only_metals_are_metallic() -> None:
    for substance in SUBSTANCES:
        assert (substance.metallic == 1) == (substance.family == "metal")
        assert 0 <= substance.roughness[0] < substance.roughness[1] <= 1


@pytest.mark.parametrize("name", PATTERNS)
def test_patterns_are_bounded_and_vary(name: str) -> None:
    value = PATTERNS[name](default_rng(0).uniform(0, 32, (5000, 3)))
    assert value.shape == (5000,) and np.isfinite(value).all()
    assert np.abs(value).max() < 2.1 and value.std() > 0.05


def test_noise_is_continuous_and_meets_its_lattice() -> None:
    grid = np.array([[3.0, 4.0, 5.0], [31.0, 0.0, 31.0]])
    at = [3 * 1024 + 4 * 32 + 5, 31 * 1024 + 31]
    assert np.allclose(noise(grid), LATTICE[at])
    p = default_rng(1).uniform(-40, 40, (1000, 3))
    assert np.abs(noise(p + 1e-4) - noise(p)).max() < 1e-2
    assert np.allclose(noise(p), noise(p + 32), atol=1e-5)


@pytest.mark.parametrize("kind", [kind for kind, _ in materials.KINDS])
def test_second_coats_lie_where_the_words_say(kind: str) -> None:
    surface = sphere(4000)
    layout = materials.Layout(kind, 0.5, 1.0, np.array([0.0, 0, 1]), np.zeros(3))
    cover = materials.coverage(layout, surface)
    assert 0.02 < cover.mean() < 0.98 and cover.min() >= 0 and cover.max() <= 1
    on, off = cover > 0.5, cover <= 0.5
    if kind == "top":
        assert surface.point[on, 2].mean() > surface.point[off, 2].mean() + 0.3
    if kind == "edges":
        assert surface.convexity[on].mean() > surface.convexity[off].mean() + 0.2
    if kind == "crevices":
        assert surface.occlusion[on].mean() > surface.occlusion[off].mean()


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
        coat = materials.draw_coat(rng, substance)
        values = materials.encoded(coat.evaluate(materials.stand_in(rng, 96)))
        assert values.shape == (96, 5) and np.all(values[:, 4] == substance.metallic)
        assert np.abs(values[:, :3].mean(0) - coat.color).max() < 0.25


def test_points_know_how_high_they_are() -> None:
    rng = default_rng(0)
    coats = tuple(materials.draw_coat(rng, next(s for s in SUBSTANCES if s.metallic == metallic)) for metallic in (0.0, 1.0))
    layout = materials.Layout("top", 0.5, 1.0, np.ones(3), np.zeros(3))
    surface = materials.stand_in(rng, 500)
    height, values = surface.point[:, 2], materials.RandomMaterial("", coats, layout).evaluate(surface)
    assert np.all(values[height > 0.1, 4] == 1) and np.all(values[height < -0.1, 4] == 0)


def test_the_reader_knows_every_layout_and_its_share_of_the_surface() -> None:
    rng, found = default_rng(0), {kind: [] for kind, _ in materials.KINDS}
    for _ in range(1500):
        layout = materials.random_material(rng, composed=1.0).layout
        assert layout is not None
        found[layout.kind].append(materials.coverage(layout, materials.stand_in(rng, 24)).mean())
    assert set(found) == set(LAYOUTS) - {"none"}
    for kind in set(found) - {"top"}:
        assert abs(np.mean(found[kind]) - float(SHARES[LAYOUTS.index(kind)])) < 0.05, kind
