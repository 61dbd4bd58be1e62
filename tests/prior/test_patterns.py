import numpy as np
import pytest
from numpy.random import default_rng

from stages.prior.patterns import DARK_BELOW, LATTICE, LEVEL, PATTERNS, average, noise


@pytest.mark.parametrize("name", PATTERNS)
def test_patterns_are_bounded_and_vary(name: str) -> None:
    value = PATTERNS[name](default_rng(0).uniform(0, 32, (5000, 3)))
    assert value.shape == (5000,) and np.isfinite(value).all()
    assert np.abs(value).max() < 2.1 and value.std() > 0.05


def test_noise_is_continuous_and_meets_its_lattice() -> None:
    grid = np.array([[3.0, 4.0, 5.0], [31.0, 0.0, 31.0]])
    at = [3 * 1024 + 4 * 32 + 5, 31 * 1024 + 31]
    assert np.allclose(noise(grid), LATTICE[at])
    p = default_rng(1).uniform(-40, 40, (1000, 3))
    assert np.abs(noise(p + 1e-4) - noise(p)).max() < 1e-2
    assert np.allclose(noise(p), noise(p + 32), atol=1e-5)


@pytest.mark.parametrize("name", PATTERNS)
def test_average_is_that_of_other_points_too(name: str) -> None:
    assert average(name) == pytest.approx(PATTERNS[name](default_rng(1).uniform(0, 32, (20000, 3))).mean(), abs=0.03)


def test_lists_name_patterns() -> None:
    assert {*DARK_BELOW, *LEVEL} <= set(PATTERNS)
