"""The stage as a whole: its files, their contents, and what it says when it cannot."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stages.asset.eight_bits import normal_8bit
from stages.asset.maps import Maps
from stages.bake import stage
from stages.bake.options import BakeOptions
from stages.bake.stage import bake
from stages.core.artifact import read_exr, read_manifest, sha256_file
from stages.core.color import srgb_encode
from stages.core.errors import ArtifactError, InputError, OutputError
from stages.core.images import read_image
from stages.core.schemas import ASSET
from tests.asset.glb import Glb
from tests.asset.test_models import khronos_issues
from tests.bake.examples import (
    constant,
    cube,
    grid,
    ring_of_cameras,
    save_material,
    save_prep,
    small_residual,
)
from tests.conftest import Golden

SMALL = BakeOptions(size=512, supersample=1, preview_size=32, occlusion_rays=16)
MATERIAL = (0.6, 0.3, 0.05, 0.35, 0.8)


@pytest.fixture
def no_preview(monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests that look at other files: a blank preview and an empty report."""

    def blank(page: Path, *args: object) -> None:
        page.write_text("")

    monkeypatch.setattr(stage, "contact_sheet", lambda *args: np.zeros((4, 4, 3), np.float32))
    monkeypatch.setattr(stage, "page_of", lambda *args: None)
    monkeypatch.setattr(stage, "write_page", blank)


TEXTURES = {"albedo.exr", "roughness.exr", "metallic.exr", "occlusion.exr", "albedo.png", "orm.png"}


@pytest.fixture(scope="module")
def constant_asset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cube baked with one material; its source was an OBJ."""
    folder = tmp_path_factory.mktemp("constant")
    prep = save_prep(folder / "prep.npz", cube().with_(source_format="obj"))
    material = save_material(folder / "material.npz", prep, constant(MATERIAL), ring_of_cameras(6))
    bake(prep, material, folder / "asset", SMALL)
    return folder


def test_all_files_are_there_and_the_manifest_knows_their_hashes(constant_asset: Path) -> None:
    folder = constant_asset / "asset"
    provenance, files = read_manifest(folder, ASSET)
    obj = {"model.obj", "model.mtl"}
    assert set(files) == TEXTURES | obj | {
        "model.glb", "preview.png", "preview.json", "preview_light.exr", "report.html", "mesh.npz",
    }  # fmt: skip
    assert all(sha256_file(folder / name) == digest for name, digest in files.items())
    assert {path.name for path in folder.iterdir()} == {*files, "bake.json", "run.json"}
    assert provenance.inputs["prep"] == sha256_file(constant_asset / "prep.npz") == files["mesh.npz"]
    assert (provenance.seed, provenance.extra["prompt"]) == (5, "a thing")
    assert provenance.extra["parts"] == [{"name": "seat", "prompt": "velvet"}]
    assert "seat: velvet" in (folder / "report.html").read_text()
    assert provenance.extra["unseen"] == pytest.approx(1 / 6, abs=1e-3)  # the bottom
    assert provenance.extra["coverage"] == pytest.approx(0.96**2 * 2 / 3, abs=0.01)


def test_one_material_is_that_material_in_every_texel_of_every_file(constant_asset: Path) -> None:
    folder = constant_asset / "asset"
    for name, channel, value in (
        ("albedo.exr", "R", MATERIAL[0]), ("albedo.exr", "G", MATERIAL[1]), ("albedo.exr", "B", MATERIAL[2]),
        ("roughness.exr", "Y", MATERIAL[3]), ("metallic.exr", "Y", MATERIAL[4]),
    ):  # fmt: skip
        pixels = read_exr(folder / name).channels[channel]
        assert pixels.shape == (512, 512)
        np.testing.assert_allclose(pixels.astype(float), value, atol=2.5e-4)  # half float
    encoded = np.round(srgb_encode(np.array(MATERIAL[:3])) * 255) / 255
    np.testing.assert_allclose(read_image(folder / "albedo.png"), np.broadcast_to(encoded, (512, 512, 3)), atol=1e-6)
    packed = np.round(np.array([1, MATERIAL[3], MATERIAL[4]]) * 255) / 255
    np.testing.assert_allclose(read_image(folder / "orm.png"), np.broadcast_to(packed, (512, 512, 3)), atol=1e-6)


def test_the_model_holds_the_very_pictures(constant_asset: Path) -> None:
    glb = Glb.read(constant_asset / "asset" / "model.glb")
    for image in glb.root["images"]:
        assert glb.view(image["bufferView"]) == (constant_asset / "asset" / f"{image['name']}.png").read_bytes()
    textures = glb.root["materials"][0]["pbrMetallicRoughness"]
    pictures = [glb.root["images"][glb.root["textures"][textures[key]["index"]]["source"]]["name"] for key in textures]
    assert dict(zip(textures, pictures, strict=True)) == {
        "baseColorTexture": "albedo",
        "metallicRoughnessTexture": "orm",
    }


@pytest.mark.usefixtures("no_preview")
def test_relief_and_occlusion_are_written_where_a_material_has_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    prep = save_prep(tmp_path / "prep.npz", cube().with_(source_format="obj"))
    material = save_material(tmp_path / "material.npz", prep, constant(MATERIAL))
    flat_maps = stage.bake_maps
    height = np.random.default_rng(0).random((512, 512), np.float32) * np.float32(1e-3)

    def with_more(*args: Any) -> tuple[Maps, dict[str, Any]]:
        maps, coverage = flat_maps(*args)
        return replace(maps, height=height, occlusion=np.full((512, 512), 0.25, np.float32)), coverage

    monkeypatch.setattr(stage, "bake_maps", with_more)
    out = tmp_path / "asset"
    files = set(bake(prep, material, out, SMALL).files)
    assert {"height.exr", "normal.exr", "normal.png", "occlusion.exr"} <= files
    np.testing.assert_array_equal(read_exr(out / "height.exr").channels["Y"], height)
    normal = np.stack([read_exr(out / "normal.exr").channels[c] for c in "RGB"], -1).astype(float)
    assert (np.abs(np.linalg.norm(normal, axis=-1) - 1) < 1e-3).all()
    assert np.degrees(np.arccos(normal[..., 2].clip(-1, 1))).mean() > 2
    np.testing.assert_allclose(read_image(out / "normal.png") * 2 - 1, normal, atol=1 / 127)
    np.testing.assert_allclose(read_image(out / "orm.png")[..., 0], 0.25, atol=0.5 / 255)
    assert "norm normal.png" in (out / "model.mtl").read_text()
    glb = Glb.read(out / "model.glb")
    assert [image["name"] for image in glb.root["images"]] == ["albedo", "orm", "normal"]
    assert glb.root["materials"][0]["normalTexture"] == {"index": 2}
    assert glb.root["materials"][0]["occlusionTexture"] == {"index": 1}
    (primitive,) = glb.primitives()
    assert len(glb.attribute(primitive, "TANGENT")) == len(glb.attribute(primitive, "POSITION")) == 24
    issues = khronos_issues(out / "model.glb")
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]


def test_relief_shows_in_the_preview(
    constant_asset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The picture is shaded with the baked normal map: grooves change it on the object and nowhere else."""
    flat_maps = stage.bake_maps
    grooves = np.broadcast_to(2e-3 * np.sin(np.arange(512, dtype=np.float32) / 3), (512, 512))

    def grooved(*args: Any) -> tuple[Maps, dict[str, Any]]:
        maps, coverage = flat_maps(*args)
        return replace(maps, height=np.ascontiguousarray(grooves)), coverage

    monkeypatch.setattr(stage, "bake_maps", grooved)
    bake(constant_asset / "prep.npz", constant_asset / "material.npz", tmp_path / "grooved", SMALL)
    views = [read_image(folder / "preview.png")[:64] for folder in (constant_asset / "asset", tmp_path / "grooved")]
    differs = np.abs(views[0] - views[1]).max(-1) > 0.02
    assert 0.1 < differs.mean() < 0.7
    assert not differs[:, :2].any()  # the background


def test_normals_become_bytes_without_terraces() -> None:
    """A slope of less than a step a hundred texels long: dithered, its mean is right everywhere; flat stays flat."""
    angle = np.linspace(0.001, 0.02, 4096, dtype="f4")
    normal = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], -1)[None].repeat(64, 0)
    error = (normal_8bit(normal).astype(float) / 127.5 - 1 - normal).mean(0).reshape(64, 64, 3).mean(1)
    assert np.abs(error).max() < 3e-4  # a step is 7.8e-3; without dithering the error reaches half of it
    flat = np.zeros((2, 2, 3), "f4")
    flat[..., 2] = 1
    np.testing.assert_array_equal(normal_8bit(flat), np.broadcast_to([128, 128, 255], (2, 2, 3)))


def test_the_same_request_is_up_to_date_and_force_gives_the_same_bytes(constant_asset: Path, tmp_path: Path) -> None:
    prep, material, folder = (constant_asset / name for name in ("prep.npz", "material.npz", "asset"))
    assert bake(prep, material, folder, SMALL).up_to_date
    again = bake(prep, material, tmp_path / "again", SMALL, force=True)
    assert not again.up_to_date
    assert (tmp_path / "again" / "bake.json").read_bytes() == (folder / "bake.json").read_bytes()


@pytest.mark.usefixtures("no_preview")
def test_a_bake_loads_no_tensors(constant_asset: Path, tmp_path: Path) -> None:
    """Their import would be a tenth of the command's time."""
    inputs = f"*(Path({str(constant_asset)!r}) / name for name in ('prep.npz', 'material.npz'))"
    options = "BakeOptions(size=512, supersample=1, preview_size=32, occlusion_rays=1)"
    call = f"bake({inputs}, Path({str(tmp_path)!r}), {options}); print('torch' in sys.modules)"
    code = f"import sys; from stages.bake.stage import *; from stages.bake.options import BakeOptions; {call}"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout == "False\n"


def test_another_request_replaces_the_folder_and_takes_its_old_files_away(tmp_path: Path) -> None:
    out = tmp_path / "asset"
    for source_format in ("obj", "ply"):
        prep = save_prep(tmp_path / "prep.npz", cube().with_(source_format=source_format))
        material = save_material(tmp_path / "material.npz", prep, constant(MATERIAL))
        bake(prep, material, out, SMALL)
        (out / "mine.txt").write_text("not ours")
    assert not (out / "model.obj").exists()
    assert (out / "mine.txt").exists()


@pytest.mark.usefixtures("no_preview")
def test_an_asset_of_an_older_version_is_replaced_and_a_foreign_folder_is_not(tmp_path: Path) -> None:
    prep = save_prep(tmp_path / "prep.npz", cube())
    material = save_material(tmp_path / "material.npz", prep, constant(MATERIAL))
    out = tmp_path / "asset"
    out.mkdir()
    (out / "normal.png").write_text("of an older asset")
    (out / "bake.json").write_text('{"schema": "dreammat.asset", "version": 1, "files": {"normal.png": "0"}}')
    with pytest.raises(ArtifactError, match=r"bake\.json: dreammat\.asset version 1, expected 3; make it again"):
        read_manifest(out, ASSET)
    bake(prep, material, out, SMALL)
    assert not (out / "normal.png").exists()
    read_manifest(out, ASSET)
    (out / "bake.json").write_text('{"oven": 200}')
    with pytest.raises(ArtifactError, match=r"bake\.json: not a file of dreammat's; give another folder"):
        bake(prep, material, out, SMALL)
    assert (out / "bake.json").read_text() == '{"oven": 200}' and (out / "model.glb").exists()


@pytest.mark.usefixtures("no_preview")
def test_a_failure_leaves_no_manifest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    prep = save_prep(tmp_path / "prep.npz", cube())
    material = save_material(tmp_path / "material.npz", prep, constant(MATERIAL))
    out = tmp_path / "asset"
    bake(prep, material, out, SMALL)

    def no_space(*args: object) -> None:
        raise OutputError(f"{out / 'model.glb'}: cannot be written: no space left on device")

    monkeypatch.setattr(stage, "write_glb", no_space)
    with pytest.raises(OutputError):
        bake(prep, material, out, SMALL, force=True)
    assert not (out / "bake.json").exists()
    assert not list(out.glob(".*tmp*"))


def test_the_material_of_another_mesh_is_refused(tmp_path: Path) -> None:
    prep, other = save_prep(tmp_path / "prep.npz", cube()), save_prep(tmp_path / "other.npz", grid(2))
    material = save_material(tmp_path / "material.npz", other, constant(MATERIAL))
    with pytest.raises(ArtifactError, match=r"material\.npz: made from another prep") as caught:
        bake(prep, material, tmp_path / "asset", SMALL)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "asset").exists()


def test_swapped_missing_and_damaged_inputs_are_named(tmp_path: Path) -> None:
    prep = save_prep(tmp_path / "prep.npz", cube())
    material = save_material(tmp_path / "material.npz", prep, constant(MATERIAL))
    with pytest.raises(ArtifactError, match=r"material\.npz: a dreammat\.material artefact, expected dreammat\.prep"):
        bake(material, prep, tmp_path / "asset", SMALL)
    with pytest.raises(ArtifactError, match=r"nothing\.npz"):
        bake(prep, tmp_path / "nothing.npz", tmp_path / "asset", SMALL)
    material.write_bytes(material.read_bytes()[:2000])
    with pytest.raises(ArtifactError, match=r"material\.npz"):
        bake(prep, material, tmp_path / "asset", SMALL)


def test_a_file_where_the_folder_should_be_is_named(tmp_path: Path) -> None:
    prep = save_prep(tmp_path / "prep.npz", cube())
    material = save_material(tmp_path / "material.npz", prep, constant(MATERIAL))
    (tmp_path / "asset").write_text("a file")
    with pytest.raises(OutputError, match="asset: cannot be written"):
        bake(prep, material, tmp_path / "asset", SMALL)
    assert (tmp_path / "asset").read_text() == "a file"


def test_uvs_that_cover_nothing_are_an_error(tmp_path: Path) -> None:
    example = cube()
    prep = save_prep(tmp_path / "prep.npz", example.with_(loop_uv=0 * example.loop_uv))
    material = save_material(tmp_path / "material.npz", prep, constant(MATERIAL))
    with pytest.raises(ArtifactError, match=r"prep\.npz: its UVs cover no texel"):
        bake(prep, material, tmp_path / "asset", SMALL)


@pytest.mark.parametrize("wrong", [{"size": 1000}, {"size": 256}, {"supersample": 0}, {"preview_size": 1}, {"relief": 2.1}])
def test_options_out_of_range_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match="expected"):
        BakeOptions(**wrong)


@pytest.mark.usefixtures("no_preview")
def test_unseen_surface_takes_the_colour_of_seen_surface(tmp_path: Path) -> None:
    """Below the cube nobody looks: the field's own values there must not appear, those of its sides must."""
    prep = save_prep(tmp_path / "prep.npz", cube())
    material = save_material(tmp_path / "material.npz", prep, small_residual(), ring_of_cameras(6))
    bake(prep, material, tmp_path / "asset", SMALL)
    hidden = read_exr(tmp_path / "asset" / "albedo.exr").channels["R"].astype(float)
    seen = save_material(tmp_path / "seen.npz", prep, small_residual())
    bake(prep, seen, tmp_path / "seen", SMALL)
    whole = read_exr(tmp_path / "seen" / "albedo.exr").channels["R"].astype(float)
    report = json.loads((tmp_path / "seen" / "bake.json").read_text())["extra"]
    assert report["unseen"] == 0
    # the bottom, at y = -0.5 of a +y up source, is chart 2 of `cube`: the right of three columns, its lower row
    chart = (slice(512 - 171 + 4, 512 - 4), slice(341 + 4, 512 - 4))
    differs = np.abs(hidden - whole) > 1e-3
    assert differs[chart].mean() > 0.9
    differs[512 - 171 - 4 :, 341 - 4 :] = False  # the chart and its padding
    assert not differs.any()
    np.testing.assert_allclose(hidden[chart].mean(), whole.mean(), atol=0.1)  # that of its sides


def test_the_report_says_what_the_asset_is(constant_asset: Path) -> None:
    page = (constant_asset / "asset" / "report.html").read_text()
    for said in ("a thing", "thing.obj", "12 triangles", "512 × 512 texels", "made new"):
        assert said in page
    for name in read_manifest(constant_asset / "asset", ASSET)[1]:
        assert name == "report.html" or sha256_file(constant_asset / "asset" / name) in page


def test_golden_bake(tmp_path: Path, golden: Golden) -> None:
    """A cube with a varied material, seen from above; every eighth texel, and the preview."""
    prep = save_prep(tmp_path / "prep.npz", cube())
    material = save_material(tmp_path / "material.npz", prep, small_residual(), ring_of_cameras(6))
    result = bake(prep, material, tmp_path / "asset", BakeOptions(size=512, supersample=2, preview_size=32))
    folder = result.folder
    channels = {name: read_exr(folder / f"{name}.exr").channels for name in ("albedo", "roughness", "metallic", "occlusion")}
    arrays = {f"{name}_{c}": pixels[::8, ::8] for name, pixel in channels.items() for c, pixels in pixel.items()}
    arrays["shares"] = np.array([result.report["coverage"], result.report["unseen"]])
    golden.check("bake/cube_maps", arrays, atol=6e-4)  # one step of a half float near 1 where the last float differs
    pictures = {"albedo": read_image(folder / "albedo.png")[::8, ::8]}
    pictures["preview"] = read_image(folder / "preview.png")[:64]  # the shaded views; below them there is text
    golden.check("bake/cube_pictures", pictures, atol=1.5 / 255)  # one 8-bit step
