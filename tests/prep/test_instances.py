"""A mesh that stands in several places has one texture, and stays one mesh in model.glb."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.asset.gltf import Look, Pictures, write_glb
from stages.asset.model import source_model
from stages.core.artifact import Artifact, load_npz
from stages.core.schemas import PREP
from stages.prep.instances import with_instances
from stages.prep.options import PrepOptions
from stages.prep.read_gltf import read_gltf
from stages.prep.stage import prep
from tests.asset.glb import Glb
from tests.prep.shapes import GltfBuilder, cube

NEW = PrepOptions(texture_size=256, padding=2, unwrap_triangles=0)


def box(built: GltfBuilder, uv: bool = False, moved: float = 0.0) -> dict[str, object]:
    """A cube, its faces each with vertices of its own."""
    vertices, faces = cube()
    corners = np.asarray(faces).reshape(-1)
    attributes = {"POSITION": built.accessor(np.float32(np.asarray(vertices)[corners]), "VEC3")}
    if uv:
        attributes["TEXCOORD_0"] = built.accessor(np.float32(box_uv(len(corners) // 3) + moved), "VEC2")
    return {"attributes": attributes, "indices": built.accessor(np.arange(len(corners), dtype=np.uint32), "SCALAR")}


def box_uv(count: int) -> NDArray:
    """Each triangle in a cell of its own."""
    side = int(np.ceil(np.sqrt(count)))
    cell = np.stack([np.arange(count) % side, np.arange(count) // side], -1)[:, None]
    return ((cell + np.array([(0.1, 0.1), (0.9, 0.1), (0.1, 0.9)])) / side).reshape(-1, 2)


def scene(path: Path, uv: bool) -> Path:
    """Three nodes with one mesh, of which the last is mirrored and larger, an instanced one, and another box alone."""
    built = GltfBuilder()
    mesh = box(built, uv)
    built.mesh([mesh], name="one")
    built.root["nodes"] += [
        {"name": "two", "mesh": 0, "translation": [3, 0, 0]},
        {"name": "three", "mesh": 0, "translation": [0, 4, 0], "scale": [-2, 2, 2]},
    ]
    shift = built.accessor(np.float32([(0, 0, 5), (0, 0, 8)]), "VEC3")
    extension = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": shift}}}
    built.root["nodes"].append({"name": "many", "mesh": 0, "extensions": extension})
    built.mesh([box(built, uv, 1.0) if uv else {**box(built), "material": 0}], name="alone", translation=[6, 6, 6])
    built.root["materials"] = [{"name": "other"}]
    built.root["scenes"] = [{"nodes": list(range(len(built.root["nodes"])))}]
    return built.write(path)


def prepared(folder: Path, uv: bool, options: PrepOptions) -> Artifact:
    prep(scene(folder / "scene.glb", uv), folder / "prep.npz", options)
    return load_npz(folder / "prep.npz", PREP)


def uv_of_parts(mesh: Artifact) -> list[NDArray]:
    part = np.repeat(mesh["face_part"], np.diff(mesh["loop_start"]))
    return [mesh["loop_uv"][part == number] for number in range(len(mesh.provenance.extra["parts"]))]


def test_what_is_equal_to_the_bit_is_an_instance_and_what_differs_in_uvs_or_slot_is_not(tmp_path: Path) -> None:
    for uv in (False, True):
        parts = with_instances(read_gltf(scene(tmp_path / "scene.glb", uv))).parts
        assert [(part.node, part.instance_of) for part in parts] == [
            ("one", -1), ("two", 0), ("three", 0), ("many_0", 0), ("many_1", 0), ("alone", -1),
        ]  # fmt: skip


def test_new_uvs_are_made_for_the_first_and_shown_by_all(tmp_path: Path) -> None:
    mesh = prepared(tmp_path, False, NEW)
    one, *others, alone = uv_of_parts(mesh)
    for uv in others:
        np.testing.assert_array_equal(uv, one)
    assert not any((alone[:, None] == one).all(-1).any(1))
    assert mesh.provenance.extra["shared_texels"]
    assert "4 instances show the texels of the first of their kind" in mesh.provenance.extra["findings"]["uv"]
    represents = np.flatnonzero(mesh["charts"] == mesh["charts"].min())
    part = mesh["face_part"][np.searchsorted(mesh["loop_start"], mesh["triangle_loops"][represents, 0], "right") - 1]
    assert set(part.tolist()) == {2}  # the largest has the texels, so that none is coarser than it must be


@pytest.mark.parametrize("uv", [False, True], ids=["new", "kept"])
def test_the_mesh_stays_one_in_the_model(tmp_path: Path, uv: bool) -> None:
    mesh = prepared(tmp_path, uv, NEW)
    assert mesh.provenance.extra["uv_kept"] == uv
    write_glb(tmp_path / "model.glb", source_model(mesh, False), Look([Pictures({"albedo": b"", "orm": b""})]))
    root = Glb.read(tmp_path / "model.glb").root
    assert [(node["name"], node["mesh"]) for node in root["nodes"]] == [
        ("one", 0), ("two", 0), ("three", 0), ("many_0", 0), ("many_1", 0), ("alone", 1),
    ]  # fmt: skip
    assert len(root["meshes"]) == 2


def test_instances_may_have_texels_of_their_own(tmp_path: Path) -> None:
    mesh = prepared(tmp_path, True, PrepOptions(texture_size=256, padding=2, unwrap_triangles=0, own_instances=True))
    every = np.concatenate([np.unique(uv.round(5), axis=0) for uv in uv_of_parts(mesh)])
    assert len(np.unique(every, axis=0)) == len(every)
    assert "instances are to have texels of their own" in mesh.provenance.extra["findings"]["uv"]
    write_glb(tmp_path / "model.glb", source_model(mesh, False), Look([Pictures({"albedo": b"", "orm": b""})]))
    assert len(Glb.read(tmp_path / "model.glb").root["meshes"]) == 6
