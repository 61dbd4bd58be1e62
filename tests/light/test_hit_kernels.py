"""What is compiled for points on triangles, beside NumPy, to the bit."""

import numpy as np
import pytest

from stages.light import hit_reference
from stages.light.scene import OFFSET, Scene


@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_kernels_are_the_reference_to_the_bit(kind: str) -> None:
    """Twelve thousand points of a soup of triangles, some without area, some whose corners' normals cancel out."""
    rng = np.random.default_rng(0)
    vertices, triangles = rng.uniform(-0.5, 0.5, (300, 3)).astype("f4"), rng.integers(0, 300, (500, 3)).astype("i4")
    normals = rng.normal(size=(500, 3, 3)).astype("f4")
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    normals[:20, 1], normals[:20, 2] = -normals[:20, 0], normals[:20, 0]
    triangle, weights = rng.integers(0, 500, 12_000).astype("i4"), rng.dirichlet((1, 1, 1), 12_000).astype(kind)
    weights[triangle < 20] = (0.25, 0.5, 0.25)
    scene, side = Scene(vertices, triangles, normals), rng.choice([-1.0, 1.0], 12_000)
    flat = scene.geometric_normal(np.arange(500))
    shape, lifts = (scene.vertices, scene.triangles), np.stack([side, OFFSET * side], -1)
    for found, wanted in (
        (scene.point(triangle, weights), hit_reference.points(*shape, triangle, weights)),
        (scene.smooth_normal(triangle, weights), hit_reference.smooth_normals(normals, flat, triangle, weights)),
        (scene.ray_origin(triangle, weights, side), hit_reference.origins(*shape, normals, flat, triangle, weights, lifts)),
    ):
        assert found.dtype == np.float32
        np.testing.assert_array_equal(found, wanted)
    assert (scene.smooth_normal(triangle, weights)[triangle < 20] == flat[triangle[triangle < 20]]).all()
