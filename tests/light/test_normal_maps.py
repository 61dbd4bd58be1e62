"""Normal maps at hits: look-up, tangent frames, and the side of the viewer."""

import numpy as np
from numpy.typing import NDArray

from stages.core.albedo import MIN_COSINE
from stages.core.frames import look_at
from stages.light.gbuffer import trace_view
from stages.light.lookup import CLAMP, MIRROR, REPEAT
from stages.light.normal_maps import NormalMap, NormalMaps
from stages.light.scene import Scene

LEANING = np.array([0.48, 0.6, 0.64])


def constant(vector: NDArray = LEANING) -> NormalMap:
    return NormalMap(np.broadcast_to(vector, (2, 2, 3)).astype("f4"))


def floor(one: NormalMap, tangent: NDArray, sign: float = 1.0, face_up: bool = True) -> Scene:
    """The square |x|, |y| <= 1 at z = 0 with one normal map, u along `tangent`."""
    vertices = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], "f4")
    triangles = np.array([[0, 1, 2], [0, 2, 3]] if face_up else [[2, 1, 0], [3, 2, 0]], "i4")
    normals = np.zeros((2, 3, 3), "f4") + np.array([0, 0, 1 if face_up else -1], "f4")
    frames = np.broadcast_to([*tangent, sign], (2, 3, 4)).astype("f4")
    uv = (vertices[triangles][..., :2] + 1) / 2
    return Scene(vertices, triangles, normals, NormalMaps([one], np.zeros(2, "i4"), uv, frames))


def from_above(distance: float = 3.0) -> NDArray:
    return look_at(np.array([0.0, 0, distance]), np.zeros(3), np.array([0.0, 1, 0]))


def test_look_up_between_texels_and_beyond_the_edge() -> None:
    angles = np.array([[0.0, 0.2], [0.4, 0.6]])
    vectors = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], -1).astype("f4")
    uv = np.array([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [1.25, 0.25], [-0.25, 0.25]])
    for mode, beyond in ((REPEAT, (0.0, 0.2)), (CLAMP, (0.2, 0.0)), (MIRROR, (0.2, 0.0))):
        found = NormalMap(vectors, wrap=(mode, mode)).at(uv)
        np.testing.assert_allclose(np.arcsin(found[:, 0]), [0, 0.2, 0.4, *beyond], atol=1e-6)
    middle = NormalMap(vectors).at(np.array([[0.5, 0.25]]))[0]
    np.testing.assert_allclose(np.arctan2(middle[0], middle[2]), 0.1, atol=1e-6)


def test_scale_and_transform_are_gltfs() -> None:
    np.testing.assert_allclose(
        NormalMap(np.array([[LEANING]], "f4"), scale=2.0).at(np.zeros((1, 2)))[0],
        np.array([0.96, 1.2, 0.64]) / np.linalg.norm([0.96, 1.2, 0.64]), atol=1e-6)  # fmt: skip
    vectors = np.zeros((1, 4, 3), "f4")
    vectors[0, :, 0], vectors[0, :, 2] = np.sin([0, 0.1, 0.2, 0.3]), np.cos([0, 0.1, 0.2, 0.3])
    moved = NormalMap(vectors, matrix=np.array([[0.5, 0, 0.25], [0, 1.0, 0]]))  # u -> u / 2 + 1/4
    np.testing.assert_allclose(np.arcsin(moved.at(np.array([[0.25, 0.5]]))[0, 0]), 0.1, atol=1e-6)


def test_a_leaning_map_turns_the_normals_of_a_view_along_its_frame() -> None:
    for tangent, sign, wanted in (
        ((1, 0, 0), 1, (0.48, 0.6, 0.64)),
        ((0, 1, 0), 1, (-0.6, 0.48, 0.64)),  # turned by 90 degrees
        ((1, 0, 0), -1, (0.48, -0.6, 0.64)),  # mirrored
    ):
        points = trace_view(floor(constant(), np.array(tangent), sign), from_above(), 0.3, 8, 8)
        np.testing.assert_allclose(points.n, np.broadcast_to(wanted, points.n.shape), atol=1e-5)
        np.testing.assert_allclose(points.ng, np.broadcast_to([0, 0, 1], points.n.shape), atol=1e-6)


def test_from_behind_the_whole_frame_is_turned_round() -> None:
    """As a double-sided material is drawn: minus the normal of the front."""
    below = look_at(np.array([0.0, 0, -3]), np.zeros(3), np.array([0.0, 1, 0]))
    points = trace_view(floor(constant(), np.array([1, 0, 0])), below, 0.3, 8, 8)
    np.testing.assert_allclose(points.n, np.broadcast_to(-LEANING, points.n.shape), atol=1e-5)


def test_normals_stay_on_the_viewers_side_at_grazing_angles() -> None:
    """A map that leans by 80 degrees, seen from the side that it leans away from."""
    lean = np.array([np.sin(1.4), 0, np.cos(1.4)])
    low = look_at(np.array([-3.0, 0, 0.3]), np.zeros(3), np.array([0.0, 0, 1]))
    points = trace_view(floor(constant(lean), np.array([1, 0, 0])), low, 0.4, 16, 16)
    assert len(points.n) > 10
    np.testing.assert_allclose((points.n * points.wo).sum(1), MIN_COSINE, atol=1e-4)


def test_without_a_map_nothing_changes_and_trees_are_shared() -> None:
    scene = floor(constant(), np.array([1, 0, 0]))
    plain = scene.bumped(None)
    np.testing.assert_array_equal(trace_view(plain, from_above(), 0.3, 4, 4).n, np.broadcast_to([0, 0, 1], (16, 3)))
    assert plain._closest is scene._closest
