"""Scanned materials: found in both layouts, laid without seams or repetition, with their own histogram at any footprint."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from dreammat_cli.main import cli
from stages.core.artifact import sha256_file
from stages.core.color import srgb_decode, srgb_encode
from stages.core.errors import InputError
from stages.core.images import read_image, write_png
from stages.material.library import Library
from stages.material.place import Place
from stages.material.scan import Scan, integrated, repeats
from stages.material.substances import LOOKS
from stages.prior.model import load_prior
from stages.prior.prompt import read_prompt

SIZE = 128


def smooth(seed: int, waves: int = 16) -> np.ndarray:
    """(SIZE, SIZE) a random tile of deviation 1 that holds nothing finer than some waves."""
    wave = np.fft.fftfreq(SIZE, 1 / SIZE)
    spectrum = np.fft.fft2(np.random.default_rng(seed).normal(size=(SIZE, SIZE)))
    tile = np.fft.ifft2(spectrum * np.exp(-0.5 * (wave[:, None] ** 2 + wave**2) / (waves / 2) ** 2)).real
    return (tile - tile.mean()) / tile.std()


def grey(path: Path, values: np.ndarray) -> None:
    write_png(path, np.repeat(np.clip(values, 0, 1)[..., None], 3, 2))


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Poly Haven's layout with packed maps, ambientCG's in a folder of its own, and what is neither."""
    folder = tmp_path_factory.mktemp("library")
    stain = smooth(1)[..., None] * (0.12, 0.06, 0.03) + (0.5, 0.3, 0.15)
    write_png(folder / "rust_coarse_01_diff_1k.png", np.clip(stain, 0, 1))
    packed = np.stack([np.ones((SIZE, SIZE)), np.clip(0.7 + 0.1 * smooth(1), 0, 1), np.zeros((SIZE, SIZE))], -1)
    write_png(folder / "rust_coarse_01_arm_1k.png", packed)
    write_png(folder / "rust_coarse_01_nor_gl_1k.png", np.full((SIZE, SIZE, 3), (0.5, 0.5, 1.0)))
    (folder / "LICENSE.txt").write_text("CC0")
    own = folder / "Bark014_1K-PNG"
    own.mkdir()
    write_png(own / "Bark014_1K-PNG_Color.png", np.clip(smooth(2)[..., None] * 0.1 + (0.35, 0.25, 0.2), 0, 1))
    grey(own / "Bark014_1K-PNG_Roughness.png", 0.85 + 0.05 * smooth(2))
    grey(own / "Bark014_1K-PNG_Displacement.png", 0.5 + 0.15 * smooth(2))
    grey(own / "preview.png", smooth(3))
    return folder


def test_sets_are_found_in_either_layout(library: Path) -> None:
    sets = Library(library).sets
    assert {name: set(s.maps) for name, s in sets.items()} == {
        "rust_coarse_01": {"color", "packed", "normal"}, "Bark014": {"color", "roughness", "height"},
    }  # fmt: skip
    assert sets["Bark014"].words == {"bark"} and sets["rust_coarse_01"].words == {"rust", "coarse"}
    told = sets["rust_coarse_01"].described()
    assert told["licence"] == "LICENSE.txt"
    assert told["files"]["rust_coarse_01_diff_1k.png"] == sha256_file(library / "rust_coarse_01_diff_1k.png")


def test_words_choose_a_set(library: Path) -> None:
    prior, scans = load_prior("cpu"), Library(library)
    rust, bark, oak = (read_prompt(words, prior, 0, library=scans).base for words in ("rusty iron", "tree bark", "oak"))
    assert rust.look.startswith("rust_coarse_01 ") and bark.look.startswith("Bark014 ") and oak.look == "oak"
    assert bark.color is not None and np.allclose(bark.color, (0.35, 0.25, 0.2), atol=0.04)
    assert bark.roughness == pytest.approx(0.85, abs=0.02)
    blue = read_prompt("blue bark", prior, 0, library=scans).base
    assert blue.look == bark.look and blue.color is not None and blue.color[2] > blue.color[0]
    assert read_prompt("oak", prior, 0, library=scans) == read_prompt("oak", prior, 0)


def place(count: int, metres: float, footprint: float, period: float = 0.0) -> Place:
    """A square of points."""
    at = (np.arange(count, dtype=np.float32) + 0.5) * np.float32(metres / count)
    u, v = (a.ravel() for a in np.meshgrid(at, at))
    points = np.stack([u, v, 0 * u])
    size = np.full(len(u), footprint, np.float32)
    return Place(points, points[:2], np.zeros(len(u), np.int32), size, (period, period, 0.0), 3)


def test_another_roughness_is_another_look(library: Path, tmp_path: Path) -> None:
    shutil.copytree(library, tmp_path / "copy")
    found = Library(tmp_path / "copy").sets["Bark014"]
    assert found.look == Library(library).sets["Bark014"].look
    shutil.copy(found.maps["color"], found.maps["roughness"])
    assert Library(tmp_path / "copy").sets["Bark014"].look != found.look


def test_a_scan_keeps_its_histogram_and_never_repeats(library: Path) -> None:
    found = Library(library).sets["rust_coarse_01"]
    look = Scan.read(found.maps, 1.0)
    assert look.back is not None
    laid = look(place(512, 6.0, 1 / SIZE)).color
    own = srgb_decode(read_image(found.maps["color"])[..., :3]).reshape(-1, 3).T
    levels = (0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.98)
    assert np.quantile(laid, levels, 1) == pytest.approx(np.quantile(own, levels, 1), rel=0.1, abs=0.01)
    tiles = laid[0].reshape(512, 512)
    spectrum = np.abs(np.fft.fft2(tiles - tiles.mean())) ** 2
    agrees = np.fft.ifft2(spectrum).real / (tiles.size * tiles.var())
    shift = 512 // 6
    assert abs(agrees[:, shift - 2 : shift + 3]).max() < 0.3, "it agrees with itself a tile away"


def test_a_scan_tiles_with_its_place_and_holds_nothing_finer_than_a_footprint(library: Path) -> None:
    look = Scan.read(Library(library).sets["rust_coarse_01"].maps, 1.0)
    color = look(place(256, 2.0, 2 / 256, period=2.0)).color[1].reshape(256, 256)
    for axis in (0, 1):
        inside = abs(np.diff(color, axis=axis)).mean()
        assert abs(np.take(color, 0, axis) - np.take(color, -1, axis)).mean() < 1.5 * inside
    fine, coarse = look(place(256, 2.0, 2 / 256, 2.0)).color, look(place(16, 2.0, 2 / 16, 2.0)).color
    assert coarse.mean(1) == pytest.approx(fine.mean(1), rel=0.05)
    averaged = fine.reshape(3, 16, 16, 16, 16).mean((2, 4))
    error = np.sqrt(((coarse.reshape(3, 16, 16) - averaged) ** 2).mean())
    assert error < 0.6 * averaged[0].std() and coarse.std(1).max() < fine.std(1).max()


def test_what_repeats_is_laid_as_it_is(tmp_path: Path) -> None:
    rows, columns = np.mgrid[:SIZE, :SIZE] // (SIZE // 8)
    board = 0.3 + 0.4 * ((rows + columns) % 2)
    grey(tmp_path / "tiles_01_Color.png", board)
    assert repeats(board) and not repeats(smooth(4))
    look = Scan.read(Library(tmp_path).sets["tiles_01"].maps, 1.0)
    laid = srgb_encode(look(place(SIZE, 1.0, 1 / SIZE)).color[0].reshape(SIZE, SIZE))
    assert abs(laid[::-1] - board).mean() < 0.02


def test_height_is_what_its_normals_are_of() -> None:
    height = 0.01 * smooth(5, 5)
    across = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) * SIZE / 2
    down = (np.roll(height, -1, 0) - np.roll(height, 1, 0)) * SIZE / 2
    normal = np.stack([-across, down, np.ones_like(height)], -1)
    stored = 0.5 + 0.5 * normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    assert integrated(stored) == pytest.approx(height - height.mean(), abs=2e-3 * np.ptp(height) + 1e-3)


def test_a_swatch_says_what_it_used(library: Path, tmp_path: Path) -> None:
    command = ["material", "rusty iron", "-o", str(tmp_path / "m"), "--size", "256", "--preview-size", "32", "--quiet"]
    result = CliRunner().invoke(cli, command, env={"DREAMMAT_LIBRARY": str(library)})
    assert result.exit_code == 0, result.output
    manifest = json.loads((tmp_path / "m" / "swatch.json").read_text())
    assert str(library) not in json.dumps(manifest)
    assert manifest["extra"]["library"]["rust_coarse_01"]["licence"] == "LICENSE.txt"
    assert any(name.startswith("library rust_coarse_01 ") for name in manifest["inputs"])


def test_a_library_that_is_none_is_one_line(tmp_path: Path, library: Path) -> None:
    with pytest.raises(InputError, match="not a folder"):
        Library(tmp_path / "none")
    with pytest.raises(InputError, match="no set of maps"):
        Library(tmp_path)
    (tmp_path / "rust_01_diff.png").write_bytes(b"no picture")
    with pytest.raises(InputError, match="not a readable picture"):
        Scan.read(Library(tmp_path).sets["rust_01"].maps, 1.0)
    missing = Library(library).restore({"oak", "rust_coarse_01 00000000"})
    assert missing == ["rust_coarse_01 00000000"]


REAL = Path(__file__).parents[3] / "shared" / "assets" / "materials"


@pytest.mark.skipif(not REAL.is_dir(), reason="no folder of real materials beside the repository")
def test_real_materials_are_found_and_laid() -> None:
    scans = Library(REAL)
    assert len(scans.sets) >= 40
    look = read_prompt("mossy rock", load_prior("cpu"), 0, library=scans)
    assert look.base.look.startswith("rock_") and look.layers[0].coat.look.startswith("moss_")
    color = LOOKS[look.base.look](place(128, 2.0, 2 / 128)).color
    assert np.isfinite(color).all() and color.std() > 0.01
