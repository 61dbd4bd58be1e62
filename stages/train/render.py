"""The training set: light transport of random shapes under random lights, seen whole and in crops.

Shading is linear, so light is traced once for each tile and any material is shaded on it later (`batches.py`). A
*tile* is one 64² picture: every fourth pixel of a 256² view, or a crop of every second or every single one, so that its
pixels are point samples as distillation takes them. A *shard* holds tiles that share a set of lights, and of each shape
what a material must know of it.
"""

from pathlib import Path

import numpy as np
from numpy.random import Generator, default_rng
from numpy.typing import NDArray

from stages.core.artifact import Field, Provenance, Schema, peek, save_npz
from stages.core.frames import look_at
from stages.core.progress import Progress
from stages.core.shading import KNOTS
from stages.light.gbuffer import GBuffer, trace_view
from stages.light.scene import Scene
from stages.light.transport import Quality, light_transport
from stages.material.directions import Pieces
from stages.material.surface import Surface
from stages.material.survey import POINTS, Lookup, make_survey
from stages.prior.profile import SIZE
from stages.train.lights import random_light
from stages.train.shapes import Shape, make_shape

EVEN = 2000
"""Points spread evenly over a shape, on which masks are settled."""

SHARD = Schema(
    "dreammat.shard",
    2,
    {
        "start": Field("i8", ("T1",)),  # points of tile i are start[i] ... start[i + 1] - 1, its mask's pixels in order
        "shape": Field("i4", ("T",)),
        "mask": Field("?", ("T", SIZE, SIZE)),
        "depth": Field("f4", ("T", SIZE, SIZE)),  # planar, 0 off the object
        "to_view": Field("f4", ("T", 3, 3)),  # world direction to view space
        "point": Field("f4", ("P", 3)),  # the fields of `material.surface.Surface`, from here to the piece; no labels
        "normal": Field("f4", ("P", 3)),  # world, facing the viewer
        "footprint": Field("f4", ("P",)),
        "convexity": Field("f4", ("P",)),
        "occlusion": Field("f4", ("P",)),
        "piece": Field("i4", ("P",)),
        "cosine": Field("f4", ("P",)),  # N·V
        "transport": Field("f2", ("P", "L", 1 + 2 * len(KNOTS), 3)),  # per light: E, A at the knots, B at the knots
        "even_point": Field("f4", ("H", EVEN, 3)),  # likewise, of each shape
        "even_normal": Field("f4", ("H", EVEN, 3)),
        "even_footprint": Field("f4", ("H", EVEN)),
        "even_convexity": Field("f4", ("H", EVEN)),
        "even_occlusion": Field("f4", ("H", EVEN)),
        "even_piece": Field("i4", ("H", EVEN)),
        "pieces_shape": Field("i4", ("K",)),  # the shape that each piece belongs to, in order
        "pieces_centre": Field("f4", ("K", 3)),
        "pieces_turn": Field("f4", ("K", 3, 3)),
        "pieces_radius": Field("f4", ("K",)),
        "pieces_grain": Field("f4", ("K", 3)),
    },
)

SURFACE = ("point", "normal", "footprint", "convexity", "occlusion", "piece")

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
    known: list[Lookup] = []
    while len(done) < tiles:
        shape = make_shape(rng)
        scene = Scene(shape.vertices, shape.triangles, shape.normals)
        whole = np.zeros(len(shape.triangles), np.int32)
        survey = make_survey(shape.vertices, shape.triangles, shape.normals, scene.occluded, whole, int(rng.integers(2**31)))
        known.append(Lookup(survey))
        for _ in range(2):
            c2w, fov = random_camera(shape, rng)
            view = trace_view(scene, c2w, fov, VIEW, VIEW)
            for stride in (4, int(rng.choice([2, 2, 1]))):
                tile = cut(view, stride, rng)
                if tile.mask.mean() >= SMALLEST_COVER:
                    width = stride * 2 * np.tan(fov / 2) / VIEW
                    one = render_tile(scene, tile, c2w, lights, known[-1], width, int(rng.integers(2**31)))
                    done.append({"shape": np.array(len(known) - 1, np.int32), **one})
    return pack(done[:tiles]) | shapes_of(known)


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
    scene: Scene, tile: GBuffer, c2w: NDArray, lights: list, known: Lookup, width: float, seed: int
) -> dict[str, NDArray]:
    """Arrays of one tile, as the shard's but for `start` and `shape`. Args: width: of a pixel at depth 1."""
    transports = light_transport(scene, tile, lights, TILE_RAYS, seed)
    values = [np.concatenate([t.E[:, None].numpy(), t.A.numpy(), t.B.numpy()], 1) for t in transports]
    footprint = (width * tile.depth[tile.mask]).astype(np.float32)
    surface = known.surface(tile.point.astype(np.float32), tile.n.astype(np.float32), footprint)
    return {
        "mask": tile.mask,
        "depth": np.where(tile.mask, tile.depth, 0).astype(np.float32),
        "to_view": c2w[:3, :3].T.astype(np.float32),
        **columns(surface),
        "cosine": transports[0].cosine.numpy(),
        "transport": np.minimum(np.stack(values, 1), 30000).astype(np.float16).reshape(len(tile.n), len(lights), -1, 3),
    }


def columns(surface: Surface, prefix: str = "") -> dict[str, NDArray]:
    """A surface as arrays by name."""
    return {prefix + name: getattr(surface, name) for name in SURFACE}


def pack(tiles: list[dict[str, NDArray]]) -> dict[str, NDArray]:
    """Tiles as a shard's arrays."""
    whole = ("shape", "mask", "depth", "to_view")
    arrays = {name: (np.stack if name in whole else np.concatenate)([t[name] for t in tiles]) for name in tiles[0]}
    return {"start": np.cumsum([0, *(len(t["point"]) for t in tiles)]).astype(np.int64), **arrays}


def shapes_of(known: list[Lookup]) -> dict[str, NDArray]:
    """Evenly spread points and pieces of the shapes."""
    even = [columns(lookup.survey.surface()[:POINTS : POINTS // EVEN], "even_") for lookup in known]
    pieces = [lookup.survey.pieces for lookup in known]
    counts = [len(p.centre) for p in pieces]
    return {
        **{name: np.stack([e[name] for e in even]) for name in even[0]},
        "pieces_shape": np.repeat(np.arange(len(known), dtype=np.int32), counts),
        **{f"pieces_{name}": np.concatenate([getattr(p, name) for p in pieces]) for name in Pieces._fields},
    }
