"""Clusters of a light's bright spots: all of the light, and small where it is bright."""

import numpy as np
import pytest

from stages.core.color import luminance
from stages.light import lamps
from stages.light.light_set import CHANNELS, FINE


def test_clusters_hold_all_of_the_excess_and_are_small_where_it_is_bright() -> None:
    peaks = np.zeros((2, FINE, FINE, 3), np.float32)
    peaks[0, 100, 200] = (9, 5, 1)
    peaks[1, :96, :96] = np.random.default_rng(0).random((96, 96, 3))
    found = lamps.cluster(peaks, luminance(peaks).mean((1, 2)), CHANNELS)
    total = peaks.sum((1, 2)) * 4 * np.pi / FINE**2
    assert found.flux.sum(0)[:6] == pytest.approx(total.ravel(), rel=1e-5)
    assert np.linalg.norm(found.direction, axis=0) == pytest.approx(1, abs=1e-6)
    alone = found.flux[:, 0] > 0
    assert alone.sum() == 1 and found.spread[alone] == pytest.approx(0, abs=1e-6)
    share = luminance(found.flux[~alone, 3:6]) / luminance(total[1])
    finest = 4 * np.pi / lamps.FINEST**2  # a patch of that many steradians spreads by less than that
    assert ((share * found.spread[~alone] <= lamps.BLUR) | (found.spread[~alone] < finest)).all()


def test_no_light_has_no_lamps() -> None:
    assert lamps.cluster(np.zeros((1, FINE, FINE, 3)), np.zeros(1), CHANNELS).flux.shape == (0, CHANNELS)
