"""The blurred light against plain sums over all texels, and its parts against the whole."""

import numpy as np
import pytest

from stages.light.environment import directions_of_texels
from stages.light.lights import preview_light
from stages.light.prefilter import LEVELS, blurred, cosine_harmonics, lobe, mip_levels, split_lamp


def small_light() -> np.ndarray:
    rng = np.random.default_rng(0)
    return (rng.uniform(0, 1, (32, 64, 3)) ** 6).astype("f4")


@pytest.mark.parametrize(("roughness", "height"), [(0.4, 32), (0.6, 16), (1.0, 4)])
def test_a_blurred_row_is_the_sum_over_all_texels(roughness: float, height: int) -> None:
    light = small_light()
    towards, solid = directions_of_texels(32, 64)
    wanted_at, _ = directions_of_texels(height, 2 * height)
    weight = lobe(wanted_at.reshape(-1, 3) @ towards.reshape(-1, 3).T, roughness**2)
    weight *= np.repeat(solid, 64)
    wanted = weight @ light.reshape(-1, 3) / weight.sum(1, keepdims=True)
    np.testing.assert_allclose(blurred(light, roughness, height).reshape(-1, 3), wanted, rtol=1e-4)


def test_an_even_light_stays_even_at_every_level() -> None:
    even = np.full((64, 128, 3), 0.7, "f4")
    levels = mip_levels(even)
    assert [len(level) for level in levels] == [64 >> k for k in range(LEVELS)]
    for level in levels:
        np.testing.assert_allclose(level, 0.7, rtol=1e-5)


def test_lamp_and_rest_are_the_light() -> None:
    light = preview_light().radiance
    rest, lamp = split_lamp(light)
    directions, solid = directions_of_texels(*light.shape[:2])
    total = np.einsum("hwc,h->c", light.astype(float), solid)
    np.testing.assert_allclose(np.einsum("hwc,h->c", rest.astype(float), solid) + lamp.power, total, rtol=1e-5)
    brightest = directions[np.unravel_index(light.sum(-1).argmax(), light.shape[:2])]
    assert np.degrees(np.arccos(brightest @ lamp.towards)) < 2
    assert np.radians(0.5) < lamp.spread < np.radians(3)
    assert rest.max() < 20 < light.max()


def test_a_light_without_a_lamp_is_left_alone() -> None:
    even = np.full((16, 32, 3), 2.0, "f4")
    rest, lamp = split_lamp(even)
    np.testing.assert_array_equal(rest, even)
    assert not lamp.power.any()


def test_harmonics_are_the_irradiance_of_a_soft_light() -> None:
    """Of a light that is quadratic in direction nine coefficients are exact; the last mip level is the same thing."""
    directions, _ = directions_of_texels(64, 128)
    x, y, z = np.moveaxis(directions, -1, 0)
    light = np.stack([1 + z, 1 + 0.5 * x * y + z * z, 2 + x - y], -1).astype("f4")
    at, _ = directions_of_texels(8, 16)
    nx, ny, nz = np.moveaxis(at, -1, 0)
    basis = np.stack([0 * nx + 1, ny, nz, nx, nx * ny, ny * nz, 3 * nz * nz - 1, nx * nz, nx * nx - ny * ny], -1)
    np.testing.assert_allclose(basis @ cosine_harmonics(light), blurred(light, 1.0, 8), rtol=2e-3)
