"""Texels that have no colour of their own: surface no view saw, and the space between the charts."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from stages.core.parallel import compiled, cores, in_parallel, slices

NEIGHBOURS = 8
"""Seen points that an unseen one is mixed from."""

AROUND = 32
"""Seen points among which those of a group each find their nearest."""

TASK = 1 << 14
"""Points of one thread's task."""

LEAST_AGREEMENT = 1e-3
"""Weight of a seen point that faces another way, against one that faces the same; it decides only alone."""


SMALLEST = float(np.finfo(np.float32).tiny)
"""Squared distance of a point that is at a seen one."""


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


def fill_groups(
    seen: tuple[NDArray[np.float32], NDArray[np.float32]],
    values: NDArray[np.float32],
    unseen: tuple[NDArray[np.float32], NDArray[np.float32]],
    first: NDArray[np.int64],
    group: NDArray[np.int64],
) -> NDArray[np.float32]:
    """`fill_unseen` of points so close together that each group of them searches once, for a tenth of its time.

    Args:
        seen, values, unseen: of `fill_unseen`. first: (G,) a point of each group. group: (N,) of each point.
    Returns:
        (N, C).
    """
    position, normal = seen
    count = min(AROUND, len(position))
    tree = cKDTree(position, balanced_tree=False, compact_nodes=False)
    near = tree.query(unseen[0][first], [*range(1, count + 1)], workers=cores())[1]  # (G, AROUND)
    result = np.empty((len(group), values.shape[1]), np.float32)

    def mix(rows: slice) -> None:
        _mix(unseen[0][rows], unseen[1][rows], near, group[rows], position, normal, values, result[rows])

    in_parallel(mix, slices(len(group), TASK))
    return result


@compiled
def _mix(point, facing, near, group, position, normal, values, result):  # type: ignore[no-untyped-def]
    """Each point's mean of its NEIGHBOURS nearest among those of its group. near: (G, AROUND)."""
    least, best = np.empty(NEIGHBOURS), np.empty(NEIGHBOURS, np.int64)
    count = min(NEIGHBOURS, near.shape[1])
    for p in range(len(point)):
        least[:] = np.inf
        for k in near[group[p]]:
            d = 0.0
            for c in range(3):
                d += (np.float64(position[k, c]) - np.float64(point[p, c])) ** 2
            for m in range(count):  # kept in order
                if d < least[m]:
                    least[m], d = d, least[m]
                    best[m], k = k, best[m]
        total, nearest = 0.0, max(least[0], SMALLEST)
        result[p] = 0
        for m in range(count):
            agree = 0.0
            for c in range(3):
                agree += normal[best[m], c] * facing[p, c]
            weight = max(agree, LEAST_AGREEMENT) * nearest / max(least[m], nearest)
            total += weight
            for c in range(values.shape[1]):
                result[p, c] += weight * values[best[m], c]
        for c in range(values.shape[1]):
            result[p, c] /= total


@dataclass(frozen=True)
class Nearest:
    """For each texel off the charts, row by row, the nearest texel on one.

    Each chart so owns all texels that are nearer to it than to any other: smaller mip levels mix charts as late
    as the layout allows.

    off: (H, W) bool. row, column: (N,) of the nearest.
    """

    off: NDArray[np.bool_]
    row: NDArray[np.int32]
    column: NDArray[np.int32]

    @staticmethod
    def of(on_chart: NDArray[np.bool_]) -> "Nearest":
        """Args: (H, W), true somewhere."""
        off = ~on_chart
        row, column = distance_transform_edt(off, return_distances=False, return_indices=True)
        return Nearest(off, row[off], column[off])

    def pad(self, *maps: NDArray[np.float32]) -> None:
        """Copy the nearest texel's values, to the last texel, in place. Args: maps: (H, W) or (H, W, C) each."""
        for values in maps:
            values[self.off] = values[self.row, self.column]


def pad(on_chart: NDArray[np.bool_], *maps: NDArray[np.float32]) -> None:
    """Give every texel off the charts what `Nearest` does, in place. Args: on_chart: (H, W). maps: (H, W) or (H, W, C) each."""
    if on_chart.any():
        Nearest.of(on_chart).pad(*maps)
