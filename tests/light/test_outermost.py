"""Which triangles lie outermost."""

import numpy as np
import pytest
import trimesh

from stages.light.outermost import outermost
from tests.light import scenes

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
    found = outermost(corner.vertices, corner.triangles, NOTHING)
    assert not found[:, 0].any() and found[:, 1].any()
    sheet = scenes.square(2, 0.0, -0.5, 0.5)
    assert not outermost(sheet, np.array([[0, 1, 2], [0, 2, 3]]), NOTHING).any()
