"""The training set: light transport of random shapes under random lights, seen whole and in crops.

Shading is linear, so light is traced once for each tile and any material is shaded on it later (`batches.py`). A
*tile* is one 64² picture: every fourth pixel of a 256² view, or a crop of every second or every single one, so that its
pixels are point samples as distillation takes them. A *shard* holds tiles that share a set of lights.
"""

from pathlib import Path

import numpy as np
from numpy.random import Generator, default_rng
from numpy.typing import NDArray

from stages.core.artifact import Field, Provenance, Schema, peek, save_npz
from stages.core.convexity import SurfaceSamples
from stages.core.frames import look_at, tangent_frame
from stages.core.progress import Progress
from stages.core.shading import KNOTS
from stages.light.gbuffer import GBuffer, trace_view
from stages.light.scene import Scene
from stages.light.transport import Quality, light_transport
from stages.prior.profile import SIZE
from stages.train.lights import random_light
from stages.train.shapes import Shape, make_shape

SHARD = Schema(
    "dreammat.shard",
    1,
    {
        "start": Field("i8", ("T1",)),  # points of tile i are start[i] ... start[i + 1] - 1, its mask's pixels in order
        "mask": Field("?", ("T", SIZE, SIZE)),
        "depth": Field("f4", ("T", SIZE, SIZE)),  # planar, 0 off the object
        "to_view": Field("f4", ("T", 3, 3)),  # world direction to view space
        "point": Field("f4", ("P", 3)),
        "normal": Field("f4", ("P", 3)),  # world, facing the viewer
        "cosine": Field("f4", ("P",)),  # N·V
        "convexity": Field("f4", ("P",)),
        "occlusion": Field("f4", ("P",)),
        "transport": Field("f2", ("P", "L", 1 + 2 * len(KNOTS), 3)),  # per light: E, A at the knots, B at the knots
    },
)

VIEW = 256
"""Pixels along an edge of the view that tiles are cut from."""

LIGHTS = 5
"""Environments of a shard."""

TILE_RAYS = Quality(lobe=48, light=6)
SMALLEST_COVER = 0.08
"""Tiles that show less of the object than this are not used."""


def render_shards(folder: Path, shards: int, tiles: int, seed: int, progress: Progress) -> list[Path]:
    """Write the missing shards.

    Args:
        shards: how many files. tiles: pictures in each.
    Returns:
        Their paths, in order.
    """
    paths = []
    for index in range(shards):
        path = folder / f"shard_{index:03d}.npz"
        provenance = Provenance({"tiles": tiles, "index": index}, seed, {})
        found = peek(path, SHARD) if path.exists() else None
        if found is None or not found.same_request(provenance):
            save_npz(path, SHARD, render_shard(index, tiles, seed), provenance)
        paths.append(path)
        progress("rendering training tiles", index + 1, shards)
    return paths


def render_shard(index: int, tiles: int, seed: int) -> dict[str, NDArray]:
    """Arrays of one shard; a function of index and seed."""
    rng = default_rng([seed, index])
    lights = [random_light(rng, f"light_{k}") for k in range(LIGHTS)]
    done: list[dict[str, NDArray]] = []
    while len(done) < tiles:
        shape = make_shape(rng)
        scene = Scene(shape.vertices, shape.triangles, shape.normals)
        neighbours = samples_of(shape, rng)
        for _ in range(2):
            c2w, fov = random_camera(shape, rng)
            view = trace_view(scene, c2w, fov, VIEW, VIEW)
            for stride in (4, int(rng.choice([2, 2, 1]))):
                tile = cut(view, stride, rng)
                if tile.mask.mean() >= SMALLEST_COVER:
                    done.append(render_tile(scene, tile, c2w, lights, neighbours, rng))
    return pack(done[:tiles])


def random_camera(shape: Shape, rng: Generator) -> tuple[NDArray[np.float64], float]:
    """c2w (4, 4) and vertical field of view, radians; the object reaches to 0.6-0.85 of the half frame."""
    fov = np.radians(rng.uniform(25, 45))
    azimuth, elevation = rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(-25, 55))
    back = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    c2w = look_at(back, np.zeros(3), np.array([0.0, 0.0, 1.0]))
    local = shape.vertices @ c2w[:3, :3]
    distance = (np.abs(local[:, :2]).max(1) / (np.tan(fov / 2) * rng.uniform(0.6, 0.85)) + local[:, 2]).max()
    c2w[:3, 3] = back * max(distance, local[:, 2].max() + 0.05)
    return c2w, float(fov)


def cut(view: GBuffer, stride: int, rng: Generator) -> GBuffer:
    """A tile of a view: its pixels `stride` apart from a random place, that holds part of the object."""
    reach = VIEW - stride * (SIZE - 1)  # first rows and columns that fit
    seen = np.argwhere(view.mask)
    centre = seen[rng.integers(len(seen))] if len(seen) else np.array([VIEW // 2, VIEW // 2])
    top, left = np.clip(centre - stride * SIZE // 2 + rng.integers(stride, size=2), 0, reach - 1)
    if stride * SIZE == VIEW:
        top, left = rng.integers(stride, size=2)
    window = slice(top, top + stride * SIZE, stride), slice(left, left + stride * SIZE, stride)
    order = np.full(view.mask.shape, -1, np.int64)
    order[view.mask] = np.arange(view.mask.sum())
    mask = view.mask[window]
    rows = order[window][mask]
    per_point = {
        name: getattr(view, name)[rows] for name in ("point", "origin", "n", "ng", "wo", "triangle", "barycentric")
    }
    return GBuffer(mask=mask, depth=view.depth[window], **per_point)


def render_tile(
    scene: Scene, tile: GBuffer, c2w: NDArray, lights: list, neighbours: SurfaceSamples, rng: Generator
) -> dict[str, NDArray]:
    """Arrays of one tile, as the shard's but for `start`."""
    transports = light_transport(scene, tile, lights, TILE_RAYS, int(rng.integers(2**31)))
    count = len(tile.n)
    values = [np.concatenate([t.E[:, None].numpy(), t.A.numpy(), t.B.numpy()], 1) for t in transports]
    return {
        "mask": tile.mask,
        "depth": np.where(tile.mask, tile.depth, 0).astype(np.float32),
        "to_view": c2w[:3, :3].T.astype(np.float32),
        "point": tile.point.astype(np.float32),
        "normal": tile.n.astype(np.float32),
        "cosine": transports[0].cosine.numpy(),
        "convexity": neighbours.convexity(tile.point, tile.ng),
        "occlusion": occlusion(scene, tile, rng),
        "transport": np.minimum(np.stack(values, 1), 30000).astype(np.float16).reshape(count, len(lights), -1, 3),
    }


def pack(tiles: list[dict[str, NDArray]]) -> dict[str, NDArray]:
    """Tiles as a shard's arrays."""
    whole = ("mask", "depth", "to_view")
    arrays = {name: (np.stack if name in whole else np.concatenate)([t[name] for t in tiles]) for name in tiles[0]}
    return {"start": np.cumsum([0, *(len(t["point"]) for t in tiles)]).astype(np.int64), **arrays}


def occlusion(scene: Scene, tile: GBuffer, rng: Generator, rays: int = 24) -> NDArray[np.float32]:
    """Share of cosine-weighted directions that are blocked, (P,)."""
    count = len(tile.ng)
    u = rng.random((count, rays, 2))
    radius, angle = np.sqrt(u[..., 0]), 2 * np.pi * u[..., 1]
    t, b = (axis[:, None] for axis in tangent_frame(tile.ng))
    x, y = (radius * np.cos(angle))[..., None], (radius * np.sin(angle))[..., None]
    directions = x * t + y * b + np.sqrt(1 - u[..., :1]) * tile.ng[:, None]
    blocked = scene.occluded(np.repeat(tile.origin, rays, 0), directions.reshape(-1, 3).astype(np.float32))
    return blocked.reshape(count, rays).mean(1).astype(np.float32)


def samples_of(shape: Shape, rng: Generator, count: int = 16000) -> SurfaceSamples:
    """Points spread over a shape."""
    a, b, c = (shape.vertices[shape.triangles[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).astype(np.float64)
    pick = rng.choice(len(area), count, p=area / area.sum())
    u = np.sqrt(rng.random((count, 1)))
    v = rng.random((count, 1))
    return SurfaceSamples((1 - u) * a[pick] + u * (1 - v) * b[pick] + u * v * c[pick])
