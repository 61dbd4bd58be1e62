"""Highlights of lamps, which are known but for what stands in their way, kept out of the averaging of noise.

A lamp mirrored in a glossy surface makes a highlight that may be narrower than the window over which noise is averaged,
and averaging would flatten it. So what an open point would show of the lamps is taken out of the sums before, as far as it
is seen there, and put back after: noise and the rest of the light are what is averaged. Any guess is right in the end, for
what is put back is what was taken out; only a smooth cone around the mirror direction counts.

Source: Bako et al. 2017, "Kernel-Predicting Convolutional Networks for Denoising Monte Carlo Renderings" (denoising what is
left of a picture when what is known is taken out).
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d

from stages.core.albedo import MIN_COSINE
from stages.core.lanes import LANES, fill, load, store
from stages.core.parallel import compiled
from stages.light.gbuffer import GBuffer
from stages.light.lamps import Lamps
from stages.light.light_set import CHANNELS
from stages.light.reconstruction import BLOCK, Neighbours, fast, in_parts

CONE = 0.15
"""Squared sine of the angle between half vector and normal at which a highlight is let go: 23 degrees."""

AROUND = (0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25)
"""How the blocks around one count in how far its highlights are seen: fewer are too noisy to tell."""


def open_highlights(
    points: GBuffer, lamps: Lamps, alphas: NDArray[np.float32], channels: int = CHANNELS
) -> NDArray[np.float32]:
    """What points show of lamps with nothing in the way, (P, 2 S, channels): terms A of the S lobes, then B.

    Args: alphas: (P, S) of the lobes.
    """
    shown = np.empty((len(points.n), 2 * alphas.shape[1], channels), np.float32)
    light = (lamps.direction, lamps.spread, np.ascontiguousarray(lamps.flux))
    in_parts(lambda start, end: _show(points.n, points.wo, alphas, light, start, end, shown), len(shown), 512)
    return shown


def take_out(
    mean: NDArray[np.float32], noise: NDArray[np.float32], shown: NDArray[np.float32], places: NDArray[np.int64],
    near: Neighbours,
) -> NDArray[np.float32]:  # fmt: skip
    """Subtract open highlights from the sums, in place, as far as they are seen; returns those sums as they were.

    How far is the slope of a regression of the sums on the highlights, lobe by lobe in the blocks around a pixel, for each
    environment: 1 where lamps are in view, 0 in their shadow.

    Args:
        mean, noise: (P, sums, CHANNELS), noise being the variance. shown: of `open_highlights`. places: (2 S,) of its terms.
    Returns:
        (P, 2 S, CHANNELS).
    """
    height, width = near.index.shape
    moments = np.zeros((-(-height // BLOCK), -(-width // BLOCK), 2, mean.shape[2] // 3), np.float32)
    in_parts(lambda start, end: _regress(mean, noise, shown, places, near.index, start, end, moments), len(moments), 8)
    for axis in (0, 1):
        moments = convolve1d(moments, AROUND, axis=axis, mode="constant")
    kept = np.empty_like(shown)
    in_parts(lambda start, end: _take_out(mean, shown, places, near.pixel, moments, start, end, kept), len(mean), 4096)
    return kept


def put_back(
    smooth: NDArray[np.float32], mean: NDArray[np.float32], kept: NDArray[np.float32], places: NDArray[np.int64]
) -> None:
    """Undo `take_out` in sums that were smoothed meanwhile, in place: what smoothing has changed is added to what was kept."""
    in_parts(lambda start, end: _put_back(smooth, mean, kept, places, start, end), len(mean), 4096)


@fast
def _show(n, wo, alphas, light, start, end, shown):  # type: ignore[no-untyped-def]
    f32 = np.float32
    direction, spread, flux = light
    lobes, count, channels = alphas.shape[1], len(spread), shown.shape[2]
    sin2, cosine, near = np.empty(count, f32), np.empty(count, f32), np.empty(count, np.int32)
    tan2, grazing, blur, window = np.empty(count, f32), np.empty(count, f32), np.empty(count, f32), np.empty(count, f32)
    weight, total = np.empty((2, count), f32), np.empty((2, LANES), f32)
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
            near[m] = k
            m += sin2[k] < f32(CONE)
        for i in range(m):
            k = near[i]
            half2 = f32(0.5) * (f32(1) + direction[0, k] * ox + direction[1, k] * oy + direction[2, k] * oz)
            away = max(f32(1) - math.sqrt(half2), f32(0))
            grazing[i] = away * away * away * away * away
            tan2[i] = (f32(1) - cosine[k] * cosine[k]) / (cosine[k] * cosine[k])
            blur[i] = f32(0.25) * spread[k]  # half vectors spread half as far
            inside = f32(1) - sin2[k] * f32(1 / CONE)
            window[i] = f32(0.25 / math.pi) / wo_z * inside * inside
            sin2[i] = sin2[k]
        for a in range(lobes):
            for i in range(m):
                a2 = alphas[p, a] * alphas[p, a] + blur[i]
                q = sin2[i] + a2 * (f32(1) - sin2[i])
                masking = f32(0.5) * (math.sqrt(f32(1) + a2 * tan2_o) + math.sqrt(f32(1) + a2 * tan2[i]))
                f = window[i] * a2 / (q * q * masking)
                weight[0, i], weight[1, i] = (f32(1) - grazing[i]) * f, grazing[i] * f
            first, second = fill(f32(0)), fill(f32(0))
            for i in range(m):
                power = load(flux, near[i] * LANES)
                first, second = first + power * weight[0, i], second + power * weight[1, i]
            store(total, 0, first)
            store(total, LANES, second)
            for c in range(channels):
                shown[p, a, c], shown[p, lobes + a, c] = total[0, c], total[1, c]


@fast
def _regress(mean, noise, shown, places, index, first, end, moments):  # type: ignore[no-untyped-def]
    """Covariance with the highlights and their variance, as multiples of the noise, in some rows of blocks."""
    f32 = np.float32
    lobes, channels = shown.shape[1] // 2, 3 * moments.shape[3]
    total, light, spread = np.empty((lobes, channels), f32), np.empty((lobes, channels), f32), np.empty((lobes, channels), f32)
    product, square = np.empty((lobes, channels), f32), np.empty((lobes, channels), f32)
    for row in range(first, end):
        for column in range(moments.shape[1]):
            count = 0
            total[:], light[:], product[:], square[:], spread[:] = 0, 0, 0, 0, 0
            for y in range(row * BLOCK, min((row + 1) * BLOCK, index.shape[0])):
                for x in range(column * BLOCK, min((column + 1) * BLOCK, index.shape[1])):
                    p = index[y, x]
                    if p < 0:
                        continue
                    count += 1
                    for j in range(lobes):
                        for c in range(channels):
                            m, g = mean[p, places[j], c], shown[p, j, c]
                            total[j, c] += m
                            light[j, c] += g
                            product[j, c] += m * g
                            square[j, c] += g * g
                            spread[j, c] += noise[p, places[j], c]
            for j in range(lobes if count > 1 else 0):
                for c in range(channels):
                    if spread[j, c] > 0:
                        moments[row, column, 0, c // 3] += (product[j, c] - total[j, c] * light[j, c] / count) / spread[j, c]
                        moments[row, column, 1, c // 3] += (square[j, c] - light[j, c] ** 2 / count) / spread[j, c]


@fast
def _take_out(mean, shown, places, pixel, moments, start, end, kept):  # type: ignore[no-untyped-def]
    f32 = np.float32
    rows, columns, _, lights = moments.shape
    seen = np.empty(shown.shape[2], f32)
    for p in range(start, end):
        y, x = f32(pixel[p, 1]) / f32(BLOCK) - f32(0.5), f32(pixel[p, 0]) / f32(BLOCK) - f32(0.5)
        seen[:] = 0
        for e in range(lights):
            along, whole = f32(0), f32(0)
            for r in range(max(math.floor(y), 0), min(math.floor(y) + 2, rows)):
                for c in range(max(math.floor(x), 0), min(math.floor(x) + 2, columns)):
                    w = (f32(1) - abs(y - f32(r))) * (f32(1) - abs(x - f32(c)))
                    along += w * moments[r, c, 0, e]
                    whole += w * moments[r, c, 1, e]
            share = min(max(along / whole, f32(0)), f32(1)) if whole > f32(0) else f32(0)
            seen[3 * e : 3 * e + 3] = share
        for j in range(len(places)):
            for c in range(kept.shape[2]):
                kept[p, j, c] = mean[p, places[j], c]
                mean[p, places[j], c] -= seen[c] * shown[p, j, c]


@compiled  # in this very order: no highlight is added to what it hides
def _put_back(smooth, mean, kept, places, start, end):  # type: ignore[no-untyped-def]
    for p in range(start, end):
        for j in range(len(places)):
            for c in range(kept.shape[2]):
                change = smooth[p, places[j], c] - mean[p, places[j], c]
                smooth[p, places[j], c] = max(kept[p, j, c] + change, np.float32(0))
