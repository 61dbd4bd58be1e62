"""Meshes on nodes, as scene formats with polygons have them (FBX, USD), joined to one source.

Their frame is glTF's: right-handed, +y up, metres; what the file says of its axes and units is in the transforms.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.prep.source import Part, Source, check_range, polygons

Indexed = tuple[NDArray, NDArray]
"""Values (N, k) and the row of each corner (L,)."""


@dataclass(frozen=True)
class Piece:
    """One mesh on one node.

    transform: (4, 4) to the source frame. positions: (N, 3). lengths: (P,) corners of each face; corner: (L,) their
    vertices. face_material: (P,) rows of materials. normals, uv: per corner, uv by set.
    """

    name: str
    node: str
    transform: NDArray[np.float64]
    positions: NDArray[np.float64]
    lengths: NDArray[np.int64]
    corner: NDArray[np.int64]
    materials: list[str]
    face_material: NDArray[np.int64]
    normals: Indexed | None = None
    uv: list[Indexed] = field(default_factory=list)


def joined(kind: str, pieces: list[Piece], skipped: dict[str, int], applied: dict[str, int], path: Path) -> Source:
    """The source whose parts are the material slots of each piece. Raises: InputError."""
    pieces = [_whole_faces(piece, skipped, path) for piece in pieces]
    first = np.cumsum([0, *(len(piece.positions) for piece in pieces)])
    corner = [piece.corner + start for piece, start in zip(pieces, first[:-1], strict=True)]
    none = np.zeros(0, np.int64)
    lengths = np.concatenate([none, *(piece.lengths for piece in pieces)])
    start, loop_vertex = polygons(lengths, int(first[-1]), np.concatenate([none, *corner]), path)
    parts, face_part = _parts(pieces)
    normals, loop_normal = _stacked([piece.normals for piece in pieces], pieces, 3)
    sets = range(max((len(piece.uv) for piece in pieces), default=0) or 1)
    (uv, loop_uv), *more = [
        _stacked([piece.uv[k] if k < len(piece.uv) else None for piece in pieces], pieces, 2) for k in sets
    ]
    return Source(
        kind, np.concatenate([np.zeros((0, 3)), *(piece.positions for piece in pieces)]), uv, normals.astype(np.float32),
        start, loop_vertex, loop_uv, loop_normal, face_part, parts, skipped=skipped, applied=applied, more_uv=more,
    )  # fmt: skip


def _whole_faces(piece: Piece, skipped: dict[str, int], path: Path) -> Piece:
    """The piece without faces of one or two corners, which are counted. Raises: InputError for what points nowhere."""
    if int(piece.lengths.sum()) != len(piece.corner) or (piece.lengths < 0).any():
        raise ValueError(f"{piece.name} has {len(piece.corner)} corners, its faces {int(piece.lengths.sum())}")
    check_range(piece.corner, len(piece.positions), "vertex", path)
    kept = piece.lengths >= 3
    if kept.all():
        return piece
    skipped["faces_with_fewer_than_3_corners"] = skipped.get("faces_with_fewer_than_3_corners", 0) + int((~kept).sum())
    corners = np.repeat(kept, piece.lengths)

    def fewer(values: Indexed) -> Indexed:
        return values[0], values[1][corners]

    return Piece(
        piece.name, piece.node, piece.transform, piece.positions, piece.lengths[kept], piece.corner[corners],
        piece.materials, piece.face_material[kept], fewer(piece.normals) if piece.normals else None,
        [fewer(values) for values in piece.uv],
    )  # fmt: skip


def _parts(pieces: list[Piece]) -> tuple[list[Part], NDArray[np.int32]]:
    """One part for each material slot that a piece uses, and the part of each face."""
    parts: list[Part] = []
    of_face = [np.zeros(0, np.int64)]
    for piece in pieces:
        used, row = np.unique(piece.face_material, return_inverse=True)
        of_face.append(row.reshape(-1) + len(parts))
        flat = tuple(float(x) for x in piece.transform.reshape(-1))
        slots = [piece.materials[slot] if 0 <= slot < len(piece.materials) else "" for slot in used]
        parts += [Part(piece.name, material, piece.node, flat) for material in slots]
    return parts, np.concatenate(of_face).astype(np.int32)


def _stacked(values: list[Indexed | None], pieces: list[Piece], width: int) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """All values one after another, and the row of each corner, -1 where a piece has none or points nowhere."""
    table, rows, count = [np.zeros((0, width))], [np.zeros(0, np.int64)], 0
    for piece, entry in zip(pieces, values, strict=True):
        if entry is None or len(entry[1]) != len(piece.corner):
            rows.append(np.full(len(piece.corner), -1))
            continue
        inside = (entry[1] >= 0) & (entry[1] < len(entry[0]))
        rows.append(np.where(inside, entry[1] + count, -1))
        table.append(np.asarray(entry[0], np.float64))
        count += len(entry[0])
    return np.concatenate(table), np.concatenate(rows).astype(np.int32)
