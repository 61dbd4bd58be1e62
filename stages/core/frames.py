"""Coordinate frames: world, camera, tangent.

World: right-handed, z up, the object's longest bounding-box edge is 1 and its centre the origin, its front on +x.
Camera: OpenGL (x right, y up, looks along -z); `c2w` is 4 x 4; pixel centres lie at +0.5; depth is planar z.
Arrays are NumPy; geometry is float64 where it is made and float32 where it is traced.
"""

import numpy as np
from numpy.typing import NDArray

Y_UP_TO_WORLD = np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""(x, y, z) of a +y up, +z front source becomes (z, x, y)."""

Z_UP_TO_WORLD = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
"""A +z up, -y front source (Blender): front -y becomes +x."""


def transform_points(matrix: NDArray, points: NDArray) -> NDArray:
    """Apply an affine (4, 4) matrix to points (..., 3)."""
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def look_at(eye: NDArray, target: NDArray, up: NDArray) -> NDArray[np.float64]:
    """Camera-to-world matrix of a camera at `eye` that looks at `target`.

    Args:
        eye, target, up: (..., 3) world; up must not be parallel to the view direction.
    Returns:
        (..., 4, 4).
    """
    back = eye - target
    back = back / np.linalg.norm(back, axis=-1, keepdims=True)
    right = np.cross(np.broadcast_to(up, back.shape), back)
    right = right / np.linalg.norm(right, axis=-1, keepdims=True)
    c2w = np.zeros((*back.shape[:-1], 4, 4))
    c2w[..., :3, 0], c2w[..., :3, 1], c2w[..., :3, 2] = right, np.cross(back, right), back
    c2w[..., :3, 3], c2w[..., 3, 3] = eye, 1.0
    return c2w


def camera_rays(c2w: NDArray, fov_y: float, width: int, height: int) -> tuple[NDArray, NDArray]:
    """Rays through every pixel centre, row by row from the top left.

    The directions are *not* unit vectors: each has length 1 along the camera's axis, so that the ray parameter
    of a hit is its planar depth.

    Args:
        c2w: (4, 4); fov_y: vertical field of view, radians; width, height: pixels.
    Returns:
        origins, directions: (height * width, 3) float64, world.
    """
    tan = np.tan(fov_y / 2)
    x = ((np.arange(width) + 0.5) / width * 2 - 1) * tan * width / height
    y = (1 - (np.arange(height) + 0.5) / height * 2) * tan
    local = np.stack([*np.meshgrid(x, y), -np.ones((height, width))], -1).reshape(-1, 3)
    directions = local @ c2w[:3, :3].T
    return np.broadcast_to(c2w[:3, 3], directions.shape).copy(), directions


def project(points: NDArray, c2w: NDArray, fov_y: float, width: int, height: int) -> tuple[NDArray, NDArray]:
    """Pixel coordinates and planar depth of world points.

    Returns:
        xy: (..., 2) pixels, a pixel's centre at +0.5; depth: (...), positive in front of the camera.
    """
    local = (points - c2w[:3, 3]) @ c2w[:3, :3]
    depth = -local[..., 2]
    tan = np.tan(fov_y / 2)
    x = (local[..., 0] / (depth * tan * width / height) + 1) / 2 * width
    y = (1 - local[..., 1] / (depth * tan)) / 2 * height
    return np.stack([x, y], -1), depth


def tangent_frame(n: NDArray) -> tuple[NDArray, NDArray]:
    """Two unit vectors that complete each unit normal to a right-handed frame (t, b, n).

    Source: Duff et al. 2017, "Building an Orthonormal Basis, Revisited", Listing 3; no singular direction.

    Args:
        n: (..., 3) unit.
    Returns:
        t, b: (..., 3).
    """
    x, y, z = n[..., 0], n[..., 1], n[..., 2]
    sign = np.where(z >= 0, 1.0, -1.0).astype(n.dtype)
    a = -1.0 / (sign + z)
    c = x * y * a
    t = np.stack([1 + sign * x * x * a, sign * c, -sign * x], -1)
    b = np.stack([c, sign + y * y * a, -y], -1)
    return t, b
