"""Blender's light maps: the closures against quadrature, and maps with their bounce against the float64 reference."""

import dataclasses

import numpy as np
import pytest
import torch

from stages.core.albedo import cosines
from stages.core.color import reinhard
from stages.core.shading import LIGHT_MAPS
from stages.light import blender
from stages.light.bounce import blender_light_maps
from stages.light.environment import Environment
from stages.light.reference import _dielectric, _principled, reference_light_maps
from stages.light.scene import Scene
from stages.light.terms import BLENDER
from stages.light.transport import QUALITY, Quality
from tests.light import scenes

CONVERGED = Quality(800, 300)


def test_fresnel_is_the_exact_law_rescaled_between_f0_and_one() -> None:
    for cosine in (1.0, 0.8, 0.5, 0.2, 0.05):
        expected = _dielectric(cosine)
        assert blender.F0 + (1 - blender.F0) * blender.fresnel(cosine) == pytest.approx(expected, abs=1e-12)
        assert blender.mirror_reflectance(np.array(cosine)) == pytest.approx(expected, abs=1e-12)
    assert blender.fresnel(1.0) == pytest.approx(0, abs=1e-12) and blender.fresnel(0.0) == pytest.approx(1)


@pytest.mark.parametrize("column", (30, 55, 80, 95))
def test_open_albedo_is_that_of_quadrature_over_the_hemisphere(column: int) -> None:
    """0.2 %, between N·V 0.1 and 1; polar midpoint quadrature with 1,200 x 600 cells."""
    z = cosines()[column]
    theta, phi = np.meshgrid((np.arange(1200) + 0.5) / 1200 * np.pi / 2, (np.arange(600) + 0.5) / 600 * np.pi)
    wi = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)
    angle = (np.sin(theta) * (np.pi / 2 / 1200) * (2 * np.pi / 600)).ravel()
    n, wo = np.array([0.0, 0, 1]), np.array([np.sqrt(1 - z * z), 0, z])
    found = BLENDER.albedo()[column]
    expected = []
    for roughness in (0.0, 0.5, 1.0):
        diffuse, glossy, fresnel = _principled(n, wo, wi, roughness)
        expected.append(((diffuse + fresnel * glossy) @ angle, glossy @ angle))
    maps, metal = zip(*expected, strict=True)
    np.testing.assert_allclose(found, [*maps, *metal[1:]], rtol=2e-3)


def hilly_light() -> Environment:
    """Coloured and uneven, but smooth enough for the reference's coarse cells."""
    y, x = np.mgrid[:16, :32] + 0.5
    up, around = np.cos(y / 16 * np.pi), x / 32 * 2 * np.pi
    channels = [0.5 + 0.4 * up, 0.5 + 0.3 * np.sin(around), 0.6 + 0.5 * np.cos(around) * np.sin(y / 16 * np.pi)]
    return Environment("hilly", np.stack(channels, -1).astype(np.float32))


@pytest.fixture(scope="module")
def corner() -> Scene:
    return scenes.box_in_corner()


def test_light_maps_agree_with_the_reference_bounce_included(corner: Scene) -> None:
    """Tone-mapped mean absolute error of eight runs averaged: under 1/255 in every map; the bounce carries three times that."""
    points, light = scenes.view_of(corner, 16), hilly_light()
    pixels = np.random.default_rng(0).permutation(len(points.n))[:8]
    direct, bounced = (reference_light_maps(corner, points, light, 2, pixels, bounce) for bounce in (False, True))
    runs = [blender_light_maps(corner, points, [light], CONVERGED, seed)[0] for seed in range(8)]
    found = torch.stack(runs).mean(0)[torch.from_numpy(pixels)]
    toned = [reinhard(torch.as_tensor(maps).double()) for maps in (found, bounced, direct)]
    error, carried = ((toned[k] - toned[1]).abs().mean((0, 2)) for k in (0, 2))
    assert float(error.max()) < 1 / 255, error
    assert float(carried.min()) > 3 / 255, carried


def test_standard_rays_are_enough_for_eight_bits(corner: Scene) -> None:
    points, light = scenes.view_of(corner, 32), scenes.sunny_light(200.0)
    few, many = (blender_light_maps(corner, points, [light], q, 0)[0] for q in (QUALITY["standard"], CONVERGED))
    assert float((reinhard(few) - reinhard(many)).abs().mean()) < 2 / 255


def test_a_white_diffuse_corner_sends_back_no_more_than_comes_in(corner: Scene) -> None:
    lambert = dataclasses.replace(BLENDER, principled=(True, 0.0, 0.0))
    maps = blender_light_maps(corner, scenes.view_of(corner, 32), [scenes.even_light()], CONVERGED, 0, lambert)[0]
    rough = maps[:, LIGHT_MAPS.index((0, 1.0))]
    assert float(rough.max()) < 1.02 and 0.75 < float(rough.mean()) < 0.98


def test_an_open_point_has_no_bounce() -> None:
    ball = scenes.sphere(4)
    points = scenes.view_of(ball, 24)
    maps = blender_light_maps(ball, points, [scenes.even_light(2.0)], QUALITY["standard"], 0)[0]
    cosine = (points.n * points.wo).sum(-1)
    facing = cosine > 0.3
    albedo = np.stack([np.interp(np.sqrt(cosine), np.sqrt(cosines()), column) for column in BLENDER.albedo().T], -1)
    expected = torch.from_numpy(2 * albedo[facing]).float()
    found = maps[torch.from_numpy(facing)][..., 0]
    torch.testing.assert_close(found[:, [1, 2, 4, 5]], expected[:, 1:], rtol=0, atol=5e-3)
    mirrored = 2 * torch.from_numpy(blender.mirror_reflectance(cosine[facing])).float()
    torch.testing.assert_close(found[:, 0], expected[:, 0] + mirrored, rtol=0, atol=5e-3)


def test_two_environments_are_two_alone(corner: Scene) -> None:
    points, lights = scenes.view_of(corner, 16), [scenes.even_light(), hilly_light()]
    both = blender_light_maps(corner, points, lights, CONVERGED, 0)
    for light, found in zip(lights, both, strict=True):
        alone = blender_light_maps(corner, points, [light], CONVERGED, 0)[0]
        assert float((reinhard(found) - reinhard(alone)).abs().mean()) < 0.5 / 255


def test_a_cube_shaded_smooth_has_normals_along_its_diagonals() -> None:
    """However its sides are cut into triangles; what cancels out keeps its face's."""
    import trimesh

    cube = trimesh.creation.box()
    smooth = Scene(cube.vertices, cube.faces, np.zeros((12, 3, 3))).shaded_smooth()
    diagonal = np.sign(cube.vertices) / np.sqrt(3)
    np.testing.assert_allclose(smooth.normals, diagonal[cube.faces], atol=1e-6)
    both_sides = Scene(cube.vertices[:3], np.array([[0, 1, 2], [0, 2, 1]]), np.zeros((2, 3, 3))).shaded_smooth()
    assert np.linalg.norm(both_sides.normals, axis=-1) == pytest.approx(1)


def directions(count: int, up: np.ndarray | None = None) -> np.ndarray:
    """Random unit vectors, (count, 3) float32; on the side of `up` where given."""
    found = np.random.default_rng(0 if up is None else 1).normal(size=(count, 3))
    found /= np.linalg.norm(found, axis=-1, keepdims=True)
    return (found if up is None else found * np.sign((found * up).sum(-1, keepdims=True))).astype(np.float32)


def test_a_lifted_normal_shows_nothing_behind_the_face() -> None:
    ng = directions(2000)
    wo = directions(2000, ng)
    aside = np.random.default_rng(2).normal(size=ng.shape) * np.random.default_rng(3).uniform(0, 1, (2000, 1))
    n = (ng + aside).astype(np.float32)
    n *= np.sign((n * ng).sum(-1, keepdims=True)) / np.linalg.norm(n, axis=-1, keepdims=True)
    found = blender.lifted(n, ng, wo)

    def rise(normal: np.ndarray) -> np.ndarray:
        """Height over the face of what a mirror shows."""
        mirror = 2 * (normal * wo).sum(-1, keepdims=True) * normal - wo
        return (mirror * ng).sum(-1)

    least = np.minimum(0.9 * (wo * ng).sum(-1), blender.LEAST_RISE)
    fine = rise(n) >= least + 1e-5
    assert 0.2 < fine.mean() < 0.8
    np.testing.assert_allclose(found[fine], n[fine], atol=1e-5)  # what is fine stays
    np.testing.assert_allclose(rise(found)[~fine], least[~fine], atol=1e-4)  # the others turn no further than they must
    np.testing.assert_allclose(np.linalg.norm(found, axis=-1), 1, atol=1e-5)
    assert np.abs((np.cross(n, ng) * found).sum(-1)).max() < 1e-5  # within the plane of both
