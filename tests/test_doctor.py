"""`dreammat doctor` where things are as they should be, and where they are not."""

import json
import os
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from dreammat_cli.doctor import EXTRAS

GIB = 1 << 30


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


@pytest.mark.skipif(not hasattr(resource, "RLIMIT_AS"), reason="needs a limit of memory")
def test_little_memory_is_told(tmp_path: Path) -> None:
    code, found, _ = doctor(tmp_path, before=lambda: resource.setrlimit(resource.RLIMIT_AS, (2 * GIB, 2 * GIB)))
    assert code in (0, 5)  # torch may not even load in it
    if found:
        assert float(found["memory"]["found"].split()[0]) <= 2 and "smaller --size" in found["memory"]["remedy"]
