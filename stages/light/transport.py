"""Light transport E, A(r), B(r) of a view's points, with shadows, for several environments from one set of rays.

    E    = ∫ L v (1 - F_d) N·L / π dw             F_d = 0.04 + 0.96 s,  s = (1 - V·H)^5
    A(r) = ∫ L v (1 - s) D_r G_r / (4 N·V) dw     the specular part that F0 multiplies
    B(r) = ∫ L v      s  D_r G_r / (4 N·V) dw     the Fresnel part

How. Visibility depends on neither light nor material, so each point traces one set of directions and every ray serves
every term, every roughness and every environment:

- a ray along the mirror direction gives roughness 0 exactly;
- rays drawn from the cosine lobe and from the visible-normal lobe of each roughness are weighted by the density of the
  whole mixture (multiple importance sampling, balance heuristic). Each looks up the bounded part of the light in a
  prefiltered pyramid, at an eighth of the solid angle the ray stands for. The sum is divided by the sum of its own weights and
  multiplied by the exact unoccluded albedo, so an evenly lit open point has no error at all;
- what rises above the bound (a sun, a lamp) has rays of its own, aimed at what the point would reflect most of, and
  combined with the lobe rays by the same balance heuristic, so neither a tiny sun nor a sharp lobe sparkles;
- neighbouring pixels use complementary samples; the points that turn out noisiest trace more; and what noise is left is
  averaged over neighbours that do not differ by more than it (`stages.light.reconstruction`).

These errors fall as rays are added. What stays is the resolution of the lights, 0.4 degrees (`stages.light.light_set`), under
what roughness 0.08 spreads; a mirror looks up the light itself. The result depends on seed and pixel only, not on threads.
`stages.light.reference` is the obvious form.

Source: Veach 1997, ch. 9 (MIS); Křivánek & Colbert 2008, "Real-time Shading with Filtered Importance Sampling"; Keller &
Heidrich 2001, "Interleaved Sampling".
"""

import functools
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray

from stages.core.albedo import MIN_COSINE, cosines, diffuse_table, specular_albedo
from stages.core.brdf import alpha_from_roughness
from stages.core.frames import tangent_frame
from stages.core.shading import KNOTS, Transport
from stages.light import reconstruction
from stages.light.environment import Environment, lookup
from stages.light.gbuffer import GBuffer
from stages.light.light_set import CHANNELS, MAX_LIGHTS, LightSet, light_set
from stages.light.scene import Scene
from stages.light.transport_kernels import CLASSES, GOLDEN, accumulate, aim, draw, hashed, interleaved_shifts

TILE = 512
"""Points a thread takes at once: their rays stay in its cache."""

STORED = 2 * len(KNOTS) + 1
"""Sums a point keeps: E, then A and B of every knot."""

MIRROR = (1, 1 + len(KNOTS))
"""Where among them roughness 0 is. It is looked up, not summed."""

JUDGED = [0, 1 + KNOTS.index(0.5), 1 + KNOTS.index(1.0)]
"""E and A at roughness 0.5 and 1, by which noise is judged: all that a picture of a rough thing is made of."""

SHARP = [m + 1 for m in MIRROR]
"""The least rough lobe, which shows edges that no neighbour knows of: left as it was traced."""

SUMMED = np.array([j for j in range(STORED) if j not in MIRROR])


@dataclass(frozen=True)
class Quality:
    """How many rays a point traces: `lobe` for the mixture of lobes, `light` for the excess of an average environment.

    The noisiest points trace more, see EXTRA, and what noise is left is smoothed, unless switched off.
    """

    lobe: int
    light: int
    extra: bool = True
    smooth: bool = True

    def scaled(self, factor: float) -> "Quality":
        """About `factor` times as many rays."""
        return replace(self, lobe=max(2, round(self.lobe * factor)), light=max(2, round(self.light * factor)))


EXTRA = ((0.1, 3.0), (0.012, 12.0))
"""Rounds of further rays: for which share of the points, the noisiest by then, and how many times what all began with."""

SEED_STEP = 0x5EED
"""Between the seed of a point's rays and that of its further ones."""

EVEN = 0.35
"""Share of the light rays that is not given out by demand."""

QUALITY = {"draft": Quality(20, 8), "standard": Quality(44, 18), "high": Quality(240, 100)}

LOBE_SHARES = np.array([0.22, 0.03, 0.05, 0.08, 0.11, 0.14, 0.14, 0.12, 0.11])
"""Share of the lobe rays: the cosine lobe, then each knot but the mirror."""

AIM = np.array([alpha_from_roughness(r) for r in (0.5, 1.0)], np.float32)
"""Glossy lobes that light rays are aimed for, beside the diffuse one."""


@dataclass(frozen=True)
class Sums:
    """What a point gathers, for all environments: (P, STORED, CHANNELS) float32, and the variance of each.

    rays: (P,) float32, traced for a point, as a multiple of what every point begins with.
    """

    mean: NDArray[np.float32]
    variance: NDArray[np.float32]
    rays: NDArray[np.float32]


def light_transport(
    scene: Scene, points: GBuffer, environments: list[Environment], quality: Quality, seed: int
) -> list[Transport]:
    """Transport of every point of a view under each environment.

    Returns:
        One Transport a light, (P, ...) float32, linear radiance for a white surface.
    """
    result: list[Transport] = []
    for first in range(0, len(environments), MAX_LIGHTS):
        lights = cached_light_set(tuple(environments[first : first + MAX_LIGHTS]))
        result += integrate(scene, points, lights, quality, seed)
    return result


_light_sets: dict[tuple[int, ...], LightSet] = {}


def cached_light_set(environments: tuple[Environment, ...]) -> LightSet:
    """The light set of these very objects, kept for the next view (the last two sets are)."""
    key = tuple(id(e) for e in environments)
    if key not in _light_sets or _light_sets[key].environments != environments:
        while len(_light_sets) > 1:
            _light_sets.pop(next(iter(_light_sets)))
        _light_sets[key] = light_set(list(environments))
    return _light_sets[key]


def integrate(scene: Scene, points: GBuffer, lights: LightSet, quality: Quality, seed: int) -> list[Transport]:
    """`light_transport` for lights that are already split."""
    near = reconstruction.Neighbours.of(points)
    sums = trace(scene, points, lights, quality, seed)
    for i, (share, factor) in enumerate(EXTRA if quality.extra else (), 1):
        judged = sums.mean[:, JUDGED], sums.variance[:, JUDGED]
        worst = reconstruction.noisiest(*judged, near, int(share * len(points.n)))
        add(sums, worst, trace(scene, points[worst], lights, quality.scaled(factor), seed + i * SEED_STEP), factor)
    mean = sums.mean
    if quality.smooth:
        sums.variance[:, SHARP] = 0
        mean = reconstruction.smoothed(mean, sums.variance, near)
    cosine = torch.from_numpy((points.n * points.wo).sum(-1).clip(MIN_COSINE, 1.0))
    return [_transport(mean[:, :, 3 * e : 3 * e + 3], cosine) for e in range(len(lights.environments))]


def _transport(sums: NDArray, cosine: torch.Tensor) -> Transport:
    E, A, B = torch.from_numpy(sums).split([1, len(KNOTS), len(KNOTS)], 1)
    return Transport(E[:, 0], A, B, cosine)


def add(sums: Sums, rows: NDArray[np.int64], more: Sums, factor: float) -> None:
    """Average further rays into some points, in place; `more` holds `factor` times the rays that any point began with."""
    new = (factor / (sums.rays[rows] + factor))[:, None, None]
    sums.mean[rows] += new * (more.mean - sums.mean[rows])
    sums.variance[rows] = (1 - new) ** 2 * sums.variance[rows] + new**2 * more.variance
    sums.rays[rows] += factor


def trace(scene: Scene, points: GBuffer, lights: LightSet, quality: Quality, seed: int) -> Sums:
    """The sums of every point by Monte Carlo, each on its own."""
    mean, gap = np.zeros((2, len(points.n), STORED, CHANNELS), np.float32)
    rays = Rays.plan(quality, lights, seed)
    pixel, order = tiles(points.mask)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        parts = [order[start : start + TILE] for start in range(0, len(order), TILE)]
        list(pool.map(lambda part: _tile(scene, points, lights, rays, pixel[part], part, mean, gap), parts))
    variance = reconstruction.variance(gap, reconstruction.Neighbours.of(points))
    return Sums(mean, variance, np.ones(len(mean), np.float32))


def _tile(
    scene: Scene,
    points: GBuffer,
    lights: LightSet,
    rays: "Rays",
    pixel: NDArray,
    part: NDArray,
    mean: NDArray,
    gap: NDArray,
) -> None:
    """The sums of a tile's points, written to rows `part` of `mean` and `gap`."""
    n, wo, origin, cells = points.n[part], points.wo[part], points.origin[part], lights.cells
    frame = (n, *tangent_frame(n))
    alphas, count, slots = knot_alphas(), len(part), len(rays.slots)
    chosen, aimed = np.empty((2, count, len(cells.energy)), np.float32)
    aim(n, wo, AIM, (cells.direction, cells.energy), cells.first, chosen, aimed)
    directions, owner = np.empty((count * slots, 3), np.float32), np.empty(count * slots, np.int32)
    row = np.empty((count, slots), np.int32)
    excess = (lights.texels, lights.cumulative, cells.begin, cells.first)
    samples = (rays.slots, rays.shift, rays.turn, rays.seed)
    used = draw(*frame, wo, pixel, samples, alphas, excess, chosen, directions, owner, row)
    directions = directions[:used]
    occluded = scene.occluded(origin[owner[:used]], directions)
    seen = (lights.pyramid, lights.level_start, lights.fine, lights.block, rays.density, cells.number, aimed)
    counts = (rays.counts, rays.bounds)
    accumulate(*frame, wo, alphas, counts, row, directions, occluded, albedo_table(), seen, (part, SUMMED), mean, gap)
    mirror = row[:, -1]
    _mirror(n, wo, directions[mirror], ~occluded[mirror], lights, part, mean)


def _mirror(
    n: NDArray, wo: NDArray, wi: NDArray, visible: NDArray, lights: LightSet, part: NDArray, mean: NDArray
) -> None:
    s = (1 - (n * wo).sum(-1, keepdims=True).astype(np.float64).clip(0, 1)) ** 5
    for e, environment in enumerate(lights.environments):
        radiance = lookup(environment.radiance, wi) * visible[:, None]
        mean[part, MIRROR[0], 3 * e : 3 * e + 3] = (1 - s) * radiance
        mean[part, MIRROR[1], 3 * e : 3 * e + 3] = s * radiance


def tiles(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Class and number of each object pixel, and an order of the pixels in which neighbours follow each other.

    Returns:
        pixel: (P, 2). order: (P,).
    """
    y, x = np.nonzero(mask)
    pixel = np.stack([y % 8 * 8 + x % 8, y * mask.shape[1] + x], -1)
    return pixel, np.lexsort((x, y, x // 16, y // 16))


@dataclass(frozen=True)
class Rays:
    """Which samples every point draws. A slot is one sample; S slots in all.

    counts: rays of each lobe. slots: (S, 4), lobe (a light's number follows the lobes', -1 is the mirror), number in
    its lobe, rays of that lobe, place among all light rays. bounds: first slot of the first half's lobe rays, its light
    rays, the second half's lobe rays, its light rays, and their end. shift: (CLASSES, 2). turn: (CLASSES, S, 2), cosine
    and sine of a lobe sample's azimuth. density: of a `LightSet`, times each environment's rays.
    """

    counts: NDArray[np.int64]
    slots: NDArray[np.int64]
    bounds: NDArray[np.int64]
    shift: NDArray[np.float64]
    turn: NDArray[np.float32]
    density: NDArray[np.float32]
    seed: int

    @staticmethod
    def plan(quality: Quality, lights: LightSet, seed: int) -> "Rays":
        counts = lobe_counts(quality.lobe)
        light_counts = share_out(quality.light, lights)
        lobe = _slots(counts, 0)
        light = _slots(light_counts, len(counts))
        groups = [rays[rays[:, 1] % 2 == half] for half in (0, 1) for rays in (lobe, light)]
        slots = np.concatenate([*groups, [[-1, 0, 1, 0]]])
        bounds = np.cumsum([0, *map(len, groups)])
        shift = interleaved_shifts()
        offset = np.array([hashed(2 * j + 1, seed) for j in slots[:, 0]])
        azimuth = 2 * np.pi * (shift[:, 1:] + (slots[:, 1] + 1) * GOLDEN + offset)
        turn = np.stack([np.cos(azimuth), np.sin(azimuth)], -1).astype(np.float32)
        density = lights.density * np.pad(light_counts, (0, MAX_LIGHTS - len(light_counts))).astype(np.float32)
        assert turn.shape == (CLASSES, len(slots), 2)
        return Rays(counts, slots, bounds, shift, turn, density, seed)


def share_out(light: int, lights: LightSet) -> NDArray[np.int64]:
    """Rays of each environment's excess, an even number: `light` on average over those that have any.

    EVEN of them go to all alike, for the penumbrae of suns, the rest by demand.
    """
    has_excess = np.diff(lights.cells.first) > 0
    demand = np.where(has_excess, lights.demand + 1e-9, 0.0)
    shares = demand / max(demand.sum(), np.finfo(float).tiny) * has_excess.sum()
    rays = light * (EVEN + (1 - EVEN) * shares)
    return np.where(has_excess, 2 * np.maximum(1, np.round(rays / 2)), 0).astype(np.int64)


def _slots(counts: NDArray, first: int) -> NDArray[np.int64]:
    rows = [(first + j, i, count) for j, count in enumerate(counts) for i in range(count)]
    table = np.array(rows, np.int64).reshape(-1, 3)
    return np.c_[table, np.arange(len(table))]


def lobe_counts(total: int) -> NDArray[np.int64]:
    """Rays of the cosine lobe and of each knot's lobe: an even number, for two halves, and not 0."""
    return 2 * np.maximum(1, np.round(LOBE_SHARES * total / 2)).astype(np.int64)


def knot_alphas() -> NDArray[np.float32]:
    """alpha of every knot but the mirror's."""
    return np.array([alpha_from_roughness(r) for r in KNOTS[1:]], np.float32)


@functools.lru_cache(maxsize=1)
def albedo_table() -> NDArray[np.float32]:
    """Open-point albedo of each sum: (COSINE_STEPS, SUMMED) float32, in the order of `accumulate`."""
    cosine = torch.from_numpy(cosines().astype(np.float32))
    knots = [specular_albedo(torch.full_like(cosine, roughness), cosine).numpy() for roughness in KNOTS[1:]]
    return np.stack([diffuse_table(), *(k[:, 0] for k in knots), *(k[:, 1] for k in knots)], -1)
