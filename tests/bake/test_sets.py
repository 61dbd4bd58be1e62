"""An asset of several texture sets: what one atlas shows, in files of their own."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stages.asset.export import EXTRAS, export
from stages.asset.folder import read_asset
from stages.asset.options import ExportOptions
from stages.asset.read_glb import read_model
from stages.bake import stage
from stages.bake.options import BakeOptions
from stages.bake.raster import Layout, touched_texels
from stages.bake.sizes import MOST, block, means, sized
from stages.bake.stage import bake
from stages.core.artifact import load_npz, read_exr, read_manifest
from stages.core.errors import ArtifactError
from stages.core.images import read_image
from stages.core.schemas import ASSET, PREP
from stages.core.texture_sets import TextureSet, map_files, texture_sets, triangle_sets
from stages.light.textured_model import TexturedModel
from stages.report.baked import read_baked
from tests.asset.glb import Glb
from tests.asset.test_models import khronos_issues
from tests.bake.examples import Example, cube, one_part, save_material, save_prep, small_residual

SMALL = BakeOptions(size=512, supersample=1, preview_size=32, occlusion_rays=16)
LOWER, UPPER = [0, 1, 2], [3, 4, 5]
SETS = (TextureSet("_shell", None, ("shell",), 0.5), TextureSet(".1002", 1002, ("visor",), 0.5))


def divided() -> Example:
    """A cube whose slots have the same three cells of their squares; the second lies one tile to the right."""
    one = cube()
    uv = one.loop_uv.copy()
    uv[12:] += np.float32((1, -1 / 3))
    slots = one_part(material="shell", node="cube") + one_part(material="visor", node="cube")
    part = [0, 0, 0, 1, 1, 1]
    return one.with_(loop_uv=uv, parts=slots, part=part, set=part, sets=SETS, source_format="obj", uv_kept=True)


@pytest.fixture(scope="module")
def assets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same cube and material, with two sets and with one atlas."""
    folder = tmp_path_factory.mktemp("sets")
    with pytest.MonkeyPatch.context() as patch:
        for name, example in (("sets", divided()), ("one", cube().with_(source_format="obj"))):
            prep = save_prep(folder / f"{name}.npz", example)
            bake(prep, save_material(folder / f"{name}_material.npz", prep, small_residual()), folder / name, SMALL)
            patch.setattr(stage, "page_of", lambda *args: None)
            patch.setattr(stage, "write_page", blank)  # nobody reads the other's
    return folder


def blank(page: Path, *args: object) -> None:
    page.write_text("")


def test_each_set_has_its_files_and_the_manifest_lists_them(assets: Path) -> None:
    provenance, files = read_manifest(assets / "sets", ASSET)
    assert texture_sets(provenance) == [replace(one, size=512) for one in SETS]
    plain = {f"{name}.exr" for name in ("albedo", "roughness", "metallic", "occlusion")} | {"albedo.png", "orm.png"}
    found = [map_files(one, files) for one in SETS]
    assert [set(of) for of in found] == [plain, plain]
    others = {f"model.{ending}" for ending in ("glb", "obj", "mtl")} | {f"preview.{ending}" for ending in ("png", "json")}
    others |= {"mesh.npz", "preview_light.exr", "report.html"}
    assert set(files) == {name for of in found for name in of.values()} | others


@pytest.mark.parametrize(("number", "faces"), [(0, LOWER), (1, UPPER)])
def test_a_set_shows_what_one_atlas_shows(assets: Path, number: int, faces: list[int]) -> None:
    """Texels on the charts are the atlas's; three cells further up in the second."""
    mesh = load_npz(assets / "sets.npz", PREP)
    mine = triangle_sets(mesh) == number
    on = touched_texels(Layout.of(mesh["uv"], 512, mesh["charts"], mine)).triangle >= 0
    assert sorted(set(np.flatnonzero(mine) // 2)) == faces
    whole = touched_texels(Layout.of(load_npz(assets / "one.npz", PREP)["uv"], 512)).triangle
    theirs = np.isin(whole // 2, faces) & (whole >= 0)
    for name in ("albedo", "roughness", "metallic"):
        ours, atlas = (
            np.concatenate([np.ravel(np.sort(values[where])) for values in read_exr(assets / path).channels.values()])
            for path, where in ((f"sets/{SETS[number].file(f'{name}.exr')}", on), (f"one/{name}.exr", theirs))
        )
        assert np.abs(np.quantile(ours, [0.1, 0.5, 0.9]) - np.quantile(atlas, [0.1, 0.5, 0.9])).max() < 2e-3
    flat = read_exr(assets / "sets" / SETS[number].file("occlusion.exr")).channels["Y"]
    assert flat.min() > 0.99  # a cube hides nothing from itself


def test_the_model_has_a_material_for_each(assets: Path) -> None:
    glb = Glb.read(assets / "sets" / "model.glb")
    images = [image["name"] for image in glb.root["images"]]
    assert images == ["albedo_shell", "orm_shell", "albedo.1002", "orm.1002"]
    assert [material["name"] for material in glb.root["materials"]] == ["shell", "visor"]
    wraps = [glb.root["samplers"][texture["sampler"]]["wrapS"] for texture in glb.root["textures"]]
    assert wraps == [33071, 33071, 10497, 10497]
    for number, material in enumerate(glb.root["materials"]):
        texture = glb.root["textures"][material["pbrMetallicRoughness"]["baseColorTexture"]["index"]]
        stored = glb.view(glb.root["images"][texture["source"]]["bufferView"])
        assert stored == (assets / "sets" / SETS[number].file("albedo.png")).read_bytes()
    mtl = (assets / "sets" / "model.mtl").read_text()
    assert "newmtl shell\n" in mtl and "map_Kd albedo_shell.png" in mtl and "map_Pm metallic.1002.exr" in mtl
    assert [line for line in (assets / "sets" / "model.obj").read_text().splitlines() if line.startswith("usemtl")] == [
        "usemtl shell", "usemtl visor",
    ]  # fmt: skip


def test_the_validator_has_nothing_to_say(assets: Path) -> None:
    found = khronos_issues(assets / "sets" / "model.glb")
    assert (found["numErrors"], found["numWarnings"]) == (0, 0)


def test_the_picture_is_the_one_atlas_s(assets: Path) -> None:
    """But for what is interpolated at the rims of charts."""
    ours, atlas = (read_image(assets / name / "preview.png")[:64, :, :3] for name in ("sets", "one"))
    assert np.sqrt(np.square(ours - atlas).mean()) < 10 ** (-38 / 20)


def test_readers_of_assets_know_the_sets(assets: Path) -> None:
    found = read_asset(assets / "sets")
    assert [stem for stem, _ in found.stems()] == ["thing_shell", "thing_1002"]
    assert [look.repeats for look in read_model(assets / "sets" / "model.glb").looks] == [False, True]
    maps, one = (read_baked(assets / f"{name}.npz", assets / f"{name}_material.npz", assets / name) for name in ("sets", "one"))
    assert len(maps.maps) == pytest.approx(len(one.maps), rel=0.02)
    np.testing.assert_allclose(maps.maps.mean(0), one.maps.mean(0), atol=2e-3)
    page = (assets / "sets" / "report.html").read_text()
    assert "2 texture sets of 512 texels" in page and "shell: albedo" in page and "visor: roughness" in page


def test_a_textured_model_has_each_set_s_material(assets: Path) -> None:
    """What `eval` and a reference material read: in the middle of each face, as the masters say."""
    mesh = load_npz(assets / "sets.npz", PREP)
    middle = mesh["vertices"][mesh["triangles"]].mean(1)
    model = TexturedModel(assets / "sets" / "model.glb", mesh["to_world"])
    found, there = model.material_at(middle, middle + mesh["normals"][:, 0])
    assert there.all()
    for number, chosen in enumerate(SETS):
        color = read_exr(assets / "sets" / chosen.file("albedo.exr")).channels
        mine = np.flatnonzero(triangle_sets(mesh) == number)
        u, v = np.moveaxis(mesh["uv"][mine].mean(1) % 1, -1, 0)
        row, column = ((1 - v) * 512).astype(int), (u * 512).astype(int)
        stored = np.stack([color[c][row, column] for c in "RGB"], 1)
        assert np.abs(found[mine, :3] - stored).max() < 0.05  # texels differ by as much from one to the next


EACH = {
    "unreal": ("T_thing_{}_BC.png", "T_thing_{}_ORM.png"),
    "unity-hdrp": ("thing_{}_BaseMap.png", "thing_{}_MaskMap.png"),
    "unity-urp": ("thing_{}_BaseMap.png", "thing_{}_MetallicSmoothness.png", "thing_{}_Occlusion.png"),
    "usd": ("textures/thing_{}_albedo.png", "textures/thing_{}_orm.png"),
    "materialx": ("textures/thing_{}_albedo.png", "textures/thing_{}_orm.png"),
}
"""Files that a target has of each set."""


@pytest.mark.parametrize("target", EACH)
def test_exports_have_files_for_each_set(assets: Path, tmp_path: Path, target: str) -> None:
    for name, (module, _) in EXTRAS.items():
        if name == target:
            pytest.importorskip(module)
    files = set(export(assets / "sets", tmp_path / "out", ExportOptions(target)).sizes)
    assert {words.format(name) for words in EACH[target] for name in ("shell", "1002")} <= files


def test_a_set_without_texels_is_named(tmp_path: Path) -> None:
    example = divided()
    uv = example.loop_uv.copy()
    uv[12:] = 0.5
    prep = save_prep(tmp_path / "prep.npz", example.with_(loop_uv=uv))
    material = save_material(tmp_path / "material.npz", prep, small_residual())
    with pytest.raises(ArtifactError, match=r"prep\.npz: its UVs cover no texel of 512 of set 1002; make it again"):
        bake(prep, material, tmp_path / "asset", SMALL)
    assert not list((tmp_path / "asset").glob("*.exr"))


def test_sizes_follow_the_share_of_the_surface() -> None:
    def sizes(*shares: float, size: int | None = None) -> list[int]:
        return [one.size for one in sized([TextureSet(share=share) for share in shares], size)]

    assert sizes(1.0) == [2048]
    assert sizes(0.5, 0.3, 0.1, 0.05, 0.05) == [2048, 2048, 1024, 512, 512]
    assert sizes(*[0.25] * 4) == [2048] * 4
    assert sizes(*[1 / 6] * 6) == [1024] * 6
    assert sum(edge**2 for edge in sizes(*[1 / 300] * 300)) <= MOST
    assert sizes(1.0, 0.0) == [2048, 64]
    assert sizes(0.9, 0.1, size=512) == [512, 512]


def test_pictures_are_drawn_from_means_where_there_are_many_texels() -> None:
    assert [block([TextureSet(size=8192)] * count) for count in (1, 2, 4, 5)] == [1, 2, 2, 4]
    values = np.arange(48, dtype="f4").reshape(4, 4, 3)
    np.testing.assert_array_equal(means(values, 2)[0, 0], values[:2, :2].mean((0, 1)))
    assert means(values, 1) is values
