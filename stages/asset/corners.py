"""What each corner of the source carries into a file: UV, normal and tangent, in its part's own frame.

A *loop* is one corner of one face of the source, in the order of the file (Blender's word).
"""

from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.core.artifact import Artifact
from stages.core.polygons import triangulate
from stages.core.tangents import mikktspace

UNIT_TOLERANCE = 5e-3
"""A source normal whose length is within this of 1 keeps its bits; the glTF validator allows 6.7e-3."""

USABLE = (0.9, 1.1)
"""Lengths that pass for a unit normal, as in `prep`; outside of it the traced normal stands in."""


def source_triangles(prep: Artifact) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The source's faces cut as they were traced, in the file's order. Returns: loops (T, 3) and face (T,) of each."""
    return triangulate(prep["loop_start"], prep["source_vertices"][prep["loop_vertex"]])


def loop_parts(prep: Artifact) -> NDArray[np.int32]:
    """Part of each loop, (L,)."""
    return np.repeat(prep["face_part"], np.diff(prep["loop_start"]))


def gltf_uv(prep: Artifact) -> NDArray[np.float32]:
    """UV of each loop, v down; the source's own bits where its format has v down too. Returns: (L, 2)."""
    uv = prep["loop_uv"].copy()
    uv[:, 1] = 1 - uv[:, 1]
    if keeps_gltf_uv(prep):
        with np.errstate(over="ignore"):
            own = prep["source_uv"][prep["loop_source_uv"]].astype(np.float32)
        turned = np.stack([own[:, 0], (1 - own[:, 1].astype(np.float64)).astype(np.float32)], 1)  # as `prep` does
        same = (prep["loop_source_uv"] >= 0) & (turned == prep["loop_uv"]).all(1)
        uv[same] = own[same]
    return uv


def keeps_gltf_uv(prep: Artifact) -> bool:
    """Whether the UVs are a glTF file's own."""
    return bool(prep.provenance.extra["uv_kept"]) and prep.provenance.extra["source_format"] == "glb"


# ---------------------------------------------------------------------------------------------------- frames


def transform_of(part: dict[str, Any]) -> NDArray[np.float64]:
    """A part's local-to-source matrix (4, 4)."""
    return np.array(part["transform"], np.float64).reshape(4, 4)


def part_frames(prep: Artifact) -> NDArray[np.float64]:
    """Local to world of each part but for its place, scaled to 1 at its largest number. Returns: (parts, 3, 3)."""
    transforms = np.stack([transform_of(part) for part in prep.provenance.extra["parts"]])
    linear = (prep["to_world"] @ transforms)[:, :3, :3]
    largest = np.abs(linear).max((1, 2), keepdims=True)
    return linear / np.where(largest > 0, largest, 1)


def flipped_loops(prep: Artifact) -> NDArray[np.bool_]:
    """Loops of faces that the working mesh winds the other way round than a renderer of the source sees them.

    A node that mirrors turns its faces round by itself (glTF 2.0, section 3.7.4). Returns: (L,).
    """
    loops = prep["triangle_loops"].astype(np.int64)
    descents = (np.roll(loops, -1, 1) < loops).sum(1)  # a rotation of ascending loops descends once
    mirrored = np.array([np.linalg.det(transform_of(part)[:3, :3]) < 0 for part in prep.provenance.extra["parts"]])
    flipped = np.zeros(len(prep["loop_vertex"]), bool)
    flipped[loops[(descents == 2) != mirrored[loop_parts(prep)[loops[:, 0]]]]] = True
    return flipped


# ---------------------------------------------------------------------------------------------------- normals


def loop_normals(prep: Artifact) -> NDArray[np.float32]:
    """Unit normal of each loop in its part's frame, on the side of the source's winding. Returns: (L, 3).

    The source's own where it has one, else the one that was traced and shaded with. A loop of a face that was left out
    has the normal of its vertex, on its face's side.
    """
    normals = traced_normals(prep)
    own, has_own = authored_normals(prep)
    normals[has_own] = own[has_own]
    unknown = np.flatnonzero((normals == 0).all(1))
    if len(unknown):
        normals[unknown] = vertex_or_face_normals(prep, normals, unknown)
    return normals


def traced_normals(prep: Artifact) -> NDArray[np.float32]:
    """The working mesh's normals in their parts' frames; 0 for the loops of faces that were left out. Returns: (L, 3)."""
    world = np.zeros((len(prep["loop_vertex"]), 3))
    world[prep["triangle_loops"]] = prep["normals"]
    world[flipped_loops(prep)] *= -1
    frame, part = part_frames(prep), loop_parts(prep)
    # normals go by the inverse transpose; one column after the other, so that equal normals stay equal to the bit
    local = sum(world[:, k : k + 1] * frame[part, k] for k in range(3))
    return (unit(local) + 0.0).astype(np.float32)  # no negative zeros, which would be another vertex


def authored_normals(prep: Artifact) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """The source's normals, made unit where they are not. Returns: (L, 3); (L,) whether a loop has one."""
    row = prep["loop_source_normal"]
    if not (row >= 0).any():
        return np.zeros((len(row), 3), np.float32), np.zeros(len(row), bool)
    table = prep["source_normals"]
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.linalg.norm(table.astype(np.float64), axis=1)
        rounded = (unit(table) + 0.0).astype(np.float32)
        table = np.where((np.abs(length - 1) <= UNIT_TOLERANCE)[:, None], table, rounded)
        usable = (length > USABLE[0]) & (length < USABLE[1])
    return table[row], (row >= 0) & usable[row]


def vertex_or_face_normals(prep: Artifact, normals: NDArray[np.float32], loops: NDArray) -> NDArray[np.float32]:
    """Normals for loops without: the first known one of the vertex, on the face's side, else the face's, else +z."""
    triangles, _ = source_triangles(prep)
    a, b, c = (prep["source_vertices"][prep["loop_vertex"][triangles[:, k]]] for k in range(3))
    flat = np.zeros((len(normals), 3))
    with np.errstate(invalid="ignore", over="ignore"):
        flat[triangles] = unit(np.cross(b - a, c - a))[:, None]
    known = np.flatnonzero((normals != 0).any(1))[::-1]
    first = np.full(len(prep["source_vertices"]), -1)
    first[prep["loop_vertex"][known]] = known
    at_vertex = first[prep["loop_vertex"][loops]]
    there = np.where((at_vertex >= 0)[:, None], normals[at_vertex], 0)
    there = there * np.where((there * flat[loops]).sum(1, keepdims=True) < 0, -1, 1)
    result = np.where((at_vertex >= 0)[:, None], there, flat[loops])
    result[(result == 0).all(1)] = (0, 0, 1)
    return (result + 0.0).astype(np.float32)


# ---------------------------------------------------------------------------------------------------- tangents


def loop_tangents(
    prep: Artifact, normals: NDArray[np.float32], uv: NDArray[np.float32], parts: Collection[int]
) -> NDArray[np.float32]:
    """Tangent of each loop of some parts, by which their normal maps are read: the source's own, else MikkTSpace's.

    Args:
        normals: (L, 3) in the part's frame. uv: (L, 2), v down. parts: numbers of the parts.
    Returns:
        (L, 4), glTF's TANGENT; (1, 0, 0, 1) for loops of other parts.
    """
    triangles, face = source_triangles(prep)
    position = prep["source_vertices"].astype(np.float32)[prep["loop_vertex"]]
    triangles_part = prep["face_part"][face]
    sound = np.isfinite(position[triangles]).all((1, 2))
    tangents = np.zeros((len(uv), 4), np.float32)
    tangents[:] = (1, 0, 0, 1)
    for part in parts:
        mine = triangles[sound & (triangles_part == part)]
        tangents[mine] = mikktspace(position[mine], normals[mine], uv[mine] * np.array([1, -1], np.float32))
    own, has_own = authored_tangents(prep)
    has_own &= np.isin(loop_parts(prep), list(parts))
    tangents[has_own] = own[has_own]
    return tangents


def authored_tangents(prep: Artifact) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """The source's tangents where its UVs were kept. Returns: (L, 4); (L,) whether a loop has a sound one."""
    row, table = prep["loop_source_tangent"], prep["source_tangents"]
    if not keeps_gltf_uv(prep) or not (row >= 0).any():
        return np.zeros((len(row), 4), np.float32), np.zeros(len(row), bool)
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.linalg.norm(table[:, :3].astype(np.float64), axis=1)
    sound = (np.abs(length - 1) <= UNIT_TOLERANCE) & (np.abs(table[:, 3]) == 1)
    return table[row], (row >= 0) & sound[row]


def unit(vectors: NDArray) -> NDArray[np.float64]:
    """Vectors (N, 3) at length 1; what has no finite direction becomes 0."""
    largest = np.abs(vectors).max(1, keepdims=True, initial=0)
    usable = np.isfinite(largest) & (largest > 0)
    scaled = np.where(usable, vectors, 0) / np.where(usable, largest, 1)
    length = np.linalg.norm(scaled, axis=1, keepdims=True)
    return scaled / np.where(length > 0, length, 1)
