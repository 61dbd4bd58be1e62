"""What is welded, left out and counted, and the frame of the working mesh."""

from pathlib import Path

import numpy as np
import pytest

from stages.core.errors import InputError
from stages.core.frames import transform_points
from stages.prep.measure import topology
from stages.prep.read_gltf import read_gltf
from stages.prep.read_obj import read_obj
from stages.prep.repair import Working, altitude, repair, weld
from stages.prep.topology import edges
from tests.prep.shapes import CUBE_QUADS, GltfBuilder, cube, cube_corners, write_obj

TOLERANCE = 1e-6


def mended(path: Path, up: str = "y") -> Working:
    read = read_gltf if path.suffix == ".glb" else read_obj
    return repair(read(path), up, TOLERANCE, path)


def is_closed(working: Working) -> bool:
    return bool((edges(working.triangles).faces == 2).all())


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
@pytest.mark.parametrize("jitter, closed", [(0.0, True), (1e-7, True), (1e-4, False)])
def test_cracks_close_within_a_tolerance_that_scales(tmp_path: Path, scale: float, jitter: float, closed: bool) -> None:
    """A cube of loose quads whose corners differ by rounding is closed; one whose gaps are real is not."""
    soup = np.concatenate([cube_corners()[list(quad)] for quad in CUBE_QUADS])
    soup += jitter * np.random.default_rng(0).uniform(-1, 1, soup.shape)
    faces = np.arange(24).reshape(6, 4)
    working = mended(write_obj(tmp_path / "a.obj", soup * scale + 3 * scale, faces))
    assert is_closed(working) is closed
    assert len(working.vertices) == (8 if closed else 24)


@pytest.mark.parametrize("scale", [1e-30, 1e-4, 1.0, 1e4, 1e30])
def test_the_world_frame(tmp_path: Path, scale: float) -> None:
    """Longest edge 1, centred, +y up and +z front of the source become z and +x."""
    box = cube_corners() * [2.0, 4.0, 1.0]
    working = mended(write_obj(tmp_path / "a.obj", (box + [5, 6, 7]) * scale, CUBE_QUADS))
    np.testing.assert_allclose(working.vertices.min(0), [-0.125, -0.25, -0.5], atol=1e-7)
    np.testing.assert_allclose(working.vertices.max(0), [0.125, 0.25, 0.5], atol=1e-7)
    top_front = transform_points(working.to_world, (np.array([1.0, 4, 1]) + [5, 6, 7]) * scale)
    np.testing.assert_allclose(top_front, [0.125, 0, 0.5], atol=1e-7)


def test_z_up_puts_minus_y_in_front(tmp_path: Path) -> None:
    path = write_obj(tmp_path / "a.obj", cube_corners(), CUBE_QUADS)
    front_top = transform_points(mended(path, "z").to_world, np.array([0.5, 0.0, 1.0]))
    np.testing.assert_allclose(front_top, [0.5, 0, 0.5], atol=1e-12)


def test_unused_and_infinite_vertices_do_not_move_the_frame(tmp_path: Path) -> None:
    vertices = np.concatenate([cube_corners(), [(1e6, 0, 0), (np.inf, 0, 0), (np.nan, 1, 1)]])
    path = write_obj(tmp_path / "a.obj", vertices, [*CUBE_QUADS, (0, 1, 9)])
    working = mended(path)
    assert np.abs(working.vertices).max() == 0.5 and is_closed(working)
    found = working.findings
    assert (found["unreferenced_vertices"], found["non_finite_vertices"], found["non_finite_faces"]) == (2, 2, 1)


def test_faces_without_a_side_and_twins_are_left_out_and_counted(tmp_path: Path) -> None:
    vertices = np.concatenate([cube_corners(), [(0.5, 0, 0)]])
    extra = [(0, 1, 1), (0, 8, 1), (0, 2, 1), (1, 2, 0), (0, 8, 8, 1)]  # (0, 2, 1) is half of the cube's bottom
    working = mended(write_obj(tmp_path / "a.obj", vertices, [*CUBE_QUADS, *extra]))
    assert len(working.triangles) == 12
    found = working.findings
    assert (found["degenerate"], found["zero_area"], found["duplicates"]) == (2, 2, 2)


def test_loops_of_left_out_faces_have_stand_ins_at_their_vertex(tmp_path: Path) -> None:
    """A card drawn twice, back and front: the second copy takes the first one's UVs corner by corner."""
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 0), (1, 0, 0), (0, 1, 0)], float)
    path = write_obj(tmp_path / "a.obj", vertices, [(0, 1, 2), (5, 4, 3), (0, 0, 1)])
    working = mended(path)
    assert len(working.triangles) == 1
    assert working.stand_in[:6].tolist() == [0, 1, 2, 2, 1, 0]
    assert read_obj(path).loop_vertex[working.stand_in[6:]].tolist() == [0, 0, 1]


def test_loops_of_triangles_name_their_source_corners(tmp_path: Path) -> None:
    path = write_obj(tmp_path / "a.obj", cube_corners(), CUBE_QUADS)
    working, source = mended(path), read_obj(path)
    placed = transform_points(working.to_world, source.vertices[source.loop_vertex[working.loops]])
    np.testing.assert_allclose(working.vertices[working.triangles], placed, atol=1e-7)


def test_a_mirroring_node_turns_its_faces(tmp_path: Path) -> None:
    vertices, triangles = cube()
    built = GltfBuilder()
    position = built.accessor(vertices.astype(np.float32), "VEC3")
    index = built.accessor(triangles.reshape(-1).astype(np.uint16), "SCALAR")
    built.mesh([{"attributes": {"POSITION": position}, "indices": index}], scale=[-1, 1, 1])
    working = mended(built.write(tmp_path / "a.glb"))
    corners = working.vertices[working.triangles]
    assert np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6 == pytest.approx(1)


@pytest.mark.parametrize(
    "vertices, cause",
    [
        (np.full((3, 3), np.nan), "no face has finite vertices"),
        (np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0)]), "none of its 1 faces has an area"),
        (np.ones((3, 3)), "one point"),
    ],
)
def test_nothing_usable_is_an_error(tmp_path: Path, vertices: np.ndarray, cause: str) -> None:
    path = write_obj(tmp_path / "a.obj", vertices, [(0, 1, 2)])
    with pytest.raises(InputError, match=cause):
        mended(path)


def test_weld_against_all_pairs() -> None:
    """Chains of close pairs are what counts."""
    rng = np.random.default_rng(5)
    points = np.concatenate([rng.random((60, 3)), rng.random((60, 3)) * 0.2])
    points = np.concatenate([points, points[:40] + rng.uniform(-0.02, 0.02, (40, 3)), points[:5]])
    near = np.linalg.norm(points[:, None] - points[None], axis=-1) <= 0.05
    reach = near.copy()
    while (bigger := reach @ near).sum() > reach.sum():
        reach = bigger
    assert (weld(points, 0.05) == reach.argmax(1)).all()


def test_weld_of_very_many_points_in_one_place_ends() -> None:
    points = np.random.default_rng(0).random((60_000, 3)) * 1e-9
    assert (weld(points, 1e-6) == 0).all()


def test_altitude() -> None:
    corners = np.array([[(0, 0, 0), (4, 0, 0), (1, 3, 0)], [(0, 0, 0), (1, 1, 1), (2, 2, 2)], [(1, 1, 1)] * 3], float)
    np.testing.assert_allclose(altitude(corners), [12 / np.sqrt(18), 0, 0], atol=1e-12)


def test_topology_of_a_cube_and_of_a_cube_without_its_lid() -> None:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.int32)
    assert topology(corners, faces) == {"non_manifold_vertices": 0, "holes": 0, "genus": 0}
    assert topology(corners, faces[:-2])["holes"] == 1
