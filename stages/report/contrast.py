"""How a texture varies, scale by scale, and how far two textures are apart in it.

Luminance is linear (Rec. 709), of a square of 512 texels that tiles. Bands are those of a Laplacian pyramid with the kernel
(1 4 6 4 1) / 16: wavelengths of about 2, 4, 8 … texels. Sources: Burt & Adelson 1983, "The Laplacian Pyramid as a Compact Image
Code"; Portilla & Simoncelli 2000, "A Parametric Texture Model" (marginals of bands).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, stats

KERNEL = np.array([1, 4, 6, 4, 1]) / 16
WAVES = (2, 4, 8, 16, 32, 64)
SIZE = 512
"""Texels along an edge of what is measured."""

TILE = 32
"""Edge of the squares whose finest contrast is compared, texels."""

MOST = 3.0
"""What one feature may count for, at the most."""


class Contrast(NamedTuple):
    """Of one texture. mean: luminance. deviation, skew, kurtosis: (6,) of the bands, the deviation as a share of the mean.
    direction: log2 of the contrast across against along. patchiness: how much the finest band's deviation varies from place to
    place. with_roughness, with_height: correlation of the luminance with them; nan where they are even.
    """

    mean: float
    deviation: NDArray[np.float64]
    skew: NDArray[np.float64]
    kurtosis: NDArray[np.float64]
    direction: float
    patchiness: float
    with_roughness: float
    with_height: float

    @property
    def slope(self) -> float:
        """Contrast an octave, from 2 to 64 texels: log2 of a band's deviation against that of the next finer one."""
        return float(np.polyfit(range(len(WAVES)), np.log2(np.maximum(self.deviation, 1e-9)), 1)[0])

    def features(self) -> NDArray[np.float64]:
        """What the distance looks at: contrast a band in octaves, tails, sign of the detail, direction, patchiness."""
        contrast, tails = np.log2(np.maximum(self.deviation, 1e-4)), np.log2(np.maximum(self.kurtosis[:4], 1) / 3)
        sign = np.clip(self.skew[1:3], -3, 3)
        return np.array([*contrast, *tails, *sign, abs(self.direction), np.log2(max(self.patchiness, 0.02))])


def bands(image: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Laplacian pyramid of an image (H, H) that tiles: one array a wavelength of `WAVES`."""
    found = []
    for _ in WAVES:
        small = _blur(image)[::2, ::2]
        up = np.zeros_like(image)
        up[::2, ::2] = small
        found.append(image - 4 * _blur(up))
        image = small
    return found


def _blur(image: NDArray[np.float64]) -> NDArray[np.float64]:
    return ndimage.convolve1d(ndimage.convolve1d(image, KERNEL, axis=0, mode="wrap"), KERNEL, axis=1, mode="wrap")


def measure(luminance: NDArray, roughness: NDArray | None = None, height: NDArray | None = None) -> Contrast:
    """Args: (512, 512) each."""
    image = luminance.astype(np.float64)
    parts, mean = bands(image), max(float(image.mean()), 1e-4)
    local = np.sqrt(ndimage.uniform_filter(parts[0] ** 2, TILE, mode="wrap")[TILE // 2 :: TILE, TILE // 2 :: TILE])
    across, along = (float(np.square(np.diff(image, axis=axis)).mean()) + 1e-12 for axis in (1, 0))
    return Contrast(
        mean,
        np.array([part.std() for part in parts]) / mean,
        np.array([stats.skew(part.ravel()) for part in parts]),
        np.array([stats.kurtosis(part.ravel(), fisher=False) for part in parts]),
        float(np.log2(across / along)),
        float(local.std() / max(local.mean(), 1e-9)),
        _correlation(image, roughness),
        _correlation(image, height),
    )


def _correlation(image: NDArray[np.float64], other: NDArray | None) -> float:
    if other is None or other.std() < 1e-9 or image.std() < 1e-9:
        return float("nan")
    return float(np.corrcoef(image.ravel(), other.ravel())[0, 1])


def spread(known: dict[str, Contrast]) -> NDArray[np.float64]:
    """Per feature, what two textures of one kind ("rust_01", "rust_02") differ by: what a distance of 1 means."""
    table = {name: contrast.features() for name, contrast in known.items()}
    gaps = [abs(table[a] - table[b]) for a in table for b in table if a < b and kind(a) == kind(b)]
    return np.maximum(1.4826 * np.median(gaps, axis=0), 0.05)


def kind(name: str) -> str:
    """rust_01 -> rust."""
    return name.split("_")[0]


def distance(a: Contrast, b: Contrast, scale: NDArray[np.float64]) -> float:
    """Root mean square over the features, in units of the spread within a kind."""
    return float(np.sqrt(np.mean(np.minimum(abs(a.features() - b.features()) / scale, MOST) ** 2)))
