"""Meshes that nobody means well with, as (vertices, triangles), and a campaign that takes `prep` through large ones.

`python -m tests.prep.hostile` (make hostile): 100,000 triangles of each kind within 30 s of CPU time, a million within
90 s, unwrapping, which has a limit of its own, not counted.
"""

import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.prep.shapes import cube, sphere

Mesh = tuple[NDArray[np.float64], NDArray[np.int64]]


def voxels(triangles: int) -> Mesh:
    """About half of a grid's cells at random, exported as their outer faces: most edges have four."""
    n = round((triangles / 3) ** (1 / 3)) + 1
    corners, quads = _cells(np.argwhere(np.random.default_rng(0).random((n, n, n)) < 0.5), n)
    _, which, count = np.unique(np.sort(quads, 1), axis=0, return_inverse=True, return_counts=True)
    return corners, _halved(quads[count[which.reshape(-1)] == 1])


def honeycomb(triangles: int) -> Mesh:
    """Every face of every cell of a grid, once: no edge inside it has fewer than three."""
    n = round((triangles / 6) ** (1 / 3)) + 1
    corners, quads = _cells(np.argwhere(np.ones((n, n, n))), n)
    return corners, _halved(quads[np.unique(np.sort(quads, 1), axis=0, return_index=True)[1]])


def _cells(cells: NDArray, n: int) -> tuple[NDArray, NDArray]:
    corner, faces = cube()[0].astype(int), np.array([(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (2, 3, 7, 6), (1, 2, 6, 5),
                                                     (3, 0, 4, 7)])  # fmt: skip
    place = cells[:, None, None] + corner[faces]
    points = np.stack(np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    return points, (place @ [(n + 1) ** 2, n + 1, 1]).reshape(-1, 4)


def _halved(quads: NDArray) -> NDArray:
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def leaves(count: int) -> Mesh:
    """A crown of loose quads."""
    rng = np.random.default_rng(0)
    place, along, across = rng.normal(size=(3, count, 3))
    place *= rng.random((count, 1)) ** (1 / 3) / np.linalg.norm(place, axis=1, keepdims=True)
    across = np.cross(along, across)
    along, across = (0.01 * side / np.linalg.norm(side, axis=1, keepdims=True) for side in (along, across))
    points = np.stack([place - along, place + across, place + along, place - across], 1)
    return points.reshape(-1, 3), _halved(np.arange(4 * count).reshape(-1, 4))


def soup(triangles: int) -> Mesh:
    """Loose triangles through each other."""
    rng = np.random.default_rng(0)
    points = rng.random((triangles, 1, 3)) + 0.05 * rng.normal(size=(triangles, 3, 3))
    return points.reshape(-1, 3), np.arange(3 * triangles).reshape(-1, 3)


def slivers(triangles: int) -> Mesh:
    """Loose triangles a hundred thousand times as long as high."""
    rng = np.random.default_rng(0)
    start, along, off = rng.random((triangles, 3)), rng.normal(size=(triangles, 3)), rng.normal(size=(triangles, 3))
    points = np.stack([start, start + along, start + along / 2 + 1e-5 * off], 1)
    return points.reshape(-1, 3), np.arange(3 * triangles).reshape(-1, 3)


def shells(triangles: int) -> Mesh:
    """Spheres one in the other, a third of them inside out, every second one with a hole."""
    points, faces = sphere()
    count = max(1, triangles // len(faces))
    turned = [(faces if i % 3 else faces[:, ::-1])[i % 2 :] + i * len(points) for i in range(count)]
    return np.concatenate([points * (0.1 + 0.9 * i / count) for i in range(count)]), np.concatenate(turned)


def crumbs(triangles: int) -> Mesh:
    """Tetrahedra, each a part of its own."""
    count = triangles // 4
    corners = 0.002 * np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
    points = corners + np.random.default_rng(0).random((count, 1, 3))
    faces = np.array([(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]) + 4 * np.arange(count)[:, None, None]
    return points.reshape(-1, 3), faces.reshape(-1, 3)


def book(triangles: int) -> Mesh:
    """All triangles on one edge."""
    angle = np.arange(triangles) / triangles * 2 * np.pi
    points = np.stack([np.cos(angle), np.sin(angle), np.full(triangles, 0.5)], -1)
    rim = np.arange(triangles) + 2
    return np.concatenate([[(0, 0, 0), (0, 0, 1)], points]), np.stack([0 * rim, 0 * rim + 1, rim], -1)


def bicone(triangles: int) -> Mesh:
    """Closed; half of the triangles at either of two vertices."""
    count = triangles // 2
    points, _ = book(count)
    rim = np.arange(count)
    after = (rim + 1) % count + 2
    return points, np.concatenate([np.stack([0 * rim, after, rim + 2], -1), np.stack([0 * rim + 1, rim + 2, after], -1)])


def rough(triangles: int) -> Mesh:
    """One sheet of noise."""
    n = round((triangles / 2) ** 0.5) + 1
    x, y = np.meshgrid(np.arange(n) / n, np.arange(n) / n, indexing="ij")
    i = np.arange(n * n).reshape(n, n)
    quads = np.stack([i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]], -1).reshape(-1, 4)
    return np.stack([x, y, 0.3 * np.random.default_rng(0).random((n, n))], -1).reshape(-1, 3), _halved(quads)


def crowd(triangles: int) -> Mesh:
    """Most vertices within the weld tolerance of each other."""
    points, faces = soup(triangles)
    points[3 * (triangles // 10) :] *= 1e-7
    return points, faces


KINDS: dict[str, Callable[[int], Mesh]] = {
    "voxels": voxels, "honeycomb": honeycomb, "leaves": lambda n: leaves(n // 2), "soup": soup, "slivers": slivers,
    "shells": shells, "crumbs": crumbs, "book": book, "bicone": bicone, "rough": rough, "crowd": crowd,
}  # fmt: skip


def write_ply(path: Path, vertices: NDArray, triangles: NDArray) -> Path:
    """A binary PLY in double precision."""
    rows = np.zeros(len(triangles), np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
    rows["count"], rows["corners"] = 3, triangles
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n" + "".join(
        f"property double {axis}\n" for axis in "xyz"
    ) + f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"  # fmt: skip
    path.write_bytes(header.encode() + vertices.astype("<f8").tobytes() + rows.tobytes())
    return path


def _cpu_seconds() -> float:
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


def _campaign(kinds: list[str]) -> int:
    """Returns: how many meshes took too long."""
    from stages.prep import stage
    from stages.prep.options import PrepOptions

    unwrapping, unwrap = [0.0], stage.unwrap

    def timed(*arguments: object) -> object:
        start = _cpu_seconds()
        try:
            return unwrap(*arguments)  # type: ignore[arg-type]
        finally:
            unwrapping[0] += _cpu_seconds() - start

    stage.unwrap = timed  # type: ignore[assignment]
    late = 0
    with tempfile.TemporaryDirectory() as folder:
        for size, limit in ((100_000, 30.0), (1_000_000, 90.0)):
            for kind in kinds:
                mesh = write_ply(Path(folder) / "mesh.ply", *KINDS[kind](size))
                unwrapping[0], start, clock = 0.0, _cpu_seconds(), time.monotonic()
                stage.prep(mesh, Path(folder) / "prep.npz", PrepOptions(), force=True)
                spent = _cpu_seconds() - start - unwrapping[0]
                late += spent > limit
                print(f"{kind:10} {size:8} {spent:6.1f} s of {limit:.0f}, unwrapping {unwrapping[0]:6.1f} s, "
                      f"{time.monotonic() - clock:6.1f} s on the clock", flush=True)  # fmt: skip
    return late


if __name__ == "__main__":
    sys.exit(min(_campaign(sys.argv[1:] or list(KINDS)), 1))
