"""Taking the Monte Carlo noise out of a view's sums by its own estimate of that noise.

The rays of a point come in two halves; their difference tells the variance. A sum is replaced by a weighted mean over
the window around its pixel, of those neighbours that lie on the same surface and differ from it by no more than noise
explains. Where nothing is noisy nothing changes, so the bias falls with the variance. Sums of which the differences count,
as those of one lobe at many roughnesses, share their weights: what they have in common then cancels as it did before.

Source: Rousselle, Knaus & Zwicker 2012, "Adaptive Rendering with Non-Local Means Filtering" (two halves, acceptance by
variance).
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core.lanes import LANES, fill, larger, load, smaller, store, sum_of, where_positive
from stages.core.parallel import compiled, cores
from stages.light.gbuffer import GBuffer

RADIUS = 2
"""Of the window, pixels: it holds every class of a 4 x 4 block of interleaved samples at least once."""

TOLERANCE = 12.0
"""A neighbour counts for nothing when its squared difference exceeds this many times the sum of both variances; its own
is taken for no more than the point's, so that noise does not flow to where there is none."""

TOGETHER = 8.0
"""Nor does it count when the squared differences of the first sum, diffuse light, exceed this many times what noise explains,
on average over all lights and colours: what stands in the way of one light stands in the way of others."""

NORMALS = 100.0
"""Squared difference of unit normals, inverse, at which a neighbour counts for nothing: 7 degrees."""

BEND = 0.1
"""Squared sine of the angle out of the tangent plane at which a neighbour counts for nothing: 18 degrees."""

BLOCK = 4
"""Side, in pixels, of the blocks over which variance is averaged."""

POINTS_PER_TASK = 4096

inline = compiled(inline="always")

fast = compiled(fastmath={"contract", "reassoc", "nsz", "arcp"})


@dataclass(frozen=True)
class Neighbours:
    """Where points lie in the image. index: (H, W) row of a pixel's point or -1. pixel: (P, 2), x and y. n, point."""

    index: NDArray[np.int32]
    pixel: NDArray[np.int32]
    n: NDArray[np.float32]
    point: NDArray[np.float32]

    @staticmethod
    def of(points: GBuffer) -> "Neighbours":
        y, x = np.nonzero(points.mask)
        index = np.full(points.mask.shape, -1, np.int32)
        index[y, x] = np.arange(len(x))
        return Neighbours(index, np.stack([x, y], -1).astype(np.int32), points.n, points.point)

    @staticmethod
    def on_lattice(x: NDArray, y: NDArray, n: NDArray, point: NDArray) -> "Neighbours":
        """Of points that lie on every so manieth pixel, (P,) each, as crops show them."""
        step = max(1, int(np.gcd(np.gcd.reduce(x - x[:1]), np.gcd.reduce(y - y[:1]))))
        pixel = np.stack([x, y], -1).astype(np.int32) // step
        width, height = pixel.max(0, initial=-1) + 1
        index = np.full((height, width), -1, np.int32)
        index[pixel[:, 1], pixel[:, 0]] = np.arange(len(pixel))
        return Neighbours(index, pixel, np.ascontiguousarray(n, np.float32), np.ascontiguousarray(point, np.float32))


def variance(gap: NDArray[np.float32], near: Neighbours) -> NDArray[np.float32]:
    """Variance of each sum from the difference of its two halves, (P, ...): its own or its block's, the larger one.

    `gap` may be overwritten.
    """
    flat = _rows(gap)
    in_parts(lambda start, end: _variance(flat, near.index, start, end), -(-len(near.index) // BLOCK), 8)
    return flat.reshape(gap.shape)


Estimate = tuple[NDArray[np.float32], NDArray[np.float32]]
"""Sums and their variances."""


def merge(into: Estimate, rows: NDArray[np.int64], more: Estimate, share: NDArray[np.float32]) -> None:
    """Average an independent estimate of some points into theirs, in place.

    Args:
        into: (P, sums, channels). more: (rows, sums, channels). share: (rows, channels), weight of the new one.
    """
    mean, noise, new_mean, new_noise = map(_rows, (*into, *more))

    def part(start: int, end: int) -> None:
        _merge(mean, noise, rows, new_mean, new_noise, share, start, end)

    in_parts(part, len(rows), POINTS_PER_TASK)


def smoothed(
    mean: NDArray[np.float32], noise: NDArray[np.float32], near: Neighbours, joint: tuple[int, ...] = ()
) -> NDArray[np.float32]:
    """The sums, (P, sums, channels), with the noise of variance `noise` averaged away.

    joint: sums that share their weights, channel by channel; the others have their own.
    """
    return _weighted(mean, noise, near, 1, joint)


def noise_left(
    mean: NDArray[np.float32], noise: NDArray[np.float32], near: Neighbours, judged: tuple[int, ...]
) -> NDArray[np.float32]:
    """Noise that each point keeps under each light once smoothed, in tone-mapped sums, x / (1 + x): (P, lights) variances.

    A point on a thin rim, whose neighbours lie on other surfaces, keeps all its noise; one on a flat loses most of it.

    Args:
        mean, noise: (P, sums, channels), three channels a light. judged: the sums that count.
    """
    some, their_noise = (_sums(values, judged) for values in (mean, noise))
    left = _weighted(some, their_noise, near, 2)
    seen = np.empty((len(left), left.shape[2] // 3), np.float32)
    in_parts(lambda start, end: _seen(some, left, start, end, seen), len(seen), POINTS_PER_TASK)
    return seen


def largest(values: NDArray[np.float32], share: float) -> NDArray[np.bool_]:
    """Where the largest of some values are, that share of them all."""
    result = np.zeros(values.shape, np.bool_)
    count = int(share * values.size)
    if count:
        result.reshape(-1)[np.argpartition(-values, count - 1, None)[:count]] = True
    return result


def _sums(values: NDArray[np.float32], which: tuple[int, ...]) -> NDArray[np.float32]:
    """Some of the sums of each point."""
    result = np.empty((len(values), len(which), values.shape[2]), np.float32)

    def part(start: int, end: int) -> None:
        np.take(values[start:end], which, 1, result[start:end], "clip")

    in_parts(part, len(values), POINTS_PER_TASK)
    return result


def _weighted(
    mean: NDArray[np.float32], noise: NDArray[np.float32], near: Neighbours, power: int, joint: tuple[int, ...] = ()
) -> NDArray[np.float32]:
    """Over each point's neighbours: the weighted mean of the sums, power 1, or that mean's variance, power 2."""
    noisy = np.asarray((noise > 0).any((0, 2)))  # the others stay as they are
    own = np.array([k for k in np.flatnonzero(noisy) if k not in joint], np.int64)
    shared = np.array([k for k in joint if noisy[k]], np.int64)
    channels = mean.shape[2]
    mean, noise = _whole_lanes(mean), _whole_lanes(noise)
    values, result = mean if power == 1 else noise, np.empty_like(mean)
    geometry = (near.index, near.pixel, near.n, near.point)

    def part(start: int, end: int) -> None:
        _average(mean, noise, values, power, own, shared, geometry, start, end, result)

    in_parts(part, len(mean), POINTS_PER_TASK)
    return result[:, :, :channels]


def _whole_lanes(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """(P, sums, LANES), what is missing being 0."""
    missing = LANES - values.shape[2]
    return np.ascontiguousarray(np.pad(values, ((0, 0), (0, 0), (0, missing))) if missing else values, np.float32)


def _rows(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """(P, ...) as (P, values), also where P is 0."""
    return values.reshape(len(values), int(np.prod(values.shape[1:])))


def in_parts(work: Callable[[int, int], None], count: int, size: int) -> None:
    """Do `work(start, end)` for stretches of `size` that cover 0 to `count`, on all cores."""
    with ThreadPoolExecutor(cores()) as pool:
        list(pool.map(lambda start: work(start, min(start + size, count)), range(0, count, size)))


@fast
def _merge(mean, noise, rows, new_mean, new_noise, share, start, end):  # type: ignore[no-untyped-def]
    for i in range(start, end):
        p = rows[i]
        for k in range(mean.shape[1]):
            w = share[i, k % share.shape[1]]
            mean[p, k] += w * (new_mean[i, k] - mean[p, k])
            noise[p, k] = (np.float32(1) - w) ** 2 * noise[p, k] + w * w * new_noise[i, k]


@fast
def _seen(mean, noise, start, end, result):  # type: ignore[no-untyped-def]
    """Noise in the tone-mapped sums, of each point and light."""
    total = np.empty(mean.shape[2], np.float32)
    for p in range(start, end):
        total[:] = 0
        for k in range(mean.shape[1]):
            for c in range(mean.shape[2]):
                square = (np.float32(1) + max(mean[p, k, c], np.float32(0))) ** 2
                total[c] += noise[p, k, c] / (square * square)
        for e in range(result.shape[1]):
            result[p, e] = total[3 * e] + total[3 * e + 1] + total[3 * e + 2]


@fast
def _variance(gap, index, first, end):  # type: ignore[no-untyped-def]
    """`variance` of the blocks in some rows of blocks."""
    height, width = index.shape
    size = gap.shape[1]
    total = np.empty(size, np.float32)
    for top in range(first * BLOCK, min(end * BLOCK, height), BLOCK):
        for left in range(0, width, BLOCK):
            total[:] = 0
            count = 0
            for y in range(top, min(top + BLOCK, height)):
                for x in range(left, min(left + BLOCK, width)):
                    q = index[y, x]
                    if q >= 0:
                        count += 1
                        for k in range(size):
                            total[k] += gap[q, k] * gap[q, k]
            if count == 0:
                continue
            share = np.float32(1 / count)
            for y in range(top, min(top + BLOCK, height)):
                for x in range(left, min(left + BLOCK, width)):
                    q = index[y, x]
                    if q >= 0:
                        for k in range(size):
                            gap[q, k] = np.float32(0.25) * max(gap[q, k] * gap[q, k], total[k] * share)


@fast
def _same(n, point, p, q):  # type: ignore[no-untyped-def]
    """How far two points count as of one surface, 0 to 1."""
    f32 = np.float32
    turned, out, distance = f32(0), f32(0), f32(1e-20)
    for d in range(3):
        turned += (n[p, d] - n[q, d]) ** 2
        step = point[q, d] - point[p, d]
        out += step * n[p, d]
        distance += step * step
    same = max(f32(0), f32(1) - turned * f32(NORMALS))
    return same * max(f32(0), f32(1) - out * out / (distance * f32(BEND)))


@inline
def _unlike(mine, my_noise, other, other_noise):  # type: ignore[no-untyped-def]
    """Squared differences of values at two points, as multiples of what noise explains."""
    apart = mine - other
    return apart * apart / (my_noise + smaller(my_noise, other_noise) + np.float32(1e-20))


@fast
def _average(mean, noise, values, power, own, shared, near, start, end, result):  # type: ignore[no-untyped-def]
    """Sum of w^power values over the sum of w, to that power. Args: mean, noise, values, result: (P, sums, LANES).

    own: numbers of the sums that have weights of their own, each channel one. shared: of those that share them channel by
    channel, by what they are unlike on average.
    """
    f32 = np.float32
    index, pixel, n, point = near
    height, width = index.shape
    size = mean.shape[1] * LANES
    sums, weights = np.empty(size, np.float32), np.empty(size, np.float32)
    none, one, share = fill(f32(0)), fill(f32(1)), f32(1 / TOLERANCE) / f32(max(len(shared), 1))
    for p in range(start, end):
        x, y = pixel[p]
        me = p * size
        for k in range(0, size, LANES):
            store(sums, k, load(values, me + k))
            store(weights, k, one)
        whole = one
        first, first_noise = load(mean, me), load(noise, me)
        counts = where_positive(first_noise, one, none)
        counts = counts * (f32(1 / TOGETHER) / max(sum_of(counts), f32(1)))
        for j in range(max(y - RADIUS, 0), min(y + RADIUS, height - 1) + 1):
            for i in range(max(x - RADIUS, 0), min(x + RADIUS, width - 1) + 1):
                q = index[j, i]
                if q < 0 or q == p:
                    continue
                same = _same(n, point, p, q)
                if same <= f32(0):
                    continue
                other = q * size
                unlike = _unlike(first, first_noise, load(mean, other), load(noise, other))
                same *= f32(1) - sum_of(smaller(unlike, fill(f32(1e9))) * counts)
                if same <= f32(0):
                    continue
                for s in own:
                    k = s * LANES
                    unlike = _unlike(load(mean, me + k), load(noise, me + k), load(mean, other + k), load(noise, other + k))
                    left = larger(f32(1) - unlike * f32(1 / TOLERANCE), none)
                    w = left * left * same
                    store(weights, k, load(weights, k) + w)
                    if power != 1:
                        w = w * w
                    store(sums, k, load(sums, k) + w * load(values, other + k))
                if len(shared) == 0:
                    continue
                unlike = none
                for s in shared:
                    k = s * LANES
                    unlike = unlike + _unlike(
                        load(mean, me + k), load(noise, me + k), load(mean, other + k), load(noise, other + k)
                    )
                left = larger(f32(1) - unlike * share, none)
                w = left * left * same
                whole = whole + w
                if power != 1:
                    w = w * w
                for s in shared:
                    k = s * LANES
                    store(sums, k, load(sums, k) + w * load(values, other + k))
        for s in shared:
            store(weights, s * LANES, whole)
        for k in range(0, size, LANES):
            weight = load(weights, k)
            store(result, me + k, load(sums, k) / (weight if power == 1 else weight * weight))
