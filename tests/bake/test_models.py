"""model.glb and model.obj: the source's own vertices, faces, UVs and frame, bit for bit."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from stages.bake.gltf import shears, write_glb
from stages.bake.source import Model, source_model, split_vertices, vertex_normals
from stages.bake.wavefront import write_obj
from stages.core.artifact import Artifact, load_npz
from stages.core.frames import Z_UP_TO_WORLD
from stages.core.images import write_png
from stages.core.schemas import PREP
from stages.prep.read_obj import read_obj
from tests.bake.examples import Example, cube, grid, one_part, save_prep
from tests.bake.glb import Glb


def odd_numbers(shape: tuple[int, ...]) -> NDArray[np.float64]:
    """float32 numbers of every size and sign that no rounding survives, negative zero among them."""
    values = np.random.default_rng(1).normal(0, 1, shape).astype("f4") * np.float32(3e7)
    values.reshape(-1)[:3] = (-0.0, 1e-41, 16777217.0)
    return values.astype("f8")


def gltf_example() -> Example:
    """Two parts on two nodes, each with its own run of vertices; each run ends with a vertex no face uses."""
    vertices = odd_numbers((9, 3))
    faces = [[0, 1, 2], [2, 1, 3], [5, 7, 6]]
    loops = np.concatenate(faces)
    uv = np.random.default_rng(0).uniform(0, 1, (9, 2)).astype("f4")[loops]  # one UV for each vertex, as in glTF
    turn = np.array([[0, -2, 0, 1], [2, 0, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1.0]])
    parts = [
        {"name": "body", "material": "paint", "node": "a", "transform": np.eye(4).reshape(-1).tolist()},
        {"name": "lid", "material": "steel", "node": "b", "transform": turn.reshape(-1).tolist()},
    ]
    return Example(vertices, faces, uv, [0, 0, 1], [0, 0, 1], parts, source_format="glb", uv_kept=True)


def load_prep(folder: Path, example: Example) -> Artifact:
    return load_npz(save_prep(folder / "prep.npz", example), PREP)


def write(folder: Path, model: Model) -> Path:
    pictures = {}
    for name in ("albedo", "orm"):
        write_png(folder / f"{name}.png", np.full((4, 4, 3), 128, np.uint8))
        pictures[name] = (folder / f"{name}.png").read_bytes()
    write_glb(folder / "model.glb", model, pictures)
    return folder / "model.glb"


def glb_of(folder: Path, example: Example) -> Glb:
    return Glb.read(write(folder, source_model(load_prep(folder, example), double_sided=False)))


def assert_same_bits(a: NDArray, b: NDArray) -> None:
    assert a.shape == b.shape
    assert np.asarray(a, "<f4").tobytes() == np.asarray(b, "<f4").tobytes()


def test_gltf_source_comes_back_bit_for_bit(tmp_path: Path) -> None:
    example = gltf_example()
    glb = glb_of(tmp_path, example)
    body, lid = glb.primitives()
    assert_same_bits(glb.attribute(body, "POSITION"), example.vertices[:5])
    assert_same_bits(glb.attribute(lid, "POSITION"), example.vertices[5:])
    np.testing.assert_array_equal(glb.triangles(body), [[0, 1, 2], [2, 1, 3]])
    np.testing.assert_array_equal(glb.triangles(lid), [[0, 2, 1]])
    source_uv = load_npz(tmp_path / "prep.npz", PREP)["source_uv"]  # one row for each loop
    assert_same_bits(glb.attribute(body, "TEXCOORD_0")[[0, 1, 2, 2, 1, 3]], source_uv[:6])
    assert_same_bits(glb.attribute(lid, "TEXCOORD_0")[[0, 2, 1]], source_uv[6:])


def test_gltf_nodes_and_material_slots_are_kept(tmp_path: Path) -> None:
    glb = glb_of(tmp_path, gltf_example())
    assert [node["name"] for node in glb.root["nodes"]] == ["a", "b"]
    assert "matrix" not in glb.root["nodes"][0]
    assert glb.root["nodes"][1]["matrix"] == [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 1, 0, 0, 1]
    assert [material["name"] for material in glb.root["materials"]] == ["paint", "steel"]
    assert [primitive["material"] for primitive in glb.primitives()] == [0, 1]


def test_trimesh_reads_the_same_positions_and_faces(tmp_path: Path) -> None:
    example = gltf_example()
    path = write(tmp_path, source_model(load_prep(tmp_path, example), double_sided=False))
    geometry = list(trimesh.load_scene(path, process=False).geometry.values())
    assert_same_bits(geometry[0].vertices, example.vertices[:5])
    np.testing.assert_array_equal(geometry[0].faces, [[0, 1, 2], [2, 1, 3]])


def test_own_uvs_of_an_obj_split_vertices_only_where_they_differ(tmp_path: Path) -> None:
    """Two quads share an edge; one of its ends has two UVs: one vertex is appended, all others keep their index."""
    vertices = odd_numbers((7, 3))  # the last one is not used
    uv = np.array([[0, 0], [0.25, 0], [0.25, 0.25], [0, 0.25], [0.5, 0], [0.75, 0], [0.75, 0.3], [0.25, 0.25]], "f4")
    example = Example(vertices, [[0, 1, 2, 3], [1, 4, 5, 2]], uv, [0, 1], [0, 0], one_part(), "obj", True)
    glb = glb_of(tmp_path, example)
    (primitive,) = glb.primitives()
    assert_same_bits(glb.attribute(primitive, "POSITION"), vertices[[*range(7), 1]])
    np.testing.assert_array_equal(glb.triangles(primitive), [[0, 1, 2], [0, 2, 3], [7, 4, 5], [7, 5, 2]])
    flipped = np.stack([uv[:, 0], 1 - uv[:, 1]], 1)  # v is down in glTF
    assert_same_bits(glb.attribute(primitive, "TEXCOORD_0")[:6], flipped[[0, 1, 2, 3, 5, 6]])
    assert_same_bits(glb.attribute(primitive, "TEXCOORD_0")[[7]], flipped[[4]])


def test_each_uv_of_a_vertex_is_one_entry_however_often_and_in_whatever_order_it_recurs() -> None:
    vertex = np.array([1, 0, 1, 1, 1, 1, 1, 0])
    uv = np.array([[0, 0], [9, 9], [1, 0], [2, 0], [0, 0], [2, 0], [1, 0], [8, 8]], "f4")
    table = split_vertices(vertex, np.arange(8), uv, 0, 3)
    np.testing.assert_array_equal(table.of_loop, [1, 0, 3, 4, 1, 4, 3, 5])
    np.testing.assert_array_equal(table.source, [0, 1, 2, 1, 1, 0])
    np.testing.assert_array_equal(table.loop, [1, 0, -1, 2, 3, 7])


def test_new_uvs_split_a_cube_along_its_charts_only(tmp_path: Path) -> None:
    """Eight vertices, each on three charts: 24, the first eight of them the source's own."""
    glb = glb_of(tmp_path, cube())
    (primitive,) = glb.primitives()
    positions = glb.attribute(primitive, "POSITION")
    assert_same_bits(positions[:8], cube().vertices)
    assert len(positions) == 24
    fans = [[[face[0], face[1], face[2]], [face[0], face[2], face[3]]] for face in cube().faces]
    assert_same_bits(positions[glb.triangles(primitive)], cube().vertices[np.concatenate(fans)])


def test_obj_is_written_back_with_its_polygons_and_its_numbers(tmp_path: Path) -> None:
    vertices = np.random.default_rng(3).normal(0, 1, (8, 3))  # float64 with all its digits
    parts = one_part("a", "red paint") + one_part("b", "")
    normals = np.tile([[0, 0, 1.0]], (24, 1))
    example = cube().with_(vertices=vertices, source_format="obj", uv_kept=True, parts=parts, loop_normal=normals)
    example = example.with_(part=[0, 0, 1, 1, 0, 0])
    write_obj(tmp_path / "model.obj", load_prep(tmp_path, example))
    source = read_obj(tmp_path / "model.obj")
    np.testing.assert_array_equal(source.vertices, vertices)
    np.testing.assert_array_equal(source.uv, example.loop_uv)
    np.testing.assert_array_equal(source.loop_vertex.reshape(-1, 4), example.faces)
    np.testing.assert_array_equal(source.normals[source.loop_normal], normals)
    text = (tmp_path / "model.mtl").read_text()
    assert "newmtl red paint" in text and "newmtl material" in text
    for line in ("map_Kd albedo.png", "map_Pr roughness.png", "map_Pm metallic.png"):
        assert text.count(line) == 2


def test_obj_with_new_uvs_names_each_once(tmp_path: Path) -> None:
    example = grid(2).with_(source_format="obj")
    write_obj(tmp_path / "model.obj", load_prep(tmp_path, example))
    source = read_obj(tmp_path / "model.obj")
    assert len(source.uv) == 9
    np.testing.assert_array_equal(source.uv[source.loop_uv], example.loop_uv)


def test_shared_vertices_of_two_parts_are_stored_once(tmp_path: Path) -> None:
    parts = one_part("a", "x") + one_part("b", "y")
    glb = glb_of(tmp_path, grid(4).with_(parts=parts, part=[0] * 8 + [1] * 8))
    first, second = glb.primitives()
    assert first["attributes"] == second["attributes"]
    assert len(glb.triangles(first)) == len(glb.triangles(second)) == 16


@pytest.mark.parametrize(("count", "dtype"), [(65535, "<u2"), (65536, "<u4")])
def test_index_type_never_uses_its_restart_value(tmp_path: Path, count: int, dtype: str) -> None:
    vertices = np.zeros((count, 3))
    vertices[:, 0] = np.arange(count)
    vertices[0, 1] = 1
    uv = np.array([[0, 0], [1, 0], [0, 1]], "f4")
    glb = glb_of(tmp_path, Example(vertices, [[0, 1, count - 1]], uv, [0], [0], one_part()))
    (primitive,) = glb.primitives()
    assert glb.accessor(primitive["indices"]).dtype == np.dtype(dtype)
    assert glb.triangles(primitive).max() == count - 1


def test_a_z_up_source_stands_upright_by_its_node(tmp_path: Path) -> None:
    glb = glb_of(tmp_path, cube().with_(to_world=Z_UP_TO_WORLD))
    matrix = np.reshape(glb.root["nodes"][glb.root["scenes"][0]["nodes"][0]]["matrix"], (4, 4)).T
    np.testing.assert_allclose(matrix @ [0, 0, 1, 1], [0, 1, 0, 1], atol=1e-6)
    assert_same_bits(glb.attribute(glb.primitives()[0], "POSITION")[:8], cube().vertices)


def test_a_sheared_transform_becomes_two_nodes(tmp_path: Path) -> None:
    parts = [{**one_part()[0], "transform": SHEAR.reshape(-1).tolist()}]
    glb = glb_of(tmp_path, cube().with_(parts=parts))
    outer = glb.root["nodes"][glb.root["scenes"][0]["nodes"][0]]
    inner = glb.root["nodes"][outer["children"][0]]
    outer_matrix, inner_matrix = (np.reshape(node["matrix"], (4, 4)).T for node in (outer, inner))
    np.testing.assert_allclose(outer_matrix @ inner_matrix, SHEAR, atol=1e-12)
    assert not shears(outer_matrix) and not shears(inner_matrix)


def test_vertices_that_are_not_finite_are_left_out_and_counted(tmp_path: Path) -> None:
    vertices = cube().vertices.copy()
    vertices[0] = (np.nan, np.inf, 1e300)
    model = source_model(load_prep(tmp_path, cube().with_(vertices=vertices)), double_sided=False)
    assert model.notes == {"vertices_not_finite": 1, "faces_with_vertices_not_finite_left_out": 3}
    glb = Glb.read(write(tmp_path, model))
    (primitive,) = glb.primitives()
    positions = glb.attribute(primitive, "POSITION")
    assert np.isfinite(positions).all()
    assert_same_bits(positions[1:8], vertices[1:])
    assert len(glb.triangles(primitive)) == 6


def test_source_normals_keep_their_bits_and_bad_ones_are_replaced(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    normals = rng.normal(0, 1, (9, 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype("f4")
    example = gltf_example().with_(loop_normal=normals[np.concatenate(gltf_example().faces)])
    glb = glb_of(tmp_path, example)
    assert_same_bits(glb.attribute(glb.primitives()[0], "NORMAL")[:4], normals[:4])
    zero = example.with_(loop_normal=np.zeros((9, 3), "f4"))
    for primitive in glb_of(tmp_path, zero).primitives():
        if "NORMAL" in primitive["attributes"]:
            lengths = np.linalg.norm(glb_of(tmp_path, zero).attribute(primitive, "NORMAL"), axis=1)
            np.testing.assert_allclose(lengths, 1, atol=1e-6)


def test_smooth_surfaces_have_normals_and_hard_edges_are_left_to_facets() -> None:
    """A sphere of shared vertices keeps its normals; a cube of shared vertices would be rounded, so it has none."""
    ball = trimesh.creation.icosphere(2)
    vertices, triangles = ball.vertices.astype("f4"), ball.faces.astype(np.int64)
    smooth = vertex_normals(vertices, triangles, vertices[triangles])
    assert smooth is not None
    np.testing.assert_allclose(smooth, vertices, atol=1e-6)
    box = trimesh.creation.box()
    flat = np.repeat(box.face_normals[:, None], 3, 1).astype("f4")
    assert vertex_normals(box.vertices.astype("f4"), box.faces.astype(np.int64), flat) is None


def test_a_source_wound_the_other_way_is_double_sided(tmp_path: Path) -> None:
    """Where prep turned faces round, the file keeps the source's winding, so both sides must show."""
    prep = load_prep(tmp_path, cube())
    assert not source_model(prep, double_sided=False).double_sided
    turned = Artifact({**prep.arrays, "triangle_loops": prep["triangle_loops"][:, ::-1].copy()}, prep.provenance)
    assert source_model(turned, double_sided=False).double_sided


# ---------------------------------------------------------------------------------------------------- validator

VALIDATE = """
const validator = require('gltf-validator'), fs = require('fs');
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1])))
  .then(report => console.log(JSON.stringify(report.issues)));
"""


def khronos_issues(path: Path) -> dict:
    """What the Khronos validator says; NODE_PATH or a folder above must hold the npm package gltf-validator."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed; the Khronos validator cannot run")
    root = Path(__file__).resolve().parents[2]
    run = subprocess.run([node, "-e", VALIDATE, str(path)], capture_output=True, text=True, cwd=root, env=os.environ)
    if "Cannot find module" in run.stderr:
        pytest.skip("the npm package gltf-validator is not installed; npm install gltf-validator, or set NODE_PATH")
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)


SHEAR = np.array([[1, 0.5, 0, 2], [0, 1, 0, 0], [0, 0.2, -3, 1], [0, 0, 0, 1.0]])

EXAMPLES = {
    "cube": cube(),
    "sheet": grid(5, lambda x, y: 0.1 * np.sin(6 * x)),
    "gltf": gltf_example(),
    "z_up": cube().with_(to_world=Z_UP_TO_WORLD),
    "degenerate": cube().with_(faces=[*cube().faces[:5], [1, 5, 5, 3]]),
    "shear": cube().with_(parts=[{**one_part()[0], "transform": SHEAR.reshape(-1).tolist()}]),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_khronos_validator_finds_nothing(tmp_path: Path, name: str) -> None:
    path = write(tmp_path, source_model(load_prep(tmp_path, EXAMPLES[name]), double_sided=True))
    issues = khronos_issues(path)
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]
