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

ALIKE = math.cos(math.radians(6))
"""Cosine between two rays of a point that end on one side from which on rough gloss sends alike along both."""

POINTS_PER_TASK = 1 << 11

RAYS_PER_TASK = 1 << 16

MOST = 256
"""Rays of a side at most."""


class Sky(NamedTuple):
    """L environments, blurred by each of ROUGHNESS: texels (T, 3 L), level after level, each with a border of one texel; first
    (levels,) where each begins."""

    texels: NDArray[np.float32]
    first: NDArray[np.int64]


class OwnLight(NamedTuple):
    """Sides of cells under L environments. bounces: that a path may have made. material: (S, 5) albedo, roughness, metallic.

    light, before: (S, 3 L), what they receive, and that with one bounce less. sent: (S, 3 L), what they send with two less.
    start: (S + 1,) where each side's rays begin, of R in all, in whole vectors, the last of which may be filled up by zeros.
    around: (4, R), their directions and the solid angles that they stand for, steradians. brought: (3 L, R), what each brings,
    with one bounce less.
    """

    bounces: int
    material: NDArray[np.float32]
    light: NDArray[np.float32]
    before: NDArray[np.float32]
    sent: NDArray[np.float32]
    start: NDArray[np.int32]
    around: NDArray[np.float32]
    brought: NDArray[np.float32]

    def by_light(self) -> "list[OwnLight]":
        """The same under each environment alone."""
        count = len(self.brought) // 3
        parts = [map(np.ascontiguousarray, np.split(a, count, 1)) for a in (self.light, self.before, self.sent)]
        lights = zip(*parts, np.split(self.brought, count), strict=True)
        return [self._replace(light=a, before=b, sent=c, brought=d) for a, b, c, d in lights]


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


def arriving(ends: Ends, own: OwnLight, sky: Sky, part: slice, blur: NDArray[np.float32]) -> NDArray[np.float32]:
    """What the blocked rays of some points bring them: (rays, 3 L).

    Args: blur: (points, J), roughness of what a ray that is followed stands for, by its `Ends.lobe`.
    """
    result = np.empty((ends.start[part.stop] - ends.start[part.start], own.light.shape[1]), np.float32)
    start, followed = ends.start[part.start : part.stop + 1], ends.followed[part]
    tables = albedo.table(), albedo.diffuse_table()
    _arriving(start, followed, ends.rays, own, tables, result)
    if followed.any():
        first = int(ends.followed[: part.start].sum(dtype=np.int64))
        _followed(start, followed, (*ends.rays, *ends.far), first, blur, own, sky, tables, result)
    return result


def received(
    ends: Ends, weight: NDArray[np.float32], own: OwnLight, sky: Sky
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """What all rays of each of the points bring it, each of a weight: (P, 3 L), and what each ray brings, (R, 3 L)."""
    points = len(ends.followed)
    none = np.zeros((points, 1), np.float32)
    result = np.zeros((points, own.light.shape[1]), np.float32)
    brought = np.empty((len(weight), own.light.shape[1]), np.float32)

    def task(part: slice) -> None:
        rays = slice(ends.start[part.start], ends.start[part.stop])
        brought[rays] = arriving(ends, own, sky, part, none[part])
        _weighted(ends.start[part.start : part.stop + 1], weight, brought[rays], result[part])

    in_parallel(task, slices(points, POINTS_PER_TASK))
    return result, brought


def open_sky(ends: Ends, angle: NDArray[np.float32], sky: Sky) -> NDArray[np.float32]:
    """What the rays of the sides bring that end on nothing: (R, 3 L), 0 of the others. Args: angle: (R,)."""
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
def _clear(values):  # type: ignore[no-untyped-def]
    """To 0, one by one: an assignment to a slice takes as long as all else."""
    for c in range(len(values)):
        values[c] = 0


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
    _clear(out)
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
def _direction(place):  # type: ignore[no-untyped-def]
    """Of two whole numbers of `Ends`."""
    return on_square(place[0] * np.float32(1 / STEPS), place[1] * np.float32(1 / STEPS))


@compiled(inline="always")
def _cosine(one, two):  # type: ignore[no-untyped-def]
    """Cosine to the normal of the mirror that turns a direction into another."""
    along = one[0] * two[0] + one[1] * two[1] + one[2] * two[2]
    return np.sqrt(min(max((np.float32(1) - along) * np.float32(0.5), np.float32(0)), np.float32(1)))


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
def _send(material, light, side, cosine, table, diffuse, out):  # type: ignore[no-untyped-def]
    """What a side sends where its gloss shows `out`, which is overwritten. Args: light: (S, 3 L), what sides receive."""
    f32 = np.float32
    r, m = material[side, 3], material[side, 4]
    x = np.sqrt(cosine) * f32(len(diffuse) - 1)
    a, b = _whole(table, x, r)
    matt = _between(diffuse, x) * (f32(1) - m)
    for c in range(len(out)):
        color = material[side, c % 3]
        gloss = (f32(F0) * (f32(1) - m) + m * color) * a + b
        out[c] = matt * color * light[side, c] + gloss * out[c]


@compiled(inline="always")
def _rougher(roughness, other):  # type: ignore[no-untyped-def]
    """Roughness of one lobe seen through another: the squares of their alphas add up."""
    a, b = roughness * roughness, other * other
    return min(np.sqrt(np.sqrt(a * a + b * b)), np.float32(1))


@fast
def _lobe(around, first, last, d, n, a2, weight):  # type: ignore[no-untyped-def]
    """Weights of a side's rays, `first` to `last`, in its gloss towards -d, written to `weight`: D and G times their angle."""
    f32 = np.float32
    n_o = max(-(d[0] * n[0] + d[1] * n[1] + d[2] * n[2]), f32(MIN_COSINE))
    masking, rest = math.sqrt(f32(1) + a2 * (f32(1) / (n_o * n_o) - f32(1))), f32(1) - a2
    x, y, z, angle = around[0, first:last], around[1, first:last], around[2, first:last], around[3, first:last]
    for i in range(last - first):
        cosine = n[0] * x[i] + n[1] * y[i] + n[2] * z[i]
        n_i = max(cosine, f32(MIN_COSINE))
        square = max(f32(2) - f32(2) * (d[0] * x[i] + d[1] * y[i] + d[2] * z[i]), f32(1e-6))  # of the half vector's length
        q = max(square - rest * (n_i + n_o) * (n_i + n_o), a2 * square) / square
        q2 = q * q * (masking * n_i + math.sqrt(a2 + rest * n_i * n_i))
        weight[i] = angle[i] * n_i / q2 if cosine > f32(MIN_COSINE) else f32(0)


@compiled
def _around(first, last, d, onward, roughness, around, brought, weight, out):  # type: ignore[no-untyped-def]
    """What a side's own rays, `first` to `last`, show to its gloss, their mean by the lobe, written to `out`.

    Args: d, onward: direction of a ray and that of its mirror image. weight: scratch, MOST long.
    Returns: whether there are any.
    """
    f32 = np.float32
    x, y, z = onward[0] - d[0], onward[1] - d[1], onward[2] - d[2]
    scale = f32(1) / max(math.sqrt(x * x + y * y + z * z), f32(1e-6))
    blurred = f32(ROUGHNESS[1] ** 4)  # the sky is, by so much
    a2 = max(roughness**4 - blurred, blurred)
    _lobe(around, first, last, d, (x * scale, y * scale, z * scale), a2, weight)
    return _mean(weight, brought, first, last, out)


@fast
def _mean(weight, brought, first, last, out):  # type: ignore[no-untyped-def]
    """Weighted mean of what some rays bring, written to `out`, 0 where no ray has a weight. Returns: whether any has."""
    f32 = np.float32
    total = f32(0)
    for i in range(last - first):
        total += weight[i]
    scale = f32(1) / total if total > f32(0) else f32(0)
    for c in range(len(out)):
        row, seen = brought[c, first:last], f32(0)
        for i in range(last - first):
            seen += weight[i] * row[i]
        out[c] = scale * seen
    return total > f32(0)


@compiled(inline="always")
def _mirror_there(ray, number, rays, towards, rough, cells, sky, tables, shown):  # type: ignore[no-untyped-def]
    """What a smooth side shows at the end of a ray: the sky along its mirror, or another side, of which the same is asked.

    Args: towards: direction of that mirror. cells: bounces, material, before and sent of `OwnLight`.
    """
    onward, second, third, beyond = rays
    bounces, material, before, sent = cells
    if second[number] == OPEN:
        _look_up(sky, onward[ray], rough, shown)
    elif second[number] == DARK or bounces < 2:
        _clear(shown)
    else:
        there = second[number]
        if third[number] == OPEN:
            _look_up(sky, beyond[number], _rougher(rough, material[there, 3]), shown)
        elif third[number] == DARK:
            _clear(shown)
        else:
            for c in range(len(shown)):
                shown[c] = sent[third[number], c]
        cosine = _cosine(towards, _direction(beyond[number]))
        _send(material, before, there, cosine, tables[0], tables[1], shown)


@compiled
def _arriving(start, followed, rays, own, tables, out):  # type: ignore[no-untyped-def]
    """`arriving`, of rays that are not followed; start begins at the first of the rays that are wanted.

    What is in a tuple is taken out before the loop: within it, each time costs as much as the sums.
    """
    side_of, towards, onward = rays
    table, diffuse = tables
    begin, around, material, light, brought = own.start, own.around, own.material, own.light, own.brought
    weight, shown = np.empty(MOST, np.float32), np.zeros(out.shape[1], np.float32)
    for p in range(len(followed)):
        for ray in range(start[p], start[p + 1] - followed[p]):
            side = side_of[ray]
            _clear(shown)
            if side < DARK:
                d = on_square(towards[ray, 0] * np.float32(1 / STEPS), towards[ray, 1] * np.float32(1 / STEPS))
                m = on_square(onward[ray, 0] * np.float32(1 / STEPS), onward[ray, 1] * np.float32(1 / STEPS))
                rough = max(material[side, 3], np.float32(SOFT))
                _around(begin[side], begin[side + 1], d, m, rough, around, brought, weight, shown)
                _send(material, light, side, _cosine(d, m), table, diffuse, shown)
            for c in range(len(shown)):
                out[ray - start[0], c] = shown[c]


@compiled
def _followed(start, followed, rays, first, blur, own, sky, tables, out):  # type: ignore[no-untyped-def]
    """`arriving`, of rays that are followed; start begins at the first of the points that are wanted.

    A side whose gloss is rough for what the ray stands for shows what its own rays bring, a smooth one what mirrors show.
    Args: first: number of the first one's first ray among those that are followed.
    """
    f32 = np.float32
    side_of, towards, onward, lobe, second, third, beyond = rays
    material, light, begin, around, brought = own.material, own.light, own.start, own.around, own.brought
    far, cells = (onward, second, third, beyond), (own.bounces, own.material, own.before, own.sent)
    channels, number, (table, diffuse) = out.shape[1], first, tables
    weight, seen, shown = np.empty(MOST, f32), np.zeros(channels, f32), np.zeros(channels, f32)
    for p in range(len(followed)):
        last, d = np.uint16(DARK), (f32(0), f32(0), f32(0))
        for ray in range(start[p + 1] - followed[p], start[p + 1]):
            side, along = side_of[ray], _direction(towards[ray])
            alike = side == last and d[0] * along[0] + d[1] * along[1] + d[2] * along[2] > f32(ALIKE)
            if side >= DARK:
                _clear(shown)
                last = side
            elif not alike or material[side, 3] < f32(WIDE):
                mirror = _direction(onward[ray])
                rough = _rougher(material[side, 3], blur[p, lobe[number]])
                wide = min(max((rough - f32(NARROW)) * f32(1 / (WIDE - NARROW)), f32(0)), f32(1))
                to = begin[side + 1]
                if wide > f32(0) and not _around(begin[side], to, along, mirror, rough, around, brought, weight, seen):
                    wide = f32(0)
                if wide < f32(1):
                    _mirror_there(ray, number, far, mirror, rough, cells, sky, tables, shown)
                for c in range(channels):
                    shown[c] = shown[c] + wide * (seen[c] - shown[c]) if wide < f32(1) else seen[c]
                _send(material, light, side, _cosine(along, mirror), table, diffuse, shown)
                last, d = side, along
            for c in range(channels):
                out[ray - start[0], c] = shown[c]
            number += 1


@compiled
def _shown(side, towards, angle, sky, out):  # type: ignore[no-untyped-def]
    """`open_sky`."""
    for i in range(len(side)):
        if side[i] == OPEN:
            width = np.sqrt(angle[i] * np.float32(0.25 / np.pi))  # half the radius of what the ray stands for
            blur = max(np.sqrt(np.float32(0.5) * width), np.float32(ROUGHNESS[1]))  # else suns fall between the rays
            _look_up(sky, towards[i], min(blur, np.float32(1)), out[i])
