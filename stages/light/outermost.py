"""Triangles on the convex hull of all that there is: beyond their plane lies nothing, and what leaves them needs no ray."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError, cKDTree

MARGIN = 4e-6
"""World units by which anything may stand over such a plane: a fifth of the height at which rays start."""


def outermost(vertices: NDArray, triangles: NDArray, others: NDArray) -> NDArray[np.bool_]:
    """Whether nothing stands over a triangle's plane, in front of it and behind it: (F, 2).

    A triangle is one of the hull when its plane is that of a facet. Source: Barber, Dobkin & Huhdanpaa 1996, "The Quickhull
    Algorithm for Convex Hulls".

    Args:
        vertices: (V, 3) world. triangles: (F, 3). others: (N, 3), vertices of what else there is.
    """
    found = np.zeros((len(triangles), 2), np.bool_)
    every = np.concatenate([vertices, others]).astype(np.float64)
    try:
        planes = ConvexHull(every).equations  # outward normals and offsets
    except (QhullError, ValueError):  # flat, or next to nothing
        return found
    corners = vertices[triangles].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal /= np.where(length > 0, length, 1)
    own = np.c_[normal, -(normal * corners.mean(1)).sum(1)]
    tree, nearest = cKDTree(planes), MARGIN / (1 + np.linalg.norm(every, axis=1).max())
    for side, sign in enumerate((1, -1)):
        found[:, side] = np.isfinite(tree.query(sign * own, distance_upper_bound=nearest)[0])
    return found & (length > 0)
