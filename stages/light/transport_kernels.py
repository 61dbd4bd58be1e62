"""The inner loops of the light transport: aiming and drawing a tile's rays, and summing what they saw."""

import math

import numpy as np
from numpy.typing import NDArray

from stages.core.albedo import MIN_COSINE
from stages.core.parallel import compiled
from stages.light.blender import F0, burley, fresnel
from stages.light.environment import bilinear
from stages.light.light_set import CELLS, CHANNELS, FINE, SQUARE

CLASSES = 64
"""Pixels of an 8 x 8 block each use a sample set of their own; together they stratify the hemisphere 64 times finer."""

GOLDEN = 0.6180339887498949

CELL_SHIFT = int(math.log2(FINE // CELLS))

WEIGHT = CHANNELS - 1
"""The channel, no light's, that holds 1 for every lobe ray: its sums are those of the weights."""

GRAZING = 0.1
"""Cosine of a ray to its own triangle's normal from which on it starts from that triangle. Flatter ones start from the smooth
surface that is meant, or facets would throw shadows on each other; were all to start there, the shadows of other things would
move. Blender's default (Shadow Terminator: Geometry Offset)."""

LANES = 16
"""Rays are weighed in multiples of this many, so that a vector unit has no odd ones left over."""

fast = compiled(fastmath={"contract", "reassoc", "nsz", "arcp"})
inline = compiled(inline="always")


def interleaved_shifts() -> NDArray[np.float64]:
    """Shift of both sample coordinates for each pixel of an 8 x 8 block, two Bayer matrices: (CLASSES, 2) in [0, 1).

    Every 2 x 2, 4 x 4 and 8 x 8 group of neighbours is stratified in both. Source: Keller & Heidrich 2001,
    "Interleaved Sampling".
    """
    x, y = np.arange(CLASSES) % 8, np.arange(CLASSES) // 8
    first, second = np.zeros(CLASSES, np.int64), np.zeros(CLASSES, np.int64)
    for bit in range(3):
        a, b = (x >> bit) & 1, (y >> bit) & 1
        first |= (2 * (a ^ b) + b) << (2 * (2 - bit))
        second |= (2 * b + a) << (2 * (2 - bit))
    return np.stack([first, second], -1) / CLASSES


@inline
def hashed(x, y):  # type: ignore[no-untyped-def]
    """Uniform [0, 1) from two integers. Source: Steele et al. 2014, SplitMix64's finaliser."""
    state = np.uint64(x) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(y) * np.uint64(0xD1B54A32D192ED03)
    state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    state = state ^ (state >> np.uint64(31))
    return np.float64(state >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@fast
def aim(n, wo, wanted, alphas, cells, chosen, share):  # type: ignore[no-untyped-def]
    """How much of each cell of the excess a point would reflect if nothing stood in the way.

    A light ray is drawn from a cell in proportion to its energy times the BRDF there, summed over a white diffuse and a
    few glossy materials: product importance sampling, without visibility.

    Args:
        n, wo: (P, 3). wanted: (P, lights), no ray is drawn for the others. alphas: of the glossy lobes. cells: direction,
        radius, energy and first of `Cells`.
        chosen, share: (P, K), written: probability of each cell among its environment's, and that over its energy.
    """
    f32 = np.float32
    direction, radius, energy, first = cells
    count = len(energy)
    for p in range(len(n)):
        ox, oy, oz = wo[p, 0], wo[p, 1], wo[p, 2]
        nx, ny, nz = n[p, 0], n[p, 1], n[p, 2]
        wo_z = max(ox * nx + oy * ny + oz * nz, f32(MIN_COSINE))
        for k in range(count):
            wi_z = direction[0, k] * nx + direction[1, k] * ny + direction[2, k] * nz
            share[p, k] = max(wi_z + radius[k], f32(0)) * f32(1 / math.pi)
        for a in range(len(alphas)):
            a2 = alphas[a] * alphas[a]
            lambda_o = f32(0.5) * math.sqrt(f32(1) + a2 * (f32(1) - wo_z * wo_z) / (wo_z * wo_z))
            scale = f32(0.25) * a2 / (f32(math.pi) * wo_z)
            for k in range(count):
                wx, wy, wz = direction[0, k], direction[1, k], direction[2, k]
                wi_z = max(wx * nx + wy * ny + wz * nz, radius[k])
                hx, hy, hz = wx + ox, wy + oy, wz + oz
                h2 = max(hx * hx + hy * hy + hz * hz, f32(1e-6))
                hn = hx * nx + hy * ny + hz * nz
                q = f32(1) + (a2 - f32(1)) * min(hn * hn / h2, f32(1))
                masking = f32(0.5) * math.sqrt(f32(1) + a2 * (f32(1) - wi_z * wi_z) / (wi_z * wi_z))
                share[p, k] += min(max(share[p, k], f32(0)) * f32(1e9), f32(1)) * scale / (q * q * (lambda_o + masking))
        for e in range(len(first) - 1):
            total = f32(0)
            for k in range(first[e], first[e + 1]):
                total += share[p, k] * energy[k]
            inverse = f32(1) / total if total > 0 and wanted[p, e] else f32(0)
            for k in range(first[e], first[e + 1]):
                share[p, k] *= inverse
                chosen[p, k] = share[p, k] * energy[k]


@fast
def draw(n, t, b, wo, origin, pixel, samples, alphas, excess, chosen, rays):  # type: ignore[no-untyped-def]
    """Draw a tile's rays above the horizon, those of neighbours along the same lobe after each other.

    Args:
        n, t, b, wo, origin: (P, 3) world. pixel: (P, 2), its class and its number in the image.
        samples: slots, shift, turn, jitter and seed of `Rays`. alphas: (P, K) of the lobes after the cosine.
        excess: texels of a `LightSet`, begin and first of its cells. chosen: of `aim`. rays: arrays of a `Drawn`, written.
    Returns:
        Rays written.
    """
    f32 = np.float32
    slots, shift, turn, spread, seed = samples
    origins, directions, texel, density, row = rays
    points, knots = len(n), alphas.shape[1]
    lobes = knots + 1
    view = np.empty((lobes, 3, points), np.float32)  # stretched by each alpha, see core.brdf.sample_vndf
    jitter, base = np.empty(points, np.float32), np.empty(points, np.float32)
    for p in range(points):
        x = wo[p, 0] * t[p, 0] + wo[p, 1] * t[p, 1] + wo[p, 2] * t[p, 2]
        y = wo[p, 0] * b[p, 0] + wo[p, 1] * b[p, 1] + wo[p, 2] * b[p, 2]
        z = wo[p, 0] * n[p, 0] + wo[p, 1] * n[p, 1] + wo[p, 2] * n[p, 2]
        view[0, 0, p], view[0, 1, p], view[0, 2, p] = x, y, z
        for k in range(knots):
            a = alphas[p, k]
            s = f32(1) / math.sqrt((x * x + y * y) * a * a + z * z)
            view[k + 1, 0, p], view[k + 1, 1, p], view[k + 1, 2, p] = x * a * s, y * a * s, z * s
        jitter[p] = hashed(pixel[p, 1], seed) * spread
        base[p] = f32(shift[pixel[p, 0], 0]) + jitter[p]
    cell, within = _choose_cells(pixel, samples, excess, chosen, lobes, jitter)
    us, vs, share = np.empty(points, np.float32), np.empty(points, np.float32), np.empty(points, np.float32)
    cos, sin = np.empty(points, np.float32), np.empty(points, np.float32)
    found, towards, up = np.empty(points, np.int32), np.empty((3, points), np.float32), np.empty(points, np.float32)
    who, squared = np.empty(points, np.int32), np.empty((3, points), np.float32)  # the points that draw, and where they do
    used = 0
    for s in range(len(slots)):
        lobe, i, count, place = slots[s]
        offset0, offset1 = hashed(2 * lobe, seed), hashed(2 * lobe + 1, seed)
        if lobe >= lobes:
            some = 0
            for p in range(points):
                up[p] = f32(-1)
                k = cell[p, place]
                if k >= 0:
                    line = shift[pixel[p, 0], 1] + offset1 + (i + 1) * GOLDEN
                    us[some], vs[some], found[p], share[p] = _in_cell(k, within[p, place], line - math.floor(line), excess)
                    share[p] *= f32(count) * chosen[p, k] * f32(FINE * FINE / (4 * math.pi))
                    who[some] = p
                    some += 1
            for j in range(some):
                x, y, z = on_square(us[j], vs[j])
                squared[0, j], squared[1, j], squared[2, j] = x, y, z
            for j in range(some):
                p = who[j]
                x, y, z = squared[0, j], squared[1, j], squared[2, j]
                towards[0, p], towards[1, p], towards[2, p] = x, y, z
                up[p] = x * n[p, 0] + y * n[p, 1] + z * n[p, 2]
        else:
            for p in range(points):
                c = pixel[p, 0]
                cos[p], sin[p] = turn[c, s, 0], turn[c, s, 1]
            _towards(view, lobe, base, (f32(offset0), f32(i), f32(1 / max(count, 1))), cos, sin, alphas, towards, up)
            for p in range(points):
                x, y, z = towards[0, p], towards[1, p], up[p]
                towards[0, p] = x * t[p, 0] + y * b[p, 0] + z * n[p, 0]
                towards[1, p] = x * t[p, 1] + y * b[p, 1] + z * n[p, 1]
                towards[2, p] = x * t[p, 2] + y * b[p, 2] + z * n[p, 2]
        for p in range(points):
            row[p, s] = -1
            if up[p] > f32(0):
                directions[used, 0], directions[used, 1], directions[used, 2] = towards[0, p], towards[1, p], towards[2, p]
                origins[used, 0], origins[used, 1], origins[used, 2] = origin[p, 0], origin[p, 1], origin[p, 2]
                texel[used], density[used] = found[p], share[p]
                row[p, s] = used
                used += 1
    return used


@fast
def _towards(view, lobe, base, sample, cos, sin, alphas, towards, up):  # type: ignore[no-untyped-def]
    """Where one sample of a lobe (-1: the mirror) points from each point, in its own frame.

    view: of `draw`. base: (P,) shift of each point. sample: shift, number and inverse of the count. cos, sin: (P,) of its
    azimuth. towards: its first two rows written, x and y. up: (P,), written, z.
    """
    f32 = np.float32
    offset, number, inverse = sample
    ox, oy, oz = view[0, 0], view[0, 1], view[0, 2]
    if lobe < 0:
        for p in range(len(up)):
            towards[0, p], towards[1, p], up[p] = -ox[p], -oy[p], oz[p]
        return
    vx, vy, vz = view[lobe, 0], view[lobe, 1], view[lobe, 2]
    for p in range(len(up)):
        first = base[p] + offset
        u = (number + (first - np.floor(first))) * inverse
        if lobe == 0:
            radius = math.sqrt(u)
            towards[0, p], towards[1, p] = radius * cos[p], radius * sin[p]
            up[p] = math.sqrt(max(f32(1) - u, f32(0)))
        else:
            a = alphas[p, lobe - 1]
            cap = (f32(1) - u) * (f32(1) + vz[p]) - vz[p]
            radius = math.sqrt(max(f32(1) - cap * cap, f32(0)))
            mx, my, mz = (radius * cos[p] + vx[p]) * a, (radius * sin[p] + vy[p]) * a, cap + vz[p]
            twice = f32(2) * (ox[p] * mx + oy[p] * my + oz[p] * mz) / (mx * mx + my * my + mz * mz)
            towards[0, p], towards[1, p], up[p] = twice * mx - ox[p], twice * my - oy[p], twice * mz - oz[p]


@fast
def settle(origin, direction, row, surface, ng):  # type: ignore[no-untyped-def]
    """Move the starts of rays from the smooth surface to the triangle, by their angle to it, in place.

    Args:
        origin, direction: (R, 3). row: (P, S) of a `Drawn`. surface, ng: (P, 3), where rays leave the triangle, and its normal.
    """
    for p in range(len(row)):
        for s in range(row.shape[1]):
            r = row[p, s]
            if r < 0:
                continue
            cosine = direction[r, 0] * ng[p, 0] + direction[r, 1] * ng[p, 1] + direction[r, 2] * ng[p, 2]
            lifted = np.float32(1) - min(max(cosine * np.float32(1 / GRAZING), np.float32(0)), np.float32(1))
            for d in range(3):
                origin[r, d] = surface[p, d] + lifted * (origin[r, d] - surface[p, d])


@fast
def to_trace(direction, row, ng, outer):  # type: ignore[no-untyped-def]
    """Which rays (R,) may meet something: all but those that rise from points over whose plane there is nothing.

    Args:
        direction: (R, 3). row: (P, S) of a `Drawn`. ng: (P, 3). outer: (P,) bool.
    """
    result = np.ones(len(direction), np.bool_)
    for p in range(len(row)):
        if outer[p]:
            for s in range(row.shape[1]):
                r = row[p, s]
                if r >= 0:
                    cosine = direction[r, 0] * ng[p, 0] + direction[r, 1] * ng[p, 1] + direction[r, 2] * ng[p, 2]
                    result[r] = cosine <= np.float32(0)
    return result


@fast
def _choose_cells(pixel, samples, excess, chosen, lobes, jitter):  # type: ignore[no-untyped-def]
    """The cell of each light ray, or -1, and how far into that cell's share its sample lies: (P, light rays) each."""
    slots, shift, _, _, seed = samples
    first = excess[-1]
    points, rays = len(pixel), 0
    for s in range(len(slots)):
        rays += slots[s, 0] >= lobes
    cell, within = np.full((points, rays), -1, np.int32), np.zeros((points, rays), np.float32)
    counts, places = np.zeros(len(first) - 1, np.int64), np.zeros(len(first) - 1, np.int64)
    for s in range(len(slots)):
        e = slots[s, 0] - lobes
        if e >= 0:
            counts[e], places[e] = slots[s, 2], slots[s, 3] - slots[s, 1]
    for e in range(len(counts)):
        offset, last = hashed(2 * (lobes + e), seed), first[e + 1] - 1
        for p in range(points):
            start = (shift[pixel[p, 0], 0] + offset + jitter[p]) % 1.0
            k, low = first[e], 0.0
            for i in range(counts[e]):
                u = (i + start) / counts[e]
                while k < last and low + chosen[p, k] <= u:
                    low += chosen[p, k]
                    k += 1
                if chosen[p, k] > 0:
                    cell[p, places[e] + i] = k
                    within[p, places[e] + i] = min(max((u - low) / chosen[p, k], 0.0), 1.0)
    return cell, within


@inline
def _in_cell(k, u, line, excess):  # type: ignore[no-untyped-def]
    """A place in cell k on the octahedral square, u and v, its texel and that one's share of the cell.

    The texel by its energy and u, the place across it by what is left of u and by `line`.
    """
    place, cumulative, guide, _ = excess[0]
    start, end = excess[1][k]
    low = cumulative[start - 1] if start > 0 else 0.0
    whole = cumulative[end - 1] - low
    target = low + u * whole
    i = guide[min(start + int(u * (end - start)), end - 1)]  # the first texel whose cumulative energy exceeds the target
    while i < end - 1 and cumulative[i] <= target:
        i += 1
    if i > start:
        low = cumulative[i - 1]
    width = cumulative[i] - low  # 0 where the sum's rounding has swallowed the texel
    across = min(max((target - low) / width, 0.0), 0.9999) if width > 0 else 0.5
    share = np.float32(width / whole if width > 0 else 1.0)
    return np.float32((place[i] % FINE + across) / FINE), np.float32((place[i] // FINE + line) / FINE), i, share


@inline
def on_square(u, v):  # type: ignore[no-untyped-def]
    """`octahedral.square_to_direction` in float32, to 1e-6. Source: Taylor series around 0, of cosine and sine."""
    f32 = np.float32
    u, v = f32(2) * u - f32(1), f32(2) * v - f32(1)
    a, b = abs(u), abs(v)
    distance = f32(1) - (a + b)
    radius = f32(1) - abs(distance)
    t = (b - a) / max(radius, f32(1e-20)) * f32(math.pi / 4)  # the angle from the diagonal
    q = t * t
    cos = f32(1) + q * (f32(-1 / 2) + q * (f32(1 / 24) + q * (f32(-1 / 720) + q * f32(1 / 40320))))
    sin = t * (f32(1) + q * (f32(-1 / 6) + q * (f32(1 / 120) + q * (f32(-1 / 5040) + q * f32(1 / 362880)))))
    scale = radius * math.sqrt(f32(1) - f32(0.5) * radius * radius)  # of 1 / sqrt 2, the diagonal's cosine and sine
    x, y, z = (cos - sin) * scale, (cos + sin) * scale, f32(1) - radius * radius
    return (x if u >= f32(0) else -x), (y if v >= f32(0) else -y), (z if distance >= f32(0) else -z)


@inline
def arctan_turns(y, x):  # type: ignore[no-untyped-def]
    """atan2(y, x) 2 / pi for x, y >= 0, to 1e-5. Source: Abramowitz & Stegun 1964, 4.4.49."""
    f32 = np.float32
    large, small = max(x, y), min(x, y)
    r = small / max(large, f32(1e-30))
    q = r * r
    a = f32(0.0208351)
    a = a * q - f32(0.0851330)
    a = a * q + f32(0.1801410)
    a = a * q - f32(0.3302995)
    a = (a * q + f32(0.9998660)) * r * f32(2 / math.pi)
    return f32(1) - a if y > x else a


@fast
def weigh(  # type: ignore[no-untyped-def]
    n, t, b, wo, p, wi, count, alphas, counts, principled, scratch, density, inverse, weight
):
    """How much of each sum a ray of point p stands for: the BRDF over the density of all lobe rays that could have been it.

    Args:
        n, t, b, wo: (P, 3) world. wi: three components, (S,) each, of which the first `count` are read.
        alphas: (P, K) of the glossy lobes. counts: rays of each lobe. principled: of `Terms`. scratch: four times (S,).
        density: (S,), written: of the lobe rays, in rays per steradian. inverse: (S,), written: 1 / density.
        weight: (sums, count), written.
    """
    f32 = np.float32
    dx, dy, dz = wi
    s5, sin2, cos2, tan2 = scratch
    knots = alphas.shape[1]
    blender, departure, reflection = principled[0], f32(principled[1]), f32(principled[2])
    ox, oy, oz = wo[p, 0], wo[p, 1], wo[p, 2]
    nx, ny, nz = n[p, 0], n[p, 1], n[p, 2]
    tx, ty, tz = t[p, 0], t[p, 1], t[p, 2]
    bx, by, bz = b[p, 0], b[p, 1], b[p, 2]
    wo_z = max(ox * nx + oy * ny + oz * nz, f32(MIN_COSINE * 0.5))
    tan2_o = (f32(1) - min(wo_z, f32(1)) ** 2) / (wo_z * wo_z)
    for i in range(count):
        wi_z = max(dx[i] * nx + dy[i] * ny + dz[i] * nz, f32(1e-7))
        hx, hy, hz = dx[i] + ox, dy[i] + oy, dz[i] + oz
        norm = f32(1) / math.sqrt(hx * hx + hy * hy + hz * hz)
        hx, hy, hz = hx * norm, hy * norm, hz * norm
        c = max(f32(1) - (hx * dx[i] + hy * dy[i] + hz * dz[i]), f32(0))
        mx = hx * tx + hy * ty + hz * tz
        my = hx * bx + hy * by + hz * bz
        mz = hx * nx + hy * ny + hz * nz
        s5[i] = c * c * c * c * c
        sin2[i], cos2[i] = mx * mx + my * my, mz * mz
        tan2[i] = (f32(1) - wi_z * wi_z) / (wi_z * wi_z)
        density[i] = f32(counts[0]) * wi_z * f32(1 / math.pi)
        weight[0, i] = f32(0.96) * (f32(1) - s5[i]) * wi_z * f32(1 / math.pi)
    if blender:
        for i in range(count):
            wi_z = density[i] * f32(math.pi / counts[0])
            cosine = f32(1) - s5[i] ** f32(0.2)
            s5[i] = fresnel(cosine)
            weight[0, i] = burley(wo_z, wi_z, cosine, f32(0), departure)
            for k in range(knots):
                weight[1 + k, i] = burley(wo_z, wi_z, cosine, f32(math.sqrt(alphas[p, k])), departure)
    for k in range(knots):
        a2 = alphas[p, k] * alphas[p, k]
        lambda_o = f32(0.5) * (math.sqrt(f32(1) + a2 * tan2_o) - f32(1))
        scale = f32(0.25) * a2 / (f32(math.pi) * wo_z)
        share = f32(counts[k + 1]) / (f32(1) + lambda_o)
        masking = f32(0.5) + lambda_o
        for i in range(count):
            q = sin2[i] + a2 * cos2[i]
            D = scale / (q * q)
            f = D / (masking + f32(0.5) * math.sqrt(f32(1) + a2 * tan2[i]))
            density[i] += share * D
            if blender:
                weight[1 + k, i] += reflection * (f32(F0) + f32(1 - F0) * s5[i]) * f
                weight[1 + knots + k, i] = f
            else:
                weight[1 + k, i] = (f32(1) - s5[i]) * f
                weight[1 + knots + k, i] = s5[i] * f
    for i in range(count):
        inverse[i] = f32(1) / density[i]
    for j in range(len(weight)):
        for i in range(count):
            weight[j, i] *= inverse[i]


@inline
def _scales(albedo, p, j, first, second):  # type: ignore[no-untyped-def]
    """Of sum j at point p: what makes both halves of the rays, the first and the second a mean each.

    Divided by their own weights and multiplied by the open-point albedo; plain sums where `albedo` has no rows.
    """
    f32 = np.float32
    if len(albedo) == 0:
        return f32(1), f32(2), f32(2)
    whole = albedo[p, j]
    return (
        whole / (first + second) if first + second > 0 else f32(0),
        whole / first if first > 0 else f32(0),
        whole / second if second > 0 else f32(0),
    )


@fast
def accumulate(n, t, b, wo, alphas, sampled, rays, occluded, albedo, seen, where, out, gap):  # type: ignore[no-untyped-def]
    """Sum the rays of each point.

    Args:
        n, t, b, wo: (P, 3) world. alphas: (P, K) of the glossy lobes. sampled: counts, bounds and slots of `Rays`, principled
        of `Terms`. rays: of `draw`, occluded: of the scene. albedo: (P, sums) of an open point; without rows, sums are
        plain, see `_scales`, and the light is looked up as it is.
        seen: pyramid, level_start, fine, block, peak of a `LightSet`; density of `Rays`; number of `Cells`; aimed of `aim`.
        where: each point's row of `out` and `gap`, and the place of each sum in it.
        out: (..., CHANNELS), written. gap: as `out`, written: the estimate from the first half of the rays less that
        from the second.
    """
    f32 = np.float32
    counts, bounds, slots, principled = sampled
    _, directions, drawn, drawn_density, row = rays
    texels, level_start, fine, block, peak, light_density, cells, aimed = seen
    lights = len(cells)
    points, most = row.shape
    most = -(-most // LANES) * LANES
    terms, levels = albedo.shape[1], len(level_start)
    dx, dy, dz = np.empty(most, np.float32), np.empty(most, np.float32), np.empty(most, np.float32)
    s5, sin2, cos2 = np.empty(most, np.float32), np.empty(most, np.float32), np.empty(most, np.float32)
    scratch = (s5, sin2, cos2, np.empty(most, np.float32))
    density, inverse = np.empty(most, np.float32), np.empty(most, np.float32)
    bits = inverse.view(np.int32)
    us, vs, level = np.empty(most, np.float32), np.empty(most, np.float32), np.empty(most, np.int32)
    ray, light = np.empty(most, np.int32), np.empty(most, np.int32)
    weights = np.empty(terms * most, np.float32)
    radiance = np.empty((most, 2 * CHANNELS), np.float32)  # of the residual, then of the excess
    total = np.empty((2, terms, 2 * CHANNELS), np.float32)
    texel_angle = 4 * math.pi / (SQUARE * SQUARE)
    filtering = f32(0.25 / texel_angle) if len(albedo) > 0 else f32(0)
    for p in range(points):
        for half in range(2):
            m = lobes = 0
            for is_light in range(2):
                lobes = m
                for s in range(bounds[2 * half + is_light], bounds[2 * half + is_light + 1]):
                    r = row[p, s]
                    if r >= 0 and not (is_light and occluded[r]):
                        dx[m], dy[m], dz[m] = directions[r, 0], directions[r, 1], directions[r, 2]
                        ray[m], light[m] = r, slots[s, 0] - len(counts)
                        m += 1
            count = -(-m // LANES) * LANES  # whole vectors: the rays that fill them up see nothing
            dx[m:count], dy[m:count], dz[m:count] = n[p, 0], n[p, 1], n[p, 2]
            weight = weights[: terms * count].reshape((terms, count))
            weigh(n, t, b, wo, p, (dx, dy, dz), count, alphas, counts, principled, scratch, density, inverse, weight)
            radiance[:count] = 0
            radiance[:lobes, WEIGHT] = 1
            for i in range(min(-(-lobes // LANES) * LANES, count)):  # where lobe rays look
                a = math.sqrt(max(f32(1) - abs(dz[i]), f32(0)))
                v = arctan_turns(abs(dy[i]), abs(dx[i])) * a
                u = a - v
                if dz[i] < 0:
                    u, v = f32(1) - v, f32(1) - u
                us[i] = (u if dx[i] >= 0 else -u) * f32(0.5) + f32(0.5)
                vs[i] = (v if dy[i] >= 0 else -v) * f32(0.5) + f32(0.5)
                inverse[i] = inverse[i] * filtering  # an eighth of 2 x, the nearest level: finer, for less bias
                level[i] = min(max(((bits[i] >> 23) - 127) >> 1, 0), levels - 1)
            for i in range(lobes):
                if occluded[ray[i]]:
                    continue
                size = SQUARE >> level[i]
                x, y = us[i] * f32(size) + f32(0.5), vs[i] * f32(size) + f32(0.5)
                left, top = int(x), int(y)
                x, y = x - f32(left), y - f32(top)
                above = level_start[level[i]] + top * (size + 2) + left
                below = above + size + 2
                w00, w01, w10, w11 = (f32(1) - x) * (f32(1) - y), x * (f32(1) - y), (f32(1) - x) * y, x * y
                for c in range(WEIGHT):
                    radiance[i, c] = (
                        w00 * texels[above, c]
                        + w01 * texels[above + 1, c]
                        + w10 * texels[below, c]
                        + w11 * texels[below + 1, c]
                    )
                column, line = min(int(us[i] * f32(FINE)), FINE - 1), min(int(vs[i] * f32(FINE)), FINE - 1)
                number = block[line >> 1, column >> 1]
                if number >= 0:
                    texel = 4 * number + 2 * (line & 1) + (column & 1)
                    for e in range(lights):
                        cell = cells[e, line >> CELL_SHIFT, column >> CELL_SHIFT]
                        if cell >= 0:
                            share = density[i] / (density[i] + light_density[texel, e] * aimed[p, cell])
                            for c in range(3 * e, 3 * e + 3):
                                radiance[i, c] += share * fine[texel, c]
            for i in range(lobes, m):
                share = density[i] / (density[i] + drawn_density[ray[i]])
                for c in range(3):
                    radiance[i, CHANNELS + 3 * light[i] + c] = share * peak[drawn[ray[i]], c]
            np.dot(weight, radiance[:count], total[half])
        for j in range(terms):
            scale, scale0, scale1 = _scales(albedo, p, j, total[0, j, WEIGHT], total[1, j, WEIGHT])
            total[0, j, WEIGHT] = total[1, j, WEIGHT] = 0
            target, place = where[0][p], where[1][j]
            for c in range(CHANNELS):
                smooth0, smooth1 = total[0, j, c], total[1, j, c]
                bright0, bright1 = total[0, j, CHANNELS + c], total[1, j, CHANNELS + c]
                out[target, place, c] = (smooth0 + smooth1) * scale + bright0 + bright1
                gap[target, place, c] = smooth0 * scale0 - smooth1 * scale1 + f32(2) * (bright0 - bright1)


@fast
def mirror(radiance, rays, occluded, weights, where, first, out):  # type: ignore[no-untyped-def]
    """What the last ray of each point, the mirror direction's, shows of one environment.

    Args:
        radiance: (H, W, 3). rays: of `draw`, occluded: of the scene. weights: (2, P), of what is shown in two sums.
        where: each point's row of `out` and the places of those sums in it. first: channel of the environment.
    """
    _, directions, _, _, row = rays
    seen = np.empty(3, np.float64)
    for p in range(len(row)):
        r = row[p, row.shape[1] - 1]
        if r >= 0 and not occluded[r]:
            bilinear(radiance, directions[r], seen)
            for j in range(2):
                for c in range(3):
                    out[where[0][p], where[1][j], first + c] = weights[j, p] * seen[c]


@fast
def accumulate_bounce(  # type: ignore[no-untyped-def]
    n, t, b, wo, alphas, sampled, rays, hit, shown, albedo, where, out, gap
):
    """Add to the sums of each point what its lobe rays see of the surface itself.

    Args:
        As `accumulate`; the rays are lobe rays only. hit: (R,) number of the surface point that a ray hits, or -1.
        shown: (H, sums, CHANNELS), what such a point sends back to it, for each sum.
    """
    counts, bounds, _, principled = sampled
    _, directions, _, _, row = rays
    points, slots = row.shape
    terms = albedo.shape[1]
    dx, dy, dz = np.empty(slots, np.float32), np.empty(slots, np.float32), np.empty(slots, np.float32)
    s5, sin2, cos2 = np.empty(slots, np.float32), np.empty(slots, np.float32), np.empty(slots, np.float32)
    scratch = (s5, sin2, cos2, np.empty(slots, np.float32))
    density, inverse = np.empty(slots, np.float32), np.empty(slots, np.float32)
    number = np.empty(slots, np.int32)
    weights = np.empty(terms * slots, np.float32)
    total = np.empty((2, terms, CHANNELS), np.float32)
    normaliser = np.empty((2, terms), np.float32)
    for p in range(points):
        total[:] = 0
        any_hit = False
        for half in range(2):
            m = 0
            for s in range(bounds[2 * half], bounds[2 * half + 1]):
                r = row[p, s]
                if r >= 0:
                    dx[m], dy[m], dz[m] = directions[r, 0], directions[r, 1], directions[r, 2]
                    number[m] = hit[r]
                    any_hit |= hit[r] >= 0
                    m += 1
            weight = weights[: terms * m].reshape((terms, m))
            weigh(n, t, b, wo, p, (dx, dy, dz), m, alphas, counts, principled, scratch, density, inverse, weight)
            for j in range(terms):
                normaliser[half, j] = weight[j].sum()
                for i in range(m):
                    if number[i] >= 0:
                        for c in range(CHANNELS):
                            total[half, j, c] += weight[j, i] * shown[number[i], j, c]
        if not any_hit:
            continue
        for j in range(terms):
            scale, scale0, scale1 = _scales(albedo, p, j, normaliser[0, j], normaliser[1, j])
            target, place = where[0][p], where[1][j]
            for c in range(CHANNELS):
                out[target, place, c] += (total[0, j, c] + total[1, j, c]) * scale
                gap[target, place, c] += total[0, j, c] * scale0 - total[1, j, c] * scale1
