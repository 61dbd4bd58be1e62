"""glTF 2.0, as .glb and as .gltf with data URIs or files beside it: the geometry of the default scene, bit for bit, and
the textures of its materials that are not made anew.

Own reader, because general ones flip v and re-index vertices. Source: glTF 2.0 specification, sections 3.5 to 3.7. A
part is one primitive of one mesh on one node; vertices keep the order of their accessors, v = 0 is the top row.
Skins, morph targets and animations are counted and left out: the mesh is taken as stored.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.core.errors import InputError
from stages.prep.gltf_file import Gltf, buffer_bytes, open_gltf
from stages.prep.gltf_textures import material_name, pass_on
from stages.prep.source import Part, Source, check_range, polygons

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_POINTS, _TRIANGLES, _STRIP, _FAN = 0, 4, 5, 6


@dataclass
class _Geometry:
    """What is gathered while the scene is walked; arrays are joined at the end."""

    positions: list[NDArray] = field(default_factory=list)
    uv: list[NDArray] = field(default_factory=list)
    normals: list[NDArray] = field(default_factory=list)
    tangents: list[NDArray] = field(default_factory=list)
    corners: list[tuple[NDArray, ...]] = field(default_factory=list)  # vertex, uv, normal, tangent rows
    face_part: list[NDArray] = field(default_factory=list)
    parts: list[Part] = field(default_factory=list)
    skipped: dict[str, int] = field(default_factory=dict)
    blocks: dict[tuple, tuple[int, ...]] = field(default_factory=dict)  # (node, accessors) -> first rows

    def skip(self, what: str, count: int = 1) -> None:
        self.skipped[what] = self.skipped.get(what, 0) + count


def read_gltf(path: Path) -> Source:
    """Read a .glb or .gltf file. Raises: InputError."""
    gltf = open_gltf(path)
    try:
        geometry = _gather(gltf)
        passed_on, images = pass_on(gltf, geometry.skip)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise InputError(f"{path}: not valid glTF 2.0 ({type(error).__name__}: {error}); export it again") from None
    corners = [np.concatenate(rows) if rows else np.zeros(0, np.int64) for rows in zip(*geometry.corners, strict=True)]
    vertex, uv, normal, tangent = corners or [np.zeros(0, np.int64)] * 4
    positions = np.concatenate([np.zeros((0, 3)), *geometry.positions])
    start, loop_vertex = polygons(np.full(len(vertex) // 3, 3), len(positions), vertex, path)
    return Source(
        "glb", positions, np.concatenate([np.zeros((0, 2)), *geometry.uv]),
        np.concatenate([np.zeros((0, 3), np.float32), *geometry.normals]), start, loop_vertex, uv.astype(np.int32),
        normal.astype(np.int32), np.concatenate(geometry.face_part).astype(np.int32), geometry.parts, v_down=True,
        skipped=geometry.skipped, tangents=np.concatenate([np.zeros((0, 4), np.float32), *geometry.tangents]),
        loop_tangent=tangent.astype(np.int32), passed_on=passed_on, images=images,
    )  # fmt: skip


# ---------------------------------------------------------------------------------------------------- accessors


def _accessor(gltf: Gltf, index: int) -> NDArray:
    """An accessor's elements, (N, width), in the stored type; normalised integers become float32 (section 3.11)."""
    entry = gltf.item("accessors", index)
    dtype, width = np.dtype(_COMPONENTS[entry["componentType"]]), _WIDTHS[entry["type"]]
    count = entry["count"]
    if "bufferView" in entry:
        values = _view(gltf, entry["bufferView"], entry.get("byteOffset", 0), count, width, dtype)
    else:
        values = np.zeros((count, width), dtype)
    if "sparse" in entry:
        values = _sparse(gltf, entry["sparse"], values)
    if entry.get("normalized") and dtype.kind in "iu":
        scaled = values.astype(np.float64) / np.iinfo(dtype).max
        values = np.maximum(scaled, -1.0).astype(np.float32)
    return values


def _view(gltf: Gltf, index: int, offset: int, count: int, width: int, dtype: np.dtype) -> NDArray:
    """`count` rows of a buffer view, honouring its stride."""
    view = gltf.item("bufferViews", index)
    if "EXT_meshopt_compression" in view.get("extensions", {}) and "uri" not in gltf.item("buffers", view["buffer"]):
        raise InputError(
            f"{gltf.path}: needs the glTF extension EXT_meshopt_compression, which is not read; export without"
        )
    row = width * dtype.itemsize
    stride = view.get("byteStride") or row
    start = view.get("byteOffset", 0) + offset
    data = buffer_bytes(gltf, view["buffer"])
    if count < 0 or start < 0 or (count and start + stride * (count - 1) + row > len(data)):
        raise InputError(f"{gltf.path}: bufferViews[{index}] reaches past the end of its buffer; export it again")
    strided = np.ndarray((count, row), np.uint8, data, start, (stride, 1)) if count else np.zeros((0, row), np.uint8)
    return np.ascontiguousarray(strided).view(dtype).reshape(count, width)


def _sparse(gltf: Gltf, sparse: dict[str, Any], values: NDArray) -> NDArray:
    """Values with the sparse replacements of section 3.6.2.3."""
    at, new, count = sparse["indices"], sparse["values"], sparse["count"]
    dtype = np.dtype(_COMPONENTS[at["componentType"]])
    rows = _view(gltf, at["bufferView"], at.get("byteOffset", 0), count, 1, dtype)[:, 0].astype(np.int64)
    check_range(rows, len(values), "element", gltf.path)
    values = values.copy()
    values[rows] = _view(gltf, new["bufferView"], new.get("byteOffset", 0), count, values.shape[1], values.dtype)
    return values


# ---------------------------------------------------------------------------------------------------- scene


def _gather(gltf: Gltf) -> _Geometry:
    """Walk the default scene (all root nodes where there is none), parents before children, in file order."""
    geometry = _Geometry()
    stack = [(index, np.eye(4)) for index in reversed(_roots(gltf))]
    visits = 0
    while stack:
        index, parent = stack.pop()
        node = gltf.item("nodes", index)
        visits += 1
        if visits > len(gltf.root["nodes"]):
            raise InputError(f"{gltf.path}: its nodes form a loop; export it again")
        transform = parent @ _local_transform(node)
        stack += [(child, transform) for child in reversed(node.get("children", []))]
        if "mesh" in node:
            if "skin" in node:
                geometry.skip("skins")
            _add_mesh(gltf, geometry, index, node, transform)
    for kind in ("animations", "cameras"):
        if gltf.root.get(kind):
            geometry.skip(kind, len(gltf.root[kind]))
    return geometry


def _roots(gltf: Gltf) -> list[int]:
    if gltf.root.get("scenes"):
        return list(gltf.item("scenes", gltf.root.get("scene", 0)).get("nodes", []))
    nodes = gltf.root.get("nodes", [])
    children = {child for node in nodes for child in node.get("children", [])}
    return [index for index in range(len(nodes)) if index not in children]


def _local_transform(node: dict[str, Any]) -> NDArray[np.float64]:
    """A node's matrix, or translation * rotation * scale (section 3.5.3)."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), np.float64)
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, :3] *= np.array(node.get("scale", (1, 1, 1)), np.float64)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def _add_mesh(gltf: Gltf, geometry: _Geometry, node_index: int, node: dict, transform: NDArray) -> None:
    mesh = gltf.item("meshes", node["mesh"])
    name = mesh.get("name") or f"mesh_{node['mesh']}"
    flat = tuple(float(x) for x in transform.reshape(-1))
    for primitive in mesh["primitives"]:
        mode = primitive.get("mode", _TRIANGLES)
        if mode < _TRIANGLES:
            geometry.skip("points" if mode == _POINTS else "lines")
            continue
        if "targets" in primitive:
            geometry.skip("morph_targets", len(primitive["targets"]))
        material = ""
        if "material" in primitive:
            gltf.item("materials", primitive["material"])
            material = material_name(gltf.root["materials"], primitive["material"])
        corners = _add_vertices(gltf, geometry, node_index, primitive)
        triangles = _triangles(gltf, primitive, mode, corners[-1])
        geometry.face_part.append(np.full(len(triangles), len(geometry.parts)))
        geometry.parts.append(Part(name, material, node.get("name") or f"node_{node_index}", flat))
        flat_index = triangles.reshape(-1)
        check_range(flat_index, corners[-1], "vertex", gltf.path)
        geometry.corners.append(tuple(np.where(first >= 0, first + flat_index, -1) for first in corners[:-1]))


def _add_vertices(gltf: Gltf, geometry: _Geometry, node: int, primitive: dict) -> tuple[int, ...]:
    """First rows of a primitive's positions, UVs, normals and tangents (-1: none) and their count.

    Primitives of one node that share their accessors share the rows.
    """
    if "KHR_draco_mesh_compression" in primitive.get("extensions", {}):
        view = gltf.item("accessors", primitive["attributes"]["POSITION"])
        if "bufferView" not in view:
            raise InputError(f"{gltf.path}: needs the glTF extension KHR_draco_mesh_compression, which is not read; "
                             "export without")  # fmt: skip
    attributes = primitive["attributes"]
    names = [attributes.get(name) for name in ("POSITION", "TEXCOORD_0", "NORMAL", "TANGENT")]
    key = (node, *names)
    count = gltf.item("accessors", names[0])["count"]
    if key not in geometry.blocks:
        stores = (geometry.positions, geometry.uv, geometry.normals, geometry.tangents)
        firsts = []
        for accessor, store, width in zip(names, stores, (3, 2, 3, 4), strict=True):
            if accessor is None:
                firsts.append(-1)
                continue
            values = _accessor(gltf, accessor)
            if values.shape != (count, width):
                raise InputError(f"{gltf.path}: accessors[{accessor}] is {values.shape}, expected {(count, width)}")
            firsts.append(sum(len(block) for block in store))
            exact = store is geometry.positions or store is geometry.uv
            store.append(values.astype(np.float64 if exact else np.float32))
        geometry.blocks[key] = tuple(firsts)
    return (*geometry.blocks[key], count)


def _triangles(gltf: Gltf, primitive: dict, mode: int, count: int) -> NDArray[np.int64]:
    """Vertex indices (T, 3) of a triangle list, strip or fan (section 3.7.2.1)."""
    indexed = "indices" in primitive
    index = _accessor(gltf, primitive["indices"])[:, 0].astype(np.int64) if indexed else np.arange(count)
    if mode == _TRIANGLES:
        return index[: len(index) // 3 * 3].reshape(-1, 3)
    i = np.arange(max(len(index) - 2, 0))
    if mode == _STRIP:
        return np.stack([index[i], index[i + 1 + i % 2], index[i + 2 - i % 2]], -1)
    if mode == _FAN:
        return np.stack([index[i + 1], index[i + 2], np.broadcast_to(index[:1], i.shape)], -1)
    raise InputError(f"{gltf.path}: primitive mode {mode}, expected 0 to 6; export it again")
