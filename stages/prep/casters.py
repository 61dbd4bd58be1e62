"""What else stands in a scene, as shadow casters of the object that is made: geometry alone, in the object's world frame.

Casters are the same for the eye, not to the bit: where a scene has more than MOST triangles its objects are simplified. What
encloses an object so that no light comes to it (a sky, a room with all its walls) casts no shadow.
"""

from dataclasses import dataclass

import numpy as np
import pymeshlab
from numpy.typing import NDArray

from stages.core.frames import transform_points
from stages.core.polygons import triangulate
from stages.light.scene import OFFSET, Scene
from stages.prep.source import Source

MOST = 100_000
"""Triangles of all casters together."""

LEAST = 64
"""Triangles that an object keeps when it is simplified."""

POINTS, RAYS = 64, 64
"""By which it is asked how open an object stands."""

OPEN = 0.02
"""Least share of the rays that must reach the sky."""


@dataclass(frozen=True)
class Placed:
    """A node's surface: vertices (V, 3) in the scene's frame, triangles (T, 3)."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]

    def box(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Its lowest and highest corner."""
        return self.vertices.min(0), self.vertices.max(0)


def placed(source: Source, parts_of_nodes: list[list[int]]) -> list[Placed]:
    """The surface of each node, simplified where all together are too many. Args: parts of each node."""
    points = source.placed_vertices()
    finite = (np.abs(points) <= np.finfo(np.float32).max).all(1)
    loops, face = triangulate(source.loop_start, np.where(finite[:, None], points, 0)[source.loop_vertex])
    corners, part = source.loop_vertex[loops], source.face_part[face]
    corners, part = corners[finite[corners].all(1)], part[finite[corners].all(1)]
    order = np.argsort(part, kind="stable")
    bounds = np.searchsorted(part[order], np.arange(len(source.parts) + 1))
    found = []
    for parts in parts_of_nodes:
        mine = corners[np.concatenate([order[bounds[k] : bounds[k + 1]] for k in parts])]
        used, triangles = np.unique(mine, return_inverse=True)
        found.append(_simplified(Placed(points[used], triangles.reshape(-1, 3)), MOST / max(len(corners), 1)))
    return found


def _simplified(of: Placed, share: float) -> Placed:
    """A surface with a share of its triangles, by quadric error (Garland and Heckbert 1997)."""
    wanted = max(LEAST, int(len(of.triangles) * share))
    if len(of.triangles) <= wanted:
        return of
    low, high = of.box()
    scale = float((high - low).max()) or 1.0
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh((of.vertices - low) / scale, of.triangles))
    meshes.meshing_merge_close_vertices()
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=wanted)
    made = meshes.current_mesh()
    if not made.face_number():
        return of
    return Placed(made.vertex_matrix() * scale + low, made.face_matrix().astype(np.int64))


def casters(
    others: list[Placed], to_world: NDArray[np.float64], scene: Scene
) -> tuple[NDArray[np.float32], NDArray[np.int32], int]:
    """What casts shadows on an object, in its world frame.

    Args:
        others: all nodes but its own. to_world: (4, 4) of the object. scene: the object.
    Returns:
        (CV, 3); (CF, 3); how many nodes were left out since they enclose it.
    """
    moved = [Placed(transform_points(to_world, of.vertices), of.triangles) for of in others]
    low, high = scene.vertices.min(0), scene.vertices.max(0)
    apart = [of for of in moved if not ((of.box()[0] <= low).all() and (of.box()[1] >= high).all())]
    chosen = moved if len(apart) == len(moved) or _open(scene, _joined(moved)) else apart
    return *_joined(chosen), len(moved) - len(chosen)


def _joined(parts: list[Placed]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    first = np.cumsum([0, *(len(of.vertices) for of in parts)])
    vertices = np.concatenate([np.zeros((0, 3)), *(of.vertices for of in parts)])
    triangles = np.concatenate([np.zeros((0, 3), np.int64), *(of.triangles + k for of, k in zip(parts, first, strict=False))])
    return np.clip(vertices, -1e6, 1e6).astype(np.float32), triangles.astype(np.int32)


def _open(scene: Scene, around: tuple[NDArray[np.float32], NDArray[np.int32]]) -> bool:
    """Whether light comes to an object between its casters."""
    rng = np.random.default_rng(0)
    face = rng.integers(0, len(scene.triangles), POINTS)
    weights = rng.dirichlet((1, 1, 1), POINTS)
    ng = scene.geometric_normal(face)
    start = scene.point(face, weights) + OFFSET * ng
    wi = rng.normal(size=(POINTS, RAYS, 3))
    wi *= np.sign(np.einsum("prk,pk->pr", wi, ng))[..., None]
    lit = Scene(scene.vertices, scene.triangles, scene.normals, casters=around)
    origins = np.repeat(start, RAYS, 0)
    alone, among = (~of.occluded(origins, wi.reshape(-1, 3)) for of in (scene, lit))
    return bool(among.sum() >= OPEN * max(alone.sum(), 1))
