"""The source mesh as its file has it: numbers, faces and UV set untouched, so that `bake` can give them back.

A *loop* is one corner of one face, in the order of the file. Readers repair nothing; they refuse, with one line, what
they cannot take literally.
"""

from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.core.errors import InputError
from stages.core.frames import transform_points

IDENTITY = tuple(float(x) for x in np.eye(4).reshape(-1))


def nothing_passed_on() -> dict[str, Any]:
    """What a source without further textures has of them."""
    return {"materials": {}, "textures": [], "images": []}


@dataclass(frozen=True)
class Part:
    """The faces of one material slot on one node. transform: node to source frame, 16 numbers, row by row.

    instance_of: the first part of the same mesh and slot, whose texels this one shows; -1 where it has its own.
    """

    name: str
    material: str = ""
    node: str = ""
    transform: tuple[float, ...] = IDENTITY
    instance_of: int = -1


@dataclass(frozen=True)
class Tree:
    """The nodes of a scene as its file has them.

    nodes: glTF's entries: "name", "children", places, "extras"; "instances" has the columns of EXT_mesh_gpu_instancing as
    numbers. roots: rows of them. places: of each part, its node and the number of the instance on it. meshes: of each node,
    what is equal where nodes share a mesh, -1 where nothing hangs on it. posed: nodes whose vertices are in the scene's frame.
    """

    nodes: list[dict[str, Any]]
    roots: list[int]
    places: list[tuple[int, int]]
    meshes: list[int]
    posed: list[int] = field(default_factory=list)


@dataclass(frozen=True)
class Source:
    """A mesh file's content.

    vertices: (SV, 3) float64 as in the file. uv: (ST, 2) float64. normals: (SN, 3) float32.
    loop_start: (P + 1,) int32; face p has loops loop_start[p] .. loop_start[p + 1] - 1.
    loop_vertex, loop_uv, loop_normal: (L,) int32 rows of the above; -1 where a loop has no UV or normal.
    face_part: (P,) int32 rows of parts. face_group: (P,) int32 rows of groups (an OBJ's `g`), or -1.
    v_down: whether v = 0 is the top of the image. tangents: (SG, 4) float32; loop_tangent: (L,) rows of these.
    passed_on, images: what materials have besides colour, see `stages.asset.passed_on`.
    skipped: what the file holds besides triangles and polygons, with its count.
    applied: what made these vertices out of the file's (skins, morph targets, instances). more_uv: further UV sets, uv and
    loop_uv of each. tree: the scene's nodes, where the format has some.
    """

    format: str
    vertices: NDArray[np.float64]
    uv: NDArray[np.float64]
    normals: NDArray[np.float32]
    loop_start: NDArray[np.int32]
    loop_vertex: NDArray[np.int32]
    loop_uv: NDArray[np.int32]
    loop_normal: NDArray[np.int32]
    face_part: NDArray[np.int32]
    parts: list[Part]
    v_down: bool = False
    skipped: dict[str, int] = field(default_factory=dict)
    applied: dict[str, int] = field(default_factory=dict)
    more_uv: list[tuple[NDArray[np.float64], NDArray[np.int32]]] = field(default_factory=list)
    face_group: NDArray[np.int32] | None = None
    groups: list[str] = field(default_factory=list)
    tangents: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 4), np.float32))
    loop_tangent: NDArray[np.int32] | None = None
    passed_on: dict[str, Any] = field(default_factory=nothing_passed_on)
    images: list[bytes] = field(default_factory=list)
    tree: Tree | None = None

    def by_uv_set(self) -> list["Source"]:
        """This source, and itself with each further UV set in the first one's place; tangents and the textures passed on
        belong to the first."""
        bare = replace(self, tangents=self.tangents[:0], loop_tangent=None, passed_on=nothing_passed_on(), images=[])
        return [self, *(replace(bare, uv=uv, loop_uv=loop_uv) for uv, loop_uv in self.more_uv)]

    def placed_vertices(self) -> NDArray[np.float64]:
        """(SV, 3) vertices with node transforms applied; an unreferenced vertex stays as it is."""
        placed = self.vertices.copy()
        part_of_vertex = np.full(len(placed), -1)
        part_of_vertex[self.loop_vertex] = self.loop_part()
        for part, mine in zip(self.parts, rows_of(part_of_vertex, len(self.parts)), strict=True):
            if part.transform != IDENTITY:
                with np.errstate(invalid="ignore", over="ignore"):
                    placed[mine] = transform_points(np.reshape(part.transform, (4, 4)), placed[mine])
        return placed

    def loop_part(self) -> NDArray[np.int32]:
        """(L,) the part of each loop."""
        return np.repeat(self.face_part, np.diff(self.loop_start))


def rows_of(labels: NDArray, count: int) -> list[NDArray[np.int64]]:
    """The rows of `labels` that are 0, those that are 1, … count - 1."""
    order = np.argsort(labels, kind="stable")
    bounds = np.searchsorted(labels[order], np.arange(count + 1))
    return [order[start:stop] for start, stop in pairwise(bounds)]


def polygons(lengths: NDArray, vertices: int, loop_vertex: NDArray, path: Path) -> tuple[NDArray, NDArray]:
    """loop_start and loop_vertex as int32, checked.

    Args:
        lengths: (P,) corners of each face. vertices: how many there are. loop_vertex: (L,) indices, flat.
    Raises: InputError when there is no face or an index points at no vertex.
    """
    if vertices == 0 or len(lengths) == 0:
        raise InputError(
            f"{path}: {vertices} vertices and {len(lengths)} faces, expected a surface; export the mesh again"
        )
    check_range(loop_vertex, vertices, "vertex", path)
    if len(loop_vertex) >= 2**31:
        raise InputError(f"{path}: {len(loop_vertex)} corners, expected fewer than 2147483648; split the mesh")
    start = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)
    return start, np.asarray(loop_vertex).astype(np.int32)


def check_range(index: NDArray, count: int, what: str, path: Path) -> None:
    """Raises: InputError when an index is outside 0 .. count - 1."""
    wrong = (index < 0) | (index >= count)
    if wrong.any():
        found = int(np.asarray(index)[wrong][0])
        raise InputError(
            f"{path}: a face refers to {what} {found} (counted from 0), but the file has {count}; "
            "the file is damaged or cut off, export it again"
        )
