"""The container of glTF 2.0: JSON, buffers, views and accessors, compressed ones among them.

Source: glTF 2.0 specification, sections 3.6 and 4; KHR_draco_mesh_compression, EXT_meshopt_compression. Where a
compressed view or primitive has its plain form beside it, that is read.
"""

import base64
import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from stages.core.artifact import reason
from stages.core.errors import InputError, one_line
from stages.prep.extras import package
from stages.prep.source import check_range

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
DRACO = "KHR_draco_mesh_compression"
_UNDERSTOOD = (DRACO, *_MESHOPT, "KHR_mesh_quantization", "EXT_mesh_gpu_instancing", "KHR_node_visibility")
# what changes nothing of the geometry
_HARMLESS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "MSFT_lod", "KHR_lights_", "EXT_lights_",
             "KHR_animation_", "KHR_xmp", "KHR_node_", "KHR_interactivity", "KHR_physics_", "KHR_audio", "EXT_mesh_features",
             "EXT_mesh_manifold", "EXT_structural_metadata", "CESIUM_")  # fmt: skip
_MOST = 2**28  # elements of an accessor, vertices of all instances: more is no mesh but a trap


@dataclass
class Gltf:
    """The parsed file. buffers, views: bytes by index, read or unpacked when first asked for."""

    path: Path
    root: dict[str, Any]
    chunk: bytes | None
    buffers: dict[int, bytes] = field(default_factory=dict)
    views: dict[int, bytes] = field(default_factory=dict)

    def item(self, kind: str, index: Any) -> dict[str, Any]:
        """Entry `index` of the top-level array `kind`. Raises: InputError."""
        entries = self.root.get(kind, [])
        if not isinstance(index, int) or not 0 <= index < len(entries):
            raise InputError(f"{self.path}: refers to {kind}[{index}], but has {len(entries)}; export it again")
        return entries[index]

    def bounded(self, count: int, what: str) -> int:
        """`count`, if memory can hold as many. Raises: InputError."""
        if not 0 <= count <= _MOST:
            raise InputError(f"{self.path}: {count} {what}, expected {_MOST} at most; export it again")
        return count


def companions(path: Path) -> dict[str, Path]:
    """Files beside a .gltf that hold its buffers: URI -> path. Raises: InputError."""
    files = {}
    for entry in open_gltf(path).root.get("buffers", []):
        uri = entry.get("uri") if isinstance(entry, dict) else None
        if isinstance(uri, str) and not uri.startswith("data:"):
            beside = path.parent / unquote(uri)
            if not _is_fallback(entry) or beside.is_file():
                files[uri] = beside
    return files


def open_gltf(path: Path) -> Gltf:
    """Parse .glb or .gltf. Raises: InputError where it needs an extension that is not read."""
    data = path.read_bytes()
    text, chunk = _chunks(data, path) if data.startswith(b"glTF") else (data, None)
    try:
        root = json.loads(text)
    except ValueError as error:
        raise InputError(
            f"{path}: neither GLB nor glTF JSON ({error}); it is cut off or another kind of file"
        ) from None
    version = root.get("asset", {}).get("version") if isinstance(root, dict) else None
    if not str(version).startswith("2."):
        raise InputError(f"{path}: glTF version {version}, expected 2.0; export it again")
    required = root.get("extensionsRequired", [])
    foreign = [name for name in required if name not in _UNDERSTOOD and not str(name).startswith(_HARMLESS)]
    if foreign:
        raise InputError(f"{path}: needs the glTF extension {foreign[0]}, which is not read; export it without")
    return Gltf(path, root, chunk)


def _chunks(data: bytes, path: Path) -> tuple[bytes, bytes | None]:
    """JSON and binary chunk of a GLB."""
    length = struct.unpack_from("<I", data, 8)[0] if len(data) >= 20 else len(data) + 1
    if length > len(data):
        raise InputError(f"{path}: {len(data)} bytes, but its header announces {length}; it is cut off")
    chunks: dict[bytes, bytes] = {}
    offset = 12
    while offset + 8 <= length:
        size, kind = struct.unpack_from("<I4s", data, offset)
        chunks.setdefault(kind, data[offset + 8 : offset + 8 + size])
        offset += 8 + size
    if b"JSON" not in chunks or offset > length:
        raise InputError(f"{path}: its GLB chunks are damaged; export it again")
    return chunks[b"JSON"], chunks.get(b"BIN\0")


# -------------------------------------------------------------------------------------------------------- accessors


def accessor(gltf: Gltf, index: int) -> NDArray:
    """An accessor's elements, (N, width), in the stored type; normalised integers become float32 (section 3.11)."""
    entry = gltf.item("accessors", index)
    dtype, width = np.dtype(_COMPONENTS[entry["componentType"]]), _WIDTHS[entry["type"]]
    count = gltf.bounded(entry["count"], "elements in an accessor")
    if "bufferView" in entry:
        values = _rows(gltf, entry["bufferView"], entry.get("byteOffset", 0), count, width, dtype)
    else:
        values = np.zeros((count, width), dtype)
    if "sparse" in entry:
        values = _sparse(gltf, entry["sparse"], values)
    return _normalised(entry, values)


def unpacked(gltf: Gltf, primitive: dict[str, Any]) -> tuple[dict[str, NDArray], NDArray] | None:
    """Attributes and vertex indices (T, 3) of a primitive in Draco's form; None where it has its plain form, too."""
    draco = primitive.get("extensions", {}).get(DRACO)
    if draco is None or "bufferView" in gltf.item("accessors", primitive["attributes"]["POSITION"]):
        return None
    view = gltf.item("bufferViews", draco["bufferView"])
    begin = view.get("byteOffset", 0)
    packed = _buffer(gltf, view["buffer"])[begin : begin + view["byteLength"]]
    library = package("DracoPy", "gltf", DRACO, gltf.path)
    try:
        mesh = library.decode(packed)
        found = {name: mesh.get_attribute_by_unique_id(key)["data"] for name, key in draco["attributes"].items()}
        faces = np.asarray(mesh.faces, np.int64).reshape(-1, 3)
    except (ValueError, RuntimeError, TypeError, AttributeError, library.FileTypeException) as error:
        raise InputError(f"{gltf.path}: its Draco data cannot be read ({one_line(error)}); export it again") from None
    attributes = primitive["attributes"]
    shaped = {name: values.reshape(len(values), -1) for name, values in found.items() if name in attributes}
    return {name: _normalised(gltf.item("accessors", attributes[name]), values) for name, values in shaped.items()}, faces


def _normalised(entry: dict[str, Any], values: NDArray) -> NDArray:
    if entry.get("normalized") and values.dtype.kind in "iu":
        return np.maximum(values.astype(np.float64) / np.iinfo(values.dtype).max, -1.0).astype(np.float32)
    return values


def _rows(gltf: Gltf, index: int, offset: int, count: int, width: int, dtype: np.dtype) -> NDArray:
    """`count` rows of a buffer view, honouring its stride."""
    row = width * dtype.itemsize
    data, start, stride = _view(gltf, index)
    start, stride = start + offset, stride or row
    if start < 0 or (count and start + stride * (count - 1) + row > len(data)):
        raise InputError(f"{gltf.path}: bufferViews[{index}] reaches past the end of its buffer; export it again")
    strided = np.ndarray((count, row), np.uint8, data, start, (stride, 1)) if count else np.zeros((0, row), np.uint8)
    return np.ascontiguousarray(strided).view(dtype).reshape(count, width)


def _sparse(gltf: Gltf, sparse: dict[str, Any], values: NDArray) -> NDArray:
    """Values with the sparse replacements of section 3.6.2.3."""
    at, new, count = sparse["indices"], sparse["values"], gltf.bounded(sparse["count"], "sparse elements")
    dtype = np.dtype(_COMPONENTS[at["componentType"]])
    rows = _rows(gltf, at["bufferView"], at.get("byteOffset", 0), count, 1, dtype)[:, 0].astype(np.int64)
    check_range(rows, len(values), "element", gltf.path)
    values = values.copy()
    values[rows] = _rows(gltf, new["bufferView"], new.get("byteOffset", 0), count, values.shape[1], values.dtype)
    return values


# ------------------------------------------------------------------------------------------------- views and buffers


def _view(gltf: Gltf, index: int) -> tuple[bytes, int, int | None]:
    """The bytes that hold a view, where it begins there, and its stride if it states one."""
    view = gltf.item("bufferViews", index)
    packed = next((view["extensions"][name] for name in _MESHOPT if name in view.get("extensions", {})), None)
    if packed is None or _is_there(gltf, view["buffer"]):
        return _buffer(gltf, view["buffer"]), view.get("byteOffset", 0), view.get("byteStride")
    if index not in gltf.views:
        gltf.views[index] = _meshopt(gltf, packed)
    return gltf.views[index], 0, packed["byteStride"]


def _meshopt(gltf: Gltf, packed: dict[str, Any]) -> bytes:
    library = package("meshopt", "gltf", _MESHOPT[0], gltf.path)
    begin, stride = packed.get("byteOffset", 0), packed["byteStride"]
    data = _buffer(gltf, packed["buffer"])[begin : begin + packed["byteLength"]]
    count = gltf.bounded(packed["count"], "elements in a compressed view")
    try:
        rows = library.decode_gltf_buffer(data, count, stride, packed["mode"], packed.get("filter", "NONE"))
    except (ValueError, RuntimeError, TypeError) as error:
        raise InputError(f"{gltf.path}: its meshopt data cannot be read ({one_line(error)}); export it again") from None
    return np.ascontiguousarray(rows).tobytes()


def _is_fallback(entry: dict[str, Any]) -> bool:
    """Whether a buffer only stands in for compressed ones, and may be missing."""
    return any(entry.get("extensions", {}).get(name, {}).get("fallback") for name in _MESHOPT)


def _is_there(gltf: Gltf, index: int) -> bool:
    entry = gltf.item("buffers", index)
    uri = entry.get("uri")
    if uri is None:
        return index == 0 and gltf.chunk is not None and len(gltf.chunk) >= entry["byteLength"] and not _is_fallback(entry)
    return uri.startswith("data:") or (gltf.path.parent / unquote(uri)).is_file()


def _buffer(gltf: Gltf, index: int) -> bytes:
    if index not in gltf.buffers:
        entry = gltf.item("buffers", index)
        uri = entry.get("uri")
        if uri is None and gltf.chunk is not None:
            data = gltf.chunk
        elif uri is None:
            raise InputError(f"{gltf.path}: buffer {index} has neither a URI nor a binary chunk; export it again")
        elif uri.startswith("data:"):
            data = base64.b64decode(uri.partition(",")[2])
        else:
            data = _read_beside(gltf.path, uri)
        if len(data) < entry["byteLength"]:
            raise InputError(
                f"{gltf.path}: buffer {index} has {len(data)} of {entry['byteLength']} bytes; it is cut off"
            )
        gltf.buffers[index] = data
    return gltf.buffers[index]


def _read_beside(path: Path, uri: str) -> bytes:
    try:
        return (path.parent / unquote(uri)).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: its buffer {uri}: {reason(error)}; keep the file beside it") from None
