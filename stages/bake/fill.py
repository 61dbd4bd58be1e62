"""Texels that have no colour of their own: surface no view saw, and the space between the charts."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from stages.core.parallel import cores

NEIGHBOURS = 8
"""Seen points that an unseen one is mixed from."""

LEAST_AGREEMENT = 1e-3
"""Weight of a seen point that faces another way, against one that faces the same; it decides only alone."""


def fill_unseen(
    seen: tuple[NDArray[np.float32], NDArray[np.float32]],
    values: NDArray[np.float32],
    unseen: tuple[NDArray[np.float32], NDArray[np.float32]],
) -> NDArray[np.float32]:
    """Mix the values of the nearest seen points in space, weighted by nearness and by how the normals agree.

    Space, not UV: the neighbour across a seam is as near as any. The weight falls with the squared distance, so the
    result runs into the seen values at the border.

    Args:
        seen: positions and normals (S, 3), S > 0. values: (S, C) of these. unseen: positions and normals (N, 3).
    Returns:
        (N, C).
    """
    (position, normal), (wanted_position, wanted_normal) = seen, unseen
    count = min(NEIGHBOURS, len(position))
    tree = cKDTree(position, balanced_tree=False, compact_nodes=False)  # far points find their way in a third of the time
    distance, index = tree.query(wanted_position, k=[*range(1, count + 1)], workers=cores())  # (N, K)
    agreement = np.einsum("nkd,nd->nk", normal[index], wanted_normal)
    nearest = np.maximum(distance[:, :1], np.finfo(np.float32).tiny)
    weight = np.maximum(agreement, LEAST_AGREEMENT) * (nearest / np.maximum(distance, nearest)) ** 2
    weight /= weight.sum(1, keepdims=True)
    return np.einsum("nk,nkc->nc", weight.astype(np.float32), values[index])


def pad(on_chart: NDArray[np.bool_], *maps: NDArray[np.float32]) -> None:
    """Give every texel off the charts the values of the nearest texel on one, to the last texel, in place.

    Each chart so owns all texels that are nearer to it than to any other: smaller mip levels mix charts as late
    as the layout allows.

    Args:
        on_chart: (H, W), true somewhere. maps: (H, W) or (H, W, C) each.
    """
    if not on_chart.any():
        return
    row, column = distance_transform_edt(~on_chart, return_distances=False, return_indices=True)
    off = ~on_chart
    for values in maps:
        values[off] = values[row[off], column[off]]
