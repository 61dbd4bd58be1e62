"""Relief as it is shown: true where it is small, bounded where it would fight the mesh."""

import numpy as np
import pytest

from stages.material.relief import HIGHEST, STEEPEST, bounded, gentle


@pytest.mark.parametrize("relief", [0.0, 0.5, 1.0, 2.0])
def test_heights_are_multiplied_and_bounded(relief: float) -> None:
    height = np.linspace(-0.5, 0.5, 20_001, dtype=np.float32)
    shown = bounded(height, relief)
    assert abs(shown).max() <= HIGHEST and (np.diff(shown) >= 0).all()
    small = abs(relief * height) < HIGHEST / 10
    np.testing.assert_allclose(shown[small], relief * height[small], rtol=4e-3, atol=1e-9)


def test_gradients_keep_their_direction_and_small_ones_themselves() -> None:
    gradient = np.random.default_rng(0).normal(0, 2, (500, 3))
    shown = gentle(gradient)
    length, was = np.linalg.norm(shown, axis=1), np.linalg.norm(gradient, axis=1)
    assert length.max() <= STEEPEST + 1e-12 and (was > STEEPEST).any()
    np.testing.assert_array_equal(shown[was <= STEEPEST], gradient[was <= STEEPEST])
    np.testing.assert_allclose((shown * gradient).sum(1), length * was)
    np.testing.assert_array_equal(gentle(np.zeros((2, 3))), np.zeros((2, 3)))
