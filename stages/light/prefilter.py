"""An environment as a rasteriser looks it up: its brightest part a lamp, the rest blurred by the GGX lobe of each mip level.

The lobe is that of a viewer straight above (Karis 2013, "Real Shading in Unreal Engine 4"): around a direction, a light at
angle g weighs D(g / 2) cos g. It knows no azimuth, so that a row of the result is a sum of circular convolutions of rows.
Roughness 1 makes it the cosine lobe: the last level is irradiance over pi.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core.brdf import alpha_from_roughness
from stages.light.environment import directions_of_texels

LEVELS = 6
"""Mip levels: level k has roughness k / (LEVELS - 1) and half the size of the one before; level 0 is the light itself."""

LAMP = 8.0
"""Radiance, as a multiple of the light's mean, above which what is over it belongs to the lamp."""


@dataclass(frozen=True)
class Lamp:
    """A distant lamp. towards: (3,) unit, world. power: (3,) radiance integrated over its solid angle. spread: radians, RMS."""

    towards: NDArray[np.float64]
    power: NDArray[np.float64]
    spread: float


def split_lamp(radiance: NDArray[np.float32]) -> tuple[NDArray[np.float32], Lamp]:
    """What is brighter than a multiple of the mean, as one lamp, and the rest; together they are the light.

    Args:
        radiance: (H, 2 H, 3).
    """
    directions, solid = directions_of_texels(*radiance.shape[:2])
    weight = np.broadcast_to(solid[:, None], radiance.shape[:2])[..., None]
    most = LAMP * (radiance * weight).sum() / (3 * weight.sum())
    brightest = radiance.max(-1, keepdims=True)
    rest = radiance * np.minimum(1, most / np.maximum(brightest, most))
    over = (radiance - rest).astype(np.float64) * weight
    power = over.sum((0, 1))
    if not power.any():
        return rest, Lamp(np.array([0.0, 0.0, 1.0]), power, 0.0)
    towards = (directions * over.sum(-1, keepdims=True)).sum((0, 1))
    towards /= np.linalg.norm(towards)
    angle = np.arccos((directions @ towards).clip(-1, 1))
    return rest, Lamp(towards, power, float(np.sqrt((angle**2 * over.sum(-1)).sum() / over.sum())))


def mip_levels(radiance: NDArray[np.float32]) -> list[NDArray[np.float32]]:
    """The light at every roughness. Args: radiance (H, 2 H, 3). Returns: LEVELS arrays, (H / 2^k, 2 H / 2^k, 3)."""
    height = len(radiance)
    rough = [blurred(radiance, k / (LEVELS - 1), height >> k) for k in range(1, LEVELS)]
    return [radiance, *rough]


def blurred(radiance: NDArray[np.float32], roughness: float, height: int) -> NDArray[np.float32]:
    """The light under a lobe, at `height` rows. Args: radiance (H, 2 H, 3). Returns: (height, 2 height, 3)."""
    rows = len(radiance)
    theta_in = (np.arange(rows) + 0.5) / rows * np.pi
    theta_out = (np.arange(height) + 0.5) / height * np.pi
    solid = np.diff(-np.cos(np.arange(rows + 1) / rows * np.pi))
    phi = np.arange(2 * rows) / rows * np.pi
    # output columns lie between input columns: half an output column less half an input one, in radians
    shift = (np.pi / height - np.pi / rows) / 2
    spectrum = np.fft.rfft(radiance.astype(np.float64), axis=1)
    step, result = rows // height, np.empty((height, 2 * height, 3), np.float32)
    for i, theta in enumerate(theta_out):
        cosine = np.cos(theta) * np.cos(theta_in)[:, None] + np.sin(theta) * np.sin(theta_in)[:, None] * np.cos(phi + shift)
        weight = lobe(cosine, alpha_from_roughness(roughness)) * solid[:, None]
        kernel = np.fft.rfft(weight / weight.sum(), axis=1)
        row = np.fft.irfft((kernel[..., None] * spectrum).sum(0), 2 * rows, axis=0)
        result[i] = row[::step]
    return result


def lobe(cosine: NDArray[np.float64], alpha: float) -> NDArray[np.float64]:
    """D at the half vector of two directions with this cosine, times the cosine; not normalised."""
    half2 = (1 + cosine) / 2  # (N·H)^2
    a2 = alpha * alpha
    return np.maximum(cosine, 0) * a2 / np.square(1 - half2 + a2 * half2)


def cosine_harmonics(radiance: NDArray[np.float32]) -> NDArray[np.float64]:
    """Irradiance over pi as nine coefficients of 1, y, z, x, xy, yz, 3z²-1, xz, x²-y² of the normal: (9, 3).

    Source: Ramamoorthi & Hanrahan 2001, "An Efficient Representation for Irradiance Environment Maps".
    """
    directions, solid = directions_of_texels(*radiance.shape[:2])
    x, y, z = np.moveaxis(directions, -1, 0)
    basis = np.stack([0 * x + 1, y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y])
    norm2 = np.array([1, 3, 3, 3, 15, 15, 5 / 4, 15, 15 / 4]) / (4 * np.pi)
    band = np.array([1, *[2 / 3] * 3, *[1 / 4] * 5])  # of the cosine lobe, over pi
    return np.einsum("khw,hwc,h->kc", basis, radiance.astype(np.float64), solid) * (norm2 * band)[:, None]
