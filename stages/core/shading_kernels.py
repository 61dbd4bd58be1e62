"""Compiled CPU form of `stages.core.shading.shade_reference`, with its derivatives; a test holds the two together."""

import functools

import numpy as np
from numpy.typing import NDArray

from stages.core import albedo
from stages.core.parallel import compiled, in_parallel, slices

ROWS_PER_TASK = 1 << 11

Values = NDArray[np.float32]


@functools.lru_cache(maxsize=4)
def _knot_table(knots: tuple[float, ...]) -> Values:
    """The albedo table at the roughness knots: (K, COSINE_STEPS, 2)."""
    y = np.array(knots) * (albedo.ROUGHNESS_STEPS - 1)
    row = np.minimum(y.astype(int), albedo.ROUGHNESS_STEPS - 2)
    fraction = (y - row)[:, None, None]
    table = albedo.table().astype(np.float64)
    return (table[row] * (1 - fraction) + table[row + 1] * fraction).astype(np.float32)


def shade(
    transport: tuple[Values, Values, Values, Values],
    material: tuple[Values, Values, Values],
    knots: tuple[float, ...],
    slopes: NDArray[np.float64],
    constants: tuple[float, ...],
) -> tuple[Values, Values, Values]:
    """Radiance and what its gradient needs.

    Args:
        transport: E (N, 3), A and B (N, K, 3), cosine (N,). material: albedo (P, 3), roughness (P,), metallic (P,);
        N = P L. slopes: of `stages.core.shading.spline_slopes`. constants: F0, LEAST_ALBEDO, DARK, TINY, SOFTEN, BULGE there.
    Returns:
        radiance, interpolated A, and d radiance / d roughness: (N, 3) each.
    """
    count = len(transport[0])
    lights = count // max(len(material[1]), 1)
    out = tuple(np.empty((count, 3), np.float32) for _ in range(3))
    known = np.ascontiguousarray(_knot_table(knots).transpose(1, 2, 0))  # (COSINE_STEPS, 2, K)
    tables = (known, albedo.table(), np.array(knots, np.float32), slopes.astype(np.float32))
    floats = tuple(map(np.float32, constants))

    def task(part: slice) -> None:
        given = (t[part] for t in transport)
        _shade(part.start, lights, *given, *material, *tables, *floats, *(o[part] for o in out))

    in_parallel(task, slices(count, ROWS_PER_TASK))
    return out  # type: ignore[return-value]


def shade_backward(
    gradient: Values, E: Values, A: Values, by_roughness: Values, material: tuple[Values, Values, Values], f0: float
) -> tuple[Values, Values, Values]:
    """Gradients of albedo (P, 3), roughness (P,) and metallic (P,) from that of the radiance (N, 3)."""
    c, roughness, metallic = material
    points = len(roughness)
    out = (np.empty((points, 3), np.float32), np.empty(points, np.float32), np.empty(points, np.float32))
    lights = len(gradient) // max(points, 1)

    def task(part: slice) -> None:
        rows = slice(part.start * lights, part.stop * lights)
        given = (gradient[rows], E[rows], A[rows], by_roughness[rows], c[part], metallic[part])
        _shade_backward(lights, *given, np.float32(f0), *(o[part] for o in out))

    in_parallel(task, slices(points, ROWS_PER_TASK))
    return out


ROOT = np.int32(0x3F3504F3)
"""The bits of the root of a half."""


@compiled
def logarithms(bits, scratch, result):  # type: ignore[no-untyped-def]
    """Natural logarithms of float32 numbers over 0, to 1e-7; many at once.

    Source: Moshier 1989, "Methods and Programs for Mathematical Functions" (Cephes, logf).

    Args: bits: of the numbers, int32. scratch: (2, K), overwritten. result: (K,), written.
    """
    f32 = np.float32
    exponent, fraction = scratch[0], scratch[1].view(np.int32)
    for k in range(len(bits)):
        above = np.int32(bits[k] - ROOT)
        exponent[k] = f32(np.int32(above >> np.int32(23)))
        fraction[k] = np.int32(np.int32(above & np.int32(0x7FFFFF)) + ROOT)
    for k in range(len(bits)):
        z = scratch[1, k] - f32(1)
        q = f32(7.0376836292e-2)
        q = q * z - f32(1.1514610310e-1)
        q = q * z + f32(1.1676998740e-1)
        q = q * z - f32(1.2420140846e-1)
        q = q * z + f32(1.4249322787e-1)
        q = q * z - f32(1.6668057665e-1)
        q = q * z + f32(2.0000714765e-1)
        q = q * z - f32(2.4999993993e-1)
        q = q * z + f32(3.3333331174e-1)
        low = q * z * z * z - f32(2.12194440e-4) * exponent[k] - f32(0.5) * z * z
        result[k] = z + low + f32(0.693359375) * exponent[k]


@compiled(fastmath={"contract", "reassoc", "nsz", "arcp"})
def _shade(  # type: ignore[no-untyped-def]
    first, lights, E, A, B, cosine, c, roughness, metallic, knot_table, table, knots, slopes, f0, least, dark, tiny, soften,
    bulge, out, out_a, out_r
):  # fmt: skip
    one = np.float32(1)
    count = len(knots)
    rows, columns = len(table), table.shape[1]
    bent = np.log(knots + soften)
    value, slope = np.empty(2, np.float32), np.empty(2, np.float32)
    raised, y = np.empty(6 * count, np.float32), np.empty(6 * count, np.float32)
    bits, scratch, least_y = raised.view(np.int32), np.empty((2, 6 * count), np.float32), np.empty(6, np.float32)
    scale, open_point, by_r = np.empty((2, count), np.float32), np.empty(2, np.float32), np.empty(2, np.float32)
    for i in range(len(E)):
        p = (first + i) // lights
        r, m = roughness[p], metallic[p]
        left = 0
        while left < count - 2 and knots[left + 1] <= r:
            left += 1
        h = bent[left + 1] - bent[left]
        x = (np.log(r + soften) - bent[left]) / h
        u = np.sqrt(min(max(cosine[i], np.float32(0)), one)) * np.float32(columns - 1)
        column = min(int(u), columns - 2)
        fu = u - np.float32(column)
        v = r * np.float32(rows - 1)
        row = min(max(int(v), 0), rows - 2)
        fv = v - np.float32(row)
        for term in range(2):
            low = table[row, column, term] * (one - fu) + table[row, column + 1, term] * fu
            high = table[row + 1, column, term] * (one - fu) + table[row + 1, column + 1, term] * fu
            exact = low * (one - fv) + high * fv
            open_point[term] = max(exact, least)
            by_r[term] = (high - low) * np.float32(rows - 1) if exact >= least else np.float32(0)
            for k in range(count):
                known = knot_table[column, term, k] * (one - fu) + knot_table[column + 1, term, k] * fu
                scale[term, k] = one / max(known, least)
        for j in range(3):
            for term in range(2):
                stored, own = A[i, :, j] if term == 0 else B[i, :, j], 2 * j + term
                least_y[own] = dark * max(stored[count - 1] * scale[term, count - 1], np.float32(0)) + tiny
                for k in range(count):
                    raised[own * count + k] = max(stored[k] * scale[term, k], np.float32(0)) + least_y[own]
        logarithms(bits, scratch, y)
        for j in range(3):
            for term in range(2):
                a, b, own = np.float32(0), np.float32(0), 2 * j + term
                ys = y[own * count : (own + 1) * count]
                for k in range(count):
                    a += slopes[left, k] * ys[k]
                    b += slopes[left + 1, k] * ys[k]
                rise = ys[left + 1] - ys[left]
                lowest, highest = 3 * min(rise, np.float32(0)) - bulge, 3 * max(rise, np.float32(0)) + bulge
                a, b = min(max(h * a, lowest), highest), min(max(h * b, lowest), highest)
                spline = ys[left] + x * (x * (3 - 2 * x) * rise + (one - x) * (a * (one - x) - b * x))
                whole = np.exp(spline)
                relative = max(whole - least_y[own], np.float32(0))
                change = rise * 6 * x * (one - x) + a * (one - x) * (one - 3 * x) + b * x * (3 * x - 2)
                value[term] = relative * open_point[term]
                change = whole * change / (h * (r + soften)) if relative > 0 else np.float32(0)
                slope[term] = change * open_point[term] + relative * by_r[term]
            diffuse, f = (one - m) * c[p, j], f0 * (one - m) + m * c[p, j]
            out[i, j] = diffuse * E[i, j] + f * value[0] + value[1]
            out_a[i, j] = value[0]
            out_r[i, j] = f * slope[0] + slope[1]


@compiled
def _shade_backward(  # type: ignore[no-untyped-def]
    lights, gradient, E, A, by_roughness, c, metallic, f0, out_c, out_r, out_m
):
    for p in range(len(out_r)):
        m = metallic[p]
        r_sum, m_sum = np.float32(0), np.float32(0)
        for j in range(3):
            c_sum = np.float32(0)
            for i in range(p * lights, (p + 1) * lights):
                g = gradient[i, j]
                c_sum += g * ((np.float32(1) - m) * E[i, j] + m * A[i, j])
                m_sum += g * ((c[p, j] - f0) * A[i, j] - c[p, j] * E[i, j])
                r_sum += g * by_roughness[i, j]
            out_c[p, j] = c_sum
        out_r[p], out_m[p] = r_sum, m_sum
