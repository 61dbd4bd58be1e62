"""What glTF's extensions and deformations make of a mesh: instances, visibility, compression, poses, UV sets."""

import json
import struct
import sys
from pathlib import Path

import DracoPy
import numpy as np
import pytest
from numpy.typing import NDArray

from stages.core.artifact import load_npz
from stages.core.errors import InputError
from stages.core.schemas import PREP
from stages.prep.gltf_file import companions
from stages.prep.options import PrepOptions
from stages.prep.read_gltf import read_gltf
from stages.prep.source import Source
from stages.prep.stage import prep
from tests.prep.shapes import GltfBuilder

SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], np.float32)
QUAD = np.array([0, 1, 2, 0, 2, 3], np.uint32)


def square(built: GltfBuilder, **primitive: object) -> dict[str, object]:
    attributes = {"POSITION": built.accessor(SQUARE, "VEC3"), **primitive.pop("attributes", {})}  # type: ignore[dict-item]
    return {"attributes": attributes, "indices": built.accessor(QUAD, "SCALAR"), **primitive}


# ------------------------------------------------------------------------------------------------------------- nodes


def test_instances_stand_where_their_transforms_put_them(tmp_path: Path) -> None:
    """EXT_mesh_gpu_instancing: each has its own vertices, in the node's frame; rotations may be normalised shorts."""
    built = GltfBuilder()
    turns = np.array([(0, 0, 0, 32767), (0, 0, 23170, 23170), (0, 0, 0, 32767)], np.int16)
    attributes = {
        "TRANSLATION": built.accessor(np.array([(0, 0, 0), (5, 0, 0), (0, 5, 0)], np.float32), "VEC3"),
        "ROTATION": built.accessor(turns, "VEC4", normalized=True),
        "SCALE": built.accessor(np.array([(1, 1, 1), (1, 1, 1), (2, 2, 2)], np.float32), "VEC3"),
    }
    extension = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    built.mesh([square(built)], name="brick", translation=[0, 0, 7], extensions=extension)
    built.root["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    source = read_gltf(built.write(tmp_path / "a.glb"))
    assert [part.node for part in source.parts] == ["brick_0", "brick_1", "brick_2"]
    assert source.applied == {"instances": 3} and source.face_part.tolist() == [0, 0, 1, 1, 2, 2]
    placed = source.placed_vertices().reshape(3, 4, 3)
    np.testing.assert_allclose(placed[0], SQUARE + [0, 0, 7])
    np.testing.assert_allclose(placed[1][:, :2], SQUARE[:, [1, 0]] * [-1, 1] + [5, 0], atol=1e-4)
    np.testing.assert_allclose(placed[2], 2 * SQUARE + [0, 5, 7])


def test_hidden_nodes_are_left_out_with_what_hangs_on_them(tmp_path: Path) -> None:
    built = GltfBuilder()
    hidden = {"KHR_node_visibility": {"visible": False}}
    built.mesh([square(built)], name="seen", extensions={"KHR_node_visibility": {"visible": True}})
    built.mesh([square(built)], name="hidden", extensions=hidden, children=[2])
    built.mesh([square(built)], name="below", extensions={"KHR_node_visibility": {"visible": True}})
    built.root["scenes"] = [{"nodes": [0, 1]}]
    source = read_gltf(built.write(tmp_path / "a.glb"))
    assert [part.node for part in source.parts] == ["seen"] and source.skipped == {"hidden_nodes": 2}


def test_a_primitive_without_positions_is_left_out_alone(tmp_path: Path) -> None:
    built = GltfBuilder()
    built.mesh([{"attributes": {}}, square(built), {"attributes": {"NORMAL": 0}}])
    source = read_gltf(built.write(tmp_path / "a.glb"))
    assert len(source.face_part) == 2 and source.skipped == {"primitives_without_positions": 2}


def test_ten_thousand_instances_are_placed_at_once(tmp_path: Path) -> None:
    built = GltfBuilder()
    shift = np.arange(30_000, dtype=np.float32).reshape(-1, 3)
    extension = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": built.accessor(shift, "VEC3")}}}
    built.mesh([square(built)], extensions=extension)
    placed = read_gltf(built.write(tmp_path / "a.glb")).placed_vertices().reshape(-1, 4, 3)
    assert np.array_equal(placed[:, 0], shift)


# -------------------------------------------------------------------------------------------------------- compression


def hidden_package(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.setitem(sys.modules, name, None)


def draco(built: GltfBuilder, plain: bool) -> None:
    """A square in Draco's form; the plain form beside it where asked for."""
    uv, normals = SQUARE[:, :2].astype(np.float64), np.tile([(0.0, 0, 1)], (4, 1))
    packed = DracoPy.encode(SQUARE, QUAD, quantization_bits=16, preserve_order=True, tex_coord=uv, normals=normals)
    ids = {DracoPy.AttributeType(item["attribute_type"]).name: item["unique_id"]
           for item in DracoPy.decode(packed).attributes}  # fmt: skip
    primitive = square(built, attributes={"TEXCOORD_0": built.accessor(SQUARE[:, :2].copy(), "VEC2"),
                                          "NORMAL": built.accessor(normals.astype(np.float32), "VEC3")})  # fmt: skip
    view = built.accessor(np.frombuffer(packed, np.uint8), "SCALAR")
    names = {"POSITION": "POSITION", "TEXCOORD_0": "TEX_COORD", "NORMAL": "NORMAL"}
    primitive["extensions"] = {"KHR_draco_mesh_compression": {
        "bufferView": built.root["accessors"][view]["bufferView"], "attributes": {k: ids[v] for k, v in names.items()},
    }}  # fmt: skip
    if not plain:
        for accessor in built.root["accessors"][:view]:
            del accessor["bufferView"]
        built.root["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    built.mesh([primitive])


def test_draco_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built = GltfBuilder()
    draco(built, plain=False)
    path = built.write(tmp_path / "a.glb")
    source = read_gltf(path)
    corners = source.vertices[source.loop_vertex]
    np.testing.assert_allclose(corners, SQUARE[QUAD], atol=1e-4)
    np.testing.assert_allclose(source.uv[source.loop_uv], SQUARE[QUAD, :2], atol=1e-3)
    assert source.normals[source.loop_normal].tolist() == [[0, 0, 1]] * 6
    hidden_package(monkeypatch, "DracoPy")
    with pytest.raises(InputError, match=r"a.glb: KHR_draco_mesh_compression needs DracoPy.*\[gltf\]"):
        read_gltf(path)


def test_the_plain_form_beside_draco_needs_no_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built = GltfBuilder()
    draco(built, plain=True)
    hidden_package(monkeypatch, "DracoPy")
    assert np.array_equal(read_gltf(built.write(tmp_path / "a.glb")).vertices, SQUARE)


def test_draco_data_that_is_damaged_is_refused_in_one_line(tmp_path: Path) -> None:
    built = GltfBuilder()
    draco(built, plain=False)
    built.data = built.data[:-40] + b"\xff" * 40
    with pytest.raises(InputError, match="Draco data cannot be read"):
        read_gltf(built.write(tmp_path / "a.glb"))


def meshopt_gltf(name: str, required: bool, fallback: str | None) -> tuple[dict, dict[str, bytes]]:
    """A grid with quantised positions and octahedral normals behind `name`; fallback: URI of plain data, if any."""
    library = pytest.importorskip("meshopt", reason="has no wheel for Python 3.10")
    x, y = np.meshgrid(np.arange(4), np.arange(4))
    positions = np.stack([x, y, 0 * x, 0 * x], -1).reshape(-1, 4).astype(np.uint16)
    normals = library.encode_filter_oct(np.tile(np.array([(0, 0, 1, 0)], np.float32), (16, 1)), 4, 8)
    corner = np.array([(4 * r + c, 4 * r + c + 1, 4 * r + c + 5) for r in range(3) for c in range(3)], np.uint16)
    uv = (positions[:, :2] * 5).astype(np.uint16)
    packed, plain, views = b"", b"", []
    for values, mode, filtered in ((positions, "ATTRIBUTES", "NONE"), (np.asarray(normals), "ATTRIBUTES", "OCTAHEDRAL"),
                                   (uv, "ATTRIBUTES", "NONE"), (corner.reshape(-1), "TRIANGLES", "NONE")):  # fmt: skip
        stride = values.nbytes // len(values)
        data = bytes(library.encode_gltf_buffer(values, mode))
        views.append({
            "buffer": 1, "byteOffset": len(plain), "byteLength": values.nbytes,
            "extensions": {name: {"buffer": 0, "byteOffset": len(packed), "byteLength": len(data), "byteStride": stride,
                                  "count": len(values), "mode": mode, "filter": filtered}},
        } | ({"byteStride": stride} if mode == "ATTRIBUTES" else {}))  # fmt: skip
        packed += data.ljust(-(-len(data) // 4) * 4, b"\0")
        if filtered == "OCTAHEDRAL":
            values = np.tile(np.array([(0, 0, 127, 0)], np.int8), (16, 1))
        plain += values.tobytes().ljust(-(-values.nbytes // 4) * 4, b"\0")
    accessors = [
        {"bufferView": 0, "componentType": 5123, "count": 16, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5120, "count": 16, "type": "VEC3", "normalized": True},
        {"bufferView": 2, "componentType": 5123, "count": 16, "type": "VEC2", "normalized": True},
        {"bufferView": 3, "componentType": 5123, "count": corner.size, "type": "SCALAR"},
    ]
    stand_in: dict = {"byteLength": len(plain), "extensions": {name: {"fallback": True}}}
    root = {
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "scale": [2, 2, 2]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3}]}],
        "accessors": accessors, "bufferViews": views, "extensionsRequired": [name, "KHR_mesh_quantization"] * required,
        "buffers": [{"byteLength": len(packed), "uri": "packed.bin"}, stand_in | ({"uri": fallback} if fallback else {})],
    }  # fmt: skip
    return root, {"packed.bin": packed} | ({fallback: plain} if fallback else {})


def check_grid(source: Source) -> None:
    x, y = np.meshgrid(np.arange(4), np.arange(4))
    np.testing.assert_array_equal(source.vertices, np.stack([x, y, 0 * x], -1).reshape(-1, 3))
    np.testing.assert_allclose(source.uv, source.vertices[:, :2] * 5 / 65535, rtol=1e-6)
    np.testing.assert_allclose(source.normals, [(0, 0, 1)] * 16, atol=0.01)
    assert sorted(map(sorted, source.loop_vertex.reshape(-1, 3).tolist())) == sorted(
        [4 * r + c, 4 * r + c + 1, 4 * r + c + 5] for r in range(3) for c in range(3)
    )


@pytest.mark.parametrize("name", ["EXT_meshopt_compression", "KHR_meshopt_compression"])
def test_meshopt_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    root, files = meshopt_gltf(name, required=True, fallback=None)
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(root))
    for file, data in files.items():
        (tmp_path / file).write_bytes(data)
    check_grid(read_gltf(path))
    hidden_package(monkeypatch, "meshopt")
    with pytest.raises(InputError, match=r"needs meshopt.*\[gltf\]"):
        read_gltf(path)


def test_the_plain_form_beside_meshopt_needs_no_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A fallback file that is there is read; one that is missing is not asked for where the package is there."""
    root, files = meshopt_gltf("EXT_meshopt_compression", required=False, fallback="plain.bin")
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(root))
    for file, data in files.items():
        (tmp_path / file).write_bytes(data)
    with monkeypatch.context() as without:
        hidden_package(without, "meshopt")
        check_grid(read_gltf(path))
    assert set(companions(path)) == {"packed.bin", "plain.bin"}
    (tmp_path / "plain.bin").unlink()
    assert set(companions(path)) == {"packed.bin"}
    check_grid(read_gltf(path))


def test_an_accessor_that_announces_gigabytes_is_refused(tmp_path: Path) -> None:
    built = GltfBuilder()
    built.mesh([square(built)])
    entry = built.root["accessors"][0]
    entry["count"] = 2**31
    del entry["bufferView"]
    with pytest.raises(InputError, match="2147483648 elements"):
        read_gltf(built.write(tmp_path / "a.glb"))


# -------------------------------------------------------------------------------------------------------- deformation


def turn_z(degrees: float) -> list[float]:
    half = np.radians(degrees) / 2
    return [0.0, 0.0, float(np.sin(half)), float(np.cos(half))]


def test_a_skin_is_applied_in_its_default_pose(tmp_path: Path) -> None:
    """Half of the square follows a joint turned by 90 degrees about its corner; the node's own transform does not count."""
    built = GltfBuilder()
    weights = np.array([(1, 0, 0, 0), (1, 0, 0, 0), (0, 255, 0, 0), (0, 0, 0, 0)], np.uint8)
    bind = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    bind[1, :3, 3] = [-1, -1, 0]
    attributes = {
        "JOINTS_0": built.accessor(np.tile(np.array([(0, 1, 7, 0)], np.uint8), (4, 1)), "VEC4"),
        "WEIGHTS_0": built.accessor(np.where(weights == 1, 255, weights).astype(np.uint8), "VEC4", normalized=True),
        "NORMAL": built.accessor(np.tile(np.array([(1, 0, 0)], np.float32), (4, 1)), "VEC3"),
    }
    built.mesh([square(built, attributes=attributes)], skin=0, translation=[100, 0, 0])
    built.root["nodes"] += [{"children": [2], "translation": [0, 0, 3]}, {"translation": [1, 1, 0], "rotation": turn_z(90)}]
    matrices = built.accessor(bind.transpose(0, 2, 1).reshape(2, 16).copy(), "MAT4")
    built.root["skins"] = [{"joints": [1, 2], "inverseBindMatrices": matrices}]
    built.root["scenes"] = [{"nodes": [0, 1]}]
    source = read_gltf(built.write(tmp_path / "a.glb"))
    assert source.applied == {"skins_in_their_default_pose": 1} and not source.skipped
    expected = SQUARE + [0, 0, 3]
    np.testing.assert_allclose(source.placed_vertices(), expected, atol=1e-6)  # vertex 2 is the corner it turns about
    np.testing.assert_allclose(source.normals, [(1, 0, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0)], atol=1e-6)


def test_a_skin_in_bind_pose_leaves_the_mesh_where_its_joints_stand(tmp_path: Path) -> None:
    """A point weighted halfway between a joint at rest and one turned over by 180 degrees ends up halfway."""
    built = GltfBuilder()
    halves = np.tile(np.array([(0.5, 0.5, 0, 0)], np.float32), (4, 1))
    attributes = {"JOINTS_0": built.accessor(np.tile(np.array([(0, 1, 0, 0)], np.uint16), (4, 1)), "VEC4"),
                  "WEIGHTS_0": built.accessor(halves, "VEC4")}  # fmt: skip
    built.mesh([square(built, attributes=attributes)], skin=0)
    built.root["nodes"] += [{}, {"rotation": turn_z(180)}]
    built.root["skins"] = [{"joints": [1, 2]}]
    built.root["scenes"] = [{"nodes": [0, 1, 2]}]
    np.testing.assert_allclose(read_gltf(built.write(tmp_path / "a.glb")).vertices, 0 * SQUARE, atol=1e-6)


@pytest.mark.parametrize("on_node", [False, True])
def test_morph_targets_are_applied_with_their_default_weights(tmp_path: Path, on_node: bool) -> None:
    """The node's weights come before the mesh's; a sparse target without a view moves one vertex."""
    built = GltfBuilder()
    at, new = built.accessor(np.array([2], np.uint8), "SCALAR"), built.accessor(np.array([(0, 0, 4)], np.float32), "VEC3")
    views = [built.root["accessors"][i]["bufferView"] for i in (at, new)]
    built.root["accessors"].append({"componentType": 5126, "count": 4, "type": "VEC3", "sparse": {
        "count": 1, "indices": {"bufferView": views[0], "componentType": 5121}, "values": {"bufferView": views[1]},
    }})  # fmt: skip
    lift = built.accessor(np.tile(np.array([(0, 0, 1)], np.float32), (4, 1)), "VEC3")
    built.mesh([square(built, targets=[{"POSITION": 2}, {"POSITION": lift}])], **({"weights": [0.5, 0]} if on_node else {}))
    built.root["meshes"][0]["weights"] = [0, 2]
    source = read_gltf(built.write(tmp_path / "a.glb"))
    assert source.vertices[:, 2].tolist() == ([0, 0, 2, 0] if on_node else [2, 2, 2, 2])
    assert source.applied == {"morph_targets_with_their_default_weights": 2}


# ------------------------------------------------------------------------------------------------------------- UV sets


def two_sets(folder: Path, first: NDArray, second: NDArray) -> Path:
    built = GltfBuilder()
    attributes = {f"TEXCOORD_{k}": built.accessor(uv.astype(np.float32), "VEC2") for k, uv in enumerate((first, second))}
    built.mesh([square(built, attributes=attributes)])
    return built.write(folder / "a.glb")


def test_a_second_uv_set_is_baked_where_the_first_cannot_be(tmp_path: Path) -> None:
    """As game engines have it: tiled UVs first, a layout for light maps second."""
    tiled, layout = SQUARE[:, :2] * 8, SQUARE[:, :2] * 0.75 + 0.125
    for first, second, number in ((tiled, layout, 1), (layout, tiled, 0), (layout, layout / 2, 0)):
        out = tmp_path / f"{number}.npz"
        found = prep(two_sets(tmp_path, first, second), out, PrepOptions(uv="keep"), force=True).findings
        made = load_npz(out, PREP)
        assert found["uv_set"] == number and made.provenance.extra["uv_kept"]
        used = layout if number else first
        np.testing.assert_array_equal(made["source_uv"][made["loop_source_uv"]], used[QUAD].astype(np.float32))
        np.testing.assert_allclose(made["loop_uv"], used[QUAD] * [1, -1] + [0, 1], atol=1e-7)


def test_two_bad_uv_sets_are_replaced(tmp_path: Path) -> None:
    path = two_sets(tmp_path, SQUARE[:, :2] * 8, SQUARE[:, :2] * 0)
    found = prep(path, tmp_path / "a.npz", PrepOptions(unwrap_triangles=0)).findings
    assert found["uv_set"] is None and "go through 64 tiles" in found["unusable_uv"]
    with pytest.raises(InputError, match="go through 64 tiles"):
        prep(path, tmp_path / "b.npz", PrepOptions(uv="keep"))


def test_a_uv_set_that_only_some_primitives_have(tmp_path: Path) -> None:
    built = GltfBuilder()
    uv = built.accessor(SQUARE[:, :2].copy(), "VEC2")
    built.mesh([square(built, attributes={"TEXCOORD_0": uv, "TEXCOORD_1": uv}), square(built)])
    source = read_gltf(built.write(tmp_path / "a.glb"))
    assert [(candidate.loop_uv >= 0).sum() for candidate in source.by_uv_set()] == [6, 6]


def test_quantised_attributes_are_read_as_they_are_meant(tmp_path: Path) -> None:
    """KHR_mesh_quantization: integers that a node scales back, normalised normals, UVs beyond the unit square."""
    built = GltfBuilder()
    attributes = {
        "POSITION": built.accessor((SQUARE * 1000 - 500).astype(np.int16), "VEC3", stride=8),
        "NORMAL": built.accessor(np.tile(np.array([(0, 0, 127)], np.int8), (4, 1)), "VEC3", stride=4, normalized=True),
        "TEXCOORD_0": built.accessor((SQUARE[:, :2] * 3).astype(np.uint8), "VEC2", stride=4),
    }
    built.mesh([{"attributes": attributes, "indices": built.accessor(QUAD, "SCALAR")}], scale=[1e-3] * 3)
    built.root["extensionsRequired"] = ["KHR_mesh_quantization"]
    source = read_gltf(built.write(tmp_path / "a.glb"))
    np.testing.assert_allclose(source.placed_vertices(), SQUARE - 0.5 * np.array([1, 1, 1]), atol=1e-9)
    assert source.normals.tolist() == [[0, 0, 1]] * 4 and source.uv.max() == 3


def test_glb_that_is_cut_within_its_last_chunk(tmp_path: Path) -> None:
    built = GltfBuilder()
    built.mesh([square(built)])
    data = built.write(tmp_path / "a.glb").read_bytes()
    cut = data[: len(data) - 8]
    (tmp_path / "b.glb").write_bytes(cut[:8] + struct.pack("<I", len(cut)) + cut[12:])
    with pytest.raises(InputError, match=r"damaged|cut off"):
        read_gltf(tmp_path / "b.glb")
