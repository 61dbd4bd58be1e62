"""Vertices as renderers want them: one normal, UV and tangent each.

A vertex whose corners differ in any of these is split: the first kind met, in the order of the loops, keeps the
source's index, the others are appended.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled


@dataclass(frozen=True)
class VertexTable:
    """A run of vertices that some parts share.

    source: (N,) source vertex of each. loop: (N,) the first loop that uses it, or -1. of_loop: (L,) vertex of each loop
    of those parts.
    """

    source: NDArray[np.int64]
    loop: NDArray[np.int64]
    of_loop: NDArray[np.int64]

    def values(self, per_loop: NDArray[np.float32], unused: NDArray | float) -> NDArray[np.float32]:
        """An attribute of each vertex. Args: per_loop (L, D). unused: (D,) or a number, where no face uses it."""
        result = np.empty((len(self.loop), per_loop.shape[1]), np.float32)
        result[:] = unused
        result[self.loop >= 0] = per_loop[self.loop[self.loop >= 0]]
        return result


def split_vertices(vertex: NDArray, loops: NDArray, attributes: list[NDArray], start: int, stop: int) -> VertexTable:
    """Split source vertices start … stop - 1 by the attributes of the loops that use them, bit by bit.

    Args:
        vertex: (L,) source vertex of each loop. loops: those to look at, ascending. attributes: (L, D) float32 each.
    """
    bits = np.concatenate([np.ascontiguousarray(values, np.float32).view(np.uint32) for values in attributes], 1)
    of_loop, first = np.full(len(vertex), -1, np.int64), np.full(stop - start + len(loops), -1, np.int64)
    total = _split(vertex.astype(np.int64) - start, loops, bits, stop - start, of_loop, first)
    first = first[:total]
    source = np.arange(start, start + total)
    source[stop - start :] = vertex[first[stop - start :]]
    return VertexTable(source, first, of_loop)


@compiled
def _differ(bits, a, b):  # type: ignore[no-untyped-def]
    for k in range(bits.shape[1]):  # noqa: SIM110, numba compiles no generators
        if bits[a, k] != bits[b, k]:
            return True
    return False


@compiled
def _split(vertex, loops, bits, count, of_loop, first):  # type: ignore[no-untyped-def]
    """Number the distinct (vertex, bits); first: the first loop of each. Returns: how many there are."""
    following = np.full(len(first), -1, np.int64)  # chain of the entries of one vertex
    total = count
    for loop in loops:
        entry = vertex[loop]
        while first[entry] >= 0 and _differ(bits, first[entry], loop) and following[entry] >= 0:
            entry = following[entry]
        if first[entry] >= 0 and _differ(bits, first[entry], loop):
            following[entry] = total
            entry = total
            total += 1
        if first[entry] < 0:
            first[entry] = loop
        of_loop[loop] = entry
    return total
