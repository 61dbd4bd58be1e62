"""A textured model: the metallic-roughness material of each point of its surface.

Normal maps, emission, occlusion and vertex colours are ignored.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.visual.material import PBRMaterial

from stages.core.artifact import reason
from stages.core.beside import beside
from stages.core.color import srgb_decode
from stages.core.errors import InputError, one_line
from stages.core.frames import transform_points
from stages.light.scene import Scene

REACH = 5e-3
"""The model's surface is looked for this far before and behind a seen point, world units, unless told otherwise."""

_SRGB = srgb_decode(np.arange(256) / 255.0).astype(np.float32)
_BYTE = (np.arange(256) / 255.0).astype(np.float32)
_EXTENSION = b"KHR_texture_transform"


@dataclass(frozen=True)
class _Part:
    """Textures of one material, (H, W, C) uint8 or None, and the factors they are multiplied by."""

    base: NDArray[np.uint8] | None
    base_factor: NDArray[np.float32]
    orm: NDArray[np.uint8] | None
    roughness_factor: float
    metallic_factor: float

    def at(self, uv: NDArray) -> NDArray[np.float32]:
        """Albedo, roughness and metallic (K, 5) at uv (K, 2), v up."""
        result = np.empty((len(uv), 5), np.float32)
        result[:, :3] = self.base_factor
        result[:, 3], result[:, 4] = self.roughness_factor, self.metallic_factor
        if self.base is not None:
            result[:, :3] *= bilinear(self.base, uv, _SRGB)[:, :3]
        if self.orm is not None:
            result[:, 3:] *= bilinear(self.orm, uv, _BYTE)[:, 1:3]
        return result.clip(0.0, 1.0)


def bilinear(texture: NDArray[np.uint8], uv: NDArray, decode: NDArray[np.float32]) -> NDArray[np.float32]:
    """Bilinear look-up of a repeating texture, each texel decoded before it is blended.

    Args:
        texture: (H, W, C). uv: (K, 2), v up. decode: (256,) value of each stored byte.
    Returns:
        (K, C).
    """
    height, width, _ = texture.shape
    x, y = uv[:, 0] * width - 0.5, (1.0 - uv[:, 1]) * height - 0.5
    column, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    fx, fy = (x - column)[:, None], (y - row)[:, None]

    def texel(i: NDArray, j: NDArray) -> NDArray[np.float32]:
        return decode[texture[i % height, j % width]]

    top = texel(row, column) * (1 - fx) + texel(row, column + 1) * fx
    bottom = texel(row + 1, column) * (1 - fx) + texel(row + 1, column + 1) * fx
    return (top * (1 - fy) + bottom * fy).astype(np.float32)


class TexturedModel:
    """A textured model in the world frame. Raises: InputError when it is unreadable or has no material.

    Args:
        path: a glTF file. to_world: (4, 4) from its frame, node transforms applied, to the world.
    """

    def __init__(self, path: Path, to_world: NDArray) -> None:
        self.path = path
        self._parts: list[_Part] = []
        vertices: list[NDArray] = []
        triangles, uv, part = [], [], []
        for mesh in _meshes(path):
            triangles.append(np.asarray(mesh.faces) + sum(len(v) for v in vertices))
            vertices.append(transform_points(to_world, np.asarray(mesh.vertices, np.float64)))
            uv.append(_uv(mesh)[mesh.faces])
            part.append(np.full(len(mesh.faces), len(self._parts)))
            self._parts.append(_part(path, mesh))
        corners = np.concatenate(triangles)
        self._uv, self._part = np.concatenate(uv), np.concatenate(part)
        self._scene = Scene(np.concatenate(vertices), corners, np.zeros((*corners.shape, 3)))

    def material_at(
        self, points: NDArray, eyes: NDArray, reach: float = REACH
    ) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """The material where the line of sight meets the surface near each point.

        Args:
            points: (P, 3) world, on or near the surface. eyes: (P, 3), from where the points are seen. reach: how far
            before and behind a point the surface is looked for.
        Returns:
            (P, 5) albedo, roughness, metallic; (P,) whether the surface was found.
        """
        sight = points - eyes
        sight = sight / np.linalg.norm(sight, axis=1, keepdims=True)
        hits = self._scene.intersect(points - reach * sight, sight)
        found = hits.mask & (hits.t < 2 * reach)
        uv = np.einsum("pk,pkd->pd", hits.barycentric[found], self._uv[hits.triangle[found]])
        part = self._part[hits.triangle[found]]
        values = np.zeros((len(uv), 5), np.float32)
        for i in np.unique(part):
            values[part == i] = self._parts[i].at(uv[part == i])
        result = np.zeros((len(points), 5), np.float32)
        result[found] = values
        return result, found


def _meshes(path: Path) -> list[trimesh.Trimesh]:
    """The model's meshes with their node transforms applied."""
    if path.suffix.lower() not in (".glb", ".gltf"):
        raise InputError(f"{path}: expected a .glb or .gltf model with metallic-roughness textures")
    try:
        transformed = _EXTENSION in path.read_bytes()
        _expect_companions(path)
        parts = trimesh.load_scene(path).dump()
    except OSError as error:
        raise InputError(f"{path}: {reason(error)}; expected a textured .glb or .gltf model") from error
    except InputError:
        raise
    except Exception as error:  # the loader raises whatever a malformed file makes it trip over
        raise InputError(f"{path}: not a readable glTF model ({one_line(error)}); export it again") from error
    if transformed:
        raise InputError(f"{path}: uses {_EXTENSION.decode()}, which is not supported; export it without")
    meshes = [mesh for mesh in parts if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces)]
    if not meshes:
        raise InputError(f"{path}: holds no triangles; expected a textured model")
    return meshes


def _expect_companions(path: Path) -> None:
    """Whether the files that a .gltf names may be read; the loader opens any. Raises: InputError; ValueError."""
    if path.suffix.lower() == ".gltf":
        root = json.loads(path.read_bytes())
        for entry in [*root.get("buffers", []), *root.get("images", [])]:
            if not entry.get("uri", "data:").startswith("data:"):
                beside(path, entry["uri"])


def _uv(mesh: trimesh.Trimesh) -> NDArray[np.float64]:
    uv = getattr(mesh.visual, "uv", None)
    return np.zeros((len(mesh.vertices), 2)) if uv is None else np.asarray(uv, np.float64)


def _part(path: Path, mesh: trimesh.Trimesh) -> _Part:
    material = getattr(mesh.visual, "material", None)
    if not isinstance(material, PBRMaterial):
        raise InputError(f"{path}: a part has no metallic-roughness material; expected a textured model")
    colour = material.baseColorFactor
    factor = np.ones(3) if colour is None else _BYTE[np.asarray(colour, np.uint8)[:3]]
    return _Part(
        _texels(material.baseColorTexture),
        factor.astype(np.float32),
        _texels(material.metallicRoughnessTexture),
        _factor(material.roughnessFactor),
        _factor(material.metallicFactor),
    )


def _factor(value: Any) -> float:
    """glTF's default for a factor that is not given is 1."""
    return 1.0 if value is None else float(value)


def _texels(image: Any) -> NDArray[np.uint8] | None:
    return None if image is None else np.asarray(image.convert("RGB"))
