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
from stages.report.transfer import report_transfer
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
