"""New UVs: charts by xatlas within a time limit, or by direction; checked, mended, and packed with gutters.

Whatever made the charts, three things hold of the result: no chart covers itself, triangles of one source polygon
share a chart, and charts stand two paddings apart.
"""

import subprocess
import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.prep import charts, xatlas_worker
from stages.prep.merge import merge
from stages.prep.normals import face_normals
from stages.prep.overlap import overlapping
from stages.prep.pack import Packing, affordable_padding, pack
from stages.prep.stitch import stitch
from stages.prep.topology import face_components, renumber
from stages.prep.uv import signed_area, stretch, uv_vertices

_POOR = 0.2  # share of the texture that charts fill, below which the other way of making charts is tried too
_ROUNDS = 24  # of splitting charts that cover themselves


@dataclass(frozen=True)
class Layout:
    """chart: (F,) from 0. method: what made the charts. packing: UVs, scale and gutter. stretch: of the surface, 1 at best."""

    chart: NDArray[np.int32]
    method: str
    packing: Packing
    stretch: float

    @property
    def uv(self) -> NDArray[np.float32]:
        """(F, 3, 2)."""
        return self.packing.uv


def unwrap(
    vertices: NDArray, triangles: NDArray, polygon: NDArray, texture_size: int, padding: int | None, seconds: float
) -> Layout:
    """UVs for a mesh that has none.

    Args:
        vertices: (V, 3) world. triangles: (F, 3). polygon: (F,) source face of each. texture_size, padding: texels; None: as
            wide as costs little. seconds: what xatlas may take; 0 does without it.
    """
    polygon = renumber(polygon)
    made, method = run_xatlas(vertices, triangles, seconds) if seconds > 0 else (None, "projection: the mesh is large")
    if made is not None:
        flat, chart = _whole_polygons(vertices, triangles, polygon, *made)
        flat = _to_scale(vertices[triangles], flat, chart)
        padding = affordable_padding(flat, chart, texture_size) if padding is None else padding
        layout = _lay_out(vertices, triangles, polygon, flat, chart, texture_size, padding, method)
        if np.abs(signed_area(layout.uv)).sum() > _POOR:
            return layout
    chart = charts.grow(vertices, triangles, polygon)
    flat = charts.project(vertices, triangles, chart)
    padding = affordable_padding(flat, chart, texture_size) if padding is None else padding
    if made is None:
        return _lay_out(vertices, triangles, polygon, flat, chart, texture_size, padding, method)
    method = "projection: denser than xatlas's many charts"
    other = _lay_out(vertices, triangles, polygon, flat, chart, texture_size, padding, method)
    return max(layout, other, key=_merit)


def _lay_out(
    vertices: NDArray, triangles: NDArray, polygon: NDArray, flat: NDArray, chart: NDArray,
    texture_size: int, padding: int, method: str,
) -> Layout:  # fmt: skip
    """Mend charts, join neighbours unless that packs worse, and pack."""

    def packed(flat: NDArray, chart: NDArray) -> Layout:
        packing = pack(flat, triangles, chart, texture_size, padding)
        return Layout(chart, method, packing, stretch(vertices[triangles], packing.uv))

    flat, chart = _mend(vertices, triangles, polygon, flat, chart)
    apart = packed(flat, chart)
    flat, chart = merge(vertices, triangles, flat, chart, texture_size, padding)
    joined = packed(*stitch(flat, triangles, chart, texture_size, padding))
    return max(joined, apart, key=_merit)


def _merit(layout: Layout) -> tuple[int, float]:
    """What makes one layout better than another: the gutter asked for, then texels where the texture is stretched."""
    return layout.packing.gutter, layout.packing.texels_per_unit / layout.stretch


def run_xatlas(
    vertices: NDArray, triangles: NDArray, seconds: float, sheet: tuple[int, int] = (256, 0)
) -> tuple[tuple[NDArray, NDArray] | None, str]:
    """Charts by xatlas in a process of its own: ((F, 3, 2) in units of length, (F,) chart or -1) or None, and how.

    Args:
        sheet: width and padding, texels, of xatlas's own packing, which costs next to nothing at the default.
    """
    header = np.array([len(vertices), len(triangles)], np.int64)
    request = header.tobytes() + vertices.astype(np.float32).tobytes() + triangles.astype(np.uint32).tobytes()
    command = [sys.executable, xatlas_worker.__file__, *map(str, sheet)]
    try:
        answer = subprocess.run(command, input=request, timeout=seconds, check=True, capture_output=True).stdout
    except subprocess.TimeoutExpired:
        return None, f"projection: xatlas took more than {seconds:g} s"
    except (subprocess.CalledProcessError, OSError):
        return None, "projection: xatlas failed"
    corners = 6 * len(triangles)
    if len(answer) != 4 * (corners + len(triangles)):
        return None, "projection: xatlas failed"
    flat = np.frombuffer(answer, np.float32, corners).astype(np.float64).reshape(-1, 3, 2)
    return (flat, np.frombuffer(answer, np.int32, offset=4 * corners)), "xatlas"


def _to_scale(corners: NDArray, flat: NDArray, chart: NDArray) -> NDArray[np.float64]:
    """Charts stretched in x and y so that edges have their length in space, as nearly as each chart allows.

    xatlas rounds a chart's width and height to whole texels of its own. Least squares of dx^2 a + dy^2 b = length^2.
    """
    space, plane = ((np.roll(points, -1, 1) - points) ** 2 for points in (corners, flat))
    length, dx, dy = space.sum(-1), plane[..., 0], plane[..., 1]
    xx, xy, yy, xl, yl = (
        np.bincount(chart, term.sum(1)) for term in (dx * dx, dx * dy, dy * dy, dx * length, dy * length)
    )
    determinant = xx * yy - xy * xy
    solvable = determinant > 1e-6 * xx * yy
    safe = np.where(solvable, determinant, 1.0)
    a, b = (xl * yy - yl * xy) / safe, (yl * xx - xl * xy) / safe
    solvable &= (a > 0.25) & (a < 4) & (b > 0.25) & (b < 4)
    stretch = np.where(solvable[:, None], np.sqrt(np.where(solvable[:, None], np.stack([a, b], -1), 1.0)), 1.0)
    return flat * stretch[chart][:, None]


def _whole_polygons(
    vertices: NDArray, triangles: NDArray, polygon: NDArray, flat: NDArray, chart: NDArray
) -> tuple[NDArray, NDArray]:
    """Polygons that lie in several charts, or in none, or have lost their area, become charts of their own."""
    count = int(polygon.max()) + 1
    low, high = np.full(count, chart.max() + 1), np.full(count, -1)
    np.minimum.at(low, polygon, chart)
    np.maximum.at(high, polygon, chart)
    broken = (low != high) | (low < 0)
    lost = ~np.isfinite(flat).all((1, 2)) | (signed_area(np.nan_to_num(flat)) == 0)
    broken[polygon[lost]] = True
    own = broken[polygon]
    chart = np.where(own, int(chart.max()) + 1 + polygon, chart)
    chart = renumber(chart)
    flat = np.where(own[:, None, None], charts.project(vertices, triangles, chart), flat)
    return flat, chart


def _mend(
    vertices: NDArray, triangles: NDArray, polygon: NDArray, flat: NDArray, chart: NDArray
) -> tuple[NDArray, NDArray]:
    """Split charts that cover themselves or turn faces over, and project the pieces, until none can be split."""
    flat, chart = flat.copy(), renumber(chart)
    rows = np.arange(len(chart))
    for _ in range(_ROUNDS):
        own = renumber(chart[rows])
        bad = overlapping(flat[rows], own)
        bad[own[_turned_over(flat[rows], own)]] = True
        rows = rows[bad[own]]
        if not len(rows):
            break
        own = renumber(chart[rows])
        pieces = _split(vertices, triangles[rows], polygon[rows], own, _turned_over(flat[rows], own))
        flat[rows] = charts.project(vertices, triangles[rows], pieces)
        chart[rows] = int(chart.max()) + 1 + pieces
    return flat, renumber(chart)


def _turned_over(flat: NDArray, chart: NDArray) -> NDArray[np.bool_]:
    """(F,) faces that lie the other way up than their chart."""
    area = signed_area(flat)
    return area * np.bincount(chart, area)[chart] <= 0


def _split(vertices: NDArray, triangles: NDArray, polygon: NDArray, chart: NDArray, over: NDArray) -> NDArray[np.int32]:
    """Each chart cut in two: faces turned over from the others, or else where polygons differ most in place and
    direction. Pieces hang together."""
    normal, area = face_normals(vertices, triangles)
    order = np.argsort(chart, kind="stable")
    second = np.zeros(len(chart), np.int64)
    for faces in np.split(order, np.searchsorted(chart[order], np.arange(1, int(chart.max()) + 1))):
        second[faces] = np.isin(polygon[faces], polygon[faces[over[faces]]])
        if second[faces].any() and not second[faces].all():
            continue
        place = vertices[triangles[faces]].mean(1)
        features = np.concatenate([place, normal[faces] * np.linalg.norm(np.ptp(place, axis=0))], -1)
        _, member = np.unique(polygon[faces], return_inverse=True)
        weight = np.bincount(member, area[faces])
        features = np.stack([np.bincount(member, area[faces] * column) / weight for column in features.T], -1)
        features -= np.average(features, axis=0, weights=weight)
        along = features @ np.linalg.svd(features * weight[:, None] ** 0.5, full_matrices=False)[2][0]
        second[faces] = (along > 0)[member]
    sides = np.broadcast_to((2 * chart + second)[:, None, None], (len(chart), 3, 2))
    return face_components(uv_vertices(triangles, sides))  # a vertex on both sides counts as two
