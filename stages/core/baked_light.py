"""Light that passes for albedo: how much the one follows the other over a surface."""

import numpy as np
from numpy.typing import NDArray

from stages.core.color import luminance

DARKEST = 1e-4
"""Added to albedo and irradiance before the logarithm."""


def light_correlation(albedo: NDArray, irradiance: NDArray) -> float:
    """Correlation over points of log albedo luminance with log irradiance; 0 where either does not vary. (P, 3) linear."""
    a, e = (np.log(luminance(x.astype(np.float64)) + DARKEST) for x in (albedo, irradiance))
    if a.std() < 1e-6 or e.std() < 1e-6:
        return 0.0
    return float(np.corrcoef(a, e)[0, 1])
