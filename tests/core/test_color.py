"""Measures of colour."""

import numpy as np

from stages.core.color import log_correlation


def test_log_correlation_sees_light_that_is_baked_in() -> None:
    generator = np.random.default_rng(0)
    irradiance = np.exp(generator.normal(size=(5000, 1))) * np.ones(3)
    free = 0.2 + 0.5 * generator.random((5000, 1)) * np.ones(3)
    assert abs(log_correlation(free, irradiance)) < 0.05
    assert log_correlation(free * irradiance, irradiance) > 0.8
    assert log_correlation(np.full((10, 3), 0.5), irradiance[:10]) == 0
