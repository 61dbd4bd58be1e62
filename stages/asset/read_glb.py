"""model.glb read back: the geometry, the materials and the very pictures that every other format is written from.

A baked asset's GLB holds all that leaves the program, so an exporter needs no other file. Only what our own writer makes
is read: one buffer, accessors without gaps, pictures inside.
"""

import json
import struct
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from stages.core.artifact import reason
from stages.core.errors import ArtifactError, one_line

COMPONENTS = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
SUFFIXES = {"image/png": ".png", "image/jpeg": ".jpg"}

OPAQUE = 255

REPEAT = 10497
"""glTF's number for a texture that goes on beyond its edges."""


@dataclass(frozen=True)
class Picture:
    """An embedded picture: its row in the file's images, its encoded bytes, ".png" or ".jpg", and its name there or ""."""

    row: int
    data: bytes
    suffix: str
    name: str = ""

    def pixels(self) -> NDArray:
        """As stored, uint8 or uint16, (H, W, C). Raises: ArtifactError."""
        exact = oiio.ImageSpec()
        exact["oiio:UnassociatedAlpha"] = 1
        with tempfile.TemporaryDirectory() as folder:  # OpenImageIO's Python reads no memory
            path = Path(folder) / f"picture{self.suffix}"
            path.write_bytes(self.data)
            source = oiio.ImageInput.open(str(path), exact)
            values = source.read_image("unknown") if source else None
        if values is None:
            said = oiio.geterror() if source is None else source.geterror()
            raise ArtifactError(f"model.glb: its picture {self.row} cannot be read ({said.strip()}); bake it again")
        return values


@dataclass(frozen=True)
class Look:
    """A material of the model.

    pictures: of "albedo", "orm", "normal", "occlusion", "emission", those that it has. normal_scale: glTF's. emissive:
    the factor on the picture. repeats: whether pictures go on beyond their edges, instead of ending there.
    """

    name: str
    double_sided: bool
    pictures: dict[str, Picture]
    normal_scale: float = 1.0
    emissive: tuple[float, float, float] = (0.0, 0.0, 0.0)
    repeats: bool = False

    def packed(self) -> NDArray[np.uint8]:
        """R occlusion (1 where there is none), G roughness, B metallic: (H, W, 3)."""
        orm = eight_bit(self.pictures["orm"].pixels())[..., :3].copy()
        occlusion = self.pictures.get("occlusion")
        if occlusion is None:
            orm[..., 0] = OPAQUE
        elif occlusion.row != self.pictures["orm"].row:
            orm[..., 0] = resized(eight_bit(occlusion.pixels())[..., :1], orm.shape[1], orm.shape[0])[..., 0]
        return orm

    def scaled_normal(self) -> NDArray:
        """The normal map with its scale worked in, +Y: (H, W, 3), uint8 or uint16 as stored."""
        stored = self.pictures["normal"].pixels()[..., :3]
        if self.normal_scale == 1:
            return stored
        full = np.iinfo(stored.dtype).max
        n = (stored.astype(np.float32) / full * 2 - 1) * np.array([self.normal_scale, self.normal_scale, 1], np.float32)
        n /= np.maximum(np.linalg.norm(n, axis=-1, keepdims=True), np.float32(1e-6))
        return ((n + 1) / 2 * full + np.float32(0.5)).astype(stored.dtype)


@dataclass(frozen=True)
class Primitive:
    """Triangles of one material. positions, normals: (N, 3); normals None means flat. uv: (N, 2), v down.

    tangents: (N, 4) or None. triangles: (T, 3). look: index into `Model.looks`.
    """

    positions: NDArray[np.float32]
    normals: NDArray[np.float32] | None
    tangents: NDArray[np.float32] | None
    uv: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    look: int


@dataclass(frozen=True)
class Node:
    """A mesh where it stands. matrix: (4, 4) local to the scene, +y up, metres."""

    name: str
    matrix: NDArray[np.float64]
    primitives: list[Primitive]


@dataclass(frozen=True)
class TexturedModel:
    """What model.glb holds. pictures: all of them, row by row. root: its JSON; chunk: its binary part."""

    nodes: list[Node]
    looks: list[Look]
    pictures: list[Picture]
    root: dict[str, Any] = field(repr=False, default_factory=dict)
    chunk: bytes = field(repr=False, default=b"")


def resized(pixels: NDArray[np.uint8], width: int, height: int) -> NDArray[np.uint8]:
    """A picture (H, W, C) at another size, by area when smaller; itself where it has that size."""
    if pixels.shape[:2] == (height, width):
        return pixels
    step = pixels.shape[0] // height
    if step > 1 and pixels.shape[:2] == (step * height, step * width):
        return block_means(pixels, step)
    source = oiio.ImageBuf(np.ascontiguousarray(pixels))
    shrinks = height < pixels.shape[0]
    roi = oiio.ROI(0, width, 0, height, 0, 1, 0, pixels.shape[2])
    made = oiio.ImageBufAlgo.resize(source, filtername="box" if shrinks else "triangle", roi=roi)
    return np.asarray(made.get_pixels(oiio.UINT8)).reshape(height, width, pixels.shape[2])


def block_means(pixels: NDArray[np.uint8], step: int) -> NDArray[np.uint8]:
    """Means of whole blocks of step x step pixels, to nearest: OpenImageIO's box filter, in a tenth of its time.

    Args: pixels: (step H, step W, C). Returns: (H, W, C).
    """
    total = np.zeros((pixels.shape[0] // step, pixels.shape[1] // step, pixels.shape[2]), np.uint32)
    for i in range(step):
        for j in range(step):
            total += pixels[i::step, j::step]
    return ((total + step * step // 2) // (step * step)).astype(np.uint8)


def eight_bit(pixels: NDArray) -> NDArray[np.uint8]:
    """uint8 of uint8 or uint16, rounded to nearest."""
    return pixels if pixels.dtype == np.uint8 else ((pixels.astype(np.uint32) + 128) // 257).astype(np.uint8)


def read_model(path: Path) -> TexturedModel:
    """Read a GLB that `bake` wrote. Raises: ArtifactError."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ArtifactError(f"{path}: {reason(error)}; bake the asset again") from error
    try:
        root, chunk = _chunks(data)
        views = [chunk[v.get("byteOffset", 0) :][: v["byteLength"]] for v in root["bufferViews"]]
        arrays = [_array(entry, views) for entry in root["accessors"]]
        pictures = [_picture(row, image, views) for row, image in enumerate(root["images"])]
        looks = [_look(material, root, pictures) for material in root["materials"]]
        meshes = [[_primitive(p, arrays) for p in mesh["primitives"]] for mesh in root["meshes"]]
        roots = root["scenes"][root.get("scene", 0)]["nodes"]
        nodes = [node for index in roots for node in _nodes(root["nodes"], index, np.eye(4), meshes)]
    except (KeyError, ValueError, IndexError, TypeError, struct.error) as error:
        raise ArtifactError(f"{path}: not a model that bake wrote ({one_line(error)}); bake the asset again") from error
    return TexturedModel(nodes, looks, pictures, root, chunk)


def _chunks(data: bytes) -> tuple[dict[str, Any], bytes]:
    magic, version, length = struct.unpack_from("<4sII", data)
    size, kind = struct.unpack_from("<I4s", data, 12)
    if (magic, version, length, kind) != (b"glTF", 2, len(data), b"JSON"):
        raise ValueError("no GLB header")
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def _array(entry: dict[str, Any], views: list[bytes]) -> NDArray:
    width, start = WIDTHS[entry["type"]], entry.get("byteOffset", 0)
    values = np.frombuffer(views[entry["bufferView"]], COMPONENTS[entry["componentType"]], entry["count"] * width, start)
    return values.reshape(-1, width)


def _picture(row: int, image: dict[str, Any], views: list[bytes]) -> Picture:
    return Picture(row, bytes(views[image["bufferView"]]), SUFFIXES[image["mimeType"]], image.get("name", ""))


def _look(material: dict[str, Any], root: dict[str, Any], pictures: list[Picture]) -> Look:
    pbr, textures = material["pbrMetallicRoughness"], root["textures"]
    slots = {
        "albedo": pbr["baseColorTexture"],
        "orm": pbr["metallicRoughnessTexture"],
        "normal": material.get("normalTexture"),
        "occlusion": material.get("occlusionTexture"),
        "emission": material.get("emissiveTexture"),
    }
    found = {name: pictures[textures[slot["index"]]["source"]] for name, slot in slots.items() if slot is not None}
    red, green, blue = material.get("emissiveFactor", (0.0, 0.0, 0.0))
    scale = float(slots["normal"].get("scale", 1.0)) if slots["normal"] else 1.0
    sampler = root["samplers"][textures[slots["albedo"]["index"]]["sampler"]]
    name, sides = material.get("name", "material"), bool(material.get("doubleSided"))
    return Look(name, sides, found, scale, (red, green, blue), sampler["wrapS"] == REPEAT)


def _primitive(primitive: dict[str, Any], arrays: list[NDArray]) -> Primitive:
    named = {name: arrays[index] for name, index in primitive["attributes"].items()}
    triangles = arrays[primitive["indices"]].reshape(-1, 3).astype(np.uint32)
    optional = named.get("NORMAL"), named.get("TANGENT")
    return Primitive(named["POSITION"], *optional, named["TEXCOORD_0"], triangles, primitive["material"])


def _nodes(nodes: list[dict[str, Any]], index: int, above: NDArray, meshes: list[list[Primitive]]) -> list[Node]:
    """The meshes of a node and of all below it, each with its matrix in the scene."""
    node = nodes[index]
    matrix = above @ np.reshape(node.get("matrix", np.eye(4)), (4, 4)).T  # stored column by column
    own = [Node(node.get("name", "mesh"), matrix, meshes[node["mesh"]])] if "mesh" in node else []
    return own + [n for child in node.get("children", []) for n in _nodes(nodes, child, matrix, meshes)]
