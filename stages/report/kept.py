"""How much of a recipe's contrast is left once something was learnt on top, octave by octave.

Both are seen in the same pictures of the object. Bands are differences of Gaussians that know the object's outline, with
wavelengths of about 2, 4, 8 … pixels. What counts as left is what a band still has in common with the recipe's own, so that
noise which was learnt makes up for nothing.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stages.report.contrast import WAVES

SIGMAS = (0, *(wave / 2 for wave in WAVES))
"""Of the Gaussians, pixels; a band lies between two of them."""

LEAST = 0.005
"""Deviation of a band, as a share of the mean, under which a recipe has nothing to keep there."""


def bands(picture: NDArray, mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """The bands of `WAVES` at the object's pixels, (6, P). Args: picture, mask: (H, W)."""
    inside = mask.astype(np.float64)
    shown = np.where(mask, picture, 0.0)
    smooth = [shown[mask]]
    for sigma in SIGMAS[1:]:
        weight = ndimage.gaussian_filter(inside, sigma)[mask]
        smooth.append(ndimage.gaussian_filter(shown, sigma)[mask] / weight)
    return -np.diff(smooth, axis=0)


def contrast_kept(
    found: Sequence[NDArray], recipe: Sequence[NDArray], masks: Sequence[NDArray[np.bool_]]
) -> NDArray[np.float64]:
    """Share of the recipe's contrast that is left in each band of `WAVES`, (6,); nan where the recipe has none.

    Args: found, recipe: linear luminance of the same pictures, (H, W) each. masks: where the object is.
    """
    mine, own = (
        np.concatenate([bands(picture, mask) for picture, mask in zip(of, masks, strict=True)], 1) for of in (found, recipe)
    )
    level, was = (
        float(np.concatenate([picture[mask] for picture, mask in zip(of, masks, strict=True)]).mean()) for of in (found, recipe)
    )
    power = np.square(own).mean(1)
    left = (mine * own).mean(1) / np.maximum(power, 1e-20) * (was / max(level, 1e-6))
    return np.where(np.sqrt(power) > LEAST * was, left, np.nan)
