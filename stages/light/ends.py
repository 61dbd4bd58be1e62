"""Where the blocked rays of a view's points end: what of the object each point sees, beside the light that it sees directly.

Rays are those of the transport's lobes and of the mirror. One that is blocked tells the side of a cell (`stages.light.cells`)
that it ends on, and along which direction a mirror there would look; those of narrow lobes and of the mirror are followed:
they also tell what that one would see, the open or another side, and one there. That is all that `stages.light.own_light` must
know to say what comes along the ray, whatever the object is made of: wide lobes see no gloss sharper than what the side's own
rays show.

Directions are kept in two 16-bit numbers on the octahedral square. Normal maps do not turn the mirrors that other points
show, and what other objects of a scene block stays dark.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled
from stages.light.cells import Cells, part_of
from stages.light.octahedral import direction_to_square
from stages.light.scene import OFFSET, Scene
from stages.light.transport_kernels import on_square

OPEN, DARK = 65535, 65534
"""In place of the number of a side: the open, and another object."""

STEPS = 65535
"""Steps of a direction along each side of the octahedral square."""


@dataclass(frozen=True)
class Ends:
    """Ends of R rays of P points, point after point: the blocked ones, or all where so asked.

    start: (P + 1,) where a point's rays begin. followed: (P,) how many of them, the last ones, are followed: M in all. scale:
    (P, J) of the cosine lobe and each glossy one, what makes the weights of all rays those of an open point. side: (R,) where a
    ray ends. towards, onward: (R, 2) direction of the ray, and of a mirror where it ends. lobe: (M,) by which glossy lobe one
    that is followed was drawn, from 1, or 0 of the mirror's, its point's last one. second, third: (M,) where a mirror at its
    end looks, and where one there. beyond: (M, 2) direction of the latter.
    """

    start: NDArray[np.int32]
    followed: NDArray[np.uint8]
    scale: NDArray[np.float16]
    side: NDArray[np.uint16]
    towards: NDArray[np.uint16]
    onward: NDArray[np.uint16]
    lobe: NDArray[np.uint8]
    second: NDArray[np.uint16]
    third: NDArray[np.uint16]
    beyond: NDArray[np.uint16]

    @property
    def rays(self) -> tuple[NDArray[np.uint16], ...]:
        """What is known of each ray."""
        return self.side, self.towards, self.onward

    @property
    def far(self) -> "tuple[NDArray[np.uint8], NDArray[np.uint16], NDArray[np.uint16], NDArray[np.uint16]]":
        """What is known of each ray that is followed beside that."""
        return self.lobe, self.second, self.third, self.beyond

    @property
    def nbytes(self) -> int:
        """Memory of it all."""
        arrays: tuple[NDArray, ...] = (self.start, self.followed, self.scale, *self.rays, *self.far)
        return sum(array.nbytes for array in arrays)

    @property
    def mirror(self) -> NDArray[np.bool_]:
        """Whether each point's last ray is its mirror's, (P,)."""
        some = np.flatnonzero(self.followed)
        result = np.zeros(len(self.followed), np.bool_)
        result[some] = self.lobe[self.far_start[some + 1] - 1] == 0
        return result

    def __getitem__(self, rows: NDArray[np.int64]) -> "Ends":
        """Those of some points; -1 is the last."""
        rows = rows % len(self.followed)
        start = np.concatenate([[0], np.cumsum(np.diff(self.start)[rows])]).astype(np.int32)
        followed = self.followed[rows]
        of_rays = tuple(np.empty((start[-1], *a.shape[1:]), a.dtype) for a in self.rays)
        of_far = tuple(np.empty((followed.sum(dtype=np.int64), *a.shape[1:]), a.dtype) for a in self.far)
        _take(rows, self.start, self.far_start, (self.rays, self.far), (of_rays, of_far))
        return Ends(start, followed, self.scale[rows], *of_rays, *of_far)

    @property
    def far_start(self) -> NDArray[np.int64]:
        """Where each point's rays begin among those that are followed, (P + 1,)."""
        return np.concatenate([[0], np.cumsum(self.followed, dtype=np.int64)])

    def numbers(self, rows: NDArray[np.int64]) -> NDArray[np.int64]:
        """Which rays are those of some points, in their order."""
        count = np.diff(self.start)[rows]
        return np.arange(count.sum()) + (self.start[:-1][rows] - np.cumsum(count) + count).repeat(count)

    @staticmethod
    def cat(parts: Sequence["Ends"]) -> "Ends":
        """Those of the points of all parts."""
        before = np.cumsum([0, *(len(part.side) for part in parts[:-1])])
        start = np.concatenate([[0], *(part.start[1:] + n for part, n in zip(parts, before, strict=True))])
        rest = ((part.followed, part.scale, *part.rays, *part.far) for part in parts)
        return Ends(start.astype(np.int32), *(np.concatenate(arrays) for arrays in zip(*rest, strict=True)))

    def to_arrays(self) -> dict[str, NDArray]:
        """As `core.schemas.ENDS` has them: directions of wide lobes, which see nothing sharp, in 8 bits, the others in 16."""
        far = _far(self.start, self.followed)
        arrays: dict[str, NDArray] = {"start": self.start, "followed": self.followed, "scale": self.scale}
        arrays |= {"side": self.side, "lobe": self.lobe, "second": self.second, "third": self.third, "far_beyond": self.beyond}
        for name in ("towards", "onward"):
            steps = getattr(self, name)
            arrays[f"lobe_{name}"] = np.rint(steps[~far] / (STEPS / 255)).astype(np.uint8)
            arrays[f"far_{name}"] = steps[far]
        return arrays

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray]) -> "Ends":
        """The inverse of `to_arrays`."""
        start, followed = arrays["start"], arrays["followed"]
        far = _far(start, followed)
        directions: list[NDArray] = []
        for name in ("towards", "onward"):
            steps = np.empty((len(far), 2), np.uint16)
            steps[~far] = arrays[f"lobe_{name}"].astype(np.uint16) * np.uint16(STEPS // 255)
            steps[far] = arrays[f"far_{name}"]
            directions.append(steps)
        rest = (arrays[name] for name in ("lobe", "second", "third", "far_beyond"))
        return Ends(start, followed, arrays["scale"], arrays["side"], *directions, *rest)

    @staticmethod
    def none(points: int, lobes: int = 0) -> "Ends":
        """Of points that see nothing of the object. Args: lobes: J."""
        short, pair = np.zeros(0, np.uint16), np.zeros((0, 2), np.uint16)
        each = np.zeros(points + 1, np.int32), np.zeros(points, np.uint8), np.zeros((points, lobes), np.float16)
        return Ends(*each, short, pair, pair, short.astype(np.uint8), short, short, pair)


@compiled
def _take(rows, start, far_start, arrays, out):  # type: ignore[no-untyped-def]
    """The rays of some points, and those that are followed, written to `out` after each other."""
    side, towards, onward = arrays[0]
    lobe, second, third, beyond = arrays[1]
    new_side, new_towards, new_onward = out[0]
    new_lobe, new_second, new_third, new_beyond = out[1]
    k, m = 0, 0
    for row in rows:
        for i in range(start[row], start[row + 1]):
            new_side[k] = side[i]
            new_towards[k, 0], new_towards[k, 1] = towards[i, 0], towards[i, 1]
            new_onward[k, 0], new_onward[k, 1] = onward[i, 0], onward[i, 1]
            k += 1
        for i in range(far_start[row], far_start[row + 1]):
            new_lobe[m], new_second[m], new_third[m] = lobe[i], second[i], third[i]
            new_beyond[m, 0], new_beyond[m, 1] = beyond[i, 0], beyond[i, 1]
            m += 1


def _far(start: NDArray[np.int32], followed: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Which rays are followed (R,)."""
    back = start[1:].repeat(np.diff(start)) - np.arange(start[-1])  # 1 at a point's last one
    return back <= followed.repeat(np.diff(start))


def find_ends(
    scene: Scene, cells: Cells, scale: NDArray, found: tuple[NDArray, NDArray, NDArray], origin: NDArray, direction: NDArray
) -> Ends:
    """Follow some rays, ordered by their points.

    Args:
        scale: (P, J), of `Ends`. found: (R,) each, the number of a ray's point, ascending; its lobe if it is followed further,
        see `Ends`, such rays last among their point's, or -1; whether anything blocks it. origin, direction: (R, 3).
    """
    (point, lobe, blocked), points = found, len(scale)
    hit = np.flatnonzero(blocked)
    side, first = np.full(len(point), OPEN, np.uint16), np.zeros((len(point), 3), np.float32)
    side[hit], start, first[hit] = _mirrored(scene, cells, origin[hit], direction[hit])
    far = np.flatnonzero(lobe >= 0)
    second, third = np.full((2, len(far)), OPEN, np.uint16)
    beyond = np.zeros((len(far), 3), np.float32)
    own = np.flatnonzero(side[far] < DARK)
    begin = start[np.searchsorted(hit, far[own])]
    second[own], begin, beyond[own] = _mirrored(scene, cells, begin, first[far[own]])
    again = second[own] < DARK
    third[own[again]] = _mirrored(scene, cells, begin[again], beyond[own[again]])[0]
    followed = np.bincount(point[far], minlength=points).astype(np.uint8)
    begins = np.concatenate([[0], np.cumsum(np.bincount(point, minlength=points))]).astype(np.int32)
    towards, onward, last = (on_steps(np.ascontiguousarray(d, np.float32)) for d in (direction, first, beyond))
    each = (begins, followed, scale.astype(np.float16))
    return Ends(*each, side, towards, onward, lobe[far].astype(np.uint8), second, third, last)


def _mirrored(
    scene: Scene, cells: Cells, origin: NDArray, direction: NDArray
) -> tuple[NDArray[np.uint16], NDArray[np.float32], NDArray[np.float32]]:
    """Where some rays end, and from where and whereto a mirror there looks: (R,), (R, 3), (R, 3). Args: (R, 3) each."""
    triangle, barycentric = scene.ends(origin, direction)
    side = np.where(triangle == -2, DARK, OPEN).astype(np.uint16)
    start, onward = np.zeros((2, len(triangle), 3), np.float32)
    mesh = (scene.vertices, scene.triangles, scene.normals)
    towards = np.ascontiguousarray(direction, np.float32)
    _reflect(mesh, (cells.first, cells.cuts), triangle, barycentric, towards, side, start, onward)
    return side, start, onward


@compiled
def on_steps(directions):  # type: ignore[no-untyped-def]
    """Directions as two whole numbers. Args: (R, 3). Returns: (R, 2)."""
    result = np.empty((len(directions), 2), np.uint16)
    for i in range(len(directions)):
        u, v = direction_to_square(directions[i, 0], directions[i, 1], directions[i, 2])
        result[i, 0], result[i, 1] = round(u * STEPS), round(v * STEPS)
    return result


@compiled
def from_steps(steps):  # type: ignore[no-untyped-def]
    """The inverse of `on_steps`, its components one after the other: (3, R)."""
    result = np.empty((3, len(steps)), np.float32)
    for i in range(len(steps)):
        x, y, z = on_square(steps[i, 0] * np.float32(1 / STEPS), steps[i, 1] * np.float32(1 / STEPS))
        result[0, i], result[1, i], result[2, i] = x, y, z
    return result


@compiled(inline="always")
def _face(vertices, triangles, f):  # type: ignore[no-untyped-def]
    """Normal of a triangle by its winding, unit, and 0 for one without area."""
    a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
    ux, uy, uz = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2]
    vx, vy, vz = vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1], vertices[c, 2] - vertices[a, 2]
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = np.float32(np.sqrt(x * x + y * y + z * z))
    scale = np.float32(1) / length if length > 0 else np.float32(0)
    return x * scale, y * scale, z * scale


@compiled
def _reflect(mesh, cells, triangle, barycentric, direction, side, start, onward):  # type: ignore[no-untyped-def]
    """What a ray ends on, and where a mirror there looks from and to; rays that end on nothing, -1 or -2, are left alone."""
    vertices, triangles, normals = mesh
    first, cuts = cells
    for i in range(len(triangle)):
        f = triangle[i]
        if f < 0:
            continue
        b0, b1, b2 = barycentric[i, 0], barycentric[i, 1], barycentric[i, 2]
        gx, gy, gz = _face(vertices, triangles, f)
        dx, dy, dz = direction[i, 0], direction[i, 1], direction[i, 2]
        behind = gx * dx + gy * dy + gz * dz > 0
        side[i] = 2 * (first[f] + part_of(cuts[f], b0, b2)) + behind
        turned = np.float32(-1) if behind else np.float32(1)
        gx, gy, gz = gx * turned, gy * turned, gz * turned
        nx = (b0 * normals[f, 0, 0] + b1 * normals[f, 1, 0] + b2 * normals[f, 2, 0]) * turned
        ny = (b0 * normals[f, 0, 1] + b1 * normals[f, 1, 1] + b2 * normals[f, 2, 1]) * turned
        nz = (b0 * normals[f, 0, 2] + b1 * normals[f, 1, 2] + b2 * normals[f, 2, 2]) * turned
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        if length > 1e-3 and nx * dx + ny * dy + nz * dz < 0:
            nx, ny, nz = nx / length, ny / length, nz / length
        else:
            nx, ny, nz = gx, gy, gz
        twice = 2 * (nx * dx + ny * dy + nz * dz)
        rx, ry, rz = dx - twice * nx, dy - twice * ny, dz - twice * nz
        if rx * gx + ry * gy + rz * gz <= 0:  # behind the face: what its own plane mirrors
            twice = 2 * (gx * dx + gy * dy + gz * dz)
            rx, ry, rz = dx - twice * gx, dy - twice * gy, dz - twice * gz
        length = np.sqrt(rx * rx + ry * ry + rz * rz)
        rx, ry, rz = rx / length, ry / length, rz / length
        for d in range(3):
            p = b0 * vertices[triangles[f, 0], d] + b1 * vertices[triangles[f, 1], d] + b2 * vertices[triangles[f, 2], d]
            start[i, d] = p + np.float32(OFFSET) * (gx if d == 0 else gy if d == 1 else gz)
        onward[i, 0], onward[i, 1], onward[i, 2] = rx, ry, rz
