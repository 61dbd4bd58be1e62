"""A material like another's: its recipe and draw on another mesh, as large in space as there."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stages.core.artifact import load_npz, save_npz
from stages.core.errors import InputError
from stages.core.schemas import MATERIAL
from stages.distill.like import Like, read_like
from stages.distill.options import DistillOptions
from stages.distill.stage import distill
from stages.distill.views import Views
from stages.material.directions import WHOLE
from stages.material.evaluate import _solid, evaluate
from stages.material.masks import settled
from stages.material.place import Place
from stages.material.recipe import Coat, Layer, Mask, Recipe
from stages.material.surface import Surface
from tests.distill.examples import write_conditions

STRIPED = Recipe(
    Coat("even", color=(0.9, 0.9, 0.9), metres=0.5),
    (Layer(Coat("even", color=(0.1, 0.1, 0.1), metres=0.5), (Mask("bands", 0.5, 0.08, 0.0, level=0.01),)),),
    seed=11,
)


def bands_per_unit(recipe: Recipe, extent: float) -> float:
    """Borders along an upright line over the object, per unit of its source."""
    z = np.linspace(-0.5, 0.5, 40_000, dtype=np.float32)
    point = np.stack([0 * z, 0 * z, z], 1)
    surface = Surface.bare(point, np.tile(np.float32((1, 0, 0)), (len(z), 1)), 1e-5)
    light = evaluate(settled(recipe, surface), surface)[:, 0] > 0.3
    borders = z[1:][light[1:] != light[:-1]] * extent
    return 2 / float(np.mean(borders[2:] - borders[:-2]))


@pytest.mark.parametrize("extent", [0.5, 2.0, 3.0])
def test_structure_is_as_large_in_space_on_an_object_of_another_size(extent: float) -> None:
    like = Like(STRIPED, "stripes", 1.0, "")
    carried = like.carried(extent, None)
    assert [coat.metres for coat in carried.coats] == pytest.approx([0.5 * extent] * 2)
    assert carried.seed == STRIPED.seed
    assert carried.layers[0].masks[0].level is None
    assert bands_per_unit(carried, extent) == pytest.approx(bands_per_unit(STRIPED, 1.0), rel=0.05)


def at(recipe: Recipe, extent: float, wood: np.ndarray) -> np.ndarray:
    """Green of a recipe of one coat on an object so large, at places (P, 3) of its pattern 0.002 apart, units of the source."""
    corners = Surface.bare(np.eye(4, 3, -1, dtype=np.float32), np.tile(np.float32((0, 0, 1)), (4, 1)), 1.0)
    none = np.zeros((2, 4), np.float32)
    world = Place(np.ascontiguousarray(corners.point.T), none, none[0].astype(np.int32), corners.footprint, seed=recipe.seed)
    origin, *axes = _solid(recipe.base, corners, world, WHOLE, 0).T.astype(np.float64)  # turned and shifted by chance
    point = np.linalg.solve((np.array(axes) - origin).T, (wood / extent - origin).T).T
    up = np.tile(np.float32((0, 0, 1)), (len(point), 1))
    return evaluate(recipe, Surface.bare(point.astype(np.float32), up, 0.002 / extent))[:, 1]


@pytest.mark.parametrize("extent", [0.018, 3.0])
def test_what_is_carried_is_the_very_pattern(extent: float) -> None:
    """A mean frequency would tell less: of oak it differs by 7 % from one draw to the next."""
    own = Recipe(Coat("oak", metres=1.1), seed=3)
    carried = Like(own, "oak", 1.1, "").carried(extent, None)
    plane = np.stack([a.ravel() for a in np.meshgrid(*[np.arange(48) * 0.002 - 0.048] * 2)] + [np.zeros(48 * 48)], 1)
    source = at(own, 1.1, plane + 0.5)
    assert np.corrcoef(source, at(carried, extent, plane + 0.5))[0, 1] > 0.999
    for scale in (0.95, 1.05):
        assert np.corrcoef(source, at(carried, extent, scale * plane + 0.5))[0, 1] < 0.9


def test_metres_count_before_units() -> None:
    carried = Like(STRIPED, "stripes", 100.0, "").carried(1.0, 2.0)
    assert carried.base.metres == pytest.approx(2.0)
    assert carried.layers[0].masks[0].size == pytest.approx(0.02)


def test_a_part_that_was_found_on_one_mesh_is_looked_for_on_the_other() -> None:
    legs = Mask("pieces", 0.3, 0.1, 0.0, level=0.5, said="legs", pieces=(2, 3))
    recipe = replace(STRIPED, layers=(replace(STRIPED.layers[0], masks=(legs,)),))
    (mask,) = Like(recipe, "legs", 1.0, "").carried(2.0, None).layers[0].masks
    assert (mask.kind, mask.pieces, mask.level, mask.said, mask.size) == ("below", (), None, "legs", 0.05)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A few steps on a sphere of extent 2."""
    folder = tmp_path_factory.mktemp("like")
    write_conditions(folder / "conditions", extent=2.0)
    distill(folder / "conditions", folder / "a.npz", DistillOptions(prompt="red bricks, mossy", steps=2))
    return folder


def test_a_run_takes_over_words_recipe_and_draw(made: Path) -> None:
    write_conditions(made / "larger", views=5, extent=5.0)
    assert Views(made / "larger").extent() == pytest.approx(5)
    first = distill(made / "larger", made / "b.npz", DistillOptions(like=made / "a.npz", steps=2))
    assert not first.up_to_date
    one, other = (load_npz(made / name, MATERIAL).provenance for name in ("a.npz", "b.npz"))
    assert other.extra["prompt"] == "red bricks, mossy"
    recipes = [Recipe.from_json(made.extra["recipe"]) for made in (one, other)]
    assert recipes[0].seed == recipes[1].seed
    for a, b in zip(recipes[0].coats, recipes[1].coats, strict=True):
        assert b.look == a.look
        assert b.metres == pytest.approx(2.5 * a.metres)
        assert b.color is None or np.abs(np.subtract(a.color, b.color)).max() < 0.03  # each run moves it a little
    assert "like" in other.inputs
    assert distill(made / "larger", made / "b.npz", DistillOptions(like=made / "a.npz", steps=2)).up_to_date


def test_what_is_not_like_anything(made: Path) -> None:
    with pytest.raises(InputError, match="brings its own words; leave --prompt out"):
        read_like(made / "a.npz", DistillOptions(like=made / "a.npz", prompt="oak"))
    with pytest.raises(InputError, match="--like with --guidance sd: it follows no recipe"):
        read_like(made / "a.npz", DistillOptions(guidance="sd"))
    old = load_npz(made / "a.npz", MATERIAL)
    for missing, words in (("extent", "does not say how large its object is"), ("prompt", "has no recipe to be like")):
        extra = {**old.provenance.extra, "prompt": "" if missing == "prompt" else "x"}
        extra.pop("extent")
        save_npz(made / "old.npz", MATERIAL, old.arrays, replace(old.provenance, extra=extra))
        with pytest.raises(InputError, match=words):
            read_like(made / "old.npz", DistillOptions())
