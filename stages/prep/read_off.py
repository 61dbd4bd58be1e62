"""Object File Format (OFF) in text form, with the prefixes ST (UVs), C (colours) and N (normals)."""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.core.errors import InputError
from stages.prep.source import Part, Source, polygons


def read_off(path: Path) -> Source:
    """Read an OFF file. Raises: InputError."""
    text = path.read_bytes().decode("latin-1")
    lines = [words for line in text.splitlines() if (words := line.split("#")[0].split())]
    match = re.fullmatch(r"(ST)?(C)?(N)?OFF", lines[0][0]) if lines else None
    if not match or "BINARY" in lines[0]:
        found = lines[0][0][:20] if lines else "nothing"
        raise InputError(f"{path}: begins with '{found}', expected OFF, COFF, NOFF or STOFF in text form")
    rest = [lines[0][1:], *lines[1:]] if len(lines[0]) > 1 else lines[1:]
    try:
        vertices, faces = int(rest[0][0]), int(rest[0][1])
        table = [[float(word) for word in words] for words in rest[1 : 1 + vertices]]
        rows = [[int(word) for word in words[: 1 + int(words[0])]] for words in rest[1 + vertices :][:faces]]
        if len(table) < vertices or len(rows) < faces or any(len(row) != 1 + row[0] for row in rows):
            raise ValueError
        positions = np.array([row[:3] for row in table], np.float64).reshape(vertices, 3)
    except (ValueError, IndexError):
        raise InputError(f"{path}: holds fewer or other values than its counts announce; it is cut off") from None
    normals, uv = _attributes(table, bool(match[3]), bool(match[1]))
    return _source(positions, normals, uv, [row[1:] for row in rows], path)


def _attributes(table: list[list[float]], has_normals: bool, has_uv: bool) -> tuple[NDArray, NDArray]:
    """Normals follow the position; UVs are the last two numbers of a row."""
    rows = [row for row in table if len(row) >= 3 + 3 * has_normals + 2 * has_uv]
    if len(rows) < len(table):
        return np.zeros((0, 3), np.float32), np.zeros((0, 2))
    normals = np.array([row[3:6] for row in rows], np.float32) if has_normals else np.zeros((0, 3), np.float32)
    return normals, np.array([row[-2:] for row in rows], np.float64) if has_uv else np.zeros((0, 2))


def _source(positions: NDArray, normals: NDArray, uv: NDArray, faces: list[list[int]], path: Path) -> Source:
    whole = [face for face in faces if len(face) >= 3]
    skipped = {"faces_with_fewer_than_3_corners": len(faces) - len(whole)} if len(whole) < len(faces) else {}
    lengths = np.array([len(face) for face in whole], np.int64)
    corners = np.array([corner for face in whole for corner in face], np.int64)
    start, loop_vertex = polygons(lengths, len(positions), corners, path)
    none = np.full(len(loop_vertex), -1, np.int32)
    return Source(
        "off", positions, uv, normals, start, loop_vertex, loop_vertex if len(uv) else none,
        loop_vertex if len(normals) else none, np.zeros(len(whole), np.int32), [Part(path.stem)], skipped=skipped,
    )  # fmt: skip
