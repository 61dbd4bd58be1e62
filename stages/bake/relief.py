"""From a height map to the normal map that shows it, in the tangent space in which every client reads it.

The height of each texel is differenced within its own chart only, over the UV layout, and its gradient is carried into
space by the triangle's own Jacobian: mirrored, turned or stretched UVs give the same relief. The surface normal then
leans by minus that gradient, and is written in the tangent frame that the reader will interpolate at this texel.
By how much normals differ within a texel goes into its roughness (`material.relief.bend`).
Source: Mikkelsen 2010, "Bump Mapping Unparametrized Surfaces on the GPU" (surface gradients, which add up); 2020,
"Surface Gradient-Based Bump Mapping Framework".
"""

import numpy as np
from numpy.typing import NDArray

from stages.bake.raster import Layout, Surface
from stages.core.brdf import roughened
from stages.core.parallel import compiled, in_parallel, slices
from stages.light.normal_maps import NormalMaps, frame
from stages.material.relief import STEEPEST, bend, gentle

FAR = 4.0
"""A neighbouring texel farther off in space than this many of a texel's own steps lies beyond a fold of the chart."""

FLAT = 1e-3
"""Least spread of a texel's neighbours across, against along, for a gradient in both directions."""


TOGETHER = 1 << 15
"""Texels that lean together: the whole of a map would take a hundred times its bytes."""


def relief_normals(
    height: NDArray[np.float32],
    roughness: NDArray[np.float32],
    surface: Surface,
    layout: Layout,
    charts: NDArray[np.int32],
    corners: tuple[NDArray[np.float32], NDArray[np.float32]],
    frames: NormalMaps,
    own: NormalMaps | None,
) -> NDArray[np.float32]:
    """The tangent-space normal map of a height map.

    Args:
        height: (S, S) world units, on the texels of charts. roughness: (S, S), raised in place where normals differ.
        surface: (S, S) the point of each texel. charts: (F,).
        corners: world positions and unit normals of the triangles' corners, (F, 3, 3) each. frames: tangents of the
        corners. own: normal maps that the mesh already has, on which the relief lies.
    Returns:
        (S, S, 3) unit, +Y up; (0, 0, 1) off the charts.
    """
    positions, normals = corners
    steps = jacobians(layout, positions)
    carry = inverse_steps(steps)
    slope = np.zeros((*height.shape, 2), np.float32)
    _slopes(height, surface.triangle, surface.barycentric, charts, layout.uv, positions, steps, slope)
    _roughen(height, surface.triangle, charts, np.linalg.norm(steps, axis=1), roughness)
    result = np.zeros((*height.shape, 3), np.float32)
    result[..., 2] = 1

    def lean(rows: slice) -> None:
        on = surface.triangle[rows] >= 0
        if on.any():
            points, leaning = surface[rows].where(on), np.empty((int(on.sum()), 3), np.float32)
            added = np.zeros((0, 3)) if own is None else own_gradient(points, normals, own)
            _lean(points.triangle, points.barycentric, slope[rows][on], carry, normals, frames.tangents, added, leaning)
            result[rows][on] = leaning

    in_parallel(lean, slices(len(height), max(1, TOGETHER // len(height))))
    return result


def own_gradient(points: Surface, normals: NDArray, own: NormalMaps) -> NDArray[np.float64]:
    """What the mesh's own normal maps add to the gradient of surface points, (N, 3)."""
    n = points.interpolate(normals)
    n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-12)
    weights = np.c_[points.barycentric, 1 - points.barycentric.sum(1)]
    leaning = own.leaning(n, points.triangle, weights)
    return (n - leaning / (leaning * n).sum(1, keepdims=True)).astype(np.float64)


def lean_reference(
    points: Surface, slope: NDArray, carry: NDArray, normals: NDArray, frames: NormalMaps, own: NormalMaps | None
) -> NDArray[np.float32]:
    """Tangent-space normals (N, 3) of surface points with a slope (N, 2) in world units a texel; `_lean` is its fast form."""
    n = points.interpolate(normals)
    n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-12)
    gradient = np.einsum("nij,nj->ni", carry[points.triangle], slope)
    gradient = gentle(gradient - (gradient * n).sum(1, keepdims=True) * n)
    if own is not None:
        gradient += own_gradient(points, normals, own)
    t, b = frame(n, points.interpolate(frames.tangents))
    return in_frame(n - gradient, t, b, n)


def in_frame(m: NDArray, t: NDArray, b: NDArray, n: NDArray) -> NDArray[np.float32]:
    """(x, y, z), unit, along which m = x t + y b + z n; t and n need not be at right angles. (N, 3) each."""
    lean, along, up = (t * n).sum(1), (m * t).sum(1), (m * n).sum(1)
    squared = 1 - lean**2
    vector = np.stack([(along - lean * up) / squared, (m * b).sum(1), (up - lean * along) / squared], 1)
    return (vector / np.linalg.norm(vector, axis=1, keepdims=True)).astype(np.float32)


def jacobians(layout: Layout, positions: NDArray[np.float32]) -> NDArray[np.float64]:
    """World step of each triangle for a texel to the right and one down, (F, 3, 2); 0 for one without area in UV."""
    p, t = positions.astype(np.float64), layout.uv
    edges = np.stack([p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]], -1)  # (F, 3, 2)
    (a, c), (b, d) = (t[:, 1] - t[:, 0]).T, (t[:, 2] - t[:, 0]).T
    area = a * d - b * c
    inverse = np.stack([np.stack([d, -b], -1), np.stack([-c, a], -1)], 1)  # of [[a, b], [c, d]], times its determinant
    sound = np.abs(area) > 0
    return np.where(sound, 1, 0)[:, None, None] * (edges @ inverse) / np.where(sound, area, 1)[:, None, None]


def inverse_steps(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """What turns a slope a texel into a gradient in space: J (J'J)^-1, (F, 3, 2); 0 where J has no inverse."""
    gram = np.einsum("fki,fkj->fij", steps, steps)
    (a, b), (_, d) = np.moveaxis(gram, 0, -1)
    determinant = a * d - b * b
    sound = determinant > 1e-12 * (a + d) ** 2
    adjugate = np.stack([np.stack([d, -b], -1), np.stack([-b, a], -1)], 1)
    return np.where(sound[:, None, None], steps @ adjugate, 0) / np.where(sound, determinant, 1)[:, None, None]


@compiled
def _slopes(height, triangle, barycentric, charts, layout, positions, steps, slope):  # type: ignore[no-untyped-def]
    """Least-squares slope of each texel over its four neighbours on the same chart; along one line where they lie on one."""
    rows, columns = height.shape
    for i in range(rows):
        for j in range(columns):
            f = triangle[i, j]
            if f < 0:
                continue
            xx, xy, yy, xh, yh = 0.0, 0.0, 0.0, 0.0, 0.0
            for k in range(4):
                y, x = i + (k == 0) - (k == 1), j + (k == 2) - (k == 3)
                if y < 0 or x < 0 or y >= rows or x >= columns or triangle[y, x] < 0:
                    continue
                g = triangle[y, x]
                if charts[g] != charts[f]:
                    continue
                dx = _at(layout, g, barycentric[y, x], 0) - _at(layout, f, barycentric[i, j], 0)
                dy = _at(layout, g, barycentric[y, x], 1) - _at(layout, f, barycentric[i, j], 1)
                dx, dy = dx - columns * np.rint(dx / columns), dy - rows * np.rint(dy / rows)  # whole tiles apart is beside
                apart, expected = 0.0, 0.0
                for d in range(3):
                    apart += (_at(positions, g, barycentric[y, x], d) - _at(positions, f, barycentric[i, j], d)) ** 2
                    expected += (steps[f, d, 0] * dx + steps[f, d, 1] * dy) ** 2
                if apart > FAR * FAR * expected:
                    continue
                dh = height[y, x] - height[i, j]
                xx, xy, yy, xh, yh = xx + dx * dx, xy + dx * dy, yy + dy * dy, xh + dx * dh, yh + dy * dh
            determinant, spread = xx * yy - xy * xy, xx + yy
            if determinant > FLAT * spread * spread:
                slope[i, j, 0] = (yy * xh - xy * yh) / determinant
                slope[i, j, 1] = (xx * yh - xy * xh) / determinant
            elif spread > 0:
                slope[i, j, 0], slope[i, j, 1] = xh / spread, yh / spread


@compiled
def _roughen(height, triangle, charts, widths, roughness):  # type: ignore[no-untyped-def]
    """Raise the roughness of texels all of whose neighbours are on their chart. widths: (F, 2) of a texel on each triangle."""
    rows, columns = height.shape
    for i in range(1, rows - 1):
        for j in range(1, columns - 1):
            f = triangle[i, j]
            whole = f >= 0 and widths[f, 0] > 0 and widths[f, 1] > 0
            for k in range(9):
                g = triangle[i + k // 3 - 1, j + k % 3 - 1]
                whole = whole and g >= 0 and charts[g] == charts[f]
            if whole:
                above, below = height[i - 1], height[i + 1]
                spread = bend(above, height[i], below, (j - 1, j, j + 1), 1 / widths[f, 0], 1 / widths[f, 1])
                roughness[i, j] = roughened(roughness[i, j], spread)


@compiled
def _at(corners, f, barycentric, d):  # type: ignore[no-untyped-def]
    """Coordinate d of a point of triangle f."""
    u, v = barycentric[0], barycentric[1]
    return u * corners[f, 0, d] + v * corners[f, 1, d] + (1 - u - v) * corners[f, 2, d]


@compiled
def _lean(triangle, barycentric, slope, carry, normals, tangents, added, result):  # type: ignore[no-untyped-def]
    """`lean_reference`. added: (N, 3) of `own_gradient`, or (0, 3). result: (N, 3), written."""
    n, t, b, m = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for i in range(len(triangle)):
        f, along = triangle[i], 0.0
        for d in range(3):
            n[d], t[d] = _at(normals, f, barycentric[i], d), _at(tangents, f, barycentric[i], d)
        _to_unit(n, 1e-12)
        for d in range(3):
            m[d] = carry[f, d, 0] * slope[i, 0] + carry[f, d, 1] * slope[i, 1]
            along += m[d] * n[d]
        for d in range(3):
            m[d] -= along * n[d]
        length = np.sqrt(m[0] ** 2 + m[1] ** 2 + m[2] ** 2)
        share = min(1.0, STEEPEST / max(length, STEEPEST / 2))
        for d in range(3):
            m[d] = n[d] - share * m[d] - (added[i, d] if len(added) else 0.0)
        _to_unit(t, 1e-6)
        for d in range(3):
            b[d] = n[(d + 1) % 3] * t[(d + 2) % 3] - n[(d + 2) % 3] * t[(d + 1) % 3]
        _to_unit(b, 1e-6)
        _in_frame(m, t, b, n, -1.0 if _at(tangents, f, barycentric[i], 3) < 0 else 1.0, result[i])


@compiled
def _in_frame(m, t, b, n, sign, result):  # type: ignore[no-untyped-def]
    """`in_frame` of one vector. sign: of the bitangent."""
    lean, along, across, up = 0.0, 0.0, 0.0, 0.0
    for d in range(3):
        lean, along, across, up = lean + t[d] * n[d], along + m[d] * t[d], across + m[d] * b[d] * sign, up + m[d] * n[d]
    squared = 1 - lean**2
    x, z = (along - lean * up) / squared, (up - lean * along) / squared
    length = np.sqrt(x * x + across * across + z * z)
    result[0], result[1], result[2] = x / length, across / length, z / length


@compiled
def _to_unit(vector, least):  # type: ignore[no-untyped-def]
    """Make a vector (3,) unit, in place, or 0 where it is no longer than `least`."""
    length = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    for d in range(3):
        vector[d] = vector[d] / length if length > least else 0.0
