"""FBX: a small ASCII file of the test's own making, with everything that studios put into one."""

import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import stages.prep.read_fbx as reader
from stages.asset.model import source_model
from stages.core.artifact import load_npz
from stages.core.errors import InputError
from stages.core.frames import transform_points
from stages.core.schemas import PREP
from stages.prep.options import PrepOptions
from stages.prep.read_fbx import read_fbx
from stages.prep.stage import prep
from tests.prep.test_stage import check_promises

HEADER = """; FBX 7.4.0 project file
FBXHeaderExtension:  {{
	FBXVersion: 7400
}}
GlobalSettings:  {{
	Version: 1000
	Properties70:  {{
		P: "UpAxis", "int", "Integer", "",{up}
		P: "UpAxisSign", "int", "Integer", "",1
		P: "FrontAxis", "int", "Integer", "",{front}
		P: "FrontAxisSign", "int", "Integer", "",{sign}
		P: "CoordAxis", "int", "Integer", "",0
		P: "CoordAxisSign", "int", "Integer", "",1
		P: "UnitScaleFactor", "double", "Number", "",{unit}
	}}
}}
"""
GEOMETRY = """	Geometry: 100, "Geometry::house", "Mesh" {
		Vertices: *24 { a: 0,0,0, 2,0,0, 2,1,0, 0,1,0, 1,2,0, 0,0,1, 2,0,1, 9,9,9 }
		PolygonVertexIndex: *12 { a: 0,1,2,4,-4, 0,5,6,-2, 0,3,-6 }
		LayerElementNormal: 0 {
			MappingInformationType: "ByPolygonVertex"
			ReferenceInformationType: "Direct"
			Normals: *36 { a: NORMALS }
		}
		LayerElementUV: 0 {
			Name: "tiled"
			MappingInformationType: "ByPolygonVertex"
			ReferenceInformationType: "IndexToDirect"
			UV: *4 { a: 0,0,5,5 }
			UVIndex: *12 { a: 0,1,1,1,0,0,1,1,0,0,1,1 }
		}
		LayerElementUV: 1 {
			Name: "lightmap"
			MappingInformationType: "ByPolygonVertex"
			ReferenceInformationType: "Direct"
			UV: *24 { a: 0.1,0.1,0.4,0.1,0.4,0.3,0.25,0.4,0.1,0.3, 0.6,0.1,0.6,0.3,0.9,0.3,0.9,0.1, 0.6,0.6,0.8,0.6,0.6,0.8 }
		}
		LayerElementMaterial: 0 {
			MappingInformationType: "ByPolygon"
			ReferenceInformationType: "IndexToDirect"
			Materials: *3 { a: 0,1,0 }
		}
		Layer: 0 {
			LayerElement:  { Type: "LayerElementNormal" TypedIndex: 0 }
			LayerElement:  { Type: "LayerElementMaterial" TypedIndex: 0 }
			LayerElement:  { Type: "LayerElementUV" TypedIndex: 0 }
		}
		Layer: 1 {
			LayerElement:  { Type: "LayerElementUV" TypedIndex: 1 }
		}
	}
""".replace("NORMALS", ", ".join(["0,0,-1"] * 5 + ["0,-1,0"] * 4 + ["-1,0,0"] * 3))


def model(key: int, name: str, *properties: str, kind: str = "Mesh") -> str:
    lines = "".join(f"\t\t\tP: {entry}\n" for entry in properties)
    return f'\tModel: {key}, "Model::{name}", "{kind}" {{\n\t\tProperties70:  {{\n{lines}\t\t}}\n\t}}\n'


def moved(x: float, y: float, z: float) -> str:
    return f'"Lcl Translation", "Lcl Translation", "", "A",{x},{y},{z}'


def write_fbx(path: Path, objects: str, links: list[str], up: str = "y", unit: float = 1.0) -> Path:
    """An FBX 7.4 text file. unit: centimetres. links: entries of Connections."""
    axes = {"up": 1, "front": 2, "sign": 1} if up == "y" else {"up": 2, "front": 1, "sign": -1}
    slots = {300: "Ziegel", 301: "Dach"}
    materials = "".join(f'\tMaterial: {key}, "Material::{name}", "" {{ Version: 102 }}\n' for key, name in slots.items())
    connections = "".join(f"\tC: {link}\n" for link in links)
    body = f"Objects:  {{\n{GEOMETRY}{objects}{materials}}}\nConnections:  {{\n{connections}}}\n"
    path.write_text(HEADER.format(unit=unit, **axes) + body, encoding="utf-8")
    return path


HOUSE = ['"OO",100,200', '"OO",300,200', '"OO",301,200']


def test_polygons_slots_normals_and_uv_sets(tmp_path: Path) -> None:
    """Faces keep their corners, also of one vertex that no face uses; all UV sets are there; centimetres become metres."""
    path = write_fbx(tmp_path / "a.fbx", model(200, "Haus", moved(100, 0, 0)), ['"OO",200,0', *HOUSE])
    source = read_fbx(path)
    assert source.format == "fbx" and np.diff(source.loop_start).tolist() == [5, 4, 3]
    assert source.loop_vertex.tolist() == [0, 1, 2, 4, 3, 0, 5, 6, 1, 0, 3, 5]
    assert [(part.name, part.node, part.material) for part in source.parts] == [
        ("house", "Haus", "Ziegel"), ("house", "Haus", "Dach"),
    ]  # fmt: skip
    assert source.face_part.tolist() == [0, 1, 0] and len(source.vertices) == 8
    np.testing.assert_allclose(source.placed_vertices()[1], [1.02, 0, 0])
    assert source.normals[source.loop_normal][[0, 5, 9]].tolist() == [[0, 0, -1], [0, -1, 0], [-1, 0, 0]]
    first, second = source.by_uv_set()
    assert first.uv[first.loop_uv].max() == 5
    np.testing.assert_allclose(second.uv[second.loop_uv][[0, 5, 11]], [(0.1, 0.1), (0.6, 0.1), (0.6, 0.8)])


def test_the_files_axes_and_unit_are_in_the_transforms(tmp_path: Path) -> None:
    """A +z up file in inches, a parent that turns, a pivot's offset that only the geometry has."""
    objects = model(210, "Gruppe", '"Lcl Rotation", "Lcl Rotation", "", "A",0,0,90', kind="Null")
    objects += model(200, "Haus", moved(10, 0, 0), '"GeometricTranslation", "Vector3D", "Vector", "",0,0,5')
    path = write_fbx(tmp_path / "a.fbx", objects, ['"OO",210,0', '"OO",200,210', *HOUSE], up="z", unit=2.54)
    inches = np.array([(-1, 12, 5), (0, 10, 5)])  # vertices 2 and 0 turned by 90 degrees about z, in the file's frame
    np.testing.assert_allclose(
        read_fbx(path).placed_vertices()[[2, 0]], inches[:, [0, 2, 1]] * [1, 1, -1] * 0.0254, atol=1e-9
    )


def test_instances_hidden_nodes_and_levels_of_detail(tmp_path: Path) -> None:
    """One geometry on several nodes is there several times; what hides a node hides what hangs on it."""
    hidden = '"Visibility", "Visibility", "", "A",0'
    objects = model(200, "Haus") + model(201, "Zweites", moved(0, 300, 0)) + model(202, "Versteckt", hidden)
    objects += model(203, "Darunter") + model(220, "Stufen", kind="LodGroup")
    objects += model(204, "Stufe_0") + model(205, "Stufe_1")
    objects += '\tNodeAttribute: 400, "NodeAttribute::", "LodGroup" {\n\t\tTypeFlags: "LodGroup"\n\t}\n'
    parents = {200: 0, 201: 0, 202: 0, 203: 202, 220: 0, 204: 220, 205: 220}
    links = [f'"OO",{child},{parent}' for child, parent in parents.items()] + ['"OO",400,220']
    links += [f'"OO",100,{node}' for node in (200, 201, 202, 203, 204, 205)]
    source = read_fbx(write_fbx(tmp_path / "a.fbx", objects, links))
    assert [part.node for part in source.parts] == ["Haus", "Zweites", "Stufe_0"]
    assert source.skipped == {"hidden_nodes": 2, "lower_levels_of_detail": 1}
    assert len(source.vertices) == 24 and source.placed_vertices()[8].tolist() == [0, 3, 0]


def test_a_skin_is_applied_as_the_bones_stand(tmp_path: Path) -> None:
    """A cluster binds the roof's vertex to a bone that has moved up by 50 since."""
    objects = model(200, "Haus") + model(230, "Knochen", moved(0, 50, 0), kind="LimbNode")
    objects += '\tDeformer: 500, "Deformer::", "Skin" { Version: 101 }\n'
    eye = "1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1"
    for key, indices in ((501, "4"), (502, "0,1,2,3,5,6,7")):
        count = len(indices.split(","))
        objects += (
            f'\tDeformer: {key}, "SubDeformer::", "Cluster" {{\n\t\tVersion: 100\n\t\tIndexes: *{count} {{ a: {indices} }}\n'
            f'\t\tWeights: *{count} {{ a: {",".join("1" * count)} }}\n\t\tTransform: *16 {{ a: {eye} }}\n'
            f"\t\tTransformLink: *16 {{ a: {eye} }}\n\t}}\n"
        )
    objects += model(231, "Wurzel", kind="LimbNode")
    links = ['"OO",200,0', '"OO",230,0', '"OO",231,0', *HOUSE, '"OO",500,100', '"OO",501,500', '"OO",502,500',
             '"OO",230,501', '"OO",231,502']  # fmt: skip
    source = read_fbx(write_fbx(tmp_path / "a.fbx", objects, links))
    placed = source.placed_vertices() * 100
    np.testing.assert_allclose(placed[4], [1, 52, 0], atol=1e-6)
    np.testing.assert_allclose(placed[2], [2, 1, 0], atol=1e-6)
    assert source.applied == {"skins_in_their_default_pose": 1}


def test_an_fbx_goes_through_the_stage_to_the_model(tmp_path: Path) -> None:
    """Its second UV set can be baked and is kept."""
    path = write_fbx(tmp_path / "a.fbx", model(200, "Haus", moved(7, 0, 0)), ['"OO",200,0', *HOUSE], up="z")
    found = prep(path, tmp_path / "a.npz", PrepOptions()).findings
    made = load_npz(tmp_path / "a.npz", PREP)
    check_promises(made)
    assert found["uv_set"] == 1 and made.provenance.extra["source_format"] == "fbx"
    model_parts = source_model(made, double_sided=False).parts
    slots = [(part.node, part.worn.name, len(part.triangles)) for part in model_parts]
    assert slots == [("Haus", "Ziegel", 4), ("Haus", "Dach", 2)]
    tip = transform_points(model_parts[0].transform, model_parts[0].positions.astype(float))[4]
    np.testing.assert_allclose(tip, [0.08, 0, -0.02], atol=1e-9)  # +z up, centimetres: (8, 2, 0)
    assert prep(path, tmp_path / "a.npz", PrepOptions()).up_to_date


@pytest.mark.parametrize("content", [b"Kaydara FBX Binary  \0\x1a\0\xe8\x1c\0\0" + b"\xff" * 64, b"PNG", b"\0" * 100])
def test_files_that_are_none_are_refused_in_one_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.fbx"
    path.write_bytes(content)
    with pytest.raises(InputError) as raised:
        read_fbx(path)
    assert str(raised.value).startswith(str(path)) and "\n" not in str(raised.value)


def test_an_fbx_without_a_mesh(tmp_path: Path) -> None:
    path = write_fbx(tmp_path / "a.fbx", model(200, "Leer", kind="Null"), ['"OO",200,0'])
    with pytest.raises(InputError, match="0 vertices and 0 faces"):
        read_fbx(path)


def test_the_extra_is_named_where_it_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "find_spec", lambda name: None if name == "ufbx" else find_spec(name))
    with pytest.raises(InputError, match=r"a.fbx: FBX needs ufbx, not installed here; pip install \"\.\[fbx\]\""):
        read_fbx(tmp_path / "a.fbx")
    assert "ufbx" not in sys.modules
