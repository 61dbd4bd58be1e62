"""Horizons: nothing stands over them, they are not far too high, and light is the same without the rays over them."""

import numpy as np
import pytest
import torch
import trimesh
from numpy.typing import NDArray

from stages.core.frames import tangent_frame
from stages.light import horizon
from stages.light.horizon import SECTORS, WALL, Horizons, sector_of
from stages.light.scene import OFFSET, Scene
from stages.light.transport import QUALITY, light_transport
from tests.light import scenes
from tests.light.test_transport import stacked

TO_SKY = np.array([[np.cos(a) * np.sqrt(1 - z * z), np.sin(a) * np.sqrt(1 - z * z), z]
                   for z in (0.21, 0.3, 0.45, 0.7, 0.95) for a in np.arange(48) / 48 * 2 * np.pi + 0.01])  # fmt: skip


def of(vertices: NDArray, triangles: NDArray, casters: tuple[NDArray, NDArray] | None = None) -> Scene:
    vertices = vertices.astype(np.float32)
    return Scene(vertices, triangles, scenes.flat_normals(vertices, triangles), casters=casters)


def dented() -> Scene:
    """A ball with a bowl cut into it: part of it sees itself."""
    ball = scenes.sphere(4)
    vertices = ball.vertices.copy()
    centre = np.array([0.45, 0.3, 0.25])
    near = np.linalg.norm(vertices - centre, axis=1) < 0.35
    vertices[near] -= (0.5 * (vertices[near] - centre + 0.35 * centre / np.linalg.norm(centre))).astype(np.float32)
    return of(vertices, ball.triangles)


def rough() -> Scene:
    """A ball whose every vertex is moved."""
    ball = scenes.sphere(4)
    return of(ball.vertices * np.random.default_rng(5).uniform(0.94, 1.0, (len(ball.vertices), 1)), ball.triangles)


def ring() -> Scene:
    mesh = trimesh.creation.torus(0.36, 0.12, 32, 16)
    return of(mesh.vertices, mesh.faces.astype(np.int32))


def crumbs() -> Scene:
    """Triangles of all sizes anywhere, through each other and on each other's edges and corners."""
    random = np.random.default_rng(8)
    loose = random.uniform(-0.5, 0.5, (150, 1, 3)) + random.normal(0, 1, (150, 3, 3)) * random.uniform(0.01, 0.15, (150, 1, 1))
    fan = np.concatenate([np.zeros((60, 1, 3)), random.normal(0, 0.2, (60, 2, 3))], 1)
    corners = np.concatenate([loose, fan])
    return of(corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3))


def cart() -> Scene:
    """Slender boxes that touch, with a caster over them."""
    places = [trimesh.transformations.translation_matrix([0, y, 0]) for y in (0, 0.05, 0.2)]
    boxes = [trimesh.creation.box((0.9, 0.05, 0.05), place) for place in places]
    mesh = trimesh.util.concatenate(boxes)
    roof = np.array([[-0.2, -0.2, 0.3], [0.2, -0.2, 0.3], [0, 0.3, 0.35]], np.float32), np.array([[0, 1, 2]], np.int32)
    return of(mesh.vertices, mesh.faces.astype(np.int32), roof)


LEAST_TOLD = {"ball": 0.99, "dented": 0.9, "rough": 0.28, "ring": 0.55, "crumbs": 0.07, "cart": 0.6}
"""Share of open rays that are known to be open."""

ALL = {"ball": lambda: scenes.sphere(3), "dented": dented, "rough": rough, "ring": ring, "crumbs": crumbs, "cart": cart}


@pytest.mark.parametrize("name", ALL)
def test_no_ray_over_a_horizon_meets_anything(name: str) -> None:
    scene = ALL[name]()
    front = told(scene)
    random = np.random.default_rng(1)
    triangle = random.integers(0, len(scene.triangles), 4000)
    weights = random.dirichlet(np.full(3, 0.4), len(triangle)).astype(np.float32)  # many by edges and corners
    normal = scene.geometric_normal(triangle)
    t, b = tangent_frame(normal)
    origin = scene.point(triangle, weights) + OFFSET * normal
    wrong, over, free = 0, 0, 0
    for x, y, z in TO_SKY:
        hit = scene.occluded(origin, x * t + y * b + z * normal)
        higher = z * WALL > front[triangle, sector_of(np.float32(x), np.float32(y))]
        wrong, over, free = wrong + (hit & higher).sum(), over + (higher & ~hit).sum(), free + (~hit).sum()
    assert wrong == 0
    assert over > LEAST_TOLD[name] * free


def told(scene: Scene) -> NDArray[np.uint8]:
    """The horizons of all its triangles."""
    for _ in range(horizon.PAYS):
        scene.horizons.meet(np.arange(len(scene.triangles)))
    return scene.horizons.front


def test_a_wall_rises_where_it_stands_as_high_as_it_is() -> None:
    tile = np.array([[0, 0, 0], [0.01, 0, 0], [0, 0.01, 0]])
    wall = np.array([[0.5, -5.0, 0], [0.5, 5.0, 0], [0.5, 5.0, 0.5], [0.5, -5.0, 0.5]])
    scene = of(np.concatenate([tile, wall]), np.array([[0, 1, 2], [3, 4, 5], [3, 5, 6]], np.int32))
    t, b = (axis[0] for axis in tangent_frame(scene.geometric_normal(np.array([0]))))
    front = told(scene)[0]
    for s in range(SECTORS):
        a = (s + 0.5) * 2 * np.pi / SECTORS
        towards = np.cos(a) * t[0] + np.sin(a) * b[0]  # along +x
        sine = np.sin(np.arctan(towards)) if towards > 0 else 0
        assert front[s] >= min(max(sine, 0.2), 0.98) * WALL
        if towards < -0.3:
            assert front[s] == np.ceil(0.2 * WALL)


def test_horizons_are_told_of_triangles_that_are_met_often() -> None:
    scene = dented()
    bowl = np.flatnonzero(scene.horizons.front[:, 0] == WALL)
    scene.horizons.meet(np.repeat(bowl[:3], horizon.PAYS - 1))
    assert (scene.horizons.front[bowl] == WALL).all()
    scene.horizons.meet(bowl[:1])
    assert (scene.horizons.front[bowl[0]] < WALL).any()
    assert (scene.horizons.front[bowl[1:]] == WALL).all()


def test_a_triangle_without_area_is_all_walls() -> None:
    line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 1]])
    nothing = np.zeros((0, 3)), np.zeros((0, 3), int)
    horizons = Horizons(line, np.array([[0, 1, 2], [0, 1, 3]]), np.array([[0, 0, 0], [0, 0, 1.0]]), nothing)
    horizons.meet(np.zeros(horizon.PAYS, int))
    assert (horizons.front[0] == WALL).all()


@pytest.mark.parametrize("name", ["ball", "dented", "ring"])
def test_light_is_the_same_with_fewer_rays(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = ALL[name]()
    points, light = scenes.view_of(scene, 40), scenes.sunny_light()
    told(scene)
    asked: list[int] = []
    occluded = scene.occluded

    def counted(origins: NDArray, directions: NDArray, some: NDArray) -> NDArray[np.bool_]:
        asked.append(len(some))
        return occluded(origins, directions, some)

    monkeypatch.setattr(scene, "occluded", counted)
    found, rays = [], []
    for _ in range(2):
        asked.clear()
        found.append(stacked(light_transport(scene, points, [light], QUALITY["draft"], 3)[0]))
        rays.append(sum(asked))
        scene.horizons.front[:] = scene.horizons.behind[:] = WALL
    assert torch.equal(*found)
    assert rays[0] < 0.6 * rays[1]
