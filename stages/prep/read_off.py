"""Object File Format (OFF) in text form, with the prefixes ST (UVs), C (colours) and N (normals)."""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.core.errors import InputError
from stages.prep.source import Part, Source, polygons
from stages.prep.text import name, numbers, plain, uncommented


def read_off(path: Path) -> Source:
    """Read an OFF file. Raises: InputError."""
    lines = [words for line in plain(path.read_bytes()).splitlines() if (words := uncommented(line).split())]
    kind, rest = _keyword(lines, path)
    try:
        while len(rest) > 1 and min(len(rest[0]), len(rest[1])) < 2:  # counts on lines of their own
            rest = [rest[0] + rest[1], *rest[2:]]
        vertices, faces = int(rest[0][0]), int(rest[0][1])
        table = [_floats(words) for words in rest[1 : 1 + vertices]]
        rows = [[int(word) for word in words[: 1 + int(words[0])]] for words in rest[1 + vertices :][:faces]]
        if len(table) < vertices or len(rows) < faces or any(len(row) != 1 + row[0] for row in rows):
            raise ValueError
        positions = np.array([row[:3] for row in table], np.float64).reshape(vertices, 3)
    except (ValueError, IndexError):
        raise InputError(
            f"{path}: holds fewer or other values than its counts announce; it is cut off, export it again"
        ) from None
    normals, uv = _attributes(table, bool(kind[3]), bool(kind[1]))
    return _source(positions, normals, uv, [row[1:] for row in rows], path)


def _keyword(lines: list[list[bytes]], path: Path) -> tuple[re.Match[bytes], list[list[bytes]]]:
    """The first word, which may be missing or run into the counts, and the lines after it."""
    first = lines[0] if lines else [b"nothing"]
    counts_only = len(first) in (2, 3) and all(word.isdigit() for word in first)
    match = re.fullmatch(rb"(ST)?(C)?(N)?OFF(\d*)", b"OFF" if counts_only else first[0])
    if not match or b"BINARY" in first:
        raise InputError(f"{path}: begins with '{name(first[0][:20])}', expected OFF, COFF, NOFF or STOFF in text form")
    counts = first if counts_only else [word for word in (match[4], *first[1:]) if word]
    return match, [counts, *lines[1:]]


def _floats(words: list[bytes]) -> list[float]:
    try:
        return list(map(float, words))
    except ValueError:  # what stands for not-a-number, or a word where none belongs
        return numbers(words).tolist()


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
