"""Edges and creases of a surface, told from points spread over it."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

NEAR = 24
"""Neighbours that are looked at."""

REACH = 0.05
"""How far away they may be, object sizes."""


class SurfaceSamples:
    """Points spread evenly over a surface, some 16,000 for an object. points: (N, 3)."""

    def __init__(self, points: NDArray) -> None:
        self.points = points
        self._tree = cKDTree(points)

    def convexity(self, points: NDArray, normals: NDArray) -> NDArray[np.float32]:
        """How far the surface around each point falls off below its tangent plane, against its distance.

        Args:
            points, normals: (P, 3).
        Returns:
            (P,): about 0.4 on a right-angled edge, 0 on a plane, negative in a crease.
        """
        distance, index = self._tree.query(points, NEAR, distance_upper_bound=REACH)
        found = np.isfinite(distance)
        offset = self.points[np.where(found, index, 0)] - points[:, None]
        drop = np.where(found, -(offset * normals[:, None]).sum(-1), 0).sum(1)
        total = np.where(found, distance, 0).sum(1)
        return np.where(total > 0, drop / np.maximum(total, 1e-12), 0).astype(np.float32)
