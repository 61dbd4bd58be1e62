"""Ambient occlusion of every texel: which share of an even environment's light reaches it.

Rays start at some texels, the *samples*: all on the rims of charts, and one in each cell of a grid over every chart. A texel
takes the mean of the samples nearest to it in place and direction, whichever charts they are on, so noise is averaged
over seams and not over creases, nor from one side of a thin wall to the other. Texels whose samples are few or differ, as at a
shadow's edge, are sampled in cells half as wide, and again, down to each by itself; then it takes only those that see about
as much as it does.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from stages.bake.raster import Surface
from stages.core.parallel import compiled, cores, in_parallel
from stages.core.progress import Progress
from stages.light.openness import Lookouts, openness
from stages.light.scene import Scene

SPACING = 0.006
"""Between the first samples, object sizes; a texel where those are larger."""

TURN = 2.0
"""First spacings that count as much as a normal's turn by one radian."""

NEIGHBOURS = 16
"""Samples that a mean is taken over, most of them at little weight."""

FEW = 1.0
"""Least sum of the weights, each at most 1, of a mean that is trusted."""

UNEVEN = 0.25
"""Standard deviation among the samples of a mean that is trusted, over the root of the rays; their noise is half of it."""

ALIKE = 0.5
"""Difference from a texel's own sample at which others no longer count, over the root of the rays."""

SHUT = 1 / 255
"""Openness of a front that counts as shut in: what 8 bits show as black."""

TASK = 1 << 17
"""Texels of one thread's task."""


@dataclass(frozen=True)
class Texels:
    """The texels on charts, row by row. row, column, chart: (N,). surface: (N,). rim: (N,) bool, beside another chart or none.

    place: (N, 6) position and normal, the latter in such units that Euclidean distance weighs both; float32.
    cell: edge of the first cells, texels.
    """

    row: NDArray[np.int32]
    column: NDArray[np.int32]
    chart: NDArray[np.int32]
    surface: Surface
    rim: NDArray[np.bool_]
    place: NDArray[np.float32]
    cell: int

    @staticmethod
    def of(scene: Scene, touched: Surface, charts: NDArray[np.int32]) -> "Texels":
        """Args: touched: (size, size). charts: (F,) chart of each triangle."""
        on_chart = touched.triangle >= 0
        row, column = (axis.astype(np.int32) for axis in np.nonzero(on_chart))
        chart = np.where(on_chart, charts[touched.triangle], -1)
        surface = touched.where(on_chart)
        texel = _texel_edge(scene, surface)
        cell = 1 << max(int(np.log2(SPACING / texel)), 0)
        point, normal = (surface.interpolate(corners) for corners in (scene.vertices[scene.triangles], scene.normals))
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        normal *= TURN * cell * texel / np.maximum(length, 1e-3)
        place = np.concatenate([point, normal], 1)
        return Texels(row, column, chart[on_chart], surface, _rim(chart)[on_chart], place, cell)

    def samples(self, texels: NDArray[np.int64], cell: int) -> NDArray[np.int64]:
        """For each of some texels (K,) the first in its cell of its chart."""
        row, column = (axis[texels].astype(np.int64) // cell for axis in (self.row, self.column))
        key = (self.chart[texels] << 40) + (row << 20) + column
        _, first, of_texel = np.unique(key, return_index=True, return_inverse=True)
        return texels[first][of_texel]


def _rim(chart: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Texels one of whose four neighbours is of another chart, or of none. Args: (H, W), -1 for none."""
    around = np.pad(chart, 1, constant_values=-1)
    sides = (around[:-2, 1:-1], around[2:, 1:-1], around[1:-1, :-2], around[1:-1, 2:])
    return np.logical_or.reduce([side != chart for side in sides])


def _texel_edge(scene: Scene, surface: Surface) -> float:
    """Edge of a texel on the surface, world units, from the areas of all triangles that are on charts."""
    a, b, c = (scene.vertices[scene.triangles[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)[np.unique(surface.triangle)].sum() / 2
    return float(np.sqrt(area / len(surface.triangle)))


def occlusion_map(
    scene: Scene, touched: Surface, charts: NDArray[np.int32], rays: int, open_mesh: bool, progress: Progress
) -> NDArray[np.float32]:
    """Occlusion as glTF has it: 1 in the open, 0 where no light comes.

    Args:
        touched: (size, size) the surface point of each texel. charts: (F,). rays: of each sample.
        open_mesh: whether the backs of triangles can be seen.
    Returns:
        (size, size); 1 off the charts.
    """
    texels = Texels.of(scene, touched, charts)
    value = np.full(len(texels.row), np.nan, np.float32)  # of the samples
    result = np.empty_like(value)
    asked, cell = np.arange(len(value)), texels.cell
    while len(asked):
        progress("occlusion", len(value) - len(asked), len(value))
        owner = texels.samples(asked, cell)
        if cell == texels.cell:
            owner[texels.rim] = asked[texels.rim]
        new = np.unique(owner)
        new = new[np.isnan(value[new])]
        pattern = 4 * (texels.row[new] // cell % 4) + texels.column[new] // cell % 4
        value[new] = openness_of(scene, texels.surface[new], pattern, rays, open_mesh)
        asked = asked[_average(texels.place, value, asked, owner, rays, result)]
        cell //= 2
    full = np.ones(touched.triangle.shape, np.float32)
    full[touched.triangle >= 0] = result
    return full


def openness_of(
    scene: Scene, surface: Surface, pattern: NDArray, rays: int, open_mesh: bool
) -> NDArray[np.float32]:
    """Openness (N,) by rays; see `both_sides`."""

    def measure(rows: NDArray, side: float) -> NDArray:
        return openness(scene, lookouts_of(scene, surface[rows], side), pattern[rows], rays)

    return both_sides(measure, len(pattern), open_mesh)


def both_sides(measure: Callable[[NDArray, float], NDArray], count: int, open_mesh: bool) -> NDArray:
    """Openness (N,) of the front; of the back where the mesh is open and the front is shut in, for then the back is seen.

    Args:
        measure: openness of some rows (K,) on a side, 1 the front or -1 the back.
    """
    value = measure(np.arange(count), 1.0)
    if open_mesh:
        shut = np.flatnonzero(value < SHUT)
        value[shut] = measure(shut, -1.0)
    return value


def lookouts_of(scene: Scene, surface: Surface, side: float) -> Lookouts:
    """Where texels look out from. Args: surface: (N,). side: 1 for the front, -1 for the back."""
    weights = np.c_[surface.barycentric, 1 - surface.barycentric.sum(1)]
    return Lookouts.of(scene, surface.triangle, weights, side)


def _average(
    place: NDArray, value: NDArray, asked: NDArray, owner: NDArray, rays: int, result: NDArray
) -> NDArray[np.bool_]:
    """Write the means of some texels into `result`.

    Args:
        place: (N, 6). value: (N,) NaN where there is no sample. asked, owner: (K,) texels and a sample near each.
    Returns:
        (K,) whether a texel needs samples nearer to it.
    """
    sample = np.flatnonzero(~np.isnan(value))
    tree = cKDTree(place[sample], balanced_tree=False, compact_nodes=False)
    owners, of_texel = np.unique(owner, return_inverse=True)
    count = min(NEIGHBOURS, len(sample))
    reach, near = tree.query(place[owners], [*range(1, count + 1)], workers=cores())
    reach, near = reach[:, -1].astype(np.float32), sample[near]
    unsure = np.zeros(len(asked), bool)
    limits = UNEVEN / rays**0.5, ALIKE / rays**0.5

    def part(start: int) -> None:
        rows = slice(start, start + TASK)
        _means(place, value, asked[rows], owner[rows], of_texel[rows], reach, near, limits, result, unsure[rows])

    in_parallel(part, range(0, len(asked), TASK))
    return unsure


@compiled
def _means(place, value, asked, owner, row, reach, near, limits, result, unsure):  # type: ignore[no-untyped-def]
    """reach: (S,) distance of the last of each owner's neighbours. near: (S, K). row: (T,) of these for each texel."""
    uneven, alike = limits
    weight = np.empty(near.shape[1])
    for i in range(len(asked)):
        p, s = asked[i], row[i]
        # around the texel, inside the ball around its owner within which all samples are known
        radius = reach[s] - np.sqrt(_squared_distance(place, p, owner[i]))
        total, mean, square = 0.0, 0.0, 0.0
        for k in range(len(weight)):
            j = near[s, k]
            weight[k] = 0.0
            if radius > 0:
                weight[k] = max(1 - _squared_distance(place, p, j) / (radius * radius), 0.0) ** 2
            total += weight[k]
            mean += weight[k] * value[j]
            square += weight[k] * value[j] ** 2
        if total > 0:
            mean, square = mean / total, square / total
        result[p] = mean
        if total >= FEW and square - mean * mean <= uneven * uneven:
            continue
        if np.isnan(value[p]):
            unsure[i] = True
            continue
        total, mean = 0.0, 0.0
        for k in range(len(weight)):
            v = value[near[s, k]]
            w = weight[k] * max(1 - ((v - value[p]) / alike) ** 2, 0.0) ** 2
            total += w
            mean += w * v
        result[p] = mean / total if total > 0 else value[p]


@compiled
def _squared_distance(place, a, b):  # type: ignore[no-untyped-def]
    total = 0.0
    for d in range(place.shape[1]):
        total += (place[a, d] - place[b, d]) ** 2
    return total
