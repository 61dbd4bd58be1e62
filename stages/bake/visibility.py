"""Which surface the views of distillation saw.

Sight is decided once per *patch*: the texels of one chart in one cell of a 512 x 512 grid over the texture, by the
patch's first texel. A border between seen and unseen surface is therefore right to within one cell, size/512 texels,
about the width of a pixel of those views.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.bake.raster import Layout, Surface
from stages.core.frames import project
from stages.core.parallel import in_parallel
from stages.core.tiles import Representatives, signed_area
from stages.light.scene import OFFSET, Scene

GRID = 512
"""Cells along each edge of the texture."""

MIN_COSINE = 0.05
"""Surface seen at a flatter angle than this, 3 degrees, was not seen: a pixel there smears over twenty."""

STREWN, MOST_STREWN = 4, 1 << 20
"""Points for each patch that tell where shared texels are seen elsewhere, and all of them at most."""

RAYS_PER_TASK = 1 << 14


@dataclass(frozen=True)
class Views:
    """Cameras: c2w (N, 4, 4), fov_y (N,) radians, and the width and height of their images in pixels."""

    c2w: NDArray[np.float64]
    fov_y: NDArray[np.float64]
    width: int
    height: int

    def spread_out(self) -> list[int]:
        """All views, each the one farthest from those before it: most surface is seen after a few."""
        positions = self.c2w[:, :3, 3]
        order = [0] if len(positions) else []
        distance = np.full(len(positions), np.inf)
        for _ in range(len(positions) - 1):
            distance = np.minimum(distance, np.linalg.norm(positions - positions[order[-1]], axis=1))
            distance[order] = -1
            order.append(int(distance.argmax()))
        return order


@dataclass(frozen=True)
class Patches:
    """Texels grouped by chart and grid cell.

    key: (K,) chart and cell of each, ascending. first: (K,) index, among the texels on charts row by row, of each patch's first
    texel. of_texel: (N,) patch of each.
    """

    key: NDArray[np.int64]
    first: NDArray[np.int64]
    of_texel: NDArray[np.int64]

    def mean(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Mean of the texels of each patch. Args: values (N, C). Returns: (K, C)."""
        total = [np.bincount(self.of_texel, column) for column in values.T]
        return (np.stack(total, 1) / np.bincount(self.of_texel)[:, None]).astype(np.float32)


def patches(touched: Surface, charts: NDArray[np.int32]) -> Patches:
    """Group the texels on charts. Args: touched: (size, size). charts: (F,) chart of each triangle."""
    size = len(touched.triangle)
    row, column = np.nonzero(touched.triangle >= 0)
    key = _key(charts[touched.triangle[row, column]], row, column, size)
    return Patches(*np.unique(key, return_index=True, return_inverse=True))


def _key(chart: NDArray, row: NDArray, column: NDArray, size: int) -> NDArray[np.int64]:
    """Chart and cell of texels as one number."""
    return chart.astype(np.int64) * GRID**2 + (row * GRID // size) * GRID + column * GRID // size


def seen_elsewhere(
    scene: Scene, layout: Layout, charts: NDArray[np.int32], groups: Patches, views: Views, open_mesh: bool
) -> NDArray[np.bool_]:
    """Patches (K,) whose texels some other place of the surface shows that a view saw, told by points strewn over the UVs."""
    uv = layout.uv / layout.size
    uv[..., 1] = 1 - uv[..., 1]
    area, rng = np.abs(signed_area(uv)), np.random.default_rng(0)
    count = int(min(STREWN * len(groups.key) * max(area.sum(), 1.0), MOST_STREWN))
    face = rng.choice(len(uv), count, p=area / area.sum()).astype(np.int32)
    weights = rng.dirichlet((1, 1, 1), count)
    found, theirs = Representatives(uv, charts, np.zeros(len(uv), np.int32)).of(face, weights)
    place = np.einsum("pk,pkd->pd", theirs, layout.uv[found])
    column, row = np.floor(place % layout.size).astype(np.int64).clip(max=layout.size - 1).T
    key = _key(charts[found], row, column, layout.size)
    patch = np.searchsorted(groups.key, key).clip(max=len(groups.key) - 1)
    other = (groups.key[patch] == key) & (found != face)
    seen = np.zeros(len(groups.key), bool)
    seen[patch[other][seen_points(scene, Surface(face[other], weights[other, :2].astype(np.float32)), views, open_mesh)]] = True
    return seen


def seen_points(scene: Scene, surface: Surface, views: Views, open_mesh: bool) -> NDArray[np.bool_]:
    """Whether any view saw each surface point: inside the image, not edge-on, and nothing between.

    The cameras stand outside of the object, so a ray that meets anything at all meets it before the camera.

    Args:
        surface: (N,) points on charts. open_mesh: whether the back of a triangle can be seen.
    Returns:
        (N,) bool.
    """
    weights = np.c_[surface.barycentric, 1 - surface.barycentric.sum(1)]
    point, ng = scene.point(surface.triangle, weights), scene.geometric_normal(surface.triangle)
    seen = np.zeros(len(point), bool)
    for view in views.spread_out():
        pending = np.flatnonzero(~seen)
        c2w, fov_y = views.c2w[view], float(views.fov_y[view])
        to_camera = (c2w[:3, 3] - point[pending]).astype(np.float32)
        cosine = (ng[pending] * to_camera).sum(1) / np.linalg.norm(to_camera, axis=1)
        facing = (np.abs(cosine) if open_mesh else cosine) >= MIN_COSINE
        xy, depth = project(point[pending], c2w, fov_y, views.width, views.height)
        inside = (depth > 0) & (xy >= 0).all(1) & (xy <= (views.width, views.height)).all(1)
        ask = facing & inside
        origin = point[pending[ask]] + OFFSET * np.sign(cosine[ask, None]) * ng[pending[ask]]
        seen[pending[ask]] = ~_occluded(scene, origin, to_camera[ask])
    return seen


def is_open(triangles: NDArray[np.int32]) -> bool:
    """Whether any edge belongs to one triangle only, so that a view can see behind the surface. Args: (F, 3)."""
    a, b = triangles.astype(np.int64).T.reshape(-1), np.roll(triangles.astype(np.int64), -1, 1).T.reshape(-1)
    edges = np.minimum(a, b) * (int(triangles.max(initial=0)) + 1) + np.maximum(a, b)
    _, uses = np.unique(edges, return_counts=True)
    return bool((uses == 1).any())


def _occluded(scene: Scene, origins: NDArray, directions: NDArray) -> NDArray[np.bool_]:
    parts = [slice(i, i + RAYS_PER_TASK) for i in range(0, len(origins), RAYS_PER_TASK)]
    return np.concatenate([np.zeros(0, bool), *in_parallel(lambda p: scene.hidden(origins[p], directions[p]), parts)])
