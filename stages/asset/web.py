"""A GLB for the web: Draco geometry (KHR_draco_mesh_compression) and WebP pictures (EXT_texture_webp).

Nodes, materials and names stay those of model.glb. Positions keep POSITION_BITS of the mesh's longest edge, UVs and normals
as many as UV_BITS and NORMAL_BITS say; tangents stay floats. Colours are WebP of quality QUALITY; what is data (roughness,
normals) is WebP without loss. No library on PyPI writes KTX2, so there is none.
"""

import copy
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.asset.folder import Asset
from stages.asset.gltf import write_chunks
from stages.asset.read_glb import COMPONENTS, WIDTHS, Picture, TexturedModel, eight_bit
from stages.asset.webp import encode_webp

POSITION_BITS, UV_BITS, NORMAL_BITS = 16, 16, 12
"""A texel of 8192 is eight steps of a UV; a normal is off by 0.03 degrees at most."""

LEVEL = 7
"""Draco's compression level, 0 to 10."""

QUALITY = 92
"""Of the WebP pictures that show colour."""

DRACO, WEBP = "KHR_draco_mesh_compression", "EXT_texture_webp"

COLOURS = {"albedo", "emission"}
"""Roles of pictures whose loss the eye judges; the others hold numbers."""


def write_web(asset: Asset, out: Path) -> list[str]:
    """Write <Name>.glb."""
    name = f"{asset.name}.glb"
    root, chunk = compressed(asset.model)
    write_chunks(out / name, root, [chunk])
    return [name]


def compressed(model: TexturedModel) -> tuple[dict[str, Any], bytes]:
    """JSON and binary part of the small GLB."""
    root, chunk = copy.deepcopy(model.root), bytearray()
    views: list[dict[str, Any]] = []

    def view(data: bytes) -> int:
        chunk.extend(b"\0" * (-len(chunk) % 4))
        views.append({"buffer": 0, "byteOffset": len(chunk), "byteLength": len(data)})
        chunk.extend(data)
        return len(views) - 1

    root["accessors"] = []
    known: dict[str, dict[str, Any]] = {}
    for mesh in root["meshes"]:
        for primitive in mesh["primitives"]:
            key = repr(primitive["attributes"]) + str(primitive["indices"])  # equal geometry is stored once
            if key not in known:
                known[key] = _primitive(primitive, model, root["accessors"], view)
            primitive |= copy.deepcopy(known[key])
    _pictures(root, model, view)
    root |= {"bufferViews": views, "buffers": [{"byteLength": len(chunk)}]}
    root["extensionsUsed"] = sorted({*root.get("extensionsUsed", []), DRACO, WEBP})
    root["extensionsRequired"] = sorted({*root.get("extensionsRequired", []), DRACO, WEBP})
    return root, bytes(chunk)


def _primitive(primitive: dict[str, Any], model: TexturedModel, accessors: list, view: Any) -> dict[str, Any]:
    """Attributes, indices and extension of a compressed primitive; its accessors are added, without buffer views.

    Primitives that share a vertex table, as the parts of an OBJ do, keep the vertices that they use.
    """
    named = {name: _stored(model, index) for name, index in primitive["attributes"].items()}
    used, triangles = np.unique(_stored(model, primitive["indices"]), return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    data, ids, decoded = encode({name: values[used] for name, values in named.items()}, triangles)
    points = decoded["POSITION"]
    attributes = {}
    for name, values in decoded.items():
        entry: dict[str, Any] = {"componentType": 5126, "count": len(points), "type": f"VEC{values.shape[1]}"}
        if name == "POSITION":
            entry |= {"min": points.min(0).astype(float).tolist(), "max": points.max(0).astype(float).tolist()}
        accessors.append(entry)
        attributes[name] = len(accessors) - 1
    indices = {"componentType": 5123 if len(points) <= 65535 else 5125, "count": triangles.size, "type": "SCALAR"}
    accessors.append(indices)
    extension = {DRACO: {"bufferView": view(data), "attributes": ids}}
    return {"attributes": attributes, "indices": len(accessors) - 1, "extensions": extension}


def encode(
    named: dict[str, NDArray], triangles: NDArray
) -> tuple[bytes, dict[str, int], dict[str, NDArray[np.float32]]]:
    """One primitive through Draco. Args: named: POSITION, NORMAL, TEXCOORD_0 and TANGENT, those that there are.

    Returns:
        The bytes, Draco's id of each attribute, and what a reader will find.
    """
    import DracoPy

    optional = {"tex_coord": named.get("TEXCOORD_0"), "normals": named.get("NORMAL")}
    given = {key: np.ascontiguousarray(value, np.float64) for key, value in optional.items() if value is not None}
    generic = {"TANGENT": np.ascontiguousarray(named["TANGENT"])} if "TANGENT" in named else None
    data = DracoPy.encode(
        np.ascontiguousarray(named["POSITION"], np.float64), triangles.astype(np.uint32), quantization_bits=POSITION_BITS,
        compression_level=LEVEL, preserve_order=True, tex_coord_quantization_bits=UV_BITS,
        normal_quantization_bits=NORMAL_BITS, generic_attributes=generic, **given,
    )  # fmt: skip
    mesh = DracoPy.decode(data)
    kinds = {0: "POSITION", 1: "NORMAL", 3: "TEXCOORD_0", 4: "TANGENT"}  # Draco's GeometryAttribute::Type
    ids = {kinds[a["attribute_type"]]: int(a["unique_id"]) for a in mesh.attributes}
    found = {kinds[a["attribute_type"]]: np.asarray(a["data"], np.float32) for a in mesh.attributes}
    return data, ids, found


def _stored(model: TexturedModel, index: int) -> NDArray:
    """An accessor of model.glb."""
    entry = model.root["accessors"][index]
    view = model.root["bufferViews"][entry["bufferView"]]
    start = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
    width = WIDTHS[entry["type"]]
    return np.frombuffer(model.chunk, COMPONENTS[entry["componentType"]], entry["count"] * width, start).reshape(-1, width)


def _pictures(root: dict[str, Any], model: TexturedModel, view: Any) -> None:
    """Every picture as WebP, and every texture pointing to it by the extension."""
    colours = {p.row for look in model.looks for role, p in look.pictures.items() if role in COLOURS}
    for image, picture in zip(root["images"], model.pictures, strict=True):
        data = webp(picture, picture.row in colours)
        image |= {"mimeType": "image/webp", "bufferView": view(data)}
    for texture in root["textures"]:
        texture["extensions"] = {WEBP: {"source": texture.pop("source")}}


def webp(picture: Picture, colour: bool) -> bytes:
    """A picture's WebP file."""
    return encode_webp(eight_bit(picture.pixels())[..., :3], QUALITY if colour else None)
