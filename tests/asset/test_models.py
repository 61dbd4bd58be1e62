"""model.glb and model.obj: corner by corner the source's own positions, UVs, normals and faces, bit for bit."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from stages.asset.corners import loop_normals
from stages.asset.gltf import Look, Pictures, shears, write_glb
from stages.asset.model import Model, source_model
from stages.asset.vertices import split_vertices
from stages.asset.wavefront import write_obj
from stages.core.artifact import Artifact, load_npz
from stages.core.frames import Y_UP_TO_WORLD, Z_UP_TO_WORLD
from stages.core.images import write_png
from stages.core.schemas import PREP
from stages.prep.read_obj import read_obj
from tests.asset.glb import Glb
from tests.bake.examples import Example, cube, grid, one_part, save_prep


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
    write_glb(folder / "model.glb", model, Look([Pictures(pictures)]))
    return folder / "model.glb"


def glb_of(folder: Path, example: Example) -> Glb:
    return Glb.read(write(folder, source_model(load_prep(folder, example), double_sided=False)))


def assert_same_bits(a: NDArray, b: NDArray) -> None:
    assert a.shape == b.shape
    assert np.asarray(a, "<f4").tobytes() == np.asarray(b, "<f4").tobytes()


def corners(glb: Glb, name: str) -> NDArray:
    """An attribute at the corners of all triangles, part after part, (T, 3, D)."""
    each = [glb.attribute(primitive, name)[glb.triangles(primitive)] for primitive in glb.primitives()]
    return np.concatenate(each)


def fans(example: Example) -> NDArray[np.int64]:
    """Loops (T, 3) of faces cut as fans, which convex polygons are."""
    starts = np.cumsum([0, *map(len, example.faces)])[:-1]
    sizes = map(len, example.faces)
    return np.array([[s, s + k, s + k + 1] for s, n in zip(starts, sizes, strict=True) for k in range(1, n - 1)])


def test_gltf_source_with_normals_comes_back_bit_for_bit_and_unsplit(tmp_path: Path) -> None:
    example = with_normals(gltf_example())
    glb = glb_of(tmp_path, example)
    body, lid = glb.primitives()
    assert_same_bits(glb.attribute(body, "POSITION"), example.vertices[:5])
    assert_same_bits(glb.attribute(lid, "POSITION"), example.vertices[5:])
    np.testing.assert_array_equal(glb.triangles(body), [[0, 1, 2], [2, 1, 3]])
    np.testing.assert_array_equal(glb.triangles(lid), [[0, 2, 1]])
    source_uv = load_npz(tmp_path / "prep.npz", PREP)["source_uv"]  # one row for each loop
    assert_same_bits(glb.attribute(body, "TEXCOORD_0")[[0, 1, 2, 2, 1, 3]], source_uv[:6])
    assert_same_bits(glb.attribute(lid, "TEXCOORD_0")[[0, 2, 1]], source_uv[6:])
    assert_same_bits(corners(glb, "NORMAL").reshape(-1, 3), example.loop_normal)


def with_normals(example: Example) -> Example:
    """One unit normal for each vertex, of no particular direction."""
    normals = np.random.default_rng(0).normal(0, 1, (len(example.vertices), 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype("f4")
    return example.with_(loop_normal=normals[np.concatenate(example.faces)])


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
    geometry = next(iter(trimesh.load_scene(path, process=False).geometry.values()))
    assert_same_bits(geometry.vertices[geometry.faces], example.vertices[[[0, 1, 2], [2, 1, 3]]])


def test_own_uvs_of_an_obj_split_vertices_only_where_they_differ(tmp_path: Path) -> None:
    """Two quads share an edge; one of its ends has two UVs: one vertex is appended, all others keep their index."""
    vertices = odd_numbers((7, 3))  # the last one is not used
    uv = np.array([[0, 0], [0.25, 0], [0.25, 0.25], [0, 0.25], [0.5, 0], [0.75, 0], [0.75, 0.3], [0.25, 0.25]], "f4")
    example = Example(vertices, [[0, 1, 2, 3], [1, 4, 5, 2]], uv, [0, 1], [0, 0], one_part(), "obj", True)
    example = example.with_(loop_normal=np.tile([[0, 0, 1.0]], (8, 1)))
    glb = glb_of(tmp_path, example)
    (primitive,) = glb.primitives()
    assert_same_bits(glb.attribute(primitive, "POSITION"), vertices[[*range(7), 1]])
    np.testing.assert_array_equal(glb.triangles(primitive), [[0, 1, 2], [0, 2, 3], [7, 4, 5], [7, 5, 2]])
    flipped = np.stack([uv[:, 0], 1 - uv[:, 1]], 1)  # v is down in glTF
    assert_same_bits(glb.attribute(primitive, "TEXCOORD_0")[:6], flipped[[0, 1, 2, 3, 5, 6]])
    assert_same_bits(glb.attribute(primitive, "TEXCOORD_0")[[7]], flipped[[4]])


def test_each_kind_of_a_vertex_is_one_entry_however_often_and_in_whatever_order_it_recurs() -> None:
    vertex = np.array([1, 0, 1, 1, 1, 1, 1, 0])
    uv = np.array([[0, 0], [9, 9], [1, 0], [2, 0], [0, 0], [2, 0], [1, 0], [8, 8]], "f4")
    for attributes in ([uv], [0 * uv, uv], [uv[:, :1], uv[:, 1:], uv]):
        table = split_vertices(vertex, np.arange(8), attributes, 0, 3)
        np.testing.assert_array_equal(table.of_loop, [1, 0, 3, 4, 1, 4, 3, 5])
        np.testing.assert_array_equal(table.source, [0, 1, 2, 1, 1, 0])
        np.testing.assert_array_equal(table.loop, [1, 0, -1, 2, 3, 7])


@pytest.mark.parametrize("name", ["cube", "sheet", "gltf", "shear", "inside_out", "mirrored"])
def test_every_corner_is_the_sources_own(tmp_path: Path, name: str) -> None:
    """Positions, UVs and face order; the normals are those that were traced, turned into the part's frame."""
    example = EXAMPLES[name]
    prep = load_prep(tmp_path, example)
    glb = Glb.read(write(tmp_path, source_model(prep, double_sided=False)))
    loops, vertex = fans(example), np.concatenate(example.faces)
    assert_same_bits(corners(glb, "POSITION"), example.vertices[vertex[loops]])
    assert_same_bits(corners(glb, "TEXCOORD_0"), (example.loop_uv * [1, -1] + [0, 1]).astype("f4")[loops])
    assert_same_bits(corners(glb, "NORMAL"), loop_normals(prep)[loops])


def test_a_ball_on_a_block_is_smooth_on_the_ball_and_flat_on_the_block(tmp_path: Path) -> None:
    """Half smooth and half flat in one run of vertices: each corner has the normal that was traced."""
    ball = trimesh.creation.icosphere(2)
    block = trimesh.creation.box()
    vertices = np.concatenate([ball.vertices, block.vertices - [0, 0, 1.5]])
    faces = np.concatenate([ball.faces, block.faces + len(ball.vertices)])
    traced = np.concatenate([ball.vertices[ball.faces], np.repeat(block.face_normals[:, None], 3, 1)])
    example = Example(
        vertices, faces.tolist(), np.zeros((faces.size, 2), "f4"), [0] * len(faces), [0] * len(faces), one_part()
    ).with_(to_world=np.eye(4))
    prep = load_prep(tmp_path, example)
    prep = Artifact({**prep.arrays, "normals": traced.astype("f4")}, prep.provenance)
    glb = Glb.read(write(tmp_path, source_model(prep, double_sided=False)))
    np.testing.assert_allclose(corners(glb, "NORMAL"), traced, atol=1e-6)
    assert len(glb.attribute(glb.primitives()[0], "POSITION")) == len(ball.vertices) + 24


def test_normals_of_a_mirroring_node_point_outward(tmp_path: Path) -> None:
    """The node turns the winding round, the working mesh turned it back: nothing is inside out, nothing double-sided."""
    prep = load_prep(tmp_path, EXAMPLES["mirrored"])
    model = source_model(prep, double_sided=False)
    assert not model.double_sided
    (part,) = model.parts
    assert (np.einsum("vd,vd->v", part.normals, part.positions) > 0).all()  # a cube about its own origin


def test_faces_that_were_left_out_have_normals_on_their_side(tmp_path: Path) -> None:
    """The second of two faces back to back was not traced; a sliver that no traced face touches has its own."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 0, 0], [5, 1, 0], [5, 0, 1.0]])
    faces = [[0, 1, 2], [2, 1, 0], [3, 4, 5], [4, 4, 4]]
    uv = np.zeros((12, 2), "f4")
    prep = load_prep(tmp_path, Example(vertices, faces, uv, [0] * 4, [0] * 4, one_part(), to_world=np.eye(4)))
    tilted = np.array([[0, 0.6, 0.8]] * 3, "f4")
    kept = {name: prep[name][:1] for name in ("triangles", "normals", "uv", "charts", "triangle_loops")}
    prep = Artifact({**prep.arrays, **kept, "normals": tilted[None]}, prep.provenance)
    normals = loop_normals(prep)
    np.testing.assert_allclose(normals[:6], [[0, 0.6, 0.8]] * 3 + [[0, -0.6, -0.8]] * 3, atol=1e-6)
    np.testing.assert_allclose(normals[6:9], [[1, 0, 0]] * 3, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)


def test_concave_polygons_are_cut_as_they_were_traced(tmp_path: Path) -> None:
    """An arrowhead whose fan from its first corner would fold over."""
    vertices = np.array([[1, 0, 0], [0, 1, 0], [-1, -1, 0], [0, -0.2, 0.0]])[[1, 2, 3, 0]]
    example = Example(vertices, [[1, 2, 3, 0]], vertices[[1, 2, 3, 0], :2].astype("f4"), [0], [0], one_part(), "obj")
    prep = load_prep(tmp_path, example)
    glb = Glb.read(write(tmp_path, source_model(prep, double_sided=False)))
    a, b, c = np.moveaxis(corners(glb, "POSITION").astype(float), 1, 0)
    area = np.cross(b - a, c - a)[:, 2]
    assert (np.sign(area) == np.sign(area[0])).all()
    assert_same_bits(corners(glb, "POSITION"), vertices[prep["loop_vertex"][prep["triangle_loops"]]])


def test_obj_is_written_back_with_its_polygons_and_its_numbers(tmp_path: Path) -> None:
    vertices = np.random.default_rng(3).normal(0, 1, (8, 3))  # float64 with all its digits
    parts = one_part("a", "red paint", "a") + one_part("b", "", "b")
    normals = np.tile([[0, 0, 1.0]], (24, 1))
    example = cube().with_(vertices=vertices, source_format="obj", uv_kept=True, parts=parts, loop_normal=normals)
    example = example.with_(part=[0, 0, 1, 1, 0, 0], group=[-1, 0, 0, 1, 1, 0], groups=("left", "right"))
    write_obj(tmp_path / "model.obj", load_prep(tmp_path, example))
    source = read_obj(tmp_path / "model.obj")
    np.testing.assert_array_equal(source.vertices, vertices)
    np.testing.assert_array_equal(source.uv, example.loop_uv)
    assert [parts[0]["node"], parts[1]["node"]] == [part.node for part in source.parts][:2] == ["a", "b"]
    assert source.groups == ["left", "right"] and source.face_group is not None
    np.testing.assert_array_equal(source.face_group, example.group)
    np.testing.assert_array_equal(source.loop_vertex.reshape(-1, 4), example.faces)
    np.testing.assert_array_equal(source.normals[source.loop_normal], normals)
    text = (tmp_path / "model.mtl").read_text()
    assert "newmtl red paint" in text and "newmtl material" in text
    for line in ("map_Kd albedo.png", "map_Pr roughness.exr", "map_Pm metallic.exr"):
        assert text.count(line) == 2


def test_obj_without_normals_gets_those_that_were_traced(tmp_path: Path) -> None:
    """Beside a table of its own, from which one corner lacks its entry and one has a zero."""
    traced = np.repeat([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]], 4, 0)
    plain = cube().with_(source_format="obj")
    write_obj(tmp_path / "model.obj", load_prep(tmp_path, plain))
    source = read_obj(tmp_path / "model.obj")
    assert len(source.normals) == 6
    np.testing.assert_allclose(source.normals[source.loop_normal], traced, atol=1e-6)
    own = np.tile(np.array([[0.6, 0, 0.8]], "f4"), (24, 1))
    own[5] = 0
    prep = load_prep(tmp_path, plain.with_(loop_normal=own))
    prep["loop_source_normal"][9] = -1
    write_obj(tmp_path / "model.obj", prep)
    source = read_obj(tmp_path / "model.obj")
    assert_same_bits(source.normals[:24], own)  # the file's own table
    wanted = own.astype(float)
    wanted[[5, 9]] = traced[[5, 9]]
    np.testing.assert_allclose(source.normals[source.loop_normal], wanted, atol=1e-6)


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


def test_bad_source_normals_are_replaced_and_long_ones_shortened(tmp_path: Path) -> None:
    example = with_normals(gltf_example())
    assert example.loop_normal is not None
    own = example.loop_normal.copy()
    own[:3] *= np.float32(1.05)  # not of unit length, but a direction
    own[3:6] = (0, np.nan, 0)
    prep = load_prep(tmp_path, example.with_(loop_normal=own))
    normals = loop_normals(prep)
    np.testing.assert_allclose(normals[:3], example.loop_normal[:3], atol=1e-6)
    np.testing.assert_allclose(normals[3:6], prep["normals"][1] @ Y_UP_TO_WORLD[:3, :3], atol=1e-6)
    assert_same_bits(normals[6:], example.loop_normal[6:])


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

MIRROR = np.array([[-1, 0, 0, 3], [0, 2, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1.0]])

EXAMPLES = {
    "cube": cube(),
    "sheet": grid(5, lambda x, y: 0.1 * np.sin(6 * x)),
    "gltf": gltf_example(),
    "z_up": cube().with_(to_world=Z_UP_TO_WORLD),
    "inside_out": cube().with_(faces=[face[::-1] for face in cube().faces]),
    "mirrored": cube().with_(parts=[{**one_part()[0], "transform": MIRROR.reshape(-1).tolist()}]),
    "degenerate": cube().with_(faces=[*cube().faces[:5], [1, 5, 5, 3]]),
    "shear": cube().with_(parts=[{**one_part()[0], "transform": SHEAR.reshape(-1).tolist()}]),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_khronos_validator_finds_nothing(tmp_path: Path, name: str) -> None:
    path = write(tmp_path, source_model(load_prep(tmp_path, EXAMPLES[name]), double_sided=True))
    issues = khronos_issues(path)
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]
