"""What a glTF's materials have besides colour, roughness and metallic: normal map, occlusion, emission."""

import base64
from collections.abc import Callable
from typing import Any

from stages.core.beside import beside
from stages.core.errors import InputError
from stages.core.images import decode_image
from stages.prep.gltf_file import Gltf, buffer_bytes
from stages.prep.source import nothing_passed_on

_SIGNATURES = {b"\x89PNG\r\n": "image/png", b"\xff\xd8\xff": "image/jpeg"}
TRANSFORM = "KHR_texture_transform"


def material_name(materials: list[dict[str, Any]], index: int) -> str:
    """A material's name, with its number where it has none or shares it with another; no two have one."""
    names = [material.get("name") for material in materials]
    name = names[index]
    if name and names.index(name) == index:
        return name
    made = f"{name or 'material'}_{index}"
    while made in names:
        made += "_"
    return made


def pass_on(gltf: Gltf, skip: Callable[[str], None]) -> tuple[dict[str, Any], list[bytes]]:
    """What materials have besides colour, roughness and metallic, as `stages.asset.passed_on` wants it.

    Textures of another UV set than the first, in files that are not there, or neither PNG nor JPEG are counted and left
    out. Returns: the description; the images' bytes.
    """
    held, files, rows = nothing_passed_on(), list[bytes](), dict[int, int | None]()
    for index, material in enumerate(gltf.root.get("materials", [])):
        properties: dict[str, Any] = {}
        for kind in ("normalTexture", "occlusionTexture", "emissiveTexture"):
            info = material.get(kind)
            if info is None:
                continue
            texture = info["index"]
            if texture not in rows:
                rows[texture] = _add_texture(gltf, texture, held, files, skip)
            if uv_set(info) != 0:
                skip("textures_of_other_uv_sets")
            elif rows[texture] is not None:
                properties[kind] = _kept_info(info) | {"index": rows[texture]}
        if "emissiveFactor" in material and (material.get("emissiveTexture") is None or "emissiveTexture" in properties):
            properties["emissiveFactor"] = material["emissiveFactor"]
            strength = material.get("extensions", {}).get("KHR_materials_emissive_strength")
            if strength is not None:
                properties["extensions"] = {"KHR_materials_emissive_strength": strength}
        if properties:
            held["materials"][material_name(gltf.root["materials"], index)] = properties
    return held, files


def uv_set(info: dict[str, Any]) -> int:
    """The UV set that a texture is laid out for; KHR_texture_transform has the last word."""
    return info.get("extensions", {}).get(TRANSFORM, {}).get("texCoord", info.get("texCoord", 0))


def _kept_info(info: dict[str, Any]) -> dict[str, Any]:
    """A texture's reference with its scale or strength and its transform, and nothing that would need another extension."""
    kept = {key: value for key, value in info.items() if key in ("texCoord", "scale", "strength")}
    if TRANSFORM in info.get("extensions", {}):
        kept["extensions"] = {TRANSFORM: info["extensions"][TRANSFORM]}
    return kept


def _add_texture(gltf: Gltf, index: int, held: dict, files: list[bytes], skip: Callable[[str], None]) -> int | None:
    """Take up a texture and its image. Returns: its row, or None where the image cannot be had."""
    texture = gltf.item("textures", index)
    data = _image(gltf, texture["source"]) if "source" in texture else None
    kind = next((mime for start, mime in _SIGNATURES.items() if data and data.startswith(start)), None)
    if data is None or kind is None:
        skip("textures_missing" if data is None else "textures_not_png_or_jpeg")
        return None
    if not _readable(data):
        skip("textures_damaged")
        return None
    if data not in files:
        files.append(data)
        name = gltf.item("images", texture["source"]).get("name", "")
        held["images"].append({"name": name, "mimeType": kind, "length": len(data)})
    entry: dict[str, Any] = {"image": files.index(data)}
    if "sampler" in texture:
        sampler = gltf.item("samplers", texture["sampler"])
        entry["sampler"] = {k: v for k, v in sampler.items() if k in ("magFilter", "minFilter", "wrapS", "wrapT")}
    held["textures"].append(entry)
    return len(held["textures"]) - 1


def _readable(data: bytes) -> bool:
    try:
        decode_image(data)
    except InputError:
        return False
    return True


def _image(gltf: Gltf, index: int) -> bytes | None:
    """The bytes of an image file, or None where there is none."""
    image = gltf.item("images", index)
    if "bufferView" in image:
        view = gltf.item("bufferViews", image["bufferView"])
        start = view.get("byteOffset", 0)
        return buffer_bytes(gltf, view["buffer"])[start : start + view["byteLength"]]
    uri = image["uri"]
    if uri.startswith("data:"):
        return base64.b64decode(uri.partition(",")[2])
    try:
        return beside(gltf.path, uri).read_bytes()
    except InputError:
        return None
