"""The working mesh as Embree sees it: closest hits, occlusion, and where a secondary ray may start.

A miss is a mask, never a distance. Rays are float32; the mesh is the normalised one, about 1 across, so that one offset
in world units serves every source scale.
"""

import functools
from copy import copy
from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from stages.light import hit_kernels
from stages.light.emission import Emission
from stages.light.horizon import Horizons
from stages.light.normal_maps import NormalMaps
from stages.light.packets import Packets

OFFSET = 2e-5
"""Distance by which a secondary ray's origin is lifted off the surface, in world units (object size 1)."""


@dataclass(frozen=True)
class Hits:
    """Closest hits of R rays: mask (R,), ray parameter t (R,), triangle (R,) or -1, barycentric (R, 3)."""

    mask: NDArray[np.bool_]
    t: NDArray[np.float32]
    triangle: NDArray[np.int32]
    barycentric: NDArray[np.float32]


class _Tree:
    """Embree's trees over a mesh, each built by its first query: 2 s for a million triangles.

    robust: closest hits are watertight, and slower.
    """

    def __init__(self, vertices: NDArray, triangles: NDArray, robust: bool) -> None:
        self._mesh = vertices, triangles, robust
        self._lock = Lock()
        self._embree: EmbreeScene | None = None
        self._packets: Packets | None = None

    def occluded(self, origins: NDArray, directions: NDArray, asked: NDArray[np.int64] | None) -> NDArray[np.bool_]:
        """Whether anything lies along some of R rays, or all, (R,)."""
        o, d = np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(directions, np.float32)
        try:
            with self._lock:
                self._packets = self._packets or Packets(*self._mesh[:2])
        except OSError:  # embreex's own queries then
            hit = self.run(o, d, query="OCCLUDED") >= 0
            return hit if asked is None else hit & np.isin(np.arange(len(o)), asked)
        return self._packets.occluded(o, d, np.arange(len(o)) if asked is None else asked)

    def run(self, origins: NDArray, directions: NDArray, **query: object) -> Any:
        """Embree's answer to R rays, (R, 3) each."""
        with self._lock:
            if self._embree is None:
                self._embree = self._build(*self._mesh)
        o, d = np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(directions, np.float32)
        return self._embree.run(o, d, **query)

    def _build(self, vertices: NDArray, triangles: NDArray, robust: bool) -> EmbreeScene:
        scene = EmbreeScene(robust=robust)
        self._kept = TriangleMesh(scene, vertices, triangles)
        scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32), query="OCCLUDED")
        return scene


class Scene:
    """A triangle mesh ready for ray queries; safe to use from several threads, which run in parallel.

    Closest hits are watertight. Occlusion is not, and a fifth faster for it: of 46 million rays of a view's transport, on four
    meshes, one slipped through between two triangles.

    Args:
        vertices: (V, 3) float32 world. triangles: (F, 3) int32. normals: (F, 3, 3) float32 unit, per corner.
        bumps: normal maps that shading normals follow, if any. emission: what shines by itself, if anything; pictures show it.
        casters: vertices (CV, 3) and triangles (CF, 3) of what stands around and keeps light away, but is not seen.
    """

    def __init__(
        self,
        vertices: NDArray,
        triangles: NDArray,
        normals: NDArray,
        bumps: NormalMaps | None = None,
        emission: Emission | None = None,
        casters: tuple[NDArray, NDArray] | None = None,
    ) -> None:
        self.bumps, self.emission = bumps, emission
        self._casters = casters if casters is not None and len(casters[1]) else None
        self.vertices = np.ascontiguousarray(vertices, np.float32)
        self.triangles = np.ascontiguousarray(triangles, np.int32)
        self.normals = np.ascontiguousarray(normals, np.float32)
        self._closest, self._own = (_Tree(self.vertices, self.triangles, robust) for robust in (True, False))
        self._any = self._own
        if self._casters is not None:
            vertices = np.concatenate([self.vertices, self._casters[0]]).astype(np.float32)
            triangles = np.concatenate([self.triangles, self._casters[1] + len(self.vertices)]).astype(np.int32)
            self._any = _Tree(vertices, triangles, robust=False)

    @functools.cached_property
    def horizons(self) -> Horizons:
        """How high anything stands around its triangles."""
        others = self._casters or (np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))
        return Horizons(self.vertices, self.triangles, self._flat_normals, others)

    def intersect(self, origins: NDArray, directions: NDArray) -> Hits:
        """Closest hit of each ray. Args: (R, 3) each; directions need not be unit: t is in their length."""
        hit = self._closest.run(origins, directions, query="INTERSECT", output=True)
        mask = hit["primID"] >= 0
        u, v = np.where(mask, hit["u"], 0), np.where(mask, hit["v"], 0)
        barycentric = np.stack([1 - u - v, u, v], -1).astype(np.float32)
        return Hits(mask, np.where(mask, hit["tfar"], 0).astype(np.float32), hit["primID"], barycentric)

    def ends(self, origins: NDArray, directions: NDArray) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """What is nearest along rays that `occluded` says are blocked. Args: (R, 3) each.

        Returns:
            (R,) its triangle, -1 for nothing, -2 for a caster; (R, 3) barycentric.
        """
        hit = self._any.run(origins, directions, query="INTERSECT", output=True)
        triangle = np.where(hit["primID"] < len(self.triangles), hit["primID"], -2).astype(np.int32)
        return triangle, np.stack([1 - hit["u"] - hit["v"], hit["u"], hit["v"]], -1).astype(np.float32)

    def occluded(self, origins: NDArray, directions: NDArray, asked: NDArray[np.int64] | None = None) -> NDArray[np.bool_]:
        """Whether anything, casters too, lies along each ray, at any distance: (R,).

        Rays of one point, or of near ones, are answered faster after each other.

        Args:
            origins, directions: (R, 3). asked: rows of those that are asked about, in turn; the others are False. None for all.
        """
        return self._any.occluded(origins, directions, asked)

    def hidden(self, origins: NDArray, directions: NDArray) -> NDArray[np.bool_]:
        """Whether the mesh itself lies along each ray, at any distance. Args: (R, 3) each."""
        return self._own.occluded(origins, directions, None)

    def shaded_smooth(self) -> "Scene":
        """The same mesh with normals that are smooth over every edge: at a vertex, its faces' by the angle they have there.

        What Blender calls Shade Smooth; where they cancel out, a corner keeps its face's.
        """
        corners = self.vertices[self.triangles].astype(np.float64)  # (F, 3, 3)
        out, back = np.roll(corners, -1, 1) - corners, np.roll(corners, 1, 1) - corners
        angle = np.arctan2(np.linalg.norm(np.cross(out, back), axis=-1), (out * back).sum(-1))
        face = self.geometric_normal(np.arange(len(self.triangles)))[:, None]  # (F, 1, 3)
        weighted, vertex = (angle[..., None] * face).reshape(-1, 3), self.triangles.ravel()
        total = np.stack([np.bincount(vertex, weighted[:, k], len(self.vertices)) for k in range(3)], -1)
        length = np.linalg.norm(total, axis=-1, keepdims=True)
        smooth = (total / np.where(length > 1e-6, length, 1))[self.triangles]
        normals = np.where((length > 1e-6)[self.triangles], smooth, face)
        return Scene(self.vertices, self.triangles, normals, casters=self._casters)

    def geometric_normal(self, triangle: NDArray) -> NDArray[np.float32]:
        """Unit normal of each triangle, by its winding. Args: (P,). Returns: (P, 3); zero for a degenerate one."""
        return self._flat_normals[triangle]

    @functools.cached_property
    def _flat_normals(self) -> NDArray[np.float32]:
        """(F, 3): there are more points that ask than triangles."""
        a, b, c = (self.vertices[self.triangles[:, k]].astype(np.float64) for k in range(3))
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal, axis=-1, keepdims=True)
        return (normal / np.where(length > 0, length, 1)).astype(np.float32)

    def point(self, triangle: NDArray, barycentric: NDArray) -> NDArray[np.float32]:
        """World position on each triangle. Args: (P,), (P, 3). Returns: (P, 3)."""
        result = np.empty((len(triangle), 3), np.float32)
        hit_kernels.points(self.vertices, self.triangles, triangle, barycentric, result)
        return result

    def bumped(self, bumps: NormalMaps | None) -> "Scene":
        """The same mesh, and the same trees, with other normal maps."""
        other = copy(self)
        other.bumps = bumps
        return other

    def alone(self) -> "Scene":
        """The same mesh, and the same trees, without casters."""
        if self._casters is None:
            return self
        other = copy(self)
        other._any, other._casters = self._own, None
        return other

    def shading_normal(self, triangle: NDArray, barycentric: NDArray) -> NDArray[np.float32]:
        """Unit interpolated normal, leaning as the normal maps say. Args: (P,), (P, 3). Returns: (P, 3)."""
        n = self.smooth_normal(triangle, barycentric)
        return n if self.bumps is None else self.bumps.leaning(n, triangle, barycentric)

    def smooth_normal(self, triangle: NDArray, barycentric: NDArray) -> NDArray[np.float32]:
        """Unit interpolated normal; the triangle's own where the corners' cancel out. Returns: (P, 3)."""
        result = np.empty((len(triangle), 3), np.float32)
        hit_kernels.smooth_normals(self.normals, self._flat_normals, triangle, barycentric, result)
        return result

    def ray_origin(self, triangle: NDArray, barycentric: NDArray, side: NDArray) -> NDArray[np.float32]:
        """Where rays that leave a surface point start: on the smooth surface that the normals describe, lifted off.

        On a coarse mesh with smooth normals a ray from the flat triangle hits the mesh's own facets near the shadow
        terminator. The origin is moved onto the average of the corner tangent planes, where they lie outside.
        Source: Hanika 2021, "Hacking the Shadow Terminator", Ray Tracing Gems II, ch. 4.

        Args:
            triangle, barycentric: (P,), (P, 3). side: (P,) +1 or -1, the side of the winding's normal to leave from.
        Returns:
            (P, 3) float32.
        """
        result, lifts = np.empty((len(triangle), 3), np.float32), np.stack([side, OFFSET * side], -1).astype(np.float64)
        shape = (self.vertices, self.triangles, self.normals, self._flat_normals)
        hit_kernels.origins(*shape, triangle, barycentric, lifts, result)
        return result
