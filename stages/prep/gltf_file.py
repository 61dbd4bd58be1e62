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

_HARMLESS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "KHR_lights_", "KHR_mesh_quantization",
             "KHR_animation_", "KHR_xmp", "KHR_node_visibility")  # fmt: skip


@dataclass
class Gltf:
    """The parsed file. buffers: bytes by index, read when first asked for."""

    path: Path
    root: dict[str, Any]
    chunk: bytes | None
    buffers: dict[int, bytes] = field(default_factory=dict)

    def item(self, kind: str, index: Any) -> dict[str, Any]:
        """Entry `index` of the top-level array `kind`. Raises: InputError."""
        entries = self.root.get(kind, [])
        if not isinstance(index, int) or not 0 <= index < len(entries):
            raise InputError(f"{self.path}: refers to {kind}[{index}], but has {len(entries)}; export it again")
        return entries[index]


def open_gltf(path: Path) -> Gltf:
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
    foreign = [name for name in root.get("extensionsRequired", []) if not name.startswith(_HARMLESS)]
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
                f"{gltf.path}: buffer {index} has {len(data)} of {entry['byteLength']} bytes; it is cut off"
            )
        gltf.buffers[index] = data
    return gltf.buffers[index]


def read_beside(path: Path, uri: str) -> bytes:
    try:
        return beside(path, uri).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: its buffer {uri}: {reason(error)}; keep the file beside it") from None


def companions(path: Path) -> dict[str, Path]:
    """Files beside a .gltf that hold its buffers, and those of its images that are there: URI -> path. Raises: InputError."""
    root = open_gltf(path).root
    found: dict[str, Path] = {}
    for kind in ("buffers", "images"):
        for entry in root.get(kind, []):
            uri = entry.get("uri") if isinstance(entry, dict) else None
            if isinstance(uri, str) and not uri.startswith("data:"):
                with contextlib.nullcontext() if kind == "buffers" else contextlib.suppress(InputError):
                    found[uri] = beside(path, uri)
    return found
