"""Every target's files, opened again by the library that knows them best, and what is said when they cannot be made."""

import json
import os
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from stages.asset import export as export_module
from stages.asset.export import export
from stages.asset.folder import read_asset
from stages.asset.options import TARGETS, ExportOptions
from stages.asset.read_glb import block_means, resized
from stages.core.artifact import read_manifest, sha256_file, write_manifest
from stages.core.errors import ArtifactError, InputError, OutputError
from stages.core.images import read_image
from stages.core.naming import identifier, unique
from stages.core.schemas import ASSET, EXPORT
from tests.asset.examples import MAPS, TURNED, dome, save_asset
from tests.asset.glb import Glb
from tests.asset.test_models import khronos_issues

EVERYTHING = ("albedo", "orm", "normal", "occlusion", "emission")
NAME = "my_chair_2"


def made(folder: Path, target: str, maps: tuple[str, ...] = ("albedo", "orm"), **how: object) -> Path:
    """Export a fresh asset. Returns: the folder with the files."""
    for needed in ("web", "usd", "materialx"):
        if target == needed:
            pytest.importorskip(export_module.EXTRAS[target][0])
    asset = save_asset(folder / "asset", maps, **how)  # type: ignore[arg-type]
    return export(asset, folder / "out", ExportOptions(target)).folder


def bytes_of(path: Path) -> np.ndarray:
    """A PNG's own numbers; alpha must not have touched the others."""
    import PIL.Image

    return np.array(PIL.Image.open(path))


# ---------------------------------------------------------------------------------------------------- all targets


@pytest.mark.parametrize("target", TARGETS)
def test_the_manifest_knows_every_file_and_a_second_run_gives_the_same_bytes(tmp_path: Path, target: str) -> None:
    out = made(tmp_path, target, EVERYTHING)
    provenance, files = read_manifest(out, EXPORT)
    there = {str(p.relative_to(out)) for p in out.rglob("*") if p.is_file()}
    assert there == {*files, "export.json"}
    assert all(sha256_file(out / name) == digest for name, digest in files.items())
    assert provenance.inputs == {"asset": sha256_file(tmp_path / "asset" / "bake.json")}
    options = ExportOptions(target)
    assert export(tmp_path / "asset", out, options).up_to_date
    for path in (tmp_path / "asset").iterdir():
        os.utime(path, (1e9, 1e9))
    again = export(tmp_path / "asset", tmp_path / "again", options)
    assert not again.up_to_date
    assert again.sizes == {name: (out / name).stat().st_size for name in files}
    assert (tmp_path / "again" / "export.json").read_bytes() == (out / "export.json").read_bytes()
    assert {p.name for p in tmp_path.iterdir()} == {"asset", "out", "again"}


@pytest.mark.parametrize("target", ["blender", "three", "godot"])
def test_the_model_as_it_is(tmp_path: Path, target: str) -> None:
    out = made(tmp_path, target)
    assert (out / f"{NAME}.glb").read_bytes() == (tmp_path / "asset" / "model.glb").read_bytes()


# ---------------------------------------------------------------------------------------------------- engines


def test_unreal_textures_byte_for_byte(tmp_path: Path) -> None:
    out = made(tmp_path, "unreal", EVERYTHING)
    np.testing.assert_array_equal(bytes_of(out / f"T_{NAME}_BC.png"), MAPS["albedo"])
    np.testing.assert_array_equal(bytes_of(out / f"T_{NAME}_ORM.png"), MAPS["orm"])
    np.testing.assert_array_equal(bytes_of(out / f"T_{NAME}_E.png"), MAPS["emission"])
    normal = bytes_of(out / f"T_{NAME}_N.png")
    np.testing.assert_array_equal(normal[..., [0, 2]], MAPS["normal"][..., [0, 2]])
    np.testing.assert_array_equal(normal[..., 1], 255 - MAPS["normal"][..., 1])


def test_unity_mask_maps_byte_for_byte(tmp_path: Path) -> None:
    hdrp, urp = (made(tmp_path / target, target, EVERYTHING) for target in ("unity-hdrp", "unity-urp"))
    occlusion, roughness, metallic = (MAPS["orm"][..., k] for k in range(3))
    white = np.full_like(metallic, 255)
    expected = np.stack([metallic, occlusion, white, 255 - roughness], -1)
    np.testing.assert_array_equal(bytes_of(hdrp / f"{NAME}_MaskMap.png"), expected)
    expected = np.stack([metallic, metallic, metallic, 255 - roughness], -1)
    np.testing.assert_array_equal(bytes_of(urp / f"{NAME}_MetallicSmoothness.png"), expected)
    np.testing.assert_array_equal(bytes_of(urp / f"{NAME}_Occlusion.png"), occlusion)
    for out in (hdrp, urp):
        np.testing.assert_array_equal(bytes_of(out / f"{NAME}_BaseMap.png"), MAPS["albedo"])
        np.testing.assert_array_equal(bytes_of(out / f"{NAME}_Normal.png"), MAPS["normal"])  # +Y, as in glTF


def test_maps_that_the_asset_has_not_are_not_made_up(tmp_path: Path) -> None:
    unreal, urp = (made(tmp_path / target, target) for target in ("unreal", "unity-urp"))
    assert {p.name for p in unreal.iterdir()} == {
        f"T_{NAME}_BC.png", f"T_{NAME}_ORM.png", f"{NAME}.glb", "IMPORT.txt", "export.json",
    }  # fmt: skip
    assert (bytes_of(unreal / f"T_{NAME}_ORM.png")[..., 0] == 255).all()  # no occlusion is 1
    assert not (urp / f"{NAME}_Occlusion.png").exists()


def test_slots_with_pictures_of_their_own_have_files_of_their_own(tmp_path: Path) -> None:
    out = made(tmp_path, "unreal", apart=True)
    np.testing.assert_array_equal(bytes_of(out / f"T_{NAME}_a_paint_BC.png"), MAPS["albedo"])
    np.testing.assert_array_equal(bytes_of(out / f"T_{NAME}_b_paint_BC.png"), MAPS["albedo"][..., ::-1])


def test_the_scale_of_a_normal_map_is_worked_in(tmp_path: Path) -> None:
    out = made(tmp_path, "unity-hdrp", ("albedo", "orm", "normal"), normal_scale=0.5)
    read = bytes_of(out / f"{NAME}_Normal.png") / 127.5 - 1
    wanted = (MAPS["normal"] / 127.5 - 1) * (0.5, 0.5, 1)
    wanted /= np.linalg.norm(wanted, axis=-1, keepdims=True)
    np.testing.assert_allclose(read, wanted, atol=1.01 / 255)


def test_the_obj_stands_as_the_scene_does(tmp_path: Path) -> None:
    """Positions by the nodes' matrices, normals by their inverse transpose, a mirrored part wound the other way."""
    out = made(tmp_path, "unity-hdrp")
    rows: dict[str, list] = {"v": [], "vt": [], "vn": [], "f": []}
    slots = []
    for line in (out / f"{NAME}.obj").read_text().splitlines():
        key, *values = line.split()
        if key == "usemtl":
            slots += values
        elif key in rows:
            rows[key].append([tuple(map(int, v.split("/"))) for v in values] if key == "f" else [*map(float, values)])
    shape = dome()
    count, mirrored = len(shape["POSITION"]), shape["POSITION"] * (-1, 1, 1)
    turned = shape["POSITION"] @ TURNED[:3, :3].T + TURNED[:3, 3]
    np.testing.assert_allclose(rows["v"], np.concatenate([turned, mirrored]), atol=1e-6)
    np.testing.assert_allclose(rows["vt"][:count], shape["TEXCOORD_0"] * (1, -1) + (0, 1), atol=1e-6)
    np.testing.assert_allclose(rows["vn"][:count], shape["NORMAL"] @ TURNED[:3, :3].T / 2, atol=1e-6)
    faces, points, normals = np.array(rows["f"]), np.array(rows["v"]), np.array(rows["vn"])
    assert (faces == faces[..., :1]).all()
    corners = points[faces[..., 0] - 1]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((facing * normals[faces[..., 2] - 1].mean(1)).sum(1) > 0).all()
    assert slots == ["a_paint", "b_paint"]


# ---------------------------------------------------------------------------------------------------- web


@pytest.mark.parametrize("maps", [("albedo", "orm"), EVERYTHING], ids=["plain", "all"])
def test_web_model_is_small_near_and_clean(tmp_path: Path, maps: tuple[str, ...]) -> None:
    out = made(tmp_path, "web", maps)
    DracoPy = pytest.importorskip("DracoPy")
    glb = Glb.read(out / f"{NAME}.glb")
    assert glb.root["extensionsRequired"] == ["EXT_texture_webp", "KHR_draco_mesh_compression"]
    first, second = glb.primitives()
    assert first["attributes"] == second["attributes"]  # equal geometry is stored once
    extension = first["extensions"]["KHR_draco_mesh_compression"]
    assert set(extension["attributes"]) == set(first["attributes"])
    mesh = DracoPy.decode(glb.view(extension["bufferView"]))
    by_id = {a["unique_id"]: np.asarray(a["data"]) for a in mesh.attributes}
    near = {"POSITION": 1 / 65000, "NORMAL": 2e-3, "TEXCOORD_0": 1 / 65000, "TANGENT": 0}
    shape = dome()
    for name, at in extension["attributes"].items():
        np.testing.assert_allclose(by_id[at], shape[name], atol=near[name])
        assert glb.root["accessors"][first["attributes"][name]]["count"] == len(shape[name])
    np.testing.assert_array_equal(mesh.faces, shape["triangles"])
    for image in glb.root["images"]:
        assert image["mimeType"] == "image/webp"
        (tmp_path / "x.webp").write_bytes(glb.view(image["bufferView"]))
        pixels = np.round(read_image(tmp_path / "x.webp") * 255)
        name = [n for n in maps if n in MAPS][glb.root["images"].index(image)]
        if name in ("orm", "normal"):
            np.testing.assert_array_equal(pixels, MAPS[name])
    issues = khronos_issues(out / f"{NAME}.glb")
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]


def test_web_parts_that_share_vertices_keep_those_that_they_use(tmp_path: Path) -> None:
    out = made(tmp_path, "web", half=True)
    import DracoPy

    glb, shape = Glb.read(out / f"{NAME}.glb"), dome()
    part = glb.primitives()[1]
    mesh = DracoPy.decode(glb.view(part["extensions"]["KHR_draco_mesh_compression"]["bufferView"]))
    triangles = shape["triangles"][::2][:40]
    assert len(mesh.points) == len(np.unique(triangles)) < len(shape["POSITION"])
    assert glb.root["accessors"][part["attributes"]["POSITION"]]["count"] == len(mesh.points)
    np.testing.assert_allclose(mesh.points[mesh.faces], shape["POSITION"][triangles], atol=1 / 65000)


# ---------------------------------------------------------------------------------------------------- USD


@pytest.mark.parametrize("maps", [("albedo", "orm"), EVERYTHING], ids=["plain", "all"])
def test_usd_passes_its_own_validators(tmp_path: Path, maps: tuple[str, ...]) -> None:
    out = made(tmp_path, "usd", maps, apart=True)
    validation = pytest.importorskip("pxr.UsdValidation")
    from pxr import Usd

    for suffix in ("usdc", "usdz"):
        stage = Usd.Stage.Open(str(out / f"{NAME}.{suffix}"))
        validators = validation.ValidationRegistry().GetOrLoadAllValidators()
        found = validation.ValidationContext(validators).Validate(stage)
        assert [error.GetMessage() for error in found] == []


def test_an_emission_without_a_picture_is_a_colour(tmp_path: Path) -> None:
    usd, mtlx = (made(tmp_path / target, target, ("albedo", "orm", "glow")) for target in ("usd", "materialx"))
    from pxr import Usd

    stage = Usd.Stage.Open(str(usd / f"{NAME}.usdc"))
    assert stage.GetAttributeAtPath(f"/{NAME}/Materials/a_paint/surface.inputs:emissiveColor").Get() == (0.5, 0.25, 0)
    assert 'value="0.5, 0.25, 0"' in (mtlx / f"{NAME}.mtlx").read_text()


def test_usd_says_what_it_means(tmp_path: Path) -> None:
    out = made(tmp_path, "usd", EVERYTHING)
    from pxr import Usd, UsdGeom, UsdShade

    stage = Usd.Stage.Open(str(out / f"{NAME}.usdz"))
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    spaces, meshes = {}, []
    for prim in stage.Traverse():
        shader = UsdShade.Shader(prim)
        if shader and shader.GetIdAttr().Get() == "UsdUVTexture":
            file = shader.GetInput("file").Get()
            assert file.resolvedPath, f"{file.path} is not in the package"
            spaces[prim.GetName()] = shader.GetInput("sourceColorSpace").Get()
        if prim.IsA(UsdGeom.Mesh):
            meshes.append(UsdGeom.Mesh(prim))
    assert spaces == {"albedo": "sRGB", "orm": "raw", "normal": "raw", "emission": "sRGB"}
    shape = dome()
    np.testing.assert_array_equal(meshes[0].GetPointsAttr().Get(), shape["POSITION"])
    np.testing.assert_array_equal(meshes[0].GetNormalsAttr().Get(), shape["NORMAL"])
    st = UsdGeom.PrimvarsAPI(meshes[0]).GetPrimvar("st").Get()
    np.testing.assert_allclose(st, shape["TEXCOORD_0"] * (1, -1) + (0, 1), atol=1e-6)
    matrix = UsdGeom.XformCache().GetLocalToWorldTransform(meshes[0].GetPrim())
    np.testing.assert_allclose(np.array(matrix).T, TURNED)
    material, _ = UsdShade.MaterialBindingAPI(meshes[1].GetPrim()).ComputeBoundMaterial()
    assert material.GetPrim().GetName() == "b_paint"
    surface = UsdShade.Shader(stage.GetPrimAtPath(f"{material.GetPath()}/surface"))
    inputs = {i.GetBaseName(): i.GetConnectedSources()[0][0].sourceName for i in surface.GetInputs()}
    assert inputs == {"diffuseColor": "rgb", "roughness": "g", "metallic": "b", "occlusion": "r", "normal": "rgb",
                      "emissiveColor": "rgb"}  # fmt: skip


# ---------------------------------------------------------------------------------------------------- MaterialX


@pytest.mark.parametrize("maps", [("albedo", "orm"), EVERYTHING, ("albedo", "orm", "glow")], ids=["plain", "all", "glow"])
def test_materialx_validates_and_compiles(tmp_path: Path, maps: tuple[str, ...]) -> None:
    out = made(tmp_path, "materialx", maps, apart=True)
    mx = pytest.importorskip("MaterialX")
    from MaterialX import PyMaterialXGenGlsl as glsl
    from MaterialX import PyMaterialXGenShader as shaders

    search, library, document = mx.getDefaultDataSearchPath(), mx.createDocument(), mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), search, library)
    mx.readFromXmlFile(document, str(out / f"{NAME}.mtlx"))
    document.setDataLibrary(library)
    assert document.validate() == (True, "")
    names = [node.getName() for node in document.getMaterialNodes()]
    assert sorted(names) == ["a_paint", "a_paint_standard_surface", "b_paint", "b_paint_standard_surface"]
    for file in (e.getValueString() for e in document.traverseTree() if e.isA(mx.Input) and e.getType() == "filename"):
        assert (out / file).is_file()
    generator = glsl.GlslShaderGenerator.create()
    context = shaders.GenContext(generator)
    context.registerSourceCodeSearchPath(search)
    colours = shaders.DefaultColorManagementSystem.create(generator.getTarget())
    colours.loadLibrary(library)
    generator.setColorManagementSystem(colours)
    for node in document.getMaterialNodes():
        code = generator.generate(node.getName(), node, context).getSourceCode("pixel")
        assert all(f"{role}_map_file" in code for role in maps if role in MAPS)
        assert "srgb_texture_to_lin_rec709" in code


# ---------------------------------------------------------------------------------------------------- what goes wrong


def one_line(error: pytest.ExceptionInfo[BaseException], *words: str) -> None:
    assert "\n" not in str(error.value)
    for word in words:
        assert word in str(error.value)


def test_foreign_missing_older_and_damaged_assets(tmp_path: Path) -> None:
    options = ExportOptions("blender")
    with pytest.raises(ArtifactError) as caught:
        export(tmp_path, tmp_path / "out", options)
    one_line(caught, "bake.json", "dreammat bake")
    with pytest.raises(ArtifactError) as caught:
        export(tmp_path / "gone", tmp_path / "out", options)
    one_line(caught, "gone")
    asset = save_asset(tmp_path / "asset")
    (asset / "albedo.png").rename(tmp_path / "kept.png")
    with pytest.raises(ArtifactError) as caught:
        export(asset, tmp_path / "out", options)
    one_line(caught, "albedo.png: missing")
    (tmp_path / "kept.png").rename(asset / "albedo.png")
    manifest = (asset / "bake.json").read_text()
    (asset / "bake.json").write_text(json.dumps({**json.loads(manifest), "version": 0}))
    with pytest.raises(ArtifactError) as caught:
        export(asset, tmp_path / "out", options)
    one_line(caught, "version 0, expected")
    (asset / "bake.json").write_text(manifest)
    whole = (asset / "model.glb").read_bytes()
    (asset / "model.glb").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ArtifactError) as caught:
        export(asset, tmp_path / "out", options)
    one_line(caught, "model.glb", "bake the asset again")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["asset"]


def test_a_model_that_is_whole_and_yet_no_model_of_ours(tmp_path: Path) -> None:
    asset = save_asset(tmp_path / "asset")
    provenance, files = read_manifest(asset, ASSET)
    for content in (b"", b"glTF" + bytes(60), (asset / "albedo.png").read_bytes()):
        (asset / "model.glb").write_bytes(content)
        write_manifest(asset, ASSET, provenance, sorted(files))
        with pytest.raises(ArtifactError) as caught:
            read_asset(asset)
        one_line(caught, "model.glb: not a model that bake wrote")


def test_a_missing_package_is_named_with_its_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asset = save_asset(tmp_path / "asset")
    for target, (module, package) in export_module.EXTRAS.items():
        monkeypatch.setitem(sys.modules, module, None)
        with pytest.raises(InputError) as caught:
            export(asset, tmp_path / "out", ExportOptions(target))
        one_line(caught, package, f'pip install ".[{target}]"')
    assert not (tmp_path / "out").exists()


def test_no_space_leaves_nothing_and_an_earlier_export_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asset, out = save_asset(tmp_path / "asset"), tmp_path / "out"
    export(asset, out, ExportOptions("unreal"))
    before = {p.name: p.read_bytes() for p in out.iterdir()}

    def no_space(*args: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("stages.asset.engines.write_pixels", no_space)
    for target in (out, tmp_path / "new"):
        with pytest.raises(OutputError) as caught:
            export(asset, target, ExportOptions("unity-hdrp"), force=True)
        one_line(caught, "no space left on device; free some space")
    assert {p.name: p.read_bytes() for p in out.iterdir()} == before
    assert {p.name for p in tmp_path.iterdir()} == {"asset", "out"}


def test_another_target_replaces_the_files_of_the_first_and_nothing_else(tmp_path: Path) -> None:
    asset, out = save_asset(tmp_path / "asset"), tmp_path / "out"
    export(asset, out, ExportOptions("unreal"))
    (out / "mine.meta").write_text("not ours")
    export(asset, out, ExportOptions("blender"))
    assert {p.name for p in out.iterdir()} == {"mine.meta", f"{NAME}.glb", "export.json"}


def test_files_that_are_not_an_exports_are_never_overwritten(tmp_path: Path) -> None:
    asset = save_asset(tmp_path / "asset")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / f"{NAME}.glb").write_text("mine")
    (tmp_path / "file").write_text("a file")
    for out in (tmp_path / "mine", tmp_path / "file"):
        with pytest.raises(OutputError) as caught:
            export(asset, out, ExportOptions("blender"))
        one_line(caught, out.name)
    assert (tmp_path / "mine" / f"{NAME}.glb").read_text() == "mine"
    assert (tmp_path / "file").read_text() == "a file"


def test_unknown_target() -> None:
    with pytest.raises(InputError, match="maya; expected one of blender"):
        ExportOptions("maya")


@pytest.mark.parametrize(
    ("given", "safe"),
    [("chair", "chair"), ("my chair (2)", "my_chair_2"), ("3d", "_3d"), ("стул", "asset"), ("", "asset"), ("a.b", "a_b")],
)
def test_names_are_safe_everywhere(given: str, safe: str) -> None:
    assert identifier(given) == safe


def test_equal_names_are_told_apart_whatever_their_case() -> None:
    assert unique(["a", "A", "a", "a_2"]) == ["a", "A_2", "a_3", "a_2_2"]


def test_a_picture_of_another_size_is_averaged() -> None:
    big = np.arange(64, dtype=np.uint8).reshape(8, 8, 1) * 4
    np.testing.assert_allclose(resized(big, 4, 4)[0, 0, 0], big[:2, :2].mean(), atol=1)
    assert resized(big, 8, 8) is big


@pytest.mark.parametrize("step", [2, 3, 8])
def test_whole_blocks_are_averaged_as_by_openimageio(step: int) -> None:
    big = np.random.default_rng(0).integers(0, 256, (step * 9, step * 7, 3), np.uint8)
    roi = oiio.ROI(0, 7, 0, 9, 0, 1, 0, 3)
    theirs = oiio.ImageBufAlgo.resize(oiio.ImageBuf(big), filtername="box", roi=roi).get_pixels(oiio.UINT8)
    assert abs(block_means(big, step).astype(int) - theirs.reshape(9, 7, 3)).max() <= 1
    np.testing.assert_array_equal(resized(big, 7, 9), block_means(big, step))
