"""A surface in cells: small patches, each with two sides, that stand for what other points of the object see of it.

Large triangles are cut in equal parts; small ones are gathered by the cube of space in which they lie and by where they face,
so that there are more cells where there is detail. Cell c has the sides 2 c, seen from where its triangles wind
counter-clockwise, and 2 c + 1, seen from behind: what is thin has a light of its own on either side.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core.brdf import sample_cosine
from stages.core.frames import tangent_frame
from stages.core.parallel import compiled
from stages.light.gbuffer import GBuffer, surface_points
from stages.light.scene import OFFSET, Hits, Scene
from stages.light.transport_kernels import GOLDEN

CELLS = 6_000
"""Cells that the surface's area is divided into; detail adds to them."""

MOST = 12_000
"""Cells at most; the number of a side must fit in 16 bits, of which the last few are spared."""

LONGEST = 4.0
"""A triangle longer than this many cells is cut, however narrow it is."""

PROBES = 8
"""Rays by which a point is found to lie open, or to be seen."""

PLACES = np.array([[5, 5], [11, 2], [2, 11], [2, 2], [7, 7], [1, 7], [7, 1], [13, 1], [1, 13], [1, 1]]) / 15
"""Points of a triangle, first and third barycentric coordinate: its middle, and more where that is not like the others."""

FEW = 4
"""Points of a cell by which it is judged whether all of it lies alike."""

SEEN = 0.75
"""Share of a point's rays that must show that it is seen from somewhere, for it to stand for its cell."""

TYPICAL = 0.25
"""Share of its rays by which a point may lie more or less open than its cell does on average, and stand for it."""

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
                away = _from_middle(corners[whole].mean(1), area[whole], gathered)
                return _numbered(scene, cuts, gathered, groups, away, width)
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


def probes(normal: NDArray) -> NDArray[np.float32]:
    """Directions spread by the cosine: (PROBES, P, 3). Args: (P, 3)."""
    t, b = tangent_frame(normal)
    along = (sample_cosine((k + 0.5) / PROBES, (k * GOLDEN) % 1) for k in range(PROBES))
    return np.stack([x * t + y * b + z * normal for x, y, z in along]).astype(np.float32)


def _looked(scene: Scene, triangle: NDArray, barycentric: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Of the rays of some points, on both sides, those that end on nothing, a share of each side's: (P,). And by how many the
    point is seen: those that end on nothing or on the front of a triangle, a share of the better side's: (P,).

    Within what is closed, as where one piece stands in another, all end on backs.
    """
    point, opened, seen = scene.point(triangle, barycentric), *np.zeros((2, len(triangle)))
    for side in (1, -1):
        normal = scene.geometric_normal(triangle) * np.float32(side)
        along = probes(normal).reshape(-1, 3)
        hits = scene.intersect(np.tile(point + np.float32(OFFSET) * normal, (PROBES, 1)), along)
        shown = ~hits.mask | ((scene.geometric_normal(hits.triangle) * along).sum(-1) < 0)
        opened += (~hits.mask).reshape(PROBES, -1).mean(0)
        seen = np.maximum(seen, shown.reshape(PROBES, -1).mean(0))
    return opened, seen


def _most_like(scene: Scene, triangle: NDArray, barycentric: NDArray) -> tuple[NDArray, NDArray]:
    """Of K points of each of C cells one that lies as open as those that are seen do on average: (C,), (C, 3).

    The first, unless it is far from that, as one is that stands in a crease or within another piece. Where the first FEW are
    alike, no more are asked. Args: (K, C), (K, C, 3).
    """
    best = np.zeros(triangle.shape[1], np.int64)
    off, seen = _off_average(scene, triangle[:FEW], barycentric[:FEW])
    again = np.flatnonzero((seen < SEEN).any(0) | (off > TYPICAL).any(0))
    off, _ = _off_average(scene, triangle[:, again], barycentric[:, again])
    best[again] = np.where(off[0] < TYPICAL, 0, off.argmin(0))
    cell = np.arange(len(best))
    return triangle[best, cell], barycentric[best, cell]


def _off_average(scene: Scene, triangle: NDArray, barycentric: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How much more or less open points lie than those of their cell that are seen, infinitely where they are not; and seen."""
    opened, seen = (a.reshape(triangle.shape) for a in _looked(scene, triangle.ravel(), barycentric.reshape(-1, 3)))
    told = seen >= np.minimum(SEEN, seen.max(0))
    return np.where(told, np.abs(opened - (opened * told).sum(0) / told.sum(0)), np.inf), seen


def _from_middle(centre: NDArray, area: NDArray, group: NDArray) -> NDArray[np.float64]:
    """How far small triangles lie from the middle of their group, squared; those without an area farthest."""
    whole = np.maximum(np.bincount(group, area), np.finfo(float).tiny)
    middle = np.stack([np.bincount(group, area * centre[:, k]) / whole for k in range(3)], -1)
    return np.where(area > 0, np.square(centre - middle[group]).sum(-1), np.inf)


def _numbered(scene: Scene, cuts: NDArray, gathered: NDArray, groups: int, away: NDArray, width: float) -> Cells:
    """Cells of groups first, then those of cut triangles.

    A group is stood for by the triangle in its middle, or where that is not seen by another, ever farther from it.
    Args: away: of `_from_middle`.
    """
    whole, cut = np.flatnonzero(cuts == 1), np.flatnonzero(cuts > 1)
    first = np.zeros(len(cuts), np.int64)
    first[whole] = gathered
    first[cut] = groups + np.cumsum(cuts[cut] ** 2) - cuts[cut] ** 2
    order = np.lexsort((whole, away, gathered))
    start = np.unique(gathered[order], return_index=True)[1]
    count = np.diff(start, append=len(whole))
    parts = cut.repeat(cuts[cut] ** 2)
    number = np.concatenate([np.zeros(groups, np.int64), np.arange(len(parts)) - (first[parts] - groups)])
    along = np.concatenate([np.ones(groups, np.int64), cuts[parts]])
    triangles, places = [], []
    for k in range(len(PLACES)):
        farther = np.where(count < len(PLACES), k % count, k * count // len(PLACES))
        triangles.append(np.concatenate([whole[order[start + farther]], parts]).astype(np.int32))
        place = PLACES[np.concatenate([k // count, np.full(len(parts), k)])]
        places.append(_part_points(number, along, place).astype(np.float32))
    triangle, barycentric = _most_like(scene, np.stack(triangles), np.stack(places))
    return Cells(first.astype(np.int32), cuts.astype(np.int32), triangle, barycentric, width)


def _part_points(number: NDArray, cuts: NDArray, place: NDArray) -> NDArray[np.float64]:
    """Barycentric coordinates of points of triangles' parts, as `part_of` numbers them. Args: place: (P, 2), of PLACES."""
    row = np.floor(np.sqrt(number + 0.5)).astype(np.int64)  # row r holds 2 r + 1 parts, every second upside down
    column = number - row * row
    place = np.where((column % 2 == 1)[:, None], 1 - place, place)
    b0 = (cuts - 1 - row + place[:, 0]) / cuts
    b2 = (column // 2 + place[:, 1]) / cuts
    return np.stack([b0, 1 - b0 - b2, b2], -1)


@compiled(inline="always")
def part_of(cuts, b0, b2):  # type: ignore[no-untyped-def]
    """Which of the cuts² parts of a triangle a point lies in. Args: its first and third barycentric coordinate."""
    row = min(max(int((1 - b0) * cuts), 0), cuts - 1)
    up = min(max(int(b2 * cuts), 0), row)
    b1 = max(1 - b0 - b2, 0.0)
    other = min(max(int(b1 * cuts), 0), row)
    return row * row + 2 * up + (1 if up + other < row else 0)
