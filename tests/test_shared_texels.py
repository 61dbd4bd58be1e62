"""Places that share texels share the material: what a view is told of a place is what a bake writes to its texel."""

from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from stages.asset.parts import labels
from stages.bake.options import BakeOptions
from stages.bake.stage import Subject, bake_maps
from stages.bake.visibility import Views as Cameras
from stages.bake.visibility import patches, seen_elsewhere, seen_points
from stages.conditions.options import ConditionsOptions
from stages.conditions.stage import conditions
from stages.core.artifact import Artifact, load_npz
from stages.core.frames import look_at
from stages.core.progress import silent
from stages.core.schemas import MATERIAL, PREP
from stages.distill.base import Base
from stages.distill.views import Views
from stages.light.lookup import REPEAT, look_up
from stages.light.scene import Scene
from stages.material.learnt import LearntMaterial
from stages.material.recipe import Coat, Layer, Mask, Recipe
from stages.material.residual import Residual
from stages.prep.options import PrepOptions
from stages.prep.stage import prep
from tests.bake.examples import save_material, small_residual

SIZE = 512
RECIPE = Recipe(Coat("even", color=(0.9, 0.2, 0.1)), (Layer(Coat("even", color=(0.1, 0.3, 0.8)), (Mask("above", 0.4),)),))


def panel(corner: NDArray, u: NDArray, v: NDArray) -> NDArray:
    """(4, 3) a quad."""
    return np.array([corner, corner + u, corner + u + v, corner + v])


FIELD = np.array([(0.1, 0.1), (0.4, 0.1), (0.4, 0.8), (0.1, 0.8)])
MIRRORED = FIELD[[1, 0, 3, 2]]


def written(path: Path) -> Path:
    """One board by itself, one stacked on it, one mirrored, one a tile away, one half over the border of the tile, one of no
    area in UV. Their texels lie in two fields."""
    other = np.array([(0.65, 0), (0.9, 0), (0.9, 0.7), (0.65, 0.7)])
    return boards(path, [FIELD, FIELD, MIRRORED, FIELD + (3, -1), other - (0.85, 0), np.tile(FIELD[:1], (4, 1))])


def boards(path: Path, uvs: list[NDArray]) -> Path:
    """Up to six boards round a square post, at different heights; the sixth is thin. Args: uvs: (4, 2) of each."""
    lines, faces = [], []
    for k, uv in enumerate(uvs):
        angle = k * np.pi / 3
        out, along = np.array([np.cos(angle), 0, np.sin(angle)]), np.array([-np.sin(angle), 0, np.cos(angle)])
        height = 1e-4 if k == 5 else 1.0
        corners = panel(out - along * 0.4 + (0, 0.15 * k, 0), 0.8 * along, np.array([0, 2 * height, 0]))[::-1]
        lines += [f"v {x} {y} {z}" for x, y, z in corners] + [f"vt {u} {v}" for u, v in uv[::-1]]
        faces.append("f " + " ".join(f"{4 * k + c}/{4 * k + c}" for c in (1, 2, 3, 4)))
    path.write_text("\n".join(lines + faces) + "\n")
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("shared")
    findings = prep(written(made / "boards.obj"), made / "prep.npz", PrepOptions()).findings
    assert findings["uv"] == (
        "kept; 4 of 12 faces outside the unit square, whose textures repeat; 2 of 12 faces without area in UV, each shows the "
        "texel that it touches; 54.5 % of the texels are shared by stacked, mirrored or repeated islands"
    )
    options = ConditionsOptions(views=6, size=96, env=("overcast",), quality="draft", elevation=(0.0, 30.0))
    conditions(made / "prep.npz", made / "conditions", options)
    return made


def learnt_of(folder: Path, views: Views) -> tuple[Artifact, LearntMaterial]:
    recipe = Base(RECIPE, views).recipe
    residual = small_residual(variation=1.0)
    path = save_material(folder / "material.npz", folder / "prep.npz", residual, recipe=recipe, survey=views.survey.survey)
    made = load_npz(path, MATERIAL)
    return made, LearntMaterial.of(path, made)


def test_a_view_is_told_what_is_baked(folder: Path) -> None:
    """Every pixel's material, by recipe and residual, is its texel's, to within what half a texel changes."""
    mesh, views = load_npz(folder / "prep.npz", PREP), Views(folder / "conditions")
    made, learnt = learnt_of(folder, views)
    subject = Subject.of(folder / "prep.npz", mesh, SIZE)
    maps, _ = bake_maps(subject, made, learnt, BakeOptions(size=SIZE, occlusion_rays=1), silent)
    scene = Scene(mesh["vertices"], mesh["triangles"], mesh["normals"])
    faces = set()
    for view in views.seen:
        surface = views.surface(view, np.arange(len(views.pixels(view))))
        where = (surface.shown, surface.shown_normals, torch.full((len(surface.shown),), 0.002), surface.label)
        told = Base(learnt.recipe, views).material(Residual.of(learnt.residual), *where).columns().detach().numpy()
        hits = scene.intersect(*(np.broadcast_to(a, surface.points.shape) for a in rays(views, view, surface.points.numpy())))
        faces |= set(hits.triangle.tolist())
        uv = np.einsum("pk,pkd->pd", hits.barycentric, mesh["uv"][hits.triangle]) * (1, -1) + (0, 1)
        shown = look_up(maps.material, uv, wrap=(REPEAT, REPEAT))
        inside = (hits.barycentric > 0.03).all(1)  # a look-up on the rim mixes in what lies beyond
        border = np.abs(surface.shown[:, 2].numpy() - levels(learnt, mesh)) < 0.02
        apart = np.abs(told - shown)[inside & ~border]
        assert np.sqrt((apart**2).mean()) < 0.004
    assert faces >= set(range(10))


def levels(learnt: LearntMaterial, mesh: Artifact) -> float:
    """Height of the border between the two coats."""
    return float(learnt.recipe.layers[0].masks[0].level or 0.0)


def rays(views: Views, view: int, points: NDArray) -> tuple[NDArray, NDArray]:
    eye = views.c2w[view][:3, 3]
    return eye, points - eye


def test_places_that_share_a_texel_are_told_one_point(folder: Path) -> None:
    """All boards but the one with a field of its own are told points of the first of them."""
    views, mesh = Views(folder / "conditions"), load_npz(folder / "prep.npz", PREP)
    chart = mesh["charts"].reshape(-1, 2)[:, 0]
    assert chart[0] < chart[[1, 2, 3]].min()
    first = mesh["vertices"][mesh["triangles"][:2]].reshape(-1, 3)
    own = mesh["vertices"][mesh["triangles"][8:10]].reshape(-1, 3)
    label = labels(mesh)[::2]
    assert len(set(label)) == 6
    assert {pair[:2] for pair in views.shared_labels if pair[2] > 0.99} >= {(b, label[0]) for b in label[[1, 2, 3]]}
    for view in views.seen:
        surface = views.surface(view, np.arange(len(views.pixels(view))))
        shown = surface.shown.numpy()
        assert set(surface.label.tolist()) <= {label[0], label[4]}
        inside = [((shown > p.min(0) - 1e-4) & (shown < p.max(0) + 1e-4)).all(1) for p in (first, own)]
        assert (inside[0] | inside[1]).all()


def test_a_texel_is_seen_where_any_of_its_places_is(folder: Path) -> None:
    """One camera that sees only the mirrored board and what lies beside it."""
    mesh = load_npz(folder / "prep.npz", PREP)
    subject = Subject.of(folder / "prep.npz", mesh, SIZE)
    board = mesh["vertices"][mesh["triangles"][4]].mean(0)
    eye = board * (4, 4, 1)
    cameras = Cameras(look_at(eye, board, np.array([0.0, 0, 1]))[None], np.array([0.7]), 64, 64)
    groups = patches(subject.touched, mesh["charts"])
    on_chart = subject.touched.triangle >= 0
    firsts = subject.touched.where(on_chart)[groups.first]
    of_first = mesh["charts"][firsts.triangle] == mesh["charts"][0]
    assert not seen_points(subject.scene, firsts, cameras, False)[of_first].any()
    assert seen_elsewhere(subject.scene, subject.layout, mesh["charts"], groups, cameras, False)[of_first].mean() > 0.95


@pytest.mark.parametrize("stacked", [FIELD, MIRRORED], ids=["stacked", "mirrored"])
def test_what_is_stacked_shows_what_it_would_alone(stacked: NDArray, tmp_path: Path) -> None:
    """The texels of the board that represents the others are as crisp as if the others had texels of their own."""
    layouts = {"alone": [FIELD, FIELD + (0.45, 0)], "shared": [FIELD, stacked]}
    stone, shown = Recipe(Coat("granite", metres=1.0)), []
    for name, uvs in layouts.items():
        path = tmp_path / f"{name}.npz"
        prep(boards(tmp_path / f"{name}.obj", uvs), path, PrepOptions())
        mesh = load_npz(path, PREP)
        subject = Subject.of(path, mesh, SIZE)
        made = save_material(tmp_path / "material.npz", path, small_residual(variation=1.0), recipe=stone)
        learnt = LearntMaterial.of(made, load_npz(made, MATERIAL))
        maps, _ = bake_maps(subject, load_npz(made, MATERIAL), learnt, BakeOptions(size=SIZE, occlusion_rays=1), silent)
        first = np.isin(subject.touched.triangle, [0, 1])  # of the first board, which lies in the same field in both
        shown.append(maps.material[first])
    assert np.sqrt(np.square(shown[0] - shown[1]).mean()) < 0.01
    assert shown[0][:, :3].std() > 0.05  # there is a pattern to blur
