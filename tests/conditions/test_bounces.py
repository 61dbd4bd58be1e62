"""Light between surfaces in a conditions folder, and what distillation makes of it."""

import shutil
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from dreammat_cli.main import main
from stages.conditions.options import ConditionsOptions
from stages.conditions.stage import conditions
from stages.core.artifact import load_npz, read_exr, read_manifest
from stages.core.errors import ArtifactError
from stages.core.schemas import BOUNCES, CONDITIONS, VIEW_BOUNCES
from stages.core.shading import Material, shade
from stages.distill.sampling import CropSampler, PixelSampler
from stages.distill.views import Views
from stages.light.cells import Cells
from stages.light.ends import Ends
from tests.conditions.test_conditions import fingerprint
from tests.light import scenes
from tests.prepared import save_prep

DIRECT = ConditionsOptions(views=2, size=16, env=("clear_sky", "studio"), quality="draft")
BOUNCED = replace(DIRECT, bounces=2)


@pytest.fixture(scope="module", autouse=True)
def few_cells() -> Iterator[None]:
    """The same with fewer cells, in less time."""
    plain = Cells.of
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Cells, "of", staticmethod(lambda scene: plain(scene, 300)))
        yield


@pytest.fixture(scope="module")
def prep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scene = scenes.box_in_corner()
    return save_prep(tmp_path_factory.mktemp("prep") / "prep.npz", scene.vertices, scene.triangles, scene.normals)


@pytest.fixture(scope="module")
def folder(prep: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("bounced") / "conditions"
    conditions(prep, out, BOUNCED)
    return out


def test_with_bounces_there_are_more_files(prep: Path, folder: Path, tmp_path: Path) -> None:
    """Of those that there are without, geometry and lights hold the same; direct light is the same but for its noise."""
    conditions(prep, tmp_path / "direct", DIRECT)
    direct, bounced = fingerprint(tmp_path / "direct"), fingerprint(folder)
    images = {name for name in direct if name.endswith("geometry.exr") or name.startswith("environments")}
    assert len(images) == 4 and all(direct[name] == bounced[name] for name in images)
    for light in DIRECT.env:
        a, b = (read_exr(out / "view_000" / f"{light}.exr").channels["E.R"] for out in (tmp_path / "direct", folder))
        assert 0 < np.abs(a - b).mean() < 0.1 * a.mean() and a.mean() == pytest.approx(b.mean(), rel=0.02)
    assert set(bounced) - set(direct) == {"bounces.npz", "view_000/bounces.npz", "view_001/bounces.npz"}
    assert "bounces" not in read_manifest(tmp_path / "direct", CONDITIONS)[0].options


def test_an_interrupted_run_continues_to_the_same_bytes(prep: Path, folder: Path, tmp_path: Path) -> None:
    def stop(stage: str, done: int, total: int) -> None:
        if (stage, done) == ("views", 1):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        conditions(prep, tmp_path / "again", BOUNCED, progress=stop)
    result = conditions(prep, tmp_path / "again", BOUNCED)
    assert result.made + result.found == 2 and fingerprint(tmp_path / "again") == fingerprint(folder)
    assert conditions(prep, tmp_path / "again", BOUNCED).up_to_date


def test_what_is_convex_stores_nothing(tmp_path: Path) -> None:
    scene = scenes.sphere(3)
    made = save_prep(tmp_path / "prep.npz", scene.vertices, scene.triangles, scene.normals)
    conditions(made, tmp_path / "conditions", BOUNCED)
    assert not list((tmp_path / "conditions").rglob("bounces.npz"))
    assert read_manifest(tmp_path / "conditions", CONDITIONS)[0].extra["bounces"] == 0
    assert Views(tmp_path / "conditions").bounces is None


def test_ends_are_stored_as_they_are(folder: Path) -> None:
    """All but the directions of lobes bit for bit; those within half a step of 255 along the square."""
    stored = load_npz(folder / "view_000" / "bounces.npz", VIEW_BOUNCES).arrays
    ends = Ends.from_arrays(stored)
    again = ends.to_arrays()
    assert all((again[name] == stored[name]).all() for name in stored)
    assert len(ends.side) == ends.start[-1] and len(stored["far_onward"]) == ends.followed.sum() > ends.mirror.sum() > 0
    assert (ends.lobe == 0).sum() == ends.mirror.sum() and ends.lobe.max() == 3  # no more is known of wide lobes' rays
    assert ends.side.max() < len(load_npz(folder / "bounces.npz", BOUNCES)["direct"])


def test_crops_and_pools_are_lit_alike(folder: Path) -> None:
    """A red object throws red: on every pixel more than direct light, by both samplers the same to half precision."""
    views, device = Views(folder), torch.device("cpu")
    assert views.bounces is not None
    cells = views.bounces
    own = cells.solved(torch.tensor([[0.8, 0.05, 0.05, 0.6, 0.0]]).expand(len(cells.points), 5))
    sampler = CropSampler(views, 16, 1, device)
    sample = sampler.draw(torch.Generator().manual_seed(3))
    lit = sampler.with_own_light(own, sample)
    added = (lit.E - sample.transport.E.float()).mean(0)
    assert bool((sample.transport.E.float() <= lit.E).all()) and float(added[0]) > 3 * float(added[2]) > 0
    (view, environment), rows = sample.source[0], sample.where[0]
    pool = PixelSampler(views, 8, torch.Generator().manual_seed(0), device)
    pooled = pool.lit(views.seen.index(view), own)[1].E[environment :: len(views.environments)][rows]
    assert pooled.numpy() == pytest.approx(lit.E.numpy(), rel=2e-3, abs=1e-3)


def test_the_gradient_is_that_of_finite_differences(folder: Path) -> None:
    """Radiance by the receiver's albedo, roughness and metallic, with what the object throws on it."""
    views = Views(folder)
    assert views.bounces is not None
    own = views.bounces.solved(torch.tensor([[0.9, 0.6, 0.3, 0.5, 1.0]]).expand(len(views.bounces.points), 5))
    sampler = CropSampler(views, 16, 1, torch.device("cpu"))
    sample = sampler.draw(torch.Generator().manual_seed(1))
    lit = sampler.with_own_light(own, sample)
    values = torch.tensor([[0.5, 0.4, 0.3, 0.55, 0.4]]).repeat(len(sample.points), 1).requires_grad_()
    (gradient,) = torch.autograd.grad(shade(lit, Material.of(values)).sum(), values)
    for column, step in ((0, 1e-2), (3, 1e-2), (4, 1e-2)):
        moved = [values.detach().double() + sign * step * torch.eye(5, dtype=torch.float64)[column] for sign in (1, -1)]
        up, down = (shade(lit.to(torch.float64), Material.of(v)).sum(1) for v in moved)
        exact = ((up - down) / (2 * step)).numpy()
        error = np.sqrt(np.square(gradient[:, column].numpy() - exact).mean()) / np.sqrt(np.square(exact).mean())
        assert error < 0.02


@pytest.mark.parametrize("name", ["bounces.npz", "view_000/bounces.npz"])
@pytest.mark.parametrize("left", [0.0, 0.5], ids=["lost", "cut short"])
def test_a_damaged_file_is_told_in_one_line(
    folder: Path, tmp_path: Path, name: str, left: float, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    damaged = tmp_path / "conditions"
    shutil.copytree(folder, damaged)
    whole = (damaged / name).read_bytes()
    (damaged / name).unlink()
    if left:
        (damaged / name).write_bytes(whole[: int(left * len(whole))])
    asked = ["distill", damaged, "--prompt", "red clay", "-o", tmp_path / "m.npz", "--steps", "16", "--quiet"]
    monkeypatch.setattr(sys, "argv", ["dreammat", *map(str, asked)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 4
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1 and name in said[0]
    assert not (tmp_path / "m.npz").exists()


def test_an_environment_that_was_exchanged_is_refused(folder: Path, tmp_path: Path) -> None:
    """Another light under its name, whole in itself, is not what the views were lit by."""
    exchanged = tmp_path / "conditions"
    shutil.copytree(folder, exchanged)
    (exchanged / "environments" / "studio.exr").unlink()  # copies may share their bytes
    shutil.copy(folder / "environments" / "clear_sky.exr", exchanged / "environments" / "studio.exr")
    with pytest.raises(ArtifactError, match=r"environments/studio\.exr: damaged"):
        Views(exchanged)
