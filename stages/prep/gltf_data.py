"""The numbers of a glTF file: accessors, plain and sparse, and what Draco or meshopt have packed.

Source: glTF 2.0 specification, section 3.6; KHR_draco_mesh_compression, EXT_meshopt_compression. Where a compressed view
or primitive has its plain form beside it, that is read.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.core.beside import beside
from stages.core.errors import InputError, one_line
from stages.prep.extras import package
from stages.prep.gltf_file import DRACO, MESHOPT, Gltf, buffer_bytes, is_fallback
from stages.prep.source import check_range

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


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
    packed = buffer_bytes(gltf, view["buffer"])[begin : begin + view["byteLength"]]
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
    packed = next((view["extensions"][name] for name in MESHOPT if name in view.get("extensions", {})), None)
    if packed is None or _is_there(gltf, view["buffer"]):
        return buffer_bytes(gltf, view["buffer"]), view.get("byteOffset", 0), view.get("byteStride")
    if index not in gltf.views:
        gltf.views[index] = _meshopt(gltf, packed)
    return gltf.views[index], 0, packed["byteStride"]


def _meshopt(gltf: Gltf, packed: dict[str, Any]) -> bytes:
    library = package("meshopt", "gltf", MESHOPT[0], gltf.path)
    begin, stride = packed.get("byteOffset", 0), packed["byteStride"]
    data = buffer_bytes(gltf, packed["buffer"])[begin : begin + packed["byteLength"]]
    count = gltf.bounded(packed["count"], "elements in a compressed view")
    try:
        rows = library.decode_gltf_buffer(data, count, stride, packed["mode"], packed.get("filter", "NONE"))
    except (ValueError, RuntimeError, TypeError) as error:
        raise InputError(f"{gltf.path}: its meshopt data cannot be read ({one_line(error)}); export it again") from None
    return np.ascontiguousarray(rows).tobytes()


def _is_there(gltf: Gltf, index: int) -> bool:
    """Whether a buffer's bytes can be had."""
    entry = gltf.item("buffers", index)
    uri = entry.get("uri")
    if uri is None:
        return index == 0 and gltf.chunk is not None and len(gltf.chunk) >= entry["byteLength"] and not is_fallback(entry)
    if uri.startswith("data:"):
        return True
    try:
        return beside(gltf.path, uri).is_file()
    except InputError:
        return False
