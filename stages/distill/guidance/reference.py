"""Reference guidance: the target is the known material of a textured model of the same shape.

Every shown pixel is shaded once with the field's material and once with the true one, by the same light transport
under all lights at once, and compared on a logarithmic scale. This is inverse rendering with a perfect denoiser: the
honest test of shading and gradients, and a way to carry textures over to new UVs.

Only the metallic-roughness material counts: normal maps, emission, occlusion and vertex colours of the model are ignored.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
import trimesh
from numpy.typing import NDArray
from torch import Tensor
from trimesh.visual.material import PBRMaterial

from stages.core.artifact import reason, sha256_file
from stages.core.color import srgb_decode
from stages.core.errors import InputError
from stages.core.frames import transform_points
from stages.core.shading import Material, shade
from stages.distill import schedule
from stages.distill.guidance.base import Budget, Response
from stages.distill.sampling import PixelSampler, Sample
from stages.light.scene import Scene

PIXELS = 1024
"""Pixels a step for each image of the batch: many small steps get further in a given time than few large ones."""

BUDGET = Budget(steps=10_000, learning_rate=0.02)

REACH = 5e-3
"""The reference's surface is looked for this far before and behind a seen point, world units."""

MAX_MISSED = 0.05
"""With a larger share of points off the reference's surface the two are taken for different shapes."""

CHUNK = 16384
"""Pixels whose target is shaded at once."""

HUBER = 0.1
"""Residual, in nepers of radiance, beyond which the loss grows linearly."""

PLAIN = 0.1
"""Step towards a rough dielectric where nothing else is seen. A grey of albedo c < F0 and metallic m looks exactly like its
twin of albedo F0 (1 - m) and metallic 1 - c / F0: a dark dielectric like some metal. Of such twins the duller is taken."""

FLOOR = 0.001
"""Radiance at which the logarithmic scale turns linear, as a share of the light's mean over all seen pixels. The target
holds no noise, so that what lies deep in the shade tells as much as what lies in the light."""

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


class ReferenceAsset:
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

    def material_at(self, points: NDArray, eyes: NDArray) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """The material where the line of sight meets the surface near each point.

        Args:
            points: (P, 3) world, on or near the surface. eyes: (P, 3), from where the points are seen.
        Returns:
            (P, 5) albedo, roughness, metallic; (P,) whether the surface was found within `REACH`.
        """
        sight = points - eyes
        sight = sight / np.linalg.norm(sight, axis=1, keepdims=True)
        hits = self._scene.intersect(points - REACH * sight, sight)
        found = hits.mask & (hits.t < 2 * REACH)
        uv = np.einsum("pk,pkd->pd", hits.barycentric[found], self._uv[hits.triangle[found]])
        part = self._part[hits.triangle[found]]
        values = np.zeros((len(uv), 5), np.float32)
        for i in np.unique(part):
            values[part == i] = self._parts[i].at(uv[part == i])
        result = np.zeros((len(points), 5), np.float32)
        result[found] = values
        return result, found


class ReferenceGuidance:
    """Pulls the rendered pixels towards those of the reference asset.

    Raises: InputError when the asset cannot be read or is of another shape.
    """

    def __init__(self, asset: ReferenceAsset, sampler: PixelSampler) -> None:
        truth, found = asset.material_at(sampler.points.numpy(), sampler.eyes.numpy())
        if (missed := 1 - found.mean()) > MAX_MISSED:
            raise InputError(
                f"{asset.path}: {missed:.0%} of the seen points are not on its surface; expected the shape, scale and "
                "position of the mesh that was prepared"
            )
        self.sampler = sampler
        self.inputs = {"reference": sha256_file(asset.path)}
        self.identity = {"name": "reference", "asset": asset.path.name}
        self.start: Tensor | None = None
        self.budget, self.weights = BUDGET, None
        self._found = torch.from_numpy(found)
        self._target = _target_radiance(sampler, torch.from_numpy(truth))  # (M, L, 3)
        self._floor = FLOOR * self._target.mean((0, 2))  # (L,)

    def respond(self, radiance: Tensor, sample: Sample, progress: float, generator: torch.Generator) -> Response:
        """See `Guidance.respond`; the number for the curve is the mean absolute residual, in nepers."""
        assert sample.rows is not None
        device = radiance.device
        floor = self._floor.to(device)[:, None]
        shown = radiance.view(-1, sample.lights, 3) + floor
        target = self._target.index_select(0, sample.rows).to(device) + floor
        found = self._found[sample.rows].to(device)[:, None, None]
        residual = torch.log(shown / target) * found
        weight = (HUBER / residual.abs().clamp(min=HUBER)) / residual.numel()  # 1 up to HUBER, then falling
        weight = weight * found
        gradient, curvature = weight * residual / shown, weight / shown.square()
        plain = PLAIN * schedule.plain(progress)
        return Response(gradient.flatten(0, 1), float(residual.abs().mean()), curvature.flatten(0, 1), plain)


def _target_radiance(sampler: PixelSampler, truth: Tensor) -> Tensor:
    """Radiance (M, L, 3) of the whole pool with the true material (M, 5), in float32."""
    parts = []
    for rows in torch.arange(len(truth)).split(CHUNK):
        sample, material = sampler.at(rows), truth[rows].to(sampler.device)
        radiance = shade(sample.transport, Material(material[:, :3], material[:, 3], material[:, 4]))
        parts.append(radiance.view(-1, sample.lights, 3).cpu())
    return torch.cat(parts)


def _meshes(path: Path) -> list[trimesh.Trimesh]:
    """The model's meshes with their node transforms applied."""
    if path.suffix.lower() not in (".glb", ".gltf"):
        raise InputError(f"{path}: expected a .glb or .gltf model with metallic-roughness textures")
    try:
        transformed = _EXTENSION in path.read_bytes()
        scene = trimesh.load_scene(path)
    except OSError as error:
        raise InputError(f"{path}: {reason(error)}") from error
    except Exception as error:  # the loader raises whatever a malformed file makes it trip over
        raise InputError(f"{path}: not a readable glTF model ({str(error).splitlines()[0][:120]})") from error
    if transformed:
        raise InputError(f"{path}: uses {_EXTENSION.decode()}, which is not supported; export it without")
    meshes = [mesh for mesh in scene.dump() if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces)]
    if not meshes:
        raise InputError(f"{path}: holds no triangles; expected a textured model")
    return meshes


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
