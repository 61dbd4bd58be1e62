"""What an edit does to a material, texel by texel.

A list of edits is evaluated in one go from the first masters, in floating point and without bounds; only the end is brought
back into [0, 1]. So ten edits add up to what one would give, and an edit that goes too far can be taken back by the next.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stages.core.color import from_oklab, srgb_decode, to_oklab
from stages.core.parallel import in_parallel
from stages.edit.options import EditOptions

BAND = 1 << 16
"""Texels that one task changes."""

HALVINGS = 20
"""Steps by which the most chroma is found that a colour can have."""

OUTSIDE = 1e-6
"""What a value may lie outside of [0, 1] without being told: rounding."""

MAPS = {"albedo": slice(0, 3), "roughness": slice(3, 4), "metallic": slice(4, 5)}
"""Columns of a material."""


def changed(
    material: NDArray[np.float32], edits: Sequence[EditOptions], where: Sequence[NDArray[np.bool_]]
) -> tuple[NDArray[np.float32], dict[str, NDArray[np.bool_]]]:
    """A material after some edits.

    Args:
        material: (N, 5) albedo, roughness, metallic. where: (N,) of each edit, the texels that it changes.
    Returns:
        (N, 5); of each map, (N,) whether it was brought back into [0, 1].
    """
    made = material.copy()
    clamped = {name: np.zeros(len(material), bool) for name in MAPS}

    def change(start: int) -> None:
        rows = slice(start, start + BAND)
        values, touched = material[rows].T.astype(np.float64), np.zeros(len(material[rows]), bool)
        for edit, mask in zip(edits, where, strict=True):
            values[:, mask[rows]] = edited(values[:, mask[rows]], edit)
            touched |= mask[rows]
        bounded, outside = into_bounds(values[:, touched])
        made[rows][touched] = bounded.T
        for name, flags in outside.items():
            clamped[name][rows][touched] = flags

    in_parallel(change, list(range(0, len(material), BAND)))
    return made, clamped


def edited(material: NDArray[np.float64], edit: EditOptions) -> NDArray[np.float64]:
    """A material (5, P) after one edit, without bounds."""
    color, roughness, metallic = material[:3], material[3:4], material[4:]
    if edit.hue or edit.saturation != 1:
        color = from_oklab(turned(to_oklab(color), np.radians(edit.hue), edit.saturation))
    color = color * edit.brightness * srgb_decode(np.array(edit.tint_srgb()))[:, None]
    roughness = roughness * edit.roughness_scale + edit.roughness_offset
    if edit.metallic is not None:
        metallic = np.full_like(metallic, edit.metallic)
    return np.concatenate([color, roughness, 1 - metallic if edit.invert_metallic else metallic])


def turned(lab: NDArray[np.float64], angle: float, saturation: float) -> NDArray[np.float64]:
    """OKLab (3, P) at the same lightness, hue turned by an angle in radians, chroma multiplied."""
    lightness, a, b = lab
    cosine, sine = saturation * np.cos(angle), saturation * np.sin(angle)
    return np.stack([lightness, a * cosine - b * sine, a * sine + b * cosine])


def into_bounds(material: NDArray[np.float64]) -> tuple[NDArray[np.float64], dict[str, NDArray[np.bool_]]]:
    """A material (5, P) with all values in [0, 1]. Returns: it; of each map, (P,) whether it was outside."""
    beyond = np.abs(material - 0.5) > 0.5 + OUTSIDE
    outside: dict[str, NDArray[np.bool_]] = {name: np.asarray(beyond[columns].any(0)) for name, columns in MAPS.items()}
    made = material.copy()
    made[:3, outside["albedo"]] = greyed(made[:3, outside["albedo"]])
    return made.clip(0, 1), outside


def greyed(color: NDArray[np.float64]) -> NDArray[np.float64]:
    """Colours (3, P) as saturated as they can be shown: mixed with the grey of their lightness, at the same hue.

    What is lighter than white becomes white, what is darker than black black.
    """
    lab = to_oklab(color)
    lightness, chroma = lab[:1].clip(0, 1), lab[1:]
    low, high = np.zeros(color.shape[1]), np.ones(color.shape[1])
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        shown = from_oklab(np.concatenate([lightness, chroma * middle]))
        fits = ((shown >= -OUTSIDE) & (shown <= 1 + OUTSIDE)).all(0)
        low, high = np.where(fits, middle, low), np.where(fits, high, middle)
    return from_oklab(np.concatenate([lightness, chroma * low]))
