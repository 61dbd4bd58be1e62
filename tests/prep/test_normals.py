"""Shading normals: the file's where they can be trusted, otherwise creased."""

from pathlib import Path

import numpy as np
import pytest

from stages.prep.normals import authored, corner_angles, creased, face_normals, shading_normals
from stages.prep.read_gltf import read_gltf
from tests.prep.shapes import GltfBuilder, cube, sphere


def test_a_cube_stays_sharp_and_a_sphere_is_smooth() -> None:
    vertices, triangles = cube()
    own, _ = face_normals(vertices, triangles)
    np.testing.assert_allclose(creased(vertices, triangles, 40), np.repeat(own[:, None], 3, 1), atol=1e-12)
    vertices, triangles = sphere(24, 48)
    error = np.arccos(np.clip((creased(vertices, triangles, 40) * vertices[triangles]).sum(-1), -1, 1))
    assert np.degrees(error).max() < 1.0  # the facets themselves are off by up to 5 degrees


def test_a_wide_crease_angle_rounds_the_cube_evenly() -> None:
    """Weights by area and angle do not see how quads were cut: each corner's normal is its diagonal."""
    vertices, triangles = cube()
    expected = (vertices * 2 - 1)[triangles] / 3**0.5
    np.testing.assert_allclose(creased(vertices, triangles, 100), expected, atol=1e-12)


def test_the_crease_angle_is_an_angle() -> None:
    """Two squares hinged at 30 degrees: sharp below, smooth above."""
    bend = np.radians(30)
    vertices = np.array([(0, 0, 0), (0, 1, 0), (-1, 1, 0), (-1, 0, 0),
                         (np.cos(bend), 1, np.sin(bend)), (np.cos(bend), 0, np.sin(bend))])  # fmt: skip
    triangles = np.array([(0, 1, 2), (0, 2, 3), (0, 5, 4), (0, 4, 1)])
    own, _ = face_normals(vertices, triangles)
    np.testing.assert_allclose(creased(vertices, triangles, 29), np.repeat(own[:, None], 3, 1), atol=1e-12)
    smooth = creased(vertices, triangles, 31)
    middle = (own[0] + own[2]) / np.linalg.norm(own[0] + own[2])
    np.testing.assert_allclose(smooth[[0, 1, 2, 3], [0, 0, 0, 0]], np.tile(middle, (4, 1)), atol=1e-12)


def test_winding_clashes_do_not_mix_corners() -> None:
    """A neighbour wound the other way is still joined at the right corners."""
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0.1)])
    normals = creased(vertices, np.array([(0, 1, 2), (1, 3, 2)]), 40)
    assert np.allclose(normals[0, 1], normals[1, 0]) and np.allclose(normals[0, 2], normals[1, 2])
    assert not np.allclose(normals[0, 0], normals[0, 1])


def test_angles_of_a_triangle_sum_to_pi() -> None:
    vertices = np.random.default_rng(0).random((3, 3))
    angles = corner_angles(vertices, np.array([(0, 1, 2)]))
    assert angles.sum() == pytest.approx(np.pi) and angles.shape == (1, 3)


def test_normals_follow_their_node(tmp_path: Path) -> None:
    """Under an uneven scale normals transform by the inverse transpose; lengths and zero vectors are refused."""
    built = GltfBuilder()
    normal = np.array([(1, 1, 0)], np.float32) / np.float32(2**0.5)
    given = np.concatenate([normal, normal * 3, normal * 0])
    attributes = {"POSITION": built.accessor(np.eye(3, dtype=np.float32), "VEC3"),
                  "NORMAL": built.accessor(given, "VEC3")}  # fmt: skip
    built.mesh([{"attributes": attributes}], scale=[2, 1, 1])
    result = authored(read_gltf(built.write(tmp_path / "a.glb")), np.array([[0, 1, 2]]), np.eye(4))
    np.testing.assert_allclose(result[0, 0], np.array([0.5, 1, 0]) / 1.25**0.5, atol=1e-6)
    assert np.isnan(result[0, 1:]).all()


def test_authored_normals_are_kept_where_they_agree() -> None:
    vertices, triangles = sphere()
    given = vertices[triangles].copy()
    given[3, 1] = np.nan
    given[5] = -given[5]
    normals, kept = shading_normals(given, vertices, triangles, np.zeros(len(triangles), int), 40)
    assert kept == triangles.size - 4
    good = np.ones(len(triangles), bool)
    good[[3, 5]] = False
    np.testing.assert_array_equal(normals[good], vertices[triangles][good].astype(np.float32))
    assert np.isfinite(normals).all()
    assert ((normals * face_normals(vertices, triangles)[0][:, None]).sum(-1) > 0).all()


def test_normals_of_an_inside_out_mesh_turn_with_it() -> None:
    """The winding was turned outward; the file's normals all still point in, and are turned too."""
    vertices, triangles = sphere()
    normals, kept = shading_normals(-vertices[triangles], vertices, triangles, np.zeros(len(triangles), int), 40)
    assert kept == triangles.size
    np.testing.assert_allclose(normals, vertices[triangles], atol=1e-6)
