"""What horizons call open is open: on smooth, sharp, broken and thin meshes, for rays as the transport starts them."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.light.gbuffer import GBuffer
from stages.light.horizon import across_edges, sector
from stages.light.scene import Scene
from stages.light.transport import Drawn, Starts
from stages.light.transport_kernels import settle
from tests.light import scenes


def random_rays(points: GBuffer, count: int) -> Drawn:
    """Rays of each point over its side of the triangle, from the smooth surface."""
    generator = np.random.default_rng(0)
    d = generator.normal(size=(len(points.n), count, 3))
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    d *= np.sign((d * points.ng[:, None]).sum(-1, keepdims=True))
    row = np.arange(len(points.n) * count, dtype=np.int32).reshape(-1, count)
    direction = d.reshape(-1, 3).astype(np.float32)
    origin = points.origin.repeat(count, 0)
    unused = np.zeros(len(direction), np.float32)
    return Drawn(origin, direction, unused.astype(np.int32), unused, row, np.zeros(len(direction), np.bool_))


def called_open(scene: Scene, points: GBuffer, count: int) -> tuple[NDArray, NDArray]:
    """Which of many rays are provably open, and which do hit something."""
    skyline = scene.skyline(points.triangle, points.ng)
    rays = random_rays(points, count)
    rows = np.arange(len(points.n))
    settle(rays, Starts(points.origin, points.surface(rows), points.ng, skyline), skyline)
    return rays.open, scene.intersect(rays.origin, rays.direction).mask


def waves(rows: int, height: float) -> Scene:
    """A sheet of hills and saddles, coarse enough for its smooth normals to lift rays."""
    y, x = np.mgrid[:rows, :rows] / (rows - 1) - 0.5
    z = height * np.sin(14 * x) * np.cos(11 * y + 3 * x)
    vertices = np.stack([x, y, z], -1).reshape(-1, 3)
    a = (np.arange(rows - 1)[:, None] * rows + np.arange(rows - 1)).ravel()
    triangles = np.concatenate([np.c_[a, a + 1, a + rows], np.c_[a + 1, a + rows + 1, a + rows]])
    face = scenes.flat_normals(vertices, triangles)[:, 0]
    mean = np.stack([np.bincount(triangles.ravel(), face.repeat(3, 0)[:, d], len(vertices)) for d in range(3)], -1)
    return Scene(vertices, triangles, (mean / np.linalg.norm(mean, axis=-1, keepdims=True))[triangles])


def soup(count: int) -> Scene:
    """Triangles that know nothing of each other."""
    generator = np.random.default_rng(3)
    corners = generator.uniform(-0.5, 0.5, (count, 1, 3)) + generator.normal(size=(count, 3, 3)) * 0.05
    triangles = np.arange(3 * count).reshape(-1, 3)
    return Scene(corners.reshape(-1, 3), triangles, scenes.flat_normals(corners.reshape(-1, 3), triangles))


@pytest.mark.parametrize(
    "make, least",
    [
        (lambda: scenes.sphere(4), 0.9),
        (scenes.box_in_corner, 0.005),
        (lambda: waves(40, 0.05), 0.1),
        (lambda: waves(150, 0.02), 0.4),
        (lambda: waves(60, 0.3), 0.0),
        (lambda: soup(300), 0.0),
    ],
)
def test_what_is_called_open_is_open(make, least: float) -> None:  # type: ignore[no-untyped-def]
    scene = make()
    points = scenes.view_of(scene, 96)
    clear, hit = called_open(scene, points, 64)
    assert not (clear & hit).any()
    assert clear.mean() >= least


def test_a_real_mesh(assets: Path) -> None:
    """Two fifths of the rays over a skull's triangles need not be traced."""
    import trimesh

    mesh = trimesh.load_mesh(assets / "meshes" / "skull.obj", process=False)
    vertices = (mesh.vertices - mesh.bounds.mean(0)) / np.ptp(mesh.bounds, axis=0).max()
    scene = Scene(vertices[:, [2, 0, 1]], mesh.faces, mesh.vertex_normals[:, [2, 0, 1]][mesh.faces])
    clear, hit = called_open(scene, scenes.view_of(scene, 48), 64)
    assert not (clear & hit).any()
    assert clear.mean() > 0.4


def test_nothing_is_known_of_backs() -> None:
    scene = waves(20, 0.0)
    points = scenes.view_of(scene, 16, eye=(1.0, 0.8, -2.0))
    clear, _ = called_open(scene, points, 4)
    assert not clear.any()


@pytest.mark.parametrize("seen", [True, False])
def test_a_wall_raises_the_horizon_towards_it_alone(seen: bool) -> None:
    """A floor with a wall half as high as the floor is wide, of the mesh or around it: at 45 degrees from the middle."""
    floor = waves(65, 0.0)
    wall = np.array([[-0.5, -0.5, 0.0], [-0.5, 0.5, 0.0], [-0.5, 0.5, 0.5], [-0.5, -0.5, 0.5]])
    sides = np.array([[0, 1, 2], [0, 2, 3]])
    scene = Scene(floor.vertices, floor.triangles, floor.normals, casters=(wall, sides))
    if seen:
        vertices = np.concatenate([floor.vertices, wall])
        triangles = np.concatenate([floor.triangles, len(floor.vertices) + sides])
        scene = Scene(vertices, triangles, scenes.flat_normals(vertices, triangles))
    middle = 32 * 64 + 32
    sky = scene.skyline(np.array([middle]), np.array([[0.0, 0.0, 1.0]]))
    frame, sine = sky.frame[sky.row[0]], sky.sine[sky.row[0]] / 255
    away, towards = (sector(*(frame[1:] @ np.array([x, 0.0, 0.0]))) for x in (1.0, -1.0))
    assert sine[away] < 0.01
    assert 0.5**0.5 < sine[towards] < 0.8


def test_edges() -> None:
    """Two triangles of a square know each other; a third on the same edge parts them, as does one wound the other way."""
    square = np.array([[0, 1, 2], [0, 2, 3]])
    assert across_edges(square).tolist() == [[-1, -1, 1], [0, -1, -1]]
    assert (across_edges(np.array([[0, 1, 2], [0, 2, 3], [0, 2, 4]])) == -1).all()
    assert (across_edges(np.array([[0, 1, 2], [2, 0, 3]])) == -1).all()
