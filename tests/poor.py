"""doctor and a small run on machines where something is missing, which end in the same bytes unless kernels are compiled
afresh: python -m tests.poor"""

import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from dreammat_cli.doctor import EXTRAS
from tests.pipeline import cube_sphere, fingerprint, stages

ROOT = Path(__file__).resolve().parent.parent
GIB = 1 << 30

NO_HOME = {"HOME": "/proc/nowhere", "XDG_CACHE_HOME": "/proc/nowhere"}
NO_GPU = {"CUDA_VISIBLE_DEVICES": ""}


class Machine(NamedTuple):
    """What a process finds. environment: beside this one's. before: called in it, before all else. afresh: whether it compiles
    its kernels in every process, which may show in the last bit of a pixel and then in the third decimal of a material."""

    environment: dict[str, str]
    before: Callable[[], None] | None = None
    afresh: bool = False

    def call(self, *words: str) -> subprocess.CompletedProcess[str]:
        """dreammat there."""
        return subprocess.run(
            [sys.executable, "-m", "dreammat_cli", *words], capture_output=True, text=True, check=False, timeout=1800,
            cwd=self.environment.get("PYTHONPATH", "").split(os.pathsep)[0] or None,
            env=os.environ | self.environment, preexec_fn=self.before,
        )  # fmt: skip


def two_gib() -> None:
    """This process may take 2 GiB. The files that it maps do not count: the libraries of torch and others are 1.3 GiB more."""
    resource.setrlimit(resource.RLIMIT_DATA, (2 * GIB, 2 * GIB))


def without_extras(folder: Path) -> dict[str, str]:
    """No package of any extra can be imported. Args: folder: takes a file that sees to it."""
    modules = [module for module, _ in EXTRAS.values()]
    (folder / "sitecustomize.py").write_text(f"import sys\nsys.modules |= dict.fromkeys({modules})\n")
    return {"PYTHONPATH": os.pathsep.join([str(folder), *map(os.path.abspath, sys.path)])}


def read_only(folder: Path) -> dict[str, str]:
    """Neither beside the code nor at home can machine code be kept. Args: folder: takes a copy of the code."""
    for name in ("stages", "dreammat_cli"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for package in [path.parent for path in folder.rglob("*.py")]:
        (package / "__pycache__").write_text("")  # a file: no folder can be made in its place, whoever asks
    return {"PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1", **NO_HOME}


def poorest(folder: Path) -> Machine:
    """No GPU, no extras, 2 GiB, no home."""
    return Machine(NO_GPU | NO_HOME | without_extras(folder), two_gib)


def run_words(folder: Path) -> list[str]:
    """dreammat run of what `tests.pipeline.stages` does one by one."""
    commands, further = stages(folder), []
    for name, first in (("prep", "--texture-size"), ("conditions", "--views"), ("distill", "--steps"), ("bake", "--size")):
        further += ["--with", name, " ".join(commands[name][commands[name].index(first) :])]
    return ["run", str(folder / "mesh.obj"), "--prompt", "red plastic", "-o", str(folder), *further, "-q"]


def main() -> int:
    """Every machine by itself. Returns: how many fail."""
    failed, expected = 0, None
    with tempfile.TemporaryDirectory() as scratch:
        made = {name: Path(scratch) / name.replace(" ", "_") for name in ("all there", "no extras", "read only", "poorest")}
        for folder in made.values():
            folder.mkdir()
        machines = {
            "all there": Machine({}), "no GPU": Machine(NO_GPU), "no home": Machine(NO_HOME), "2 GiB": Machine({}, two_gib),
            "no extras": Machine(without_extras(made["no extras"])),
            "read only": Machine(read_only(made["read only"]), afresh=True),
            "poorest": poorest(made["poorest"]),
        }  # fmt: skip
        warm = Path(scratch) / "warm"
        warm.mkdir()
        cube_sphere(warm / "mesh.obj")
        Machine({}).call(*run_words(warm))  # compiles what all others load
        for name, machine in machines.items():
            begin, folder = time.perf_counter(), Path(scratch) / f"run of {name}"
            folder.mkdir()
            cube_sphere(folder / "mesh.obj")
            told = [machine.call("doctor"), machine.call(*run_words(folder))]
            wrong = [done.stderr for done in told if done.returncode]
            bytes_ = fingerprint(folder)
            expected = expected or bytes_
            other = sum(bytes_.get(file) != known for file, known in expected.items())
            state = f"ok, {other} files of other bytes" if other else "ok"
            if wrong or bytes_.keys() != expected.keys() or (other and not machine.afresh):
                failed += 1
                state = f"FAILED\n{''.join(wrong)[-2000:]}"
            print(f"{name}: {time.perf_counter() - begin:.0f} s, {state}", flush=True)
    return failed


if __name__ == "__main__":
    sys.exit(main())
