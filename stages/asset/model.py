"""The source mesh again, in its own vertices, faces, UVs and frame, as a renderer wants it: one normal and UV per vertex.

Per corner, positions, UVs and face order are the source's, bit for bit; a polygon becomes the triangles that were traced.
"""

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.asset.corners import (
    flipped_loops,
    gltf_uv,
    keeps_gltf_uv,
    loop_normals,
    loop_parts,
    loop_tangents,
    source_triangles,
    transform_of,
)
from stages.asset.vertices import VertexTable, split_vertices
from stages.asset.worn import Worn, worn_materials
from stages.core.artifact import Artifact
from stages.core.frames import Y_UP_TO_WORLD

ANY_NORMAL = np.array([0, 0, 1], np.float32)
"""Of a vertex that no face uses."""

ANY_TANGENT = np.array([1, 0, 0, 1], np.float32)
"""Likewise."""


@dataclass(frozen=True)
class Part:
    """One material of one node.

    transform: (4, 4) local to source frame. positions, normals: (N, 3) float32, local. uv: (N, 2), v down. tangents:
    (N, 4), or None without a normal map. triangles: (T, 3) uint32. Parts that share a vertex table share its arrays, and
    instances all of them.
    """

    name: str
    worn: Worn
    node: str
    transform: NDArray[np.float64]
    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    uv: NDArray[np.float32]
    tangents: NDArray[np.float32] | None
    triangles: NDArray[np.uint32]


@dataclass(frozen=True)
class Model:
    """What model.glb holds. upright: (4, 4) source frame to glTF's +y up. notes: what could not be represented."""

    parts: list[Part]
    upright: NDArray[np.float64]
    double_sided: bool
    notes: dict[str, int] = field(default_factory=dict)


def source_model(prep: Artifact, double_sided: bool, normal_mapped: Collection[str] = ()) -> Model:
    """Build the model from prep.npz.

    Args:
        double_sided: whether backs are meant to be seen. normal_mapped: names of the materials that have a normal map.
    """
    notes: dict[str, int] = {}
    positions = finite_positions(prep["source_vertices"], notes)
    uv, normals = gltf_uv(prep), loop_normals(prep)
    infos = prep.provenance.extra["parts"]
    bumpy = {number for number, info in enumerate(infos) if info["material"] in normal_mapped}
    tangents = loop_tangents(prep, normals, uv, bumpy) if bumpy else None
    triangles, face = source_triangles(prep)
    usable = ~np.isin(prep["loop_vertex"][triangles], unusable_vertices(prep["source_vertices"])).any(1)
    if not usable.all():
        notes["faces_with_vertices_not_finite_left_out"] = len(np.unique(face[~usable]))
    worn, of_face = worn_materials(prep)
    triangles, part, row = triangles[usable], prep["face_part"][face[usable]], of_face[face[usable]]
    parts: dict[tuple[int, int], Part] = {}
    for numbers, start, stop in vertex_runs(prep):
        if all(infos[number].get("instance_of", -1) >= 0 for number in numbers):
            continue
        loops = np.flatnonzero(np.isin(loop_parts(prep), numbers))
        kinds = [uv, normals] if tangents is None else [uv, normals, tangents]
        table = split_vertices(prep["loop_vertex"], loops, kinds, start, stop)
        spare = spare_uv(prep, table, loops)
        arrays = positions[table.source], table.values(normals, ANY_NORMAL), table.values(uv, spare)
        frames = None if tangents is None else table.values(tangents, ANY_TANGENT)
        for number in numbers:
            for shown in np.unique(row[part == number]).tolist():
                indices = table.of_loop[triangles[(part == number) & (row == shown)]].astype(np.uint32)
                parts[number, shown] = _part(infos[number], worn[shown], arrays, frames if number in bumpy else None, indices)
    parts |= instances(infos, parts)
    in_order = [parts[key] for key in sorted(parts)]
    return Model(in_order, upright(prep["to_world"]), double_sided or bool(flipped_loops(prep).any()), notes)


def instances(infos: list[dict[str, Any]], parts: dict[tuple[int, int], Part]) -> dict[tuple[int, int], Part]:
    """The parts that are instances of those given, whose arrays they share. Args: parts: by number and material."""
    of_first: dict[int, list[tuple[int, Part]]] = {}
    for (number, shown), part in parts.items():
        of_first.setdefault(number, []).append((shown, part))
    return {
        (number, shown): replace(part, node=str(info["node"] or info["name"] or "mesh"), transform=transform_of(info))
        for number, info in enumerate(infos)
        for shown, part in of_first.get(info.get("instance_of", -1), [])
    }


def _part(
    info: dict[str, Any], worn: Worn, arrays: tuple[NDArray, NDArray, NDArray], tangents: NDArray | None, triangles: NDArray
) -> Part:
    name = str(info["name"] or "mesh")
    node = str(info["node"] or name)
    return Part(name, worn, node, transform_of(info), *arrays, tangents, triangles)


def vertex_runs(prep: Artifact) -> list[tuple[list[int], int, int]]:
    """Parts that share vertices, with the first source vertex of their run and the one after its last.

    The parts of a GLB, an FBX or a USD file own runs of vertices, as they do in the file; in every other format all parts
    share all vertices.
    A vertex that no face uses belongs to the run before it.
    """
    count, parts = len(prep["source_vertices"]), len(prep.provenance.extra["parts"])
    if prep.provenance.extra["source_format"] not in ("glb", "fbx", "usd"):
        return [(list(range(parts)), 0, count)]
    low, high = np.full(parts, count, np.int64), np.full(parts, -1, np.int64)
    np.minimum.at(low, loop_parts(prep), prep["loop_vertex"])
    np.maximum.at(high, loop_parts(prep), prep["loop_vertex"])
    runs: list[tuple[list[int], int, int]] = []
    for part in np.argsort(low, kind="stable").tolist():
        if runs and low[part] < runs[-1][2]:
            numbers, start, stop = runs[-1]
            runs[-1] = ([*numbers, part], start, max(stop, int(high[part]) + 1))
        elif high[part] >= 0:
            runs.append(([part], int(low[part]) if runs else 0, int(high[part]) + 1))
    starts = [start for _, start, _ in runs] + [count]
    return [(numbers, start, stop) for (numbers, start, _), stop in zip(runs, starts[1:], strict=True)]


def spare_uv(prep: Artifact, table: VertexTable, loops: NDArray) -> NDArray[np.float32]:
    """UVs for the vertices of a table that no face uses, (N, 2): the file's own in a GLB, else 0."""
    result = np.zeros((len(table.source), 2), np.float32)
    own = loops[prep["loop_source_uv"][loops] >= 0]
    if keeps_gltf_uv(prep) and len(own):
        row = table.source + int(prep["loop_source_uv"][own[0]]) - int(prep["loop_vertex"][own[0]])
        there = (row >= 0) & (row < len(prep["source_uv"]))
        result[there] = np.nan_to_num(prep["source_uv"][row[there]], posinf=0, neginf=0)
    return result


def unusable_vertices(source_vertices: NDArray[np.float64]) -> NDArray[np.int64]:
    """Vertices that float32 cannot hold: not finite, or too large."""
    return np.flatnonzero(~(np.abs(source_vertices) <= np.finfo(np.float32).max).all(1))


def finite_positions(source_vertices: NDArray[np.float64], notes: dict[str, int]) -> NDArray[np.float32]:
    """Source vertices as float32; one that is not finite, which glTF forbids, moves to the first that is."""
    bad = unusable_vertices(source_vertices)
    good = np.ones(len(source_vertices), bool)
    good[bad] = False
    positions = np.zeros(source_vertices.shape, np.float32)
    positions[good] = source_vertices[good]
    if len(bad):
        positions[bad] = positions[good][:1] if good.any() else 0
        notes["vertices_not_finite"] = len(bad)
    return positions


def upright(to_world: NDArray[np.float64]) -> NDArray[np.float64]:
    """The rotation that brings the source's up axis to glTF's +y; the identity for a +y up source. Returns: (4, 4)."""
    scale = np.cbrt(abs(np.linalg.det(to_world[:3, :3])))
    rotation = np.eye(4)
    rotation[:3, :3] = np.round(Y_UP_TO_WORLD[:3, :3].T @ to_world[:3, :3] / scale, 6)
    return rotation
