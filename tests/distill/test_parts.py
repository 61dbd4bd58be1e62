"""Parts with prompts of their own: whose a place is, what lies there, and what is said where a name or prompt will not do."""

from pathlib import Path

import numpy as np
import pytest
import torch
from click.testing import CliRunner

from dreammat_cli.main import cli
from stages.asset.parts import LabelledPart
from stages.core.artifact import load_npz
from stages.core.errors import InputError
from stages.core.schemas import MATERIAL
from stages.distill.base import Base
from stages.distill.options import DistillOptions
from stages.distill.parts import Claim, claimed, shared
from stages.distill.stage import distill
from stages.distill.start import random_points
from stages.distill.views import Views
from stages.material.evaluate import evaluate_coats
from stages.material.learnt import LearntMaterial
from stages.material.recipe import Coat, Layer, Mask, Part, Recipe
from tests.distill.examples import PARTS, label_at, write_conditions

TABLE = [LabelledPart.from_json(part) for part in PARTS]
GREY, RED = Coat("even", (0.5, 0.5, 0.5), metallic=0.0), Coat("even", (0.8, 0.1, 0.1), metallic=0.0)
GOLD = Coat("even", (0.8, 0.6, 0.2), metallic=1.0)
GILDED = Recipe(GREY, parts=(Part("upper", "gilded", (1,), Recipe(RED, (Layer(GOLD, (Mask("below", 0.5, wear=0.0),)),))),))
"""A sphere whose upper half is red and gilded below: between the equator and half of the half's own height."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_conditions(tmp_path_factory.mktemp("parts") / "conditions", size=48).parent


def test_a_later_prompt_has_what_two_claim_and_it_is_said() -> None:
    claims, lines = claimed([("#4", "oak"), ("upper", "steel")], TABLE)
    assert [(c.number, c.labels) for c in claims] == [(0, (0, 2)), (1, (1,))]
    assert lines == ["part #4: some of it is steel by the later --part upper"]
    claims, lines = claimed([("upper", "oak"), ("u*", "steel"), ("lower", "gold")], TABLE)
    assert [(c.number, c.labels) for c in claims] == [(1, (1,)), (2, (0,))]
    assert lines == ["part upper: all of it is steel by the later --part u*"]


@pytest.mark.parametrize(
    ("name", "prompt", "words"),
    [
        ("sofa", "oak", "--part 'sofa': there is none of this name; expected lower, upper, hair, #4"),
        ("hair", "oak", "--part hair: it has no area, so nothing can be seen of it; expected lower, upper, #4"),
        ("upper", " ", "--part upper: its prompt is empty"),
    ],
)
def test_a_part_that_will_not_do_is_an_error_that_says_what_would(name: str, prompt: str, words: str) -> None:
    with pytest.raises(InputError, match=f"^{words}"):
        claimed([("lower", "steel"), (name, prompt)], TABLE)


def test_prompts_on_shared_texels_are_told_apart() -> None:
    claims = [Claim(0, "seat", "oak", (1, 2)), Claim(1, "leg", "steel", (3,))]
    assert shared(claims, [(1, 2, 0.5), (2, 3, 0.001)]) == []
    assert shared(claims, [(1, 3, 0.4), (2, 3, 0.4), (0, 1, 0.9)]) == [
        "part seat shows texels that part leg has too: these look like part leg",
        "what is no part shows texels that part seat has too: these look like part seat",
    ]


def test_each_part_has_its_own_coats_with_a_sharp_border(folder: Path) -> None:
    """No point mixes coats across the border of two parts, and "lowest half" is that of the part, not of the sphere."""
    views = Views(folder / "conditions")
    points, normals, label = random_points(views, views.seen, 8000, torch.Generator().manual_seed(0))
    assert (label.numpy() == label_at(points.numpy())).mean() > 0.999
    base = Base(GILDED, views)
    values, shares = base.at(points, normals, torch.full((len(points),), views.pixel_size()), label)
    height, upper = points[:, 2].numpy(), label.numpy() == 1
    assert shares.shape[1] == len(GILDED.coats) == 3
    assert (shares[~upper, 0] == 1).all() and (shares[upper, 0] == 0).all()
    torch.testing.assert_close(shares.sum(1), torch.ones(len(points)))
    gold = values[:, 4].numpy() > 0.5
    assert gold[upper & (height < 0.24)].all() and not gold[upper & (height > 0.26)].any() and not gold[~upper].any()


def test_a_part_looks_as_it_would_alone(folder: Path) -> None:
    """Pattern and all: what lies elsewhere changes nothing of it."""
    views = Views(folder / "conditions")
    own = Recipe(Coat("rust", metres=0.4), (Layer(Coat("moss", metres=0.4), (Mask("patches", 0.4),)),), seed=5)
    recipe = Recipe(GREY, (Layer(RED, (Mask("spots", 0.3),)),), parts=(Part("upper", "rust", (1,), own),))
    settled = Base(recipe, views).recipe
    surface = views.survey.survey.surface()
    values, _ = evaluate_coats(settled, surface, views.survey.survey.pieces)
    mine = np.flatnonzero(surface.label == 1)
    alone, _ = evaluate_coats(settled.parts[0].recipe, surface[mine], views.survey.survey.pieces)
    assert np.array_equal(values[mine], alone)


def test_recipes_with_parts_are_stored_and_moved_whole() -> None:
    assert Recipe.from_json(GILDED.to_json()) == GILDED
    assert GILDED.with_coats(GILDED.coats) == GILDED
    turned = GILDED.with_coats(GILDED.coats[::-1])
    assert (turned.base, turned.parts[0].recipe.base, turned.parts[0].recipe.layers[0].coat) == (GOLD, RED, GREY)


@pytest.fixture(scope="module")
def made(folder: Path) -> tuple[Path, list[str]]:
    """A few steps of a sphere, gold above; and what was said."""
    lines: list[str] = []
    parts = (("lower", "oak"), ("upper", "gold"), ("lower", "blue plastic"))
    options = DistillOptions(prompt="black rubber", parts=parts, steps=3)
    distill(folder / "conditions", folder / "material.npz", options, tell=lines.append)
    return folder / "material.npz", lines


def test_a_run_holds_every_part(made: tuple[Path, list[str]]) -> None:
    path, lines = made
    learnt = LearntMaterial.of(path, load_npz(path, MATERIAL))
    parts = learnt.recipe.parts
    found = [(part.name, part.prompt, part.labels) for part in parts]
    assert found == [("upper", "gold", (1,)), ("lower", "blue plastic", (0,))]
    assert lines[:3] == [
        "part lower: all of it is blue plastic by the later --part lower",
        "black rubber: all that is no part", "gold: part upper",
    ]  # fmt: skip
    surface = learnt.lookup.survey.surface()
    values, _ = evaluate_coats(learnt.recipe, surface, learnt.lookup.survey.pieces)
    upper = values[surface.label == 1].mean(0), values[surface.label == 0].mean(0)
    assert upper[0][4] > 0.9 and upper[1][4] < 0.1 and upper[1][2] > 2 * upper[1][0]


def test_a_material_like_it_takes_the_parts_that_are_there(made: tuple[Path, list[str]], folder: Path) -> None:
    lines: list[str] = []
    options = DistillOptions(like=made[0], parts=(("lower", "snow"),), steps=1)
    distill(folder / "conditions", folder / "like.npz", options, tell=lines.append)
    recipe = LearntMaterial.of(folder / "like.npz", load_npz(folder / "like.npz", MATERIAL)).recipe
    assert [(part.name, part.prompt) for part in recipe.parts] == [("upper", "gold"), ("lower", "snow")]
    assert lines[0] == "part lower: all of it is snow by the later --part lower"
    assert claimed([], TABLE, carried=[("wheel_*", "rubber"), ("hair", "felt"), ("upper", "gold")]) == (
        [Claim(2, "upper", "gold", (1,))],
        ["part wheel_*: this mesh has none; rubber is left out", "part hair: this mesh has none; felt is left out"],
    )


def test_a_known_material_reads_no_words(folder: Path) -> None:
    options = DistillOptions(guidance="reference", reference=folder, parts=(("upper", "gold"),))
    with pytest.raises(InputError, match="--part with --guidance reference: it reads no words"):
        distill(folder / "conditions", folder / "known.npz", options)


def test_what_is_understood_of_parts_is_shown(folder: Path) -> None:
    """With their coats, and who has what two claim, where the conditions are there to tell."""
    words = ["--prompt", "walnut", "--part", "upper", "oak", "--part", "u*", "navy velvet with a brass top", "--explain"]
    told = CliRunner().invoke(cli, ["distill", str(folder / "conditions"), "-o", "m.npz", *words]).output
    rows = [[cell.strip() for cell in line.split("  ") if cell][:2] for line in told.splitlines()]
    assert rows[1:] == [
        ["walnut", "all that is no part"], ["oak", "part upper"], ["navy velvet", "part u*"],
        ["brass", "part u*, highest 50 % (top)"],
        ["part upper: all of it is navy velvet with a brass top by the later --part u*"],
    ]  # fmt: skip
    unknown = CliRunner().invoke(cli, ["distill", str(folder / "none"), "-o", "m.npz", *words])
    assert unknown.exit_code == 0 and unknown.output == told[: told.index("part upper: all")]


def test_run_looks_for_parts_before_it_traces_light(tmp_path: Path) -> None:
    """Options of a stage are quoted as in a shell."""
    (tmp_path / "two.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl cloth\nf 1 2 3\nusemtl wood\nf 1 2 4\n")
    options = "--part cloth 'navy velvet' --part \"sofa bed\" oak"
    words = ["run", tmp_path / "two.obj", "--prompt", "oak", "-o", tmp_path / "out", "-q", "--with", "distill", options]
    error = CliRunner().invoke(cli, list(map(str, words))).exception
    assert str(error) == "--part 'sofa bed': there is none of this name; expected two, cloth, wood, #4"
    assert [path.name for path in (tmp_path / "out").iterdir() if path.suffix != ".json"] == ["prep.npz"]
