"""A small conditions folder made from formulas: a sphere of diameter 1 under lights that brighten towards one side."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
import trimesh
from numpy.typing import NDArray
from PIL import Image

from stages.core.albedo import specular_albedo
from stages.core.artifact import Provenance, save_npz, write_manifest
from stages.core.frames import camera_rays, look_at
from stages.core.schemas import CAMERAS, CONDITIONS, SURVEY
from stages.core.shading import KNOTS, Transport, light_maps
from stages.core.views import SD, Geometry, view_folder, write_geometry, write_light_maps, write_transport
from stages.material import survey
from stages.material.directions import WHOLE
from stages.material.survey import Survey

RADIUS = 0.5
FOV = np.radians(35.0)
DISTANCE = 2.4
LIGHTS: dict[str, tuple[NDArray, NDArray]] = {  # name -> (towards, colour)
    "left": (np.array([0.6, -0.8, 0.0]), np.array([1.0, 0.9, 0.7])),
    "above": (np.array([0.1, 0.2, 0.97]), np.array([0.6, 0.8, 1.1])),
    "front": (np.array([0.9, 0.3, 0.3]), np.array([0.8, 0.8, 0.8])),
}


def sphere_view(c2w: NDArray, size: int) -> tuple[Geometry, NDArray, NDArray]:
    """Geometry of the sphere from a camera; unit normal and direction to the viewer of its pixels (P, 3), world."""
    origins, directions = camera_rays(c2w, FOV, size, size)
    a, b = (directions**2).sum(-1), (origins * directions).sum(-1)
    disc = b**2 - a * ((origins**2).sum(-1) - RADIUS**2)
    mask = disc > 0
    t = (-b - np.sqrt(disc.clip(0))) / a
    n = (origins + t[:, None] * directions)[mask] / RADIUS
    wo = -directions[mask] / np.linalg.norm(directions[mask], axis=-1, keepdims=True)
    normal = np.zeros((size * size, 3), np.float32)
    normal[mask] = n @ c2w[:3, :3]
    depth = np.where(mask, t, 0).astype(np.float32).reshape(size, size)
    label = np.zeros(size * size, np.int32)
    label[mask] = label_at(origins[mask] + t[mask, None] * directions[mask])
    return Geometry(mask.reshape(size, size), depth, normal.reshape(size, size, 3), label.reshape(size, size)), n, wo


def label_at(point: NDArray) -> NDArray[np.int32]:
    """The upper half of the sphere is one part, the lower another."""
    return (point[:, 2] > 0).astype(np.int32)


PARTS = [
    {"number": 1, "kind": "slot", "name": "lower", "share": 0.5, "labels": [0]},
    {"number": 2, "kind": "slot", "name": "upper", "share": 0.5, "labels": [1]},
    {"number": 3, "kind": "slot", "name": "hair", "share": 0.0, "labels": [2]},
    {"number": 4, "kind": "piece", "name": "", "share": 1.0, "labels": [0, 1, 2]},
]
"""Those of the sphere; of one nothing can be seen."""


def gradient_light(name: str, n: NDArray, wo: NDArray) -> Transport:
    """Transport under L(w) = colour (0.6 + 0.5 w · towards), a rough lobe seeing less of the slope; no shadows."""
    towards, colour = LIGHTS[name]
    cosine = (n * wo).sum(-1).clip(1e-3, 1)
    mirror = 2 * cosine[:, None] * n - wo
    albedo = torch.stack([specular_albedo(torch.full((len(n),), r), torch.from_numpy(cosine).float()) for r in KNOTS], 1)
    slope = 0.5 * (1 - 0.8 * np.array(KNOTS) ** 2)
    light = torch.from_numpy((0.6 + (mirror @ towards)[:, None] * slope)[..., None] * colour).float()  # (P, K, 3)
    E = torch.from_numpy(0.9 * (0.6 + 0.5 * 2 / 3 * (n @ towards))[:, None] * colour).float()
    return Transport(E, light * albedo[..., :1], light * albedo[..., 1:], torch.from_numpy(cosine).float())


def write_conditions(folder: Path, views: int = 4, size: int = 24, profile: str = "gltf", extent: float = 1.0) -> Path:
    """Write the folder; four cameras or more on a ring, alternately above and below. extent: of the sphere in its source.

    The light maps of the profile sd are twice as bright as glTF's, and its normals point to the viewer.
    """
    azimuth = np.arange(views) / views * 2 * np.pi
    elevation = np.where(np.arange(views) % 2, -0.3, 0.5)
    direction = [np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)]
    c2w = look_at(DISTANCE * np.stack(direction, -1), np.zeros(3), np.array([0.0, 0, 1]))
    folder.mkdir(parents=True, exist_ok=True)
    cameras = {"c2w": c2w, "fov_y": np.full(views, FOV), "width": np.array(size, "i4"), "height": np.array(size, "i4")}
    made = Provenance({"views": views, "size": size}, 0, {"prep": "0" * 64})
    save_npz(folder / "cameras.npz", CAMERAS, cameras, made)
    save_npz(folder / "survey.npz", SURVEY, sphere_survey().to_arrays(), made)
    files = ["cameras.npz", "survey.npz"]
    for view in range(views):
        geometry, n, wo = sphere_view(c2w[view], size)
        write_geometry(folder, view, geometry)
        for name in LIGHTS:
            write_transport(folder, view, name, geometry.mask, gradient_light(name, n, wo))
            if profile == SD:
                write_light_maps(folder, view, name, geometry.mask, 2 * light_maps(gradient_light(name, n, wo)), SD)
        if profile == SD:
            towards = np.where(geometry.mask[..., None], np.array([0.0, 0, 1]), 0).astype(np.float32)
            write_geometry(folder, view, dataclasses.replace(geometry, normal=towards), SD)
        folders = [view_folder(view), *([f"{view_folder(view)}/{SD}"] if profile == SD else [])]
        files += [f"{place}/{name}.exr" for place in folders for name in ("geometry", *LIGHTS)]
    extra = {"environments": list(LIGHTS), "views": views, "knots": list(KNOTS), "clamped": {}, "profile": profile}
    extra |= {"parts": PARTS, "shared_labels": [], "bounces": 0}
    extra["to_world"] = [x / extent for x in identity()[:-1]] + [1.0]
    write_manifest(folder, CONDITIONS, Provenance(made.options, 0, made.inputs, extra), files)
    return folder


def sphere_survey() -> Survey:
    """Points spread evenly over the sphere, in a spiral; no ray meets it."""
    count = 4000
    z = 1 - (2 * np.arange(count) + 1) / count
    angle = np.arange(count) * np.pi * (3 - np.sqrt(5))
    normal = np.stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z], 1).astype(np.float32)
    point, zero = np.float32(RADIUS) * normal, np.zeros(count, np.float32)
    order = np.random.default_rng(0).permutation(count)  # its first ones are evenly spread, too
    shape = survey.convexity(point, normal, survey.neighbours(point))
    label = label_at(point[order])
    return Survey(point[order], normal[order], shape[order], zero, np.zeros(count, np.int32), label, WHOLE)


def identity() -> list[float]:
    """A 4 x 4 identity, row by row."""
    return [float(x) for x in np.eye(4).ravel()]


def write_sphere_model(path: Path, colour: Callable[[NDArray], NDArray], orm: Callable[[NDArray], NDArray]) -> Path:
    """A textured GLB of the sphere. colour, orm: (H,) height in [0, 1] to (H, 3) bytes of its textures, by height."""
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=RADIUS)
    v = 1 - (np.arange(64) + 0.5) / 64  # the top row is v = 1
    height = (v - 0.1) / 0.8  # kept off the border, where the texture repeats
    textures = [Image.fromarray(np.repeat(f(height)[:, None], 4, 1).clip(0, 255).astype(np.uint8)) for f in (colour, orm)]
    material = trimesh.visual.material.PBRMaterial(
        baseColorTexture=textures[0], metallicRoughnessTexture=textures[1], metallicFactor=1.0, roughnessFactor=1.0
    )
    uv = np.stack([np.full(len(mesh.vertices), 0.5), 0.1 + 0.8 * (mesh.vertices[:, 2] + 0.5)], -1)
    mesh.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    path.write_bytes(trimesh.Scene(mesh).export(file_type="glb"))
    return path


def painted_sphere(path: Path) -> Path:
    """A model that is red, rough and dielectric below and fades to smooth gold-coloured metal above."""

    def colour(height: NDArray) -> NDArray:
        return np.stack([200 + 30 * height, 60 + 130 * height, 50 + 60 * height], -1)

    def orm(height: NDArray) -> NDArray:
        return np.stack([255 + 0 * height, 200 - 120 * height, 255 * (height > 0.5)], -1)

    return write_sphere_model(path, colour, orm)
