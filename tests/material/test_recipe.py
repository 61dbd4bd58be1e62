"""Recipes: stored and read alike, laid where they say, with borders as sharp as asked for, the same at any size of texel."""

import json
from dataclasses import replace

import numpy as np
import pytest

from stages.material.directions import FIRST_ROUND, FLOOR, WHOLE, Pieces, along, along_reference, measure
from stages.material.evaluate import COLUMNS, FOOTPRINTS, _gains, evaluate, steadying
from stages.material.masks import settled
from stages.material.recipe import Coat, Layer, Mask, Recipe
from stages.material.substances import METRES
from stages.material.surface import Surface
from stages.material.survey import EMPTY, Lookup, Survey, connected_pieces, make_survey

GREY, RED = Coat("even", metallic=0.0), Coat("even", color=(0.8, 0.1, 0.1), metallic=1.0)


def plate(size: int, edge: float = 1.0, height: float = 0.0) -> Surface:
    """size x size points of an upright plate that faces the front."""
    across = (np.arange(size, dtype=np.float32) + 0.5) / size * edge - edge / 2
    y, z = (a.ravel() for a in np.meshgrid(across, across))
    point = np.stack([np.full_like(y, height), y, z], 1).astype(np.float32)
    return Surface.bare(point, np.broadcast_to(np.array([1, 0, 0], np.float32), point.shape), edge / size)


def two(*masks: Mask, thickness: float = 0.0) -> Recipe:
    return settled(Recipe(GREY, (Layer(RED, masks, thickness),)), plate(96))


def test_a_recipe_comes_back_from_json() -> None:
    recipe = two(Mask("patches", 0.3), Mask("above", 0.5, invert=True))
    assert Recipe.from_json(json.loads(json.dumps(recipe.to_json()))) == recipe
    with pytest.raises((KeyError, TypeError)):
        Recipe.from_json({"base": {}})


@pytest.mark.parametrize("kind", ["below", "above", "stripes", "bands", "spots", "patches", "chips", "streaks"])
@pytest.mark.parametrize("share", [0.2, 0.6])
def test_a_mask_covers_its_share(kind: str, share: float) -> None:
    for invert in (False, True):
        recipe = two(Mask(kind, share, 0.1, invert=invert))
        covered = evaluate(recipe, plate(96))[:, 4].mean()
        assert covered == pytest.approx(1 - share if invert else share, abs=0.06)


def border(recipe: Recipe, size: int) -> float:
    """Texels over which a level border between two coats runs, on average over the columns."""
    metal = evaluate(recipe, plate(size, 0.1))[:, 4].reshape(size, size)
    return float(((metal > 0.02) & (metal < 0.98)).sum(0).mean())


def test_a_sharp_border_is_three_texels_wide_at_most() -> None:
    recipe = settled(two(Mask("below", 0.5, 0.05, 0.0)), plate(96))
    recipe = replace(recipe, layers=(replace(recipe.layers[0], masks=(replace(recipe.layers[0].masks[0], level=3e-4),)),))
    assert 0 < border(recipe, 128) <= 3  # texels of 1 / 1280 of the object


def test_a_worn_border_is_ragged_at_every_scale() -> None:
    """The longer the closer one looks, as a coast is."""
    mask = replace(two(Mask("below", 0.5, 0.06, 1.0)).layers[0].masks[0], level=0.0)
    recipe = Recipe(GREY, (Layer(RED, (mask,)),))
    lengths = []
    for size in (64, 256):
        metal = evaluate(recipe, plate(size, 0.2))[:, 4].reshape(size, size) > 0.5
        lengths.append((np.diff(metal, axis=0).sum() + np.diff(metal, axis=1).sum()) / size)
    assert lengths[1] > 1.3 * lengths[0] > 1.3


def test_layers_stand_proud_by_their_thickness() -> None:
    surface = plate(64)
    recipe = settled(Recipe(GREY, (Layer(replace(RED, metres=2.0), (Mask("above", 0.5, wear=0.0),), 0.004),)), surface)
    values = evaluate(recipe, surface)
    assert values.shape == (64 * 64, COLUMNS)
    np.testing.assert_allclose(values[values[:, 4] == 1, 5], 0.002, atol=1e-6)
    np.testing.assert_allclose(values[values[:, 4] == values[:, 4].min(), 5], 0, atol=1e-6)


def test_a_coat_has_the_means_that_are_asked_for() -> None:
    wanted = Coat("granite", color=(0.2, 0.35, 0.7), roughness=0.35, metres=0.5)
    found = evaluate(Recipe(wanted), plate(160, 1.0)).mean(0)
    assert found[2] > found[1] > found[0] and found[3] == pytest.approx(0.35, abs=0.03)
    plain = evaluate(Recipe(replace(wanted, contrast=0.0)), plate(32))
    assert plain[:, :3].std(0).max() < 1e-3


def test_seeds_change_patterns_not_stuff() -> None:
    one, other = (evaluate(Recipe(Coat("rust", metres=3.0), seed=seed), plate(128)) for seed in (0, 1))
    assert abs(np.corrcoef(one[:, 0], other[:, 0])[0, 1]) < 0.25
    np.testing.assert_allclose(one.mean(0)[:4], other.mean(0)[:4], atol=0.02)


def test_the_same_view_at_two_texel_sizes_is_the_same_on_average() -> None:
    """4 x 4 fine texels against one coarse one: the band limit hides nothing but what is too fine."""
    moss = Layer(Coat("moss", metres=1.0), (Mask("patches", 0.3),), 1e-3)
    recipe = settled(Recipe(Coat("brick", metres=2.0), (moss,)), plate(64))
    fine = evaluate(recipe, plate(512, 0.5))[:, :5].reshape(128, 4, 128, 4, 5).mean((1, 3))
    coarse = evaluate(recipe, plate(128, 0.5))[:, :5].reshape(128, 128, 5)
    assert np.sqrt(np.square(fine - coarse).mean()) < 0.05
    assert abs(fine.mean((0, 1)) - coarse.mean((0, 1))).max() < 0.01


def cylinder(count: int = 4000) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals of the wall of an upright cylinder of radius 0.25."""
    dice = np.random.default_rng(0)
    angle, z = dice.uniform(0, 2 * np.pi, count), dice.uniform(-0.5, 0.5, count)
    normal = np.stack([np.cos(angle), np.sin(angle), 0 * z], 1).astype(np.float32)
    return (normal * 0.25 + np.stack([0 * z, 0 * z, z], 1)).astype(np.float32), normal


def test_round_things_are_measured_around_and_boxes_by_their_sides() -> None:
    point, normal = cylinder()
    pieces, row = measure(point, normal, np.ones(len(point), np.float32), np.zeros(len(point), np.int64))
    assert pieces.radius[0] == pytest.approx(0.25, abs=0.01)
    uv, face = along(pieces, row, point, normal)
    assert (face % 16 == FIRST_ROUND).all() and np.ptp(uv[0]) == pytest.approx(2 * np.pi * 0.25, abs=0.05)
    box = plate(32)
    pieces, row = measure(box.point, box.normal, np.ones(len(box), np.float32), np.zeros(len(box), np.int64))
    uv, face = along(pieces, row, box.point, box.normal)
    assert pieces.radius[0] == 0 and len(np.unique(face)) == 1
    np.testing.assert_allclose(np.ptp(uv, axis=1), [31 / 32, 31 / 32], atol=1e-5)


def test_directions_are_those_of_their_plain_form() -> None:
    """Of pieces that are round and others, each turned its own way."""
    dice = np.random.default_rng(0)
    point, normal = dice.normal(size=(2, 3000, 3)).astype(np.float32)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    turn = np.stack([[[np.cos(a), np.sin(a), 0], [-np.sin(a), np.cos(a), 0], [0, 0, 1]] for a in (0.0, 0.4, 1.1)])
    centre, radius = dice.normal(size=(3, 3)).astype(np.float32), np.array([0, 0.3, 0], np.float32)
    pieces, piece = Pieces(centre, turn.astype(np.float32), radius, centre), dice.integers(0, 3, 3000).astype(np.int32)
    (uv, face), (wanted, own) = (of(pieces, piece, point, normal) for of in (along, along_reference))
    np.testing.assert_array_equal(face, own)
    np.testing.assert_allclose(uv, wanted, atol=2e-6)


def test_bricks_close_around_a_tower() -> None:
    """Just before and just behind the place where the way around begins anew there are the same courses."""
    z = np.linspace(-0.4, 0.4, 200).astype(np.float32)
    point, normal = cylinder()
    pieces, _ = measure(point, normal, np.ones(len(point), np.float32), np.zeros(len(point), np.int64))
    sides = []
    for angle in (np.pi - 1e-4, -np.pi + 1e-4):
        n = np.broadcast_to(np.array([np.cos(angle), np.sin(angle), 0], np.float32), (200, 3))
        surface = Surface.bare((0.25 * n + np.stack([0 * z, 0 * z, z], 1)).astype(np.float32), n, 1e-3)
        sides.append(evaluate(Recipe(Coat("brick", metres=3.0)), surface, pieces)[:, 0])
    assert np.corrcoef(*sides)[0, 1] > 0.95


@pytest.mark.parametrize("look", ["rust", "marble"])
def test_what_is_solid_runs_on_from_the_wall_of_a_round_thing_to_its_top(look: str) -> None:
    """Points of a sphere just below and just above the circle where its wall ends."""
    dice = np.random.default_rng(0).normal(size=(4000, 3))
    normal = (dice / np.linalg.norm(dice, axis=1, keepdims=True)).astype(np.float32)
    pieces, _ = measure(0.5 * normal, normal, np.ones(4000, np.float32), np.zeros(4000, np.int64))
    assert pieces.radius[0] > 0
    angle, sides = np.linspace(0, 6.2, 300), []
    for rise in (FLOOR - 1e-4, FLOOR + 1e-4):
        level = np.sqrt(1 - rise**2)
        n = np.stack([level * np.cos(angle), level * np.sin(angle), np.full_like(angle, rise)], 1).astype(np.float32)
        sides.append(evaluate(Recipe(Coat(look, metres=1.0)), Surface.bare(0.5 * n, n, 2e-3), pieces)[:, 0])
    assert np.corrcoef(*sides)[0, 1] > 0.98


def test_a_survey_finds_edges_creases_and_what_is_hidden() -> None:
    """A cube: its edges are convex, its sides flat; with every ray blocked from one half, that half is dark."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)], np.float32)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = np.array([[q[0], q[a], q[b]] for q in quads for a, b in ((1, 2), (2, 3))], np.int32)
    p = corners[triangles]
    flat = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    normals = np.repeat(flat[:, None], 3, 1).astype(np.float32)
    label = np.zeros(len(triangles), np.int32)
    found = make_survey(corners, triangles, normals, lambda origin, direction: origin[:, 2] < 0, label)
    near = np.sort(abs(abs(found.point) - 0.5), axis=1)[:, 1]  # distance to the nearest edge
    assert found.convexity[near < 0.003].mean() > 0.2 > 0.03 > abs(found.convexity[near > 0.05]).max()
    low = found.point[:, 2] < -0.05
    assert found.occlusion[low].mean() > 0.95 and found.occlusion[found.point[:, 2] > 0.05].mean() < 0.05
    assert (connected_pieces(triangles, 8) == 0).all()
    again = Survey.from_arrays(found.to_arrays())
    asked = Lookup(again).surface(found.point[:50], found.normal[:50], np.full(50, 1e-3, np.float32))
    np.testing.assert_allclose(asked.occlusion, found.occlusion[:50], atol=0.35)


def test_nothing_is_known_of_an_empty_survey() -> None:
    surface = Lookup(EMPTY).surface(*(np.ones((3, 3), np.float32),) * 2, np.ones(3, np.float32))
    assert (surface.convexity == 0).all() and (surface.piece == 0).all() and len(WHOLE.centre) == 1
    assert len(evaluate(Recipe(GREY), surface[:0])) == 0


def test_points_that_search_together_are_told_what_each_alone_is() -> None:
    """Convexity and occlusion of groups of near points equal those of single look-ups; a survey may be smaller than a group."""
    rng = np.random.default_rng(2)
    for count in (2, 4000):
        at, normal = rng.random((count, 3)).astype(np.float32), rng.normal(size=(count, 3)).astype(np.float32)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        values = rng.random((2, count)).astype(np.float32)
        lookup = Lookup(Survey(at, normal, values[0], values[1], *[np.zeros(count, np.int32)] * 2, WHOLE))
        first = rng.random((50, 3)).astype(np.float32)
        group = np.repeat(np.arange(50), 20)
        point = first[group] + rng.uniform(-1, 1, (1000, 3)).astype(np.float32) * np.float32(2e-3)
        point[::20] = first
        facing = normal[rng.integers(0, count, 1000)]
        alone = lookup.surface(point, facing, np.ones(1000, np.float32))
        together = lookup.shared(point, facing, np.arange(0, 1000, 20), group)
        np.testing.assert_allclose(together[0], alone.convexity, atol=2e-6)
        np.testing.assert_allclose(together[1], alone.occlusion, atol=2e-6)


def test_white_leather_is_clean() -> None:
    """Its colours differ less from their mean than those of brown leather do, each as a share of it."""
    surface = Surface.bare(*(np.random.default_rng(0).random((2, 4000, 3)).astype(np.float32)), 1e-3)
    spread = []
    for color in ((0.36, 0.24, 0.14), (0.93, 0.93, 0.93)):
        found = evaluate(Recipe(Coat("leather", color)), surface)[:, :3].mean(1)
        spread.append(found.std() / found.mean())
    assert 0 < spread[1] < 0.5 * spread[0]


def test_gains_are_interpolated_between_octaves_of_the_footprint() -> None:
    footprint = np.exp(np.random.default_rng(0).uniform(-16, 2, 3000)).astype(np.float32)
    footprint[:4] = METRES["rust"] * np.array([FOOTPRINTS[0], FOOTPRINTS[-1], FOOTPRINTS[3], FOOTPRINTS[3]])
    octave = np.log2(footprint / np.float32(METRES["rust"]))
    expected = [np.interp(octave, np.log2(FOOTPRINTS), gain) for gain in _gains("rust")]
    np.testing.assert_allclose(steadying("rust", footprint), expected, rtol=2e-6)
