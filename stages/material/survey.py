"""What a material must know of a mesh: where its edges and creases are, what it hides from the sky, which pieces it has.

A survey is some tens of thousands of points spread over the surface, more of them along sharp edges, each with what was found
there. It is made once, from the mesh, and travels with the conditions and with material.npz, so that a point seen by a view
and a texel of a bake are told the same. """

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from stages.core.parallel import compiled, in_parallel, slices
from stages.material.directions import WHOLE, Pieces, measure
from stages.material.surface import Array, Surface

POINTS, EDGE_POINTS = 50_000, 30_000
"""Points spread evenly, and those beside sharp edges."""

OF_LABEL, OF_SMALL = 64, 20_000
"""Points that each label gets at least, and how many there are at most for those labels whose share is too small for that."""

SHARP = 0.85
"""Neighbouring triangles whose normals agree by less than this cosine, 32 degrees, meet in an edge or a crease."""

NEAR, REACH = 24, 0.03
"""Neighbours that tell a point's convexity, and how far away they may be, object sizes."""

RAYS, TOGETHER = 48, 16
"""Rays a point that tell what hides the sky, and how many of them are traced at a time."""

OFFSET = 1e-4
"""How far above the surface a ray begins, object sizes."""

MIXED, AROUND = 3, 24
"""Points of the survey that a look-up mixes, and those among which it finds them where neighbours search together."""

TASK = 1 << 17
"""Points of one thread's task."""

Blocked = Callable[[NDArray[np.float32], NDArray[np.float32]], NDArray[np.bool_]]
"""Whether rays meet the object. Args: origins, directions (R, 3). Returns: (R,)."""


class Survey(NamedTuple):
    """point, normal: (S, 3) world. convexity, occlusion: (S,). piece: (S,) int32, row of `pieces`. label: (S,) int32, of the
    parts. pieces: what hangs together."""

    point: Array
    normal: Array
    convexity: Array
    occlusion: Array
    piece: NDArray[np.int32]
    label: NDArray[np.int32]
    pieces: Pieces

    def surface(self) -> Surface:
        """The survey's own points as a surface."""
        size = np.full(len(self.point), np.float32(1e-3))
        return Surface(self.point, self.normal, size, self.convexity, self.occlusion, self.piece, self.label)

    def to_arrays(self) -> dict[str, NDArray]:
        """By name, as `from_arrays` wants them; half floats where they do."""
        rows = {"point": self.point, "normal": self.normal, "convexity": self.convexity, "occlusion": self.occlusion}
        arrays: dict[str, NDArray] = {f"survey_{name}": value.astype(np.float16) for name, value in rows.items()}
        arrays |= {"survey_point": self.point, "survey_piece": self.piece, "survey_label": self.label}
        return arrays | {f"pieces_{name}": value for name, value in self.pieces._asdict().items()}

    @staticmethod
    def from_arrays(arrays: dict[str, NDArray]) -> "Survey":
        """Of what `to_arrays` gave."""
        pieces = Pieces(*(arrays[f"pieces_{name}"] for name in Pieces._fields))
        point, normal, convex, hidden = (
            arrays[f"survey_{name}"].astype(np.float32) for name in ("point", "normal", "convexity", "occlusion")
        )
        return Survey(point, normal, convex, hidden, arrays["survey_piece"], arrays["survey_label"], pieces)


class Lookup:
    """A survey that can be asked about any point of the surface."""

    def __init__(self, survey: Survey) -> None:
        self.survey = survey
        self._tree = cKDTree(survey.point, balanced_tree=False, compact_nodes=False)

    def surface(
        self, point: Array, normal: Array, footprint: Array, label: NDArray[np.int32] | None = None
    ) -> Surface:
        """Points with what the survey knows there: the nearest of its points, those that face the same way first.

        Args:
            point, normal: (P, 3) world. footprint: (P,). label: (P,); None for that of the nearest point, which near the
            border of two parts may be the other's.
        """
        if not len(point):
            return Surface.bare(point, normal, footprint)
        distance, index = self._tree.query(point, [*range(1, min(MIXED, len(self.survey.point)) + 1)])
        agree = np.einsum("pkd,pd->pk", self.survey.normal[index], normal).clip(0.02, 1)
        weight = agree**2 / np.maximum(distance, 1e-6)
        weight = (weight / weight.sum(1, keepdims=True)).astype(np.float32)
        convexity, occlusion = ((weight * values[index]).sum(1) for values in (self.survey.convexity, self.survey.occlusion))
        best = np.take_along_axis(index, weight.argmax(1)[:, None], 1)[:, 0]
        own = self.survey.label[best] if label is None else label
        return Surface(point, normal, footprint, convexity, occlusion, self.survey.piece[best], own)


    def shared(
        self, point: Array, normal: Array, first: NDArray[np.int64], group: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Convexity and occlusion, as of `surface`, of points so close together that each group of them searches once.

        Args:
            point, normal: (P, 3) float32. first: (G,) a point of each group. group: (P,) of each point.
        Returns:
            (P,) each.
        """
        count = min(AROUND, len(self.survey.point))
        near = np.empty((len(first), count), np.int64)
        mixed = np.empty((2, len(point)), np.float32)
        known = (self.survey.point, self.survey.normal, np.stack([self.survey.convexity, self.survey.occlusion]))

        def search(rows: slice) -> None:
            near[rows] = self._tree.query(point[first[rows]], [*range(1, count + 1)])[1]

        def mix(rows: slice) -> None:
            _mix(point[rows], normal[rows], group[rows], near, known, mixed[:, rows])

        in_parallel(search, slices(len(first), TASK))
        in_parallel(mix, slices(len(point), TASK))
        return mixed[0], mixed[1]


@compiled
def _mix(point, normal, group, near, known, mixed):  # type: ignore[no-untyped-def]
    """`Lookup.surface` of points, each among the neighbours of its group. near: (G, AROUND). mixed: (2, P), written."""
    positions, normals, values = known
    least, best = np.empty(MIXED), np.empty(MIXED, np.int64)
    for p in range(len(point)):
        least[:] = np.inf
        for k in near[group[p]]:
            d = 0.0
            for c in range(3):
                d += (positions[k, c] - point[p, c]) ** 2
            for m in range(MIXED):  # kept in order
                if d < least[m]:
                    least[m], d = d, least[m]
                    best[m], k = k, best[m]
        total, convexity, occlusion = 0.0, 0.0, 0.0
        for m in range(min(MIXED, near.shape[1])):
            k, agree = best[m], 0.0
            for c in range(3):
                agree += normals[k, c] * normal[p, c]
            weight = min(max(agree, 0.02), 1.0) ** 2 / max(np.sqrt(least[m]), 1e-6)
            total += weight
            convexity += weight * values[0, k]
            occlusion += weight * values[1, k]
        mixed[0, p], mixed[1, p] = convexity / total, occlusion / total


def make_survey(
    vertices: Array, triangles: NDArray[np.int32], normals: Array, blocked: Blocked, label: NDArray[np.int32], seed: int = 0
) -> Survey:
    """Survey a mesh.

    Args:
        vertices: (V, 3) world, welded. triangles: (F, 3). normals: (F, 3, 3) shading normal of each corner. blocked: traces
        rays. label: (F,) of the parts.
    """
    rng = np.random.default_rng(seed)
    corners = vertices[triangles].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1) / 2
    face, weights = _everywhere(area, rng)
    edge_face, edge_weights = _beside_edges(triangles, corners, cross, rng)
    small_face, small_weights = _on_small(area, label, rng)
    face, weights = np.concatenate([face, edge_face, small_face]), np.concatenate([weights, edge_weights, small_weights])
    point = np.einsum("pk,pkd->pd", weights, corners[face]).astype(np.float32)
    normal = np.einsum("pk,pkd->pd", weights, normals[face])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = (normal / np.where(length > 0, length, 1)).astype(np.float32)
    of_vertex = connected_pieces(triangles, len(vertices))
    shares = np.where(np.arange(len(face)) < POINTS, area.sum() / POINTS, 0.0)
    pieces, row = measure(point, normal, shares, of_vertex[triangles[face, 0]])
    flat = (cross[face] / np.maximum(2 * area[face], 1e-30)[:, None]).astype(np.float32)
    near = neighbours(point)
    hidden = occlusion(point, normal, flat, near, blocked, rng)
    return Survey(point, normal, convexity(point, normal, near), hidden, row, label[face], pieces)


def connected_pieces(triangles: NDArray[np.int32], count: int) -> NDArray[np.int64]:
    """(V,) number of the piece that each vertex belongs to."""
    a, b = triangles[:, [0, 1]].T.reshape(2, -1), triangles[:, [1, 2]].T.reshape(2, -1)
    rows, columns = np.concatenate([a[0], b[0]]), np.concatenate([a[1], b[1]])
    graph = coo_matrix((np.ones(len(rows), bool), (rows, columns)), (count, count))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def _everywhere(area: NDArray, rng: np.random.Generator) -> tuple[NDArray[np.int64], NDArray]:
    """Triangles and barycentric weights of points spread evenly."""
    total = np.cumsum(area)
    u = (np.arange(POINTS) + rng.random(POINTS)) / POINTS * total[-1]
    return np.searchsorted(total, u, side="right").clip(max=len(area) - 1), _weights(POINTS, rng)


def _weights(count: int, rng: np.random.Generator) -> NDArray:
    """Barycentric weights (count, 3), even over a triangle."""
    root, other = np.sqrt(rng.random(count)), rng.random(count)
    return np.stack([1 - root, root * (1 - other), root * other], 1)


def _on_small(area: NDArray, label: NDArray[np.int32], rng: np.random.Generator) -> tuple[NDArray[np.int64], NDArray]:
    """As `_everywhere`, of points on labels that even ones hardly meet: what lies on a part is settled on its own extent."""
    share = np.bincount(label, area)
    small = np.flatnonzero((share > 0) & (share < OF_LABEL / POINTS * share.sum()))
    if not len(small):
        return np.zeros(0, np.int64), np.zeros((0, 3))
    each = max(1, min(OF_LABEL, OF_SMALL // len(small)))
    order = np.flatnonzero(np.isin(label, small))
    order = order[np.argsort(label[order], kind="stable")]
    total = np.cumsum(area[order] / share[label[order]])  # each label is 1 wide
    u = (np.arange(each * len(small)) + rng.random(each * len(small))) / each
    return order[np.searchsorted(total, u, side="right").clip(max=len(order) - 1)], _weights(len(u), rng)


def _beside_edges(
    triangles: NDArray[np.int32], corners: NDArray, cross: NDArray, rng: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray]:
    """The same of points close to sharp edges, on the triangles that meet there."""
    start, end = triangles.T.reshape(-1), triangles[:, [1, 2, 0]].T.reshape(-1)  # side k of each triangle: corner k to k + 1
    owner, side = np.tile(np.arange(len(triangles)), 3), np.repeat(np.arange(3), len(triangles))
    key = np.minimum(start, end).astype(np.int64) * (int(triangles.max(initial=0)) + 1) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    pairs = np.flatnonzero(key[order][1:] == key[order][:-1])
    one, two = order[pairs], order[pairs + 1]
    unit = cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-30)
    sharp = (unit[owner[one]] * unit[owner[two]]).sum(1) < SHARP
    sides = np.concatenate([one[sharp], two[sharp]])
    if not len(sides):
        return np.zeros(0, np.int64), np.zeros((0, 3))
    a, b = corners[owner[sides], side[sides]], corners[owner[sides], (side[sides] + 1) % 3]
    length = np.cumsum(np.linalg.norm(b - a, axis=1))
    pick = np.searchsorted(length, rng.random(EDGE_POINTS) * length[-1], side="right").clip(max=len(sides) - 1)
    t, inward = rng.random(EDGE_POINTS), 0.6 * rng.random(EDGE_POINTS) ** 2
    rows, weights = np.arange(EDGE_POINTS), np.zeros((EDGE_POINTS, 3))
    weights[rows, side[sides[pick]]] = (1 - inward) * (1 - t)
    weights[rows, (side[sides[pick]] + 1) % 3] = (1 - inward) * t
    weights[rows, (side[sides[pick]] + 2) % 3] = inward
    return owner[sides[pick]], weights


def neighbours(point: Array) -> tuple[Array, NDArray[np.int64]]:
    """Distance and row of each point's neighbours, itself the first: (S, NEAR) each; infinite and S where there are fewer."""
    distance, index = cKDTree(point).query(point, NEAR, distance_upper_bound=REACH)
    return distance, index


def convexity(point: Array, normal: Array, near: tuple[Array, NDArray[np.int64]]) -> Array:
    """How far the surface around each point falls off below its tangent plane, against its distance: about 0.4 on a
    right-angled edge, 0 on a plane, negative in a crease. Args: (S, 3) each; of `neighbours`. Returns: (S,)."""
    result = np.empty(len(point), np.float32)
    _fall(point, normal, *near, result)
    return result


@compiled
def _fall(point, normal, distance, index, result):  # type: ignore[no-untyped-def]
    """`convexity`, which is written to `result`."""
    for p in range(len(point)):
        drop, total = 0.0, 0.0
        for k in range(index.shape[1]):
            q, away = index[p, k], distance[p, k]
            if not 0 < away < np.inf:
                continue
            agree, fall = 0.0, 0.0
            for d in range(3):
                agree += normal[q, d] * normal[p, d]
                fall -= (point[q, d] - point[p, d]) * normal[p, d]
            if agree > -0.7:  # not the other side of a thin wall
                drop, total = drop + fall, total + away
        result[p] = drop / total if total > 0 else 0.0


def occlusion(
    point: Array,
    normal: Array,
    flat: Array,
    near: tuple[Array, NDArray[np.int64]],
    blocked: Blocked,
    rng: np.random.Generator,
) -> Array:
    """Share of the sky, weighted by the cosine, that the object hides from each point; averaged with its neighbours.

    Args:
        point, normal: (S, 3). flat: (S, 3) normal of the triangle itself, on whose outer side the rays begin. near: of
        `neighbours`.
    """
    side = np.sign((flat * normal).sum(1, keepdims=True))
    origin = (point + OFFSET * np.where(side < 0, -flat, flat)).astype(np.float32)
    hits = np.zeros(len(point), np.float32)
    for first in range(0, RAYS, TOGETHER):  # a point's rays after each other, which is faster
        direction = np.empty((len(point), TOGETHER, 3), np.float32)
        _to_sky(normal, rng.random((TOGETHER, 2, len(point))), first, direction)
        found = blocked(np.repeat(origin, TOGETHER, 0), direction.reshape(-1, 3))
        hits += found.reshape(-1, TOGETHER).sum(1)
    distance, index = (values[:, :4] for values in near)
    counts = distance < REACH / 2
    weight = np.where(counts, 1.0, 0.0)
    index = np.where(counts, index, 0)
    weight *= (normal[index] * normal[:, None]).sum(-1) > 0.7
    return ((weight * hits[index]).sum(1) / np.maximum(weight.sum(1), 1) / RAYS).astype(np.float32)


@compiled
def _to_sky(normal, sample, first, direction):  # type: ignore[no-untyped-def]
    """Cosine-weighted directions, (S, R, 3), written. Args: sample: (R, 2, S), 0 to 1. first: number of the first."""
    golden = (math.sqrt(5.0) - 1) / 2
    for r in range(len(sample)):
        k = first + r
        for p in range(len(normal)):
            u = (k + sample[r, 0, p]) / RAYS
            angle = 2 * math.pi * ((k * golden + sample[r, 1, p] / RAYS) % 1)
            out = 2 * math.sqrt(u * (1 - u))
            direction[p, r, 0] = normal[p, 0] + np.float32(out * math.cos(angle))
            direction[p, r, 1] = normal[p, 1] + np.float32(out * math.sin(angle))
            direction[p, r, 2] = normal[p, 2] + np.float32(1 - 2 * u)


_NOTHING, _ZERO = np.zeros(1, np.float32), np.zeros(1, np.int32)
EMPTY = Survey(
    np.zeros((1, 3), np.float32), np.array([[0, 0, 1]], np.float32), _NOTHING, _NOTHING, _ZERO, _ZERO, WHOLE
)
"""Of a thing of which nothing is known."""
