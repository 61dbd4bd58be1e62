"""Winding: consistent within each connected patch, and outward.

A patch is what hangs together over edges with exactly two faces. A patch without border tells its outside by its signed
volume; an open one by which of its sides sees more of the sky; one whose sides see the same keeps the winding it has.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import minimum_spanning_tree

from stages.light.scene import OFFSET, Scene
from stages.prep.topology import Edges, components, edges

_SAMPLES = 256  # points per open patch, fewer where there are many patches
_EFFORT = 1e7  # microseconds that rays may take altogether
_DIRECTIONS = 16  # rays per point and side
_CLEAR = 0.32  # least difference in visible sky by which a side is told, times the square root of a patch's points


@dataclass(frozen=True)
class Winding:
    """flip: (F,) faces to turn round. patch: (F,) labels. non_orientable: edges across which no winding agrees."""

    flip: NDArray[np.bool_]
    patch: NDArray[np.int32]
    non_orientable: int


def outward(vertices: NDArray, triangles: NDArray) -> Winding:
    """Which faces to turn round for consistent, outward winding."""
    table = edges(triangles)
    patch = components(len(triangles), table.pairs // 3)
    flip, clashes = _consistent(table, len(triangles))
    turned = np.where(flip[:, None], triangles[:, ::-1], triangles)
    inward = _inward_patches(vertices, turned, patch, flip)
    return Winding(flip ^ inward[patch], patch, clashes)


def _consistent(table: Edges, faces: int) -> tuple[NDArray[np.bool_], int]:
    """Flips (F,) that make winding agree across every edge of a spanning forest, and the edges left that clash."""
    pairs = table.pairs // 3
    clash = table.forward[table.pairs[:, 0]] == table.forward[table.pairs[:, 1]]
    if not clash.any():
        return np.zeros(faces, bool), 0
    flip = _flips(pairs, clash, faces)
    left = flip[pairs[:, 0]] ^ flip[pairs[:, 1]] ^ clash
    if left.any():  # a Moebius band: only a tree can be wound
        graph = coo_matrix((np.arange(1, len(pairs) + 1), (pairs[:, 0], pairs[:, 1])), shape=(faces, faces))
        chosen = minimum_spanning_tree(graph.tocsr()).tocoo().data.astype(np.int64) - 1
        flip = _flips(pairs[chosen], clash[chosen], faces)
        left = flip[pairs[:, 0]] ^ flip[pairs[:, 1]] ^ clash
    return flip, int(left.sum())


def _flips(pairs: NDArray, clash: NDArray, faces: int) -> NDArray[np.bool_]:
    """Two-colour the faces. Face f stands twice, as it is (f) and turned (f + F); a link joins what agrees."""
    a, b = pairs.T
    twisted = np.where(clash, faces, 0)
    links = np.concatenate([np.stack([a, b + twisted], -1), np.stack([a + faces, b + faces - twisted], -1)])
    label = components(2 * faces, links)
    return label[:faces] > label[faces:]


def _inward_patches(vertices: NDArray, triangles: NDArray, patch: NDArray, flipped: NDArray) -> NDArray[np.bool_]:
    """(patches,) whether a consistently wound patch has its front inside."""
    count = int(patch.max()) + 1
    corners = vertices[triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.bincount(patch, np.linalg.norm(cross, axis=1) / 2, count)
    total = np.stack([np.bincount(patch, corners.mean(1)[:, k], count) for k in range(3)], -1)
    centre = total / np.bincount(patch, minlength=count)[:, None]
    volume = np.bincount(patch, (cross * (corners[:, 0] - centre[patch])).sum(1) / 6, count)
    # a patch of area a holds at most a^1.5 / (6 sqrt(pi)); below a millionth of that it is a sheet folded onto itself
    solid = ~_open_patches(triangles, patch, count) & (np.abs(volume) > 1e-7 * area**1.5)
    turned = np.bincount(patch, np.where(flipped, 1.0, -1.0) * np.linalg.norm(cross, axis=1), count) > 0
    inward = np.where(solid, volume < 0, turned)
    if not solid.all():
        points = int(_EFFORT / (2 * _DIRECTIONS * _ray_cost(corners, area)))
        wanted = np.flatnonzero(~solid)
        wanted = np.sort(wanted[np.argsort(-area[wanted], kind="stable")[:points]])  # or else the largest
        samples = int(np.clip(points // len(wanted), 1, _SAMPLES))
        sky = _sky_difference(vertices, triangles, patch, wanted, samples)
        clear = np.abs(sky) > _CLEAR / samples**0.5
        inward[wanted] = np.where(clear, sky < 0, inward[wanted])
    return inward


def _open_patches(triangles: NDArray, patch: NDArray, count: int) -> NDArray[np.bool_]:
    """(patches,) whether some edge is not passed as often one way as the other within the patch."""
    table = edges(triangles)
    _, key = np.unique(table.edge * count + np.repeat(patch, 3), return_inverse=True)
    balance = np.bincount(key, np.where(table.forward, 1, -1))
    result = np.zeros(count, bool)
    result[np.repeat(patch, 3)[balance[key] != 0]] = True
    return result


def _ray_cost(corners: NDArray, area: NDArray) -> float:
    """What a ray takes at most, microseconds, so that the time of all is bounded whatever the mesh: large overlapping
    boxes with little in them, such as those of slivers, make a ray a thousand times slower.

    A line through a box meets a convex part of it with the ratio of their surfaces (Cauchy); it is followed up to its
    second hit. The factors were measured on one core.
    """
    boxes, whole = _surface(np.ptp(corners, axis=1)), _surface(np.ptp(corners.reshape(-1, 3), axis=0))
    crossed, hits = float(boxes.sum() / whole), float(2 * area.sum() / whole)
    return 0.5 + 0.4 * crossed / max(hits / 2, 1.0) + 0.006 * crossed


def _surface(edges: NDArray) -> NDArray[np.float64]:
    """Surface of boxes (..., 3)."""
    return 2 * (edges * np.roll(edges, 1, -1)).sum(-1)


def _sky_difference(
    vertices: NDArray, triangles: NDArray, patch: NDArray, wanted: NDArray, samples: int
) -> NDArray[np.float64]:
    """Share of the sky that fronts see minus the share that backs see, of each wanted patch; (W,)."""
    face = _samples(vertices, triangles, patch, wanted, samples)
    points, normals = _points(vertices[triangles[face]])
    scene = Scene(vertices, triangles, np.zeros((*triangles.shape, 3)))
    seen = np.zeros(len(points))
    for direction in _opposites(_DIRECTIONS):
        side = np.where(normals @ direction >= 0, 1.0, -1.0)
        origins = points + OFFSET * side[:, None] * normals
        blocked = scene.occluded(origins, np.broadcast_to(direction, origins.shape))
        seen += np.where(blocked, 0.0, side)
    return seen.reshape(len(wanted), samples).mean(1) / _DIRECTIONS


def _samples(
    vertices: NDArray, triangles: NDArray, patch: NDArray, wanted: NDArray, samples: int
) -> NDArray[np.int64]:
    """Faces spread over each wanted patch by area, (W * samples,). Seed 0: the choice is part of the code."""
    order = np.argsort(patch, kind="stable")
    first, last = (np.searchsorted(patch[order], wanted, side) for side in ("left", "right"))
    steps = np.concatenate([[0.0], np.cumsum(_doubled_area(vertices[triangles[order]]))])
    share = (np.arange(samples) + np.random.default_rng(0).random((len(wanted), samples))) / samples
    position = steps[first, None] + share * (steps[last] - steps[first])[:, None]
    chosen = np.searchsorted(steps, position, "right") - 1
    return order[np.clip(chosen, first[:, None], last[:, None] - 1)].reshape(-1)


def _points(corners: NDArray) -> tuple[NDArray, NDArray]:
    """A random point on each triangle (N, 3, 3), and its unit normal."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    u, v = np.random.default_rng(1).random((2, len(corners), 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    cross = np.cross(b - a, c - a)
    return a + u * (b - a) + v * (c - a), cross / np.linalg.norm(cross, axis=1, keepdims=True)


def _doubled_area(corners: NDArray) -> NDArray[np.float64]:
    """Twice the areas of triangles (F, 3, 3)."""
    return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)


def _opposites(count: int) -> NDArray[np.float64]:
    """Directions spread evenly over the sphere, (2 * count, 3), each with its opposite: any plane has as many on either
    side. Source: Swinbank and Purser 2006, Fibonacci grids."""
    i = np.arange(count) + 0.5
    z, azimuth = 1 - i / count, np.pi * (1 + 5**0.5) * i
    radius = np.sqrt(1 - z * z)
    half = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], -1)
    return np.concatenate([half, -half])
