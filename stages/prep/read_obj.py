"""Wavefront OBJ. Faces keep their polygons; a part is one object (or group) with one material.

Read: v (extra numbers such as colours are ignored), vt with one to three numbers, vn, f in all four forms with
negative indices, o, g, usemtl, comments, lines continued with a backslash. Counted and left out: lines, points, curves.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.core.errors import InputError
from stages.prep.source import Part, Source, check_range, polygons

_IGNORED = {b"mtllib", b"s", b"vp", b"mg", b"lod", b"shadow_obj", b"trace_obj", b"bevel", b"c_interp", b"d_interp"}


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
    for line in data.removeprefix(b"\xef\xbb\xbf").replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines():
        words = line.split()
        if not words or words[0].startswith(b"#"):
            continue
        keyword = words[0]
        if keyword in content.rows:
            content.rows[keyword].append(words[1:])
        elif keyword == b"f":
            if part < 0:
                part = content.parts.setdefault((names[b"o"], names[b"g"], names[b"usemtl"]), len(content.parts))
            _add_face(content, words[1:], part)
        elif keyword in names:
            names[keyword] = b" ".join(words[1:]).decode("utf-8", "replace")
            part = -1
        elif keyword not in _IGNORED:
            kind = {b"l": "lines", b"p": "points"}.get(keyword, "other_statements")
            content.skipped[kind] = content.skipped.get(kind, 0) + 1
    return content


def _add_face(content: _Content, corners: list[bytes], part: int) -> None:
    if b"#" in corners:
        corners = corners[: corners.index(b"#")]
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


def _row(row: list[bytes], width: int, least: int, keyword: str, path: Path) -> list[float]:
    """One row number by number: what is written for not-a-number by some compilers is taken as such."""
    text = " ".join([keyword, *(word.decode("utf-8", "replace") for word in row)])
    if len(row) < least:
        raise InputError(
            f"{path}: '{text[:60]}' has {len(row)} numbers, expected {width}; the file is damaged or cut off"
        )
    values = []
    for word in [*row[:width], b"0"][:width]:
        try:
            values.append(float(word))
        except ValueError:
            if b"#" not in word and b"nan" not in word.lower():
                raise InputError(f"{path}: '{text[:60]}' is not made of numbers; export the mesh again") from None
            values.append(float("nan"))
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
            wrong = next(word for word in words if not word.lstrip(b"+-").isdigit()).decode("utf-8", "replace")
            raise InputError(f"{path}: a face has the corner '{wrong[:40]}', expected whole numbers") from None
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
    unique = list(dict.fromkeys(nodes))
    to_unique = np.array([unique.index(node) for node in nodes], np.int32)
    parts = [Part(name or stem, material, name if by_object else "") for name, material in unique]
    return to_unique[np.array(content.face_part, np.int32)], parts


def _groups(content: _Content) -> tuple[NDArray[np.int32], list[str]]:
    """The group of each face, -1 for none, and the groups' names."""
    of_key = [group for _, group, _ in content.parts]
    names = list(dict.fromkeys(group for group in of_key if group))
    numbers = np.array([names.index(group) if group else -1 for group in of_key], np.int32)
    return numbers[np.array(content.face_part, np.int32)], names
