"""Writer of binary glTF 2.0: our own bytes, so that every position, index and UV is the very bits it was given.

Source: Khronos glTF 2.0 specification, sections 3 (concepts) and 4 (GLB). Images are embedded.
"""

import importlib.metadata
import json
import struct
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.asset.model import Model, Part
from stages.asset.passed_on import TEXTURES, PassedOn
from stages.asset.worn import Worn
from stages.core.artifact import written_atomically

FLOAT, UINT16, UINT32 = 5126, 5123, 5125
ARRAY, ELEMENTS = 34962, 34963
CLAMP, LINEAR, TRILINEAR = 33071, 9729, 9987


def generator() -> str:
    """Program and version, for `asset.generator`."""
    try:
        return f"dreammat {importlib.metadata.version('dreammat')}"
    except importlib.metadata.PackageNotFoundError:  # run from a source tree
        return "dreammat"


@dataclass(frozen=True)
class Pictures:
    """PNG files of one texture set.

    images: by map: "albedo" (sRGB), "orm" (linear: R occlusion, G roughness, B metallic) and, where there is relief, "normal"
    (linear). suffix: behind the maps' names. wrap: how they go on beyond their edges.
    """

    images: dict[str, bytes]
    suffix: str = ""
    wrap: int = CLAMP


@dataclass(frozen=True)
class Look:
    """What the materials show.

    sets: pictures of each texture set. occlusion: whether R of "orm" holds any, for materials that bring none. passed_on: what
    else the source's materials had.
    """

    sets: list[Pictures]
    occlusion: bool = False
    passed_on: PassedOn = field(default_factory=PassedOn)

    def material(self, worn: Worn) -> dict[str, Any]:
        """glTF's material; the textures baked here come first, those passed on take the rows after them."""
        before = sum(len(pictures.images) for pictures in self.sets[: worn.set])
        baked = sum(len(pictures.images) for pictures in self.sets)
        row = {image: before + index for index, image in enumerate(self.sets[worn.set].images)}
        pbr = {"baseColorTexture": {"index": row["albedo"]}, "metallicRoughnessTexture": {"index": row["orm"]}}
        made: dict[str, Any] = {"name": worn.name or "material", "pbrMetallicRoughness": pbr}
        for key, value in self.passed_on.materials.get(worn.slot, {}).items():
            made[key] = value | {"index": value["index"] + baked} if key in TEXTURES else value
        if "normal" in row:
            made["normalTexture"] = {"index": row["normal"]}
        if self.occlusion:
            made.setdefault("occlusionTexture", {"index": row["orm"]})
        return made

    def textures(self) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
        """glTF's textures and samplers; the first samplers are the baked textures' own."""
        wraps = list(dict.fromkeys(pictures.wrap for pictures in self.sets))
        samplers: list[dict[str, Any]] = [
            {"magFilter": LINEAR, "minFilter": TRILINEAR, "wrapS": wrap, "wrapT": wrap} for wrap in wraps
        ]
        own = [wraps.index(pictures.wrap) for pictures in self.sets for _ in pictures.images]
        textures: list[dict[str, Any]] = [{"source": index, "sampler": sampler} for index, sampler in enumerate(own)]
        for texture in self.passed_on.textures:
            entry = {"source": len(own) + texture["image"]}
            if "sampler" in texture:
                if texture["sampler"] not in samplers:
                    samplers.append(texture["sampler"])
                entry["sampler"] = samplers.index(texture["sampler"])
            textures.append(entry)
        return textures, samplers

    def stored_images(self, buffer: "_Buffer") -> list[dict[str, Any]]:
        """glTF's images, whose bytes go into the buffer."""
        baked = [(name + of.suffix, "image/png", data) for of in self.sets for name, data in of.images.items()]
        files = baked + self.passed_on.images
        return [
            ({"name": name} if name else {}) | {"mimeType": kind, "bufferView": buffer.view(data)}
            for name, kind, data in files
        ]


def bare(model: Model) -> tuple[dict[str, Any], bytes]:
    """JSON and binary part of a model in plain grey."""
    buffer = _Buffer()
    worn = list(dict.fromkeys(part.worn for part in model.parts))
    meshes, nodes, roots = _scene(model, worn, buffer)
    grey = {"baseColorFactor": [0.5, 0.5, 0.5, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8}
    root: dict[str, Any] = {
        "meshes": meshes,
        "nodes": nodes,
        "scenes": [{"nodes": roots}],
        "materials": [{"name": of.name or "material", "pbrMetallicRoughness": grey, "doubleSided": True} for of in worn],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
    }
    return root, b"".join(buffer.pieces)


def write_glb(path: Path, model: Model, look: Look) -> None:
    """Write model.glb atomically."""
    buffer = _Buffer()
    materials = list(dict.fromkeys(part.worn for part in model.parts))
    meshes, nodes, roots = _scene(model, materials, buffer)
    sides = {"doubleSided": True} if model.double_sided else {}
    textures, samplers = look.textures()
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": generator()},
        "scene": 0,
        "scenes": [{"nodes": roots}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [look.material(worn) | sides for worn in materials],
        "textures": textures,
        "samplers": samplers,
        "images": look.stored_images(buffer),
    }
    if extensions := _extensions(document["materials"]):
        document["extensionsUsed"] = extensions
    document |= {"accessors": buffer.accessors, "bufferViews": buffer.views, "buffers": [{"byteLength": buffer.length}]}
    write_chunks(path, document, buffer.pieces)


def _extensions(content: Any) -> list[str]:
    """Names of the extensions that a piece of glTF uses, sorted."""
    found: set[str] = set()
    if isinstance(content, dict):
        found |= set(content.get("extensions", {}))
    for value in content.values() if isinstance(content, dict) else content if isinstance(content, list) else ():
        found |= set(_extensions(value))
    return sorted(found)


class _Buffer:
    """The binary chunk as it grows; equal data is stored once."""

    def __init__(self) -> None:
        self.pieces: list[bytes] = []
        self.length = 0
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self._known: dict[tuple[int, str, int], tuple[NDArray, int]] = {}

    def view(self, data: bytes, target: int | None = None) -> int:
        """Append bytes at a multiple of four. Returns: the index of their buffer view."""
        view = {"buffer": 0, "byteOffset": self.length, "byteLength": len(data)}
        self.views.append(view | ({"target": target} if target else {}))
        padded = data + b"\0" * (-len(data) % 4)
        self.pieces.append(padded)
        self.length += len(padded)
        return len(self.views) - 1

    def accessor(self, array: NDArray, kind: str, target: int, bounds: bool = False) -> int:
        """Store an array once. Args: kind: "SCALAR", "VEC2", "VEC3" or "VEC4". Returns: the index of its accessor."""
        key = (id(array), kind, target)
        if key not in self._known:  # the array is kept, so that its id stays its own
            component = {"f4": FLOAT, "u2": UINT16, "u4": UINT32}[array.dtype.str[1:]]
            data = array.astype(array.dtype.newbyteorder("<")).tobytes()
            entry: dict[str, Any] = {"bufferView": self.view(data, target), "componentType": component}
            entry |= {"count": len(array), "type": kind}
            if bounds:
                entry |= {"min": array.min(0).astype(float).tolist(), "max": array.max(0).astype(float).tolist()}
            self.accessors.append(entry)
            self._known[key] = (array, len(self.accessors) - 1)
        return self._known[key][1]


def _scene(model: Model, materials: list[Worn], buffer: _Buffer) -> tuple[list[dict], list[dict], list[int]]:
    """Meshes, nodes and the indices of the root nodes: a node for each run of parts on one node, a mesh for those alike."""
    meshes: list[dict[str, Any]] = []
    nodes: list[dict[str, Any]] = []
    roots: list[int] = []
    known: dict[tuple, int] = {}
    for run in _runs(model.parts):
        key = tuple((id(part.positions), id(part.triangles)) for part in run)  # instances share their arrays
        if key not in known:
            known[key] = len(meshes)
            meshes.append({"name": run[0].name, "primitives": [_primitive(part, materials, buffer) for part in run]})
        roots.append(_add_node(nodes, run[0], known[key]))
    if not np.array_equal(model.upright, np.eye(4)):
        nodes.append({"name": "upright", "children": roots, "matrix": _columns(model.upright)})
        roots = [len(nodes) - 1]
    return meshes, nodes, roots


def _runs(parts: list[Part]) -> list[list[Part]]:
    """Parts one after another that stand on one node."""
    runs: list[list[Part]] = []
    for part in parts:
        if not runs or not _same_node(runs[-1][-1], part):
            runs.append([])
        runs[-1].append(part)
    return runs


def _same_node(a: Part, b: Part) -> bool:
    return (a.node, a.name) == (b.node, b.name) and np.array_equal(a.transform, b.transform)


def _add_node(nodes: list[dict[str, Any]], part: Part, mesh: int) -> int:
    """Add the node of a part. Returns: its index.

    A glTF matrix must be a translation, rotation and scale. One that also shears, which a tree of nodes can make, is
    written as two nested nodes by its singular values: rotation, scale, rotation.
    """
    node: dict[str, Any] = {"name": part.node, "mesh": mesh}
    if np.array_equal(part.transform, np.eye(4)):
        nodes.append(node)
    elif not shears(part.transform):
        nodes.append(node | {"matrix": _columns(part.transform)})
    else:
        u, s, vt = np.linalg.svd(part.transform[:3, :3])
        inner, outer = np.eye(4), part.transform.copy()
        inner[:3, :3], outer[:3, :3] = vt, u * s
        nodes.append(node | {"matrix": _columns(inner)})
        nodes.append({"name": f"{part.node} (shear)", "children": [len(nodes) - 1], "matrix": _columns(outer)})
    return len(nodes) - 1


def shears(transform: NDArray[np.float64]) -> bool:
    """Whether the axes of an affine (4, 4) matrix are not at right angles."""
    axes = transform[:3, :3].T
    length = np.linalg.norm(axes, axis=1)
    gram = (axes @ axes.T) / np.where(length > 0, length, 1)[:, None] / np.where(length > 0, length, 1)
    return bool((np.abs(gram - np.diag(np.diag(gram))) > 1e-6).any())


def _columns(matrix: NDArray[np.float64]) -> list[float]:
    """A matrix in glTF's order, column by column."""
    return matrix.T.reshape(-1).tolist()


def _primitive(part: Part, materials: list[Worn], buffer: _Buffer) -> dict[str, Any]:
    attributes = {"POSITION": buffer.accessor(part.positions, "VEC3", ARRAY, bounds=True)}
    attributes["NORMAL"] = buffer.accessor(part.normals, "VEC3", ARRAY)
    if part.tangents is not None:
        attributes["TANGENT"] = buffer.accessor(part.tangents, "VEC4", ARRAY)
    attributes["TEXCOORD_0"] = buffer.accessor(part.uv, "VEC2", ARRAY)
    small = len(part.positions) <= 65535  # the index 65535 itself means "restart"
    indices = part.triangles.reshape(-1).astype(np.uint16 if small else np.uint32)
    return {
        "attributes": attributes,
        "indices": buffer.accessor(indices, "SCALAR", ELEMENTS),
        "material": materials.index(part.worn),
    }


def write_chunks(path: Path, document: dict[str, Any], pieces: Iterable[bytes]) -> None:
    """Write a GLB atomically. Args: document: its JSON part. pieces: its binary part; the last is filled up to four bytes."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    pieces = list(pieces)
    length = sum(map(len, pieces))
    filling = -length % 4
    with written_atomically(path) as temporary, open(temporary, "wb") as stream:
        stream.write(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + length + filling))
        stream.write(struct.pack("<I4s", len(text), b"JSON") + text)
        stream.write(struct.pack("<I4s", length + filling, b"BIN\0"))
        stream.writelines([*pieces, b"\0" * filling])
