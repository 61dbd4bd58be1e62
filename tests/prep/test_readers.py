"""Each format is read as it is written, and what cannot be read is refused in one line that names the file."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from stages.core.errors import InputError
from stages.prep.gltf_file import companions
from stages.prep.read_gltf import read_gltf
from stages.prep.read_obj import read_obj
from stages.prep.read_off import read_off
from stages.prep.read_ply import read_ply
from stages.prep.read_stl import read_stl
from stages.prep.source import Source
from stages.prep.stage import READERS
from tests.prep.shapes import GltfBuilder, cube

TRIANGLE = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], np.float32)


def write(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def faces_of(source: Source) -> list[list[int]]:
    return [face.tolist() for face in np.split(source.loop_vertex, source.loop_start[1:-1])]


def test_obj_with_everything_at_once(tmp_path: Path) -> None:
    text = (
        "\ufeff# comment\nmtllib a.mtl\no first thing\nv 0 0 0 1 0.5 0.5 0.5\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
        "vt 0.25\nvt 0.5 0.75\nvt 1 1 0\nvn 0 0 1\nusemtl red paint\nf 1/1/1 2/2/1 3/3/1 4//1 # quad\n"
        "v 0 0 1\ns off\nusemtl blue\nf -1 \\\n 1 2\nf -5/-1 -4/-2 -3\nl 1 2\nf 1 2\nvp 1 2\r\ncurv 0 1 2\n"
    )
    source = read_obj(write(tmp_path / "a.obj", text))
    assert faces_of(source) == [[0, 1, 2, 3], [4, 0, 1], [0, 1, 2]]
    assert source.loop_uv.tolist() == [0, 1, 2, -1, -1, -1, -1, 2, 1, -1]
    assert source.loop_normal.tolist() == [0, 0, 0, 0, -1, -1, -1, -1, -1, -1]
    assert source.uv.tolist() == [[0.25, 0], [0.5, 0.75], [1, 1]]
    assert [(p.node, p.material) for p in source.parts] == [("first thing", "red paint"), ("first thing", "blue")]
    assert source.face_part.tolist() == [0, 1, 1]
    assert source.skipped == {"lines": 1, "faces_with_fewer_than_3_corners": 1, "other_statements": 1}


def test_obj_groups_are_parts_only_without_objects(tmp_path: Path) -> None:
    body = "v 0 0 0\nv 1 0 0\nv 0 1 0\n{}g a\nf 1 2 3\ng b\nf 1 2 3\ng a\nf 3 2 1\n"
    grouped = read_obj(write(tmp_path / "g.obj", body.format("")))
    assert [part.name for part in grouped.parts] == ["a", "b"] and grouped.face_part.tolist() == [0, 1, 0]
    whole = read_obj(write(tmp_path / "o.obj", body.format("o whole\n")))
    assert [(part.name, part.node) for part in whole.parts] == [("whole", "whole")]
    for source in (grouped, whole):
        assert source.groups == ["a", "b"] and source.face_group is not None
        assert source.face_group.tolist() == [0, 1, 0]


def test_obj_numbers_that_are_none(tmp_path: Path) -> None:
    """What printf writes for not-a-number is read as such, not refused."""
    source = read_obj(write(tmp_path / "a.obj", "v 1.#INF 0 0\nv nan(ind) 1 0\nv inf -inf 0\nf 1 2 3\n"))
    assert np.isnan(source.vertices[:2, 0]).all() and np.isinf(source.vertices[2, :2]).all()


PLY_ASCII = """ply
format ascii 1.0
comment made by hand
element vertex 5
property float x
property float y
property float z
property float s
property float t
element face 2
property uchar red
property list uchar int vertex_indices
end_header
0 0 0 0.5 0.25
1 0 0 0 0
1 1 0 0 0
0 1 0 0 0
0 0 1 0 0
255 4 0 1 2 3
0 3 0 1 4
"""


def test_ply_text_keeps_polygons_and_uvs(tmp_path: Path) -> None:
    source = read_ply(write(tmp_path / "a.ply", PLY_ASCII))
    assert faces_of(source) == [[0, 1, 2, 3], [0, 1, 4]]
    assert source.uv[source.loop_uv[0]].tolist() == [0.5, 0.25]


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("faces", [[[0, 1, 2], [0, 2, 3]], [[0, 1, 2, 3], [0, 1, 2], [1, 2, 3]]])
def test_ply_binary(tmp_path: Path, order: str, faces: list[list[int]]) -> None:
    """Equal and mixed face sizes, both byte orders, normals, a double and an element that is not wanted."""
    name = "little" if order == "<" else "big"
    header = (
        f"ply\nformat binary_{name}_endian 1.0\nelement camera 1\nproperty int id\nelement vertex 4\n"
        "property double x\nproperty double y\nproperty double z\nproperty float nx\nproperty float ny\n"
        f"property float nz\nelement face {len(faces)}\nproperty list uint8 uint32 vertex_index\nend_header\n"
    )
    points = np.random.default_rng(1).random((4, 3))
    body = struct.pack(order + "i", 7)
    body += b"".join(struct.pack(order + "3d3f", *point, 0, 0, 1) for point in points)
    body += b"".join(struct.pack(f"{order}B{len(face)}I", len(face), *face) for face in faces)
    source = read_ply(write(tmp_path / "a.ply", header.encode() + body))
    assert faces_of(source) == faces and np.array_equal(source.vertices, points)
    assert source.normals.tolist() == [[0, 0, 1]] * 4 and (source.loop_normal == source.loop_vertex).all()


def test_ply_uvs_per_corner(tmp_path: Path) -> None:
    text = PLY_ASCII.replace("property uchar red\n", "").replace("vertex_indices\n", "vertex_indices\n"
           "property list uchar float texcoord\n").replace("255 4 0 1 2 3", "4 0 1 2 3 8 0 0 1 0 1 1 0 1")  # fmt: skip
    source = read_ply(write(tmp_path / "a.ply", text.replace("0 3 0 1 4", "3 0 1 4 6 0 0 .5 0 .5 .5")))
    assert source.uv[source.loop_uv].tolist() == [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0], [0.5, 0], [0.5, 0.5]]


def test_stl_text_and_binary_agree(tmp_path: Path) -> None:
    vertices, triangles = cube()
    soup = vertices[triangles].astype(np.float32)
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in corners)
        + "endloop\nendfacet\n" for corners in soup
    )  # fmt: skip
    text = read_stl(write(tmp_path / "t.stl", f"solid cube\n{facets}endsolid cube\n"))
    records = b"".join(struct.pack("<12fH", 0, 0, 0, *corners.reshape(-1), 0) for corners in soup)
    # a binary file may begin with the word solid
    binary = read_stl(write(tmp_path / "b.stl", b"solid".ljust(80) + struct.pack("<I", 12) + records))
    assert np.array_equal(text.vertices, binary.vertices) and text.vertices.shape == (36, 3)


def test_off_variants(tmp_path: Path) -> None:
    plain = read_off(
        write(tmp_path / "a.off", "OFF 4 2 0 # counts\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 255 0 0\n3 0 1 2\n")
    )
    assert faces_of(plain) == [[0, 1, 2, 3], [0, 1, 2]]
    full = "STCNOFF\n3 1 0\n" + "".join(f"{x} {y} 0 0 0 1 9 9 9 1 0.{i} 0.5\n" for i, (x, y, _) in enumerate(TRIANGLE))
    source = read_off(write(tmp_path / "b.off", full + "3 0 1 2\n"))
    assert source.normals.tolist() == [[0, 0, 1]] * 3 and source.uv[1].tolist() == [0.1, 0.5]


def builder(**primitive: object) -> GltfBuilder:
    built = GltfBuilder()
    position = built.accessor(TRIANGLE, "VEC3")
    built.mesh([{"attributes": {"POSITION": position}, **primitive}])
    return built


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_gltf_keeps_bits_and_places_nodes(tmp_path: Path, suffix: str) -> None:
    """Strided floats, short indices, UVs as stored (v down), and a parent's and a child's transform."""
    rng = np.random.default_rng(2)
    points, uv = rng.random((4, 3)).astype(np.float32), rng.random((4, 2)).astype(np.float32)
    built = GltfBuilder()
    attributes = {"POSITION": built.accessor(points, "VEC3", stride=20),
                  "TEXCOORD_0": built.accessor(uv, "VEC2")}  # fmt: skip
    indices = built.accessor(np.array([0, 1, 2, 2, 1, 3], np.uint16), "SCALAR")
    built.root["materials"] = [{"name": "gold"}]
    built.root["nodes"].append({"children": [1], "scale": [2, 2, 2]})
    built.mesh([{"attributes": attributes, "indices": indices, "material": 0}], name="leaf",
               translation=[0, 0, 1], rotation=[0, 0, 2**-0.5, 2**-0.5])  # fmt: skip
    source = read_gltf(built.write(tmp_path / f"a{suffix}"))
    assert np.array_equal(source.vertices, points) and np.array_equal(source.uv, uv) and source.v_down
    assert faces_of(source) == [[0, 1, 2], [2, 1, 3]]
    assert (source.parts[0].node, source.parts[0].material) == ("leaf", "gold")
    x, y, z = points[0].astype(np.float64)
    np.testing.assert_allclose(source.placed_vertices()[0], [-2 * y, 2 * x, 2 * (z + 1)], atol=1e-12)


def test_gltf_instances_and_shared_accessors(tmp_path: Path) -> None:
    """A mesh on two nodes is there twice; primitives that share accessors share vertices."""
    built = GltfBuilder()
    attributes = {"POSITION": built.accessor(TRIANGLE, "VEC3")}
    built.mesh([{"attributes": attributes}, {"attributes": attributes}])
    built.root["nodes"].append({"mesh": 0, "translation": [5, 0, 0]})
    built.root["scenes"] = [{"nodes": [0, 1]}]
    source = read_gltf(built.write(tmp_path / "a.glb"))
    assert len(source.vertices) == 6 and len(source.parts) == 4
    assert source.loop_vertex.tolist() == [0, 1, 2, 0, 1, 2, 3, 4, 5, 3, 4, 5]
    assert source.placed_vertices()[:, 0].tolist() == [0, 1, 0, 5, 6, 5]


def test_gltf_strips_fans_and_what_is_no_surface(tmp_path: Path) -> None:
    built = GltfBuilder()
    points = built.accessor(np.random.default_rng(3).random((5, 3)).astype(np.float32), "VEC3")
    built.mesh([{"attributes": {"POSITION": points}, "mode": mode} for mode in (5, 6, 1, 0)])
    source = read_gltf(built.write(tmp_path / "a.glb"))
    assert faces_of(source) == [[0, 1, 2], [1, 3, 2], [2, 3, 4], [1, 2, 0], [2, 3, 0], [3, 4, 0]]
    assert source.skipped == {"lines": 1, "points": 1}


def test_gltf_normalised_integers_and_sparse_values(tmp_path: Path) -> None:
    built = builder()
    uv = built.accessor(np.array([(0, 255), (51, 0), (255, 255)], np.uint8), "VEC2", stride=4, normalized=True)
    built.root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uv
    at = built.accessor(np.array([2], np.uint8), "SCALAR")
    new = built.accessor(np.array([(0, 7, 0)], np.float32), "VEC3")
    views = [built.root["accessors"][i]["bufferView"] for i in (at, new)]
    built.root["accessors"][0]["sparse"] = {
        "count": 1, "indices": {"bufferView": views[0], "componentType": 5121}, "values": {"bufferView": views[1]},
    }  # fmt: skip
    source = read_gltf(built.write(tmp_path / "a.glb"))
    assert source.vertices[2].tolist() == [0, 7, 0]
    np.testing.assert_allclose(source.uv, [(0, 1), (0.2, 0), (1, 1)], atol=1e-7)


def test_gltf_buffers_beside_it_are_named(tmp_path: Path) -> None:
    built = builder()
    path = built.write(tmp_path / "a.gltf")
    root = json.loads(path.read_text())
    root["buffers"][0]["uri"] = "my%20mesh.bin"
    path.write_text(json.dumps(root))
    (tmp_path / "my mesh.bin").write_bytes(built.data)
    assert len(read_gltf(path).vertices) == 3
    assert companions(path) == {"my%20mesh.bin": tmp_path / "my mesh.bin"}


def broken_gltf(change: str) -> bytes:
    """A GLB with one thing wrong."""
    built = builder()
    root, primitive = built.root, built.root["meshes"][0]["primitives"][0]
    if change == "loop":
        root["nodes"][0]["children"] = [0]
    elif change == "index":
        primitive["indices"] = built.accessor(np.array([0, 1, 9], np.uint8), "SCALAR")
    elif change == "extension":
        root["extensionsRequired"] = ["EXT_foreign"]
    elif change == "view":
        root["bufferViews"][0]["byteOffset"] = 4096
    elif change == "version":
        root["asset"]["version"] = "1.0"
    elif change == "accessor":
        primitive["attributes"]["POSITION"] = 12
    elif change == "type":
        root["accessors"][0]["type"] = "VEC5"
    elif change == "nothing":
        root["scenes"] = [{"nodes": []}]
    text = json.dumps(root | {"buffers": [{"byteLength": len(built.data)}]}).encode()
    text = text.ljust(-(-len(text) // 4) * 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(built.data), b"BIN\0") + built.data
    whole = struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body
    return whole[: len(whole) // 2] if change == "cut off" else whole


STL_CUT = b"\0" * 80 + struct.pack("<I", 12) + b"\0" * 70
BROKEN: dict[str, tuple[str, str | bytes, str]] = {
    "obj index": ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "refers to vertex 3"),
    "obj index zero": ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "refers to vertex -1"),
    "obj negative index": ("a.obj", "v 0 0 0\nv 1 0 0\nf -1 -2 -3\n", "refers to vertex -1"),
    "obj uv index": ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2 3\n", "texture coordinate 0"),
    "obj corner": ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x\n", "corner 'x'"),
    "obj number": ("a.obj", "v 0 zero 0\n", "v 0 zero 0"),
    "obj short": ("a.obj", "v 0 0 0\nv 1 0\n", "2 numbers"),
    "obj empty": ("a.obj", "# nothing\n", "0 vertices and 0 faces"),
    "ply header": ("a.ply", "ply\nformat ascii 1.0\n", "no complete PLY header"),
    "ply cut": ("a.ply", PLY_ASCII[:-20], "cut off"),
    "ply points": ("a.ply", PLY_ASCII.split("element face")[0] + "end_header\n0 0 0 0 0\n" * 5, "holds fewer or other"),
    "ply type": ("a.ply", PLY_ASCII.replace("float x", "quad x"), "not understood"),
    "ply index": ("a.ply", PLY_ASCII.replace("0 1 4", "0 1 5"), "refers to vertex 5"),
    "stl cut": ("a.stl", STL_CUT, "12 facets"),
    "stl word": ("a.stl", "solid a\nvertex 0 0 0\nvertex 1 0 0\n", "whole triangles"),
    "off cut": ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n", "cut off"),
    "off other": ("a.off", "PNG\n", "begins with 'PNG'"),
    "gltf json": ("a.gltf", "{", "neither GLB nor glTF"),
    "gltf cut off": ("a.glb", broken_gltf("cut off"), "cut off"),
    "gltf loop": ("a.glb", broken_gltf("loop"), "loop"),
    "gltf index": ("a.glb", broken_gltf("index"), "refers to vertex 9"),
    "gltf extension": ("a.glb", broken_gltf("extension"), "EXT_foreign"),
    "gltf view": ("a.glb", broken_gltf("view"), "past the end"),
    "gltf version": ("a.glb", broken_gltf("version"), "version 1.0"),
    "gltf accessor": ("a.glb", broken_gltf("accessor"), "accessors[12]"),
    "gltf type": ("a.glb", broken_gltf("type"), "not valid glTF"),
    "gltf nothing": ("a.glb", broken_gltf("nothing"), "0 faces"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files_are_refused_in_one_line(tmp_path: Path, name: str) -> None:
    file, content, cause = BROKEN[name]
    path = write(tmp_path / file, content)
    with pytest.raises(InputError) as raised:
        READERS[path.suffix](path)
    message = str(raised.value)
    assert message.startswith(str(path)) and cause in message and "\n" not in message
