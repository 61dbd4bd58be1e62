"""A glTF 2.0 file taken apart: its JSON, and the bytes that its buffers and images lie in."""

import base64
import contextlib
import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stages.core.artifact import reason
from stages.core.beside import beside
from stages.core.errors import InputError

MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
DRACO = "KHR_draco_mesh_compression"
_UNDERSTOOD = (DRACO, *MESHOPT, "KHR_mesh_quantization", "EXT_mesh_gpu_instancing", "KHR_node_visibility")
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


def open_gltf(path: Path) -> Gltf:
    """Parse .glb or .gltf. Raises: InputError where it needs an extension that is not read."""
    data = path.read_bytes()
    text, chunk = _chunks(data, path) if data.startswith(b"glTF") else (data, None)
    try:
        root = json.loads(text)
    except ValueError as error:
        raise InputError(
            f"{path}: neither GLB nor glTF JSON ({error}); it is cut off or another kind of file, export it again"
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
        raise InputError(f"{path}: {len(data)} bytes, but its header announces {length}; it is cut off, export it again")
    chunks: dict[bytes, bytes] = {}
    offset = 12
    while offset + 8 <= length:
        size, kind = struct.unpack_from("<I4s", data, offset)
        chunks.setdefault(kind, data[offset + 8 : offset + 8 + size])
        offset += 8 + size
    if b"JSON" not in chunks or offset > length:
        raise InputError(f"{path}: its GLB chunks are damaged; export it again")
    return chunks[b"JSON"], chunks.get(b"BIN\0")


def buffer_bytes(gltf: Gltf, index: int) -> bytes:
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
            data = read_beside(gltf.path, uri)
        if len(data) < entry["byteLength"]:
            raise InputError(
                f"{gltf.path}: buffer {index} has {len(data)} of {entry['byteLength']} bytes; it is cut off, export it again"
            )
        gltf.buffers[index] = data
    return gltf.buffers[index]


def read_beside(path: Path, uri: str) -> bytes:
    try:
        return beside(path, uri).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: its buffer {uri}: {reason(error)}; keep the file beside it") from None


def companions(path: Path) -> dict[str, Path]:
    """Files beside a .gltf that hold its buffers, and those of its images and fallbacks that are there: URI -> path.

    Raises: InputError.
    """
    root = open_gltf(path).root
    found: dict[str, Path] = {}
    for kind in ("buffers", "images"):
        for entry in root.get(kind, []):
            uri = entry.get("uri") if isinstance(entry, dict) else None
            if isinstance(uri, str) and not uri.startswith("data:"):
                needed = kind == "buffers" and not is_fallback(entry)
                with contextlib.nullcontext() if needed else contextlib.suppress(InputError):
                    found[uri] = beside(path, uri)
    return found


def is_fallback(entry: dict[str, Any]) -> bool:
    """Whether a buffer only stands in for compressed ones, and may be missing."""
    return any(entry.get("extensions", {}).get(name, {}).get("fallback") for name in MESHOPT)
