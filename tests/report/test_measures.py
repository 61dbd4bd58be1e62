"""The prior report's arithmetic."""

import numpy as np
import pytest

from stages.report import measures


def test_color_difference_is_ciede2000() -> None:
    grey, lighter = np.full(3, 0.5), np.full(3, 0.55)
    assert measures.color_difference(grey, grey) == 0
    assert measures.color_difference(np.array([1.0, 0, 0]), np.array([0, 1.0, 0])) == pytest.approx(86.6, abs=0.1)
    assert 3 < measures.color_difference(grey, lighter) < 6


def test_decided_and_nearest() -> None:
    assert measures.decided(np.array([0.0, 0.1, 0.5, 0.9])) == 0.75
    assert measures.nearest(np.array([0.9, 0.1]), np.array([[0.0, 0], [1, 0], [0, 1]])) == 1


def test_interval_holds_the_value_and_narrows_with_runs() -> None:
    x = np.random.default_rng(0).normal(size=400)
    few, many = measures.interval(x[:20].tolist()), measures.interval(x.tolist())
    assert few[1] < few[0] < few[2] and many[1] < many[0] < many[2]
    assert many[2] - many[1] < few[2] - few[1]
    assert measures.interval([2.0, 2.0, 2.0]) == (2.0, 2.0, 2.0)
    assert np.isnan(measures.interval([])[0])
