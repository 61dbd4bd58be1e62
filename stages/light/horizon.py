"""Which rays from the surface are provably open, so that nobody need trace them: a horizon for each small patch of it.

Triangles that lie together and face alike are a patch C. Around its mean normal N the azimuth is cut in SECTORS; in each, a ray
from any point of C that rises above the horizon there hits nothing. It need not be the lowest such horizon, only a safe one:

- Near by, the surface is a height field over C's plane. From C the triangles are followed over their edges as far as a circle
  in that plane reaches; the circle shrinks until no edge inside it is open or shared by more than two, and no triangle inside
  it leans out by more than STEEP. What is left covers the circle exactly once, so by the mean value theorem a line between two
  of its points, of which one lies in C, is no steeper than the steepest triangle between them. Those that lie behind C, as
  seen along a sector, are not between.
- All else, in a tree of boxes, is no higher than its top over its least distance from C, within the azimuths it covers. What
  lies over C itself closes the horizon; what does not rise above C's lowest point counts for nothing.

Rays start OFFSET above the triangle, or higher, where `Scene.ray_origin` lifts them along the corners' normals; a patch is
closed unless those are steep enough to lead out of the surface around it. OFFSET also pays for rounding. A surface that winds
twice around a vertex, through itself, is not thought of.

Source: Max 1988, "Horizon Mapping: Shadows for Bump-Mapped Surfaces" (horizons in sectors; there sampled, here bounded).
"""

import math
from dataclasses import dataclass
from threading import Lock
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from stages.core.frames import tangent_frame
from stages.core.parallel import compiled, in_parallel

SECTORS = 16
"""Of the azimuth, four a quadrant: at 18, 45 and 72 degrees."""

CLOSED = 255
"""A horizon above which nothing is known; others are the sine of their elevation, times 255, rounded up."""

STEEPEST = 4.0
"""Tangent of an elevation from which a horizon counts as closed."""

SIDE, TURN = 1 / 64, 0.4
"""Side of the cells, of the object and of the sphere of normals, in which triangles lie together and face alike."""

CIRCLE = 1.7
"""How far the surface is followed, as a multiple of the patch's radius."""

STEEP = 0.2
"""Cosine to the patch's normal under which a triangle leans out too far."""

SLACK = 4e-6
"""World units by which a surface may rise above a plane unnoticed; a fifth of what rays start above it."""

MARGIN = 2e-3
"""Added to tangents of horizons and to cosines of azimuths, for rounding."""

NARROW = 0.25
"""A box is not opened when it is smaller than this share of its distance."""

LEAF = 4
"""Triangles of a leaf."""

PER_TASK = 64

inline = numba.njit(inline="always", error_model="numpy", cache=True)


class Surface(NamedTuple):
    """Triangles, F in all.

    corners: (F, 3, 3). n: (F, 3) by winding, 0 for a degenerate one. next: (F, 3), the triangle across the edge from corner k
    to k + 1, or -1. lift: (F,), how far a ray's start may be moved. normals: (F, 3, 3) at the corners.
    """

    corners: NDArray[np.float64]
    n: NDArray[np.float64]
    next: NDArray[np.int32]
    lift: NDArray[np.float64]
    normals: NDArray[np.float32]


class Tree(NamedTuple):
    """Boxes over triangles.

    boxes: (nodes, 7), centre, half size and radius, the root being node 1, the children of i nodes 2 i and 2 i + 1; radius -1
    if empty. order: the triangles of one leaf after the other, -1 where a leaf has fewer than LEAF.
    """

    boxes: NDArray[np.float64]
    order: NDArray[np.int32]


class Patches(NamedTuple):
    """C patches. of: (F,) the patch of each triangle. begin: (C + 1,) into member: (F,). frame: (C, 3, 3), n, t and b."""

    of: NDArray[np.int32]
    begin: NDArray[np.int64]
    member: NDArray[np.int32]
    frame: NDArray[np.float64]


class Skyline(NamedTuple):
    """What stands above some points, P. row: (P,) of the other two, or -1 where nothing is known. frame: (C, 3, 3) n, t and b.

    sine: (C, SECTORS), of the elevation of each sector's horizon, times 255, or CLOSED.
    """

    row: NDArray[np.int32]
    frame: NDArray[np.float32]
    sine: NDArray[np.uint8]

    def of(self, part: NDArray[np.int64]) -> "Skyline":
        """Of some of the points."""
        return self._replace(row=self.row[part])


@dataclass
class Horizons:
    """Horizons of a mesh's patches, found when first asked for; safe to use from several threads."""

    surface: Surface
    patches: Patches
    tree: Tree
    sine: NDArray[np.uint8]
    known: NDArray[np.bool_]
    lock: Lock

    @staticmethod
    def over(vertices: NDArray, triangles: NDArray, normals: NDArray) -> "Horizons":
        """Args: vertices: (V, 3). triangles: (F, 3). normals: (F, 3, 3), unit, per corner."""
        surface = surface_of(vertices, triangles, normals)
        patches = patches_of(surface)
        count = len(patches.frame)
        sine, known = np.full((count, SECTORS), CLOSED, np.uint8), np.zeros(count, np.bool_)
        return Horizons(surface, patches, tree_over(surface.corners), sine, known, Lock())

    def above(self, triangle: NDArray, ng: NDArray) -> Skyline:
        """Over points of some triangles. Args: (P,); (P, 3), normals to the side in question; of backs nothing is known."""
        row = self.patches.of[triangle]
        front = np.einsum("pd,pd->p", self.surface.n[triangle], ng) > 0
        with self.lock:
            missing = np.unique(row[front])
            missing = missing[~self.known[missing]]
            parts = [missing[i : i + PER_TASK] for i in range(0, len(missing), PER_TASK)]
            in_parallel(lambda which: _horizons(self.surface, self.patches, self.tree, which, self.sine), parts)
            self.known[missing] = True
        return Skyline(np.where(front, row, -1).astype(np.int32), self.patches.frame.astype(np.float32), self.sine)


def surface_of(vertices: NDArray, triangles: NDArray, normals: NDArray) -> Surface:
    """Triangles and what lies across their edges; vertices are one where their positions are."""
    corners = vertices[triangles].astype(np.float64)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    lift = np.zeros(len(corners))
    for k in range(3):
        for i in range(3):
            lift = np.maximum(lift, ((corners[:, k] - corners[:, i]) * normals[:, k]).sum(-1))
    _, place = np.unique(vertices, axis=0, return_inverse=True)
    welded = place.reshape(-1)[triangles]
    return Surface(corners, across / np.where(length > 0, length, 1), across_edges(welded), lift, normals)


def across_edges(triangles: NDArray) -> NDArray[np.int32]:
    """The triangle across each edge, (F, 3), from corner k to k + 1; -1 unless just one is there, and wound the same way."""
    start, end = triangles.ravel(), np.roll(triangles, -1, 1).ravel()
    edge = np.minimum(start, end).astype(np.int64) * (int(triangles.max(initial=0)) + 1) + np.maximum(start, end)
    order = np.argsort(edge, kind="stable")
    _, first, count = np.unique(edge[order], return_index=True, return_counts=True)
    one, other = order[first[count == 2]], order[first[count == 2] + 1]
    opposite = (start[one] == end[other]) & (start[one] != end[one])
    one, other = one[opposite], other[opposite]
    result = np.full(len(start), -1, np.int32)
    result[one], result[other] = other // 3, one // 3
    return result.reshape(-1, 3)


def patches_of(surface: Surface) -> Patches:
    """Triangles whose middles share a cell of space and whose normals share one of the sphere."""
    cell = np.floor(np.c_[surface.corners.mean(1) / SIDE, surface.n / TURN + 0.5]).astype(np.int64)
    key = np.zeros(len(cell), np.int64)
    for values in cell.T:
        low = int(values.min(initial=0))
        key = key * (int(values.max(initial=0)) - low + 1) + values - low
    _, of, count = np.unique(key, return_inverse=True, return_counts=True)
    of = of.reshape(-1)
    corners = surface.corners
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    mean = np.stack([np.bincount(of, across[:, d], len(count)) for d in range(3)], -1)
    length = np.linalg.norm(mean, axis=-1, keepdims=True)
    n = np.where(length > 0, mean / np.where(length > 0, length, 1), [0.0, 0.0, 1.0])
    begin = np.concatenate([[0], np.cumsum(count)])
    member = np.argsort(of, kind="stable").astype(np.int32)
    return Patches(of.astype(np.int32), begin, member, np.stack([n, *tangent_frame(n)], 1))


def tree_over(corners: NDArray[np.float64]) -> Tree:
    """A binary tree of boxes over triangles along a Morton curve."""
    low, high = corners.min(1), corners.max(1)  # (F, 3)
    middle = (low + high) / 2
    size = np.maximum(np.ptp(middle, axis=0).max(), np.finfo(float).tiny)
    code = np.zeros(len(middle), np.int64)
    for axis, line in enumerate(((middle - middle.min(0)) / size * 0xFFFFF).astype(np.int64).T):
        for bit in range(20):
            code |= ((line >> bit) & 1) << (3 * bit + axis)
    leaves = 1 << max(0, math.ceil(math.log2(max(1, len(code) / LEAF))))
    order = np.full(leaves * LEAF, -1, np.int32)
    place = (np.arange(len(code)) * len(order)) // max(1, len(code))  # evenly, so that no part of the tree is empty
    order[place] = np.argsort(code, kind="stable")
    bound = np.full((2, leaves * LEAF, 3), np.inf)
    bound[1] = -np.inf
    bound[0][order >= 0], bound[1][order >= 0] = low[order[order >= 0]], high[order[order >= 0]]
    levels = [np.stack([bound[0].reshape(leaves, LEAF, 3).min(1), bound[1].reshape(leaves, LEAF, 3).max(1)])]
    while levels[-1].shape[1] > 1:
        pairs = levels[-1].reshape(2, -1, 2, 3)
        levels.append(np.stack([pairs[0].min(1), pairs[1].max(1)]))
    low, high = np.concatenate([np.zeros((2, 1, 3)), *reversed(levels)], 1)
    full = (low <= high).all(-1)
    boxes = np.full((len(low), 7), -1.0)
    boxes[full, :3] = (low + high)[full] / 2
    boxes[full, 3:6] = (high - low)[full] / 2 * (1 + 1e-6) + 1e-7
    boxes[full, 6] = np.linalg.norm(boxes[full, 3:6], axis=-1)
    return Tree(boxes, order)


@inline
def sector(x, y):  # type: ignore[no-untyped-def]
    """Which sector a direction of azimuth (x, y) lies in."""
    a, b = abs(x), abs(y)
    quarter = min(int(np.float32(4) * b / max(a + b, np.float32(1e-30))), 3)
    return quarter + (4 if x < 0 else 0) + (8 if y < 0 else 0)


@compiled
def _edges():  # type: ignore[no-untyped-def]
    """Unit vectors along both edges of each sector: twice x and y, (2, 2, SECTORS)."""
    result = np.empty((2, 2, SECTORS))
    for k in range(SECTORS):
        for i in range(2):
            b = (k % 4 + i) / 4
            a = 1 - b
            length = math.sqrt(a * a + b * b)
            result[i, 0, k] = (-a if k & 4 else a) / length
            result[i, 1, k] = (-b if k & 8 else b) / length
    return result


@compiled
def _farthest(edges, x, y, result):  # type: ignore[no-untyped-def]
    """How far (x, y) reaches along the directions of each sector, at most."""
    for k in range(SECTORS):
        result[k] = max(edges[0, 0, k] * x + edges[0, 1, k] * y, edges[1, 0, k] * x + edges[1, 1, k] * y)
    result[sector(x, y)] = math.sqrt(x * x + y * y)


@inline
def _to_segment(ax, ay, bx, by):  # type: ignore[no-untyped-def]
    """Distance of the origin from a segment in the plane."""
    ux, uy = bx - ax, by - ay
    u2 = ux * ux + uy * uy
    s = min(max(-(ax * ux + ay * uy) / u2, 0.0), 1.0) if u2 > 0 else 0.0
    x, y = ax + s * ux, ay + s * uy
    return math.sqrt(x * x + y * y)


@inline
def _to_triangle(flat):  # type: ignore[no-untyped-def]
    """Distance of the origin from a triangle in the plane, 0 inside. Args: (3, 2 or more)."""
    least, left, right = 1e30, False, False
    for k in range(3):
        j = (k + 1) % 3
        least = min(least, _to_segment(flat[k, 0], flat[k, 1], flat[j, 0], flat[j, 1]))
        turn = flat[k, 0] * flat[j, 1] - flat[k, 1] * flat[j, 0]
        left |= turn > 0
        right |= turn < 0
    return least if left and right else 0.0


@compiled
def _flatten(corners, centre, frame, flat):  # type: ignore[no-untyped-def]
    """A triangle's corners along t, b and n of a frame. Args: flat: (3, 3), written."""
    for k in range(3):
        x, y, z = corners[k, 0] - centre[0], corners[k, 1] - centre[1], corners[k, 2] - centre[2]
        for d in range(3):
            e = (d + 1) % 3
            flat[k, d] = x * frame[e, 0] + y * frame[e, 1] + z * frame[e, 2]


@compiled
def _horizons(surface, patches, tree, which, sine):  # type: ignore[no-untyped-def]
    """Horizons of some patches. Args: sine: of a `Skyline`, rows `which` written."""
    edges, stamp = _edges(), np.full(len(surface.n), -1, np.int32)
    tangent, found = np.empty(SECTORS), np.empty(len(surface.n), np.int32)
    for c in which:
        members = patches.member[patches.begin[c] : patches.begin[c + 1]]
        sine[c] = CLOSED
        centre, reach, low, slope = _extent(surface, members, patches.frame[c])
        if reach < 0:
            continue
        tangent[:] = 0
        circle = _follow(surface, members, patches.frame[c], centre, (reach, slope), edges, c, stamp, found, tangent)
        limits = reach, low, circle
        if circle < 0 or not _look_around(surface, tree, patches.frame[c], centre, limits, edges, c, stamp, tangent):
            continue
        for k in range(SECTORS):
            if tangent[k] < STEEPEST:
                up = tangent[k] + MARGIN
                sine[c, k] = min(int(255 * up / math.sqrt(1 + up * up)) + 1, CLOSED)


@compiled
def _extent(surface, members, frame):  # type: ignore[no-untyped-def]
    """A patch's middle; the radius around it within which rays start, -1 if it leans too far; its lowest point over its plane
    through the middle; the steepest slope out of which its normals still lead."""
    lowest, highest = np.full(3, 1e30), np.full(3, -1e30)
    for f in members:
        for k in range(3):
            for d in range(3):
                lowest[d] = min(lowest[d], surface.corners[f, k, d])
                highest[d] = max(highest[d], surface.corners[f, k, d])
    centre, flat = (lowest + highest) / 2, np.empty((3, 3))
    reach, low, slope, n = 0.0, 1e30, 1e30, frame[0]
    for f in members:
        if not surface.n[f, 0] * n[0] + surface.n[f, 1] * n[1] + surface.n[f, 2] * n[2] > STEEP:
            return centre, -1.0, low, slope
        _flatten(surface.corners[f], centre, frame, flat)
        for k in range(3):
            reach = max(reach, math.sqrt(flat[k, 0] ** 2 + flat[k, 1] ** 2) + surface.lift[f])
            low = min(low, flat[k, 2])
            m = surface.normals[f, k]
            up = m[0] * n[0] + m[1] * n[1] + m[2] * n[2]
            if surface.lift[f] > SLACK:
                slope = min(slope, max(up, 0.0) / math.sqrt(max(1 - up * up, 1e-12)))
    return centre, reach + 10 * SLACK, low, slope


@compiled
def _follow(surface, members, frame, centre, limits, edges, c, stamp, found, tangent):  # type: ignore[no-untyped-def]
    """Follow the surface around a patch and raise the horizon over it.

    Args: limits: radius of the patch and steepest slope. c: the patch, with which `stamp` marks what is found. found: scratch.
    Returns: the radius of the circle that is covered, 0 for none, or -1 where nothing is known.
    """
    reach, slope = limits
    n, t, b = frame[0], frame[1], frame[2]
    flat, along, ahead = np.empty((3, 3)), np.empty(SECTORS), np.empty(SECTORS)
    circle, count, done = CIRCLE * reach, 1, 0
    found[0], stamp[members[0]] = members[0], c
    while done < count and circle > reach:
        f = found[done]
        done += 1
        _flatten(surface.corners[f], centre, frame, flat)
        for k in range(3):
            j = (k + 1) % 3
            distance = _to_segment(flat[k, 0], flat[k, 1], flat[j, 0], flat[j, 1])
            if distance >= circle:
                continue
            g = surface.next[f, k]
            if g < 0 or not surface.n[g, 0] * n[0] + surface.n[g, 1] * n[1] + surface.n[g, 2] * n[2] > STEEP:
                circle = distance
            elif stamp[g] != c:
                stamp[g] = c
                found[count] = g
                count += 1
    if circle <= reach:
        for i in range(count):
            stamp[found[i]] = -1
        return 0.0
    for f in members:
        if stamp[f] != c:
            return -1.0
    for i in range(count):
        f = found[i]
        _flatten(surface.corners[f], centre, frame, flat)
        if _to_triangle(flat) >= circle:
            continue
        m = surface.n[f]
        up = m[0] * n[0] + m[1] * n[1] + m[2] * n[2]
        x, y = -(m[0] * t[0] + m[1] * t[1] + m[2] * t[2]) / up, -(m[0] * b[0] + m[1] * b[1] + m[2] * b[2]) / up
        if x * x + y * y > slope * slope:
            return -1.0
        _ahead(edges, flat, ahead, along)
        _farthest(edges, x, y, along)
        for s in range(SECTORS):
            if ahead[s] >= -reach:
                tangent[s] = max(tangent[s], along[s])
    return circle


@compiled
def _look_around(surface, tree, frame, centre, limits, edges, c, stamp, tangent):  # type: ignore[no-untyped-def]
    """Raise the horizon of a patch over what lies beyond its circle.

    Args: limits: radius of the patch, its lowest point and the circle.
    Returns: whether anything is open.
    """
    reach, low, circle = limits
    n, t, b = frame[0], frame[1], frame[2]
    flat, along, corner = np.empty((3, 3)), np.empty(SECTORS), np.empty(SECTORS)
    stack, depth, leaves = np.empty(64, np.int64), 1, len(tree.boxes) // 2
    stack[0] = 1
    while depth > 0:
        depth -= 1
        node = stack[depth]
        box = tree.boxes[node]
        if box[6] < 0:
            continue
        vx, vy, vz = box[0] - centre[0], box[1] - centre[1], box[2] - centre[2]
        top = vx * n[0] + vy * n[1] + vz * n[2] + box[3] * abs(n[0]) + box[4] * abs(n[1]) + box[5] * abs(n[2])
        if top - low <= SLACK:
            continue
        x, y = vx * t[0] + vy * t[1] + vz * t[2], vx * b[0] + vy * b[1] + vz * b[2]
        distance = math.sqrt(x * x + y * y)
        gap = distance - box[6] - reach
        if gap > 0:
            _farthest(edges, x, y, along)
            small = box[6] < NARROW * gap
            if _raise(along, _within(distance, box[6] + reach), (top - low) / gap, small, tangent) or small:
                continue
        if node < leaves:
            first, second = 0.0, 0.0
            for d in range(3):
                first += (tree.boxes[2 * node, d] - centre[d]) ** 2
                second += (tree.boxes[2 * node + 1, d] - centre[d]) ** 2
            nearer = 1 if first < second else 0  # is taken first, so that the horizon is high when the others come
            stack[depth], stack[depth + 1] = 2 * node + nearer, 2 * node + 1 - nearer
            depth += 2
            continue
        for i in range((node - leaves) * LEAF, (node - leaves + 1) * LEAF):
            f = tree.order[i]
            if f < 0:
                continue
            _flatten(surface.corners[f], centre, frame, flat)
            top = max(flat[0, 2], flat[1, 2], flat[2, 2])
            if top - low <= SLACK:
                continue
            nearest, farthest = _to_triangle(flat), 0.0
            x, y = (flat[0, 0] + flat[1, 0] + flat[2, 0]) / 3, (flat[0, 1] + flat[1, 1] + flat[2, 1]) / 3
            size = 0.0
            for k in range(3):
                farthest = max(farthest, math.sqrt(flat[k, 0] ** 2 + flat[k, 1] ** 2))
                size = max(size, math.sqrt((flat[k, 0] - x) ** 2 + (flat[k, 1] - y) ** 2))
            if stamp[f] == c:
                if farthest <= circle:
                    continue
                nearest = max(nearest, circle)
            if nearest <= reach:
                return False
            distance = math.sqrt(x * x + y * y)
            if distance > size + reach:
                _farthest(edges, x, y, along)
                least = _within(distance, size + reach)
            else:
                _ahead(edges, flat, along, corner)
                least = -reach
            _raise(along, least, (top - low) / (nearest - reach), True, tangent)
    return True


@inline
def _within(distance, size):  # type: ignore[no-untyped-def]
    """How far a disc's middle reaches at least along a direction that meets the disc."""
    return math.sqrt(distance * distance - size * size) - MARGIN * distance


@compiled
def _ahead(edges, flat, result, corner):  # type: ignore[no-untyped-def]
    """How far a triangle reaches along the directions of each sector, at most. Args: corner: scratch."""
    result[:] = -1e30
    for k in range(3):
        _farthest(edges, flat[k, 0], flat[k, 1], corner)
        for s in range(SECTORS):
            result[s] = max(result[s], corner[s])


@compiled
def _raise(along, least, rise, now, tangent):  # type: ignore[no-untyped-def]
    """Raise the horizon to a tangent in the sectors that reach far enough `along` what rises, if `now`.

    Returns: whether it is as high there already.
    """
    hidden = True
    for k in range(SECTORS):
        if along[k] >= least and tangent[k] < rise:
            hidden = False
            if now:
                tangent[k] = rise
    return hidden
