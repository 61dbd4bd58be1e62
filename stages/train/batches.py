"""Batches for training: stored transport, mixed and tinted, shaded with fresh materials.

A material costs more than to light it, so that each is seen in a few pictures of its shape, under lights of their own. A
batch is a function of tiles, seed and step alone, so a resumed run sees what an uninterrupted one would have seen.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.random import Generator, default_rng
from numpy.typing import NDArray
from torch import Tensor

from stages.core.artifact import load_npz
from stages.core.shading import KNOTS, Material, Transport, light_maps, shade
from stages.material.directions import Pieces
from stages.material.evaluate import evaluate
from stages.material.masks import settled
from stages.material.surface import Surface
from stages.prior.profile import SIZE, exposure, prepare, profile_tone
from stages.train.materials import encoded, random_coat, random_material
from stages.train.render import SHARD, SURFACE


@dataclass(frozen=True)
class Batch:
    """B pictures and what they show.

    image: (B, 3, S, S) as the model sees it. conditions: (B, 23, S, S). mask: (B, 1, S, S), 0 or 1.
    material: (B, 5, S, S) sRGB albedo, roughness, metallic. captions: B texts.
    """

    image: Tensor
    conditions: Tensor
    mask: Tensor
    material: Tensor
    captions: list[str]


@dataclass(frozen=True)
class TiledShape:
    """A shape and its T stored pictures, whose P object points lie in the order of tiles and of their masks' pixels.

    mask, depth: (T, S, S). start: (T + 1,) where each tile's points begin. normal: (P, 3) view space. transport: (P, L, 19, 3)
    float16 under each light. cosine: (P,). even: points spread evenly over the whole shape. pieces: of it.
    """

    mask: NDArray[np.bool_]
    depth: NDArray[np.float32]
    start: NDArray[np.int64]
    normal: NDArray[np.float32]
    surface: Surface
    transport: NDArray[np.float16]
    cosine: NDArray[np.float32]
    even: Surface
    pieces: Pieces


class Tiles:
    """The tiles of some shards, in memory, by shape."""

    def __init__(self, paths: list[Path]) -> None:
        self.shards = [load_npz(path, SHARD).arrays for path in paths]
        self.where = [(s, int(k)) for s, shard in enumerate(self.shards) for k in np.unique(shard["shape"])]

    def __len__(self) -> int:
        return len(self.where)

    def __getitem__(self, index: int) -> TiledShape:
        number, shape = self.where[index]
        shard = self.shards[number]
        first, last = np.searchsorted(shard["shape"], [shape, shape + 1])  # a shape's tiles follow one another
        tiles, start = slice(first, last), shard["start"][first : last + 1]
        part = slice(start[0], start[-1])
        surface, even = _surface(shard, "", part), _surface(shard, "even_", shape)
        pieces = Pieces(*(shard[f"pieces_{name}"][shard["pieces_shape"] == shape] for name in Pieces._fields))
        to_view = np.repeat(shard["to_view"][tiles], np.diff(start), 0)
        normal = np.einsum("pij,pj->pi", to_view, surface.normal)
        light = shard["transport"][part], shard["cosine"][part]
        return TiledShape(shard["mask"][tiles], shard["depth"][tiles], start - start[0], normal, surface, *light, even, pieces)


def _surface(shard: dict[str, NDArray], prefix: str, rows: slice | int) -> Surface:
    """Stored points of a shape, which has no parts."""
    stored = {name: shard[prefix + name][rows] for name in SURFACE}
    return Surface(**stored, label=np.zeros(len(stored["point"]), np.int32))


class PictureBatches(torch.utils.data.Dataset):
    """Batch number `step` of a run, by index."""

    def __init__(self, tiles: Tiles, size: int, seed: int) -> None:
        self.tiles, self.size, self.seed = tiles, size, seed

    def __getitem__(self, step: int) -> Batch:
        rng = default_rng([self.seed, 1, step])
        captions, images = list[str](), list[NDArray[np.float32]]()
        while len(captions) < self.size:
            caption, some = pictures(self.tiles[int(rng.integers(len(self.tiles)))], rng)
            captions += [caption] * len(some)
            images += some
        captions, images = captions[: self.size], images[: self.size]
        return assemble(captions, torch.from_numpy(np.stack(images)), rng)


@dataclass(frozen=True)
class CaptionBatch:
    """B phrases and the material that each calls for: sRGB albedo, roughness and metallic, (B, 5)."""

    captions: list[str]
    coats: Tensor


class CaptionBatches(torch.utils.data.Dataset):
    """Phrases of one substance and what they call for; batch number `step` of a run."""

    def __init__(self, size: int, seed: int) -> None:
        self.size, self.seed = size, seed

    def __getitem__(self, step: int) -> CaptionBatch:
        rng = default_rng([self.seed, 2, step])
        phrases, coats = zip(*(random_coat(rng) for _ in range(self.size)), strict=True)
        means = [[*(coat.color or ()), coat.roughness, coat.metallic] for coat in coats]
        return CaptionBatch(list(phrases), torch.tensor(means))


CHANNELS = {"mask": 1, "depth": 1, "normal": 3, "height": 1, "lights": 18, "radiance": 3, "material": 5}
"""Channels of a picture as `picture` lays them out."""


TILES, LIGHTINGS = 2, 2
"""In how many tiles of its shape a material is seen, and under how many lights in each."""


def pictures(shape: TiledShape, rng: Generator) -> tuple[str, list[NDArray[np.float32]]]:
    """A random material on a shape, in some of its tiles under random lights.

    Returns:
        caption, pictures of channels (32, S, S) as `CHANNELS`, zero off the object.
    """
    material = random_material(rng)
    recipe = settled(material.recipe, shape.even, shape.pieces)
    found = list[NDArray[np.float32]]()
    for tile in rng.permutation(len(shape.mask))[:TILES]:
        rows = slice(shape.start[tile], shape.start[tile + 1])
        values = np.ascontiguousarray(evaluate(recipe, shape.surface[rows], shape.pieces)[:, :5])  # (P, 5)
        found += [picture(shape, int(tile), values, rng) for _ in range(LIGHTINGS)]
    return material.caption, found


def picture(shape: TiledShape, tile: int, values: NDArray[np.float32], rng: Generator) -> NDArray[np.float32]:
    """One tile of a shape under a random light: channels (32, S, S). Args: values: (P, 5) material of the tile's points."""
    rows, mask = slice(shape.start[tile], shape.start[tile + 1]), shape.mask[tile]
    transport = random_transport(shape.transport[rows], shape.cosine[rows], rng)
    radiance = shade(transport, Material.of(torch.from_numpy(values)))
    lights = light_maps(transport).reshape(len(values), 18).numpy()
    depth, height = shape.depth[tile][mask][:, None], shape.surface.point[rows, 2:]
    parts = (np.ones_like(height), depth, shape.normal[rows], height, lights, radiance.numpy(), encoded(values))
    dense = np.zeros((sum(CHANNELS.values()), SIZE, SIZE), np.float32)
    dense[:, mask] = np.concatenate(parts, 1).T
    if rng.random() < 0.5:  # a mirrored world is as good
        dense = dense[..., ::-1].copy()
        dense[2] *= -1
    return dense


def random_transport(stored: NDArray[np.float16], cosine: NDArray[np.float32], rng: Generator) -> Transport:
    """One of the tile's lights or two of them, each in a random colour; light is linear, so this is a light, too."""
    picks = rng.permutation(stored.shape[1])[: 1 + int(rng.random() < 0.5)]
    mixed = sum(stored[:, k].astype(np.float32) * random_gain(rng) for k in picks)
    values = torch.from_numpy(mixed)  # (P, 19, 3)
    k = len(KNOTS)
    return Transport(values[:, 0], values[:, 1 : 1 + k], values[:, 1 + k :], torch.from_numpy(cosine))


def random_gain(rng: Generator) -> NDArray[np.float32]:
    """Intensity and tint of a light, (3,)."""
    return np.exp(rng.normal(0, 0.6) + rng.normal(0, 0.12, 3)).astype(np.float32)


def assemble(captions: list[str], dense: Tensor, rng: Generator) -> Batch:
    """Pictures as the model wants them. Args: dense (B, 32, S, S) as `CHANNELS`."""
    mask, depth, normal, height, lights, radiance, material = dense.split(list(CHANNELS.values()), 1)
    jitter = torch.from_numpy(np.exp(rng.normal(0, 0.25, (len(captions), 1, 1, 1))).astype(np.float32))
    exposed = exposure(lights, mask) * jitter
    conditions = prepare(depth, normal, height, mask, lights * exposed)
    return Batch(profile_tone(radiance * exposed), conditions, mask, material, captions)
