"""Every real mesh goes through all four stages, and every broken one gives a result or a one-line error, in time."""

import time
from pathlib import Path

import numpy as np
import pytest

from stages.bake.options import BakeOptions
from stages.bake.stage import bake
from stages.conditions.options import ConditionsOptions
from stages.conditions.stage import conditions
from stages.core.artifact import load_npz
from stages.core.errors import InputError
from stages.core.images import read_image
from stages.core.schemas import PREP
from stages.distill.options import DistillOptions
from stages.distill.stage import distill
from stages.prep.options import PrepOptions
from stages.prep.stage import prep

ASSETS = Path(__file__).resolve().parents[2] / "shared" / "assets"
MESHES = sorted(ASSETS.glob("meshes/*"))
BROKEN = sorted(ASSETS.glob("broken_micro/*"))

LARGE = 4_000_000
"""Bytes above which a mesh is left to a run by hand; the largest takes a minute and a half in `prep` alone."""


SLOW = 20_000
"""Triangles above which xatlas takes longer than all the rest."""


@pytest.mark.skipif(not MESHES, reason="the optional assets are not beside the project")
@pytest.mark.parametrize("mesh", [p for p in MESHES if p.stat().st_size < LARGE], ids=lambda p: p.stem)
def test_real_mesh_through_all_stages(mesh: Path, tmp_path: Path) -> None:
    prepared, folder = tmp_path / "prep.npz", tmp_path / "conditions"
    material, asset = tmp_path / "material.npz", tmp_path / "asset"
    prep(mesh, prepared, PrepOptions(texture_size=512, padding=4, unwrap_triangles=SLOW))
    few = ConditionsOptions(views=3, size=48, env=("overcast", "studio"), quality="draft")
    conditions(prepared, folder, few)
    distill(folder, material, DistillOptions(prompt="worn red plastic", steps=4))
    bake(prepared, material, asset, BakeOptions(size=512, supersample=1, preview_size=32, occlusion_rays=8))

    made = load_npz(prepared, PREP)
    assert np.ptp(made["vertices"], axis=0).max() == pytest.approx(1, abs=1e-4)
    assert np.abs(np.linalg.norm(made["normals"], axis=-1) - 1).max() < 1e-3
    assert made["uv"].min() >= 0
    assert made["uv"].max() <= 1
    albedo = read_image(asset / "albedo.png")
    assert albedo.shape == (512, 512, 3)
    assert albedo.min() > 0  # filled to the last texel
    assert (asset / "model.glb").stat().st_size > 1000


@pytest.mark.skipif(not BROKEN, reason="the optional assets are not beside the project")
@pytest.mark.parametrize("mesh", BROKEN, ids=lambda p: p.stem)
def test_broken_mesh_gives_a_result_or_one_line(mesh: Path, tmp_path: Path) -> None:
    begin = time.perf_counter()
    try:
        prep(mesh, tmp_path / "prep.npz", PrepOptions())
    except InputError as error:
        assert "\n" not in str(error)
        assert mesh.name in str(error)
        assert not list(tmp_path.iterdir())
    else:
        assert len(load_npz(tmp_path / "prep.npz", PREP)["triangles"]) > 0
    assert time.perf_counter() - begin < 20
