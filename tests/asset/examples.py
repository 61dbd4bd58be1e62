"""A small asset folder as `bake` leaves it: two slots, sharing pictures or not, on nodes that turn, scale and mirror."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.asset.gltf import write_chunks
from stages.core.artifact import Provenance, write_manifest
from stages.core.images import write_png
from stages.core.schemas import ASSET
from stages.core.texture_sets import TextureSet

SIZE = 16

TURNED = np.array([[0, -2, 0, 1], [2, 0, 0, 0], [0, 0, 2, 3], [0, 0, 0, 1.0]])
MIRRORED = np.diag([-1.0, 1, 1, 1])


def picture(seed: int, channels: int = 3) -> NDArray[np.uint8]:
    """Every byte another."""
    return np.random.default_rng(seed).integers(0, 256, (SIZE, SIZE, channels), dtype=np.uint8)


def bump() -> NDArray[np.uint8]:
    """A normal map that leans every way, +Y."""
    x, y = np.meshgrid(np.linspace(-0.6, 0.6, SIZE), np.linspace(0.6, -0.6, SIZE))
    n = np.stack([x, y, np.sqrt(1 - x * x - y * y)], -1)
    return ((n + 1) * 127.5 + 0.5).astype(np.uint8)


def gradient() -> NDArray[np.uint8]:
    """Colours that a lossy picture keeps."""
    x, y = np.meshgrid(np.linspace(40, 220, SIZE), np.linspace(60, 200, SIZE))
    return np.stack([x, y, 255 - x], -1).astype(np.uint8)


MAPS = {"albedo": picture(1), "orm": picture(2), "normal": bump(), "emission": picture(3)}


def dome(n: int = 12) -> dict[str, NDArray]:
    """A curved sheet: positions (N, 3), normals, tangents, uv (v down), triangles."""
    u, v = np.meshgrid(np.linspace(0.02, 0.98, n), np.linspace(0.02, 0.98, n), indexing="ij")
    a, b = (u - 0.5) * 2.4, (v - 0.5) * 2.4
    normal = np.stack([np.sin(a) * np.cos(b), -np.sin(b), np.cos(a) * np.cos(b)], -1)
    tangent = np.stack([np.cos(a), 0 * a, -np.sin(a), 0 * a + 1], -1)
    index = np.arange(n * n).reshape(n, n)
    quads = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], -1).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    flat = {"POSITION": normal * 0.5, "NORMAL": normal, "TANGENT": tangent, "TEXCOORD_0": np.stack([u, v], -1)}
    made = {name: value.reshape(n * n, -1).astype("<f4") for name, value in flat.items()}
    return {**made, "triangles": triangles.astype("<u2")}


class Parts:
    """The binary chunk of a GLB and the tables that point into it."""

    def __init__(self) -> None:
        self.chunk, self.views, self.accessors = bytearray(), [], []  # type: ignore[var-annotated]

    def view(self, data: bytes) -> int:
        self.chunk.extend(b"\0" * (-len(self.chunk) % 4))
        self.views.append({"buffer": 0, "byteOffset": len(self.chunk), "byteLength": len(data)})
        self.chunk.extend(data)
        return len(self.views) - 1

    def accessor(self, values: NDArray, kind: str) -> int:
        component = {"f": 5126, "u": 5123}[values.dtype.kind]
        entry = {"bufferView": self.view(values.tobytes()), "componentType": component, "count": len(values), "type": kind}
        if kind == "VEC3":
            entry |= {"min": values.min(0).tolist(), "max": values.max(0).tolist()}
        self.accessors.append(entry)
        return len(self.accessors) - 1


def save_asset(
    folder: Path, maps: tuple[str, ...] = ("albedo", "orm"), source: str = "my chair (2).obj", apart: bool = False,
    normal_scale: float = 1.0, albedo: NDArray[np.uint8] = MAPS["albedo"],
    half: bool = False,
) -> Path:  # fmt: skip
    """Write an asset folder with those maps; "occlusion" means that the red of orm is one.

    apart: the second slot has pictures of its own, red and blue of the albedo exchanged. half: the second part shows half of
    the triangles, of the vertices that both share.
    """
    folder.mkdir(parents=True)
    parts, stored = Parts(), [name for name in maps if name in MAPS]
    images, textures = [], []
    for number in range(1 + apart):
        for name in stored:
            file = folder / f"{name}{number or ''}.png"
            pixels = albedo if name == "albedo" else MAPS[name]
            write_png(file, pixels[..., ::-1] if number and name == "albedo" else pixels)
            named = {"name": file.stem} if name in ("albedo", "orm") else {}  # those of the source may have no name
            images.append({**named, "mimeType": "image/png", "bufferView": parts.view(file.read_bytes())})
            textures.append({"source": len(images) - 1, "sampler": 0})
    materials = [_material(f"{name} paint", maps, k * apart * len(stored), normal_scale) for k, name in enumerate("ab")]
    geometry = dome()
    attributes = {
        name: parts.accessor(geometry[name], f"VEC{geometry[name].shape[1]}")
        for name in ("POSITION", "NORMAL", "TEXCOORD_0", *(("TANGENT",) if "normal" in maps else ()))
    }
    indices = parts.accessor(geometry["triangles"].reshape(-1, 1), "SCALAR")
    some = parts.accessor(geometry["triangles"][::2].reshape(-1, 1)[: 3 * 40], "SCALAR") if half else indices
    faces = (indices, some)
    meshes = [{"primitives": [{"attributes": attributes, "indices": faces[k], "material": k}]} for k in range(2)]
    root = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [2]}],
        "nodes": [
            {"name": "1 turned", "mesh": 0, "matrix": TURNED.T.reshape(-1).tolist()},
            {"name": "mirrored", "mesh": 1, "matrix": MIRRORED.reshape(-1).tolist()},
            {"name": "upright", "children": [0, 1]},
        ],
        "meshes": meshes, "materials": materials, "textures": textures, "images": images,
        "samplers": [{"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}],
        "accessors": parts.accessors, "bufferViews": parts.views, "buffers": [{"byteLength": len(parts.chunk)}],
    }  # fmt: skip
    write_chunks(folder / "model.glb", root, [bytes(parts.chunk)])
    files = [path.name for path in folder.iterdir()]
    said = {"source_name": source, "prompt": "a thing", "sets": [TextureSet().to_json()]}
    write_manifest(folder, ASSET, Provenance({}, 5, {"prep": "0" * 64}, said), files)
    return folder


def _material(name: str, maps: tuple[str, ...], first: int, normal_scale: float) -> dict[str, Any]:
    at = {name: first + k for k, name in enumerate(n for n in maps if n in MAPS)}
    pbr = {"baseColorTexture": {"index": at["albedo"]}, "metallicRoughnessTexture": {"index": at["orm"]}}
    made: dict[str, Any] = {"name": name, "pbrMetallicRoughness": pbr}
    if "occlusion" in maps:
        made["occlusionTexture"] = {"index": at["orm"]}
    if "normal" in maps:
        made["normalTexture"] = {"index": at["normal"], **({"scale": normal_scale} if normal_scale != 1 else {})}
    if "glow" in maps:
        made["emissiveFactor"] = [0.5, 0.25, 0.0]
    if "emission" in maps:
        made |= {"emissiveTexture": {"index": at["emission"]}, "emissiveFactor": [1.0, 0.5, 0.25]}
    return made
