"""Charts without xatlas: regions that face one way, laid flat by projection. Linear time, and it always ends.

Faces choose among a few directions by their smoothed normal and their neighbours' choice; regions of one choice are
charts; small ones join a neighbour that faces nearly the same way; each is projected along its own mean normal. The
faces of one polygon of the source always stay together.
"""

import numpy as np
from numpy.typing import NDArray

from stages.prep.normals import face_normals
from stages.prep.topology import components, edges, renumber

_SWEEPS = 12  # of the choice of direction
_SMOOTHINGS = 6  # of the normals
_NEIGHBOUR = 0.3  # worth of an agreeing boundary against the cosine to the direction
_STEEPEST = 0.35  # least cosine between a face and its chart's direction: stretch of 1 / 0.35 at most
_SMALL = 0.004  # of the surface: charts below this look for a neighbour to join


def grow(vertices: NDArray, triangles: NDArray, polygon: NDArray) -> NDArray[np.int32]:
    """Chart (F,) of each triangle.

    Args:
        vertices: (V, 3). triangles: (F, 3). polygon: (F,) from 0; triangles of one polygon share a chart.
    """
    normal, area = face_normals(vertices, triangles)
    table = edges(triangles)
    start, end = (ids.reshape(-1)[table.pairs[:, 0]] for ids in (triangles, np.roll(triangles, -1, 1)))
    length = np.linalg.norm(vertices[end] - vertices[start], axis=1)
    count = int(polygon.max()) + 1
    area_of, normal_of = np.bincount(polygon, area, count), _sum(polygon, normal * area[:, None], count)
    links = polygon[table.pairs // 3]
    between = links[:, 0] != links[:, 1]
    links, length = links[between], length[between]
    smoothed = _smooth(normal_of, links)
    label = _choose(smoothed, links, length)
    region = _face_one_way(_connected(label, links), _unit(normal_of), area_of, links)
    region = _join_small(region, normal_of, area_of, links, length)
    return renumber(region[polygon])


def project(vertices: NDArray, triangles: NDArray, chart: NDArray) -> NDArray[np.float64]:
    """(F, 3, 2) triangles projected along their chart's mean normal, to the scale of the mesh."""
    normal, area = face_normals(vertices, triangles)
    axis = _unit(_sum(chart, normal * area[:, None], int(chart.max()) + 1))
    lost = ~axis.any(1)  # a chart that closes on itself has no side; any will do, it is split later
    axis[lost] = [0.0, 0.0, 1.0]
    t, b = _frame(axis)
    points = vertices[triangles]
    return np.stack([(points * side[chart][:, None]).sum(-1) for side in (t, b)], -1)


def _sum(label: NDArray, values: NDArray, count: int) -> NDArray[np.float64]:
    return np.stack([np.bincount(label, values[:, k], count) for k in range(values.shape[1])], -1)


def _unit(v: NDArray) -> NDArray[np.float64]:
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.divide(v, length, out=np.zeros_like(v), where=length > 0)


def _frame(axis: NDArray) -> tuple[NDArray, NDArray]:
    t = np.cross(np.where(np.abs(axis[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[0.0, 1.0, 0.0]]), axis)
    t = _unit(t)
    return t, np.cross(axis, t)


def _smooth(normal: NDArray, links: NDArray) -> NDArray[np.float64]:
    """Unit normals averaged with their neighbours', where these do not face elsewhere altogether."""
    current = normal
    for _ in range(_SMOOTHINGS):
        unit = _unit(current)
        weight = np.maximum((unit[links[:, 0]] * unit[links[:, 1]]).sum(-1), 0.0)[:, None] ** 4
        a, b = links.T
        current = current + _sum(a, weight * current[b], len(current)) + _sum(b, weight * current[a], len(current))
    return _unit(current)


def _directions() -> NDArray[np.float64]:
    """The 6 axes and 8 diagonals."""
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T / 3**0.5
    return np.concatenate([axes, signs])


def _choose(normal: NDArray, links: NDArray, length: NDArray) -> NDArray[np.int64]:
    """A direction for each polygon: iterated conditional modes, alternately on either half of the polygons."""
    fit = normal @ _directions().T
    label = fit.argmax(1)
    around = np.bincount(links.reshape(-1), np.repeat(length, 2), len(normal))
    share = [length / around[links[:, 0]], length / around[links[:, 1]]]
    half = np.random.default_rng(0).random(len(normal)) < 0.5
    for sweep in range(_SWEEPS):
        support = np.zeros(fit.size)
        for k, (a, b) in enumerate((links.T, links.T[::-1])):
            support += np.bincount(a * fit.shape[1] + label[b], share[k], fit.size)
        best = (fit + _NEIGHBOUR * support.reshape(fit.shape)).argmax(1)
        label = np.where(half ^ bool(sweep % 2), best, label)
    return label


def _connected(label: NDArray, links: NDArray) -> NDArray[np.int32]:
    """Regions of linked polygons with the same label."""
    return components(len(label), links[label[links[:, 0]] == label[links[:, 1]]])


def _face_one_way(region: NDArray, unit: NDArray, area: NDArray, links: NDArray) -> NDArray[np.int32]:
    """Regions without polygons that would be squashed: those leave, by the direction that they face themselves."""
    own = (unit @ _directions().T).argmax(1) + 1
    for _ in range(_SWEEPS):
        axis = _unit(_sum(region, unit * area[:, None], int(region.max()) + 1))
        steep = (unit * axis[region]).sum(-1) < _STEEPEST
        if not steep.any():
            return region
        region = _connected(region * (int(own.max()) + 1) + np.where(steep, own, 0), links)
    alone = int(region.max()) + 1 + np.arange(len(region))
    return renumber(np.where(steep, alone, region))


def _join_small(region: NDArray, normal: NDArray, area: NDArray, links: NDArray, length: NDArray) -> NDArray[np.int32]:
    """Regions merged with the neighbour of the longest common border while all polygons still face its way."""
    unit, total = _unit(normal), float(area.sum())
    for _ in range(30):
        count = int(region.max()) + 1
        size = np.bincount(region, area, count)
        axis = _sum(region, normal, count)
        target = _longest_border(region, links, length, size, _unit(axis))
        target[size > _SMALL * total] = -1
        target[np.isin(np.arange(count), target)] = -1  # who is joined does not move in the same round
        moving = np.flatnonzero(target >= 0)
        merged = np.arange(count)
        merged[moving] = target[moving]
        new_axis = _unit(_sum(merged[region], normal, count))
        fits = (unit * new_axis[merged[region]]).sum(-1) >= _STEEPEST
        spoiled = np.zeros(count, bool)
        spoiled[region[~fits]] = True
        spoiled |= np.isin(merged, merged[spoiled])
        merged = np.where(spoiled, np.arange(count), merged)
        if (merged == np.arange(count)).all():
            break
        region = renumber(merged[region])
    return region.astype(np.int32)


def _longest_border(
    region: NDArray, links: NDArray, length: NDArray, size: NDArray, axis: NDArray
) -> NDArray[np.int64]:
    """For each region the larger neighbour that faces most nearly its way along the longest border, or -1."""
    count = len(size)
    ends = region[links]
    ends, length = ends[ends[:, 0] != ends[:, 1]], length[ends[:, 0] != ends[:, 1]]
    both = np.concatenate([ends, ends[:, ::-1]])
    code, inverse = np.unique(both[:, 0].astype(np.int64) * count + both[:, 1], return_inverse=True)
    border = np.bincount(inverse, np.concatenate([length, length]))
    a, b = code // count, code % count
    score = border * np.maximum((axis[a] * axis[b]).sum(-1), 0.0)
    allowed = ((size[b] > size[a]) | ((size[b] == size[a]) & (b < a))) & (score > 0)
    a, b, score = a[allowed], b[allowed], score[allowed]
    order = np.lexsort((score, a))
    target = np.full(count, -1, np.int64)
    target[a[order]] = b[order]
    return target
