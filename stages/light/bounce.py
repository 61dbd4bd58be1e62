"""Light maps as the released ControlNet was shown them: Blender's Principled, with one bounce over the white surface itself.

A lobe ray that hits the surface sees what that point sends back: its own direct light, shaded with the material of the map
in question. Blender lets a path take one diffuse and one glossy bounce; of those with both, which carry little where
the dielectric is dark and the metal has no diffuse lobe, none is traced.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.core.frames import tangent_frame
from stages.core.parallel import cores
from stages.core.shading import LIGHT_MAPS
from stages.light import reconstruction
from stages.light.blender import lifted
from stages.light.environment import Environment
from stages.light.gbuffer import GBuffer, surface_points
from stages.light.light_set import MAX_LIGHTS, LightSet
from stages.light.scene import Scene
from stages.light.terms import BLENDER, Terms
from stages.light.transport import Quality, Rays, Sums, cached_light_set, gather, smoothed, starts, tiles, trace
from stages.light.transport_kernels import accumulate_bounce

THERE = Quality(6, 4, extra=False, smooth=False, averaged=True)
"""Rays of a point that is seen so: few, for many such points are averaged."""

CHUNK = 16384
"""Points whose hits are shaded together."""

SEED_STEP = 0xB0CE
"""Between the seed of a point's rays and that of those that may bounce."""


def blender_light_maps(
    scene: Scene, points: GBuffer, environments: list[Environment], quality: Quality, seed: int, terms: Terms = BLENDER
) -> list[Tensor]:
    """The six light maps of a view's points under each environment: (P, 6, 3) float32, linear radiance."""
    points = lifted_points(points)
    near, result = reconstruction.Neighbours.of(points), []
    for first in range(0, len(environments), MAX_LIGHTS):
        some = environments[first : first + MAX_LIGHTS]
        lights = cached_light_set(tuple(some))
        sums = gather(scene, points, lights, quality, seed, near, terms)
        add_bounce(sums, scene, points, lights, Quality(quality.lobe, 0), seed + SEED_STEP, near, terms)
        maps = torch.from_numpy(light_maps(smoothed(sums, points, lights, near, terms)))
        result += [maps[..., 3 * e : 3 * e + 3].contiguous() for e in range(len(some))]
    return result


def lifted_points(points: GBuffer) -> GBuffer:
    """The same with normals as Cycles shades with them, see `blender.lifted`."""
    return replace(points, n=lifted(points.n, points.ng, points.wo))


def light_maps(sums: NDArray[np.float32]) -> NDArray[np.float32]:
    """The maps in the order of `LIGHT_MAPS`, (P, 6, CHANNELS), of the sums of `BLENDER`."""
    maps = sums[:, : len(LIGHT_MAPS)].copy()
    maps[:, 0] += sums[:, len(LIGHT_MAPS)]
    return maps


def add_bounce(
    sums: Sums,
    scene: Scene,
    points: GBuffer,
    lights: LightSet,
    quality: Quality,
    seed: int,
    near: reconstruction.Neighbours,
    terms: Terms,
) -> None:
    """Add the light that comes by way of the surface itself, in place."""
    mean, gap = np.zeros((2, *sums.mean.shape), np.float32)
    rays = Rays.plan(quality, lights, seed, terms)
    pixel, order = tiles(points.mask)
    parts = [order[start : start + CHUNK] for start in range(0, len(order), CHUNK)]
    with ThreadPoolExecutor(cores()) as pool:
        list(pool.map(lambda part: _chunk(scene, points, lights, terms, rays, pixel[part], part, mean, gap), parts))
    sums.mean[:] += mean
    sums.variance[:] += reconstruction.variance(gap, near)


def _chunk(
    scene: Scene,
    points: GBuffer,
    lights: LightSet,
    terms: Terms,
    rays: Rays,
    pixel: NDArray,
    part: NDArray,
    mean: NDArray,
    gap: NDArray,
) -> None:
    """What some points see of the surface, added to rows `part` of `mean` and `gap`."""
    n, wo = points.n[part], points.wo[part]
    frame, alphas = (n, *tangent_frame(n)), terms.alphas(part)
    unused = np.zeros((len(part), len(lights.cells.energy)), np.float32)
    drawn = rays.draw(frame, wo, starts(points, part), pixel, alphas, lights, unused)
    hits = scene.intersect(drawn.origin, drawn.direction)
    if not hits.mask.any():
        return
    hit = np.where(hits.mask, np.cumsum(hits.mask) - 1, -1).astype(np.int32)
    count = int(hits.mask.sum())
    pixels = np.arange(8 * -(-count // 8)).reshape(8, -1) < count  # eight rows: neighbours' samples complement each other
    there = lifted_points(surface_points(scene, hits, drawn.direction, pixels))
    maps = light_maps(trace(scene, there, lights, THERE, rays.seed + SEED_STEP, terms).mean)
    shown = np.ascontiguousarray(maps[:, terms.summed])
    sampled = (rays.counts, rays.bounds, rays.slots, terms.principled)
    where = (part, terms.summed)
    albedo = rays.albedo(terms, (n * wo).sum(-1).astype(np.float64), part)
    accumulate_bounce(*frame, wo, alphas, sampled, drawn, hit, shown, albedo, where, mean, gap)
    mirrored = hit[drawn.row[:, -1]]
    seen = mirrored >= 0
    cosine = (n[seen] * wo[seen]).sum(-1, keepdims=True).astype(np.float64).clip(0, 1)
    metal, dielectric = terms.mirror_weights(cosine)
    mean[part[seen], terms.mirror[0]] += metal * maps[mirrored[seen], terms.mirror[0]]
    mean[part[seen], terms.mirror[1]] += dielectric * maps[mirrored[seen], 0]
