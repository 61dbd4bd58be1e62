"""preview.png of a swatch: a sphere and a tilted plate under three lights, and the tile itself, repeated and close by."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, maximum_filter, minimum_filter

from stages.asset.maps import Maps
from stages.core.color import srgb_encode
from stages.core.frames import camera_rays, look_at
from stages.core.parallel import in_parallel
from stages.core.tangents import mikktspace
from stages.light.gbuffer import trace_view
from stages.light.known import reflected
from stages.light.lights import BUILTIN
from stages.light.lookup import REPEAT, look_up
from stages.light.normal_maps import NormalMap, NormalMaps
from stages.light.scene import Scene
from stages.light.transport import Quality, cached_light_set
from stages.swatch.kernels import shrunk

LIGHTS = ("studio", "clear_sky", "interior")
FOV_Y = np.radians(26.0)
EXPOSURE = 1.15
"""Radiance in the picture of a white diffuse plate, on average."""

BACKDROP = 0.11
RAYS = Quality(lobe=16, light=8, extra=False)
"""Few: on a sphere and a plate nothing stands in the light."""

FEW = Quality(lobe=2, light=1, extra=False, smooth=False)
"""Enough for the mean of a picture."""

SEGMENTS = 64
AROUND = 2
"""How often the tile goes around the sphere."""


class Thing(NamedTuple):
    """A mesh with UVs: vertices and their normals (V, 3), triangles (T, 3), uv (T, 3, 2) v up, camera (4, 4)."""

    vertices: NDArray[np.float32]
    normals: NDArray[np.float32]
    triangles: NDArray[np.int32]
    uv: NDArray[np.float32]
    c2w: NDArray[np.float64]


def preview(maps: Maps, size: int) -> NDArray[np.float32]:
    """Encoded sRGB, (3 size, 3 size, 3). Args: maps: of a tile. size: pixels along each edge of a picture."""
    shown, normal = shrunk(maps.material, size), shrunk(_normals(maps), max(size, 256))
    material = shown if size >= 256 else shrunk(maps.material, 256)
    lights = [BUILTIN[name]() for name in LIGHTS]
    cached_light_set(tuple(lights))  # once, not in every thread
    rows = in_parallel(lambda thing: _pictures(thing, lights, material, normal, size), (sphere(), plate()))
    albedo = srgb_encode(shown[..., :3])
    repeated = np.tile(srgb_encode(shrunk(maps.albedo, -(-size // 2))), (2, 2, 1))[:size, :size]
    close = srgb_encode(maps.albedo[:size, :size]) if len(maps.albedo) >= size else albedo
    rough = np.repeat(shown[..., 3:4], 3, 2)
    last = [repeated, close, rough]
    return np.concatenate([*(np.concatenate(row, 1) for row in rows), np.concatenate(last, 1)], 0).astype(np.float32)


def _normals(maps: Maps) -> NDArray[np.float32]:
    flat = np.array([0, 0, 1], np.float32)
    return maps.normal if maps.normal is not None else np.broadcast_to(flat, maps.albedo.shape)


def _pictures(thing: Thing, lights: list, material: NDArray, normal: NDArray, size: int) -> list[NDArray[np.float32]]:
    """The thing under each light, encoded, (size, size, 3) each."""
    down = thing.uv * (1, -1) + (0, 1)
    normals, of_map = thing.normals[thing.triangles], np.zeros(len(thing.triangles), np.int32)
    tangents = mikktspace(thing.vertices[thing.triangles], normals, thing.uv)
    scene = Scene(thing.vertices, thing.triangles, normals, NormalMaps([NormalMap(normal)], of_map, down, tangents))
    hits = trace_view(scene, thing.c2w, float(FOV_Y), size, size)
    cover = covered(scene, thing.c2w, hits.mask)
    uv = np.einsum("pk,pkd->pd", hits.barycentric, down[hits.triangle])
    values = look_up(material, uv, wrap=(REPEAT, REPEAT))
    some = hits[np.arange(0, len(values), 16)]
    white = np.broadcast_to(np.array([1, 1, 1, 1, 0], np.float32), (len(some.n), 5))
    brightness = reflected(scene, some, lights, white, FEW, seed=0).mean((1, 2))
    pictures = []
    for radiance, even in zip(reflected(scene, hits, lights, values, RAYS, seed=0), brightness, strict=True):
        shown = (EXPOSURE / max(float(even), 1e-9) * 0.6) * radiance
        color = shown[nearest_hit(hits.mask)]
        pictures.append(srgb_encode(color * cover + BACKDROP * (1 - cover)))
    return pictures


def covered(scene: Scene, c2w: NDArray, mask: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Share of each pixel that the thing fills, (H, W, 1), of two samples along each edge where its outline runs.

    Args: mask: (H, W), which pixels it fills at their centres.
    """
    share = mask.astype(np.float32)
    size = len(mask)
    row, column = np.nonzero(maximum_filter(mask, 3) & ~minimum_filter(mask, 3))
    _, directions = camera_rays(c2w, float(FOV_Y), 2 * size, 2 * size)
    fine = directions.reshape(size, 2, size, 2, 3)[row, :, column].reshape(-1, 3)
    origins = np.broadcast_to(c2w[:3, 3].astype(np.float32), fine.shape)
    share[row, column] = scene.intersect(origins, fine).mask.reshape(-1, 4).mean(1)
    return share[..., None]


def nearest_hit(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """For each pixel the number of the hit one nearest to it. Args: (H, W). Returns: (H, W)."""
    row, column = distance_transform_edt(~mask, return_distances=False, return_indices=True)
    return (np.cumsum(mask) - 1).reshape(mask.shape)[row, column]


def sphere() -> Thing:
    """A sphere of diameter 1, around which the tile goes `AROUND` times."""
    theta, phi = np.linspace(0.02, np.pi - 0.02, SEGMENTS + 1), np.linspace(0, 2 * np.pi, 2 * SEGMENTS + 1)
    t, p = np.meshgrid(theta, phi, indexing="ij")
    n = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1)
    uv = np.stack([AROUND * p / (2 * np.pi), AROUND / 2 * (1 - t / np.pi)], -1)
    return Thing(*_grid(n / 2, n, uv), _camera((-2.4, -0.35, 0.75)))


def plate() -> Thing:
    """A square of edge 1 that leans back, so that light rakes over it."""
    a, b = np.meshgrid(np.linspace(-0.5, 0.5, 9), np.linspace(-0.5, 0.5, 9), indexing="ij")
    c, s = np.cos(0.9), np.sin(0.9)
    p = np.stack([s * b, -a, c * b], -1)
    n = np.broadcast_to(np.array([-c, 0.0, s]), p.shape)
    return Thing(*_grid(p, n, np.stack([a + 0.5, b + 0.5], -1)), _camera((-2.1, 0.25, 1.35)))


def _camera(eye: tuple[float, float, float]) -> NDArray[np.float64]:
    return look_at(np.array(eye), np.zeros(3), np.array([0.0, 0.0, 1.0]))


def _grid(p: NDArray, n: NDArray, uv: NDArray) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int32], NDArray]:
    """Vertices, normals, triangles and their UVs of a grid of points, wound so that they face along n."""
    rows, columns = n.shape[:2]
    number = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], 2).reshape(-1, 3)
    vertices, normals, coordinates = (values.reshape(rows * columns, -1).astype(np.float32) for values in (p, n, uv))
    corners = vertices[triangles]
    if (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) * normals[triangles[:, 0]]).sum() < 0:
        triangles = triangles[:, ::-1].copy()
    return vertices, normals, triangles, coordinates[triangles]
