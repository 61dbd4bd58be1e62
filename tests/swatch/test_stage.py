"""Swatches: a folder of maps that tile, said what was understood, the same bytes again, errors in one line."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from dreammat_cli.main import cli
from stages.core.artifact import read_exr
from stages.core.errors import InputError
from stages.core.images import read_image
from stages.material.relief import gentle
from stages.swatch.kernels import shrunk, tile_normals
from stages.swatch.options import SwatchOptions
from stages.swatch.stage import make_swatch

SMALL = {"size": 256, "preview_size": 32}


@pytest.fixture(scope="module")
def bricks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("swatch") / "brick"
    made = make_swatch(folder, SwatchOptions("red brick with moss", **SMALL))  # type: ignore[arg-type]
    assert not made.up_to_date and set(made.files) == {p.name for p in folder.iterdir()} - {"swatch.json", "run.json"}
    return folder


def test_maps_are_there_and_tile(bricks: Path) -> None:
    albedo = read_image(bricks / "albedo.png")
    assert albedo.shape == (256, 256, 3)
    for axis in (0, 1):
        inside = abs(np.diff(albedo, axis=axis)).mean()
        around = abs(np.take(albedo, 0, axis) - np.take(albedo, -1, axis)).mean()
        assert around < 2.5 * inside
    height, normal = read_exr(bricks / "height.exr").channels["Y"], read_exr(bricks / "normal.exr").channels
    assert np.ptp(height) > 0 and set(normal) == {"R", "G", "B"}
    assert read_image(bricks / "preview.png").shape[:2] == (96, 96)


def test_it_says_what_was_understood(bricks: Path) -> None:
    report = json.loads((bricks / "swatch.json").read_text())["extra"]
    assert [row["look"] for row in report["understood"]][:2] == ["brick", "moss"]
    assert report["metres"] > 0.5


def test_the_same_request_is_up_to_date_and_another_seed_is_not(bricks: Path, tmp_path: Path) -> None:
    asked = SwatchOptions("red brick with moss", **SMALL)  # type: ignore[arg-type]
    assert make_swatch(bricks, asked).up_to_date
    again = make_swatch(tmp_path / "again", asked)
    other = make_swatch(tmp_path / "other", SwatchOptions("red brick with moss", seed=1, **SMALL))  # type: ignore[arg-type]
    for name in ("albedo.png", "normal.exr"):
        assert (again.folder / name).read_bytes() == (bricks / name).read_bytes() != (other.folder / name).read_bytes()


def test_a_material_of_known_words_needs_no_tensors(tmp_path: Path) -> None:
    """Two seconds of torch's import would be a fifth of the command's time."""
    make = f"make_swatch(Path({str(tmp_path / 'steel')!r}), SwatchOptions('brushed steel', size=256, preview_size=32))"
    code = f"from tests.swatch.test_stage import *; {make}; print([m for m in ('torch',) if m in sys.modules])"
    run = subprocess.run([sys.executable, "-c", f"import sys; {code}"], capture_output=True, text=True, check=True)
    assert run.stdout == "[]\n"


def test_normals_lean_away_from_a_slope() -> None:
    height = np.tile(np.sin(2 * np.pi * np.arange(64) / 64).astype(np.float32) / 100, (64, 1))
    normal = tile_normals(height, np.full_like(height, 0.5))
    assert normal[0, 0, 0] < -0.05 and normal[0, 32, 0] > 0.05 and abs(normal[..., 1]).max() < 1e-6


def test_normals_and_means_are_those_of_the_obvious_form() -> None:
    rng = np.random.default_rng(0)
    height = rng.normal(0, 0.01, (96, 96)).astype(np.float32)  # steeper than what is shown, here and there
    slope = np.stack([np.roll(height, -1, 1) - np.roll(height, 1, 1), np.roll(height, 1, 0) - np.roll(height, -1, 0)], -1) * 48
    leaning = np.concatenate([-gentle(slope), np.ones((96, 96, 1))], -1)
    leaning /= np.linalg.norm(leaning, axis=-1, keepdims=True)
    np.testing.assert_allclose(tile_normals(height, np.full_like(height, 0.5)), leaning, atol=3e-6)
    maps = rng.random((96, 96, 6)).astype(np.float32)[..., :5]
    blocks = maps[:95, :95].reshape(19, 5, 19, 5, 5).mean((1, 3))
    np.testing.assert_allclose(shrunk(maps, 19), blocks, atol=1e-6)
    np.testing.assert_allclose(shrunk(maps, 18), np.delete(np.delete(blocks, 18, 0), 18, 1), atol=1e-6)


@pytest.mark.parametrize("wrong", [{"prompt": " "}, {"size": 300}, {"metres": 0.0}, {"preview_size": 1}])
def test_wrong_options_are_named(wrong: dict) -> None:
    with pytest.raises(InputError, match=r"expected|empty"):
        SwatchOptions(**{"prompt": "oak", **wrong})


def test_the_command_makes_it(tmp_path: Path) -> None:
    arguments = ["material", "brushed steel", "-o", str(tmp_path / "steel"), "--size", "256", "--preview-size", "32"]
    result = CliRunner().invoke(cli, arguments)
    assert result.exit_code == 0 and "brushed steel: everywhere" in result.stdout
