"""`dreammat doctor` where things are as they should be, and where they are not."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from dreammat_cli import main
from dreammat_cli.doctor import EXTRAS
from tests.poor import read_only, two_gib


def doctor(cwd: Path, name: str = "", source: str = "", before: Callable[[], None] | None = None) -> tuple[int, dict, str]:
    """Run it, with a module of that name and source before all others. Returns: exit code, finding by name, stderr."""
    (cwd / f"{name}.py").write_text(source)
    paths = os.pathsep.join([str(cwd), *sys.path])
    home = {"HOME": "/proc/nowhere", "XDG_CACHE_HOME": "/proc/nowhere", "CUDA_VISIBLE_DEVICES": ""}
    result = subprocess.run(
        [sys.executable, "-m", "dreammat_cli", "doctor", "--json"],
        capture_output=True, text=True, cwd=cwd, preexec_fn=before, timeout=300, env=os.environ | home | {"PYTHONPATH": paths},
    )  # fmt: skip
    findings = json.loads(result.stdout)["findings"] if result.stdout else []
    return result.returncode, {finding["what"]: finding for finding in findings}, result.stderr


def test_a_machine_without_gpu_extras_and_home_is_fine(tmp_path: Path) -> None:
    modules = [module for module, _ in EXTRAS.values()]
    code, found, error = doctor(tmp_path, "sitecustomize", f"import sys\nsys.modules |= dict.fromkeys({modules})")
    assert code == 0, error
    assert all(found[f"[{extra}]"]["state"] == "-" and extra in found[f"[{extra}]"]["remedy"] for extra in EXTRAS)
    assert found["GPU"]["state"] == "-"
    assert all(found[f"test of {what}"]["state"] == "ok" for what in ("Embree", "torch", "OpenEXR", "numba"))


def test_a_broken_package_is_named_with_its_remedy(tmp_path: Path) -> None:
    code, found, error = doctor(tmp_path, "xatlas", "raise OSError('libxatlas.so: wrong ELF class')")
    assert code == 5
    assert found["xatlas"]["state"] == "WRONG" and "wrong ELF class" in found["xatlas"]["found"]
    assert found["xatlas"]["remedy"] == "pip install --force-reinstall xatlas"
    assert error.count("\n") == 1 and "xatlas" in error


def test_little_memory_is_told(tmp_path: Path) -> None:
    code, found, error = doctor(tmp_path, before=two_gib)
    assert code == 0, error
    assert float(found["memory"]["found"].split()[0]) <= 2 and "smaller --size" in found["memory"]["remedy"]


def test_code_that_cannot_be_written_beside_is_compiled_all_the_same(tmp_path: Path) -> None:
    """`make poor` runs all stages so; here every module is only imported, which is where numba looks for a folder."""
    there = os.environ | read_only(tmp_path)
    names = "[m.name for m in pkgutil.walk_packages(stages.__path__, 'stages.') if not m.name.endswith('_worker')]"
    code = f"import importlib, pkgutil, stages\nfor name in {names}: importlib.import_module(name)\nprint(stages.__path__[0])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=there, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str(tmp_path / "stages")


def test_a_signal_that_meets_a_package_being_loaded_is_a_signal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def call(**_: object) -> None:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as signal:
            raise ImportError("initialization failed") from signal  # as pybind11 does

    monkeypatch.setattr(main, "cli", call)
    with pytest.raises(SystemExit) as ended:
        main.main()
    assert ended.value.code == 130 and capsys.readouterr().err == f"error: {main.STOPPED}\n"


@pytest.mark.parametrize(
    ("raised", "words"),
    [
        ("MemoryError()", ["out of memory", "--views"]),
        ("RuntimeError(\"DefaultCPUAllocator: can't allocate memory: you tried to allocate 8 bytes\")", ["out of memory"]),
        ("ImportError('libtorch_cpu.so: failed to map segment', name='torch')", ["torch cannot be loaded", "doctor"]),
    ],
)
def test_what_a_poor_machine_cannot_do_is_one_line(
    raised: str, words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def call(**_: object) -> None:
        raise eval(raised)

    monkeypatch.setattr(main, "cli", call)
    with pytest.raises(SystemExit) as ended:
        main.main()
    error = capsys.readouterr().err
    assert ended.value.code == 5 and error.count("\n") == 1
    assert all(word in error for word in words)
