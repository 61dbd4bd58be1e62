"""USD: small stages that the test writes with usd-core, with everything that studios put into one."""

import sys
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdSkel, Vt

from stages.core.artifact import load_npz
from stages.core.errors import InputError
from stages.core.schemas import PREP
from stages.prep.options import PrepOptions
from stages.prep.read_usd import layers, read_usd
from stages.prep.stage import prep
from tests.prep.test_stage import check_promises

POINTS = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0), (1, 2, 0), (0, 0, 1), (2, 0, 1), (9, 9, 9)]
COUNTS, CORNERS = [5, 4, 3], [0, 1, 2, 4, 3, 0, 5, 6, 1, 0, 3, 5]
LAYOUT = [(0.1, 0.1), (0.4, 0.1), (0.4, 0.3), (0.25, 0.4), (0.1, 0.3), (0.6, 0.1), (0.6, 0.3), (0.9, 0.3), (0.9, 0.1),
          (0.6, 0.6), (0.8, 0.6), (0.6, 0.8)]  # fmt: skip


def stage_at(path: Path, up: str = "Y", unit: float = 1.0) -> Usd.Stage:
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, up)
    UsdGeom.SetStageMetersPerUnit(stage, unit)
    return stage


def house(stage: Usd.Stage, path: str) -> UsdGeom.Mesh:
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(POINTS)
    mesh.CreateFaceVertexCountsAttr(COUNTS)
    mesh.CreateFaceVertexIndicesAttr(CORNERS)
    mesh.CreateSubdivisionSchemeAttr("none")
    return mesh


def primvar(mesh: UsdGeom.Mesh, name: str, kind: Sdf.ValueTypeName, how: str, values: list, rows: list | None = None) -> None:
    made = UsdGeom.PrimvarsAPI(mesh.GetPrim()).CreatePrimvar(name, kind, how)
    made.Set(values)
    if rows is not None:
        made.SetIndices(Vt.IntArray(rows))


def saved(stage: Usd.Stage) -> Path:
    stage.Save()
    return Path(stage.GetRootLayer().realPath)


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usd"])
def test_polygons_slots_normals_and_uv_sets(tmp_path: Path, suffix: str) -> None:
    stage = stage_at(tmp_path / f"a{suffix}")
    mesh = house(stage, "/Welt/Haus/Netz")
    stage.GetPrimAtPath("/Welt/Haus").SetTypeName("Xform")
    primvar(mesh, "lightmap", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying", LAYOUT)
    primvar(mesh, "st", Sdf.ValueTypeNames.Float2Array, "faceVarying", [(0, 0), (5, 5)], [0, 1] * 6)
    primvar(mesh, "width", Sdf.ValueTypeNames.Float2Array, "vertex", [(0, 0)] * 8)
    primvar(mesh, "normals", Sdf.ValueTypeNames.Normal3fArray, "uniform", [(0, 0, -1), (0, -1, 0), (-1, 0, 0)])
    for name in ("Ziegel", "Dach"):
        UsdShade.Material.Define(stage, f"/Welt/{name}")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(UsdShade.Material.Get(stage, "/Welt/Ziegel"))
    subset = UsdGeom.Subset.CreateGeomSubset(mesh, "oben", "face", [1], "materialBind")
    UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(UsdShade.Material.Get(stage, "/Welt/Dach"))
    source = read_usd(saved(stage))
    assert source.format == "usd" and np.diff(source.loop_start).tolist() == COUNTS
    assert source.loop_vertex.tolist() == CORNERS and len(source.vertices) == 8
    assert [(part.name, part.material) for part in source.parts] == [("Netz", "Ziegel"), ("Netz", "Dach")]
    assert source.face_part.tolist() == [0, 1, 0] and not source.skipped
    assert source.normals[source.loop_normal][[0, 5, 9]].tolist() == [[0, 0, -1], [0, -1, 0], [-1, 0, 0]]
    first, second = source.by_uv_set()
    assert first.uv[first.loop_uv].tolist() == [[0, 0], [5, 5]] * 6
    np.testing.assert_allclose(second.uv[second.loop_uv], LAYOUT, atol=1e-7)


def test_axes_unit_and_places_are_in_the_transforms(tmp_path: Path) -> None:
    """A +z up stage in centimetres; a parent turns, the mesh is scaled."""
    stage = stage_at(tmp_path / "a.usda", "Z", 0.01)
    top = UsdGeom.Xform.Define(stage, "/Gruppe")
    top.AddRotateZOp().Set(90)
    mesh = house(stage, "/Gruppe/Haus")
    mesh.AddTranslateOp().Set((10, 0, 5))
    mesh.AddScaleOp().Set((1, 1, 3))
    placed = read_usd(saved(stage)).placed_vertices()
    file_frame = np.array([(-1, 12, 5), (0, 10, 8)])  # vertices 2 and 5
    np.testing.assert_allclose(placed[[2, 5]], file_frame[:, [0, 2, 1]] * [1, 1, -1] * 0.01, atol=1e-9)


def test_blenders_object_names_are_the_nodes(tmp_path: Path) -> None:
    stage = stage_at(tmp_path / "a.usda")
    UsdGeom.Xform.Define(stage, "/Stuhl")
    house(stage, "/Stuhl/Cube_001")
    assert read_usd(saved(stage)).parts[0].node == "Stuhl"


def test_only_what_a_renderer_shows(tmp_path: Path) -> None:
    """Hidden and guide geometry is left out and counted, and so are shapes that are no meshes."""
    stage = stage_at(tmp_path / "a.usda")
    house(stage, "/Haus")
    UsdGeom.Imageable(house(stage, "/Versteckt")).MakeInvisible()
    UsdGeom.Imageable(house(stage, "/Huelle")).CreatePurposeAttr("guide")
    UsdGeom.Sphere.Define(stage, "/Kugel")
    over = stage.OverridePrim("/Nichts")
    over.SetActive(False)
    cage = house(stage, "/Kaefig")
    cage.CreateSubdivisionSchemeAttr("catmullClark")
    source = read_usd(saved(stage))
    assert [part.node for part in source.parts] == ["Haus", "Kaefig"]
    assert source.skipped == {"hidden_nodes": 1, "proxies_and_guides": 1, "usd_sphere": 1, "subdivision_levels": 1}


def test_instances_of_both_kinds(tmp_path: Path) -> None:
    """Scene-graph instances, and a point instancer whose prototype stands elsewhere and is itself not drawn."""
    stage = stage_at(tmp_path / "a.usda")
    house(stage, "/Vorlage/Haus")
    for k in range(2):
        prim = UsdGeom.Xform.Define(stage, f"/Kopie{k}")
        prim.AddTranslateOp().Set((10.0 * k, 0, 0))
        prim.GetPrim().GetReferences().AddInternalReference("/Vorlage")
        prim.GetPrim().SetInstanceable(True)
    UsdGeom.Imageable(UsdGeom.Xform.Define(stage, "/Vorlage")).MakeInvisible()
    for k in range(2):
        UsdGeom.Imageable(stage.GetPrimAtPath(f"/Kopie{k}")).CreateVisibilityAttr("inherited")
    instancer = UsdGeom.PointInstancer.Define(stage, "/Wald")
    instancer.AddTranslateOp().Set((0, 100, 0))
    tree = UsdGeom.Xform.Define(stage, "/Wald/Baum")
    tree.AddTranslateOp().Set((0, 0, 1))
    house(stage, "/Wald/Baum/Krone").AddScaleOp().Set((2, 2, 2))
    instancer.CreatePrototypesRel().AddTarget("/Wald/Baum")
    instancer.CreateProtoIndicesAttr([0, 0, 0])
    instancer.CreatePositionsAttr([(0, 0, 0), (5, 0, 0), (6, 0, 0)])
    instancer.CreateScalesAttr([(1, 1, 1), (1, 1, 1), (3, 3, 3)])
    instancer.CreateIdsAttr([0, 1, 2])
    instancer.InvisId(1, Usd.TimeCode.Default())
    source = read_usd(saved(stage))
    placed = source.placed_vertices().reshape(-1, 8, 3)
    np.testing.assert_allclose(placed[:, 1], [(2, 0, 0), (12, 0, 0), (4, 100, 1), (18, 100, 3)])
    assert source.applied == {"instances": 2} and source.skipped == {"hidden_nodes": 1}


def test_left_handed_faces_are_turned(tmp_path: Path) -> None:
    stage = stage_at(tmp_path / "a.usda")
    mesh = house(stage, "/Haus")
    mesh.CreateOrientationAttr("leftHanded")
    primvar(mesh, "st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex", [(k / 8, 0) for k in range(8)])
    source = read_usd(saved(stage))
    assert source.loop_vertex.tolist() == [0, 3, 4, 2, 1, 0, 1, 6, 5, 0, 5, 3]
    np.testing.assert_allclose(source.uv[source.loop_uv, 0], source.loop_vertex / 8)


def skinned_stage(path: Path) -> Path:
    """The roof's vertex hangs on a joint that an animation lifts by 5; the others on one that stays."""
    stage = stage_at(path)
    UsdSkel.Root.Define(stage, "/Figur")
    skeleton = UsdSkel.Skeleton.Define(stage, "/Figur/Skelett")
    skeleton.CreateJointsAttr(["unten", "oben"])
    eye = Gf.Matrix4d(1.0)
    skeleton.CreateBindTransformsAttr([eye, eye])
    skeleton.CreateRestTransformsAttr([eye, eye])
    animation = UsdSkel.Animation.Define(stage, "/Figur/Bewegung")
    animation.CreateJointsAttr(["unten", "oben"])
    animation.CreateTranslationsAttr().Set([(0, 0, 0), (0, 5, 0)], 1.0)
    animation.CreateRotationsAttr([Gf.Quatf(1, 0, 0, 0)] * 2)
    animation.CreateScalesAttr(Vt.Vec3hArray([(1, 1, 1)] * 2))
    mesh = house(stage, "/Figur/Haus")
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets(["/Figur/Skelett"])
    binding.CreateJointIndicesPrimvar(False, 1).Set([0, 0, 0, 0, 1, 0, 0, 0])
    binding.CreateJointWeightsPrimvar(False, 1).Set([1.0] * 8)
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets(["/Figur/Bewegung"])
    stage.SetStartTimeCode(1)
    stage.SetEndTimeCode(2)
    return saved(stage)


def test_a_skin_is_applied_at_the_first_time(tmp_path: Path) -> None:
    path = skinned_stage(tmp_path / "a.usda")
    before = path.read_bytes()
    source = read_usd(path)
    np.testing.assert_allclose(source.placed_vertices()[[2, 4]], [(2, 1, 0), (1, 7, 0)], atol=1e-5)
    assert source.applied == {"skins_in_their_first_pose": 1} and path.read_bytes() == before


def test_layers_beside_the_stage_are_inputs(tmp_path: Path) -> None:
    """A change of a referenced file makes prep.npz out of date; a reference that leads nowhere is said."""
    part = stage_at(tmp_path / "part.usda")
    house(part, "/Haus")
    part.SetDefaultPrim(part.GetPrimAtPath("/Haus"))
    saved(part)
    stage = stage_at(tmp_path / "a.usda")
    stage.DefinePrim("/Haus").GetReferences().AddReference("./part.usda")
    stage.DefinePrim("/Fort").GetReferences().AddReference("./gone.usda")
    path = saved(stage)
    assert layers(path) == {"part.usda": tmp_path / "part.usda"}
    options = PrepOptions(unwrap_triangles=0, texture_size=256, padding=1)
    found = prep(path, tmp_path / "a.npz", options).findings
    assert found["skipped"] == {"references_that_cannot_be_found": 1} and found["faces"] == 3
    assert prep(path, tmp_path / "a.npz", options).up_to_date
    (tmp_path / "part.usda").write_text((tmp_path / "part.usda").read_text() + "# touched\n")
    assert not prep(path, tmp_path / "a.npz", options).up_to_date


def test_a_usdz_goes_through_the_stage(tmp_path: Path) -> None:
    """Its layout for light maps is kept where its first UV set tiles."""
    stage = stage_at(tmp_path / "a.usdc", "Z")
    mesh = house(stage, "/Haus")
    primvar(mesh, "st", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying", [(0, 0), (5, 5)], [0, 1] * 6)
    primvar(mesh, "st1", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying", LAYOUT)
    saved(stage)
    from pxr import UsdUtils

    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "a.usdc"), str(tmp_path / "a.usdz"))
    found = prep(tmp_path / "a.usdz", tmp_path / "a.npz", PrepOptions()).findings
    made = load_npz(tmp_path / "a.npz", PREP)
    check_promises(made)
    assert found["uv_set"] == 1 and made.provenance.extra["source_format"] == "usd"


@pytest.mark.parametrize("suffix, content", [(".usda", b"#usda 1.0\n{"), (".usdc", b"PXR-USDC" + b"\xff" * 200),
                                             (".usdz", b"PK\3\4"), (".usd", b"\0" * 64)])  # fmt: skip
def test_files_that_are_none_are_refused_in_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], suffix: str, content: bytes
) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError) as raised:
        read_usd(path)
    assert str(raised.value).startswith(str(path)) and "\n" not in str(raised.value)
    assert capfd.readouterr().err == ""


def broken(mesh: UsdGeom.Mesh, what: str) -> None:
    if what == "corner":
        mesh.CreateFaceVertexIndicesAttr([*CORNERS[:-1], 99])
    elif what == "count":
        mesh.CreateFaceVertexCountsAttr([5, 4, 9])
    elif what == "empty":
        mesh.CreateFaceVertexCountsAttr([])
        mesh.CreateFaceVertexIndicesAttr([])


@pytest.mark.parametrize("what, cause", [("corner", "vertex 99"), ("count", "not a sound"), ("empty", "0 faces")])
def test_meshes_that_are_none_are_refused(tmp_path: Path, what: str, cause: str) -> None:
    stage = stage_at(tmp_path / "a.usda")
    broken(house(stage, "/Haus"), what)
    with pytest.raises(InputError, match=cause):
        read_usd(saved(stage))


def test_the_extra_is_named_where_it_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pxr.Gf", None)
    with pytest.raises(InputError, match=r"a.usd: USD needs usd-core, not installed here; pip install \"\.\[usd\]\""):
        read_usd(tmp_path / "a.usd")


