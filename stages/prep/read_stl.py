"""STL, binary and ASCII. A soup of triangles: every corner is a vertex of its own; facet normals are passed over.

A binary file whose header announces fewer facets than fill it, or leaves the count blank, is read to its end; what is
beyond the announced ones, or no facet, is counted.
"""

import re
from pathlib import Path

import numpy as np

from stages.core.errors import InputError
from stages.prep.source import Part, Source, polygons
from stages.prep.text import numbers, plain

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = 84  # bytes before the first facet; the last four hold the count
_BLANK = 2**32 - 1  # a count that the writer never came back to fill in


def read_stl(path: Path) -> Source:
    """Read an STL file. Raises: InputError."""
    data = path.read_bytes()
    count, skipped = _facets(data)
    if count:
        corners = np.frombuffer(data, _FACET, count, _HEADER)["corners"].reshape(-1, 3).astype(np.float64)
    else:
        corners = _ascii(data, path)
    lengths = np.full(len(corners) // 3, 3)
    start, loop_vertex = polygons(lengths, len(corners), np.arange(len(corners)), path)
    none = np.full(len(corners), -1, np.int32)
    return Source(
        "stl", corners, np.zeros((0, 2)), np.zeros((0, 3), np.float32), start, loop_vertex, none, none,
        np.zeros(len(lengths), np.int32), [Part(path.stem)], skipped=skipped,
    )  # fmt: skip


def _facets(data: bytes) -> tuple[int, dict[str, int]]:
    """How many facets a binary file has, 0 for another kind of file, and what does not agree with its header."""
    room, rest = divmod(len(data) - _HEADER, _FACET.itemsize)
    announced = int.from_bytes(data[80:84], "little")
    if announced == _BLANK and rest == 0:
        announced = room
    if room < 1 or announced > room or (announced == 0 and _is_text(data)):
        return 0, {}
    if announced < room and rest == 0:
        return room, {"facets_beyond_the_announced": room - announced}
    if announced == room:
        return room, {}
    return announced, {"bytes_after_the_last_facet": len(data) - _HEADER - announced * _FACET.itemsize}


def _is_text(data: bytes) -> bool:
    return data.lstrip()[:5].lower() == b"solid"


def _ascii(data: bytes, path: Path) -> np.ndarray:
    text = plain(data)
    words = re.findall(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", text, re.IGNORECASE)
    if not _is_text(text) or not words:
        announced = int.from_bytes(data[80:84], "little")
        raise InputError(
            f"{path}: {len(data)} bytes, neither ASCII STL with facets nor binary STL with the {announced} facets "
            "its header announces; it is empty, cut off or another kind of file, export it again"
        )
    if len(words) % 3:
        raise InputError(f"{path}: {len(words)} corners are not whole triangles; the file is cut off, export it again")
    corners = numbers([word for row in words for word in row])
    if len(corners) < 3 * len(words):
        raise InputError(f"{path}: a vertex is not made of three numbers; export the mesh again")
    return corners.reshape(-1, 3)
