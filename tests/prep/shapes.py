"""Small meshes made in the test, as arrays and as files."""

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

CUBE_QUADS = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (2, 3, 7, 6), (1, 2, 6, 5), (3, 0, 4, 7)]


def cube_corners() -> NDArray[np.float64]:
    """(8, 3) corners of the unit cube, bottom (z = 0) first."""
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    return np.array([(x, y, z) for z in (0, 1) for x, y in square], np.float64)


def cube() -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """The unit cube, 12 outward triangles."""
    triangles = [(q[0], q[k], q[k + 1]) for q in CUBE_QUADS for k in (1, 2)]
    return cube_corners(), np.array(triangles, np.int32)


def sphere(rows: int = 12, columns: int = 24) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """A closed latitude-longitude sphere of radius 1, outward."""
    theta = np.linspace(0, np.pi, rows + 1)[1:-1]
    phi = np.arange(columns) / columns * 2 * np.pi
    ring = [(np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)) for t in theta for p in phi]
    vertices = np.array([*ring, (0, 0, 1), (0, 0, -1)])
    north, south = len(ring), len(ring) + 1
    triangles = []
    for c in range(columns):
        d = (c + 1) % columns
        triangles += [(north, c, d), (south, (rows - 2) * columns + d, (rows - 2) * columns + c)]
        for r in range(rows - 2):
            a, b = r * columns, (r + 1) * columns
            triangles += [(a + c, b + c, b + d), (a + c, b + d, a + d)]
    return vertices, np.array(triangles, np.int32)


def moebius(count: int = 12) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """A band with one twist: it cannot be wound consistently."""
    angle = np.arange(count) / count * 2 * np.pi
    rows = []
    for side in (-0.3, 0.3):
        radius = 1 + side * np.cos(angle / 2)
        rows.append(np.stack([radius * np.cos(angle), radius * np.sin(angle), side * np.sin(angle / 2)], -1))
    triangles = []
    for i in range(count):
        j = (i + 1) % count
        a, b = i, i + count
        c, d = (j, j + count) if j else (count, 0)  # the seam joins either side to the other
        triangles += [(a, b, c), (b, d, c)]
    return np.concatenate(rows), np.array(triangles, np.int32)


def write_obj(path: Path, vertices: NDArray, faces: Any, uv: NDArray | None = None) -> Path:
    """An OBJ with one UV per vertex where given."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(vertices, np.float64).tolist()]
    lines += [f"vt {u!r} {v!r}" for u, v in (np.asarray(uv).tolist() if uv is not None else [])]
    corner = "{0}/{0}" if uv is not None else "{0}"
    lines += ["f " + " ".join(corner.format(int(i) + 1) for i in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")
    return path


class GltfBuilder:
    """Collects accessors and writes them as .glb or as .gltf with a data URI."""

    def __init__(self) -> None:
        self.data = b""
        self.root: dict[str, Any] = {
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [], "meshes": [],
            "accessors": [], "bufferViews": [],
        }  # fmt: skip

    def accessor(self, values: NDArray, kind: str, stride: int | None = None, normalized: bool = False) -> int:
        """Store rows, `stride` bytes apart, and return the accessor's index."""
        values = np.ascontiguousarray(values)
        rows = values.reshape(len(values), -1)
        size = rows.dtype.itemsize * rows.shape[1]
        packed = b"".join(row.tobytes().ljust(stride or size, b"\xff") for row in rows)
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(packed)}
        if stride:
            view["byteStride"] = stride
        self.data += packed.ljust(-(-len(packed) // 4) * 4, b"\0")
        self.root["bufferViews"].append(view)
        codes = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}
        entry = {"bufferView": len(self.root["bufferViews"]) - 1, "componentType": codes[values.dtype.name],
                 "count": len(values), "type": kind, "normalized": normalized}  # fmt: skip
        self.root["accessors"].append(entry)
        return len(self.root["accessors"]) - 1

    def mesh(self, primitives: list[dict[str, Any]], **node: Any) -> None:
        """Add a mesh on a node of its own."""
        self.root["meshes"].append({"primitives": primitives})
        self.root["nodes"].append({"mesh": len(self.root["meshes"]) - 1, **node})

    def write(self, path: Path) -> Path:
        """Write .glb or .gltf, by the path's suffix."""
        buffer: dict[str, Any] = {"byteLength": len(self.data)}
        if path.suffix == ".gltf":
            buffer["uri"] = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        text = json.dumps(self.root | {"buffers": [buffer]}).encode()
        if path.suffix == ".gltf":
            path.write_bytes(text)
            return path
        text = text.ljust(-(-len(text) // 4) * 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(self.data), b"BIN\0") + self.data
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
        return path
