"""The wheel of this tree, installed apart from it, holds all that it needs and goes from a mesh to textures.

Other packages are those of the running environment, so that nothing is downloaded.
"""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("stages", "dreammat_cli")

STAGES = """
import sys, stages, dreammat_cli
from dreammat_cli.main import cli
site = sys.argv[1]
assert all(path.startswith(site) for path in (*stages.__path__, *dreammat_cli.__path__)), (stages.__path__, site)
for command in (
    "prep mesh.obj -o prep.npz --texture-size 512",
    "conditions prep.npz -o conditions --views 1 --size 32 --env studio --quality draft",
    "distill conditions --prompt copper --steps 1 -o material.npz",
    "bake prep.npz material.npz -o asset --size 512 --supersample 1",
):
    cli(command.split(), standalone_mode=False)
"""


def sources() -> list[Path]:
    """Every file of the packages, relative to the tree."""
    files = [path for package in PACKAGES for path in (ROOT / package).rglob("*") if path.is_file()]
    return [path.relative_to(ROOT) for path in files if "__pycache__" not in path.parts]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from a copy: setuptools leaves things behind, and takes up what it has left."""
    copy, out = tmp_path_factory.mktemp("tree"), tmp_path_factory.mktemp("wheel")
    for path in [*sources(), *map(Path, ("pyproject.toml", "README.md", "LICENSE"))]:
        (copy / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / path, copy / path)
    build = "from setuptools.build_meta import build_wheel; import sys; build_wheel(sys.argv[1])"
    subprocess.run([sys.executable, "-c", build, out], cwd=copy, check=True, capture_output=True)
    (built,) = out.glob("dreammat-*.whl")
    return built


def test_holds_every_file_of_the_packages(wheel: Path) -> None:
    held = {name for name in zipfile.ZipFile(wheel).namelist() if name.split("/")[0] in PACKAGES}
    assert held == {path.as_posix() for path in sources()}
    assert {"stages/core/albedo.npy", "stages/sd/filmic.csv", "stages/prior/weights/prior.npz"} <= held


def test_asks_for_a_range_of_torch(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        lines = archive.read(name).decode().splitlines()
    (torch,) = (line.removeprefix("Requires-Dist: torch") for line in lines if line.startswith("Requires-Dist: torch<"))
    assert ">=" in torch and "==" not in torch


def test_runs_the_four_stages_without_the_clone(wheel: Path, tmp_path: Path) -> None:
    site = tmp_path / "site"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    for path in sources():  # machine code that other tests have compiled is good for sources of the same time
        shutil.copystat(ROOT / path, site / path)
        for code in (ROOT / path).parent.glob(f"__pycache__/{path.stem}.*.nb?"):
            (site / path).parent.joinpath("__pycache__").mkdir(exist_ok=True)
            shutil.copy2(code, (site / path).parent / "__pycache__")
    (tmp_path / "mesh.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    environment = {**os.environ, "PYTHONPATH": str(site), "PYTHONNOUSERSITE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", STAGES, str(site)], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "asset" / "model.glb").is_file() and (tmp_path / "asset" / "albedo.png").is_file()
