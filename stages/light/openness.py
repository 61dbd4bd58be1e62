"""How much light of an even environment reaches a point: the cosine-weighted share of its hemisphere that is free.

Rays are unbounded: what reads the result, glTF's occlusion, dims the light of an environment, which is infinitely far.
A point looks out from where `light transport` does, about the normal that is shaded with, less what a normal map adds.

Cosine-weighted directions over a hemisphere are points spread evenly over a unit disc, seen from above (Nusselt 1928). The fast
form draws rays there, the slow one paints the mesh onto it in float64.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core.frames import tangent_frame
from stages.core.parallel import compiled, in_parallel
from stages.light.gbuffer import facing
from stages.light.scene import OFFSET, Scene

PATTERNS = 16
"""Sets of directions that complement one another: together they are spread as evenly as one set of all their rays."""

RAYS_PER_TASK = 1 << 17


@dataclass(frozen=True)
class Lookouts:
    """Where points look out from. origin: (P, 3). frame: (P, 3, 3) tangent, bitangent and normal, row by row; float32."""

    origin: NDArray[np.float32]
    frame: NDArray[np.float32]

    @staticmethod
    def of(scene: Scene, triangle: NDArray, barycentric: NDArray, side: float = 1.0) -> "Lookouts":
        """From points of the surface. Args: (P,), (P, 3). side: 1 for the front of the triangles, -1 for the back."""
        ng = side * scene.geometric_normal(triangle)
        n = facing(side * scene.smooth_normal(triangle, barycentric), ng)
        origin = _not_through_walls(scene, triangle, barycentric, np.full(len(triangle), side), ng)
        return Lookouts(origin, np.stack([*tangent_frame(n), n], 1).astype(np.float32))


def _not_through_walls(
    scene: Scene, triangle: NDArray, barycentric: NDArray, side: NDArray, ng: NDArray
) -> NDArray[np.float32]:
    """Origins on the smooth surface, but no farther from the triangle than half-way to what stands above it.

    A bolt of eight sides in a hole of eight would else look out from inside the wall around it.
    """
    flat = scene.point(triangle, barycentric) + OFFSET * ng
    lift = scene.ray_origin(triangle, barycentric, side) - flat
    lifted = np.flatnonzero((lift**2).sum(-1) > (0.1 * OFFSET) ** 2)
    hit = scene.intersect(flat[lifted], lift[lifted])
    share = np.ones(len(flat), np.float32)
    share[lifted] = np.where(hit.mask, np.minimum(hit.t / 2, 1), 1)
    return (flat + share[:, None] * lift).astype(np.float32)


def openness(scene: Scene, lookouts: Lookouts, pattern: NDArray, rays: int) -> NDArray[np.float32]:
    """Share of the hemisphere that is free, by rays.

    Args:
        pattern: (P,) which of the complementary sets of directions each point uses, any integer. rays: of each point.
    Returns:
        (P,) in [0, 1].
    """
    directions = np.stack([disc_directions(rays, k) for k in range(PATTERNS)])
    result = np.empty(len(pattern), np.float32)
    step = max(1, RAYS_PER_TASK // rays)

    def part(start: int) -> None:
        rows = slice(start, start + step)
        origin, frame = lookouts.origin[rows], lookouts.frame[rows]
        wi = np.empty((len(origin), rays, 3), np.float32)
        _to_world(directions, pattern[rows] % PATTERNS, frame, wi)
        blocked = scene.occluded(np.repeat(origin, rays, 0), wi.reshape(-1, 3))
        result[rows] = 1 - blocked.reshape(-1, rays).mean(1)

    in_parallel(part, range(0, len(result), step))
    return result


def disc_directions(count: int, pattern: int) -> NDArray[np.float32]:
    """Cosine-weighted directions (count, 3), z up: rings of equal area, angles by the golden section, shifted by pattern."""
    k = np.arange(count)
    ring = (k + (_reversed_bits(pattern) + 0.5 / PATTERNS)) / count
    angle = 2 * np.pi * ((k * (5**0.5 - 1) / 2 + pattern / PATTERNS) % 1)
    return np.stack([np.sqrt(ring) * np.cos(angle), np.sqrt(ring) * np.sin(angle), np.sqrt(1 - ring)], -1).astype(np.float32)


def _reversed_bits(pattern: int) -> float:
    return int(f"{pattern:04b}"[::-1], 2) / PATTERNS


@compiled
def _to_world(directions, pattern, frame, wi):  # type: ignore[no-untyped-def]
    for p in range(len(wi)):
        for r in range(wi.shape[1]):
            x, y, z = directions[pattern[p], r]
            for k in range(3):
                wi[p, r, k] = x * frame[p, 0, k] + y * frame[p, 1, k] + z * frame[p, 2, k]


def reference_openness(scene: Scene, lookouts: Lookouts, cells: int) -> NDArray[np.float64]:
    """The same in float64 without rays: every triangle is painted onto the disc, whose free cells are counted.

    Args:
        cells: across the disc. A cell is covered where its centre is, so the error is of the order of one in cells.
    Returns:
        (P,).
    """
    corners = scene.vertices[scene.triangles].astype(np.float64)
    result = np.empty(len(lookouts.origin))

    def part(row: int) -> None:
        covered = np.zeros((cells, cells), np.bool_)
        origin, frame = lookouts.origin[row].astype(np.float64), lookouts.frame[row].astype(np.float64)
        result[row] = _free_share(corners, origin, frame, covered)

    in_parallel(part, range(len(result)))
    return result


@compiled
def _free_share(corners, origin, frame, covered):  # type: ignore[no-untyped-def]
    """Paint triangles (F, 3, 3), seen from origin, onto the disc; the share of its cells that stay free."""
    cells = len(covered)
    local = np.empty((3, 3))
    planes = np.empty((3, 3))
    for f in range(len(corners)):
        for k in range(3):
            dx, dy, dz = corners[f, k, 0] - origin[0], corners[f, k, 1] - origin[1], corners[f, k, 2] - origin[2]
            for axis in range(3):
                local[k, axis] = frame[axis, 0] * dx + frame[axis, 1] * dy + frame[axis, 2] * dz
        if max(local[0, 2], local[1, 2], local[2, 2]) <= 0:
            continue
        for k in range(3):
            a, b = local[k], local[(k + 1) % 3]
            planes[k, 0] = a[1] * b[2] - a[2] * b[1]
            planes[k, 1] = a[2] * b[0] - a[0] * b[2]
            planes[k, 2] = a[0] * b[1] - a[1] * b[0]
        volume = planes[0, 0] * local[2, 0] + planes[0, 1] * local[2, 1] + planes[0, 2] * local[2, 2]
        if volume == 0:  # edge-on
            continue
        if volume < 0:
            planes[:] = -planes
        x0, x1, y0, y1 = _bounds(local)
        for i in range(max(int((y0 + 1) / 2 * cells - 0.5), 0), min(int((y1 + 1) / 2 * cells + 0.5) + 1, cells)):
            y = (i + 0.5) / cells * 2 - 1
            for j in range(max(int((x0 + 1) / 2 * cells - 0.5), 0), min(int((x1 + 1) / 2 * cells + 0.5) + 1, cells)):
                if covered[i, j]:
                    continue
                x = (j + 0.5) / cells * 2 - 1
                z2 = 1 - x * x - y * y
                if z2 <= 0:
                    continue
                z = np.sqrt(z2)
                inside = True
                for k in range(3):
                    inside = inside and planes[k, 0] * x + planes[k, 1] * y + planes[k, 2] * z >= 0
                covered[i, j] = inside
    free, total = 0, 0
    for i in range(cells):
        for j in range(cells):
            x, y = (j + 0.5) / cells * 2 - 1, (i + 0.5) / cells * 2 - 1
            if x * x + y * y < 1:
                total += 1
                free += not covered[i, j]
    return free / total


@compiled
def _bounds(local):  # type: ignore[no-untyped-def]
    """Bounds in x and y of the directions to a triangle, from a cone around its corners."""
    ax, ay, az, length = 0.0, 0.0, 0.0, np.empty(3)
    for k in range(3):
        length[k] = np.sqrt(local[k, 0] ** 2 + local[k, 1] ** 2 + local[k, 2] ** 2)
        if length[k] == 0:
            return -1.0, 1.0, -1.0, 1.0
        ax, ay, az = ax + local[k, 0] / length[k], ay + local[k, 1] / length[k], az + local[k, 2] / length[k]
    total = np.sqrt(ax * ax + ay * ay + az * az)
    if total < 1e-3:
        return -1.0, 1.0, -1.0, 1.0
    least = 1.0
    for k in range(3):
        least = min(least, (local[k, 0] * ax + local[k, 1] * ay + local[k, 2] * az) / (length[k] * total))
    if least <= 0.0:
        return -1.0, 1.0, -1.0, 1.0
    spread = np.arccos(min(least, 1.0)) + 1e-9
    tx, ty = np.arccos(min(max(ax / total, -1.0), 1.0)), np.arccos(min(max(ay / total, -1.0), 1.0))
    return (
        np.cos(min(tx + spread, np.pi)), np.cos(max(tx - spread, 0.0)),
        np.cos(min(ty + spread, np.pi)), np.cos(max(ty - spread, 0.0)),
    )
