"""What is measured on a baked material, against the truth of its prompt."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from skimage.color import deltaE_ciede2000, rgb2lab

BIMODAL = (0.15, 0.85)
"""Metallic under the first or over the second counts as decided."""

RESAMPLES = 2000
CONFIDENCE = 0.95


def color_difference(found: NDArray, true: NDArray) -> float:
    """CIEDE2000 between two sRGB colours (3,)."""
    return float(deltaE_ciede2000(rgb2lab(found.clip(0, 1)[None]), rgb2lab(true[None]))[0])


def decided(metallic: NDArray) -> float:
    """Share of texels that are metal or not."""
    return float(((metallic < BIMODAL[0]) | (metallic > BIMODAL[1])).mean())


def nearest(found: NDArray, truths: NDArray) -> int:
    """Which of the materials (N, 5), sRGB albedo, roughness and metallic, lies nearest to one (5,)."""
    return int(np.square(truths - found).sum(1).argmin())


def interval(values: Sequence[float], statistic: Callable = np.mean) -> tuple[float, float, float]:
    """A statistic and its 95 % interval by bootstrap; without one for fewer than three values."""
    x = np.array(values, np.float64)
    if len(x) == 0:
        return float("nan"), float("nan"), float("nan")
    value = float(statistic(x))
    if len(x) < 3 or np.ptp(x) == 0:
        return value, value, value
    found = stats.bootstrap((x,), statistic, n_resamples=RESAMPLES, confidence_level=CONFIDENCE, method="percentile",
                            random_state=np.random.default_rng(0)).confidence_interval  # fmt: skip
    return value, float(found.low), float(found.high)
