"""Slopes within a texel that its normal does not tell go into roughness."""

import numpy as np
import pytest

from stages.core.brdf import roughened, rougher
from stages.material.relief import STEEPEST, bend
from stages.report.flicker import hidden


def of_texel(height: np.ndarray, texel: float) -> float:
    """`bend` of the middle one of nine texels."""
    above, here, below = height
    return float(bend(above, here, below, (0, 1, 2), 1 / texel, 1 / texel))


@pytest.mark.parametrize("turn", [0.0, 0.3, np.pi / 4])
def test_it_is_the_variance_of_slopes_over_the_texel_whichever_way_a_ridge_runs(turn: float) -> None:
    """A parabola's slope is spread evenly: over a texel of edge t, curvature k along a direction gives k² t² / 24 an axis."""
    texel, k = 0.01, 3.0
    along = np.cos(turn), np.sin(turn)

    def slope_along(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return k * (x * along[0] + y * along[1])

    inside = (np.arange(400) + 0.5) / 400 - 0.5
    s = slope_along(*np.meshgrid(inside * texel, inside * texel))
    exact = (s.var() * along[0] ** 2 + s.var() * along[1] ** 2) / 2
    x, y = np.meshgrid([-texel, 0, texel], [-texel, 0, texel])
    found = of_texel(k * (x * along[0] + y * along[1]) ** 2 / 2, texel)
    assert found == pytest.approx(exact, rel=1e-4)
    assert hidden(k * (x * along[0] + y * along[1]) ** 2 / 2 / texel)[0, 0] == pytest.approx(found, rel=1e-9)


def test_an_even_slope_hides_nothing_and_a_step_no_more_than_is_shown() -> None:
    x = np.array([[-1.0, 0, 1]] * 3)
    assert of_texel(0.7 * x, 1.0) == pytest.approx(0, abs=1e-15)
    assert of_texel(np.where(x > 0, 1e3, 0.0), 1.0) == pytest.approx(STEEPEST**2 / 24)


def test_one_texel_is_made_rougher_as_all_are() -> None:
    assert roughened(0.3, 0.02) == pytest.approx(float(rougher(np.float64(0.3), np.float64(0.02))), rel=1e-9)
    assert roughened(0.9, 5.0) == 1
