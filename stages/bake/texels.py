"""The material of every texel: the recipe's mean over the samples inside it that lie on a chart, and what was learnt there.

Samples on its diagonal are enough where a texel is like its neighbours; where a border runs between them there are more. Each
is evaluated at its own point in space, so a texel on a chart's rim holds nothing from outside. A texel that a chart touches
without covering any of its samples takes the surface point nearest to its centre. The residual is as
smooth as the views were coarse: it is looked up once a texel. """

import numpy as np
from numpy.typing import NDArray

from stages.bake.evaluate import evaluate as evaluate_residual
from stages.bake.raster import Layout, Surface, bands, covered_samples
from stages.bake.visibility import Patches
from stages.core.parallel import compiled, in_parallel
from stages.core.progress import Progress
from stages.material import surface as material_surface
from stages.material.evaluate import COLUMNS, evaluate
from stages.material.learnt import LearntMaterial
from stages.material.uneven import patterns, uneven

TASKS = 8
"""Bands between two reports of progress."""

SAMPLES = 1 << 15
"""Evaluated together: what they need stays in a core's cache."""


class Texels:
    """A material on the surface that a UV layout shows.

    Args:
        corners, normals: (F, 3, 3) world positions and normals of the triangles' corners. label: (F,) of the parts. touched: of
        `touched_texels`.
    """

    def __init__(
        self, made: LearntMaterial, corners: NDArray[np.float32], normals: NDArray[np.float32], label: NDArray[np.int32],
        layout: Layout, touched: Surface,
    ) -> None:  # fmt: skip
        self._made, self._corners, self._normals, self._label = made, corners, normals, label
        self._layout, self._touched = layout, touched
        self._texel = texel_size(corners, layout)
        shown = np.unique(layout.face)
        centre, mean = corners[shown].mean(1), normals[shown].mean(1)
        self._piece = np.zeros(len(corners), np.int32)  # (F,), of those that the layout shows
        self._piece[shown] = made.lookup.surface(centre, mean, self._texel[shown]).piece

    def residual(self) -> NDArray[np.float32]:
        """What was learnt at every texel that a chart touches, row by row: (N, 5) logits."""
        points = self._touched.where(self._touched.triangle >= 0).interpolate(self._corners)
        return evaluate_residual(self._made.residual, points)

    def recipe(self, supersample: int, groups: Patches, progress: Progress) -> NDArray[np.float32]:
        """The recipe's material of every texel that a chart touches: (size, size, 6), see `COLUMNS`; 0 off the charts.

        Args:
            supersample: N samples on the diagonal of each texel; N x N in those that differ much from their neighbours
            (`uneven`). groups: of `patches`.
        """
        size, features = self._layout.size, self._features(groups)
        on_chart = self._touched.triangle >= 0
        maps, counts = np.zeros((size, size, COLUMNS), np.float32), np.zeros((size, size), np.int32)
        first, others = patterns(supersample)
        self._sample(first, on_chart, features, maps, counts, progress)
        bare = on_chart & (counts == 0)
        maps[bare] = self._evaluate(self._touched.where(bare), 1, features, np.flatnonzero(bare))
        if others.any():
            self._sample(others, uneven(maps, on_chart), features, maps, counts, progress)
        return maps

    def _sample(  # type: ignore[no-untyped-def]
        self, pattern: NDArray[np.bool_], chosen: NDArray[np.bool_], features, maps: NDArray[np.float32],
        counts: NDArray[np.int32], progress: Progress,
    ) -> None:  # fmt: skip
        """Let samples of a pattern in each chosen texel (size, size) that lie on a chart count in its mean, and count them."""
        supersample = len(pattern)
        todo = [rows for rows in bands(len(chosen)) if chosen[rows.start : rows.stop].any()]

        def bake_band(rows: range) -> None:
            band = slice(rows.start, rows.stop)
            wanted = np.kron(chosen[band], pattern)
            samples = covered_samples(self._layout, supersample, rows)
            covered = wanted & (samples.triangle >= 0)
            row, column = (k // supersample for k in np.nonzero(covered))
            values = self._evaluate(samples.where(covered), supersample, features, (rows.start + row) * len(maps) + column)
            _count_in(covered, values, supersample, maps[band], counts[band])

        for first in range(0, len(todo), TASKS):
            progress("texels", first, len(todo))
            in_parallel(bake_band, todo[first : first + TASKS])
        progress("texels", len(todo), len(todo))

    def _features(self, groups: Patches) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
        """Convexity and occlusion of each texel, flat; None where the recipe asks for neither."""
        if not self._made.recipe.follows_surface:
            return None
        on_chart = self._touched.triangle >= 0
        some = self._touched.where(on_chart)
        point, normal = some.interpolate(self._corners), some.interpolate(self._normals)
        features = np.zeros((2, on_chart.size), np.float32)
        features[:, on_chart.ravel()] = self._made.lookup.shared(point, normal, groups.first, groups.of_texel)
        return features[0], features[1]

    def _evaluate(self, samples: Surface, supersample: int, features, texel) -> NDArray[np.float32]:  # type: ignore[no-untyped-def]
        """Recipe at samples on charts, (N, 6). Args: features: of `_features`; texel: (N,) of each sample among them."""
        result = np.empty((len(samples.triangle), COLUMNS), np.float32)
        for start in range(0, len(result), SAMPLES):
            rows = slice(start, start + SAMPLES)
            some = Surface(samples.triangle[rows], samples.barycentric[rows])
            footprint = self._texel[some.triangle] / np.float32(supersample)
            zero = np.zeros(len(footprint), np.float32)
            convexity, occlusion = (zero, zero) if features is None else (f[texel[rows]] for f in features)
            point, normal = some.interpolate(self._corners), some.interpolate(self._normals)
            piece, label = self._piece[some.triangle], self._label[some.triangle]
            surface = material_surface.Surface(point, normal, footprint, convexity, occlusion, piece, label)
            result[rows] = evaluate(self._made.recipe, surface, self._made.lookup.survey.pieces)
        return result


def texel_size(corners: NDArray[np.float32], layout: Layout) -> NDArray[np.float32]:
    """Edge of a texel on each triangle, world units, (F,): the root of its area by its area in texels."""
    a, b = (corners[:, k].astype(np.float64) - corners[:, 0] for k in (1, 2))
    area = np.linalg.norm(np.cross(a, b), axis=1)
    p, q = (layout.uv[:, k] - layout.uv[:, 0] for k in (1, 2))
    texels = abs(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
    known = (texels > 1e-6) & (area > 0)
    size = np.sqrt(area / np.where(known, texels, 1))
    usual = float(np.sqrt(area[known].sum() / texels[known].sum())) if known.any() else 1 / layout.size
    return np.where(known, np.clip(size, usual / 16, usual * 16), usual).astype(np.float32)


@compiled
def _count_in(covered, values, supersample, maps, counts):  # type: ignore[no-untyped-def]
    """Let covered samples count in the mean of their texel. values: (N, C), row by row. counts: of those that are in it."""
    taken = 0
    for i in range(covered.shape[0]):
        for j in range(covered.shape[1]):
            if covered[i, j]:
                k, m = i // supersample, j // supersample
                counts[k, m] += 1
                share = np.float32(1) / np.float32(counts[k, m])
                for c in range(values.shape[1]):
                    maps[k, m, c] += (values[taken, c] - maps[k, m, c]) * share
                taken += 1
