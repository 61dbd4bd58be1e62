"""Six shapes to judge a prior on, none from the training generator: used where no mesh files are given."""

from collections.abc import Callable

import numpy as np
import trimesh
from numpy.typing import NDArray

SEGMENTS = 96


def knot() -> trimesh.Trimesh:
    """A trefoil knot of round rope."""
    t = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    path = np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], -1)
    return _tube(path, 0.55)


def amphora() -> trimesh.Trimesh:
    """A turned vessel with a foot, a belly and a lip."""
    z = np.linspace(0, 1, 80)
    radius = 0.1 + 0.24 * np.exp(-(((z - 0.5) / 0.22) ** 2)) + 0.08 * np.exp(-((z / 0.06) ** 2)) + 0.07 * z**8
    return _lathe(np.concatenate([[0], radius, [0]]), np.concatenate([[0], z, [0.97]]))


def gear() -> trimesh.Trimesh:
    """Twelve teeth and a bore."""
    angle = np.linspace(0, 2 * np.pi, 12 * 16, endpoint=False)
    radius = 0.42 + 0.08 * np.clip(3 * np.sin(12 * angle), -1, 1)
    inner = np.full_like(angle, 0.16)
    return _ring(angle, radius, inner, 0.22)


def shell() -> trimesh.Trimesh:
    """A sea shell: a tube that grows along a spiral."""
    t = np.linspace(0, 5 * np.pi, 220)
    growth = np.exp(0.16 * t)
    path = np.stack([growth * np.cos(t), growth * np.sin(t), -1.4 * growth], -1)
    return _tube(path, 0.75 * growth, closed=False)


def totem() -> trimesh.Trimesh:
    """Superellipsoids on top of one another."""
    parts = []
    for i, power in enumerate((0.3, 1.0, 2.4, 0.6)):
        ball = trimesh.creation.icosphere(subdivisions=4)
        v = ball.vertices
        ball.vertices = np.sign(v) * np.abs(v) ** power / np.linalg.norm(np.abs(v) ** power, axis=1, keepdims=True) ** 0.6
        ball.apply_scale([0.34 - 0.05 * i, 0.34 - 0.05 * i, 0.26])
        ball.apply_translation([0, 0, 0.4 * i])
        parts.append(ball)
    vertices = np.concatenate([part.vertices for part in parts])
    starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    return trimesh.Trimesh(vertices, np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=True)]))


def pebble() -> trimesh.Trimesh:
    """A ball with slow bumps."""
    ball = trimesh.creation.icosphere(subdivisions=5)
    x, y, z = ball.vertices.T
    ball.vertices *= (1 + 0.16 * np.sin(3 * x + 1) * np.sin(4 * y) + 0.1 * np.sin(6 * z + 2 * x))[:, None]
    ball.apply_scale([1, 0.8, 0.65])
    return ball


SHAPES: dict[str, Callable[[], trimesh.Trimesh]] = {f.__name__: f for f in (knot, amphora, gear, shell, totem, pebble)}


def _lathe(radius: NDArray, z: NDArray) -> trimesh.Trimesh:
    angle = np.linspace(0, 2 * np.pi, SEGMENTS, endpoint=False)
    grid = np.stack(np.broadcast_arrays(radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle), z[:, None]), -1)
    return _grid(grid, wrap=False)


def _tube(path: NDArray, radius: NDArray | float, closed: bool = True) -> trimesh.Trimesh:
    """A round tube along a path (N, 3); an open one ends in points."""
    ahead = np.roll(path, -1, 0) - np.roll(path, 1, 0) if closed else np.gradient(path, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    side = np.cross(ahead, [0.31, 0.17, 0.93])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(ahead, side)
    angle = np.linspace(0, 2 * np.pi, SEGMENTS // 2, endpoint=False)[:, None]
    thickness = np.broadcast_to(radius, len(path)).copy()
    if not closed:
        thickness[[0, -1]] = 0
    ring = np.cos(angle) * side[:, None] + np.sin(angle) * up[:, None]  # (N, A, 3)
    return _grid(path[:, None] + thickness[:, None, None] * ring, wrap=closed)


def _ring(angle: NDArray, outer: NDArray, inner: NDArray, height: float) -> trimesh.Trimesh:
    """A ring of straight walls between two outlines."""
    corners = [(outer, 0.0), (outer, height), (inner, height), (inner, 0.0), (outer, 0.0)]
    grid = np.stack([np.stack([r * np.cos(angle), r * np.sin(angle), np.full_like(r, z)], -1) for r, z in corners])
    return _grid(grid, wrap=False)


def _grid(points: NDArray, wrap: bool) -> trimesh.Trimesh:
    """Quads between neighbours of an (N, M, 3) grid, closed along M, and along N where it wraps; points that meet are one."""
    rows, columns, _ = points.shape
    i, j = np.mgrid[: rows if wrap else rows - 1, :columns].reshape(2, -1)
    next_i, next_j = (i + 1) % rows, (j + 1) % columns
    a, b, c, d = (y * columns + x for y, x in ((i, j), (i, next_j), (next_i, next_j), (next_i, j)))
    mesh = trimesh.Trimesh(points.reshape(-1, 3), np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]))
    mesh.fix_normals()
    return mesh
