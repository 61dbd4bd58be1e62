"""Points, normals and ray origins on triangles, in NumPy: what `stages.light.hit_kernels` computes. Arguments as there."""

import numpy as np
from numpy.typing import NDArray


def points(vertices: NDArray, triangles: NDArray, triangle: NDArray, weights: NDArray) -> NDArray[np.float32]:
    """World positions."""
    corners = vertices[triangles[triangle]].astype(np.float64)  # (P, 3, 3)
    return np.einsum("pk,pkd->pd", weights, corners).astype(np.float32)


def smooth_normals(normals: NDArray, flat: NDArray, triangle: NDArray, weights: NDArray) -> NDArray[np.float32]:
    """Unit interpolated normals; the triangle's own where the corners' cancel out."""
    n = np.einsum("pk,pkd->pd", weights, normals[triangle].astype(np.float64))
    length = np.linalg.norm(n, axis=-1, keepdims=True)
    return np.where(length > 1e-3, n / np.where(length > 1e-3, length, 1), flat[triangle]).astype(np.float32)


def origins(
    vertices: NDArray, triangles: NDArray, normals: NDArray, flat: NDArray, triangle: NDArray, weights: NDArray, lifts: NDArray
) -> NDArray[np.float32]:
    """On the average of the corners' tangent planes, where they lie outside, lifted off."""
    b = np.asarray(weights, np.float64)
    corners = vertices[triangles[triangle]].astype(np.float64)  # (P, 3, 3)
    turned = normals[triangle].astype(np.float64) * lifts[:, 0, None, None]
    p = np.einsum("pk,pkd->pd", b, corners)
    below = np.minimum(np.einsum("pkd,pkd->pk", p[:, None] - corners, turned), 0.0)  # (P, 3)
    smooth = p - np.einsum("pk,pk,pkd->pd", b, below, turned)
    return (smooth + lifts[:, 1:] * flat[triangle]).astype(np.float32)
