import numpy as np
import pytest
import trimesh
from numpy.random import default_rng

from stages.train import shapes


@pytest.mark.parametrize("part", shapes.PARTS, ids=lambda part: part.__name__)
@pytest.mark.parametrize("seed", range(4))
def test_parts_are_closed_and_face_outwards(part, seed: int) -> None:
    mesh = part(default_rng(seed))
    assert np.isfinite(mesh.vertices).all()
    solid = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    assert solid.is_watertight and solid.is_winding_consistent and solid.volume > 0


@pytest.mark.parametrize("seed", range(8))
def test_shapes_are_normalised_with_unit_normals(seed: int) -> None:
    shape = shapes.make_shape(default_rng(seed))
    low, high = shape.vertices.min(0), shape.vertices.max(0)
    assert (high - low).max() == pytest.approx(1, abs=1e-5)
    assert np.allclose(low + high, 0, atol=1e-5)
    used = np.linalg.norm(shape.normals, axis=-1)
    assert np.abs(used - 1).max() < 1e-4 or (used < 1e-4).mean() < 1e-3  # a triangle without area has none


def test_shapes_follow_their_seed_and_differ() -> None:
    first, again, other = (shapes.make_shape(default_rng(seed)) for seed in (3, 3, 4))
    assert np.array_equal(first.vertices, again.vertices)
    assert first.vertices.shape != other.vertices.shape or not np.array_equal(first.vertices, other.vertices)


def test_hard_edges_stay_hard_and_soft_ones_smooth() -> None:
    cube = shapes.Mesh(shapes.cube_sphere(4), shapes.grid_cube(4))
    flat = shapes.Mesh(cube.vertices / np.abs(cube.vertices).max(1, keepdims=True), cube.triangles)
    sharp = shapes.finish(flat, np.radians(30)).normals
    assert np.allclose(np.abs(sharp).max(-1), 1)  # each along an axis
    round_ = shapes.finish(shapes.Mesh(shapes.cube_sphere(16), shapes.grid_cube(16)), np.radians(30))
    corners = round_.vertices[round_.triangles]
    outward = corners / np.linalg.norm(corners, axis=-1, keepdims=True)
    assert (round_.normals * outward).sum(-1).min() > 0.99
