"""Contrast that is left of a recipe's, in pictures made for it."""

import numpy as np
import pytest
from numpy.random import default_rng
from scipy import ndimage

from stages.report.contrast import WAVES
from stages.report.kept import bands, contrast_kept

ROW, COLUMN = np.mgrid[:128, :128]
DISC = np.hypot(ROW - 60, COLUMN - 64) < 50


def textured(seed: int = 0) -> np.ndarray:
    """A picture with detail of every size about 0.5."""
    noise = default_rng(seed).normal(size=(128, 128))
    return 0.5 + 0.02 * sum(ndimage.gaussian_filter(noise, wave / 3) * wave for wave in WAVES)


def test_bands_are_the_picture() -> None:
    picture = textured()
    parts = bands(picture, DISC)
    assert parts.shape == (len(WAVES), DISC.sum())
    assert np.allclose(parts.sum(0) - (picture - picture[DISC].mean())[DISC], 0, atol=0.5 * picture[DISC].std())
    assert np.allclose(bands(np.full((128, 128), 0.3), DISC), 0, atol=1e-9), "the outline is no contrast"
    outside = np.where(DISC, picture, 9.0)
    assert np.array_equal(bands(outside, DISC), parts), "nor is what lies behind"


def test_half_the_contrast_is_half_in_every_octave() -> None:
    picture = textured()
    half = 0.5 + 0.5 * (picture - 0.5)
    assert contrast_kept([half], [picture], [DISC]) == pytest.approx([0.5] * 6, abs=0.02)
    assert contrast_kept([3 * picture], [picture], [DISC]) == pytest.approx([1.0] * 6), "a share of the mean"


def test_other_detail_makes_up_for_nothing() -> None:
    picture, other = textured(), textured(1)
    assert (abs(contrast_kept([other], [picture], [DISC])) < 0.6).all()
    kept = contrast_kept([0.5 + 0.2 * (picture - 0.5) + (other - 0.5)], [picture], [DISC])
    assert (abs(kept[:3] - 0.2) < 0.1).all()


def test_a_washed_out_octave_is_told_from_the_others() -> None:
    picture = textured()
    kept = contrast_kept([ndimage.gaussian_filter(picture, 2)], [picture], [np.ones_like(DISC)])
    assert kept[0] < 0.1 and kept[5] > 0.9 and (np.diff(kept) > 0).all()


def test_where_a_recipe_has_no_contrast_nothing_is_said() -> None:
    even = np.full((128, 128), 0.4)
    assert np.isnan(contrast_kept([textured()], [even], [DISC])).all()
