"""What a camera sees of the mesh, one point sample at each pixel's centre."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stages.core.albedo import MIN_COSINE
from stages.core.frames import camera_rays
from stages.light.scene import OFFSET, Hits, Scene


@dataclass(frozen=True)
class GBuffer:
    """Surface points of a view. P is the count of object pixels, row by row.

    mask: (H, W) bool. depth: (H, W) planar, 0 off the object. origin: (P, 3) where rays leave the point.
    point, n, ng, wo: (P, 3) world; n (as normal maps turn it) and ng face the viewer, wo is unit and points to it.
    triangle: (P,). barycentric: (P, 3).
    """

    mask: NDArray[np.bool_]
    depth: NDArray[np.float32]
    point: NDArray[np.float32]
    origin: NDArray[np.float32]
    n: NDArray[np.float32]
    ng: NDArray[np.float32]
    wo: NDArray[np.float32]
    triangle: NDArray[np.int32]
    barycentric: NDArray[np.float32]

    def surface(self, rows: NDArray[np.int64]) -> NDArray[np.float32]:
        """Where steep rays leave some points, (R, 3): the triangle itself; `origin` lies on the smooth surface over it."""
        return self.point[rows] + np.float32(OFFSET) * self.ng[rows]

    def __getitem__(self, rows: NDArray[np.int64]) -> "GBuffer":
        """Some of the points, by ascending rows, as a view in which the others are not seen."""
        mask = np.zeros(self.mask.size, bool)
        mask[np.flatnonzero(self.mask)[rows]] = True
        return replace(
            self,
            mask=mask.reshape(self.mask.shape),
            point=self.point[rows],
            origin=self.origin[rows],
            n=self.n[rows],
            ng=self.ng[rows],
            wo=self.wo[rows],
            triangle=self.triangle[rows],
            barycentric=self.barycentric[rows],
        )


def trace_view(scene: Scene, c2w: NDArray, fov_y: float, width: int, height: int) -> GBuffer:
    """Trace one ray through each pixel centre.

    Args:
        c2w: (4, 4). fov_y: radians. width, height: pixels.
    """
    origins, directions = camera_rays(c2w, fov_y, width, height)
    hits = scene.intersect(origins, directions)
    return surface_points(scene, hits, directions, hits.mask.reshape(height, width))


def surface_points(scene: Scene, hits: Hits, directions: NDArray, mask: NDArray[np.bool_]) -> GBuffer:
    """The points that rays hit, in their order, as pixels of a view. Args: directions: (R, 3). mask: (H, W), as many as hit."""
    seen = hits.mask
    depth = np.zeros(mask.shape, np.float32)
    depth[mask] = hits.t[seen]
    triangle, barycentric = hits.triangle[seen], hits.barycentric[seen]
    wo = -directions[seen] / np.linalg.norm(directions[seen], axis=-1, keepdims=True)
    ng = scene.geometric_normal(triangle)
    side = np.where((ng * wo).sum(-1) >= 0, 1.0, -1.0)
    n = facing(scene.shading_normal(triangle, barycentric) * side[:, None], wo)
    return GBuffer(
        mask=mask,
        depth=depth,
        point=scene.point(triangle, barycentric),
        origin=scene.ray_origin(triangle, barycentric, side),
        n=n,
        ng=(ng * side[:, None]).astype(np.float32),
        wo=wo.astype(np.float32),
        triangle=triangle,
        barycentric=barycentric,
    )


def facing(n: NDArray, wo: NDArray) -> NDArray[np.float32]:
    """Shading normals, those that turn away from the viewer bent back until N·V = `MIN_COSINE`.

    Args:
        n, wo: (P, 3) unit.
    Returns:
        (P, 3) unit float32.
    """
    cosine = (n * wo).sum(-1, keepdims=True)
    across = n - cosine * wo
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    across = across / np.where(length > 0, length, 1)
    bent = MIN_COSINE * wo + np.sqrt(1 - MIN_COSINE**2) * across
    return np.where(cosine < MIN_COSINE, bent, n).astype(np.float32)
