"""Points of a surface, with what a material may follow: edges and creases, what is hidden, pieces and their directions."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
"""float32, or what it was mixed with."""


@dataclass(frozen=True)
class Surface:
    """Points at which a material is asked for, in the world: the object's longest edge is 1, z is up.

    point, normal: (P, 3). footprint: (P,) edge of the texel or pixel that each stands for. convexity: (P,) −1 in a crease … 1
    on an edge. occlusion: (P,) share of the sky that the object hides. piece: (P,) int32, row of the survey's pieces. label:
    (P,) int32, of the parts that each belongs to. """

    point: Array
    normal: Array
    footprint: Array
    convexity: Array
    occlusion: Array
    piece: NDArray[np.int32]
    label: NDArray[np.int32]

    def __len__(self) -> int:
        return len(self.point)

    def __getitem__(self, rows: NDArray | slice) -> "Surface":
        return Surface(*(getattr(self, f.name)[rows] for f in fields(self)))

    @staticmethod
    def bare(point: Array, normal: Array, footprint: Array | float) -> "Surface":
        """Of a surface of which nothing more is known: one open, even piece."""
        count = len(point)
        size = np.broadcast_to(np.float32(footprint), count)
        zero, none = np.zeros(count, np.float32), np.zeros(count, np.int32)
        return Surface(point, normal, size, zero, zero, none, none)
