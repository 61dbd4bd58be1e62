"""All four stages through the command line: killed at random moments and run again, they end in the same output."""

import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests import campaign
from tests.pipeline import cube_sphere, fingerprint, stages


def heed_interrupts() -> None:
    """A shell's background jobs, and so this test's process, may have been told to ignore Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def start(arguments: list[str]) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "dreammat_cli", *arguments, "-q"]
    return subprocess.Popen(command, stderr=subprocess.PIPE, preexec_fn=heed_interrupts)


def run(arguments: list[str]) -> float:
    """Run to the end. Returns: seconds."""
    begin = time.perf_counter()
    process = start(arguments)
    _, error = process.communicate(timeout=300)
    assert process.returncode == 0, error.decode()
    return time.perf_counter() - begin


def kill_after(arguments: list[str], seconds: float, how: signal.Signals) -> int:
    """Run, send a signal after some seconds. Returns: the exit code."""
    process = start(arguments)
    try:
        process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        process.send_signal(how)
        process.communicate(timeout=120)
    return process.returncode


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
        command = [sys.executable, "-m", "dreammat_cli", *arguments]
        result = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
        assert "up to date" in result.stdout
    assert fingerprint(whole[0]) == before


def test_one_call_gives_the_same_bytes(whole: tuple[Path, dict[str, float]], tmp_path: Path) -> None:
    folder = tmp_path / "it's #1 (50%)"
    folder.mkdir()
    shutil.copy(whole[0] / "mesh.obj", folder)
    commands = stages(folder)
    further = []
    for name, first in (("prep", "--texture-size"), ("conditions", "--views"), ("distill", "--steps"), ("bake", "--size")):
        options = commands[name][commands[name].index(first) :]
        further += ["--with", name, " ".join(options)]
    run(["run", str(folder / "mesh.obj"), "--prompt", "red plastic", "-o", str(folder), *further])
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
    cube_sphere(tmp_path / "mesh.obj")
    run(stages(tmp_path)["prep"])
    process = start([*stages(tmp_path)["conditions"], "--views", "2000"])
    deadline = time.monotonic() + 120
    while not (tmp_path / "conditions" / "view_001").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=60)
    assert process.returncode == 130
    assert error.decode().strip() == "error: interrupted; the same command continues where it stopped"


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
