"""Stanford PLY, ASCII and binary of both byte orders, with any elements and properties.

Read: positions, faces and triangle strips, vertex normals (nx, ny, nz), UVs per vertex (s, t; u, v; texture_u,
texture_v) or per corner (the list `texcoord` of MeshLab). Everything else, colours among it, is passed over.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.core.errors import InputError
from stages.prep.source import Part, Source, polygons
from stages.prep.text import numbers, plain

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8", "int64": "i8", "uint64": "u8",
}  # fmt: skip
_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))


@dataclass
class _Element:
    """One element of the header. properties: name -> (length type, or "" for a scalar; value type)."""

    name: str
    count: int
    properties: dict[str, tuple[str, str]] = field(default_factory=dict)

    def add(self, name: str, types: tuple[str, str]) -> None:
        """Append a property; one whose name is taken still has its place in the rows."""
        while name in self.properties:
            name += "_"
        self.properties[name] = types


@dataclass(frozen=True)
class _List:
    """A list property: lengths (N,) and all values one after another."""

    lengths: NDArray
    values: NDArray


_Columns = dict[str, NDArray | _List]


def read_ply(path: Path) -> Source:
    """Read a PLY file. Raises: InputError."""
    data = plain(path.read_bytes())
    kind, elements, body = _header(data, path)
    try:
        tables = _ascii(elements, data[body:]) if kind == "ascii" else _binary(elements, data[body:], kind)
    except (ValueError, IndexError, OverflowError):
        raise InputError(
            f"{path}: holds fewer or other values than its header announces; it is cut off, export it again"
        ) from None
    vertex, face = tables.get("vertex", {}), tables.get("face", {})
    if not {"x", "y", "z"} <= vertex.keys():
        raise InputError(f"{path}: its vertices have no x, y and z; expected a mesh")
    faces, texcoord = _corners(face), face.get("texcoord")
    if isinstance(texcoord, _List) and not np.array_equal(texcoord.lengths, 2 * faces.lengths):
        texcoord = None
    strips = _unrolled(_corners(tables.get("tristrips", {})).values)
    corners = _List(
        np.concatenate([faces.lengths, np.full(len(strips), 3)]), np.concatenate([faces.values, strips.reshape(-1)])
    )
    if len(corners.lengths) == 0:
        raise InputError(f"{path}: no faces; expected a mesh, not a point cloud")
    return _source(vertex, corners, texcoord, path)


def _corners(face: _Columns) -> _List:
    found = face.get("vertex_indices", face.get("vertex_index"))
    return found if isinstance(found, _List) else _List(np.zeros(0, np.int64), np.zeros(0, np.int64))


def _unrolled(strip: NDArray) -> NDArray[np.int64]:
    """Triangles (T, 3) of strips that -1 ends, every second one turned round; those without area only lead on."""
    strip = strip.astype(np.int64)
    i = np.arange(max(len(strip) - 2, 0))
    begin = np.maximum.accumulate(np.where(strip < 0, np.arange(1, len(strip) + 1), 0))[: len(i)]
    odd = (i - begin) % 2
    triangles = np.stack([strip[i], strip[i + 1 + odd], strip[i + 2 - odd]], -1)
    return triangles[(triangles >= 0).all(1) & (triangles != np.roll(triangles, 1, 1)).all(1)]


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
    if isinstance(texcoord, _List):  # faces come first, strips have none
        uv = texcoord.values.astype(np.float64).reshape(-1, 2)
        row = np.arange(len(kept), dtype=np.int32)
        loop_uv = np.where(row < len(uv), row, -1)[kept]
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
    """Format word, elements, and the offset of the body. Lines end as the first one does: with CR, LF or both."""
    first = re.match(rb"ply[ \t]*(\r\n|\r|\n)", data)
    ending = first[1] if first else b"\n"
    end = re.search(b"(?<=" + ending + rb")end_header[ \t]*(" + ending + rb"|$)", data)
    if not first or not end:
        raise InputError(f"{path}: has no complete PLY header; it is cut off or another kind of file, export it again")
    kind, elements = "", list[_Element]()
    try:
        for line in data[: end.start()].decode("latin-1").split(ending.decode()):
            words = line.split()
            if words[:1] == ["format"]:
                kind = words[1]
            elif words[:1] == ["element"]:
                elements.append(_Element(words[1], int(words[2])))
            elif words[:2] == ["property", "list"]:
                elements[-1].add(words[4], (_TYPES[words[2]], _TYPES[words[3]]))
            elif words[:1] == ["property"]:
                elements[-1].add(words[2], ("", _TYPES[words[1]]))
    except (IndexError, KeyError, ValueError):
        raise InputError(
            f"{path}: its PLY header has the line '{line[:60]}', which is not understood; export the mesh again"
        ) from None
    if kind not in ("ascii", "binary_little_endian", "binary_big_endian"):
        raise InputError(f"{path}: PLY format '{kind}', expected ascii or binary; export the mesh again")
    return kind, elements, end.end()


def _ascii(elements: list[_Element], body: bytes) -> dict[str, _Columns]:
    values = numbers(body.split())
    tables, offset = {}, 0
    for element in elements:
        tables[element.name], offset = _rows(element, values, offset)
    return tables


def _rows(element: _Element, values: NDArray, offset: int) -> tuple[_Columns, int]:
    """Cut one element's rows from a flat array in which every value takes one place."""
    scalars: dict[str, list] = {name: [] for name, (length, _) in element.properties.items() if not length}
    lists: dict[str, list] = {name: [] for name, (length, _) in element.properties.items() if length}
    if not lists:
        width = len(element.properties)
        table = values[offset : offset + element.count * width].reshape(element.count, width)
        return {name: table[:, i] for i, name in enumerate(element.properties)}, offset + table.size
    for _ in range(element.count):
        for name in element.properties:
            if name in scalars:
                scalars[name].append(values[offset])
                offset += 1
            else:
                n = _length(values[offset])
                lists[name].append(values[offset + 1 : offset + 1 + n])
                offset += 1 + n
    if offset > len(values):
        raise ValueError("cut off")
    return _columns(scalars, lists), offset


def _length(value: np.generic) -> int:
    """The length of a list, of whatever type. Raises: ValueError."""
    length = int(value)
    if length < 0:
        raise ValueError("negative")
    return length


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
    if not fields:
        return {}, offset
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
                n = _length(np.frombuffer(body, length, 1, offset)[0])
                lists[name].append(np.frombuffer(body, value, n, offset + length.itemsize))
                offset += length.itemsize + n * value.itemsize
    return _columns(scalars, lists), offset
