"""The highlights of a light's bright spots, which are known but for what stands in their way.

A lamp mirrored in a glossy surface makes a highlight that may be narrower than the window over which noise is averaged,
and averaging would flatten it. So what an open point would show of the lamps is taken out of the sums before, and put back
after: noise, shadows and the rest of the light are what is averaged. Any guess would do, for what is put back is what was
taken out; a lamp is one direction with a spread, and only a smooth cone around the mirror direction counts.

Source: Bako et al. 2017, "Kernel-Predicting Convolutional Networks for Denoising Monte Carlo Renderings" (denoising what is
left of a picture when what is known is taken out); Walter et al. 2005, "Lightcuts" (lights in clusters).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core.albedo import MIN_COSINE
from stages.core.color import luminance
from stages.light.gbuffer import GBuffer
from stages.light.octahedral import texel_directions
from stages.light.reconstruction import fast, in_parts

COARSE, FINEST = 16, 128
"""Cells along each side of the octahedral square: a cluster is one of at most 13 degrees, and at least 1.5."""

BLUR = 3e-6
"""A cluster is cut in four while its share of the light, times its spread, is above this."""

CONE = 0.15
"""Squared sine of the angle between half vector and normal at which a highlight is let go: 23 degrees."""


@dataclass(frozen=True)
class Lamps:
    """Clusters of a light set's excess, K in all.

    direction: (3, K) float32, mean. spread: (K,) float32, mean squared distance of unit directions from it. flux: (K,
    CHANNELS) float32, radiance times solid angle, in the channels of its environment.
    """

    direction: NDArray[np.float32]
    spread: NDArray[np.float32]
    flux: NDArray[np.float32]


def cluster(peaks: NDArray, mean: NDArray, channels: int) -> Lamps:
    """Lamps of the excess on the octahedral square.

    Args:
        peaks: (E, S, S, 3), radiance, S at least FINEST. mean: (E,), luminance of the whole light over the sphere.
        channels: of the result's flux, 3 E or more.
    """
    size = peaks.shape[1]
    share = luminance(peaks.astype(np.float64)) / (np.maximum(mean, np.finfo(float).tiny)[:, None, None] * size**2)
    towards = share[..., None] * np.stack(texel_directions(size), -1)
    levels = [np.concatenate([towards, peaks * (4 * np.pi / size**2), share[..., None]], -1)]
    while levels[-1].shape[1] > COARSE:
        half = levels[-1].shape[1] // 2
        levels.append(levels[-1].reshape(len(peaks), half, 2, half, 2, -1).sum((2, 4)))
    found = []
    uncut = np.ones((len(peaks), COARSE, COARSE), bool)
    for level in reversed(levels):
        energy = level[..., 6]
        length = np.linalg.norm(level[..., :3], axis=-1) / np.maximum(energy, np.finfo(float).tiny)
        spread = (1 - length**2).clip(0)
        uncut &= energy > 0
        cut = uncut & (energy * spread > BLUR) & (level.shape[1] < FINEST)
        whole = uncut & ~cut
        found.append(np.c_[level[whole], spread[whole], np.nonzero(whole)[0]])
        uncut = cut.repeat(2, 1).repeat(2, 2)
        if level.shape[1] == FINEST:
            break
    lamps = np.concatenate(found)
    direction = lamps[:, :3] / np.linalg.norm(lamps[:, :3], axis=1, keepdims=True)
    flux = np.zeros((len(lamps), channels), np.float32)
    np.put_along_axis(flux, 3 * lamps[:, 8:].astype(np.int64) + np.arange(3), lamps[:, 3:6], 1)
    return Lamps(np.ascontiguousarray(direction.T, np.float32), lamps[:, 7].astype(np.float32), flux)


def take_out(
    mean: NDArray[np.float32], points: GBuffer, lamps: Lamps, alphas: NDArray[np.float32], places: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Subtract the highlights that open points would show from the sums, in place; returns those sums as they were.

    Args:
        mean: (P, sums, CHANNELS). alphas: (S,) of the lobes. places: (2 S,), their first sums, then their second ones.
    Returns:
        (P, 2 S, CHANNELS).
    """
    kept = np.empty((len(mean), len(places), mean.shape[2]), np.float32)
    light = (lamps.direction, lamps.spread, lamps.flux)

    def part(start: int, end: int) -> None:
        _take_out(points.n, points.wo, alphas, light, places, start, end, mean, kept)

    in_parts(part, len(mean), 512)
    return kept


def put_back(
    smooth: NDArray[np.float32], mean: NDArray[np.float32], kept: NDArray[np.float32], places: NDArray[np.int64]
) -> None:
    """Undo `take_out` in sums that were smoothed meanwhile, in place: what smoothing has changed is added to what was kept."""
    in_parts(lambda start, end: _put_back(smooth, mean, kept, places, start, end), len(mean), 4096)


@fast
def _put_back(smooth, mean, kept, places, start, end):  # type: ignore[no-untyped-def]
    for p in range(start, end):
        for j in range(len(places)):
            for c in range(kept.shape[2]):
                change = smooth[p, places[j], c] - mean[p, places[j], c]
                smooth[p, places[j], c] = max(kept[p, j, c] + change, np.float32(0))


@fast
def _take_out(n, wo, alphas, light, places, start, end, mean, kept):  # type: ignore[no-untyped-def]
    f32 = np.float32
    direction, spread, flux = light
    lobes, channels = len(alphas), mean.shape[2]
    count = len(spread) if lobes > 0 else 0
    sin2, cosine = np.empty(count, f32), np.empty(count, f32)
    tan2, grazing, blur, window = np.empty(count, f32), np.empty(count, f32), np.empty(count, f32), np.empty(count, f32)
    weights, radiance = np.empty(2 * lobes * count, f32), np.empty((count, channels), f32)
    shown = np.zeros((2 * lobes, channels), f32)
    for p in range(start, end):
        ox, oy, oz = wo[p, 0], wo[p, 1], wo[p, 2]
        nx, ny, nz = n[p, 0], n[p, 1], n[p, 2]
        wo_z = max(ox * nx + oy * ny + oz * nz, f32(MIN_COSINE))
        tan2_o = max(f32(1) - wo_z * wo_z, f32(0)) / (wo_z * wo_z)
        for k in range(count):
            hx, hy, hz = direction[0, k] + ox, direction[1, k] + oy, direction[2, k] + oz
            hn = hx * nx + hy * ny + hz * nz
            cosine[k] = direction[0, k] * nx + direction[1, k] * ny + direction[2, k] * nz
            sin2[k] = f32(1) - hn * hn / max(hx * hx + hy * hy + hz * hz, f32(1e-6))
            sin2[k] = max(sin2[k], f32(0)) if cosine[k] > f32(1e-3) else f32(1)
        m = 0
        for k in range(count):
            if sin2[k] < f32(CONE):
                to_half = math.sqrt(f32(0.5) * (f32(1) + direction[0, k] * ox + direction[1, k] * oy + direction[2, k] * oz))
                grazing[m] = max(f32(1) - to_half, f32(0)) ** 5
                tan2[m] = (f32(1) - cosine[k] * cosine[k]) / (cosine[k] * cosine[k])
                blur[m] = f32(0.25) * spread[k]  # half vectors spread half as far
                window[m] = f32(0.25 / math.pi) / wo_z * (f32(1) - sin2[k] / f32(CONE)) ** 2
                radiance[m] = flux[k]
                sin2[m] = sin2[k]
                m += 1
        if m > 0:
            weight = weights[: 2 * lobes * m].reshape((2 * lobes, m))
            for a in range(lobes):
                for i in range(m):
                    a2 = alphas[a] * alphas[a] + blur[i]
                    q = sin2[i] + a2 * (f32(1) - sin2[i])
                    masking = f32(0.5) * (math.sqrt(f32(1) + a2 * tan2_o) + math.sqrt(f32(1) + a2 * tan2[i]))
                    f = window[i] * a2 / (q * q * masking)
                    weight[a, i] = (f32(1) - grazing[i]) * f
                    weight[lobes + a, i] = grazing[i] * f
            np.dot(weight, radiance[:m], shown)
        else:
            shown[:] = 0
        for j in range(2 * lobes):
            for c in range(channels):
                kept[p, j, c] = mean[p, places[j], c]
                mean[p, places[j], c] -= shown[j, c]
