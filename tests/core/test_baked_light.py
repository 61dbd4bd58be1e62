"""The measure of baked-in light."""

import numpy as np

from stages.core.baked_light import light_correlation


def test_light_correlation_sees_what_is_baked() -> None:
    generator = np.random.default_rng(0)
    irradiance = np.exp(generator.normal(size=(5000, 1))) * np.ones(3)
    free = 0.2 + 0.5 * generator.random((5000, 1)) * np.ones(3)
    assert abs(light_correlation(free, irradiance)) < 0.05
    assert light_correlation(free * irradiance, irradiance) > 0.8
    assert light_correlation(np.full((10, 3), 0.5), irradiance[:10]) == 0
