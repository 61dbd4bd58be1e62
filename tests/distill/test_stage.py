"""The distill stage end to end on a tiny sphere: it finds a known material, continues where it stopped, says what is wrong."""

import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from stages.core import parallel
from stages.core.artifact import load_npz, peek
from stages.core.errors import ArtifactError, InputError, NumericalError
from stages.core.schemas import MATERIAL
from stages.core.shading import Material
from stages.distill import checkpoint, stage
from stages.distill.guidance import reference
from stages.distill.guidance.base import Budget, Response
from stages.distill.options import DistillOptions, HoldOptions
from stages.distill.sampling import CropSampler, PixelSampler
from stages.distill.stage import distill
from stages.distill.views import Views
from stages.light.textured_model import TexturedModel
from stages.material.evaluate import evaluate
from stages.material.learnt import LearntMaterial
from stages.material.residual import Residual, combined
from tests.conftest import Golden
from tests.distill.examples import label_at, painted_sphere, write_conditions


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stage")
    write_conditions(folder / "conditions")
    painted_sphere(folder / "sphere.glb")
    return folder


@pytest.fixture(autouse=True)
def few_pixels(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reference, "PIXELS", 128)


def options(folder: Path, **changes: object) -> DistillOptions:
    chosen = {"guidance": "reference", "reference": folder / "sphere.glb", "steps": 12, **changes}
    return DistillOptions(**chosen)  # type: ignore[arg-type]


def interrupt_at(step: int, action: Callable[[], None]) -> Callable[[str, int, int], None]:
    def progress(what: str, done: int, total: int) -> None:
        if what.startswith("distill") and done == step:
            action()

    return progress


def ctrl_c() -> None:
    raise KeyboardInterrupt


def test_quality_multiplies_the_steps_and_steps_replace_it() -> None:
    called_for = Budget(steps=250, learning_rate=0.01)

    def steps(**chosen: object) -> int:
        return stage.chosen_budget(DistillOptions(**chosen), called_for).steps  # type: ignore[arg-type]

    assert [steps(quality=quality) for quality in ("draft", "standard", "high")] == [62, 250, 1000]
    assert steps(quality="high", steps=7) == 7
    assert stage.chosen_budget(DistillOptions(learning_rate=0.5), called_for).learning_rate == 0.5


def learnt_at(path: Path, points: torch.Tensor) -> Material:
    """The material of points (P, 3) by material.npz, the normals of a sphere's."""
    learnt = LearntMaterial.of(path, load_npz(path, MATERIAL))
    normals, footprint = torch.nn.functional.normalize(points), np.full(len(points), 1e-3, "f4")
    surface = learnt.lookup.surface(points.numpy(), normals.numpy(), footprint, label_at(points.numpy()))
    base = torch.from_numpy(evaluate(learnt.recipe, surface)[:, :5])
    return Material.of(combined(base, Residual.of(learnt.residual)(points)))


def test_golden(folder: Path, tmp_path: Path, golden: Golden) -> None:
    out = tmp_path / "material.npz"
    result = distill(folder / "conditions", out, options(folder, hold=HoldOptions(smoothness=0.1)))
    material = load_npz(out, MATERIAL)
    found = learnt_at(out, torch.rand(64, 3, generator=torch.Generator().manual_seed(0)) - 0.5)
    assert result.steps == 12 and not result.up_to_date
    arrays = {"albedo": found.albedo, "roughness": found.roughness, "metallic": found.metallic}
    # Adam divides by the gradient's size, so rounding differences of processors grow with the steps
    found_values = {name: value.detach().numpy() for name, value in arrays.items()}
    golden.check("distill/sphere", found_values | {"loss": material["curve_loss"]}, atol=2e-3)


def test_finds_the_known_material(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "material.npz"
    distill(folder / "conditions", out, options(folder, steps=400))
    views = Views(folder / "conditions")
    seen = [views.surface(view, np.arange(len(views.pixels(view)))).points for view in views.seen]
    points = torch.cat(seen)
    eyes = np.repeat(views.c2w[views.seen, :3, 3], [len(s) for s in seen], 0)
    truth, _ = TexturedModel(folder / "sphere.glb", np.eye(4)).material_at(points.numpy(), eyes)
    away = abs(points[:, 2].numpy()) > 0.06  # the step between dielectric and metal is finer than the views
    found = learnt_at(out, points)
    roughness = found.roughness.detach().numpy()[:, None]
    error = np.concatenate([found.albedo.detach().numpy(), roughness], 1) - truth[:, :4]
    assert np.sqrt((error[away, :3] ** 2).mean()) < 0.025
    assert np.sqrt((error[away, 3] ** 2).mean()) < 0.03
    assert np.sqrt(((found.metallic.detach().numpy() - truth[:, 4])[away] ** 2).mean()) < 0.05


def terminate_twice() -> None:
    """As timeout(1) does, which signals the process and then its group."""
    os.kill(os.getpid(), signal.SIGTERM)
    os.kill(os.getpid(), signal.SIGTERM)


@pytest.mark.parametrize("action", [ctrl_c, terminate_twice])
def test_interrupted_run_ends_in_the_same_bytes(folder: Path, tmp_path: Path, action: Callable[[], None]) -> None:
    whole, broken = tmp_path / "whole.npz", tmp_path / "broken.npz"
    chosen = options(folder, hold=HoldOptions(smoothness=0.1))
    distill(folder / "conditions", whole, chosen)
    for step in (1, 5, 11):
        with pytest.raises(KeyboardInterrupt):
            distill(folder / "conditions", broken, chosen, progress=interrupt_at(step, action))
        assert checkpoint.checkpoint_path(broken).is_file() and not broken.exists()
    result = distill(folder / "conditions", broken, chosen)
    assert result.resumed == 11
    assert whole.read_bytes() == broken.read_bytes()
    assert not checkpoint.checkpoint_path(broken).exists()


def test_killed_run_continues_from_its_last_checkpoint(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A kill that leaves no time to save: only the checkpoints made on the way remain."""

    class Killed(BaseException):
        pass

    def die() -> None:
        raise Killed

    monkeypatch.setattr(checkpoint, "SECONDS", 0.0)
    whole, broken = tmp_path / "whole.npz", tmp_path / "broken.npz"
    distill(folder / "conditions", whole, options(folder))
    with pytest.raises(Killed):
        distill(folder / "conditions", broken, options(folder), progress=interrupt_at(7, die))
    assert distill(folder / "conditions", broken, options(folder)).resumed == 6
    assert whole.read_bytes() == broken.read_bytes()


def test_a_run_killed_at_its_very_end_leaves_nothing_undone(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whichever of its files is the last one: another run must find that it has to write the rest."""
    names = ("material.npz", "material.curve.csv", "material.preview.png")
    whole, broken = tmp_path / "whole" / names[0], tmp_path / "broken" / names[0]
    distill(folder / "conditions", whole, options(folder))
    for killed in ("_preview", "_write"):
        real = getattr(stage, killed)

        def dies(run: stage.Run, real: Callable[[stage.Run], None] = real) -> None:
            if run.state.step == run.budget.steps:
                raise KeyboardInterrupt
            real(run)

        monkeypatch.setattr(stage, killed, dies)
        with pytest.raises(KeyboardInterrupt):
            distill(folder / "conditions", broken, options(folder))
        monkeypatch.setattr(stage, killed, real)
        distill(folder / "conditions", broken, options(folder))
        assert all((whole.parent / name).read_bytes() == (broken.parent / name).read_bytes() for name in names[::2])
        broken.unlink()


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 half a file", None])
def test_foreign_or_damaged_checkpoint_is_not_continued(folder: Path, tmp_path: Path, damage: bytes | None) -> None:
    out, fresh = tmp_path / "material.npz", tmp_path / "fresh.npz"
    with pytest.raises(KeyboardInterrupt):
        first = options(folder, seed=0 if damage is not None else 9)
        distill(folder / "conditions", out, first, progress=interrupt_at(5, ctrl_c))
    if damage is not None:
        checkpoint.checkpoint_path(out).write_bytes(damage)
    assert distill(folder / "conditions", out, options(folder)).resumed == 0
    distill(folder / "conditions", fresh, options(folder))
    assert out.read_bytes() == fresh.read_bytes()


def test_up_to_date_until_something_changes(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "material.npz"
    distill(folder / "conditions", out, options(folder, steps=3))
    written = out.stat().st_mtime_ns
    assert distill(folder / "conditions", out, options(folder, steps=3)).up_to_date
    assert out.stat().st_mtime_ns == written
    assert not distill(folder / "conditions", out, options(folder, steps=3), force=True).up_to_date
    assert not distill(folder / "conditions", out, options(folder, steps=4)).up_to_date


def test_other_seed_other_result(folder: Path, tmp_path: Path) -> None:
    outs = [tmp_path / f"{seed}.npz" for seed in (0, 1)]
    for seed, out in enumerate(outs):
        distill(folder / "conditions", out, options(folder, steps=3, seed=seed))
    a, b = (load_npz(out, MATERIAL) for out in outs)
    assert not np.array_equal(a["table"], b["table"])


def test_writes_curve_and_preview_beside(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "spot.npz"
    distill(folder / "conditions", out, options(folder, steps=3))
    lines = (tmp_path / "spot.curve.csv").read_text().splitlines()
    assert lines[0] == "step,seconds,loss" and [line.split(",")[0] for line in lines[1:]] == ["1", "2", "3"]
    assert (tmp_path / "spot.preview.png").stat().st_size > 500
    made = peek(out, MATERIAL)
    assert made is not None
    assert made.extra["guidance"]["name"] == "reference"
    assert set(made.inputs) == {"conditions", "prep", "reference"}


def test_users_mistakes_are_one_line(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "material.npz"
    cases = [
        (DistillOptions(guidance="reference"), "--guidance reference: no model"),
        (DistillOptions(guidance="prior", prompt=" "), "--prompt: empty"),
        (DistillOptions(guidance="magic"), "--guidance magic: unknown"),
        (options(folder, steps=0), "--steps 0"),
        (options(folder, device="abacus"), "--device abacus"),
    ]
    for chosen, message in cases:
        with pytest.raises(InputError) as caught:
            distill(folder / "conditions", out, chosen)
        assert message in str(caught.value) and "\n" not in str(caught.value)
    with pytest.raises(ArtifactError):
        distill(folder, out, options(folder))
    assert list(tmp_path.iterdir()) == []


def test_non_finite_gradient_names_step_and_seed(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def nonsense(self, radiance, sample, progress, generator):  # type: ignore[no-untyped-def]
        return Response(radiance * (float("nan") if progress > 0.5 else 0.0), 0.0)

    monkeypatch.setattr(reference.ReferenceGuidance, "respond", nonsense)
    out = tmp_path / "material.npz"
    with pytest.raises(NumericalError, match=r"step 7: .*seed 0"):
        distill(folder / "conditions", out, options(folder))
    assert not out.exists()


def test_per_step_cost_is_in_the_run_log(folder: Path, tmp_path: Path) -> None:
    clock = stage.Clock()
    for _ in range(3):
        with clock("shading"):
            pass
    assert set(clock.per_step(3)) == {"shading"} and clock.per_step(3)["shading"] >= 0
    out = tmp_path / "material.npz"
    distill(folder / "conditions", out, options(folder, steps=2))
    log = (tmp_path / "material.npz.run.json").read_text()
    assert all(part in log for part in ("data", "recipe", "residual", "shading", "guidance", "backward", "optimiser"))


@pytest.mark.parametrize("guidance", ["prior", "reference"])
def test_bytes_do_not_depend_on_the_number_of_threads(
    guidance: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor does torch ever work on more than one, on whatever thread of ours it is called: its own spin while they wait."""
    seen, by_torch = set(), torch.get_num_threads()
    drawn = CropSampler.draw if guidance == "prior" else PixelSampler.draw

    def draw(self: Any, generator: torch.Generator) -> Any:
        seen.add((threading.current_thread() is threading.main_thread(), torch.get_num_threads()))
        return drawn(self, generator)

    monkeypatch.setattr(CropSampler if guidance == "prior" else PixelSampler, "draw", draw)
    written = []
    for threads in (1, 2, 3):
        monkeypatch.setattr(parallel, "cores", lambda threads=threads: threads)
        torch.set_num_threads(threads)
        out, told = tmp_path / f"{threads}.npz", list[str]()
        chosen = options(folder, guidance=guidance, prompt="oak with a gold base", steps=5, hold=HoldOptions(smoothness=0.1))
        distill(folder / "conditions", out, chosen, tell=told.append)
        assert told[:2] == (["oak: everywhere", "gold: lowest 20 % (base)"] if guidance == "prior" else [])
        assert all(": moved " in line for line in told[2:])
        assert torch.get_num_threads() == threads
        written.append(out.read_bytes())
    torch.set_num_threads(by_torch)
    assert written[0] == written[1] == written[2]
    assert seen == {(False, 1)}
