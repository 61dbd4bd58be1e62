"""How high anything stands over the triangles of a scene, all around: rays that rise higher meet nothing, and are not traced.

A horizon is told in 16 sectors of azimuth, for all points of a triangle at once. What is told may be too high, never too low:
boxes and balls around others are taken for no lower and no farther than they are, and what would take long to tell is taken for
a wall. To tell it takes as long as to trace some points' rays, so it is told of those triangles that many points are met on.

Source: Max 1988, "Horizon Mapping: Shadows for Bump-Mapped Surfaces".
"""

import math
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stages.core.frames import tangent_frame
from stages.core.parallel import compiled, in_parallel, slices
from stages.light.outermost import MARGIN, outermost

SECTORS = 16

WALL = 255
"""Of a sector in which everything may be hidden; another horizon is its sine times this, rounded up."""

LEAST = 0.2
"""Sine of the lowest horizon that is told, but for 0 where nothing stands over the plane at all."""

FLATTEST, STEEPEST = LEAST / math.sqrt(1 - LEAST**2), 5.0
"""Slopes: what is flatter is raised to that, what is steeper is a wall, for it leaves little of the sky."""

LEAF = 4
"""Triangles in a leaf of the tree."""

FAR, NEAR = 0.35, 0.7
"""Sines of the angle at which a box, and a triangle, are looked into: those that appear smaller are taken for a ball."""

VISITS = 1000
"""Boxes and triangles that are looked into for one triangle; then balls will do."""

PAYS = 16
"""Points met on a triangle from which on its horizon is told."""


class Frame(NamedTuple):
    """A triangle that others are seen from. axes: (3, 3) tangents and normal. centre: (3,) world. corners: (3, 3) in that
    frame. radius: of a ball around it."""

    axes: NDArray[np.float64]
    centre: NDArray[np.float64]
    corners: NDArray[np.float64]
    radius: float


class Tree(NamedTuple):
    """Boxes around triangles; box i holds 2 i + 1 and 2 i + 2. middle, half: (N, 3), a negative half is empty.

    slab: (N, 5), a unit normal, and the middle and half of the box's extent along it. order: (L LEAF,) triangles of the last L
    boxes, the leaves; -1 is none.
    """

    middle: NDArray[np.float64]
    half: NDArray[np.float64]
    slab: NDArray[np.float64]
    order: NDArray[np.int64]


class Mesh(NamedTuple):
    """Triangles, F in all. corners: (F, 3, 3) world. axes: (F, 3, 3) tangents and normal, 0 without area. ball: (F, 4), centre
    and radius."""

    corners: NDArray[np.float64]
    axes: NDArray[np.float64]
    ball: NDArray[np.float64]


class Horizons:
    """Horizons of the front sides of a scene's own triangles, told where it pays.

    Args:
        vertices: (V, 3) world. triangles: (F, 3). normals: (F, 3) unit, of triangles. others: vertices (CV, 3) and triangles
        (CF, 3) of what else stands in the way.
    """

    def __init__(self, vertices: NDArray, triangles: NDArray, normals: NDArray, others: tuple[NDArray, NDArray]) -> None:
        self._own, self._others = (vertices, triangles, normals), others
        self._lock, self._met = Lock(), np.zeros(len(triangles), np.int64)
        self._scene: tuple[Mesh, Tree] | None = None
        self.behind = np.full(len(triangles), WALL, np.uint8)
        """(F,) of the other sides, alike all around."""
        self.front = np.full((len(triangles), SECTORS), WALL, np.uint8)
        """(F, SECTORS), sectors counted from the first of `tangent_frame`'s axes to the second."""
        outer = outermost(vertices, triangles, others[0])
        self.front[outer[:, 0]], self.behind[outer[:, 1]] = 0, 0
        self._told = outer[:, 0]

    def meet(self, triangle: NDArray) -> None:
        """Points are met on these triangles, (P,): tell the horizons that pay by now."""
        with self._lock:
            self._met += np.bincount(triangle, minlength=len(self._met))
            rows = np.flatnonzero((self._met >= PAYS) & ~self._told)
            if len(rows):
                self._scene = self._scene or self._build()
                self.front[rows] = horizons(*self._scene, rows)
                self._told[rows] = True

    def _build(self) -> tuple[Mesh, Tree]:
        vertices, triangles, normals = self._own
        corners = np.concatenate([vertices[triangles], self._others[0][self._others[1]]]).astype(np.float64)
        axes = np.stack([*tangent_frame(normals), normals], 1).astype(np.float64)
        axes[~np.asarray(normals.any(-1))] = 0
        centre = corners.mean(1)
        radius = np.linalg.norm(corners - centre[:, None], axis=-1).max(1)
        return Mesh(corners, axes, np.c_[centre, radius]), tree_of(corners)


def horizons(mesh: Mesh, tree: Tree, rows: NDArray[np.int64]) -> NDArray[np.uint8]:
    """The horizons of some triangles' fronts: (R, SECTORS), see `WALL`."""
    result = np.empty((len(rows), SECTORS), np.uint8)
    in_parallel(lambda part: _horizons(mesh, tree, rows[part], result[part]), slices(len(rows), 2048))
    return result


def tree_of(corners: NDArray[np.float64]) -> Tree:
    """A tree over triangles (F, 3, 3), each box's halved along its longest side."""
    centre, count = corners.mean(1), len(corners)
    leaves = 1 << max(0, math.ceil(math.log2(count / LEAF)))
    order, boxes = np.arange(count), 1
    while boxes < leaves:
        start = np.arange(boxes) * count // boxes
        at, box = centre[order], np.searchsorted(start, np.arange(count), "right") - 1
        longest = (np.maximum.reduceat(at, start) - np.minimum.reduceat(at, start)).argmax(1)
        order = order[np.lexsort((at[np.arange(count), longest[box]], box))]
        boxes *= 2
    start = np.arange(leaves) * count // leaves
    leaf = np.searchsorted(start, np.arange(count), "right") - 1
    held = np.full((leaves, LEAF), -1, np.int64)
    held[leaf, np.arange(count) - start[leaf]] = order
    there = held[..., None, None] >= 0
    low, high = (np.where(there, corners[held], np.inf).min((1, 2)), np.where(there, corners[held], -np.inf).max((1, 2)))
    normal = (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[held] * there[..., 0]).sum(1)
    levels = [(low, high, normal)]
    while len(low) > 1:
        low, high, normal = low.reshape(-1, 2, 3).min(1), high.reshape(-1, 2, 3).max(1), normal.reshape(-1, 2, 3).sum(1)
        levels.append((low, high, normal))
    low, high, normal = (np.concatenate([level[k] for level in reversed(levels)]) for k in range(3))
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    empty = low > high
    middle, half = np.where(empty, 0, (low + high) / 2), np.where(empty, -1, (high - low) / 2)
    return Tree(middle, half, _slabs(corners, held.ravel(), normal), held.ravel())


@compiled
def _slabs(corners, order, normal):  # type: ignore[no-untyped-def]
    """`Tree.slab`. Args: normal: (N, 3) of the boxes."""
    boxes, first = len(normal), len(order) // LEAF - 1
    low, high, result = np.full(boxes, np.inf), np.full(boxes, -np.inf), np.empty((boxes, 5))
    for i in range(len(order)):
        box = first + i // LEAF if order[i] >= 0 else -1
        while box >= 0:
            for k in range(3):
                height = _dot(corners[order[i], k], normal[box])
                low[box], high[box] = min(low[box], height), max(high[box], height)
            box = (box + 1) // 2 - 1
    for box in range(boxes):
        result[box, :3], result[box, 3], result[box, 4] = normal[box], (low[box] + high[box]) / 2, (high[box] - low[box]) / 2
    return result


@compiled
def _dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def sector_of(x, y):  # type: ignore[no-untyped-def]
    """The sector of a direction, counted from +x towards +y."""
    a, b = abs(x), abs(y)
    tangent = np.float32(0.41421357)  # of 22.5 degrees
    sector = int(b > a * tangent) if b <= a else 2 + int(b * tangent > a)
    sector = 7 - sector if x < 0 else sector
    return 15 - sector if y < 0 else sector


@compiled
def _horizons(mesh, tree, rows, result):  # type: ignore[no-untyped-def]
    slope, waiting, other = np.empty(SECTORS), np.empty(64, np.int64), np.empty((3, 3))
    room = np.empty((4, 3)), np.empty(12), np.empty((12, 3))
    first = len(tree.order) // LEAF - 1
    for row in range(len(rows)):
        f = rows[row]
        axes, centre, radius = mesh.axes[f], mesh.ball[f, :3], mesh.ball[f, 3]
        own = Frame(axes, centre, _seen(mesh.corners[f], axes, centre, np.empty((3, 3))), radius)
        slope[:] = FLATTEST if axes.any() else np.inf
        lowest, visits, count = slope[0], 0, 1
        waiting[0] = 0
        while count > 0 and lowest < np.inf:
            count -= 1
            box = waiting[count]
            visits += 1
            if _passed(own, tree, box, slope, lowest, visits > VISITS):
                continue
            if visits > VISITS:
                slope[:] = np.inf
            elif box < first:
                near = 0.0
                for i in range(3):
                    near += (tree.middle[2 * box + 1, i] - centre[i]) ** 2 - (tree.middle[2 * box + 2, i] - centre[i]) ** 2
                waiting[count], waiting[count + 1] = 2 * box + (2 if near < 0 else 1), 2 * box + (1 if near < 0 else 2)
                count += 2  # the nearer one first, which hides more
            else:
                for i in range((box - first) * LEAF, (box - first + 1) * LEAF):
                    g = tree.order[i]
                    if g >= 0 and g != f:
                        _seen(mesh.corners[g], axes, centre, other)
                        if not _is_small(own, other, mesh.ball[g, 3], slope):
                            visits += 1
                            _raise_exactly(own.corners, other, slope, room)
            lowest = np.inf
            for s in range(SECTORS):
                slope[s] = np.inf if slope[s] > STEEPEST else slope[s]
                lowest = min(lowest, slope[s])
        for s in range(SECTORS):
            sine = slope[s] / math.sqrt(1 + slope[s] ** 2) if slope[s] < np.inf else 1.0
            result[row, s] = min(math.ceil(sine * WALL), WALL)


@compiled
def _seen(corners, axes, centre, result):  # type: ignore[no-untyped-def]
    """A triangle's corners in the frame of another. Args: corners: (3, 3). result: (3, 3), written."""
    for k in range(3):
        for d in range(3):
            result[k, d] = 0.0
            for i in range(3):
                result[k, d] += (corners[k, i] - centre[i]) * axes[d, i]
    return result


@compiled
def _passed(own, tree, box, slope, lowest, hurry):  # type: ignore[no-untyped-def]
    """Whether a box need not be looked into: nothing of it is over a triangle's horizon, or it was raised to the whole box.

    Args: slope: (SECTORS,), the horizon as slopes. lowest: of them. hurry: take any box as a whole that is not too near for it.
    """
    if tree.half[box, 0] < 0:
        return True
    n = own.axes[2]
    x, y, z, size, reach = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        away, half = tree.middle[box, i] - own.centre[i], tree.half[box, i]
        x, y, z = x + away * own.axes[0, i], y + away * own.axes[1, i], z + away * n[i]
        reach += abs(n[i]) * half
        size += half * half
    if z + reach <= MARGIN:
        return True
    slab = tree.slab[box]
    turn = _dot(n, slab[:3])
    height = z + reach  # at most; a patch that lies alike is lower than a box around it
    lean = max(1.0 - turn * turn, 0.0)
    if lean < 0.25:
        off = slab[3] - _dot(tree.middle[box], slab[:3])
        height = min(height, z + turn * off + abs(turn) * slab[4] + math.sqrt(lean * size))
        if height <= MARGIN:
            return True
    far, wide = math.sqrt(x * x + y * y), math.sqrt(size) + own.radius
    if far <= wide:
        return False
    rise = height / (far - wide)
    if rise <= lowest or _least(slope, x, y, wide / far) >= rise:
        return True
    if wide < FAR * far or hurry:
        _raise(slope, math.atan2(y, x) - math.asin(wide / far), math.atan2(y, x) + math.asin(wide / far), rise, 0.0, 0.0)
        return True
    return False


@compiled
def _is_small(own, other, radius, slope):  # type: ignore[no-untyped-def]
    """The same for a triangle in the frame of another, as far as a ball around it tells. Args: radius: of the ball."""
    highest = max(other[0, 2], other[1, 2], other[2, 2])
    if highest <= MARGIN:
        return True
    x, y = (other[0, 0] + other[1, 0] + other[2, 0]) / 3, (other[0, 1] + other[1, 1] + other[2, 1]) / 3
    far, wide = math.sqrt(x * x + y * y), radius + own.radius
    if far <= wide:
        return False
    rise = highest / (far - wide)
    if rise <= FLATTEST or _least(slope, x, y, wide / far) >= rise:
        return True
    if wide < NEAR * far:
        _raise(slope, math.atan2(y, x) - math.asin(wide / far), math.atan2(y, x) + math.asin(wide / far), rise, 0.0, 0.0)
        return True
    return False


@compiled
def _least(slope, x, y, sine):  # type: ignore[no-untyped-def]
    """The lowest horizon of the sectors within an angle, less than a right one, of a direction. Args: sine: of the angle."""
    middle = sector_of(x, y)
    least = slope[middle]
    for k in range(1, 2 + (sine > 0.3826) + (sine > 0.7071) + (sine > 0.9238)):
        least = min(least, slope[(middle + k) % SECTORS], slope[(middle - k) % SECTORS])
    return least


@compiled
def _raise(slope, begin, end, rise, px, py):  # type: ignore[no-untyped-def]
    """Raise the sectors of an azimuth, radians, to `rise`, or to what the plane z = px x + py y has there if that is lower and
    the plane not level."""
    width = 2 * math.pi / SECTORS
    low, high = math.floor(begin / width - 1e-5), math.floor(end / width + 1e-5)
    steepest, ahead = math.sqrt(px * px + py * py), math.atan2(py, px)
    for s in range(low, min(high, low + SECTORS - 1) + 1):
        bound = rise
        if steepest > 0:
            away = abs((s + 0.5) * width - ahead) % (2 * math.pi)
            away = max(min(away, 2 * math.pi - away) - width / 2 - 1e-5, 0.0)
            bound = min(rise, max(steepest * math.cos(away), 0.0))
        slope[s % SECTORS] = max(slope[s % SECTORS], bound)


@compiled
def _raise_exactly(own, other, slope, room):  # type: ignore[no-untyped-def]
    """Raise the horizon of a triangle to another. Args: own, other: (3, 3), corners in the former's frame. room: to work in."""
    px, py = _plane_in_front(own, other)
    if 0 < px * px + py * py <= FLATTEST * FLATTEST:
        return
    above, turn, ways = room
    count = _over_plane(other, above)
    gap, ax, ay = _gap(own, above[:count])
    if gap <= -1e-8:  # one hangs over the other
        slope[:] = np.inf
        return
    highest = 0.0
    many, begin, end = 0, math.pi, -math.pi
    for i in range(count):  # ways from the one to the other: all directions are sums of these
        highest = max(highest, above[i, 2])
        for j in range(3):
            x, y = above[i, 0] - own[j, 0], above[i, 1] - own[j, 1]
            if x * x + y * y > 1e-14:
                turn[many] = math.atan2(y * ax - x * ay, x * ax + y * ay)
                begin, end = min(begin, turn[many]), max(end, turn[many])
                ways[many, 0], ways[many, 1], ways[many, 2] = x, y, above[i, 2]
                many += 1
    towards = math.atan2(ay, ax)
    if gap > 1e-9 or px != 0 or py != 0:
        _raise(slope, towards + begin, towards + end, highest / gap if gap > 1e-9 else np.inf, px, py)
        return
    for i in range(many):
        for j in range(i):
            a, b = (i, j) if turn[i] < turn[j] else (j, i)
            _raise_between(slope, ways[a], ways[b], towards + turn[a], towards + turn[b])


@compiled
def _raise_between(slope, a, b, begin, end):  # type: ignore[no-untyped-def]
    """Raise the horizon to all directions between two, (3,) each, of azimuths `begin` and `end`."""
    if end - begin >= math.pi - 1e-5:
        _raise(slope, begin, end, np.inf, 0.0, 0.0)
        return
    steepest = 0.0
    for way in (a, b):
        steepest = max(steepest, way[2] / math.sqrt(way[0] * way[0] + way[1] * way[1]))
    nx, ny, nz = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    if steepest <= FLATTEST * math.cos((end - begin) / 2):
        return
    if nz > 1e-12:
        _raise(slope, begin, end, np.inf, -nx / nz, -ny / nz)
    else:
        _raise(slope, begin, end, steepest, 0.0, 0.0)


@compiled
def _plane_in_front(own, other):  # type: ignore[no-untyped-def]
    """(px, py) of the plane z = px x + py y + c of `other`, if it faces all rays' starts; else, or if it is level, 0."""
    ux, uy, uz = other[1, 0] - other[0, 0], other[1, 1] - other[0, 1], other[1, 2] - other[0, 2]
    vx, vy, vz = other[2, 0] - other[0, 0], other[2, 1] - other[0, 1], other[2, 2] - other[0, 2]
    mx, my, mz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    if mz < 0:
        mx, my, mz = -mx, -my, -mz
    if mz <= 1e-3 * math.sqrt(mx * mx + my * my + mz * mz):
        return 0.0, 0.0
    for k in range(3):
        start = 5 * MARGIN  # over the triangle
        if mx * (own[k, 0] - other[0, 0]) + my * (own[k, 1] - other[0, 1]) + mz * (start - other[0, 2]) < 0:
            return 0.0, 0.0
    return -mx / mz, -my / mz


@compiled
def _over_plane(other, above):  # type: ignore[no-untyped-def]
    """What of a triangle lies over the plane z = MARGIN. Args: above: (4, 3), written. Returns: corners written."""
    count = 0
    for k in range(3):
        a, b = other[k], other[(k + 1) % 3]
        if a[2] > MARGIN:
            above[count] = a
            count += 1
        if (a[2] > MARGIN) != (b[2] > MARGIN):
            above[count] = a + (MARGIN - a[2]) / (b[2] - a[2]) * (b - a)
            count += 1
    return count


@compiled
def _gap(own, above):  # type: ignore[no-untyped-def]
    """The widest gap between two polygons seen from above that their sides, and their middles, tell, and its direction."""
    gap, ax, ay = -np.inf, 1.0, 0.0
    count = len(above)
    for k in range(4 + count):
        if k < 3:
            x, y = own[(k + 1) % 3, 1] - own[k, 1], own[k, 0] - own[(k + 1) % 3, 0]
        elif k < 3 + count:
            i, j = k - 3, (k - 2) % count
            x, y = above[j, 1] - above[i, 1], above[i, 0] - above[j, 0]
        else:
            x, y = above[:, 0].sum(), above[:, 1].sum()  # from the middle of `own`, which is 0
        length = math.sqrt(x * x + y * y)
        if length < 1e-12:
            continue
        x, y = x / length, y / length
        least, most, near, far = np.inf, -np.inf, np.inf, -np.inf
        for i in range(3):
            at = own[i, 0] * x + own[i, 1] * y
            least, most = min(least, at), max(most, at)
        for i in range(count):
            at = above[i, 0] * x + above[i, 1] * y
            near, far = min(near, at), max(far, at)
        if near - most > gap:
            gap, ax, ay = near - most, x, y
        if least - far > gap:
            gap, ax, ay = least - far, -x, -y
    return gap, ax, ay
