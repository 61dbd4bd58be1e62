"""Wavefront OBJ. Faces keep their polygons; a part is one object (or group) with one material.

Read: v (extra numbers such as colours are ignored), vt with one to three numbers, vn, f in all four forms with
negative indices, o, g, usemtl, comments, lines continued with a backslash; any Unicode encoding. Counted and left out:
lines, points, curves.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.core.errors import InputError
from stages.prep import text
from stages.prep.source import Part, Source, check_range, polygons

_IGNORED = {b"mtllib", b"s", b"vp", b"mg", b"lod", b"shadow_obj", b"trace_obj", b"bevel", b"c_interp", b"d_interp"}
_STATEMENTS = _IGNORED | {b"v", b"vt", b"vn", b"f", b"o", b"g", b"usemtl", b"l", b"p", b"#"}


@dataclass
class _Content:
    """What the lines of the file say, before any number is parsed."""

    rows: dict[bytes, list[list[bytes]]] = field(default_factory=lambda: {b"v": [], b"vt": [], b"vn": []})
    corners: list[bytes] = field(default_factory=list)
    lengths: list[int] = field(default_factory=list)
    counts: list[tuple[int, int, int]] = field(default_factory=list)  # v, vt, vn seen before each face
    face_part: list[int] = field(default_factory=list)
    parts: dict[tuple[str, str, str], int] = field(default_factory=dict)  # object, group, material
    skipped: dict[str, int] = field(default_factory=dict)


def read_obj(path: Path) -> Source:
    """Read an OBJ file. Raises: InputError."""
    content = _scan(path.read_bytes())
    vertices = _numbers(content.rows[b"v"], 3, "v", path)
    uv = _numbers(content.rows[b"vt"], 2, "vt", path)
    normals = _numbers(content.rows[b"vn"], 3, "vn", path)
    indices = _indices(content, (len(vertices), len(uv), len(normals)), path)
    start, loop_vertex = polygons(np.array(content.lengths, np.int64), len(vertices), indices[0], path)
    with np.errstate(over="ignore"):
        normals_single = normals.astype(np.float32)
    face_part, parts = _parts(content, path.stem)
    face_group, groups = _groups(content)
    return Source(
        "obj", vertices, uv, normals_single, start, loop_vertex, indices[1], indices[2], face_part, parts,
        skipped=content.skipped, face_group=face_group, groups=groups,
    )  # fmt: skip


def _scan(data: bytes) -> _Content:
    content = _Content()
    names = {b"o": "", b"g": "", b"usemtl": ""}
    part = -1
    for line in _lines(text.plain(data)):
        words = line.split()
        if not words or words[0].startswith(b"#"):
            continue
        keyword = words[0]
        if b"#" in line and keyword not in names:
            words = text.uncommented(line).split()
        if keyword in content.rows:
            content.rows[keyword].append(words[1:])
        elif keyword == b"f":
            if part < 0:
                part = content.parts.setdefault((names[b"o"], names[b"g"], names[b"usemtl"]), len(content.parts))
            _add_face(content, words[1:], part)
        elif keyword in names:
            names[keyword] = text.name(b" ".join(words[1:]))
            part = -1
        elif keyword not in _IGNORED:
            kind = {b"l": "lines", b"p": "points"}.get(keyword, "other_statements")
            content.skipped[kind] = content.skipped.get(kind, 0) + 1
    return content


def _lines(data: bytes) -> Iterator[bytes]:
    """The file's lines, joined where one ends in a backslash: not in a comment, and not before another statement."""
    pending = b""
    for line in data.splitlines():
        if pending:
            if (line.split(None, 1) or [b""])[0] in _STATEMENTS:
                yield pending
            else:
                line = pending + line
            pending = b""
        if line.endswith((b"\\", b"\\ ", b"\\\t")) and text.uncommented(line) is line:
            pending = line.rstrip()[:-1] + b" "
        else:
            yield line
    yield pending


def _add_face(content: _Content, corners: list[bytes], part: int) -> None:
    if len(corners) < 3:
        content.skipped["faces_with_fewer_than_3_corners"] = (
            content.skipped.get("faces_with_fewer_than_3_corners", 0) + 1
        )
        return
    content.corners += corners
    content.lengths.append(len(corners))
    content.counts.append((len(content.rows[b"v"]), len(content.rows[b"vt"]), len(content.rows[b"vn"])))
    content.face_part.append(part)


def _numbers(rows: list[list[bytes]], width: int, keyword: str, path: Path) -> NDArray[np.float64]:
    """The first `width` numbers of each row, (N, width); a vt with one number has v = 0."""
    least = 1 if keyword == "vt" else width
    try:
        if any(len(row) < least for row in rows):
            raise ValueError
        values = [(row[:width] + [b"0"])[:width] for row in rows]
        return np.array(values, dtype="S").astype(np.float64).reshape(-1, width)
    except ValueError:
        return np.array([_row(row, width, least, keyword, path) for row in rows], np.float64).reshape(-1, width)


def _row(row: list[bytes], width: int, least: int, keyword: str, path: Path) -> NDArray[np.float64]:
    """One row by itself, to take what stands for not-a-number as such or to say what is wrong."""
    line = text.name(b" ".join([keyword.encode(), *row]))[:60]
    if len(row) < least:
        raise InputError(f"{path}: '{line}' has {len(row)} numbers, expected {width}; damaged or cut off, export it again")
    values = text.numbers([*row[:width], b"0"][:width])
    if len(values) < width:
        raise InputError(f"{path}: '{line}' is not made of numbers; export the mesh again")
    return values


def _indices(content: _Content, sizes: tuple[int, int, int], path: Path) -> list[NDArray[np.int32]]:
    """Rows of v, vt and vn for each loop, (L,) each; -1 where a corner names none."""
    corners = [corner.split(b"/") for corner in content.corners]
    before = np.repeat(np.array(content.counts, np.int64).reshape(-1, 3), content.lengths, axis=0)
    result = []
    for column, (what, size) in enumerate(zip(("vertex", "texture coordinate", "normal"), sizes, strict=True)):
        words = [corner[column] if len(corner) > column and corner[column] else b"0" for corner in corners]
        try:
            number = np.array(words, dtype="S").astype(np.int64) if words else np.zeros(0, np.int64)
        except ValueError:
            wrong = text.name(next(word for word in words if not word.lstrip(b"+-").isdigit()))
            raise InputError(f"{path}: a face has the corner '{wrong[:40]}', expected whole numbers; export it again") from None
        row = np.where(number < 0, before[:, column] + number, number - 1)
        named = number != 0
        check_range(row if column == 0 else row[named], size, what, path)
        result.append(np.where(named, row, -1).astype(np.int32))
    return result


def _parts(content: _Content, stem: str) -> tuple[NDArray[np.int32], list[Part]]:
    """Parts by object and material; groups tell parts apart only in a file without objects, where parts have no node."""
    keys = list(content.parts)
    by_object = any(name for name, _, _ in keys)
    nodes = [(name if by_object else group, material) for name, group, material in keys]
    unique = {node: row for row, node in enumerate(dict.fromkeys(nodes))}
    to_unique = np.array([unique[node] for node in nodes], np.int32)
    parts = [Part(name or stem, material, name if by_object else "") for name, material in unique]
    return to_unique[np.array(content.face_part, np.int32)], parts


def _groups(content: _Content) -> tuple[NDArray[np.int32], list[str]]:
    """The group of each face, -1 for none, and the groups' names."""
    of_key = [group for _, group, _ in content.parts]
    rows = {group: row for row, group in enumerate(dict.fromkeys(filter(None, of_key)))}
    numbers = np.array([rows.get(group, -1) for group in of_key], np.int32)
    return numbers[np.array(content.face_part, np.int32)], list(rows)
