"""Every substance: finite and in range, tiling, the same on average at any footprint, with detail down to the texel."""

from dataclasses import replace

import numpy as np
import pytest

from stages.material.evaluate import means
from stages.material.substances import LOOKS, METRES
from tests.material.places import luminance, square

DISTINCT = list({getattr(look, "func", look): name for name, look in reversed(LOOKS.items())}.values())
"""One name for each function that makes looks."""

PLAIN = frozenset({"even"})
"""Looks without structure."""


@pytest.mark.parametrize("name", DISTINCT)
def test_a_look_is_a_material(name: str) -> None:
    at = square(METRES[name], 64)
    found = LOOKS[name](at)
    for channel in (*found.color, found.roughness, found.metallic, found.height, found.dye):
        assert np.isfinite(channel).all()
    assert found.color.min() > -0.02 and found.color.max() < 1.6  # clamped to [0, 1] where it is used
    albedo = np.clip(found.color, 0, 1).mean(1)
    metal = np.mean(found.metallic) > 0.5
    assert 0.008 < luminance(albedo) < (0.999 if metal else 0.93)
    for channel in (found.roughness, found.metallic, found.dye):
        assert np.min(channel) > -0.3 and np.max(channel) < 1.3 and 0 <= np.mean(channel) <= 1
    assert abs(np.asarray(found.height)).max() < 0.06  # metres


@pytest.mark.parametrize("name", DISTINCT)
def test_a_look_takes_any_seed(name: str) -> None:
    """Recipes make seeds of seeds: they grow beyond 64 bits."""
    found = LOOKS[name](replace(square(METRES[name], 8), seed=2**31 * 1_000_003**3))
    assert np.isfinite(found.color).all()


@pytest.mark.parametrize("name", DISTINCT)
def test_a_look_tiles(name: str) -> None:
    size = METRES[name]
    here, there = LOOKS[name](square(size, 40)), LOOKS[name](square(size, 40, shift=size))
    assert np.quantile(abs(here.color - there.color).max(0), 0.95) < 0.03


@pytest.mark.parametrize("name", DISTINCT)
def test_a_look_is_the_same_on_average_at_any_footprint(name: str) -> None:
    """Texels of a 4096², a 512² and a 128² map of the same square."""
    size = METRES[name]
    fine, middle, coarse = (
        np.clip(LOOKS[name](square(size, 128, size / texels)).color, 0, 1).mean(1) for texels in (4096, 512, 128)
    )
    for other in (middle, coarse):
        assert abs(np.log(luminance(other) / luminance(fine))) < 0.12


@pytest.mark.parametrize("name", [name for name in DISTINCT if name not in PLAIN])
def test_contrast_does_not_fall_towards_the_texel(name: str) -> None:
    """Deviation of the finest octaves against the wide ones, of a map as it is baked."""
    size = 128
    color = np.clip(LOOKS[name](square(METRES[name] / 4, 2 * size, period=False)).color, 0, 1)
    lum = luminance(color).reshape(size, 2, size, 2).mean((1, 3))
    bands = []
    for _ in range(4):
        half = len(lum) // 2
        small = lum.reshape(half, 2, half, 2).mean((1, 3))
        bands.append(np.std(lum - np.kron(small, np.ones((2, 2)))))
        lum = small
    slope = np.polyfit(range(4), np.log2(np.maximum(bands, 1e-7)), 1)[0]
    assert slope < 0.45 and bands[0] / luminance(color).mean() > 0.003


def test_means_are_those_of_the_dyed_share() -> None:
    from stages.material.look import from_oklab

    brick = from_oklab(means("brick").lab[:, None])[:, 0]
    assert brick[0] > 2 * brick[2]  # the clay's, without the grey mortar
