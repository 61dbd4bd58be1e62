"""All four stages through the command line: killed at random moments and run again, they end in the same output."""

import random
import resource
import shutil
import signal
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from dreammat_cli.main import cli
from tests import campaign
from tests.pipeline import cube_sphere, fingerprint, stages
from tests.poor import poorest, run_words
from tests.processes import Command


def run(arguments: list[str]) -> float:
    """Run to the end. Returns: seconds."""
    begin = time.perf_counter()
    result = Command([*arguments, "-q"]).done()
    assert result and result.returncode == 0, result
    return time.perf_counter() - begin


def kill_after(arguments: list[str], seconds: float, how: signal.Signals) -> None:
    """Run, send a signal after some seconds, and wait for the end."""
    command = Command([*arguments, "-q"])
    if command.done(seconds) is None:
        command.send(how)
        assert command.done(120)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, float]]:
    """A folder that an undisturbed run filled, and the seconds of each stage."""
    folder = tmp_path_factory.mktemp("whole")
    cube_sphere(folder / "mesh.obj")
    return folder, {name: run(arguments) for name, arguments in stages(folder).items()}


def test_the_asset_is_complete(whole: tuple[Path, dict[str, float]]) -> None:
    names = {p.name for p in (whole[0] / "asset").iterdir()}
    assert names >= {
        "albedo.exr", "roughness.exr", "metallic.exr", "albedo.png", "orm.png", "model.glb", "model.obj", "model.mtl",
        "preview.png", "preview.json", "preview_light.exr", "mesh.npz", "bake.json",
    }  # fmt: skip


def test_every_stage_is_then_up_to_date(whole: tuple[Path, dict[str, float]]) -> None:
    before = fingerprint(whole[0])
    for arguments in stages(whole[0]).values():
        result = CliRunner().invoke(cli, arguments)
        assert result.exit_code == 0 and "up to date" in result.stdout
    assert fingerprint(whole[0]) == before


def test_one_call_gives_the_same_bytes_on_a_poor_machine(whole: tuple[Path, dict[str, float]], tmp_path: Path) -> None:
    """Without GPU, extras and home, in 2 GiB; `make poor` takes each away by itself, and the kernels' cache too."""
    folder = tmp_path / "it's #1 (50%)"
    folder.mkdir()
    shutil.copy(whole[0] / "mesh.obj", folder)
    done = poorest(tmp_path).call(*run_words(folder))
    assert done.returncode == 0, done.stderr
    assert fingerprint(folder) == fingerprint(whole[0])


def test_killed_at_random_and_run_again_ends_in_the_same_bytes(
    whole: tuple[Path, dict[str, float]], tmp_path: Path
) -> None:
    reference, seconds = whole
    cube_sphere(tmp_path / "mesh.obj")
    dice = random.Random(20)
    for name, arguments in stages(tmp_path).items():
        asked = dice.choice([signal.SIGINT, signal.SIGTERM])
        for how in (signal.SIGKILL, asked) if name in ("conditions", "distill") else [asked]:  # these two have a state
            kill_after(arguments, seconds[name] * dice.uniform(0.2, 0.95), how)
        run(arguments)
    assert fingerprint(tmp_path) == fingerprint(reference)


def test_an_interrupt_says_how_to_go_on(whole: tuple[Path, dict[str, float]], tmp_path: Path) -> None:
    shutil.copy(whole[0] / "prep.npz", tmp_path)
    command = Command([*stages(tmp_path)["conditions"], "--views", "2000", "-q"])
    deadline = time.monotonic() + 120
    while not (tmp_path / "conditions" / "view_001").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    command.send(signal.SIGINT)
    result = command.done(60)
    assert result and result.returncode == 130
    assert result.stderr.strip() == "error: interrupted; the same command continues where it stopped"


def test_damaged_artefacts_are_refused_in_one_line_or_read_alike(
    whole: tuple[Path, dict[str, float]], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The first part of `make campaign`, which also runs whole stages on damaged artefacts."""
    reference = tmp_path / "reference"
    shutil.copytree(whole[0], reference)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    ends, faults = campaign.read_all(reference, 300, seed=1)
    assert faults == []
    assert ends["refused"] > 150
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1 << 20  # KiB
    assert capfd.readouterr().err == ""
