"""Openness by rays and by painting in float64, against each other and against closed forms."""

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.light.openness import PATTERNS, Lookouts, disc_directions, openness, reference_openness
from stages.light.scene import Scene


def scene_of(vertices: NDArray, triangles: NDArray) -> Scene:
    """With flat normals."""
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return Scene(vertices, triangles, np.repeat(normal[:, None], 3, 1))


def quad(centre: tuple[float, ...], u: tuple[float, ...], v: tuple[float, ...]) -> NDArray:
    """(2, 3, 3) a parallelogram of half-edges u and v, facing u x v."""
    c, u, v = np.array(centre), np.array(u), np.array(v)  # type: ignore[assignment]
    a, b, d, e = c - u - v, c + u - v, c + u + v, c - u + v  # type: ignore[operator]
    return np.array([[a, b, d], [a, d, e]])


def soup(*pieces: NDArray) -> Scene:
    corners = np.concatenate(pieces)
    return scene_of(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


def both(scene: Scene, triangle: int, point: tuple[float, float, float], side: float = 1.0) -> tuple[float, float]:
    """Openness of one point by rays, the mean of all patterns, and in float64."""
    a, b, c = scene.vertices[scene.triangles[triangle]].astype(float)
    u, v = np.linalg.lstsq(np.stack([b - a, c - a], 1), np.array(point) - a, rcond=None)[0]
    lookouts = Lookouts.of(scene, np.full(PATTERNS, triangle), np.tile([1 - u - v, u, v], (PATTERNS, 1)), side)
    by_rays = openness(scene, lookouts, np.arange(PATTERNS), 64).mean()
    return float(by_rays), reference_openness(scene, Lookouts(lookouts.origin[:1], lookouts.frame[:1]), 512)[0]


FLOOR = quad((0, 0, 0), (0.5, 0, 0), (0, 0.5, 0))


@pytest.mark.parametrize("height", [0.02, 0.1, 0.4])
def test_a_disc_overhead_hides_its_form_factor(height: float) -> None:
    """a^2 / (a^2 + h^2) of a hemisphere is hidden by a disc of radius a at height h."""
    angle = np.linspace(0, 2 * np.pi, 257)
    rim = np.stack([0.1 * np.cos(angle), 0.1 * np.sin(angle), np.full(257, height)], -1)
    disc = np.stack([np.tile([0, 0, height], (256, 1)), rim[:-1], rim[1:]], 1)
    found, reference = both(soup(FLOOR, disc), 0, (1e-4, -2e-4, 0))
    expected = height**2 / (0.1**2 + height**2)
    assert reference == pytest.approx(expected, abs=2e-3)
    assert found == pytest.approx(expected, abs=6e-3)


@pytest.mark.parametrize("distance", [1e-3, 0.03, 0.2])
def test_a_long_wall_hides_what_two_dimensions_say(distance: float) -> None:
    """A wall of height h at distance d: the light that is left is (1 + d / sqrt(d^2 + h^2)) / 2."""
    wall = quad((-distance, 0, 0.1), (0, 40, 0), (0, 0, 0.1))
    found, reference = both(soup(FLOOR, wall), 0, (0, -0.001, 0))
    expected = 0.5 + 0.5 * distance / np.hypot(distance, 0.2)
    assert reference == pytest.approx(expected, abs=2e-3)
    assert found == pytest.approx(expected, abs=6e-3)


@pytest.mark.parametrize("thickness", [0.0, 1e-4, 1e-2])
def test_a_thin_plate_sees_all_from_both_of_its_sides(thickness: float) -> None:
    top, bottom = quad((0, 0, thickness), (0.5, 0, 0), (0, 0.5, 0)), quad((0, 0, 0), (0, 0.5, 0), (0.5, 0, 0))
    scene = soup(top, bottom)
    for triangle, height in ((0, thickness), (2, 0.0)):
        assert both(scene, triangle, (0.05, 0.02, height)) == (1.0, 1.0)


def test_between_two_plates_there_is_no_light() -> None:
    scene = soup(FLOOR, quad((0, 0, 1e-3), (0, 0.5, 0), (0.5, 0, 0)))
    assert max(both(scene, 0, (0.05, 0.02, 0))) < 2e-3
    assert both(scene, 0, (0.05, 0.02, 0), side=-1.0) == (1.0, 1.0)


def test_a_bolt_in_its_hole_is_dark() -> None:
    """Two prisms of eight sides with smooth normals, a hair apart: the smooth surface of the inner lies outside the outer."""

    def prism(radius: float) -> tuple[NDArray, NDArray, NDArray]:
        angle = np.arange(8) * np.pi / 4
        ring = np.stack([np.cos(angle), np.sin(angle)], -1)
        vertices = np.concatenate([np.c_[radius * ring, np.full(8, z)] for z in (-0.5, 0.5)])
        i, j = np.arange(8), (np.arange(8) + 1) % 8
        triangles = np.concatenate([np.stack([i, j, j + 8], -1), np.stack([i, j + 8, i + 8], -1)])
        return vertices, triangles, np.r_[np.c_[ring, np.zeros(8)], np.c_[ring, np.zeros(8)]][triangles]

    (inner, t, n), (outer, _, _) = prism(0.2), prism(0.2005)
    scene = Scene(np.concatenate([inner, outer]), np.concatenate([t, t + 16]), np.concatenate([n, n]))
    smooth = scene.ray_origin(np.array([0]), np.full((1, 3), 1 / 3), np.ones(1))[0]
    assert np.hypot(*smooth[:2]) > 0.2005  # outside of the flat walls, whose middle is 0.185 from the axis
    lookouts = Lookouts.of(scene, np.arange(16), np.full((16, 3), 1 / 3))
    assert openness(scene, lookouts, np.zeros(16, int), 256).max() < 0.02


def test_patterns_complement_one_another() -> None:
    """The mean over all patterns errs less than a sixth of what one does, where chance would leave a quarter."""
    rng = np.random.default_rng(0)
    normal = rng.normal(size=(200, 3)) * (1, 1, 0.5)
    directions = np.stack([disc_directions(64, k) for k in range(PATTERNS)])  # (K, R, 3)
    below = np.einsum("krd,nd->nkr", directions, normal / np.linalg.norm(normal, axis=1, keepdims=True)) < 0
    share = below.mean(2)  # of half-spaces: a half-disc less half an ellipse
    exact = 0.5 - 0.5 * normal[:, 2] / np.linalg.norm(normal, axis=1)
    one = np.sqrt(((share - exact[:, None]) ** 2).mean())
    assert np.sqrt(((share.mean(1) - exact) ** 2).mean()) < one / 6
    assert one < 0.02


def test_rays_and_float64_agree_in_a_crowd() -> None:
    rng = np.random.default_rng(3)
    pieces = [quad(tuple(rng.uniform(-0.4, 0.4, 3)), *map(tuple, rng.normal(0, 0.08, (2, 3)))) for _ in range(60)]
    scene = soup(*pieces)
    triangle = rng.integers(0, 120, 100)
    lookouts = Lookouts.of(scene, triangle, np.full((100, 3), 1 / 3))
    reference = reference_openness(scene, lookouts, 512)
    assert reference.std() > 0.1
    np.testing.assert_allclose(openness(scene, lookouts, np.zeros(100, int), 4096), reference, atol=0.01)
