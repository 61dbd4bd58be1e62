"""A baked asset against its own model, against another, and against a thing of another shape."""

import json
from pathlib import Path

import pytest
import trimesh
from click.testing import CliRunner

from dreammat_cli.main import cli
from stages.bake.options import BakeOptions
from stages.bake.stage import bake
from stages.core.errors import InputError
from stages.core.images import read_image
from stages.report.options import TransfersReportOptions
from stages.report.transfer import report_transfer
from stages.report.transfers import report_transfers
from tests.bake.examples import constant, cube, save_material, save_prep

LEFT, RIGHT = (0.5, 0.3, 0.1, 0.4, 0.1), (0.5, 0.3, 0.2, 0.6, 0.9)


@pytest.fixture(scope="module")
def assets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("transfer")
    save_prep(folder / "prep.npz", cube())
    for name, values in (("left", LEFT), ("right", RIGHT)):
        save_material(folder / f"{name}.npz", folder / "prep.npz", constant(values))
        bake(folder / "prep.npz", folder / f"{name}.npz", folder / name, BakeOptions(512, 1, 64, 8))
    return folder


def test_an_asset_is_its_own_model_but_for_eight_bits(assets: Path) -> None:
    found = report_transfer(assets / "prep.npz", assets / "left.npz", assets / "left", assets / "left" / "model.glb")
    assert found.texels > 1000 and found.albedo_linear_db > 45 and found.albedo_srgb_db > 45
    assert found.roughness_rmse < 0.003 and found.metallic_rmse < 0.003


def test_errors_are_those_of_the_maps(assets: Path) -> None:
    command = ["report", "transfer", *(str(assets / name) for name in ("prep.npz", "left.npz", "left")), "--json"]
    result = CliRunner().invoke(cli, [*command, "--reference", str(assets / "right" / "model.glb")])
    found = json.loads(result.stdout)
    assert found["albedo_linear_db"] == pytest.approx(24.8, abs=0.2)  # 0.1 in one channel of three, 0.2 being 124 of 255
    assert found["roughness_rmse"] == pytest.approx(0.2, abs=0.003)
    assert found["metallic_rmse"] == pytest.approx(0.8, abs=0.003)


def test_another_shape_is_refused(assets: Path, tmp_path: Path) -> None:
    model = trimesh.load(assets / "left" / "model.glb")
    model.apply_scale(1.5)
    model.export(tmp_path / "large.glb")
    with pytest.raises(InputError, match="nowhere near"):
        report_transfer(assets / "prep.npz", assets / "left.npz", assets / "left", tmp_path / "large.glb")


def test_a_folder_of_models_gives_a_table_and_a_picture(assets: Path, tmp_path: Path) -> None:
    models, out = tmp_path / "models", tmp_path / "out"
    models.mkdir()
    (models / "gold.glb").write_bytes((assets / "right" / "model.glb").read_bytes())
    command = ["report", "transfer", str(models), "-o", str(out), "--json"]
    command += ["--views", "3", "--size", "24", "--steps", "150", "--texture", "512"]
    result = CliRunner().invoke(cli, command)
    (row,) = json.loads(result.stdout)["rows"]
    assert row["model"] == "gold" and row["exact"] and row["albedo_linear_db"] > 30
    assert row["roughness_rmse"] < 0.05 and row["metallic_rmse"] < 0.08 and row["cpu_seconds"] > 0
    assert (out / "transfer.csv").read_text().count("\n") == 2
    picture = read_image(out / "transfer.png")
    above, below = picture[:24], picture[24:]
    assert picture.shape == (48, 96, 3) and float(abs(above - below).mean()) < 0.02 < float(picture.std())
    made = (out / "gold" / "material.npz").stat().st_mtime_ns
    again = CliRunner().invoke(cli, command)
    assert json.loads(again.stdout)["rows"] == [row] and (out / "gold" / "material.npz").stat().st_mtime_ns == made


def test_a_folder_without_models_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"holds no textured model; expected a folder of \.glb"):
        report_transfers(tmp_path, tmp_path / "out", TransfersReportOptions())
