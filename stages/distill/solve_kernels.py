"""Compiled search for the material of each pixel; what it looks for is said in `stages.distill.solve`.

One pixel at a time, in float64. `Lights` of a pixel under L lights are the logarithms (L, 2, 3, K) of its A and B at the knots
and the spline's slopes there, what these were raised by (L, 2, 3), and its column (L,) and place in it (L,) in the table of
open points: `stages.core.shading.interpolate`, with all that does not depend on the roughness done once. A material is (5,):
albedo, roughness and metallic.
"""

import numpy as np
from numpy.typing import NDArray

from stages.core import albedo
from stages.core.knots import F0, KNOTS
from stages.core.parallel import compiled, in_parallel, slices
from stages.core.shading import BULGE, DARK, LEAST_ALBEDO, SOFTEN, TINY, spline_slopes
from stages.core.shading_kernels import _knot_table

POINTS_PER_TASK = 1 << 10

BETWEEN = 4
"""Roughnesses that are tried in each interval between two knots."""

METALLIC = np.array([0, 0.05, 0.12, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.88, 0.95, 1.0])
"""Metallics that are tried with each."""

HOLLOWS = 4
"""Deepest hollows of what was tried that are followed down."""

STEPS, AGAIN, TRIES = 15, 40, 4
"""Levenberg-Marquardt steps down a hollow, of the best of all afterwards, and how often a step may be shortened."""

EXACT, LITTLE = 1e-12, 1e-4
"""Misfit at which a material explains all, and relative gain below which a hollow's ground is reached."""

ALIKE, TIMES = 1e-7, 4.0
"""Materials explain a pixel equally well up to this misfit, or this many times the least: then the duller is taken."""

Array = NDArray[np.float64]


def solve(
    transport: tuple[NDArray, NDArray, NDArray, NDArray], seen: NDArray, floor: NDArray
) -> tuple[Array, Array, Array]:
    """The material (P, 5) of points, its misfit (P,), and the normal matrix there (P, 5, 5).

    Args:
        transport: E (P, L, 3), A and B (P, L, K, 3), cosine (P, L). seen: radiance (P, L, 3). floor: (L,) added to radiance
        before its logarithm is taken.
    """
    points = len(seen)
    out = np.empty((points, 5)), np.empty(points), np.empty((points, 5, 5))
    knots = np.array(KNOTS)
    bent = np.log(knots + SOFTEN)
    tried = np.interp(np.arange(BETWEEN * (len(KNOTS) - 1) + 1) / BETWEEN, np.arange(len(KNOTS)), bent)
    roughness = (np.exp(tried) - SOFTEN).clip(0, 1)
    tables = _knot_table(KNOTS).astype(np.float64), albedo.table().astype(np.float64), spline_slopes(KNOTS), knots, bent

    def task(part: slice) -> None:
        given = (np.ascontiguousarray(a[part], np.float64) for a in (*transport, seen))
        _solve(*given, floor.astype(np.float64), tables, roughness, METALLIC, *(o[part] for o in out))

    in_parallel(task, slices(points, POINTS_PER_TASK))
    return out


@compiled
def _solve(E, A, B, cosine, seen, floor, tables, roughness, metallic, found, misfits, normals):  # type: ignore[no-untyped-def]
    lights = seen.shape[1]
    grid = np.empty((len(roughness), len(metallic))), np.empty((len(roughness), len(metallic), 3))
    tried, misfit, normal = np.empty((HOLLOWS + 1, 5)), np.empty(HOLLOWS + 1), np.empty((5, 5))
    weight = np.empty((lights, 3))
    for p in range(len(seen)):
        light = _prepare(A[p], B[p], cosine[p], tables)
        for i in range(lights):
            for j in range(3):
                weight[i, j] = 1 / (seen[p, i, j] + floor[i])
        shown = E[p], seen[p], weight
        _scan(shown, light, tables, roughness, metallic, grid)
        count = _hollows(grid, roughness, metallic, tried)
        for h in range(count):
            misfit[h] = _descend(tried[h], shown, light, tables, STEPS, normal)
        best = int(np.argmin(misfit[:count]))
        misfit[best] = _descend(tried[best], shown, light, tables, AGAIN, normal)
        if _twin(tried[best], tried[count]):
            misfit[count] = _descend(tried[count], shown, light, tables, 0, normal)
            count += 1
        alike = max(ALIKE, TIMES * misfit[best])
        for h in range(count):
            if misfit[h] <= alike and tried[h, 4] < tried[best, 4]:
                best = h
        found[p] = tried[best]
        misfits[p] = _descend(found[p], shown, light, tables, 0, normals[p])


@compiled
def _prepare(A, B, cosine, tables):  # type: ignore[no-untyped-def]
    """The `Lights` of a pixel."""
    knot_table, table, slopes = tables[0], tables[1], tables[2]
    lights, count = len(cosine), len(slopes)
    y, slope, raised = np.empty((lights, 2, 3, count)), np.empty((lights, 2, 3, count)), np.empty((lights, 2, 3))
    column, place = np.empty(lights, np.int64), np.empty(lights)
    for i in range(lights):
        u = np.sqrt(min(max(cosine[i], 0.0), 1.0)) * (table.shape[1] - 1)
        c = min(int(u), table.shape[1] - 2)
        column[i], place[i] = c, u - c
        for term in range(2):
            for j in range(3):
                value = y[i, term, j]
                for k in range(count):
                    known = knot_table[k, c, term] * (1 - place[i]) + knot_table[k, c + 1, term] * place[i]
                    stored = A[i, k, j] if term == 0 else B[i, k, j]
                    value[k] = max(stored / max(known, LEAST_ALBEDO), 0.0)
                raised[i, term, j] = DARK * value[count - 1] + TINY
                for k in range(count):
                    value[k] = np.log(value[k] + raised[i, term, j])
                for k in range(count):
                    total = 0.0
                    for n in range(count):
                        total += slopes[k, n] * value[n]
                    slope[i, term, j, k] = total
    return y, slope, raised, column, place


@compiled
def _lobes(r, light, tables, value, change):  # type: ignore[no-untyped-def]
    """A and B (L, 2, 3) at a roughness, and their derivatives by it."""
    table, knots, bent = tables[1], tables[3], tables[4]
    y, slope, raised, columns, places = light
    left = 0
    while left < len(knots) - 2 and knots[left + 1] <= r:
        left += 1
    h = bent[left + 1] - bent[left]
    x = (np.log(r + SOFTEN) - bent[left]) / h
    v = r * (len(table) - 1)
    row = min(max(int(v), 0), len(table) - 2)
    v -= row
    for i in range(len(y)):
        c, u = columns[i], places[i]
        for term in range(2):
            low = table[row, c, term] * (1 - u) + table[row, c + 1, term] * u
            high = table[row + 1, c, term] * (1 - u) + table[row + 1, c + 1, term] * u
            exact = low * (1 - v) + high * v
            whole, by_r = max(exact, LEAST_ALBEDO), (high - low) * (len(table) - 1) if exact >= LEAST_ALBEDO else 0.0
            for j in range(3):
                known, bend = y[i, term, j], slope[i, term, j]
                rise = known[left + 1] - known[left]
                lowest, highest = 3 * min(rise, 0.0) - BULGE, 3 * max(rise, 0.0) + BULGE
                a, b = min(max(h * bend[left], lowest), highest), min(max(h * bend[left + 1], lowest), highest)
                above = np.exp(known[left] + x * (x * (3 - 2 * x) * rise + (1 - x) * (a * (1 - x) - b * x)))
                relative = max(above - raised[i, term, j], 0.0)
                steep = rise * 6 * x * (1 - x) + a * (1 - x) * (1 - 3 * x) + b * x * (3 * x - 2)
                steep = above * steep / (h * (r + SOFTEN)) if relative > 0 else 0.0
                value[i, term, j], change[i, term, j] = relative * whole, steep * whole + relative * by_r


@compiled
def _scan(shown, light, tables, roughness, metallic, grid):  # type: ignore[no-untyped-def]
    """Misfit (R, M) and albedo (R, M, 3) of the best albedo at every roughness and metallic tried: radiance is linear in it."""
    E, seen, weight = shown
    misfit, color = grid
    value, change = np.empty((len(E), 2, 3)), np.empty((len(E), 2, 3))
    misfit[:] = 0
    for n in range(len(roughness)):
        _lobes(roughness[n], light, tables, value, change)
        for j in range(3):
            ee, ea, aa, eo, ao, oo = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for i in range(len(E)):
                w = weight[i, j]
                e, a, o = w * E[i, j], w * value[i, 0, j], w * (seen[i, j] - value[i, 1, j])
                ee, ea, aa, eo, ao, oo = ee + e * e, ea + e * a, aa + a * a, eo + e * o, ao + a * o, oo + o * o
            for k in range(len(metallic)):
                m, d = metallic[k], 1 - metallic[k]  # diffuse d c, specular F0 d + m c
                f = F0 * d
                square = d * d * ee + 2 * d * m * ea + m * m * aa
                c = min(max((d * eo + m * ao - f * (d * ea + m * aa)) / max(square, 1e-30), 0.0), 1.0)
                color[n, k, j] = c
                d, f = d * c, f + m * c
                misfit[n, k] += oo - 2 * (d * eo + f * ao) + d * d * ee + 2 * d * f * ea + f * f * aa


@compiled
def _hollows(grid, roughness, metallic, tried):  # type: ignore[no-untyped-def]
    """The deepest hollows of the grid into `tried`, deepest first. Returns: how many."""
    misfit, color = grid
    depth = np.full(HOLLOWS, np.inf)
    count = 0
    for n in range(len(roughness)):
        for k in range(len(metallic)):
            here = misfit[n, k]
            if here >= depth[HOLLOWS - 1]:
                continue
            around = misfit[max(n - 1, 0) : n + 2, max(k - 1, 0) : k + 2]
            if here > around.min():
                continue
            at = HOLLOWS - 1
            while at > 0 and depth[at - 1] > here:
                depth[at], tried[at] = depth[at - 1], tried[at - 1]
                at -= 1
            depth[at] = here
            tried[at, :3], tried[at, 3], tried[at, 4] = color[n, k], roughness[n], metallic[k]
            count += 1
    return min(count, HOLLOWS)


@compiled
def _residuals(x, shown, lobes, jacobian, residual):  # type: ignore[no-untyped-def]
    """Logarithms of shown over seen (3 L,), and their derivatives (3 L, 5). Returns: the mean square."""
    E, seen, weight = shown
    value, change = lobes
    m, n, total = x[4], 0, 0.0
    for i in range(len(E)):
        for j in range(3):
            c, w = x[j], weight[i, j]
            f = F0 * (1 - m) + m * c
            ratio = max(1 + w * ((1 - m) * c * E[i, j] + f * value[i, 0, j] + value[i, 1, j] - seen[i, j]), 1e-9)
            residual[n] = np.log(ratio)
            total += residual[n] ** 2
            jacobian[n, :3] = 0
            jacobian[n, j] = w / ratio * ((1 - m) * E[i, j] + m * value[i, 0, j])
            jacobian[n, 3] = w / ratio * (f * change[i, 0, j] + change[i, 1, j])
            jacobian[n, 4] = w / ratio * ((c - F0) * value[i, 0, j] - c * E[i, j])
            n += 1
    return total / n


@compiled
def _descend(x, shown, light, tables, steps, normal):  # type: ignore[no-untyped-def]
    """Levenberg-Marquardt from x, in place, within [0, 1]; `normal` (5, 5) is left as it is there. Returns: the misfit."""
    lights = len(shown[0])
    lobes = np.empty((lights, 2, 3)), np.empty((lights, 2, 3))
    jacobian, residual, other_jacobian, other_residual = (
        np.empty((3 * lights, 5)), np.empty(3 * lights), np.empty((3 * lights, 5)), np.empty(3 * lights)
    )  # fmt: skip
    free, step, trial, damped = np.ones(5, np.bool_), np.empty(5), np.empty(5), np.empty((5, 5))
    damping = 1e-3
    _lobes(x[3], light, tables, lobes[0], lobes[1])
    misfit = _residuals(x, shown, lobes, jacobian, residual)
    for _ in range(steps):
        if misfit < EXACT:
            break
        normal[:] = jacobian.T @ jacobian
        slope = -(jacobian.T @ residual)
        for k in range(5):
            free[k] = not ((x[k] <= 0 and slope[k] < 0) or (x[k] >= 1 and slope[k] > 0))
        before = misfit
        for _ in range(TRIES):
            damped[:] = normal
            for k in range(5):
                damped[k, k] += damping * normal[k, k] + 1e-11
            _damped_step(damped, slope, free, step)
            for k in range(5):
                trial[k] = min(max(x[k] + step[k], 0.0), 1.0)
            _lobes(trial[3], light, tables, lobes[0], lobes[1])
            after = _residuals(trial, shown, lobes, other_jacobian, other_residual)
            if after < misfit:
                x[:], jacobian[:], residual[:], misfit = trial, other_jacobian, other_residual, after
                damping = max(0.1 * damping, 1e-10)
                break
            damping *= 10
        if misfit >= (1 - LITTLE) * before:
            break
    normal[:] = jacobian.T @ jacobian / (3 * lights)
    return misfit


@compiled
def _damped_step(matrix, slope, free, step):  # type: ignore[no-untyped-def]
    """Solve for the free values by Cholesky's factors; the others stay."""
    lower = np.zeros((5, 5))
    for i in range(5):
        for j in range(i + 1):
            total = matrix[i, j] if free[i] and free[j] else 1.0 if i == j else 0.0
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            lower[i, j] = np.sqrt(max(total, 1e-300)) if i == j else total / lower[j, j]
    for i in range(5):
        total = slope[i] if free[i] else 0.0
        for k in range(i):
            total -= lower[i, k] * step[k]
        step[i] = total / lower[i, i]
    for i in range(4, -1, -1):
        total = step[i]
        for k in range(i + 1, 5):
            total -= lower[k, i] * step[k]
        step[i] = total / lower[i, i]


@compiled
def _twin(x, twin):  # type: ignore[no-untyped-def]
    """A grey of albedo c < F0 and metallic m looks like one of albedo F0 (1 - m) and metallic 1 - c / F0. Returns: whether x
    has a duller one."""
    twin[:3], twin[3], twin[4] = F0 * (1 - x[4]), x[3], 1 - (x[0] + x[1] + x[2]) / (3 * F0)
    return 0 <= twin[4] < x[4]
