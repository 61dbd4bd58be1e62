"""STL, binary and ASCII. A soup of triangles: every corner is a vertex of its own; facet normals are passed over."""

import re
from pathlib import Path

import numpy as np

from stages.core.errors import InputError
from stages.prep.source import Part, Source, polygons

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = 84  # bytes before the first facet; the last four hold the count


def read_stl(path: Path) -> Source:
    """Read an STL file. Raises: InputError."""
    data = path.read_bytes()
    count = int.from_bytes(data[80:84], "little") if len(data) >= _HEADER else 0
    if len(data) >= _HEADER and len(data) - _HEADER >= count * _FACET.itemsize > 0:
        corners = np.frombuffer(data, _FACET, count, _HEADER)["corners"].reshape(-1, 3).astype(np.float64)
    else:
        corners = _ascii(data, count, path)
    lengths = np.full(len(corners) // 3, 3)
    start, loop_vertex = polygons(lengths, len(corners), np.arange(len(corners)), path)
    none = np.full(len(corners), -1, np.int32)
    return Source(
        "stl", corners, np.zeros((0, 2)), np.zeros((0, 3), np.float32), start, loop_vertex, none, none,
        np.zeros(len(lengths), np.int32), [Part(path.stem)],
    )  # fmt: skip


def _ascii(data: bytes, count: int, path: Path) -> np.ndarray:
    words = re.findall(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", data, re.IGNORECASE)
    if not data.lstrip()[:5].lower() == b"solid" or not words:
        raise InputError(
            f"{path}: {len(data)} bytes, neither ASCII STL with facets nor binary STL with the {count} facets "
            "its header announces; it is empty, cut off or another kind of file"
        )
    if len(words) % 3:
        raise InputError(f"{path}: {len(words)} corners are not whole triangles; the file is cut off, export it again")
    try:
        return np.array(words, dtype="S").astype(np.float64)
    except ValueError:
        raise InputError(f"{path}: a vertex is not made of three numbers; export the mesh again") from None
