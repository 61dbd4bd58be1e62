"""From the source's loops to a welded list of triangles: what cannot be used is left out, and everything is counted."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from stages.core.errors import InputError
from stages.core.frames import Y_UP_TO_WORLD, Z_UP_TO_WORLD, transform_points
from stages.core.polygons import triangulate
from stages.prep.source import Source
from stages.prep.topology import components

FLAT = 2.0**-24
"""A triangle lower than this (half a float32 step at the edge of the object) has no side: its normal is noise."""

_CROWD = 32  # neighbours within the weld tolerance, on average, that are too many to list


@dataclass
class Working:
    """The mesh under work, world frame.

    vertices: (V, 3) float64, values that float32 holds exactly. triangles: (F, 3) vertices. loops: (F, 3) source
    loops. stand_in: (L,) the loop of the working mesh whose UV a source loop takes, or -1. to_world: (4, 4).
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    loops: NDArray[np.int32]
    stand_in: NDArray[np.int32]
    to_world: NDArray[np.float64]
    findings: dict[str, int] = field(default_factory=dict)


def repair(source: Source, up: str, weld_tolerance: float, path: Path) -> Working:
    """Triangulate, place, normalise, weld, and leave out faces without a side or with a twin.

    Args:
        up: "y" or "z". weld_tolerance: diagonals of the bounding box.
    Raises: InputError when no face is left.
    """
    placed = source.placed_vertices()
    finite = (np.abs(placed) <= np.finfo(np.float32).max).all(1)
    largest = np.abs(placed[finite]).max(initial=0)  # so that no product of coordinates over- or underflows
    loops, _ = triangulate(source.loop_start, placed[source.loop_vertex] / (largest if largest > 0 else 1.0))
    loops = _as_seen(loops, source)
    corners = source.loop_vertex[loops]
    usable = finite[corners].all(1)
    if not usable.any():
        found = f"{int((~finite).sum())} vertices are not finite, or beyond 3.4e38"
        raise InputError(f"{path}: no face has finite vertices ({found}); export the mesh again")
    used = np.unique(corners[usable])
    to_world = normalising(placed[used], up, path)
    world = np.zeros_like(placed)
    world[used] = transform_points(to_world, placed[used]).astype(np.float32)
    working = _weld(world, used, loops, usable, source, to_world, weld_tolerance)
    referenced = np.zeros(len(placed), bool)
    referenced[source.loop_vertex] = True
    working.findings |= {
        "non_finite_vertices": int((~finite).sum()),
        "unreferenced_vertices": int((~referenced).sum()),
    }
    if len(working.triangles) == 0:
        raise InputError(f"{path}: none of its {len(source.face_part)} faces has an area; expected a surface")
    return working


def _as_seen(loops: NDArray, source: Source) -> NDArray:
    """Loops with triangles of mirroring nodes turned round (glTF 2.0, section 3.7.4)."""
    transforms = np.reshape([part.transform for part in source.parts], (-1, 4, 4))
    mirrored = np.linalg.slogdet(transforms[:, :3, :3])[0] < 0
    flip = mirrored[source.loop_part()[loops[:, 0]]]
    return np.where(flip[:, None], loops[:, [0, 2, 1]], loops)


def normalising(points: NDArray, up: str, path: Path) -> NDArray[np.float64]:
    """The (4, 4) matrix that turns `up` to z, the longest bounding-box edge to 1 and its centre to the origin."""
    turned = transform_points(Y_UP_TO_WORLD if up == "y" else Z_UP_TO_WORLD, points)
    low, high = turned.min(0), turned.max(0)
    extent = float((high - low).max())
    if extent <= 0:
        raise InputError(f"{path}: all its vertices are one point; expected a surface")
    matrix = np.eye(4)
    matrix[:3, 3] = -(low / 2 + high / 2)
    matrix[:3] /= extent
    return matrix @ (Y_UP_TO_WORLD if up == "y" else Z_UP_TO_WORLD)


def _weld(
    world: NDArray, used: NDArray, loops: NDArray, usable: NDArray, source: Source, to_world: NDArray, tolerance: float
) -> Working:
    points = world[used]
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    welded = np.full(len(world), -1)
    welded[used] = used[weld(points, tolerance * diagonal)]
    corners = welded[source.loop_vertex[loops]]
    repeats = (corners == np.roll(corners, 1, 1)).any(1) & usable
    flat = (altitude(world[corners]) <= FLAT) & usable & ~repeats
    twin = twins(corners, usable & ~repeats & ~flat)
    kept = usable & ~repeats & ~flat & (twin < 0)
    vertices, rows = np.unique(corners[kept], return_inverse=True)
    stand_in = _stand_ins(loops, corners, kept, twin, welded, source)
    findings = {
        "duplicate_vertices": len(used) - len(np.unique(welded[used])),
        "degenerate": int(repeats.sum()),
        "zero_area": int(flat.sum()),
        "duplicates": int((twin >= 0).sum()),
        "non_finite_faces": int((~usable).sum()),
    }
    triangles = rows.reshape(-1, 3).astype(np.int32)
    return Working(world[vertices], triangles, loops[kept], stand_in, to_world, findings)


def weld(points: NDArray, tolerance: float) -> NDArray[np.int64]:
    """For each point the first of those it is one with: (N,) rows.

    Points are one when a chain of steps of at most `tolerance` joins them. Where they crowd, those in one cell of half
    that size are merged first and stand for each other, so that the number of pairs stays within bounds.
    """
    near, inverse = np.unique(points, axis=0, return_inverse=True)
    if tolerance > 0:
        tree = cKDTree(near)
        if tree.count_neighbors(tree, tolerance) > _CROWD * len(near):
            cells = np.floor(points / (tolerance / 2)).astype(np.int64)
            _, first, inverse = np.unique(cells, axis=0, return_index=True, return_inverse=True)
            near = points[first]
            tree = cKDTree(near)
        group = components(len(near), tree.query_pairs(tolerance, output_type="ndarray"))
        inverse = group.astype(np.int64)[inverse.reshape(-1)]
    representative = np.full(int(inverse.max(initial=-1)) + 1, len(points))
    np.minimum.at(representative, inverse.reshape(-1), np.arange(len(points)))
    return representative[inverse.reshape(-1)]


def altitude(corners: NDArray) -> NDArray[np.float64]:
    """Height of triangles (F, 3, 3) over their longest edge, 0 for a point."""
    sides = np.roll(corners, -1, 1) - corners
    longest = np.sqrt((sides * sides).sum(-1).max(-1))
    doubled = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=-1)
    return np.divide(doubled, longest, out=np.zeros(len(corners)), where=longest > 0)


def twins(corners: NDArray, candidates: NDArray) -> NDArray[np.int64]:
    """For each triangle the earlier candidate on the same three vertices, in whatever order, or -1: (T,)."""
    rows = np.flatnonzero(candidates)
    _, first, inverse = np.unique(np.sort(corners[rows], 1), axis=0, return_index=True, return_inverse=True)
    original = rows[first[inverse.reshape(-1)]]
    result = np.full(len(corners), -1)
    result[rows] = np.where(original == rows, -1, original)
    return result


def _stand_ins(
    loops: NDArray, corners: NDArray, kept: NDArray, twin: NDArray, welded: NDArray, source: Source
) -> NDArray[np.int32]:
    """(L,) which working loop's UV each source loop takes: itself, its twin's, or one at the same welded vertex."""
    stand_in = np.full(len(source.loop_vertex), -1, np.int32)
    at_vertex = np.full(len(welded), -1, np.int32)
    at_vertex[corners[kept][::-1].reshape(-1)] = loops[kept][::-1].reshape(-1)
    position = welded[source.loop_vertex]
    stand_in[position >= 0] = at_vertex[position[position >= 0]]
    second = np.flatnonzero(twin >= 0)
    match = corners[second][:, :, None] == corners[twin[second]][:, None, :]
    stand_in[loops[second]] = np.take_along_axis(loops[twin[second]], match.argmax(-1), 1)
    stand_in[loops[kept]] = loops[kept]
    return stand_in
