"""Compiled CPU form of `stages.core.shading.shade_reference`, with its derivatives; a test holds the two together."""

import functools

import numba
import numpy as np
from numpy.typing import NDArray

from stages.core import albedo
from stages.core.parallel import run_parallel, slices

ROWS_PER_TASK = 1 << 14

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
    constants: tuple[float, float, float, float],
) -> tuple[Values, Values, Values]:
    """Radiance and what its gradient needs.

    Args:
        transport: E (N, 3), A and B (N, K, 3), cosine (N,). material: albedo (P, 3), roughness (P,), metallic (P,);
        N = P L. constants: F0, the least albedo to interpolate by, DARK and the least DARK y.
    Returns:
        radiance, interpolated A, and d radiance / d roughness: (N, 3) each.
    """
    count = len(transport[0])
    lights = count // max(len(material[1]), 1)
    out = tuple(np.empty((count, 3), np.float32) for _ in range(3))
    tables = (_knot_table(knots), albedo.table(), np.array(knots, np.float32))
    floats = tuple(map(np.float32, constants))
    tasks = [
        (part.start, lights, *(t[part] for t in transport), *material, *tables, *floats, *(o[part] for o in out))
        for part in slices(count, ROWS_PER_TASK)
    ]
    run_parallel(_shade, tasks)
    return out  # type: ignore[return-value]


def shade_backward(
    gradient: Values, E: Values, A: Values, by_roughness: Values, material: tuple[Values, Values, Values], f0: float
) -> tuple[Values, Values, Values]:
    """Gradients of albedo (P, 3), roughness (P,) and metallic (P,) from that of the radiance (N, 3)."""
    c, roughness, metallic = material
    points = len(roughness)
    out = (np.empty((points, 3), np.float32), np.empty(points, np.float32), np.empty(points, np.float32))
    lights = len(gradient) // max(points, 1)
    tasks = []
    for part in slices(points, ROWS_PER_TASK):
        rows = slice(part.start * lights, part.stop * lights)
        given = (gradient[rows], E[rows], A[rows], by_roughness[rows], c[part], metallic[part])
        tasks.append((lights, *given, np.float32(f0), *(o[part] for o in out)))
    run_parallel(_shade_backward, tasks)
    return out


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _slope(before, after, step_before, step_after):  # type: ignore[no-untyped-def]
    """As `stages.core.shading._slope`."""
    if step_before <= 0:
        return after
    if step_after <= 0:
        return before
    return (before * step_after + after * step_before) / (step_before + step_after)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _shade(  # type: ignore[no-untyped-def]
    first, lights, E, A, B, cosine, c, roughness, metallic, knot_table, table, knots, f0, least, dark, tiny, out, out_a, out_r
):
    one = np.float32(1)
    last = len(knots) - 1
    rows, columns = len(table), table.shape[1]
    y, value, slope = np.empty(4, np.float32), np.empty(2, np.float32), np.empty(2, np.float32)
    near, step, scale = np.empty(5, np.int64), np.empty(3, np.float32), np.empty((5, 2), np.float32)
    near[4] = last
    open_point, by_r = np.empty(2, np.float32), np.empty(2, np.float32)
    for i in range(len(E)):
        p = (first + i) // lights
        r, m = roughness[p], metallic[p]
        left = 0
        while left < last - 1 and knots[left + 1] <= r:
            left += 1
        for k in range(4):
            near[k] = min(max(left + k - 1, 0), last)
        for k in range(3):
            step[k] = knots[near[k + 1]] - knots[near[k]]
        h = step[1]
        x = (r - knots[left]) / h
        ease, tail = x * x * (3 - 2 * x), x * x * (x - one)
        head = x * (one - x) * (one - x)
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
        for k in range(5):
            for term in range(2):
                n = near[k]
                known = knot_table[n, column, term] * (one - fu) + knot_table[n, column + 1, term] * fu
                scale[k, term] = one / max(known, least)
        for j in range(3):
            for term in range(2):
                roughest = A[i, last, j] if term == 0 else B[i, last, j]
                least_y = dark * max(roughest * scale[4, term], np.float32(0)) + tiny
                for k in range(4):
                    n = near[k]
                    stored = A[i, n, j] if term == 0 else B[i, n, j]
                    y[k] = np.log(max(stored * scale[k, term], np.float32(0)) + least_y)
                rise0 = (y[1] - y[0]) / step[0] if step[0] > 0 else np.float32(0)
                rise1 = (y[2] - y[1]) / h
                rise2 = (y[3] - y[2]) / step[2] if step[2] > 0 else np.float32(0)
                a = _slope(rise0, rise1, step[0], h)
                b = _slope(rise1, rise2, h, step[2])
                raised = np.exp(y[1] * (one - ease) + y[2] * ease + h * (a * head + b * tail))
                relative = max(raised - least_y, np.float32(0))
                change = rise1 * 6 * x * (one - x) + a * (one - x) * (one - 3 * x) + b * x * (3 * x - 2)
                value[term] = relative * open_point[term]
                change = raised * change if relative > 0 else np.float32(0)
                slope[term] = change * open_point[term] + relative * by_r[term]
            diffuse, f = (one - m) * c[p, j], f0 * (one - m) + m * c[p, j]
            out[i, j] = diffuse * E[i, j] + f * value[0] + value[1]
            out_a[i, j] = value[0]
            out_r[i, j] = f * slope[0] + slope[1]


@numba.njit(nogil=True, cache=True)
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
