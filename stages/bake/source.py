"""The source mesh again, in its own vertices, faces, UVs and frame, as a renderer wants it: one UV per vertex.

A vertex that has several UVs is split: the first UV met, in the order of the loops, keeps the source's index, the
others are appended. Positions are the source's numbers, untouched; a face is a fan of triangles, in the file's order.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.bake.jit import compiled
from stages.core.artifact import Artifact
from stages.core.frames import Y_UP_TO_WORLD

UNIT_TOLERANCE = 5e-3
"""A source normal whose length is within this of 1 is kept as it is; the glTF validator allows 6.7e-3."""


@dataclass(frozen=True)
class Part:
    """One material slot of one node.

    transform: (4, 4) local to source frame. positions: (N, 3) float32, local. normals: (N, 3) or None for flat
    shading. uv: (N, 2), v down. triangles: (T, 3) uint32. Parts that share a vertex table share its arrays.
    """

    name: str
    material: str
    node: str
    transform: NDArray[np.float64]
    positions: NDArray[np.float32]
    normals: NDArray[np.float32] | None
    uv: NDArray[np.float32]
    triangles: NDArray[np.uint32]


@dataclass(frozen=True)
class Model:
    """What model.glb holds. upright: (4, 4) source frame to glTF's +y up. notes: what could not be represented."""

    parts: list[Part]
    upright: NDArray[np.float64]
    double_sided: bool
    notes: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class VertexTable:
    """A run of vertices that some parts share.

    source: (N,) source vertex of each. loop: (N,) the first loop that uses it, or -1. of_loop: (L,) vertex of each loop
    of those parts.
    """

    source: NDArray[np.int64]
    loop: NDArray[np.int64]
    of_loop: NDArray[np.int64]


def source_model(prep: Artifact, double_sided: bool) -> Model:
    """Build the model from prep.npz. Args: double_sided: whether backs are meant to be seen."""
    notes: dict[str, int] = {}
    positions = finite_positions(prep["source_vertices"], notes)
    uv, normals = gltf_uv(prep), loop_normals(prep)
    fan, face = fan_triangles(prep["loop_start"])
    usable = ~np.isin(prep["loop_vertex"][fan], unusable_vertices(prep["source_vertices"])).any(1)
    if not usable.all():
        notes["faces_with_vertices_not_finite_left_out"] = len(np.unique(face[~usable]))
    fan, part_of = fan[usable], prep["face_part"][face[usable]]
    parts: dict[int, Part] = {}
    for numbers, start, stop in vertex_runs(prep):
        loops = np.flatnonzero(np.isin(loop_parts(prep), numbers))
        table = split_vertices(prep["loop_vertex"].astype(np.int64), loops, uv, start, stop)
        ours = fan[np.isin(part_of, numbers)]
        vertices = positions[table.source]
        shading = vertex_normals(vertices, table.of_loop[ours], normals[ours])
        arrays = vertices, shading, table_uv(prep, table, loops, uv)
        for number in numbers:
            triangles = table.of_loop[fan[part_of == number]].astype(np.uint32)
            parts[number] = _part(prep.provenance.extra["parts"][number], arrays, triangles)
    in_order = [parts[number] for number in sorted(parts) if len(parts[number].triangles)]
    return Model(in_order, upright(prep["to_world"]), double_sided or bool(flipped_loops(prep).any()), notes)


def _part(info: dict[str, Any], arrays: tuple[NDArray, NDArray | None, NDArray], triangles: NDArray) -> Part:
    name = str(info["name"] or "mesh")
    return Part(name, str(info["material"] or ""), str(info["node"] or name), transform_of(info), *arrays, triangles)


def loop_parts(prep: Artifact) -> NDArray[np.int32]:
    """Part of each loop, (L,)."""
    return np.repeat(prep["face_part"], np.diff(prep["loop_start"]))


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


def table_uv(prep: Artifact, table: VertexTable, loops: NDArray, uv: NDArray[np.float32]) -> NDArray[np.float32]:
    """UV of each vertex of a table, (N, 2). One that no face uses has the file's own in a GLB, else 0."""
    used = table.loop >= 0
    result = np.zeros((len(table.source), 2), np.float32)
    result[used] = uv[table.loop[used]]
    own = loops[prep["loop_source_uv"][loops] >= 0]
    if keeps_gltf_uv(prep) and len(own):
        row = table.source + int(prep["loop_source_uv"][own[0]]) - int(prep["loop_vertex"][own[0]])
        spare = ~used & (row >= 0) & (row < len(prep["source_uv"]))
        result[spare] = np.nan_to_num(prep["source_uv"][row[spare]], posinf=0, neginf=0)
    return result


def split_vertices(vertex: NDArray, loops: NDArray, uv: NDArray, start: int, stop: int) -> VertexTable:
    """Split source vertices start … stop - 1 by the UVs of the loops that use them.

    Args:
        vertex: (L,) source vertex of each loop. loops: those to look at, ascending. uv: (L, 2) float32.
    """
    bits = np.ascontiguousarray(uv, np.float32).view(np.uint64)[:, 0]
    of_loop, first = np.full(len(vertex), -1, np.int64), np.full(stop - start + len(loops), -1, np.int64)
    total = _split(vertex - start, loops, bits, stop - start, of_loop, first)
    first = first[:total]
    source = np.arange(start, start + total)
    source[stop - start :] = vertex[first[stop - start :]]
    return VertexTable(source, first, of_loop)


@compiled
def _split(vertex, loops, bits, count, of_loop, first):  # type: ignore[no-untyped-def]
    """Number the distinct (vertex, bits); first: the first loop of each. Returns: how many there are."""
    following = np.full(len(first), -1, np.int64)  # chain of the entries of one vertex
    total = count
    for loop in loops:
        entry = vertex[loop]
        while first[entry] >= 0 and bits[first[entry]] != bits[loop] and following[entry] >= 0:
            entry = following[entry]
        if first[entry] >= 0 and bits[first[entry]] != bits[loop]:
            following[entry] = total
            entry = total
            total += 1
        if first[entry] < 0:
            first[entry] = loop
        of_loop[loop] = entry
    return total


def fan_triangles(loop_start: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Each face as a fan from its first loop. Returns: loops (T, 3) and face (T,) of each triangle, faces in order."""
    start, size = loop_start[:-1].astype(np.int64), np.diff(loop_start.astype(np.int64))
    each = np.maximum(size - 2, 0)
    face = np.repeat(np.arange(len(size)), each)
    step = np.arange(len(face)) - np.repeat(np.cumsum(each) - each, each)
    first = start[face]
    return np.stack([first, first + step + 1, first + step + 2], 1), face


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


def gltf_uv(prep: Artifact) -> NDArray[np.float32]:
    """UV of each loop, v down; the source's own bits where its format has v down too. Returns: (L, 2)."""
    uv = prep["loop_uv"].copy()
    uv[:, 1] = 1 - uv[:, 1]
    if keeps_gltf_uv(prep):
        rows = prep["loop_source_uv"]
        uv[rows >= 0] = prep["source_uv"][rows[rows >= 0]].astype(np.float32)
    return uv


def keeps_gltf_uv(prep: Artifact) -> bool:
    """Whether the UVs are a glTF file's own."""
    return bool(prep.provenance.extra["uv_kept"]) and prep.provenance.extra["source_format"] == "glb"


def upright(to_world: NDArray[np.float64]) -> NDArray[np.float64]:
    """The rotation that brings the source's up axis to glTF's +y; the identity for a +y up source. Returns: (4, 4)."""
    scale = np.cbrt(abs(np.linalg.det(to_world[:3, :3])))
    rotation = np.eye(4)
    rotation[:3, :3] = np.round(Y_UP_TO_WORLD[:3, :3].T @ to_world[:3, :3] / scale, 6)
    return rotation


# ---------------------------------------------------------------------------------------------------- normals


def flipped_loops(prep: Artifact) -> NDArray[np.bool_]:
    """Loops of faces that the working mesh winds the other way round than the source. Returns: (L,)."""
    loops = prep["triangle_loops"].astype(np.int64)
    descents = (np.roll(loops, -1, 1) < loops).sum(1)  # a rotation of ascending loops descends once
    flipped = np.zeros(len(prep["loop_vertex"]), bool)
    flipped[loops[descents == 2]] = True
    return flipped


def loop_normals(prep: Artifact) -> NDArray[np.float32]:
    """Shading normal of each loop in its part's frame, on the side of the source's winding; 0 where unknown.

    The source's own where it is of unit length, else the working mesh's.

    Returns:
        (L, 3).
    """
    world = np.zeros((len(prep["loop_vertex"]), 3), np.float32)
    world[prep["triangle_loops"]] = prep["normals"]
    world[flipped_loops(prep)] *= -1
    loop_part = loop_parts(prep)
    transforms = np.stack([transform_of(part) for part in prep.provenance.extra["parts"]])
    linear = (prep["to_world"] @ transforms)[:, :3, :3]  # (parts, 3, 3), local to world
    largest = np.abs(linear).max((1, 2), keepdims=True)
    linear = (linear / np.where(largest > 0, largest, 1)).astype(np.float32)
    for number in range(len(linear)):
        mine = np.flatnonzero(loop_part == number)
        world[mine] = world[mine] @ linear[number]  # normals go by the inverse transpose
    normals = unit(world).astype(np.float32)
    row = prep["loop_source_normal"]
    if (row >= 0).any():
        own = np.where((row >= 0)[:, None], prep["source_normals"][row], 0)
        valid = np.abs(np.linalg.norm(own.astype(np.float64), axis=1) - 1) <= UNIT_TOLERANCE
        normals[valid] = own[valid]
    return normals


def transform_of(part: dict[str, Any]) -> NDArray[np.float64]:
    """A part's local-to-source matrix (4, 4)."""
    return np.array(part["transform"], np.float64).reshape(4, 4)


def unit(vectors: NDArray) -> NDArray[np.float64]:
    """Vectors (N, 3) at length 1; what has no finite direction becomes 0."""
    largest = np.abs(vectors).max(1, keepdims=True, initial=0)
    usable = np.isfinite(largest) & (largest > 0)
    scaled = np.where(usable, vectors, 0) / np.where(usable, largest, 1)
    length = np.linalg.norm(scaled, axis=1, keepdims=True)
    return scaled / np.where(length > 0, length, 1)


def vertex_normals(
    positions: NDArray[np.float32], triangles: NDArray[np.int64], corner_normals: NDArray[np.float32]
) -> NDArray[np.float32] | None:
    """One normal per vertex, or None when flat shading comes nearer to the corners' normals.

    A vertex whose corners differ gets their mean: to split it would change the mesh. Where that rounds off more than
    facets would show (area-weighted squared difference), none are written, which glTF defines as flat shading.

    Args:
        positions: (N, 3). triangles: (T, 3). corner_normals: (T, 3, 3), 0 where unknown.
    Returns:
        (N, 3), unit for every vertex, unused ones too.
    """
    corners = positions[triangles].astype(np.float64)
    area_normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat, area = unit(area_normal)[:, None], np.linalg.norm(area_normal, axis=1)[:, None]
    known = (corner_normals != 0).any(2)  # (T, 3)
    wanted = np.where(known[..., None], corner_normals, flat)
    total = np.zeros(positions.shape)
    np.add.at(total, triangles.reshape(-1), wanted.reshape(-1, 3))
    result = unit(total).astype(np.float32)
    result[(result == 0).all(1)] = (0, 0, 1)
    one = np.zeros_like(result)
    one[triangles] = wanted
    differs = np.zeros(len(positions), bool)
    differs[triangles[(one[triangles] != wanted).any(2)]] = True
    same = ~differs & (np.abs(np.linalg.norm(one, axis=1) - 1) <= UNIT_TOLERANCE)
    result[same] = one[same]  # the very bits
    smooth_error = (area * ((result[triangles] - wanted) ** 2).sum(2))[known].sum()
    flat_error = (area * ((flat - wanted) ** 2).sum(2))[known].sum()
    return result if smooth_error <= flat_error else None
