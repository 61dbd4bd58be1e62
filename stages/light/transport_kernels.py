"""The inner loops of the light transport: aiming and drawing a tile's rays, and summing what they saw."""

import math

import numpy as np
from numpy.typing import NDArray

from stages.core.albedo import MIN_COSINE
from stages.core.lanes import LANES, fill, floor, larger, load, root, smaller, store, where_positive
from stages.core.parallel import compiled
from stages.light.blender import F0, burley, fresnel
from stages.light.environment import bilinear
from stages.light.horizon import WALL, sector_of
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
def draw(n, t, b, wo, start, pixel, samples, alphas, excess, chosen, rays):  # type: ignore[no-untyped-def]
    """Draw a tile's rays above the horizon, those of neighbours along the same lobe after each other.

    Args:
        n, t, b, wo: (P, 3) world. start: (P, 3) each, where rays leave the smooth surface and the triangle, and its normal.
        pixel: (P, 2), its class and its number in the image.
        samples: slots, shift, turn, jitter and seed of `Rays`. alphas: (P, K) of the lobes after the cosine.
        excess: texels of a `LightSet`, begin and first of its cells. chosen: of `aim`. rays: arrays of a `Drawn`, written.
    Returns:
        Rays written.
    """
    f32 = np.float32
    slots, shift, turn, spread, seed = samples
    origins, directions, texel, density, row = rays
    points, knots = len(n), alphas.shape[1]
    lobes, size = knots + 1, in_lanes(points)
    axes, leaves, view = _planar((t, b, n), size), _planar(start, size), _views(t, b, n, wo, alphas, size)
    jitter, base = np.zeros(size, np.float32), np.zeros(size, np.float32)
    for p in range(points):
        jitter[p] = hashed(pixel[p, 1], seed) * spread
        base[p] = f32(shift[pixel[p, 0], 0]) + jitter[p]
    cell, within = _choose_cells(pixel, samples, excess, chosen, lobes, jitter)
    first, second = np.zeros(size, np.float32), np.zeros(size, np.float32)  # place on a square, or azimuth's cosine and sine
    found, share, up = np.empty(size, np.int32), np.empty(size, np.float32), np.empty(size, np.float32)
    towards, origin = np.empty(3 * size, np.float32), np.empty(3 * size, np.float32)
    used = 0
    for s in range(len(slots)):
        lobe, i, count, place = slots[s]
        offset0, offset1 = hashed(2 * lobe, seed), hashed(2 * lobe + 1, seed)
        if lobe >= lobes:
            up[:] = -1
            some, turned = False, (offset1 + (i + 1) * GOLDEN) % 1.0
            for p in range(points):
                k = cell[p, place]
                if k >= 0:
                    line = f32(shift[pixel[p, 0], 1] + turned)
                    line = min(line - np.floor(line), f32(0.9999))
                    first[p], second[p], found[p], share[p] = _in_cell(k, within[p, place], line, excess)
                    share[p] *= f32(count) * chosen[p, k] * f32(FINE * FINE / (4 * math.pi))
                    up[p] = 1
                    some = True
            if some:
                _along_squares(first, second, axes, towards, up)
        else:
            some = True
            for p in range(points):
                c = pixel[p, 0]
                first[p], second[p] = turn[c, s, 0], turn[c, s, 1]
            _towards(view, lobe, base, (f32(offset0), f32(i), f32(1 / max(count, 1))), first, second, axes, towards, up)
        if some:
            _settle(towards, leaves, origin)
        for p in range(points):
            row[p, s] = -1
            if up[p] > f32(0):
                for d in range(3):
                    directions[used, d], origins[used, d] = towards[d * size + p], origin[d * size + p]
                texel[used], density[used] = found[p], share[p]
                row[p, s] = used
                used += 1
    return used


@inline
def _planar(vectors, size):  # type: ignore[no-untyped-def]
    """Three sets of vectors, (P, 3) each, as (9 size,): all first components of the first set, all second ones, ..."""
    result = np.zeros(9 * size, np.float32)
    for p in range(len(vectors[0])):
        for d in range(3):
            result[d * size + p] = vectors[0][p, d]
            result[(3 + d) * size + p] = vectors[1][p, d]
            result[(6 + d) * size + p] = vectors[2][p, d]
    return result


@inline
def _views(t, b, n, wo, alphas, size):  # type: ignore[no-untyped-def]
    """Directions to the viewer in the points' own frames, stretched by each alpha (`core.brdf.sample_vndf`), and the alphas.

    Returns:
        (1 + K, 4, size), the first as it is.
    """
    view = np.ones((1 + alphas.shape[1], 4, size), np.float32)
    for p in range(len(n)):
        x = wo[p, 0] * t[p, 0] + wo[p, 1] * t[p, 1] + wo[p, 2] * t[p, 2]
        y = wo[p, 0] * b[p, 0] + wo[p, 1] * b[p, 1] + wo[p, 2] * b[p, 2]
        z = wo[p, 0] * n[p, 0] + wo[p, 1] * n[p, 1] + wo[p, 2] * n[p, 2]
        view[0, 0, p], view[0, 1, p], view[0, 2, p] = x, y, z
        for k in range(alphas.shape[1]):
            a = alphas[p, k]
            s = np.float32(1) / math.sqrt((x * x + y * y) * a * a + z * z)
            view[k + 1, 0, p], view[k + 1, 1, p], view[k + 1, 2, p], view[k + 1, 3, p] = x * a * s, y * a * s, z * s, a
    return view


@fast
def _towards(view, lobe, base, sample, cos, sin, axes, towards, up):  # type: ignore[no-untyped-def]
    """Where one sample of a lobe (-1: the mirror) points from each point.

    view: of `_views`. base: (size,) shift of each point. sample: shift, number and inverse of the count. cos, sin: (size,) of
    its azimuth. axes: of `_planar`. towards: (3 size,), written. up: (size,), written, the height over the surface.
    """
    offset, number, inverse = sample
    size, none = len(up), fill(np.float32(0))
    for p in range(0, size, LANES):
        ox, oy, oz = load(view, p), load(view, size + p), load(view, 2 * size + p)
        if lobe < 0:
            x, y, z = none - ox, none - oy, oz
        else:
            first = load(base, p) + offset
            u = (first - floor(first) + number) * inverse
            x, y = load(cos, p), load(sin, p)
            if lobe == 0:
                radius = root(u)
                x, y, z = x * radius, y * radius, root(larger(np.float32(1) - u, none))
            else:
                k = 4 * lobe * size + p
                vx, vy, vz, a = load(view, k), load(view, k + size), load(view, k + 2 * size), load(view, k + 3 * size)
                cap = (np.float32(1) - u) * (vz + np.float32(1)) - vz
                radius = root(larger(np.float32(1) - cap * cap, none))
                mx, my, mz = (x * radius + vx) * a, (y * radius + vy) * a, cap + vz
                twice = (ox * mx + oy * my + oz * mz) / (mx * mx + my * my + mz * mz) * np.float32(2)
                x, y, z = twice * mx - ox, twice * my - oy, twice * mz - oz
        store(up, p, z)
        for d in range(3):
            k = d * size + p
            store(towards, k, x * load(axes, k) + y * load(axes, k + 3 * size) + z * load(axes, k + 6 * size))


@fast
def _along_squares(us, vs, axes, towards, up):  # type: ignore[no-untyped-def]
    """Directions of places on the octahedral square, as `on_square`; `up` stays as it is where it is not over 0.

    us, vs, up: (size,). axes: of `_planar`. towards: (3 size,), written.
    """
    f32 = np.float32
    size, none, one = len(up), fill(f32(0)), fill(f32(1))
    for p in range(0, size, LANES):
        u, v = load(us, p) * f32(2) - one, load(vs, p) * f32(2) - one
        a, b = larger(u, none - u), larger(v, none - v)
        distance = one - (a + b)
        radius = one - larger(distance, none - distance)
        t = (b - a) / larger(radius, fill(f32(1e-20))) * f32(math.pi / 4)
        q = t * t
        cos = q * (q * (q * (q * f32(1 / 40320) - f32(1 / 720)) + f32(1 / 24)) - f32(1 / 2)) + one
        sin = t * (q * (q * (q * (q * f32(1 / 362880) - f32(1 / 5040)) + f32(1 / 120)) - f32(1 / 6)) + one)
        scale = radius * root(one - radius * radius * f32(0.5))
        x, y, z = (cos - sin) * scale, (cos + sin) * scale, one - radius * radius
        x, y = where_positive(none - u, none - x, x), where_positive(none - v, none - y, y)
        z = where_positive(none - distance, none - z, z)
        store(towards, p, x)
        store(towards, size + p, y)
        store(towards, 2 * size + p, z)
        n = 6 * size + p
        height = x * load(axes, n) + y * load(axes, n + size) + z * load(axes, n + 2 * size)
        store(up, p, where_positive(load(up, p), height, none - one))


@fast
def _settle(towards, leaves, origin):  # type: ignore[no-untyped-def]
    """Starts of rays between the smooth surface and the triangle, by their angle to it.

    towards: (3 size,). leaves: of `_planar`, smooth surface, triangle and its normal. origin: (3 size,), written.
    """
    f32 = np.float32
    size = len(origin) // 3
    for p in range(0, size, LANES):
        n = 6 * size + p
        cosine = load(towards, p) * load(leaves, n) + load(towards, size + p) * load(leaves, n + size)
        cosine = cosine + load(towards, 2 * size + p) * load(leaves, n + 2 * size)
        lifted = f32(1) - smaller(larger(cosine * f32(1 / GRAZING), fill(f32(0))), fill(f32(1)))
        for d in range(3):
            k = d * size + p
            flat = load(leaves, k + 3 * size)
            store(origin, k, flat + lifted * (load(leaves, k) - flat))


@fast
def to_trace(direction, row, frame, horizon, asked):  # type: ignore[no-untyped-def]
    """Which rays (R,) may meet something: all but those that rise over the horizon of their point.

    Args:
        direction: (R, 3). row: (P, S) of a `Drawn`. frame: (P, 3) each, two tangents of the triangles, and their normals to the
        side of the rays. horizon: (P, SECTORS) of `Horizons`. asked: (R,), written: those rays, point by point.
    Returns:
        How many.
    """
    t, b, n = frame
    count = 0
    for p in range(len(row)):
        walled = horizon[p].min() == WALL
        for s in range(row.shape[1]):
            r = row[p, s]
            if r < 0:
                continue
            over = False
            if not walled:
                x, y, z = direction[r, 0], direction[r, 1], direction[r, 2]
                height = (x * n[p, 0] + y * n[p, 1] + z * n[p, 2]) * np.float32(WALL)
                along = x * t[p, 0] + y * t[p, 1] + z * t[p, 2]
                across = x * b[p, 0] + y * b[p, 1] + z * b[p, 2]
                over = height > np.float32(horizon[p, sector_of(along, across)])
            if not over:
                asked[count] = r
                count += 1
    return count


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
    lot, guide, _ = excess[0]
    start, end = excess[1][k]
    i = guide[min(start + int(u * np.float32(end - start)), end - 1)]
    while i < end - 1 and lot[i + 1, 0] <= u:
        i += 1
    share = lot[i, 1]  # next to none where rounding leaves it no width
    across = (u - lot[i, 0]) / share if share > np.float32(0) else np.float32(0.5)
    across = min(max(across, np.float32(0)), np.float32(0.9999))
    return (lot[i, 2] + across) * np.float32(1 / FINE), (lot[i, 3] + line) * np.float32(1 / FINE), i, share


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
def in_lanes(count):  # type: ignore[no-untyped-def]
    """The least multiple of LANES that holds so many rays."""
    return -(-count // LANES) * LANES


@fast
def weigh(  # type: ignore[no-untyped-def]
    n, t, b, wo, p, wi, count, alphas, counts, principled, scratch, density, inverse, weight
):
    """How much of each sum a ray of point p stands for: the BRDF over the density of all lobe rays that could have been it.

    Args:
        n, t, b, wo: (P, 3) world. wi: three components, (S,) each, of which the first `count` are read, a multiple of LANES.
        alphas: (P, K) of the glossy lobes, LANES at most. counts: rays of each lobe. principled: of `Terms`. scratch: (6,
        LANES). density: (S,), written: of the lobe rays, in rays per steradian. inverse: (S,), written: 1 / density.
        weight: (sums, count), written.
    """
    f32 = np.float32
    dx, dy, dz = wi
    knots = alphas.shape[1]
    alpha2, scale, share, masking, cosines, seen = scratch[0], scratch[1], scratch[2], scratch[3], scratch[4], scratch[5]
    blender, departure, reflection = principled[0], f32(principled[1]), f32(principled[2])
    ox, oy, oz = wo[p, 0], wo[p, 1], wo[p, 2]
    nx, ny, nz = n[p, 0], n[p, 1], n[p, 2]
    tx, ty, tz = t[p, 0], t[p, 1], t[p, 2]
    bx, by, bz = b[p, 0], b[p, 1], b[p, 2]
    wo_z = max(ox * nx + oy * ny + oz * nz, f32(MIN_COSINE * 0.5))
    tan2_o = (f32(1) - min(wo_z, f32(1)) ** 2) / (wo_z * wo_z)
    for k in range(knots):
        a2 = alphas[p, k] * alphas[p, k]
        lambda_o = f32(0.5) * (math.sqrt(f32(1) + a2 * tan2_o) - f32(1))
        alpha2[k], scale[k] = a2, f32(0.25) * a2 / (f32(math.pi) * wo_z)
        share[k], masking[k] = f32(counts[k + 1]) / (f32(1) + lambda_o), f32(0.5) + lambda_o
    for i in range(0, count, LANES):
        x, y, z = load(dx, i), load(dy, i), load(dz, i)
        wi_z = larger(x * nx + y * ny + z * nz, fill(f32(1e-7)))
        hx, hy, hz = x + ox, y + oy, z + oz
        norm = f32(1) / root(hx * hx + hy * hy + hz * hz)
        hx, hy, hz = hx * norm, hy * norm, hz * norm
        cosine = hx * x + hy * y + hz * z
        c = larger(f32(1) - cosine, fill(f32(1e-6)))  # whose fifth power is no subnormal number
        s5 = c * c * c * c * c
        mx, my, mz = hx * tx + hy * ty + hz * tz, hx * bx + hy * by + hz * bz, hx * nx + hy * ny + hz * nz
        sin2, cos2 = mx * mx + my * my, mz * mz
        tan2 = (f32(1) - wi_z * wi_z) / (wi_z * wi_z)
        rays = wi_z * (f32(counts[0]) * f32(1 / math.pi))
        if blender:
            store(cosines, 0, cosine)
            store(seen, 0, wi_z)
            for j in range(LANES):
                weight[0, i + j] = burley(wo_z, seen[j], cosines[j], f32(0), departure)
                for k in range(knots):
                    weight[1 + k, i + j] = burley(wo_z, seen[j], cosines[j], f32(math.sqrt(alphas[p, k])), departure)
                cosines[j] = fresnel(cosines[j])
            s5 = load(cosines, 0)
        else:
            store(weight, i, (f32(1) - s5) * wi_z * f32(0.96 / math.pi))
        for k in range(knots):
            q = sin2 + cos2 * alpha2[k]
            smith = root(tan2 * alpha2[k] + f32(1)) * f32(0.5) + masking[k]
            f = scale[k] / (q * q * smith)
            rays = rays + f * smith * share[k]
            first, second = (1 + k) * count + i, (1 + knots + k) * count + i
            if blender:
                store(weight, first, load(weight, first) + (s5 * f32(1 - F0) + f32(F0)) * f * reflection)
                store(weight, second, f)
            else:
                store(weight, first, (f32(1) - s5) * f)
                store(weight, second, s5 * f)
        over = f32(1) / rays
        store(density, i, rays)
        store(inverse, i, over)
        for j in range(len(weight)):
            store(weight, j * count + i, load(weight, j * count + i) * over)


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
        out: (..., CHANNELS), written, the scale of `_scales` in channel WEIGHT. gap: as `out`, written: the estimate from the
        first half of the rays less that from the second.
    """
    f32 = np.float32
    counts, bounds, slots, principled = sampled
    _, directions, drawn, drawn_density, row = rays
    texels, level_start, fine, block, peak, light_density, cells, aimed = seen
    lights = len(cells)
    points, most = row.shape
    most = in_lanes(most)
    terms, levels, stored = albedo.shape[1], len(level_start), out.shape[1]
    dx, dy, dz = np.empty(most, np.float32), np.empty(most, np.float32), np.empty(most, np.float32)
    scratch = np.empty((6, LANES), np.float32)
    density, inverse = np.empty(most, np.float32), np.empty(most, np.float32)
    bits = inverse.view(np.int32)
    us, vs, level = np.empty(most, np.float32), np.empty(most, np.float32), np.empty(most, np.int32)
    ray, light = np.empty(most, np.int32), np.empty(most, np.int32)
    begin = np.zeros(5, np.int64)  # of the lobe rays of both halves, then of their light rays; and the end
    weights = np.empty(terms * most, np.float32)
    radiance = np.empty((most, CHANNELS), np.float32)
    total = np.empty((4, terms, CHANNELS), np.float32)
    texel_angle = 4 * math.pi / (SQUARE * SQUARE)
    filtering = f32(0.25 / texel_angle) if len(albedo) > 0 else f32(0)
    counted = np.zeros(CHANNELS, np.float32)
    counted[WEIGHT] = 1
    for p in range(points):
        m = 0
        for part in range(4):
            is_light, half = part // 2, part % 2
            for s in range(bounds[2 * half + is_light], bounds[2 * half + is_light + 1]):
                r = row[p, s]
                if r >= 0 and not (is_light and occluded[r]):
                    dx[m], dy[m], dz[m] = directions[r, 0], directions[r, 1], directions[r, 2]
                    ray[m], light[m] = r, slots[s, 0] - len(counts)
                    m += 1
            begin[part + 1] = m
        lobes, count = begin[2], in_lanes(m)  # whole vectors: the rays that fill them up see nothing
        dx[m:count], dy[m:count], dz[m:count] = n[p, 0], n[p, 1], n[p, 2]
        weight = weights[: terms * count].reshape((terms, count))
        weigh(n, t, b, wo, p, (dx, dy, dz), count, alphas, counts, principled, scratch, density, inverse, weight)
        _on_square(dx, dy, dz, in_lanes(lobes), us, vs)
        for i in range(lobes):  # an eighth of the solid angle; 2 x, the nearest level: finer, for less bias
            inverse[i] *= filtering
            level[i] = min(max(((bits[i] >> 23) - 127) >> 1, 0), levels - 1)
        for i in range(lobes):
            found = load(counted, 0)
            if not occluded[ray[i]]:
                size = SQUARE >> level[i]
                x, y = us[i] * f32(size) + f32(0.5), vs[i] * f32(size) + f32(0.5)
                left, top = int(x), int(y)
                x, y = x - f32(left), y - f32(top)
                above = (level_start[level[i]] + top * (size + 2) + left) * CHANNELS
                below = above + (size + 2) * CHANNELS
                found = found + load(texels, above) * ((f32(1) - x) * (f32(1) - y))
                found = found + load(texels, above + CHANNELS) * (x * (f32(1) - y))
                found = found + load(texels, below) * ((f32(1) - x) * y)
                found = found + load(texels, below + CHANNELS) * (x * y)
            store(radiance, i * CHANNELS, found)
        for i in range(lobes):
            column, line = min(int(us[i] * f32(FINE)), FINE - 1), min(int(vs[i] * f32(FINE)), FINE - 1)
            number = block[line >> 1, column >> 1]
            if number >= 0 and not occluded[ray[i]]:
                texel = 4 * number + 2 * (line & 1) + (column & 1)
                for e in range(lights):
                    cell = cells[e, line >> CELL_SHIFT, column >> CELL_SHIFT]
                    if cell >= 0:
                        share = density[i] / (density[i] + light_density[texel, e] * aimed[p, cell])
                        for c in range(3 * e, 3 * e + 3):
                            radiance[i, c] += share * fine[texel, c]
        for i in range(lobes, m):
            store(radiance, i * CHANNELS, fill(f32(0)))
            share = density[i] / (density[i] + drawn_density[ray[i]])
            for c in range(3):
                radiance[i, 3 * light[i] + c] = share * peak[drawn[ray[i]], c]
        for part in range(4):
            _sum(weight, radiance, begin[part], begin[part + 1], total[part])
        for j in range(terms):
            scale, scale0, scale1 = _scales(albedo, p, j, total[0, j, WEIGHT], total[1, j, WEIGHT])
            place = (where[0][p] * stored + where[1][j]) * CHANNELS
            smooth0, smooth1 = load(total, j * CHANNELS), load(total, (terms + j) * CHANNELS)
            bright0, bright1 = load(total, (2 * terms + j) * CHANNELS), load(total, (3 * terms + j) * CHANNELS)
            store(out, place, (smooth0 + smooth1) * scale + (bright0 + bright1))
            store(gap, place, smooth0 * scale0 - smooth1 * scale1 + (bright0 - bright1) * f32(2))
            out[where[0][p], where[1][j], WEIGHT], gap[where[0][p], where[1][j], WEIGHT] = scale, 0


@fast
def _sum(weight, radiance, begin, end, total):  # type: ignore[no-untyped-def]
    """Sums of the radiance of some rays by their weights. Args: weight: (1 + 2 K, S). radiance: (S, CHANNELS). total: written.

    Two at a time, so that additions need not wait for each other.
    """
    knots = len(weight) // 2
    for j in range(knots + 1):
        other = knots + j if j > 0 else 0
        a, b = fill(np.float32(0)), fill(np.float32(0))
        for i in range(begin, end):
            seen = load(radiance, i * CHANNELS)
            a = a + seen * weight[j, i]
            b = b + seen * weight[other, i]
        store(total, j * CHANNELS, a)
        store(total, other * CHANNELS, b)


@inline
def _on_square(dx, dy, dz, count, us, vs):  # type: ignore[no-untyped-def]
    """Where rays look on the octahedral square, the inverse of `on_square`, to 1e-5; `count` is a multiple of LANES.

    Source: Abramowitz & Stegun 1964, 4.4.49 (arctangent).
    """
    f32 = np.float32
    none, one = fill(f32(0)), fill(f32(1))
    for i in range(0, count, LANES):
        x, y, z = load(dx, i), load(dy, i), load(dz, i)
        across, along, up = larger(x, none - x), larger(y, none - y), larger(z, none - z)
        most = larger(across, along)
        r = smaller(across, along) / larger(most, fill(f32(1e-30)))
        q = r * r
        turns = ((((q * f32(0.0208351) - f32(0.0851330)) * q + f32(0.1801410)) * q - f32(0.3302995)) * q + f32(0.9998660)) * r
        turns = turns * f32(2 / math.pi)
        turns = where_positive(along - across, one - turns, turns)
        radius = root(larger(one - up, none))
        v = turns * radius
        u = radius - v
        u, v = where_positive(none - z, one - v, u), where_positive(none - z, one - u, v)
        u, v = where_positive(none - x, none - u, u), where_positive(none - y, none - v, v)
        store(us, i, u * f32(0.5) + f32(0.5))
        store(vs, i, v * f32(0.5) + f32(0.5))


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
    terms, slots = albedo.shape[1], in_lanes(slots)
    dx, dy, dz = np.empty(slots, np.float32), np.empty(slots, np.float32), np.empty(slots, np.float32)
    scratch = np.empty((6, LANES), np.float32)
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
            count = in_lanes(m)
            dx[m:count], dy[m:count], dz[m:count] = n[p, 0], n[p, 1], n[p, 2]
            weight = weights[: terms * count].reshape((terms, count))
            weigh(n, t, b, wo, p, (dx, dy, dz), count, alphas, counts, principled, scratch, density, inverse, weight)
            for j in range(terms):
                normaliser[half, j] = weight[j, :m].sum()
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
