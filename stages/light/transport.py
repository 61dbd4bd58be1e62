"""Light transport E, A(r), B(r) of surface points, with shadows, for several environments from one set of rays.

    E    = ∫ L v (1 - F_d) N·L / π dw             F_d = 0.04 + 0.96 s,  s = (1 - V·H)^5
    A(r) = ∫ L v (1 - s) D_r G_r / (4 N·V) dw     the specular part that F0 multiplies
    B(r) = ∫ L v      s  D_r G_r / (4 N·V) dw     the Fresnel part

How. Visibility depends on neither light nor material, so each point traces one set of directions and every ray serves
every term, every roughness and every environment:

- a ray along the mirror direction gives roughness 0 exactly;
- rays drawn from the cosine lobe and from the visible-normal lobe of each roughness are weighted by the density of the
  whole mixture (multiple importance sampling, balance heuristic). Each looks up the bounded part of the light in a
  prefiltered pyramid, at the solid angle the ray stands for. The sum is divided by the sum of its own weights and
  multiplied by the exact unoccluded albedo, so an evenly lit open point has no error at all;
- what rises above the bound (a sun, a lamp) is sampled in proportion to its energy, by rays of its own, and combined
  with the lobe rays by the same balance heuristic, so neither a tiny sun nor a sharp lobe sparkles.

Source: Veach 1997, ch. 9 (MIS); Křivánek & Colbert 2008, "Real-time Shading with Filtered Importance Sampling".
The result depends on seed and pixel only, not on threads. `stages.light.reference` is the obvious form.
"""

import functools
import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numba
import numpy as np
import torch
from numpy.typing import NDArray

from stages.core.albedo import COSINE_STEPS, MIN_COSINE, cosines, diffuse_table, specular_albedo
from stages.core.brdf import alpha_from_roughness, sample_cosine, sample_vndf, schlick_weight
from stages.core.frames import tangent_frame
from stages.core.shading import KNOTS, Transport
from stages.light.environment import (
    FINE_ROWS,
    MAX_LIGHTS,
    SQUARE,
    Environment,
    LightSet,
    direction_to_square,
    light_set,
    lookup,
)
from stages.light.gbuffer import GBuffer
from stages.light.scene import Scene

CHUNK = 4096
"""Points a thread takes at once."""

TERMS = 2 * len(KNOTS) - 1
"""Sums a point keeps: E, then A and B of every knot but the mirror's."""


@dataclass(frozen=True)
class Quality:
    """How many rays a point traces: `lobe` for the mixture of lobes, `light` for each environment's excess."""

    lobe: int
    light: int


QUALITY = {"draft": Quality(32, 4), "standard": Quality(96, 16), "high": Quality(384, 64)}

LOBE_SHARES = np.array([0.22, 0.03, 0.05, 0.08, 0.11, 0.14, 0.14, 0.12, 0.11])
"""Share of the lobe rays: the cosine lobe, then each knot but the mirror."""


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
    count, size = len(points.n), len(lights.environments)
    out = np.zeros((count, size, 2 * len(KNOTS) + 1, 3), np.float32)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        starts = range(0, count, CHUNK)
        list(pool.map(lambda start: _chunk(scene, points, lights, quality, seed, start, out), starts))
    tensor = torch.from_numpy(out)
    cosine = torch.from_numpy((points.n * points.wo).sum(-1).clip(MIN_COSINE, 1.0))
    k = len(KNOTS)
    return [Transport(tensor[:, e, 0], tensor[:, e, 1 : k + 1], tensor[:, e, k + 1 :], cosine) for e in range(size)]


def _chunk(
    scene: Scene, points: GBuffer, lights: LightSet, quality: Quality, seed: int, start: int, out: NDArray
) -> None:
    part = slice(start, min(start + CHUNK, len(points.n)))
    n, wo, origin = points.n[part], points.wo[part], points.origin[part]
    t, b = tangent_frame(n)
    counts, alphas = lobe_counts(quality.lobe), knot_alphas()
    light_counts = np.array([quality.light if share else 0 for share in lights.excess_share], np.int64)
    cumulative, texels, first = _flat(lights)
    slots = counts.sum() + light_counts.sum()
    directions = np.empty((len(n) * slots, 3), np.float32)
    owner = np.empty(len(n) * slots, np.int32)
    begin = np.zeros((len(n), 2), np.int64)
    used = _sample(
        n, t, b, wo, start, seed, counts, alphas, light_counts, cumulative, texels, first, directions, owner, begin
    )
    directions, owner = directions[:used], owner[:used]
    occluded = scene.occluded(origin[owner], directions)
    pyramid = (lights.pyramid, lights.level_start)
    excess = (lights.fine, lights.occupied)
    lobes, rays = (counts, alphas, light_counts), (directions, occluded, begin)
    _accumulate(n, t, b, wo, *lobes, *rays, albedo_table(), pyramid, excess, out[part])
    _mirror(scene, n, wo, origin, lights, out[part])


def _flat(lights: LightSet) -> tuple[NDArray, NDArray, NDArray]:
    sizes = [len(c) for c in lights.cumulative]
    return (
        np.concatenate(lights.cumulative),
        np.concatenate(lights.texels),
        np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
    )


def _mirror(
    scene: Scene, n: NDArray, wo: NDArray, origin: NDArray, lights: LightSet, out: NDArray
) -> None:
    cosine = (n * wo).sum(-1, keepdims=True).astype(np.float64)
    wi = 2 * cosine * n - wo
    wi /= np.linalg.norm(wi, axis=-1, keepdims=True)
    visible = ~scene.occluded(origin, wi.astype(np.float32))
    s = (1 - cosine.clip(0, 1)) ** 5
    for e, environment in enumerate(lights.environments):
        radiance = lookup(environment.radiance, wi) * visible[:, None]
        out[:, e, 1] = (1 - s) * radiance
        out[:, e, 1 + len(KNOTS)] = s * radiance


def lobe_counts(total: int) -> NDArray[np.int64]:
    """Rays of the cosine lobe and of each knot's lobe; every lobe has at least one."""
    return np.maximum(1, np.round(LOBE_SHARES * total)).astype(np.int64)


def knot_alphas() -> NDArray[np.float32]:
    """alpha of every knot but the mirror's."""
    return np.array([alpha_from_roughness(r) for r in KNOTS[1:]], np.float32)


@functools.lru_cache(maxsize=1)
def albedo_table() -> NDArray[np.float32]:
    """Open-point albedo of each sum: (COSINE_STEPS, TERMS) float32, in the order of `_accumulate`."""
    cosine = torch.from_numpy(cosines().astype(np.float32))
    knots = [specular_albedo(torch.full_like(cosine, roughness), cosine).numpy() for roughness in KNOTS[1:]]
    return np.stack([diffuse_table(), *(k[:, 0] for k in knots), *(k[:, 1] for k in knots)], -1)


@numba.njit(inline="always", error_model="numpy", cache=True)
def _hash(x, y):  # type: ignore[no-untyped-def]
    """Uniform [0, 1) from two integers. Source: Jarzynski & Olano 2020, PCG."""
    state = np.uint64(x) * np.uint64(747796405) + np.uint64(y) * np.uint64(2891336453) + np.uint64(277803737)
    state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    state = state ^ (state >> np.uint64(31))
    return np.float64(state >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@numba.njit(error_model="numpy", cache=True, nogil=True)
def _sample(  # type: ignore[no-untyped-def]
    n, t, b, wo, start, seed, counts, alphas, light_counts, cumulative, texels, first, directions, owner, begin
):
    """Draw every point's directions above its horizon; R2 points, shifted at random for each point and lobe.

    Args:
        n, t, b, wo: (P, 3) world. directions (rows, 3), owner (rows,), begin (P, 2): written; `begin` holds the first
        row of a point's lobe rays and of its light rays.
    Returns:
        Rows written.
    """
    used = 0
    rows, columns = FINE_ROWS, 2 * FINE_ROWS
    for p in range(len(n)):
        begin[p, 0] = used
        x = wo[p, 0] * t[p, 0] + wo[p, 1] * t[p, 1] + wo[p, 2] * t[p, 2]
        y = wo[p, 0] * b[p, 0] + wo[p, 1] * b[p, 1] + wo[p, 2] * b[p, 2]
        z = wo[p, 0] * n[p, 0] + wo[p, 1] * n[p, 1] + wo[p, 2] * n[p, 2]
        for lobe in range(len(counts)):
            key = (np.int64(seed) * 64 + lobe) * 2
            shift0, shift1 = _hash(start + p, key), _hash(start + p, key + 1)
            for i in range(counts[lobe]):
                u0 = (shift0 + (i + 0.5) / counts[lobe]) % 1.0
                u1 = (shift1 + (i + 1) * 0.6180339887498949) % 1.0
                if lobe == 0:
                    d0, d1, d2 = sample_cosine(u0, u1)
                else:
                    m0, m1, m2 = sample_vndf(x, y, z, alphas[lobe - 1], u1, u0)
                    k = 2 * (x * m0 + y * m1 + z * m2)
                    d0, d1, d2 = k * m0 - x, k * m1 - y, k * m2 - z
                if d2 > 0:
                    for c in range(3):
                        directions[used, c] = d0 * t[p, c] + d1 * b[p, c] + d2 * n[p, c]
                    owner[used] = p
                    used += 1
        begin[p, 1] = used
        for e in range(len(light_counts)):
            energy = cumulative[first[e] : first[e + 1]]
            key = (np.int64(seed) * 64 + 32 + e) * 2
            shift0, shift1 = _hash(start + p, key), _hash(start + p, key + 1)
            for i in range(light_counts[e]):
                u = (i + shift0) / light_counts[e]
                j = min(np.searchsorted(energy, u, side="right"), len(energy) - 1)
                low = energy[j - 1] if j > 0 else 0.0
                within = (u - low) / (energy[j] - low)
                texel = texels[first[e] + j]
                row, column = texel // columns, texel % columns
                phi = (0.5 - (column + within) / columns) * 2 * math.pi
                upper, lower = math.cos(row / rows * math.pi), math.cos((row + 1) / rows * math.pi)
                w2 = upper + (lower - upper) * ((shift1 + (i + 1) * 0.6180339887498949) % 1.0)
                sin = math.sqrt(max(1 - w2 * w2, 0.0))
                w0, w1 = sin * math.cos(phi), sin * math.sin(phi)
                if w0 * n[p, 0] + w1 * n[p, 1] + w2 * n[p, 2] > 0:
                    directions[used, 0], directions[used, 1], directions[used, 2] = w0, w1, w2
                    owner[used] = p
                    used += 1
    return used


@numba.njit(inline="always", error_model="numpy", cache=True)
def _weights(wo, wi_z, m_x, m_y, m_z, s, counts, a2, lambda_o, weight):  # type: ignore[no-untyped-def]
    """BRDF terms of one direction into `weight` (TERMS,), and the mixture's density, rays / sr."""
    f32 = np.float32
    sin2, cos2 = m_x * m_x + m_y * m_y, m_z * m_z
    wi2 = wi_z * wi_z
    tan2 = (f32(1) - wi2) / wi2
    knots = len(a2)
    density = f32(counts[0]) * wi_z * f32(1 / math.pi)
    scale = f32(0.25) / (f32(math.pi) * wo)
    for k in range(knots):
        q = sin2 + a2[k] * cos2
        D = scale * a2[k] / (q * q)
        lambda_i = f32(0.5) * (math.sqrt(f32(1) + a2[k] * tan2) - f32(1))
        f = D / (f32(1) + lambda_o[k] + lambda_i)
        density += f32(counts[k + 1]) * D / (f32(1) + lambda_o[k])
        weight[1 + k] = (f32(1) - s) * f
        weight[1 + knots + k] = s * f
    weight[0] = f32(0.96) * (f32(1) - s) * wi_z * f32(1 / math.pi)
    return density


@numba.njit(inline="always", error_model="numpy", cache=True)
def _filtered(pyramid, level_start, u, v, level, radiance):  # type: ignore[no-untyped-def]
    """Trilinear look-up in the octahedral pyramid into `radiance` (C,)."""
    f32 = np.float32
    levels = len(level_start)
    level = min(max(level, f32(0)), f32(levels - 1))
    low = min(int(level), levels - 2)
    for c in range(len(radiance)):
        radiance[c] = 0
    for step in range(2):
        share = level - f32(low) if step else f32(1) - (level - f32(low))
        if share <= 0:
            continue
        size = SQUARE >> (low + step)
        start = level_start[low + step]
        x, y = f32(u) * f32(size) - f32(0.5), f32(v) * f32(size) - f32(0.5)
        column, row = int(math.floor(x)), int(math.floor(y))
        fx, fy = x - f32(column), y - f32(row)
        for a in range(2):
            for b in range(2):
                i, j = row + a, column + b
                if i < 0 or i >= size:  # across the square's edge the map continues mirrored
                    i, j = (0 if i < 0 else size - 1), size - 1 - j
                if j < 0 or j >= size:
                    i, j = size - 1 - i, (0 if j < 0 else size - 1)
                weight = share * (fy if a else f32(1) - fy) * (fx if b else f32(1) - fx)
                texel = pyramid[start + i * size + j]
                for c in range(len(radiance)):
                    radiance[c] += weight * texel[c]


@numba.njit(inline="always", error_model="numpy", cache=True)
def _fine_texel(x, y, z):  # type: ignore[no-untyped-def]
    """Row and column of a direction in the excess grid."""
    row = int(math.acos(min(max(z, -1.0), 1.0)) * (FINE_ROWS / math.pi))
    column = int((0.5 - math.atan2(y, x) / (2 * math.pi)) * (2 * FINE_ROWS))
    return min(row, FINE_ROWS - 1), min(column, 2 * FINE_ROWS - 1)


@numba.njit(error_model="numpy", cache=True, nogil=True, fastmath={"contract", "reassoc", "nsz", "arcp"})
def _accumulate(  # type: ignore[no-untyped-def]
    n, t, b, wo, counts, alphas, light_counts, directions, occluded, begin, table, pyramid, excess, out
):
    """Sum the rays of each point. out: (P, environments, 2 K + 1, 3), its mirror knots left alone."""
    f32 = np.float32
    texels, level_start = pyramid
    fine, occupied = excess
    lights, knots = out.shape[1], len(alphas)
    terms = 2 * knots + 1
    a2 = alphas * alphas
    lambda_o = np.empty(knots, np.float32)
    weight = np.empty(terms, np.float32)
    normaliser = np.empty(terms, np.float32)
    radiance = np.empty(texels.shape[1], np.float32)
    smooth = np.empty((terms, texels.shape[1]), np.float32)
    bright = np.empty((terms, lights, 3), np.float32)
    texel_angle = f32(4 * math.pi / (SQUARE * SQUARE))
    for p in range(len(n)):
        wo_z = max(wo[p, 0] * n[p, 0] + wo[p, 1] * n[p, 1] + wo[p, 2] * n[p, 2], f32(MIN_COSINE * 0.5))
        tan2 = (f32(1) - min(wo_z, f32(1)) ** 2) / (wo_z * wo_z)
        for k in range(knots):
            lambda_o[k] = f32(0.5) * (math.sqrt(f32(1) + a2[k] * tan2) - f32(1))
        normaliser[:] = 0
        smooth[:] = 0
        bright[:] = 0
        end = begin[p + 1, 0] if p + 1 < len(n) else len(directions)
        for i in range(begin[p, 0], end):
            is_light_ray = i >= begin[p, 1]
            if is_light_ray and occluded[i]:
                continue
            d0, d1, d2 = directions[i, 0], directions[i, 1], directions[i, 2]
            wi_z = max(d0 * n[p, 0] + d1 * n[p, 1] + d2 * n[p, 2], f32(1e-7))
            h0, h1, h2 = d0 + wo[p, 0], d1 + wo[p, 1], d2 + wo[p, 2]
            inverse = f32(1) / math.sqrt(h0 * h0 + h1 * h1 + h2 * h2)
            h0, h1, h2 = h0 * inverse, h1 * inverse, h2 * inverse
            cosine = h0 * d0 + h1 * d1 + h2 * d2
            m_x = h0 * t[p, 0] + h1 * t[p, 1] + h2 * t[p, 2]
            m_y = h0 * b[p, 0] + h1 * b[p, 1] + h2 * b[p, 2]
            m_z = h0 * n[p, 0] + h1 * n[p, 1] + h2 * n[p, 2]
            s = f32(schlick_weight(min(cosine, f32(1))))
            density = _weights(wo_z, wi_z, m_x, m_y, m_z, s, counts, a2, lambda_o, weight)
            inverse = f32(1) / density
            if not is_light_ray:
                for j in range(terms):
                    normaliser[j] += weight[j] * inverse
                if occluded[i]:
                    continue
                u, v = direction_to_square(d0, d1, d2)
                level = f32(0.5) * math.log2(inverse / texel_angle)
                _filtered(texels, level_start, u, v, f32(level), radiance)
                for j in range(terms):
                    w = weight[j] * inverse
                    for c in range(len(radiance)):
                        smooth[j, c] += w * radiance[c]
            row, column = _fine_texel(d0, d1, d2)
            if occupied[row >> 1, column >> 1]:
                values = fine[row * 2 * FINE_ROWS + column]
                for e in range(lights):
                    density += f32(light_counts[e]) * values[e, 3]
                for e in range(lights):
                    if values[e, 3] > 0:
                        for j in range(terms):
                            for c in range(3):
                                bright[j, e, c] += weight[j] / density * values[e, c]
        position = math.sqrt(min(wo_z, f32(1))) * f32(COSINE_STEPS - 1)
        below = min(int(position), COSINE_STEPS - 2)
        x = position - f32(below)
        for j in range(terms):
            albedo = table[below, j] * (f32(1) - x) + table[below + 1, j] * x
            scale = albedo / normaliser[j] if normaliser[j] > 0 else f32(0)
            slot = j if j <= 0 else (j + 1 if j <= knots else j + 2)
            for e in range(lights):
                for c in range(3):
                    out[p, e, slot, c] = smooth[j, 3 * e + c] * scale + bright[j, e, c]
