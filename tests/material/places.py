"""Squares of points, as a swatch has them."""

import numpy as np
from numpy.typing import NDArray

from stages.material.place import Place


def square(metres: float, size: int, footprint: float | None = None, period: bool = True, shift: float = 0.0) -> Place:
    """size x size points over a square; they tile where `period`. footprint: metres, else their distance."""
    step = metres / size
    across = (np.arange(size, dtype=np.float32) + np.float32(0.5)) * np.float32(step) + np.float32(shift)
    u, v = (a.ravel() for a in np.meshgrid(across, across))
    width = np.full(len(u), step if footprint is None else footprint, np.float32)
    around = metres if period else 0.0
    p = np.stack([u, v, np.full_like(u, 0.1234)])
    return Place(p, np.stack([u, v]), np.zeros(len(u), np.int32), width, (around, around, 0.0))


def luminance(color: NDArray) -> NDArray:
    """(P,) of linear (3, P)."""
    return np.array([0.2126, 0.7152, 0.0722]) @ color
