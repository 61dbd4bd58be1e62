import numpy as np
import pytest
from numpy.random import default_rng

from stages.core.artifact import schema_problem
from stages.core.frames import look_at, project
from stages.light.gbuffer import trace_view
from stages.light.scene import Scene
from stages.prior.profile import SIZE
from stages.train import lights, render, shapes


@pytest.mark.parametrize("seed", range(6))
def test_lights_are_valid_environments(seed: int) -> None:
    light = lights.random_light(default_rng(seed), "light")
    assert light.radiance.shape == (lights.HEIGHT, 2 * lights.HEIGHT, 3) and light.radiance.dtype == np.float32
    assert np.isfinite(light.radiance).all() and light.radiance.min() >= 0 and light.radiance.max() > 0


@pytest.mark.parametrize("seed", range(5))
def test_cameras_frame_the_object(seed: int) -> None:
    rng = default_rng(seed)
    shape = shapes.make_shape(rng)
    c2w, fov = render.random_camera(shape, rng)
    xy, depth = project(shape.vertices.astype(float), c2w, fov, 2, 2)
    assert depth.min() > 0
    assert 0.55 < np.abs(xy - 1).max() <= 0.86


@pytest.mark.parametrize("stride", [4, 2, 1])
def test_tiles_are_point_samples_of_their_view(stride: int) -> None:
    shape = shapes.finish(shapes.Mesh(shapes.cube_sphere(16), shapes.grid_cube(16)), 0.6)
    c2w = look_at(np.array([2.5, 0.3, 0.4]), np.zeros(3), np.array([0.0, 0, 1]))
    view = trace_view(Scene(shape.vertices, shape.triangles, shape.normals), c2w, 0.6, render.VIEW, render.VIEW)
    tile = render.cut(view, stride, default_rng(0))
    assert tile.mask.shape == (SIZE, SIZE) and len(tile.point) == tile.mask.sum() > 100
    xy, depth = project(tile.point.astype(float), c2w, 0.6, render.VIEW, render.VIEW)
    assert np.allclose(depth, tile.depth[tile.mask], atol=1e-4)
    rows, columns = np.argwhere(tile.mask).T
    assert np.allclose(np.diff(xy[:, 0]), np.diff(columns) * stride, atol=2e-2)
    assert np.allclose(np.diff(xy[:, 1]), np.diff(rows) * stride, atol=2e-2)


def test_a_shard_is_whole_and_follows_its_seed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(render, "LIGHTS", 1)
    shard = render.render_shard(0, 2, seed=7)
    assert schema_problem(render.SHARD, shard) is None
    again = render.render_shard(0, 2, seed=7)
    assert all(np.array_equal(shard[name], again[name]) for name in shard)
    assert shard["footprint"].min() > 0 and shard["piece"].max() < (shard["pieces_shape"] == shard["shape"].max()).sum()
    assert shard["transport"].max() > 0 and shard["start"][-1] == shard["mask"].sum() == len(shard["point"])
