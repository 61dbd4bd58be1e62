"""What the sides of an object's cells send along rays, given their materials and what they receive.

A side's matt part sends what it receives. Its gloss, where it is rough, sends what the side's own rays bring, weighted by its
lobe: the sky along those that end on nothing, and other sides. Where it is smooth, it sends what a mirror there shows: the sky,
blurred a little, or another side, of which the same is asked once more. After two mirrors, a side sends alike to everywhere.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from stages.core import albedo
from stages.core.albedo import MIN_COSINE
from stages.core.knots import F0
from stages.core.parallel import compiled, in_parallel, slices
from stages.light.ends import DARK, OPEN, STEPS, Ends
from stages.light.environment import Environment
from stages.light.light_set import bordered
from stages.light.octahedral import octahedral
from stages.light.prefilter import blurred
from stages.light.transport_kernels import fast, on_square

ROUGHNESS = (0.0, 0.25, 0.5, 0.75, 1.0)
SIZES = (512, 64, 64, 32, 32)
"""Levels of an environment as gloss shows it, and texels along each side of their octahedral squares."""

ROWS = 64
"""Rows of the environment that is blurred."""

SOFT = 0.36
"""Least roughness of gloss that a wide lobe sees, and of a side's: their few rays would sparkle."""

NARROW, WIDE = 0.2, 0.35
"""Roughness up to which gloss of a side shows what its mirror's ray meets, and from which on what the side's own rays meet."""

POINTS_PER_TASK = 1 << 11

RAYS_PER_TASK = 1 << 16

MOST = 256
"""Rays of a side at most."""


class Sky(NamedTuple):
    """L environments, blurred by each of ROUGHNESS: texels (T, 3 L), level after level, each with a border of one texel; first
    (levels,) where each begins."""

    texels: NDArray[np.float32]
    first: NDArray[np.int64]


class Around(NamedTuple):
    """All around the sides of an object's cells, as their R rays meet it, side after side.

    start: (S + 1,) where a side's rays begin. direction: (3, R). angle: (R,), solid angle that each stands for, steradians.
    """

    start: NDArray[np.int32]
    direction: NDArray[np.float32]
    angle: NDArray[np.float32]


class OwnLight(NamedTuple):
    """Sides of cells under L environments. bounces: that a path may have made. material: (S, 5) albedo, roughness, metallic.

    light, before: (S, 3 L), what they receive, and that with one bounce less. sent: (S, 3 L), what they send with two less.
    brought: (R, 3 L), what each of their rays brings, with one bounce less. around: those rays.
    """

    bounces: int
    material: NDArray[np.float32]
    light: NDArray[np.float32]
    before: NDArray[np.float32]
    sent: NDArray[np.float32]
    brought: NDArray[np.float32]
    around: Around


def make_skies(environments: Sequence[Environment]) -> list[Sky]:
    """Each environment, as gloss of an object shows it to the object itself."""
    return in_parallel(_sky, environments)


def _sky(environment: Environment) -> Sky:
    flat = [bordered(level).reshape(-1, 3).astype(np.float32) for level in _levels(environment)]
    return Sky(np.concatenate(flat), np.cumsum([0, *map(len, flat[:-1])]))


def _levels(environment: Environment) -> list[NDArray[np.float32]]:
    roi = oiio.ROI(0, 2 * ROWS, 0, ROWS, 0, 1, 0, 3)
    small = oiio.ImageBufAlgo.resize(oiio.ImageBuf(environment.radiance), filtername="box", roi=roi)
    coarse = np.asarray(small.get_pixels(oiio.FLOAT), np.float32).reshape(ROWS, 2 * ROWS, 3)
    rough = [blurred(coarse, r, ROWS // 2) for r in ROUGHNESS[1:]]
    images = [environment.radiance, *rough]
    return [octahedral(image, size, 2) for image, size in zip(images, SIZES, strict=True)]


def arriving(ends: Ends, own: OwnLight, sky: Sky, part: slice) -> NDArray[np.float32]:
    """What the blocked rays of some points bring them: (rays, 3 L)."""
    result = np.empty((ends.start[part.stop] - ends.start[part.start], own.light.shape[1]), np.float32)
    start = ends.start[part.start : part.stop + 1]
    _arriving(start, (*ends.rays, *ends.mirrors), own, sky, (albedo.table(), albedo.diffuse_table()), result)
    return result


def mirrored(ends: Ends, own: OwnLight, sky: Sky, part: slice, least: NDArray[np.float32]) -> NDArray[np.float32]:
    """What the mirror rays of some points bring them, seen by lobes of several roughnesses: (points, M, 3 L), 0 without one.

    Args: least: (points, M), roughness of each lobe.
    """
    result = np.zeros((*least.shape, own.light.shape[1]), np.float32)
    start = ends.start[part.start : part.stop + 1]
    first = np.count_nonzero(ends.mirror[: part.start])
    rays = (*ends.rays, *ends.mirrors)
    _mirrored(start, ends.mirror[part], rays, first, least, own, sky, (albedo.table(), albedo.diffuse_table()), result)
    return result


def received(
    ends: Ends, weight: NDArray[np.float32], own: OwnLight, sky: Sky
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """What all rays of each of the points bring it, each of a weight: (P, 3 L), and what each ray brings, (R, 3 L)."""
    points = len(ends.mirror)
    result = np.zeros((points, own.light.shape[1]), np.float32)
    brought = np.empty((len(weight), own.light.shape[1]), np.float32)

    def task(part: slice) -> None:
        rays = slice(ends.start[part.start], ends.start[part.stop])
        brought[rays] = arriving(ends, own, sky, part)
        _weighted(ends.start[part.start : part.stop + 1], weight, brought[rays], result[part])

    in_parallel(task, slices(points, POINTS_PER_TASK))
    return result, brought


def open_sky(ends: Ends, angle: NDArray[np.float32], sky: Sky) -> NDArray[np.float32]:
    """What the rays of the sides bring that end on nothing: (R, 3 L), 0 of the others. Args: angle: (R,) of `Around`."""
    result = np.zeros((len(angle), sky.texels.shape[1]), np.float32)

    def task(part: slice) -> None:
        _shown(ends.side[part], ends.towards[part], angle[part], sky, result[part])

    in_parallel(task, slices(len(angle), RAYS_PER_TASK))
    return result


def reflectance(material: NDArray[np.float32]) -> NDArray[np.float32]:
    """Share of an even light that materials (S, 5) reflect in all: (S, 3)."""
    c, r, m = material[:, :3], material[:, 3], material[:, 4:5]
    weight = _cosine_weights()
    over = (weight[None, :, None] * albedo.table()).sum(1)
    a, b = (np.interp(r, np.linspace(0, 1, len(over)), over[:, k])[:, None] for k in (0, 1))
    matt = float((weight * albedo.diffuse_table()).sum())
    return ((1 - m) * c * matt + (F0 * (1 - m) + m * c) * a + b).astype(np.float32)


def _cosine_weights() -> NDArray[np.float64]:
    """Of the columns of `core.albedo`: their shares of the integral of 2 cos d cos, by the trapezoidal rule."""
    x = albedo.cosines()
    x[0] = 0
    step = np.diff(x)
    weight = x * (np.append(step, 0) + np.append(0, step))
    return weight / weight.sum()


@compiled
def _weighted(start, weight, brought, out):  # type: ignore[no-untyped-def]
    for p in range(len(out)):
        for ray in range(start[p], start[p + 1]):
            for c in range(out.shape[1]):
                out[p, c] += weight[ray] * brought[ray - start[0], c]


@compiled(inline="always")
def _between(table, x):  # type: ignore[no-untyped-def]
    """A table over the cosines of `core.albedo`, linear. Args: x: square root of the cosine, in steps."""
    column = min(int(x), len(table) - 2)
    within = x - np.float32(column)
    return table[column] * (np.float32(1) - within) + table[column + 1] * within


@compiled(inline="always")
def _look_up(sky, place, roughness, out):  # type: ignore[no-untyped-def]
    """Radiance of all environments along a direction, blurred by a roughness. Args: place: of `Ends`, two whole numbers."""
    f32 = np.float32
    low = min(int(roughness * f32(len(ROUGHNESS) - 1)), len(ROUGHNESS) - 2)
    least, most = f32(ROUGHNESS[low] ** 4), f32(ROUGHNESS[low + 1] ** 4)  # a lobe's variance goes as its alpha squared
    between = min(max((roughness**4 - least) / (most - least), f32(0)), f32(1))
    out[:] = 0
    for k in range(2):
        share = between if k else f32(1) - between
        if share <= f32(0):
            continue
        size = SIZES[low + k]
        x, y = f32(place[0]) * f32(size / STEPS) + f32(0.5), f32(place[1]) * f32(size / STEPS) + f32(0.5)
        left, top = min(int(x), size), min(int(y), size)
        x, y = x - f32(left), y - f32(top)
        above = sky.first[low + k] + top * (size + 2) + left
        below = above + size + 2
        w00, w01 = share * (f32(1) - x) * (f32(1) - y), share * x * (f32(1) - y)
        w10, w11 = share * (f32(1) - x) * y, share * x * y
        for c in range(len(out)):
            upper = w00 * sky.texels[above, c] + w01 * sky.texels[above + 1, c]
            out[c] += upper + w10 * sky.texels[below, c] + w11 * sky.texels[below + 1, c]


@compiled(inline="always")
def _cosine(one, two):  # type: ignore[no-untyped-def]
    """Cosine to the normal of the mirror that turns a direction into another; both of `Ends`."""
    x, y, z = on_square(one[0] * np.float32(1 / STEPS), one[1] * np.float32(1 / STEPS))
    u, v, w = on_square(two[0] * np.float32(1 / STEPS), two[1] * np.float32(1 / STEPS))
    return np.sqrt(min(max((np.float32(1) - (x * u + y * v + z * w)) * np.float32(0.5), np.float32(0)), np.float32(1)))


@compiled(inline="always")
def _whole(table, x, roughness):  # type: ignore[no-untyped-def]
    """What a rough mirror shows of an even light: sums A and B of `core.albedo`. Args: x: root of the cosine, in steps."""
    row = roughness * np.float32(len(table) - 1)
    low = min(int(row), len(table) - 2)
    within = row - np.float32(low)
    a = _between(table[low, :, 0], x) * (np.float32(1) - within) + _between(table[low + 1, :, 0], x) * within
    b = _between(table[low, :, 1], x) * (np.float32(1) - within) + _between(table[low + 1, :, 1], x) * within
    return a, b


@compiled(inline="always")
def _send(material, cosine, light, tables, out):  # type: ignore[no-untyped-def]
    """What a side sends where its gloss shows `out`, which is overwritten. Args: light: (3 L,), what it receives."""
    f32 = np.float32
    table, diffuse = tables
    r, m = material[3], material[4]
    x = np.sqrt(cosine) * f32(len(diffuse) - 1)
    a, b = _whole(table, x, r)
    matt = _between(diffuse, x) * (f32(1) - m)
    for c in range(len(out)):
        gloss = (f32(F0) * (f32(1) - m) + m * material[c % 3]) * a + b
        out[c] = matt * material[c % 3] * light[c] + gloss * out[c]


@compiled(inline="always")
def _rougher(roughness, other):  # type: ignore[no-untyped-def]
    """Roughness of one lobe seen through another: the squares of their alphas add up."""
    a, b = roughness * roughness, other * other
    return min(np.sqrt(np.sqrt(a * a + b * b)), np.float32(1))


@fast
def _lobe(direction, angle, d, n, a2, weight):  # type: ignore[no-untyped-def]
    """Weights of a side's rays in its gloss towards -d, written to `weight`. Args: direction: three components, (K,) each."""
    f32 = np.float32
    x, y, z = direction
    n_o = max(-(d[0] * n[0] + d[1] * n[1] + d[2] * n[2]), f32(MIN_COSINE))
    masking = f32(0.5) * math.sqrt(f32(1) + a2 * (f32(1) / (n_o * n_o) - f32(1)))
    for i in range(len(x)):
        cosine = n[0] * x[i] + n[1] * y[i] + n[2] * z[i]
        n_i = max(cosine, f32(MIN_COSINE))
        square = f32(2) - f32(2) * (d[0] * x[i] + d[1] * y[i] + d[2] * z[i])  # of the half vector's length
        cos2 = min((n_i + n_o) * (n_i + n_o) / max(square, f32(1e-6)), f32(1))
        q = f32(1) - cos2 + a2 * cos2
        shadowing = f32(0.5) * math.sqrt(f32(1) + a2 * (f32(1) / (n_i * n_i) - f32(1)))
        weight[i] = angle[i] / (q * q * (masking + shadowing)) if cosine > f32(MIN_COSINE) else f32(0)


@compiled
def _around(side, one, two, roughness, own, scratch, out):  # type: ignore[no-untyped-def]
    """What a side's own rays show to its gloss, their mean by the lobe, written to `out`. Returns: whether there are any.

    Args: one, two: of `Ends`, the direction of a ray and that of its mirror image. scratch: of MOST weights.
    """
    f32 = np.float32
    start, direction, angle = own.around
    rays = slice(start[side], start[side + 1])
    d = on_square(one[0] * f32(1 / STEPS), one[1] * f32(1 / STEPS))
    x, y, z = on_square(two[0] * f32(1 / STEPS), two[1] * f32(1 / STEPS))
    x, y, z = x - d[0], y - d[1], z - d[2]
    scale = f32(1) / max(math.sqrt(x * x + y * y + z * z), f32(1e-6))
    blurred = f32(ROUGHNESS[1] ** 4)  # the sky is, by so much
    a2 = max(roughness**4 - blurred, blurred)
    weight = scratch[: rays.stop - rays.start]
    where = direction[0, rays], direction[1, rays], direction[2, rays]
    _lobe(where, angle[rays], d, (x * scale, y * scale, z * scale), a2, weight)
    out[:] = 0
    total = f32(0)
    for i in range(len(weight)):
        total += weight[i]
        for c in range(len(out)):
            out[c] += weight[i] * own.brought[rays.start + i, c]
    if total > f32(0):
        scale = f32(1) / total
        for c in range(len(out)):
            out[c] *= scale
    return total > f32(0)


@compiled(inline="always")
def _mirror_there(ray, number, rays, rough, own, sky, tables, shown):  # type: ignore[no-untyped-def]
    """What a smooth side shows at the end of a ray: the sky along its mirror, or another side, of which the same is asked."""
    _, _, onward, second, third, beyond = rays
    if second[number] == OPEN:
        _look_up(sky, onward[ray], rough, shown)
    elif second[number] == DARK or own.bounces < 2:
        shown[:] = 0
    else:
        there = second[number]
        if third[number] == OPEN:
            _look_up(sky, beyond[number], _rougher(rough, own.material[there, 3]), shown)
        elif third[number] == DARK:
            shown[:] = 0
        else:
            shown[:] = own.sent[third[number]]
        _send(own.material[there], _cosine(onward[ray], beyond[number]), own.before[there], tables, shown)


@compiled
def _along(ray, number, rays, lobe, least, own, sky, tables, scratch, shown):  # type: ignore[no-untyped-def]
    """What comes along a ray, seen by a lobe of a roughness, written to `shown`.

    Args: number: of a mirror's ray among those; -1 for one of a lobe, which shows what the side's own rays bring, or nothing.
    least: roughness taken at least.
    """
    f32 = np.float32
    side, towards, onward = rays[0][ray], rays[1][ray], rays[2][ray]
    if side >= DARK:
        shown[:] = 0
        return
    weight, seen = scratch
    rough = _rougher(max(own.material[side, 3], least), lobe)
    wide = f32(1) if number < 0 else min(max((rough - f32(NARROW)) * f32(1 / (WIDE - NARROW)), f32(0)), f32(1))
    if wide > f32(0) and not _around(side, towards, onward, rough, own, weight, seen) and number >= 0:
        wide = f32(0)
    if wide < f32(1):
        _mirror_there(ray, number, rays, rough, own, sky, tables, shown)
        for c in range(len(shown)):
            shown[c] += wide * (seen[c] - shown[c])
    else:
        shown[:] = seen
    _send(own.material[side], _cosine(towards, onward), own.light[side], tables, shown)


@compiled
def _arriving(start, rays, own, sky, tables, out):  # type: ignore[no-untyped-def]
    """`arriving`; start begins at the first of the rays that are wanted."""
    scratch = np.empty(MOST, np.float32), np.zeros(out.shape[1], np.float32)
    for ray in range(start[0], start[-1]):
        _along(ray, -1, rays, np.float32(0), np.float32(SOFT), own, sky, tables, scratch, out[ray - start[0]])


@compiled
def _mirrored(start, mirror, rays, first, least, own, sky, tables, out):  # type: ignore[no-untyped-def]
    """`mirrored`; start begins at the first of the points that are wanted, and first is the number of its mirror's ray."""
    scratch = np.empty(MOST, np.float32), np.zeros(out.shape[2], np.float32)
    number = first
    for p in range(len(mirror)):
        if mirror[p]:
            for k in range(least.shape[1]):
                lobe = least[p, k]
                _along(start[p + 1] - 1, number, rays, lobe, np.float32(0), own, sky, tables, scratch, out[p, k])
            number += 1


@compiled
def _shown(side, towards, angle, sky, out):  # type: ignore[no-untyped-def]
    """`open_sky`."""
    for i in range(len(side)):
        if side[i] == OPEN:
            width = np.sqrt(angle[i] * np.float32(0.25 / np.pi))  # half the radius of what the ray stands for
            blur = max(np.sqrt(np.float32(0.5) * width), np.float32(ROUGHNESS[1]))  # else suns fall between the rays
            _look_up(sky, towards[i], min(blur, np.float32(1)), out[i])
