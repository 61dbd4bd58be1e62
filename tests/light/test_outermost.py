"""What lies outermost needs no rays: which triangles do, and that light is the same to the last bit."""

import numpy as np
import pytest
import torch
import trimesh
from numpy.typing import NDArray

from stages.light import transport
from stages.light.outermost import outermost
from stages.light.scene import Scene
from stages.light.transport import QUALITY, light_transport
from tests.light import scenes
from tests.light.test_transport import stacked

NOTHING = np.zeros((0, 3))


def test_all_of_a_ball_and_of_a_cut_box_lies_outermost_in_front_and_nothing_behind() -> None:
    box = trimesh.creation.box().subdivide().subdivide()
    turned = box.vertices @ trimesh.transformations.rotation_matrix(0.7, [0.1, 0.7, 0.3])[:3, :3]
    ball = scenes.sphere(3)
    for vertices, triangles in ((turned.astype(np.float32), box.faces), (ball.vertices, ball.triangles)):
        found = outermost(vertices, triangles, NOTHING)
        assert found[:, 0].all() and not found[:, 1].any()


@pytest.mark.parametrize("height", [1e-4, 0.1, 50.0])
def test_whatever_stands_over_a_plane_counts(height: float) -> None:
    box = trimesh.creation.box()
    over = np.array([[0.3, 0.1, 0.5 + height]])
    top = box.face_normals[:, 2] > 0.5
    found = outermost(box.vertices, box.faces, over)[:, 0]
    assert not found[top].any()
    assert found[~top].all()  # it leans over none of the others


def test_walls_lie_outermost_behind_and_a_flat_sheet_is_left_to_rays() -> None:
    corner = scenes.box_in_corner()
    found = corner.outermost
    assert not found[:, 0].any() and found[:, 1].any()
    sheet = scenes.square(2, 0.0, -0.5, 0.5)
    assert not outermost(sheet, np.array([[0, 1, 2], [0, 2, 3]]), NOTHING).any()


def dented() -> Scene:
    """A ball with a bowl cut into it: part of it sees itself."""
    ball = scenes.sphere(4)
    vertices = ball.vertices.copy()
    centre = np.array([0.45, 0.3, 0.25])
    near = np.linalg.norm(vertices - centre, axis=1) < 0.35
    vertices[near] -= (0.5 * (vertices[near] - centre + 0.35 * centre / np.linalg.norm(centre))).astype(np.float32)
    return Scene(vertices, ball.triangles, scenes.flat_normals(vertices, ball.triangles))


@pytest.mark.parametrize("scene", [scenes.sphere(4), dented()], ids=["ball", "dented"])
def test_light_is_the_same_with_fewer_rays(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    points, light = scenes.view_of(scene, 40), scenes.sunny_light()
    asked: list[int] = []
    occluded = scene.occluded

    def counted(origins: NDArray, directions: NDArray) -> NDArray[np.bool_]:
        asked.append(len(origins))
        return occluded(origins, directions)

    monkeypatch.setattr(scene, "occluded", counted)
    found, rays = [], []
    for share in (transport.OUTER, 2.0):  # no tile has more points outermost than it has points
        monkeypatch.setattr(transport, "OUTER", share)
        asked.clear()
        found.append(stacked(light_transport(scene, points, [light], QUALITY["draft"], 3)[0]))
        rays.append(sum(asked))
    assert torch.equal(*found)
    assert rays[0] < 0.8 * rays[1]
