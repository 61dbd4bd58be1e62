"""Where a material is asked for: points of a real thing, in metres, and how far apart they are."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Axes = tuple[float, float, float]


def columns(values: NDArray, rows: NDArray | slice) -> NDArray:
    """Some columns of (K, P), each row of the result in one piece, which NumPy's own indexing does not give."""
    return values[:, rows] if isinstance(rows, slice) else np.take(values, rows, 1)


@dataclass(frozen=True)
class Place:
    """Points at which a pattern is evaluated.

    p: (3, P) position in the pattern's own frame, metres; its third axis is up where up matters. uv: (2, P) metres along the
    surface, across and up; see `directions.py`. face: (P,) which of the surface's sides uv belongs to. footprint: (P,) edge
    of the texel or pixel that a point stands for, metres: nothing finer is held. period: metres after which everything
    repeats, by axis; 0 never. seed: of this substance on this thing. bend: (3, P) how far `warped` displaced p, metres, and
    reach: over what length that varies. level: whether p lies along the surface, its third axis only telling faces apart. """

    p: NDArray[np.float32]
    uv: NDArray[np.float32]
    face: NDArray[np.int32]
    footprint: NDArray[np.float32]
    period: Axes = (0.0, 0.0, 0.0)
    seed: int = 0
    bend: NDArray[np.float32] | None = None
    reach: float = 0.0
    level: bool = False

    def __len__(self) -> int:
        return self.p.shape[1]

    def __getitem__(self, rows: NDArray | slice) -> "Place":
        bend = None if self.bend is None else columns(self.bend, rows)
        p, uv, face, footprint = columns(self.p, rows), columns(self.uv, rows), self.face[rows], self.footprint[rows]
        return replace(self, p=p, uv=uv, face=face, footprint=footprint, bend=bend)

    def straight(self, size: float) -> NDArray[np.float32]:
        """Where a structure of this size, metres, is looked up, (3, P): what is finer than a displacement follows it less and
        less. Looked up where the displaced points lie, it would be drawn out into the displacement's contour lines."""
        if self.bend is None or size >= self.reach:
            return self.p
        return self.p - self.bend * np.float32(1 - size / self.reach)

    @property
    def flat(self) -> "Place":
        """The same with the position along the surface in place of that in space: patterns of two dimensions."""
        p = np.concatenate([self.uv, self.face[None] * np.float32(17.31)])
        return replace(self, p=p, period=(self.period[0], self.period[1], 0.0), bend=None, level=True)

    @property
    def upright(self) -> "Place":
        """The same with up as the second axis of p: on things the third, on a flat swatch, which has none, up the picture."""
        if self.period[1]:
            return self
        return self._reordered([0, 2, 1])

    def moved(self, offset: NDArray[np.float32]) -> "Place":
        """The same points displaced. Args: offset (3, P) metres, itself of this place's period."""
        return replace(self, p=self.p + offset)

    def swapped(self) -> "Place":
        """The first two axes exchanged."""
        return replace(self._reordered([1, 0, 2]), uv=self.uv[::-1])

    def _reordered(self, order: list[int]) -> "Place":
        """With the axes of p in another order."""
        period = (self.period[order[0]], self.period[order[1]], self.period[order[2]])
        return replace(self, p=self.p[order], period=period, bend=None if self.bend is None else self.bend[order])

    def seeded(self, number: int) -> "Place":
        """The same place for another draw of every pattern."""
        return replace(self, seed=self.seed * 1_000_003 + number)
