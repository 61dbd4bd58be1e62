"""A surface in cells: small patches, each with two sides, that stand for what other points of the object see of it.

Large triangles are cut in equal parts; small ones are gathered by the cube of space in which they lie and by where they face,
so that there are more cells where there is detail. Cell c has the sides 2 c, seen from where its triangles wind
counter-clockwise, and 2 c + 1, seen from behind: what is thin has a light of its own on either side.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled
from stages.light.gbuffer import GBuffer, surface_points
from stages.light.scene import Hits, Scene

CELLS = 6_000
"""Cells that the surface's area is divided into; detail adds to them."""

MOST = 12_000
"""Cells at most; the number of a side must fit in 16 bits, of which the last few are spared."""

LONGEST = 4.0
"""A triangle longer than this many cells is cut, however narrow it is."""

BOLDER = 1.25
"""Growth of the cells' width while there are too many."""


@dataclass(frozen=True)
class Cells:
    """C cells of F triangles. first: (F,) a triangle's first cell. cuts: (F,) parts along each of its edges: cuts² cells.

    triangle, barycentric: (C,), (C, 3), the point that stands for a cell. width: world units.
    """

    first: NDArray[np.int32]
    cuts: NDArray[np.int32]
    triangle: NDArray[np.int32]
    barycentric: NDArray[np.float32]
    width: float

    @staticmethod
    def of(scene: Scene, count: int = CELLS) -> "Cells":
        """The cells of a scene's mesh, `count` by its area, and more for its detail."""
        corners = scene.vertices[scene.triangles].astype(np.float64)
        edges = np.roll(corners, -1, 1) - corners
        area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=-1) / 2
        longest = np.linalg.norm(edges, axis=-1).max(1)
        width = max(float(np.sqrt(area.sum() / count)), 1e-6)
        while True:
            cuts = np.ceil(np.maximum(np.sqrt(2 * area) / width, longest / (LONGEST * width))).astype(np.int64)
            cuts = np.where(area > 0, np.maximum(cuts, 1), 1)
            whole = cuts == 1
            gathered = _gathered(corners[whole].mean(1), scene.geometric_normal(np.flatnonzero(whole)), width)
            groups = int(gathered.max(initial=-1)) + 1
            if groups + int((cuts[~whole] ** 2).sum()) <= MOST:
                return _numbered(cuts, gathered, groups, area, width)
            width *= BOLDER

    def __len__(self) -> int:
        return len(self.triangle)

    def sides(self, scene: Scene) -> GBuffer:
        """The points of all sides, each seen from straight above: 2 C, in rows of eight."""
        count = 2 * len(self)
        triangle, barycentric = self.triangle.repeat(2), self.barycentric.repeat(2, 0)
        above = scene.geometric_normal(triangle) * np.tile([1, -1], len(self)).astype(np.float32)[:, None]
        mask = np.arange(8 * -(-count // 8)).reshape(8, -1) < count  # neighbours' samples complement each other
        hits = Hits(np.ones(count, np.bool_), np.ones(count, np.float32), triangle, barycentric)
        return surface_points(scene, hits, -above, mask)


def _gathered(centre: NDArray, normal: NDArray, width: float) -> NDArray[np.int64]:
    """Group of each small triangle: those in one cube that face alike, to an axis or between two or three."""
    place = np.floor(centre / width).astype(np.int64) + (1 << 17)
    facing = np.rint(normal * 1.2).astype(np.int64) + 1
    key = (place[:, 0] << 36) + (place[:, 1] << 18) + place[:, 2]
    _, group = np.unique(key * 27 + facing @ np.array([9, 3, 1]), return_inverse=True)
    return group.reshape(-1)


def _numbered(cuts: NDArray, gathered: NDArray, groups: int, area: NDArray, width: float) -> Cells:
    """Cells of groups first, each stood for by its largest triangle, then those of cut triangles."""
    whole, cut = np.flatnonzero(cuts == 1), np.flatnonzero(cuts > 1)
    first = np.zeros(len(cuts), np.int64)
    first[whole] = gathered
    first[cut] = groups + np.cumsum(cuts[cut] ** 2) - cuts[cut] ** 2
    order = np.lexsort((whole, -area[whole], gathered))
    largest = whole[order[np.unique(gathered[order], return_index=True)[1]]]
    parts = cut.repeat(cuts[cut] ** 2)
    number = np.arange(len(parts)) - (first[parts] - groups)
    triangle = np.concatenate([largest, parts]).astype(np.int32)
    middle = np.full((groups, 3), 1 / 3, np.float32)
    return Cells(
        first.astype(np.int32),
        cuts.astype(np.int32),
        triangle,
        np.concatenate([middle, _part_middles(number, cuts[parts])]).astype(np.float32),
        width,
    )


def _part_middles(number: NDArray, cuts: NDArray) -> NDArray[np.float64]:
    """Barycentric coordinates of the middle of a part of a triangle, as `part_of` numbers them."""
    row = np.floor(np.sqrt(number + 0.5)).astype(np.int64)  # row r holds 2 r + 1 parts, every second upside down
    place = number - row * row
    down = place % 2
    b0 = (cuts - 1 - row + (1 + down) / 3) / cuts
    b2 = (place // 2 + (1 + down) / 3) / cuts
    return np.stack([b0, 1 - b0 - b2, b2], -1)


@compiled(inline="always")
def part_of(cuts, b0, b2):  # type: ignore[no-untyped-def]
    """Which of the cuts² parts of a triangle a point lies in. Args: its first and third barycentric coordinate."""
    row = min(max(int((1 - b0) * cuts), 0), cuts - 1)
    up = min(max(int(b2 * cuts), 0), row)
    b1 = max(1 - b0 - b2, 0.0)
    other = min(max(int(b1 * cuts), 0), row)
    return row * row + 2 * up + (1 if up + other < row else 0)
