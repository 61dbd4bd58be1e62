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
  combined with the lobe rays by the same balance heuristic, so neither a tiny sun nor a sharp lobe sparkles. What lobe rays
  see of it is divided by their weights like the rest: a lobe narrower than a lamp shows little more than the lamp;
- a ray that rises over all that stands around its point's triangle is open, and not traced (`stages.light.horizon`);
- neighbouring pixels use complementary samples; the points that turn out noisiest trace more, towards the lights that make
  them so; and what noise is left is averaged over neighbours that do not differ by more than it
  (`stages.light.reconstruction`), less the highlights that a lamp would make in the open (`stages.light.highlights`), which
  averaging would flatten.

These errors fall as rays are added. What stays is the resolution of the lights, 0.4 degrees (`stages.light.light_set`), under
what roughness 0.08 spreads; a mirror looks up the light itself. The result depends on seed and pixel only, not on threads.
`stages.light.reference` is the obvious form.

Source: Veach 1997, ch. 9 (MIS); Křivánek & Colbert 2008, "Real-time Shading with Filtered Importance Sampling"; Keller &
Heidrich 2001, "Interleaved Sampling".
"""

import functools
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stages.core.albedo import MIN_COSINE
from stages.core.brdf import alpha_from_roughness
from stages.core.frames import tangent_frame
from stages.core.knots import KNOTS
from stages.core.parallel import cores
from stages.light import highlights, reconstruction
from stages.light.cells import Cells
from stages.light.ends import Ends, find_ends
from stages.light.environment import Environment
from stages.light.gbuffer import GBuffer
from stages.light.light_set import CHANNELS, MAX_LIGHTS, LightSet, light_set
from stages.light.scene import Scene
from stages.light.terms import BOUNCED, GLTF, NARROW, Terms
from stages.light.transport_kernels import (
    CLASSES,
    GOLDEN,
    WEIGHT,
    accumulate,
    aim,
    draw,
    hashed,
    interleaved_shifts,
    mirror,
    to_trace,
)

if TYPE_CHECKING:
    from torch import Tensor

    from stages.core.shading import Transport

TILE = 512
"""Points a thread takes at once: their rays stay in its cache."""


@dataclass(frozen=True)
class Quality:
    """How many rays a point traces: `lobe` for the mixture of lobes, `light` for the excess of an average environment.

    The noisiest points trace more, see EXTRA, and what noise is left is smoothed, unless switched off. averaged: the caller
    averages over points; each then draws samples of its own, and what is exact in an even light but biased with a handful of
    rays is left out: sums are not normalised by their weights, and the light is not prefiltered.
    """

    lobe: int
    light: int
    extra: bool = True
    smooth: bool = True
    averaged: bool = False

    def scaled(self, factor: float) -> "Quality":
        """About `factor` times as many rays."""
        return replace(self, lobe=max(2, round(self.lobe * factor)), light=max(2, round(self.light * factor)))

    @property
    def bounced(self) -> "Quality":
        """Where the object is seen in itself too, which takes what its points receive directly for exact."""
        return replace(self, light=round(self.light * MORE_LIGHT))


@dataclass(frozen=True)
class Round:
    """Further rays where most noise is left: at a share of the points or, if `each`, of the pairs of a point and a light.

    lobe, light: times the rays that every point begins with. A light of a pair must have light rays; the others gain nothing.
    """

    share: float
    lobe: float
    light: float
    each: bool


EXTRA = (Round(0.1, 3.0, 3.0, each=False), Round(0.025, 3.0, 10.0, each=True))
"""Without them a view takes three quarters of the time; the 99.9th percentile of its error under a studio is twice as high."""

SEED_STEP = 0x5EED
"""Between the seed of a point's rays and that of its further ones."""

EVEN = 0.35
"""Share of the light rays that is not given out by demand."""

MORE_LIGHT = 1.35
"""Light rays of a point with bounces, as a multiple of those without."""

QUALITY = {"draft": Quality(19, 9), "standard": Quality(38, 18), "high": Quality(304, 144)}

AIM = np.array([alpha_from_roughness(r) for r in (0.33, 1.0)], np.float32)
"""Glossy lobes that light rays are aimed for, beside the diffuse one."""


@dataclass(frozen=True)
class Sums:
    """What a point gathers, for all environments: (P, stored, CHANNELS) float32, and the variance of each.

    rays: (P, lights) float32, traced for a point under a light, as a multiple of what every point begins with. ends: where
    the first round's blocked rays end, if that was asked for.
    """

    mean: NDArray[np.float32]
    variance: NDArray[np.float32]
    rays: NDArray[np.float32]
    ends: Ends | None = None

    def of_lights(self, count: int) -> "Sums":
        """Without the channels that no light uses: averaging takes as long as there are channels."""
        if count == MAX_LIGHTS:
            return self
        mean, noise = (np.ascontiguousarray(values[:, :, : 3 * count]) for values in (self.mean, self.variance))
        return Sums(mean, noise, self.rays, self.ends)


def light_transport(
    scene: Scene, points: GBuffer, environments: list[Environment], quality: Quality, seed: int
) -> list["Transport"]:
    """Transport of every point of a view under each environment.

    Returns:
        One Transport a light, (P, ...) float32, linear radiance for a white surface.
    """
    return transport_and_ends(scene, points, environments, quality, seed)[0]


def transport_and_ends(
    scene: Scene, points: GBuffer, environments: list[Environment], quality: Quality, seed: int, cells: Cells | None = None
) -> "tuple[list[Transport], Ends | None]":
    """`light_transport`, and where the points' blocked rays end, if the surface is given in cells."""
    result: list[Transport] = []
    ends = None
    for first in range(0, len(environments), MAX_LIGHTS):
        lights = cached_light_set(tuple(environments[first : first + MAX_LIGHTS]))
        some, found = _integrated(scene, points, lights, *rays_for(quality, cells), seed, None if first else cells)
        result += some
        ends = ends or found
    return result, ends


KEPT = 8
"""Light sets that are kept: one asset's conditions, preview and report are lit by as many or fewer."""


@functools.lru_cache(KEPT)
def cached_light_set(environments: tuple[Environment, ...]) -> LightSet:
    """The light set of these very objects, kept for the next view or asset."""
    return light_set(list(environments))


def integrate(scene: Scene, points: GBuffer, lights: LightSet, quality: Quality, seed: int) -> list["Transport"]:
    """`light_transport` for lights that are already split."""
    return integrate_with_ends(scene, points, lights, quality, seed)[0]


def integrate_with_ends(
    scene: Scene, points: GBuffer, lights: LightSet, quality: Quality, seed: int, cells: Cells | None = None
) -> "tuple[list[Transport], Ends | None]":
    """`integrate`, and where the points' blocked rays end, if the surface is given in cells."""
    return _integrated(scene, points, lights, *rays_for(quality, cells), seed, cells)


def rays_for(quality: Quality, cells: Cells | None) -> tuple[Quality, Terms]:
    """What a view is traced with: more where the object is seen in itself, in cells, too."""
    return (quality, GLTF) if cells is None else (quality.bounced, BOUNCED)


def _integrated(
    scene: Scene, points: GBuffer, lights: LightSet, quality: Quality, terms: Terms, seed: int, cells: Cells | None
) -> "tuple[list[Transport], Ends | None]":
    near = reconstruction.Neighbours.of(points)
    sums = gather(scene, points, lights, quality, seed, near, terms, cells).of_lights(len(lights.environments))
    mean = smoothed(sums, points, lights, near) if quality.smooth else sums.mean
    import torch  # here, for who only asks for what a known material reflects has no tensors

    cosine = torch.from_numpy((points.n * points.wo).sum(-1).clip(MIN_COSINE, 1.0))
    return [_transport(some, cosine) for some in each_light(mean, len(lights.environments))], sums.ends


def each_light(sums: NDArray[np.float32], count: int) -> NDArray[np.float32]:
    """(P, stored, CHANNELS) as (count, P, stored, 3), each light's together: who reads one need not pass over the others."""
    points, stored, _ = sums.shape
    return np.ascontiguousarray(sums[:, :, : 3 * count].reshape(points, stored, count, 3).transpose(2, 0, 1, 3))


def _transport(sums: NDArray, cosine: "Tensor") -> "Transport":
    import torch

    from stages.core.shading import Transport

    E, A, B = torch.from_numpy(sums).split([1, len(KNOTS), len(KNOTS)], 1)
    return Transport(E[:, 0], A, B, cosine)


def gather(
    scene: Scene,
    points: GBuffer,
    lights: LightSet,
    quality: Quality,
    seed: int,
    near: reconstruction.Neighbours,
    terms: Terms = GLTF,
    cells: Cells | None = None,
) -> Sums:
    """The sums of every point, with further rays where they are noisiest."""
    sums = trace(scene, points, lights, quality, seed, terms, cells=cells)
    for i, more in enumerate(EXTRA if quality.extra else (), 1):
        wanted = noisiest(sums, near, lights, terms, more)
        rows = np.flatnonzero(wanted.any(1))
        some = replace(quality, lobe=round(quality.lobe * more.lobe), light=round(quality.light * more.light))
        found = trace(scene, points[rows], lights, some, seed + i * SEED_STEP, terms, wanted[rows])
        add(sums, rows, found, wanted[rows] * np.float32(more.light))
    return sums


def smoothed(
    sums: Sums, points: GBuffer, lights: LightSet, near: reconstruction.Neighbours, terms: Terms = GLTF
) -> NDArray[np.float32]:
    """The sums with their noise averaged away, (P, stored, CHANNELS); uses up the sums it is given."""
    sums.variance[:, terms.sharp] = 0
    if not terms.highlights:
        return reconstruction.smoothed(sums.mean, sums.variance, near, terms.joint)
    places = terms.places_of_highlights()
    alphas = np.ascontiguousarray(terms.alphas(np.arange(len(points.n)))[:, list(terms.highlights)])
    shown = highlights.open_highlights(points, lights.lamps, alphas, sums.mean.shape[2])
    kept = highlights.take_out(sums.mean, sums.variance, shown, places, near)
    result = reconstruction.smoothed(sums.mean, sums.variance, near, terms.joint)
    highlights.put_back(result, sums.mean, kept, places)
    return result


def noisiest(
    sums: Sums, near: reconstruction.Neighbours, lights: LightSet, terms: Terms, more: Round
) -> NDArray[np.bool_]:
    """Which points trace a round of further rays, and for which lights: (P, lights)."""
    left = reconstruction.noise_left(sums.mean, sums.variance, near, terms.judged)[:, : len(lights.environments)]
    if more.each:
        wanted = np.zeros(left.shape, np.bool_)
        wanted[:, lights.has_excess] = reconstruction.largest(left[:, lights.has_excess], more.share)
        return wanted
    return reconstruction.largest(left.sum(1, keepdims=True), more.share).repeat(left.shape[1], 1)


def add(sums: Sums, rows: NDArray[np.int64], more: Sums, rays: NDArray[np.float32]) -> None:
    """Average further rays into some points, in place. Args: rays: (rows, lights), how many, 0 to leave a light as it is."""
    share = np.zeros((len(rows), CHANNELS), np.float32)
    share[:, : 3 * rays.shape[1]] = (rays / (sums.rays[rows] + rays)).repeat(3, 1)
    reconstruction.merge((sums.mean, sums.variance), rows, (more.mean, more.variance), share)
    sums.rays[rows] += rays


def trace(
    scene: Scene,
    points: GBuffer,
    lights: LightSet,
    quality: Quality,
    seed: int,
    terms: Terms = GLTF,
    wanted: NDArray[np.bool_] | None = None,
    cells: Cells | None = None,
    every: bool = False,
) -> Sums:
    """The sums of every point by Monte Carlo, each on its own.

    Args:
        wanted: (P, lights), the rest is of no use; or all. cells: of the surface, where it is asked on which blocked rays end.
        every: ask it of all rays but the mirror's.
    """
    count = len(points.n), len(lights.environments)
    wanted = np.ones(count, np.bool_) if wanted is None else wanted
    mean, gap = np.empty((2, len(points.n), terms.stored, CHANNELS), np.float32)
    rays = Rays.plan(quality, lights, seed, terms)
    pixel, order = tiles(points.mask)
    scene.horizons.meet(points.triangle)
    with ThreadPoolExecutor(cores()) as pool:
        parts = [order[start : start + TILE] for start in range(0, len(order), TILE)]
        given, sums = (scene, points, lights, terms, rays), (mean, gap)
        found = list(pool.map(lambda part: _tile(*given, pixel[part], part, wanted, sums, (cells, every)), parts))
    if not wanted.all():
        gap[..., : 3 * count[1]] *= wanted.repeat(3, 1)[:, None]  # nor is its noise any to judge others by
    variance = reconstruction.variance(gap, reconstruction.Neighbours.of(points))
    ends = None if cells is None else Ends.cat([Ends.none(0, lobes_told(rays, every)), *filter(None, found)])[np.argsort(order)]
    return Sums(mean, variance, np.ones(count, np.float32), ends)


def _tile(
    scene: Scene,
    points: GBuffer,
    lights: LightSet,
    terms: Terms,
    rays: "Rays",
    pixel: NDArray,
    part: NDArray,
    wanted: NDArray,
    sums: tuple[NDArray, NDArray],
    asked: tuple[Cells | None, bool],
) -> Ends | None:
    """The sums of a tile's points, written to rows `part` of both `sums`, mean and gap. Returns: where its rays end."""
    mean, gap = sums
    n, wo, cells = points.n[part], points.wo[part], lights.cells
    frame, alphas = (n, *tangent_frame(n)), terms.alphas(part)
    chosen, aimed = np.empty((2, len(part), len(cells.energy)), np.float32)
    aim(n, wo, wanted[part], AIM, (cells.direction, cells.radius, cells.energy, cells.first), chosen, aimed)
    drawn = rays.draw(frame, wo, starts(points, part), pixel, alphas, lights, chosen)
    occluded = blocked(scene, points, part, drawn)
    excess = (lights.fine, lights.block, lights.texels.radiance, rays.density, cells.number, aimed)
    seen = (lights.pyramid, lights.level_start, *excess)
    sampled = (rays.counts, rays.bounds, rays.slots, terms.principled)
    where = (part, terms.summed)
    cosine = (n * wo).sum(-1).astype(np.float64).clip(0, 1)
    accumulate(*frame, wo, alphas, sampled, drawn, occluded, rays.albedo(terms, cosine, part), seen, where, mean, gap)
    mean[part[:, None], terms.mirror] = gap[part[:, None], terms.mirror] = 0
    weights = np.stack(terms.mirror_weights(cosine))
    for e, environment in enumerate(lights.environments):
        mirror(environment.radiance, drawn, occluded, weights, (part, terms.mirror), 3 * e, mean)
    among, every = asked
    scale = mean[part[:, None], terms.summed[: lobes_told(rays, every)], WEIGHT]
    mean[part, :, WEIGHT] = 0
    return None if among is None else _ends(scene, among, rays, drawn, occluded, (alphas, scale, every))


def lobes_told(rays: "Rays", every: bool) -> int:
    """Of how many lobes `Ends.scale` tells: of none where all rays are told of."""
    return 0 if every else len(rays.counts)


def _ends(
    scene: Scene,
    cells: Cells,
    rays: "Rays",
    drawn: "Drawn",
    occluded: NDArray[np.bool_],
    lobes: tuple[NDArray[np.float32], NDArray[np.float32], bool],
) -> Ends:
    """Where the blocked rays of a tile's lobes and mirrors end.

    Args: lobes: alphas, `Ends.scale`, and whether it is asked of every ray of the lobes, and of no mirror's.
    """
    alphas, scale, every = lobes
    ends = np.full((len(alphas), 1), np.inf), np.zeros((len(alphas), 1))
    alphas = np.concatenate([ends[0], alphas, ends[1]], 1)  # the cosine lobe's, number 0, and the mirror's, number -1
    slots = np.flatnonzero(rays.slots[: len(rays.slots) - every, 0] < len(rays.counts))
    slots = slots[np.argsort(-alphas[0, rays.slots[slots, 0]], kind="stable")]
    ray, lobe = drawn.row[:, slots], rays.slots[slots, 0]
    point, slot = np.nonzero((ray >= 0) & (occluded[ray] | every))
    ray, lobe = ray[point, slot], lobe[slot]
    narrow = alphas[point, lobe] < alpha_from_roughness(NARROW)
    found = (point, np.where(narrow, lobe.clip(0), -1), occluded[ray])
    return find_ends(scene, cells, scale, found, drawn.origin[ray], drawn.direction[ray])


def blocked(scene: Scene, points: GBuffer, part: NDArray, drawn: "Drawn") -> NDArray[np.bool_]:
    """Which rays (R,) of a tile anything blocks; those are not traced that rise over their triangle's horizon."""
    ng, triangle, horizons = points.ng[part], points.triangle[part], scene.horizons
    front = scene.geometric_normal(triangle)
    horizon = horizons.front[triangle]
    behind = (ng * front).sum(-1) < 0
    horizon[behind] = horizons.behind[triangle[behind], None]
    asked = np.empty(len(drawn.direction), np.int64)
    count = to_trace(drawn.direction, drawn.row, (*tangent_frame(front), ng), horizon, asked)
    return scene.occluded(drawn.origin, drawn.direction, asked[:count])


def starts(points: GBuffer, part: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Where rays of some points leave the smooth surface, and the triangle, and its normal."""
    return points.origin[part], points.surface(part), points.ng[part]


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
    jitter: by which points of one class differ. averaged: of `Quality`.
    """

    counts: NDArray[np.int64]
    slots: NDArray[np.int64]
    bounds: NDArray[np.int64]
    shift: NDArray[np.float64]
    turn: NDArray[np.float32]
    density: NDArray[np.float32]
    jitter: float
    seed: int
    averaged: bool

    @staticmethod
    def plan(quality: Quality, lights: LightSet, seed: int, terms: Terms = GLTF) -> "Rays":
        counts = terms.counts(quality.lobe)
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
        jitter = 1.0 if quality.averaged else 1 / CLASSES
        return Rays(counts, slots, bounds, shift, turn, density, jitter, seed, quality.averaged)

    def albedo(self, terms: Terms, cosine: NDArray, rows: NDArray[np.int64]) -> NDArray[np.float32]:
        """Of some open points, by which their sums are normalised; without rows for averaged points."""
        return np.ascontiguousarray(terms.open_albedo(cosine, rows)[: 0 if self.averaged else None], np.float32)

    def draw(
        self,
        frame: tuple[NDArray, NDArray, NDArray],
        wo: NDArray,
        start: tuple[NDArray, NDArray, NDArray],
        pixel: NDArray,
        alphas: NDArray,
        lights: LightSet,
        chosen: NDArray,
    ) -> "Drawn":
        """The rays of a tile's points, R in all. Args: start: of `starts`."""
        count, slots = len(wo), len(self.slots)
        most = count * slots
        origins, directions = np.empty((2, most, 3), np.float32)
        texel, density = np.empty(most, np.int32), np.empty(most, np.float32)
        row = np.empty((slots, count), np.int32).T  # written slot by slot, and read by neighbours after each other
        rays = Drawn(origins, directions, texel, density, row)
        excess = (lights.texels, lights.cells.begin, lights.cells.first)
        samples = (self.slots, self.shift, self.turn, self.jitter, self.seed)
        used = draw(*frame, wo, start, pixel, samples, alphas, excess, chosen, rays)
        return Drawn(origins[:used], directions[:used], texel[:used], density[:used], rays.row)


class Drawn(NamedTuple):
    """Rays of a tile's points. origin, direction: (R, 3). row: (P, S), a sample's ray, or -1 where it is under the horizon.

    texel, density: (R,), of light rays: their texel among those of the `LightSet`, and how many light rays per steradian there
    are.
    """

    origin: NDArray[np.float32]
    direction: NDArray[np.float32]
    texel: NDArray[np.int32]
    density: NDArray[np.float32]
    row: NDArray[np.int32]


def share_out(light: int, lights: LightSet) -> NDArray[np.int64]:
    """Rays of each environment's excess, an even number: `light` on average over those that have any.

    EVEN of them go to all alike, for the penumbrae of suns, the rest by demand.
    """
    if light == 0:
        return np.zeros(len(lights.environments), np.int64)
    demand = np.where(lights.has_excess, lights.demand + 1e-9, 0.0)
    shares = demand / max(demand.sum(), np.finfo(float).tiny) * lights.has_excess.sum()
    rays = light * (EVEN + (1 - EVEN) * shares)
    return np.where(lights.has_excess, 2 * np.maximum(1, np.round(rays / 2)), 0).astype(np.int64)


def _slots(counts: NDArray, first: int) -> NDArray[np.int64]:
    rows = [(first + j, i, count) for j, count in enumerate(counts) for i in range(count)]
    table = np.array(rows, np.int64).reshape(-1, 3)
    return np.c_[table, np.arange(len(table))]
