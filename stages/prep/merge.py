"""Fewer charts: neighbours flattened as one sheet, as rigidly as they can be, where that stretches little and saves texture.

Every chart costs a gutter, and every border between two a seam. Two charts become one if their union is a disk, or has no
more holes than the larger of them, and if it can be laid flat with little stretch, does not cover itself, and fits into a
smaller box, gutter included, than the two apart. Source of the flattening: Liu et al. 2008, "A Local/Global Approach to Mesh
Parameterization" (as rigid as possible). Points of the plane are complex numbers: a turn is a factor.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

from stages.prep.overlap import overlapping
from stages.prep.pack import align, expected_scale
from stages.prep.topology import components, corner_links, edges, renumber

_ROUNDS = 24  # of joining pairs
_EFFORT = 3_000_000  # triangles flattened, after which a large mesh stops: 12 s
_OVERHEAD = 700  # triangles that a union costs beside its own
_STEPS = 8  # of turning triangles and laying them together
_STRETCH = 1.05  # most of a union's L2 stretch, 1 where nothing is stretched
_FLATTEST = 1e-6  # least of a triangle's height over its longest edge, where it is divided by

SQUASHED = 0.7
"""Least of what a length may become in any triangle of a union, and the inverse of the most."""


@dataclass
class _Sheet:
    """A mesh with charts that are being joined.

    plane: (F, 3) each triangle laid flat by itself. triangles: (F, 3). flat: (F, 3, 2), each chart's lowest corner at the
    origin. chart: (F,); a joined chart gets a new number. size: (C, 2) boxes by number. pairs: (M, 2) half-edges of each edge
    between two triangles. length: (M,). refused: pairs of charts that cannot be joined. work: triangles flattened so far.
    """

    plane: NDArray[np.complex128]
    triangles: NDArray
    flat: NDArray[np.float64]
    chart: NDArray[np.int64]
    size: NDArray[np.float64]
    pairs: NDArray[np.int64]
    length: NDArray[np.float64]
    refused: set[tuple[int, int]] = field(default_factory=set)
    work: int = 0

    def candidates(self) -> Iterator[tuple[int, int]]:
        """Pairs of neighbours, those first of which the smaller has most of its outline in common with the other."""
        count, ends = len(self.size), self.chart[self.pairs // 3]
        between = ends[:, 0] != ends[:, 1]
        low, high, length = ends[between].min(1), ends[between].max(1), self.length[between]
        code, inverse = np.unique(low * count + high, return_inverse=True)
        rim = np.bincount(low, length, count) + np.bincount(high, length, count)
        a, b = code // count, code % count
        share = np.bincount(inverse, length, len(code)) / np.minimum(rim[a], rim[b]) if len(code) else np.zeros(0)
        for row in np.argsort(-share, kind="stable"):
            if (int(a[row]), int(b[row])) not in self.refused:
                yield int(a[row]), int(b[row])

    def flattened(self) -> list[tuple[tuple[int, int], NDArray, NDArray]]:
        """Unions of pairs, each chart in one at most: the charts, their rows, and (R, 3) where corners come to lie."""
        order = np.argsort(self.chart, kind="stable")
        begin = np.searchsorted(self.chart[order], np.arange(len(self.size) + 1))
        used: set[int] = set()
        made = []
        for pair in self.candidates():
            rows = np.concatenate([order[begin[k] : begin[k + 1]] for k in pair])
            if used & set(pair) or self.work + len(rows) > _EFFORT:
                continue
            self.work += len(rows) + _OVERHEAD
            union = flatten(self.plane[rows], self.triangles[rows], _complex(self.flat[rows]), self.chart[rows] == pair[1])
            if union is None:
                self.refused.add(pair)
            else:
                used |= set(pair)
                made.append((pair, rows, union))
        return made


def merge(
    vertices: NDArray, triangles: NDArray, flat: NDArray, chart: NDArray, texture_size: int, padding: int
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Join charts while that saves texture. Returns flat (F, 3, 2) and chart (F,), joined.

    Args:
        vertices: (V, 3). triangles: (F, 3). flat: (F, 3, 2) charts in units of length. chart: (F,) from 0.
        texture_size, padding: texels.
    """
    pairs = edges(triangles).pairs
    ends = vertices[triangles.reshape(-1)[pairs[:, 0]]], vertices[np.roll(triangles, -1, 1).reshape(-1)[pairs[:, 0]]]
    length = np.linalg.norm(ends[1] - ends[0], axis=1)
    chart = renumber(chart).astype(np.int64)
    flat = align(flat, chart)
    size = _sizes(flat, chart)
    sheet = _Sheet(laid_flat(vertices[triangles]), triangles, flat, chart, size, pairs, length)
    gutter = 2 * padding / expected_scale(size, texture_size, padding)
    for _ in range(_ROUNDS):
        made = sheet.flattened()
        if not made:
            break
        rows, label = np.concatenate([r for _, r, _ in made]), np.repeat(np.arange(len(made)), [len(r) for _, r, _ in made])
        union = np.concatenate([u for _, _, u in made])
        union = align(np.stack([union.real, union.imag], -1), label)
        cost, size = (sheet.size + gutter).prod(1), _sizes(union, label)
        saves = (size + gutter).prod(1) < [cost[a] + cost[b] for (a, b), _, _ in made]
        good = saves & ~overlapping(union, label)
        sheet.refused |= {pair for (pair, _, _), fine in zip(made, good, strict=True) if not fine}
        kept = good[label]
        sheet.flat[rows[kept]] = union[kept]
        sheet.chart[rows[kept]] = len(sheet.size) + label[kept]
        sheet.size = np.concatenate([sheet.size, size])
    return sheet.flat, renumber(sheet.chart)


def _sizes(flat: NDArray, chart: NDArray) -> NDArray[np.float64]:
    """(C, 2) bounding boxes of charts whose lowest corner is the origin."""
    size = np.zeros((int(chart.max()) + 1, 2))
    np.maximum.at(size, np.repeat(chart, 3), flat.reshape(-1, 2))
    return size


def laid_flat(corners: NDArray) -> NDArray[np.complex128]:
    """Triangles (F, 3, 3) in the plane, undistorted: the first corner at 0, the second on the real axis. Returns: (F, 3)."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    length = np.linalg.norm(first, axis=1)
    along = first / np.where(length > 0, length, 1)[:, None]
    x = (second * along).sum(1)
    return np.stack([0 * x, length, x + 1j * np.linalg.norm(second - x[:, None] * along, axis=1)], 1)


def flatten(plane: NDArray, triangles: NDArray, flat: NDArray, second: NDArray[np.bool_]) -> NDArray[np.complex128] | None:
    """Two charts as one, or None: no disk, with more holes than the larger one had, or stretched too much.

    Args:
        plane: (R, 3) of `laid_flat`. triangles: (R, 3). flat: (R, 3) the charts as they are. second: (R,) whether a triangle is
        of the second chart.
    Returns:
        (R, 3).
    """
    pairs, vertex = _joined(triangles)
    size, holes = int(vertex.max()) + 1, 1 - _characteristic(vertex, pairs)
    if holes:
        larger = triangles[second == (2 * second.sum() > len(second))]
        pairs_of_larger, vertex_of_larger = _joined(larger)
        if 1 - _characteristic(vertex_of_larger, pairs_of_larger) < holes:
            return None
    edge = np.roll(plane, -1, 1) - plane  # from corner k to the next
    height = np.maximum(_cross(edge[:, 0], edge[:, 1]), _FLATTEST * (np.abs(edge) ** 2).max(1))
    weight = -_dot(np.roll(edge, -1, 1), np.roll(edge, -2, 1)) / height[:, None] / 2  # half a cotangent of the angle opposite
    start, end = vertex.reshape(-1), np.roll(vertex, -1, 1).reshape(-1)
    values = np.concatenate([weight.reshape(-1)] * 2 + [-weight.reshape(-1)] * 2)
    at = np.concatenate([start, end, start, end]), np.concatenate([start, end, end, start])
    try:  # the first vertex stays at 0
        solved = splu(coo_matrix((values, at), (size, size)).tocsc()[1:, 1:], "MMD_AT_PLUS_A", options={"SymmetricMode": True})
    except RuntimeError:  # singular: triangles without area
        return None
    now = np.where(second[:, None], flat * _turn(flat, pairs, second), flat)
    for _ in range(_STEPS):
        turned = (weight * edge.conj() * (np.roll(now, -1, 1) - now)).sum(1)
        pulled = (weight * edge * (turned / np.where(turned == 0, 1, np.abs(turned)))[:, None]).reshape(-1)
        force = [np.bincount(end, part, size) - np.bincount(start, part, size) for part in (pulled.real, pulled.imag)]
        place = solved.solve(np.stack(force, 1)[1:])
        now = np.concatenate([[0], place[:, 0] + 1j * place[:, 1]])[vertex]
    return now if _little_stretched(plane, now) else None


def _joined(triangles: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Pairs of half-edges that meet, and the point of the sheet that each corner is, (R, 3)."""
    pairs = edges(triangles).pairs
    return pairs, components(3 * len(triangles), corner_links(triangles, pairs)).reshape(-1, 3)


def _characteristic(vertex: NDArray, pairs: NDArray) -> int:
    """Euler's: 1 for a disk, one less for each hole in it."""
    return int(vertex.max()) + 1 - (vertex.size - len(pairs)) + len(vertex)


def _complex(points: NDArray) -> NDArray[np.complex128]:
    return points[..., 0] + 1j * points[..., 1]


def _dot(a: NDArray, b: NDArray) -> NDArray[np.float64]:
    return (a.conj() * b).real


def _cross(a: NDArray, b: NDArray) -> NDArray[np.float64]:
    return (a.conj() * b).imag


def _turn(flat: NDArray, pairs: NDArray, second: NDArray[np.bool_]) -> complex:
    """The turn of the second chart that brings its side of the common edges to run along the first's, on the whole."""
    mixed = pairs[second[pairs[:, 0] // 3] != second[pairs[:, 1] // 3]]
    inside = second[mixed[:, 0] // 3]
    own, other = np.where(inside, mixed[:, 1], mixed[:, 0]), np.where(inside, mixed[:, 0], mixed[:, 1])
    edge = (np.roll(flat, -1, 1) - flat).reshape(-1)
    turn = complex(-(edge[own] * edge[other].conj()).sum())  # neighbours run along an edge in opposite ways
    return turn / abs(turn) if turn else 1


def _little_stretched(plane: NDArray, now: NDArray) -> bool:
    """Whether the map from the triangles to the sheet stretches little, on the whole and anywhere; none turns over."""
    (a, b), (c, d) = ((x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) for x in (plane, now))
    twice = _cross(a, b)
    sound = twice > 0
    a, b, c, d, twice = (x[sound] for x in (a, b, c, d, twice))
    same, mirrored = (np.abs(c * b.conj() - d * a.conj()), np.abs(a * d - b * c))  # times twice: conformal and mirrored part
    longest, least = (same + mirrored) / (2 * twice), (same - mirrored) / (2 * twice)
    if not len(twice) or (least < SQUASHED).any() or (longest > 1 / SQUASHED).any():
        return False
    mean = np.average(longest**-2 + least**-2, weights=twice) / 2 * np.average(longest * least, weights=twice)
    return bool(mean < _STRETCH**2)
