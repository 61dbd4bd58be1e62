"""Transfer curves, luminance, primaries. Inside the program all is linear Rec. 709; what a file or model has or wants otherwise
is converted where it is read or written.

Curves work on NumPy arrays and torch tensors alike, element by element, and keep dtype and device.
"""

import importlib
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:  # takes two seconds, which who has no tensors need not spend
    import torch

Array = TypeVar("Array", np.ndarray, "torch.Tensor")

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Rec. 709 luminance weights of linear R, G, B."""


def _library_of(values: Any) -> Any:
    """numpy or torch."""
    return np if isinstance(values, np.ndarray | np.generic) else importlib.import_module("torch")


def srgb_encode(linear: Array) -> Array:
    """Linear [0, 1] to sRGB [0, 1]; the input is clamped. Source: IEC 61966-2-1."""
    xp = _library_of(linear)
    c = linear.clip(0.0, 1.0)
    return xp.where(c <= 0.0031308, 12.92 * c, 1.055 * c.clip(0.0031308, 1.0) ** (1 / 2.4) - 0.055)


def srgb_decode(encoded: Array) -> Array:
    """sRGB [0, 1] to linear [0, 1]; the input is clamped. Source: IEC 61966-2-1."""
    xp = _library_of(encoded)
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


TO_LMS = np.array([[0.4122214708, 0.5363325363, 0.0514459929], [0.2119034982, 0.6806995451, 0.1073969566],
                   [0.0883024619, 0.2817188376, 0.6299787005]])  # fmt: skip
TO_LAB = np.array([[0.2104542553, 0.7936177850, -0.0040720468], [1.9779984951, -2.4285922050, 0.4505937099],
                   [0.0259040371, 0.7827717662, -0.8086757660]])  # fmt: skip
FROM_LMS, FROM_LAB = np.linalg.inv(TO_LMS), np.linalg.inv(TO_LAB)


def to_oklab(linear: NDArray) -> NDArray:
    """Linear Rec. 709 to OKLab. Args: (3, P). Returns: (3, P). Source: Ottosson 2020, "A perceptual color space"."""
    return TO_LAB @ np.cbrt(TO_LMS @ linear)


def from_oklab(lab: NDArray) -> NDArray:
    """OKLab to linear Rec. 709, which may lie outside of 0 … 1. Args: (3, P). Returns: (3, P)."""
    return FROM_LMS @ (FROM_LAB @ lab) ** 3


REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
"""CIE 1931 x and y of red, green, blue and white, as files give them; the white is D65."""

_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


def rgb_to_xyz(chromaticities: ArrayLike) -> NDArray[np.float64]:
    """The matrix (3, 3) from linear RGB to CIE XYZ, white at Y = 1. Source: SMPTE RP 177 (1993).

    Args:
        chromaticities: x and y of red, green, blue and white.
    Raises: ValueError where these span no colours.
    """
    x, y = np.asarray(chromaticities, np.float64).reshape(4, 2).T
    if not np.isfinite([x, y]).all() or (y == 0).any():
        raise ValueError("they are no colours")
    xyz = np.stack([x / y, np.ones(4), (1 - x - y) / y])
    if abs(np.linalg.det(xyz[:, :3])) < 1e-6:
        raise ValueError("they lie on one line")
    return xyz[:, :3] * np.linalg.solve(xyz[:, :3], xyz[:, 3])


def to_rec709(chromaticities: ArrayLike) -> NDArray[np.float64]:
    """The matrix (3, 3) from linear RGB of other primaries to linear Rec. 709; what is neutral stays so.

    Source: von Kries in the Bradford cone space (Lam 1985).
    Raises: ValueError as `rgb_to_xyz`.
    """
    source, target = rgb_to_xyz(chromaticities), rgb_to_xyz(REC709)
    cones = _BRADFORD @ np.stack([source.sum(1), target.sum(1)], 1)
    adapt = np.linalg.inv(_BRADFORD) @ np.diag(cones[:, 1] / cones[:, 0]) @ _BRADFORD
    return np.linalg.inv(target) @ adapt @ source


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
