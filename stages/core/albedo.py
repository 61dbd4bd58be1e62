"""Directional albedo of the specular terms: what an open point reflects of an even light of radiance 1.

A table over roughness and N·V, made once by float64 quadrature and shipped with the code; `python -m
stages.core.albedo` makes it again. The transport integrator normalises its sums with it, and shading interpolates
roughness relative to it, so that a white furnace comes out exact between knots too.
"""

import functools
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stages.core.brdf import MIN_ALPHA, alpha_from_roughness, directional_albedo
from stages.core.parallel import in_parallel

if TYPE_CHECKING:
    from torch import Tensor

FILE = Path(__file__).with_name("albedo.npy")

ROUGHNESS_STEPS = 129
"""Rows at roughness row / (ROUGHNESS_STEPS - 1)."""

COSINE_STEPS = 96
"""Columns at N·V = (column / (COSINE_STEPS - 1))^2, denser where the albedo bends."""

MIN_COSINE = 1e-3
"""Least N·V that is shaded; `stages.light.gbuffer` bends shading normals to keep it."""


@functools.lru_cache(maxsize=1)
def table() -> NDArray[np.float32]:
    """Albedo of A and B: (ROUGHNESS_STEPS, COSINE_STEPS, 2)."""
    return np.load(FILE, allow_pickle=False)


@functools.lru_cache(maxsize=1)
def diffuse_table() -> NDArray[np.float32]:
    """Albedo of E, which knows no roughness: (COSINE_STEPS,)."""
    return directional_albedo(cosines(), 1.0, 128)[:, 0].astype(np.float32)


def cosines() -> NDArray[np.float64]:
    """N·V of each column."""
    return np.maximum((np.arange(COSINE_STEPS) / (COSINE_STEPS - 1)) ** 2, MIN_COSINE)


def open_albedo(roughness: NDArray, cosine: NDArray) -> NDArray:
    """Albedo of A and B, bilinear in the table.

    Args:
        roughness, cosine: (P,) in [0, 1], of one float type; cosine is N·V.
    Returns:
        (P, 2).
    """
    values = table().astype(roughness.dtype)
    y = roughness * (ROUGHNESS_STEPS - 1)
    x = np.sqrt(cosine.clip(0, 1)) * (COSINE_STEPS - 1)
    row, column = y.astype(np.int64).clip(0, ROUGHNESS_STEPS - 2), x.astype(np.int64).clip(0, COSINE_STEPS - 2)
    fy, fx = ((at - cell).astype(values.dtype)[:, None] for at, cell in ((y, row), (x, column)))
    near = values[row, column] * (1 - fx) + values[row, column + 1] * fx
    far = values[row + 1, column] * (1 - fx) + values[row + 1, column + 1] * fx
    return near * (1 - fy) + far * fy


def specular_albedo(roughness: "Tensor", cosine: "Tensor") -> "Tensor":
    """`open_albedo` of tensors, (P, 2). Differentiable in: roughness."""
    values = roughness.new_tensor(table())
    y = roughness * (ROUGHNESS_STEPS - 1)
    x = cosine.clamp(0, 1).sqrt() * (COSINE_STEPS - 1)
    row, column = y.detach().long().clamp(0, ROUGHNESS_STEPS - 2), x.long().clamp(0, COSINE_STEPS - 2)
    fy, fx = (y - row)[:, None], (x - column)[:, None]
    near = values[row, column] * (1 - fx) + values[row, column + 1] * fx
    far = values[row + 1, column] * (1 - fx) + values[row + 1, column + 1] * fx
    return near * (1 - fy) + far * fy


def make_table(resolution: int = 256) -> NDArray[np.float32]:
    """The table by quadrature, `resolution` points along each side of the sampling square."""
    alphas = [max(alpha_from_roughness(r), MIN_ALPHA) for r in np.linspace(0, 1, ROUGHNESS_STEPS)]
    rows = in_parallel(lambda alpha: directional_albedo(cosines(), alpha, resolution)[:, 1:], alphas)
    return np.stack(rows).astype(np.float32)


if __name__ == "__main__":
    np.save(FILE, make_table())
