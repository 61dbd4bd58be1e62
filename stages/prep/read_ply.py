"""Stanford PLY, ASCII and binary of both byte orders, with any elements and properties.

Read: positions, vertex normals (nx, ny, nz), UVs per vertex (s, t; u, v; texture_u, texture_v) or per corner (the
list `texcoord` of MeshLab). Everything else, colours among it, is passed over.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.core.errors import InputError
from stages.prep.source import Part, Source, polygons

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))


@dataclass
class _Element:
    """One element of the header. properties: name -> (length type, or "" for a scalar; value type)."""

    name: str
    count: int
    properties: dict[str, tuple[str, str]] = field(default_factory=dict)


@dataclass(frozen=True)
class _List:
    """A list property: lengths (N,) and all values one after another."""

    lengths: NDArray
    values: NDArray


_Columns = dict[str, NDArray | _List]


def read_ply(path: Path) -> Source:
    """Read a PLY file. Raises: InputError."""
    data = path.read_bytes()
    kind, elements, body = _header(data, path)
    try:
        tables = _ascii(elements, data[body:]) if kind == "ascii" else _binary(elements, data[body:], kind)
    except (ValueError, IndexError):
        raise InputError(
            f"{path}: holds fewer or other values than its header announces; it is cut off, export it again"
        ) from None
    vertex, face = tables.get("vertex", {}), tables.get("face", {})
    if not {"x", "y", "z"} <= vertex.keys():
        raise InputError(f"{path}: its vertices have no x, y and z; expected a mesh")
    corners = face.get("vertex_indices", face.get("vertex_index"))
    if not isinstance(corners, _List) or len(corners.lengths) == 0:
        raise InputError(f"{path}: no faces; expected a mesh, not a point cloud")
    return _source(vertex, corners, face.get("texcoord"), path)


def _source(vertex: _Columns, faces: _List, texcoord: NDArray | _List | None, path: Path) -> Source:
    positions = _stack(vertex, ("x", "y", "z"), np.float64)
    whole = faces.lengths >= 3
    kept = np.repeat(whole, faces.lengths)
    start, loop_vertex = polygons(faces.lengths[whole], len(positions), faces.values[kept].astype(np.int64), path)
    none = np.full(len(loop_vertex), -1, np.int32)
    normals, loop_normal = np.zeros((0, 3), np.float32), none
    if {"nx", "ny", "nz"} <= vertex.keys():
        normals, loop_normal = _stack(vertex, ("nx", "ny", "nz"), np.float32), loop_vertex
    uv, loop_uv = np.zeros((0, 2)), none
    names = next((names for names in _UV_NAMES if set(names) <= vertex.keys()), None)
    if isinstance(texcoord, _List) and np.array_equal(texcoord.lengths, 2 * faces.lengths):
        uv = texcoord.values.astype(np.float64).reshape(-1, 2)[kept]
        loop_uv = np.arange(len(uv), dtype=np.int32)
    elif names:
        uv, loop_uv = _stack(vertex, names, np.float64), loop_vertex
    skipped = {"faces_with_fewer_than_3_corners": int((~whole).sum())} if not whole.all() else {}
    face_part = np.zeros(len(start) - 1, np.int32)
    return Source(
        "ply", positions, uv, normals, start, loop_vertex, loop_uv, loop_normal, face_part, [Part(path.stem)],
        skipped=skipped,
    )  # fmt: skip


def _stack(columns: _Columns, names: tuple[str, ...], dtype: type) -> NDArray:
    with np.errstate(over="ignore"):
        return np.stack([np.asarray(columns[name]).astype(dtype) for name in names], -1)


def _header(data: bytes, path: Path) -> tuple[str, list[_Element], int]:
    """Format word, elements, and the offset of the body."""
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        raise InputError(f"{path}: has no complete PLY header; it is cut off or another kind of file")
    kind, elements = "", list[_Element]()
    try:
        for line in data[:end].decode("latin-1").splitlines():
            words = line.split()
            if words[:1] == ["format"]:
                kind = words[1]
            elif words[:1] == ["element"]:
                elements.append(_Element(words[1], int(words[2])))
            elif words[:2] == ["property", "list"]:
                elements[-1].properties[words[4]] = (_TYPES[words[2]], _TYPES[words[3]])
            elif words[:1] == ["property"]:
                elements[-1].properties[words[2]] = ("", _TYPES[words[1]])
    except (IndexError, KeyError, ValueError):
        raise InputError(f"{path}: its PLY header has the line '{line[:60]}', which is not understood") from None
    if kind not in ("ascii", "binary_little_endian", "binary_big_endian"):
        raise InputError(f"{path}: PLY format '{kind}', expected ascii or binary")
    body = data.index(b"\n", end) + 1 if b"\n" in data[end:] else len(data)
    return kind, elements, body


def _ascii(elements: list[_Element], body: bytes) -> dict[str, _Columns]:
    numbers = np.array(body.split(), dtype="S").astype(np.float64)
    tables, offset = {}, 0
    for element in elements:
        tables[element.name], offset = _rows(element, numbers, offset)
    return tables


def _rows(element: _Element, numbers: NDArray, offset: int) -> tuple[_Columns, int]:
    """Cut one element's rows from a flat array in which every value takes one place."""
    scalars: dict[str, list] = {name: [] for name, (length, _) in element.properties.items() if not length}
    lists: dict[str, list] = {name: [] for name, (length, _) in element.properties.items() if length}
    if not lists:
        width = len(element.properties)
        table = numbers[offset : offset + element.count * width].reshape(element.count, width)
        return {name: table[:, i] for i, name in enumerate(element.properties)}, offset + table.size
    for _ in range(element.count):
        for name in element.properties:
            if name in scalars:
                scalars[name].append(numbers[offset])
                offset += 1
            else:
                n = int(numbers[offset])
                lists[name].append(numbers[offset + 1 : offset + 1 + n])
                offset += 1 + n
    if offset > len(numbers):
        raise ValueError("cut off")
    return _columns(scalars, lists), offset


def _columns(scalars: dict[str, list], lists: dict[str, list]) -> _Columns:
    columns: _Columns = {name: np.array(values) for name, values in scalars.items()}
    for name, rows in lists.items():
        lengths = np.array([len(row) for row in rows], np.int64)
        columns[name] = _List(lengths, np.concatenate(rows) if rows else np.zeros(0))
    return columns


def _binary(elements: list[_Element], body: bytes, kind: str) -> dict[str, _Columns]:
    order = "<" if kind == "binary_little_endian" else ">"
    tables, offset = {}, 0
    for element in elements:
        uniform = _uniform_rows(element, body, offset, order)
        tables[element.name], offset = uniform or _ragged_rows(element, body, offset, order)
    return tables


def _uniform_rows(element: _Element, body: bytes, offset: int, order: str) -> tuple[_Columns, int] | None:
    """All rows at once when every list is as long as in the first row; otherwise None."""
    first, _ = _ragged_rows(_Element(element.name, min(element.count, 1), element.properties), body, offset, order)
    fields: list[tuple] = []
    for name, (length, value) in element.properties.items():
        if length:
            column = first[name]
            assert isinstance(column, _List)
            n = int(column.lengths[0]) if len(column.lengths) else 0
            fields += [(f"{name} length", order + length), (name, order + value, (n,))]
        else:
            fields.append((name, order + value))
    dtype = np.dtype(fields)
    if offset + dtype.itemsize * element.count > len(body):
        return None
    table = np.frombuffer(body, dtype, element.count, offset)
    columns: _Columns = {}
    for name, (length, _) in element.properties.items():
        if length:
            lengths = table[f"{name} length"].astype(np.int64)
            if (lengths != table[name].shape[1]).any():
                return None
            columns[name] = _List(lengths, table[name].reshape(-1))
        else:
            columns[name] = table[name]
    return columns, offset + dtype.itemsize * element.count


def _ragged_rows(element: _Element, body: bytes, offset: int, order: str) -> tuple[_Columns, int]:
    """Row by row, for lists of unequal lengths."""
    scalars: dict[str, list] = {name: [] for name, (length, _) in element.properties.items() if not length}
    lists: dict[str, list] = {name: [] for name, (length, _) in element.properties.items() if length}
    dtypes = {name: (np.dtype(order + (a or "u1")), np.dtype(order + b)) for name, (a, b) in element.properties.items()}
    for _ in range(element.count):
        for name, (length, value) in dtypes.items():
            if name in scalars:
                scalars[name].append(np.frombuffer(body, value, 1, offset)[0])
                offset += value.itemsize
            else:
                n = int(np.frombuffer(body, length, 1, offset)[0])
                lists[name].append(np.frombuffer(body, value, n, offset + length.itemsize))
                offset += length.itemsize + n * value.itemsize
    return _columns(scalars, lists), offset
