"""Transfer curves, and luminance. Inside the program all is linear Rec. 709; a curve is applied where a file or model asks.

Curves work on NumPy arrays and torch tensors alike, element by element, and keep dtype and device.
"""

from typing import TypeVar

import numpy as np
import torch

Array = TypeVar("Array", np.ndarray, torch.Tensor)

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Rec. 709 luminance weights of linear R, G, B."""


def srgb_encode(linear: Array) -> Array:
    """Linear [0, 1] to sRGB [0, 1]; the input is clamped. Source: IEC 61966-2-1."""
    xp = torch if isinstance(linear, torch.Tensor) else np
    c = linear.clip(0.0, 1.0)
    return xp.where(c <= 0.0031308, 12.92 * c, 1.055 * c.clip(0.0031308, 1.0) ** (1 / 2.4) - 0.055)


def srgb_decode(encoded: Array) -> Array:
    """sRGB [0, 1] to linear [0, 1]; the input is clamped. Source: IEC 61966-2-1."""
    xp = torch if isinstance(encoded, torch.Tensor) else np
    c = encoded.clip(0.0, 1.0)
    return xp.where(c <= 0.04045, c / 12.92, ((c.clip(0.04045, 1.0) + 0.055) / 1.055) ** 2.4)


def reinhard(radiance: Array) -> Array:
    """x / (1 + x) of radiance clamped to >= 0: the scale on which errors of light are reported."""
    x = radiance.clip(0.0, None)
    return x / (1.0 + x)


def luminance(rgb: Array) -> Array:
    """Rec. 709 luminance of linear RGB. Args: rgb (..., 3). Returns: (...)."""
    r, g, b = LUMINANCE
    return r * rgb[..., 0] + g * rgb[..., 1] + b * rgb[..., 2]


DARKEST = 1e-4
"""Added to luminance before its logarithm."""


def log_correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Correlation over points of the log luminances of two colours, (P, 3) linear; 0 where either does not vary.

    Of albedo and irradiance it tells how much light is baked in.
    """
    a, b = (np.log(luminance(x.astype(np.float64)) + DARKEST) for x in (one, other))
    if a.std() < 1e-6 or b.std() < 1e-6:
        return 0.0
    return float(np.corrcoef(a, b)[0, 1])
