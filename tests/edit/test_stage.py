"""The stage: what follows from an edit, parts, the list, undo, and what is never touched."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from dreammat_cli.main import cli
from stages.asset.eight_bits import srgb_8bit, to_8bit
from stages.asset.folder import read_asset
from stages.bake.options import BakeOptions
from stages.bake.stage import Subject, bake, open_folder
from stages.core.artifact import load_npz, read_exr, read_manifest
from stages.core.errors import ArtifactError, DreammatError, InputError, OutputError
from stages.core.images import read_image
from stages.core.schemas import ASSET, PREP
from stages.core.texture_sets import TextureSet
from stages.edit.options import EditOptions
from stages.edit.stage import edit, undo
from stages.edit.texels import chosen_triangles, texels_of
from tests.bake.examples import IDENTITY, constant, cube, grid, save_material, save_prep
from tests.pipeline import fingerprint

SMALL = BakeOptions(size=512, preview_size=32, occlusion_rays=4)
MATERIAL = (0.6, 0.3, 0.05, 0.35, 0.8)
PARTS = [{"name": "box", "material": m, "node": "box", "transform": IDENTITY} for m in ("seat", "leg_1", "leg_2")]


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cube of one material and three slots; its source was an OBJ."""
    folder = tmp_path_factory.mktemp("edit")
    example = cube().with_(source_format="obj", parts=PARTS, part=[0, 0, 0, 0, 1, 2])
    prep = save_prep(folder / "prep.npz", example)
    material = save_material(folder / "material.npz", prep, constant(MATERIAL))
    bake(prep, material, folder / "asset", SMALL)
    (folder / "prep.npz").unlink()
    return folder / "asset"


def grey(folder: Path, name: str) -> np.ndarray:
    return read_exr(folder / name).channels["Y"].astype(np.float32)


def test_everything_that_depends_on_an_edit_is_rewritten_and_undo_gives_the_first_bytes_back(
    asset: Path, tmp_path: Path
) -> None:
    first, own = fingerprint(asset), tmp_path / "own"
    shutil.copytree(asset, own)
    made = edit(own, tmp_path / "new", EditOptions(saturation=0.5, invert_metallic=True))
    assert not made.up_to_date and made.edits == ["saturation 0.5, invert metallic"]
    assert edit(own, tmp_path / "new", EditOptions(saturation=0.5, invert_metallic=True)).up_to_date
    assert fingerprint(own) == first
    shutil.rmtree(own)  # the edited asset needs it no more
    new = tmp_path / "new"
    changed = {name for name, digest in fingerprint(new).items() if first.get(name) != digest}
    pictures = {"albedo.exr", "albedo.png", "metallic.exr", "orm.png", "preview.png"}
    assert changed == pictures | {"model.glb", "report.html", "bake.json", "base_albedo.exr", "base_metallic.exr"}
    albedo = np.stack([read_exr(new / "albedo.exr").channels[c] for c in "RGB"], -1).astype(np.float32)
    packed = np.round(read_image(new / "orm.png") * 255).astype(np.uint8)
    np.testing.assert_array_equal(np.round(read_image(new / "albedo.png") * 255), srgb_8bit(albedo))
    np.testing.assert_array_equal(packed[..., 2], to_8bit(grey(new, "metallic.exr")))
    np.testing.assert_allclose(grey(new, "metallic.exr"), 0.2, atol=5e-4)
    look = read_asset(new).model.looks[0]
    np.testing.assert_array_equal(look.packed(), packed)
    assert "saturation 0.5, invert metallic" in (new / "report.html").read_text()
    undo(new, tmp_path / "back")
    assert fingerprint(tmp_path / "back") == first
    with pytest.raises(InputError, match="back: has no edits to take away"):
        undo(tmp_path / "back", None)


@pytest.fixture
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests that look at other files: a blank preview and an empty report."""

    def blank(page: Path, *args: object) -> None:
        page.write_text("")

    monkeypatch.setattr("stages.bake.stage.contact_sheet", lambda *args: np.zeros((4, 4, 3), np.float32))
    monkeypatch.setattr("stages.bake.stage.page_of", lambda *args: None)
    monkeypatch.setattr("stages.bake.stage.write_page", blank)


@pytest.mark.usefixtures("no_pictures")
def test_parts_are_called_by_the_grammar_of_parts(asset: Path, tmp_path: Path) -> None:
    made = edit(asset, tmp_path / "new", EditOptions(part=("slot:leg_*",), metallic=0, roughness_scale=4))
    metallic, roughness = grey(tmp_path / "new", "metallic.exr"), grey(tmp_path / "new", "roughness.exr")
    for face in range(6):  # the atlas has rows of three faces, the first at the bottom
        top, left = 512 - 171 * (face // 3 + 1), 171 * (face % 3)
        box = slice(top + 20, top + 120), slice(left + 20, left + 120)
        np.testing.assert_allclose(metallic[box], 0.8 if face < 4 else 0, atol=5e-4)
        np.testing.assert_allclose(roughness[box], 0.35 if face < 4 else 1, atol=5e-4)
    legs = read_manifest(asset, ASSET)[0].extra["coverage"] * 512**2 / 3
    assert made.clamped["roughness"] == pytest.approx(legs, rel=0.02)
    assert set(np.unique(metallic)) == set(np.unique(grey(asset, "metallic.exr"))) | {0}  # to the last texel of padding


@pytest.mark.usefixtures("no_pictures")
def test_a_part_of_one_texture_set_leaves_the_others_files_alone(tmp_path: Path) -> None:
    sets = (TextureSet("_seat", None, ("seat",), 0.66), TextureSet("_leg", None, ("leg_1", "leg_2"), 0.33))
    example = cube().with_(source_format="obj", parts=PARTS, part=[0, 0, 0, 0, 1, 2], set=[0, 0, 0, 0, 1, 1], sets=sets)
    prep = save_prep(tmp_path / "prep.npz", example)
    bake(prep, save_material(tmp_path / "material.npz", prep, constant(MATERIAL)), tmp_path / "asset", SMALL)
    edit(tmp_path / "asset", tmp_path / "new", EditOptions(part=("leg_2",), metallic=0))
    first, now = fingerprint(tmp_path / "asset"), fingerprint(tmp_path / "new")
    pictures = {"metallic_leg.exr", "orm_leg.png", "base_metallic_leg.exr"}
    assert {name for name, digest in now.items() if first.get(name) != digest} == pictures | {"model.glb", "bake.json"}
    assert len(np.unique(grey(tmp_path / "new", "metallic_leg.exr"))) == 2


def test_islands_that_share_texels_are_edited_by_whichever_is_called(tmp_path: Path) -> None:
    """Two sheets, one on the other's texels: editing the one that does not represent them edits them all, and says so."""
    one = grid(2)
    vertices = np.concatenate([one.vertices, one.vertices + (0, 0, 1)])
    faces = one.faces + [[corner + len(one.vertices) for corner in face] for face in one.faces]
    parts = [{"name": n, "material": n, "node": n, "transform": IDENTITY} for n in ("left", "right")]
    stacked = replace(
        one, vertices=vertices, faces=faces, loop_uv=np.tile(one.loop_uv, (2, 1)), chart=[0] * 4 + [1] * 4,
        part=[0] * 4 + [1] * 4, parts=parts, shared_texels=True,
    )  # fmt: skip
    prep = save_prep(tmp_path / "prep.npz", stacked)
    mesh = load_npz(prep, PREP)
    where, shared = texels_of(Subject.of(prep, mesh, 256), chosen_triangles(mesh, ("object:right",)))
    assert where.all() and shared == pytest.approx(0.9**2 * 256**2, rel=0.02)


@pytest.mark.usefixtures("no_pictures")
def test_what_was_baked_is_never_touched_and_bad_input_is_one_line(asset: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    shutil.copytree(asset, other)
    first = fingerprint(other)
    hue = EditOptions(hue=5)
    cases: list[tuple[type[DreammatError], str, object]] = [
        (InputError, "give the folder to write with -o", lambda: edit(asset, None, hue)),
        (OutputError, "other: an asset as it was baked", lambda: edit(asset, other, hue)),
        (OutputError, "an asset as it was baked", lambda: edit(other, other, hue, force=True)),
        (InputError, "part 'wheel': there is none", lambda: edit(asset, tmp_path / "n", replace(hue, part=("wheel",)))),
        (ArtifactError, "holds no bake.json", lambda: edit(tmp_path, tmp_path / "n", hue)),
        (InputError, "has no edits to take away", lambda: undo(asset, tmp_path / "n")),
    ]  # fmt: skip
    for kind, message, call in cases:
        with pytest.raises(kind, match=message) as caught:
            call()  # type: ignore[operator]
        assert "\n" not in str(caught.value)
    assert fingerprint(other) == first and not (tmp_path / "n").exists()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "albedo.png").write_text("mine")
    with pytest.raises(OutputError, match=r"albedo\.png: is there and not this command's"):
        edit(asset, tmp_path / "mine", hue)
    assert (tmp_path / "mine" / "albedo.png").read_text() == "mine"


@pytest.mark.usefixtures("no_pictures")
def test_the_command_lists_edits_undoes_and_takes_one_thing_at_a_time(asset: Path, tmp_path: Path) -> None:
    new = str(tmp_path / "new")

    def call(*words: str) -> str:
        result = CliRunner().invoke(cli, ["edit", *words], catch_exceptions=False)
        return f"{result.exit_code} {result.output}"

    assert call(str(asset), "-o", new, "--part", "seat", "--hue", "20", "--tint", "#8a5").startswith("0 ")
    assert "1  hue 20, tint #8a5 on seat" in call(new, "--list")
    assert call(new, "--roughness-offset", "0.9").count("roughness clamped") == 1
    assert "2  roughness offset 0.9" in call(new, "--list")
    assert "roughness" not in call(new, "--undo") and "2  " not in call(new, "--list")
    for words in (["--undo", "--hue", "3"], [], ["--list", "--undo"], ["--hue", "0"]):
        assert "give one of --list, --undo" in call(new, *words)


def test_baking_again_into_its_own_folder_spares_the_mesh_that_is_given(asset: Path, tmp_path: Path) -> None:
    shutil.copytree(asset, tmp_path / "asset")
    open_folder(tmp_path / "asset", tmp_path / "asset" / "mesh.npz")
    assert sorted(path.name for path in (tmp_path / "asset").iterdir()) == ["mesh.npz", "run.json"]
