"""The material of every texel: the mean over the samples inside it that lie on a chart.

Each sample is evaluated at its own point in space, so a texel on a chart's rim holds nothing from outside. A texel
that a chart touches without covering any of its samples takes the surface point nearest to its centre.
"""

import numpy as np
from numpy.typing import NDArray

from stages.bake.evaluate import evaluate
from stages.bake.raster import Layout, Surface, bands, covered_samples
from stages.core.field import OUTPUTS, MaterialField
from stages.core.parallel import compiled, in_parallel
from stages.core.progress import Progress

TASKS = 8
"""Bands between two reports of progress."""


def bake_texels(
    field: MaterialField,
    corners: NDArray[np.float32],
    layout: Layout,
    touched: Surface,
    supersample: int,
    progress: Progress,
) -> NDArray[np.float32]:
    """Evaluate the field for every texel that a chart touches.

    Args:
        corners: (F, 3, 3) world positions of the triangles' corners. touched: of `touched_texels`.
        supersample: samples along each edge of a texel.
    Returns:
        (size, size, 5) albedo, roughness and metallic; 0 off the charts.
    """
    size = layout.size
    maps, counts = np.zeros((size, size, OUTPUTS), np.float32), np.zeros((size, size), np.int32)
    todo = bands(size)

    def bake_band(rows: range) -> None:
        surface = covered_samples(layout, supersample, rows)
        on_chart = surface.triangle >= 0
        values = evaluate(field, surface.where(on_chart).interpolate(corners))
        _average(on_chart, values, supersample, maps[rows.start : rows.stop], counts[rows.start : rows.stop])

    for first in range(0, len(todo), TASKS):
        progress("texels", first, len(todo))
        in_parallel(bake_band, todo[first : first + TASKS])
    bare = (counts == 0) & (touched.triangle >= 0)
    maps[bare] = evaluate(field, touched.where(bare).interpolate(corners))
    progress("texels", len(todo), len(todo))
    return maps


@compiled
def _average(on_chart, values, supersample, maps, counts):  # type: ignore[no-untyped-def]
    """Mean of the samples of each texel. values: (N, 5) of the samples on a chart, row by row."""
    taken = 0
    for i in range(on_chart.shape[0]):
        for j in range(on_chart.shape[1]):
            if on_chart[i, j]:
                for k in range(values.shape[1]):
                    maps[i // supersample, j // supersample, k] += values[taken, k]
                counts[i // supersample, j // supersample] += 1
                taken += 1
    for i in range(counts.shape[0]):
        for j in range(counts.shape[1]):
            if counts[i, j] > 1:
                for k in range(values.shape[1]):
                    maps[i, j, k] /= counts[i, j]
