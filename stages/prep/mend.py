"""Charts of their own, in free space of a layout that is kept, for the faces to which it gives no texels."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from stages.core.tiles import drawn, flat
from stages.prep.normals import face_normals
from stages.prep.topology import renumber
from stages.prep.unwrap import unwrap
from stages.prep.uv import covered, signed_area

CELLS = 512
"""Along an edge of the grid on which free space is sought."""

LEAST = 4
"""Cells along an edge of a free square that is worth using."""


def mended(vertices: NDArray, triangles: NDArray, polygon: NDArray, uv: NDArray[np.float32]) -> NDArray[np.float32] | None:
    """UVs (F, 3, 2) in which the polygons without texels have charts in the largest free square; None where none is free.

    The square is used as far as gives these faces the texel density of the others.

    Args:
        vertices: (V, 3). triangles: (F, 3). polygon: (F,) source face of each. uv: (F, 3, 2), NaN where missing.
    """
    lost = ~np.isfinite(uv).all((1, 2)) | flat(np.nan_to_num(uv))
    lost = np.isin(polygon, polygon[lost])
    if not lost.any():
        return uv
    area = face_normals(vertices, triangles)[1]
    density = np.sqrt(np.abs(signed_area(uv[~lost])).sum() / area[~lost].sum())
    row, column, edge = free_square(uv[~lost])
    if edge < LEAST:
        return None
    layout = unwrap(vertices, triangles[lost], renumber(polygon[lost]), CELLS, 4, 0.0)
    own = np.sqrt(np.abs(signed_area(layout.uv)).sum() / area[lost].sum())
    scale = min(edge / CELLS, density / own)
    result = uv.copy()
    result[lost] = layout.uv * scale + np.array([column, row]) / CELLS
    return result


def free_square(uv: NDArray[np.float32]) -> tuple[int, int, int]:
    """Row, column and edge, in cells, of the largest square that no triangle (F, 3, 2) comes near; rows go up."""
    fine = covered(drawn(uv, np.zeros(len(uv), np.int32)).corners) > 0
    step = len(fine) // CELLS
    taken = binary_dilation(fine.reshape(CELLS, step, CELLS, step).any((1, 3)), np.ones((3, 3)))
    edge = np.zeros((CELLS + 1, CELLS + 1), np.int64)  # of the largest free square that ends at each cell
    for row in range(CELLS):
        above, corner = edge[row, 1:], edge[row, :-1]
        least = np.where(taken[row], 0, np.minimum(above, corner) + 1)
        for column in np.flatnonzero(least):
            edge[row + 1, column + 1] = min(least[column], edge[row + 1, column] + 1)
    last, size = int(edge.argmax()), int(edge.max())
    return last // (CELLS + 1) - size, last % (CELLS + 1) - size, size
