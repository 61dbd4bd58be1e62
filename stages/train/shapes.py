"""Procedural meshes to train on: hard and smooth, thin and massive, single parts and assemblies; NumPy only.

A shape is a set of parts; parts may interpenetrate, as they do in modelled assets. Each part is a closed triangle mesh
with outward winding; the union of parts is what a ray sees. Every shape is a function of its generator's state.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray


@dataclass(frozen=True)
class Mesh:
    """vertices: (V, 3) float64. triangles: (F, 3) int64, counter-clockwise seen from outside."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]


@dataclass(frozen=True)
class Shape:
    """A mesh in the normalised world frame with its shading normals.

    vertices: (V, 3) float32, longest edge 1, centred. triangles: (F, 3) int32. normals: (F, 3, 3) float32 unit.
    """

    vertices: NDArray[np.float32]
    triangles: NDArray[np.int32]
    normals: NDArray[np.float32]


def make_shape(rng: Generator) -> Shape:
    """A random shape: one part in two of five cases, an assembly otherwise."""
    mesh = random_part(rng) if rng.random() < 0.4 else assembly(rng)
    return finish(mesh, crease=np.radians(rng.choice([20.0, 35.0, 50.0])))


def finish(mesh: Mesh, crease: float) -> Shape:
    """Normalise and give shading normals. crease: radians; sharper edges stay hard."""
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    vertices = ((mesh.vertices - (low + high) / 2) / (high - low).max()).astype(np.float32)
    triangles = mesh.triangles.astype(np.int32)
    return Shape(vertices, triangles, corner_normals(vertices, triangles, crease))


def corner_normals(vertices: NDArray, triangles: NDArray, crease: float) -> NDArray[np.float32]:
    """Area-weighted mean of the face normals around each corner that lie within the crease angle of its own face's.

    Returns: (F, 3, 3) unit.
    """
    a, b, c = (vertices[triangles[:, k]].astype(np.float64) for k in range(3))
    area = np.cross(b - a, c - a)
    length = np.linalg.norm(area, axis=1, keepdims=True)
    unit = area / np.where(length > 0, length, 1)
    smooth = np.zeros((len(vertices), 3))
    for k in range(3):
        np.add.at(smooth, triangles[:, k], area)
    smooth /= np.maximum(np.linalg.norm(smooth, axis=1, keepdims=True), 1e-30)
    corners = smooth[triangles]  # (F, 3, 3)
    hard = (corners * unit[:, None]).sum(-1) < np.cos(crease)
    return np.where(hard[..., None], unit[:, None], corners).astype(np.float32)


# ------------------------------------------------------------------------------------------------------ parts


def random_part(rng: Generator) -> Mesh:
    """One closed part, perhaps deformed, turned at random."""
    mesh = PARTS[rng.choice(len(PARTS), p=PART_SHARES)](rng)
    if rng.random() < 0.45:
        mesh = deform(mesh, rng)
    return Mesh(mesh.vertices @ rotation(rng, upright=rng.random() < 0.6).T, mesh.triangles)


def box(rng: Generator) -> Mesh:
    """A box, its edges rounded or bevelled more or less."""
    n, power = 14, rng.choice([1.0, 0.25, 0.12])
    sphere = cube_sphere(n)
    if power == 1.0:  # a plain box
        surface = sphere / np.abs(sphere).max(1, keepdims=True)
    else:
        surface = signed_power(sphere, power)
        surface /= np.abs(surface).max()
    return Mesh(surface * rng.uniform(0.15, 1, 3), grid_cube(n))


def superquadric(rng: Generator) -> Mesh:
    """Anything from an octahedron over a sphere to a soft box. Source: Barr 1981."""
    n = 24
    surface = signed_power(cube_sphere(n), rng.uniform(0.4, 1.6))
    return Mesh(surface * rng.uniform(0.35, 1, 3), grid_cube(n))


def bumpy(rng: Generator) -> Mesh:
    """A sphere with displaced surface: pebble, blob, head-like lumps."""
    n = 36
    surface = cube_sphere(n) * rng.uniform(0.6, 1, 3)
    return displace(Mesh(surface, grid_cube(n)), rng, amplitude=rng.uniform(0.1, 0.35), frequency=rng.uniform(1.2, 4))


def lathe(rng: Generator) -> Mesh:
    """A turned profile: vase, bowl with an inside, bottle, pawn, column, disc."""
    knots = int(rng.integers(3, 8))
    radius = np.concatenate([[0.0], rng.uniform(0.12, 1, knots), [0.0]])
    height = np.concatenate([[0.0], np.sort(rng.uniform(0, rng.uniform(0.5, 2.5), knots)), [0.0]])
    height[0], height[-1] = height[1], height[-2]
    if rng.random() < 0.35:  # hollow: the profile comes back inside
        wall = rng.uniform(0.04, 0.12)
        inside = np.maximum(radius[2:-1][::-1] - wall, 0.02)
        radius = np.concatenate([radius[:-1], inside, [0.0]])
        height = np.concatenate([height[:-1], height[2:-1][::-1], [height[1] + wall]])
        height[-2] = max(height[-2], height[-1])
    r, z = smooth_profile(radius, height, 48) if rng.random() < 0.6 else resample(radius, height, 40)
    return revolve(r, z, segments=int(rng.choice([6, 8, 32, 48])))


def torus(rng: Generator) -> Mesh:
    """A ring."""
    angle = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    path = np.stack([np.cos(angle), np.sin(angle), np.zeros(48)], 1)
    return sweep(path, np.full(48, rng.uniform(0.08, 0.45)), closed=True, sides=int(rng.choice([4, 6, 20])))


def tube(rng: Generator) -> Mesh:
    """A bent tube, wire, horn or spring of changing radius."""
    s = np.linspace(0, 1, 56)
    if rng.random() < 0.35:
        turns = rng.uniform(1.5, 4)
        path = np.stack([np.cos(2 * np.pi * turns * s), np.sin(2 * np.pi * turns * s), s * rng.uniform(1, 3)], 1)
    else:
        points = np.cumsum(rng.normal(0, 1, (5, 3)), 0)
        path = np.stack([np.polyval(np.polyfit(np.linspace(0, 1, 5), points[:, k], 3), s) for k in range(3)], 1)
    radius = rng.uniform(0.06, 0.3) * (1 - rng.uniform(0, 0.9) * s) * np.ptp(path, 0).max() / 2
    return sweep(path, radius, closed=False, sides=int(rng.choice([4, 6, 16])))


def prism(rng: Generator) -> Mesh:
    """An extruded outline: polygon, star, gear or lobed plate."""
    count = int(rng.integers(3, 13))
    repeat = int(rng.choice([1, 2, 4]))
    angle = np.linspace(0, 2 * np.pi, count * repeat * 2, endpoint=False)
    outline = 1 - rng.uniform(0, 0.5) * (np.arange(len(angle)) // repeat % 2)
    half = rng.uniform(0.05, 0.9)
    bevel = rng.choice([0.0, 0.06]) * min(1.0, half)
    radius = np.array([0, 1 - bevel, 1, 1, 1 - bevel, 0])
    height = np.array([-half, -half, bevel - half, half - bevel, half, half])
    r, z = resample(radius, height, 30)
    return revolve(r, z, len(angle), outline, angle)


def cone(rng: Generator) -> Mesh:
    """A cone, a truncated cone or a cylinder, standing."""
    top = rng.choice([0.0, 1.0, rng.uniform(0.2, 0.9)])
    half = rng.uniform(0.2, 2)
    r, z = resample(np.array([0.0, 1.0, max(top, 1e-3), 0.0]), np.array([-half, -half, half, half]), 30)
    return revolve(r, z, int(rng.choice([3, 4, 6, 36])))


def knot(rng: Generator) -> Mesh:
    """A torus knot: deep concavities, long curved tube."""
    p, q = ((2, 3), (3, 2), (2, 5), (3, 4))[rng.integers(4)]
    s = np.linspace(0, 2 * np.pi, 160, endpoint=False)
    ring = 2 + np.cos(q * s)
    path = np.stack([ring * np.cos(p * s), ring * np.sin(p * s), -np.sin(q * s)], 1)
    return sweep(path, np.full(len(s), rng.uniform(0.25, 0.6)), closed=True, sides=12)


PARTS: tuple[Callable[[Generator], Mesh], ...] = (
    box, superquadric, bumpy, lathe, torus, tube, prism, cone, knot,
)
PART_SHARES = np.array([0.17, 0.13, 0.16, 0.18, 0.06, 0.09, 0.1, 0.07, 0.04])


def assembly(rng: Generator) -> Mesh:
    """Several parts together: stacked, around a body, in a row, mirrored, or legs under a top."""
    kind = int(rng.integers(5))
    if kind == 0:
        return legged(rng)
    if kind == 1:
        return stacked(rng)
    body = scaled(random_part(rng), 1.0)
    count = int(rng.integers(1, 7))
    parts = [body]
    part = scaled(random_part(rng), rng.uniform(0.2, 0.6))
    for k in range(count):
        if rng.random() < 0.4:
            part = scaled(random_part(rng), rng.uniform(0.15, 0.7))
        parts.append(moved(part, attach(body, rng, kind, k / count)))
    if kind == 4:  # mirrored in x
        parts += [mirrored(p) for p in parts[1:]]
    return merge(parts)


def attach(body: Mesh, rng: Generator, kind: int, turn: float) -> NDArray[np.float64]:
    """Where an assembly's part goes: around the body (kind 2) at a share of a turn, or anywhere on its surface."""
    if kind == 2:
        angle = 2 * np.pi * turn
        radius = np.abs(body.vertices[:, :2]).max() * 0.9
        return np.array([radius * np.cos(angle), radius * np.sin(angle), rng.uniform(-0.1, 0.1)])
    return body.vertices[rng.integers(len(body.vertices))] * rng.uniform(0.7, 1.05)


def legged(rng: Generator) -> Mesh:
    """A top on thin legs, perhaps with a back: table, stool, chair, animal."""
    width, depth, leg = rng.uniform(0.5, 1.2), rng.uniform(0.5, 1), rng.uniform(0.3, 1.2)
    thick = rng.uniform(0.03, 0.12)
    top = Mesh(scaled(box(rng), 1.0).vertices * [width, depth, rng.uniform(0.06, 0.5)], grid_cube(14))
    shape = scaled(cone(rng) if rng.random() < 0.5 else box(rng), 1.0)
    stretch = np.array([thick, thick, leg]) * 2 / np.maximum(np.ptp(shape.vertices, 0), 0.05)
    post = Mesh(shape.vertices * stretch / 2, shape.triangles)
    at = [np.array([x * width * 0.42, y * depth * 0.42, -leg * 0.5]) for x in (-1, 1) for y in (-1, 1)]
    parts = [top, *(moved(post, p) for p in at)]
    if rng.random() < 0.5:
        back = Mesh(top.vertices * [0.1, 1, 1] / [1, 1, max(np.ptp(top.vertices[:, 2]), 0.1)], top.triangles)
        parts.append(moved(back, np.array([-width * 0.45, 0, 0.5])))
    return merge(parts)


def stacked(rng: Generator) -> Mesh:
    """Parts on top of each other: totem, chess piece, statue on a plinth."""
    parts, z = [], 0.0
    for _ in range(int(rng.integers(2, 5))):
        part = scaled(random_part(rng), rng.uniform(0.5, 1))
        low, high = part.vertices[:, 2].min(), part.vertices[:, 2].max()
        parts.append(moved(part, np.array([*rng.normal(0, 0.05, 2), z - low])))
        z += (high - low) * rng.uniform(0.8, 0.98)
    return merge(parts)


# -------------------------------------------------------------------------------------------------- operations


def displace(mesh: Mesh, rng: Generator, amplitude: float, frequency: float) -> Mesh:
    """Push vertices along their direction from the centre by a few random waves."""
    waves = rng.normal(0, frequency, (8, 3))
    phase, gain = rng.uniform(0, 2 * np.pi, 8), 1 / (1 + np.arange(8))
    height = (np.sin(mesh.vertices @ (waves * (1 + 0.4 * np.arange(8))[:, None]).T + phase) * gain).sum(1)
    return Mesh(mesh.vertices * (1 + amplitude * height / 2)[:, None], mesh.triangles)


def deform(mesh: Mesh, rng: Generator) -> Mesh:
    """Twist, taper, bend or displace."""
    v = scaled(mesh, 1.0).vertices.copy()
    kind, amount = rng.integers(4), rng.uniform(0.3, 1.2) * rng.choice([-1, 1])
    if kind == 0:
        c, s = np.cos(2 * amount * v[:, 2]), np.sin(2 * amount * v[:, 2])
        v[:, 0], v[:, 1] = c * v[:, 0] - s * v[:, 1], s * v[:, 0] + c * v[:, 1]
    elif kind == 1:
        v[:, :2] *= np.clip(1 + amount * v[:, 2:], 0.15, None)
    elif kind == 2:
        v[:, 0] += amount * v[:, 2] ** 2
    else:
        return displace(Mesh(v, mesh.triangles), rng, rng.uniform(0.04, 0.15), rng.uniform(2, 7))
    return Mesh(v, mesh.triangles)


def scaled(mesh: Mesh, size: float) -> Mesh:
    """The mesh centred, its longest edge `size`."""
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    return Mesh((mesh.vertices - (low + high) / 2) * (size / (high - low).max()), mesh.triangles)


def moved(mesh: Mesh, offset: NDArray) -> Mesh:
    """The mesh shifted."""
    return Mesh(mesh.vertices + offset, mesh.triangles)


def mirrored(mesh: Mesh) -> Mesh:
    """The mesh reflected in x, still wound outwards."""
    return Mesh(mesh.vertices * [-1, 1, 1], mesh.triangles[:, ::-1])


def merge(parts: list[Mesh]) -> Mesh:
    """All parts in one mesh, vertices not shared."""
    start = np.cumsum([0, *(len(p.vertices) for p in parts[:-1])])
    triangles = [p.triangles + s for p, s in zip(parts, start, strict=True)]
    return Mesh(np.concatenate([p.vertices for p in parts]), np.concatenate(triangles))


def rotation(rng: Generator, upright: bool) -> NDArray[np.float64]:
    """A random rotation matrix; about z alone when upright."""
    if upright:
        angle = rng.uniform(0, 2 * np.pi)
        return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


# ------------------------------------------------------------------------------------------------ tessellations


def cube_sphere(n: int) -> NDArray[np.float64]:
    """Unit directions of a cube's surface grid with n cells an edge; welded, as `grid_cube` indexes them."""
    points = _cube_grid(n)[0] / n * 2 - 1
    points = np.tan(points * np.pi / 4)  # evens the cells out
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def grid_cube(n: int) -> NDArray[np.int64]:
    """Triangles of a cube's surface grid, outward."""
    return _cube_grid(n)[1]


def _cube_grid(n: int) -> tuple[NDArray, NDArray]:
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij"))
    cell = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    quads = np.stack([cell, cell + n + 1, cell + n + 2, cell + 1], 1)
    corners: list[NDArray] = []
    triangles: list[NDArray] = []
    for axis in range(3):
        for side in (0, n):
            p = np.empty((len(i), 3), int)
            p[:, axis], p[:, (axis + 1) % 3], p[:, (axis + 2) % 3] = side, i, j
            q = quads if side else quads[:, ::-1]
            triangles.append(np.concatenate([q[:, [0, 1, 2]], q[:, [0, 2, 3]]]) + len(i) * len(corners))
            corners.append(p)
    unique, inverse = np.unique(np.concatenate(corners), axis=0, return_inverse=True)
    return unique.astype(float), inverse.ravel()[np.concatenate(triangles)]


def revolve(
    r: NDArray, z: NDArray, segments: int, outline: NDArray | None = None, angles: NDArray | None = None
) -> Mesh:
    """Turn a profile about z. The first and last radius are 0: the poles close the surface.

    Args:
        r, z: (N,) profile, ordered so that its outside lies to the right on the way from first to last.
        outline: (segments,) factor of the radius at each angle.
    """
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False) if angles is None else angles
    factor = np.ones(segments) if outline is None else outline
    ring = np.stack([np.cos(angle) * factor, np.sin(angle) * factor], 1)
    inner = np.maximum(r[1:-1], 1e-4)
    body = np.concatenate([(inner[:, None, None] * ring), np.repeat(z[1:-1], segments).reshape(-1, segments, 1)], 2)
    vertices = np.concatenate([body.reshape(-1, 3), [[0, 0, z[0]], [0, 0, z[-1]]]])
    return Mesh(vertices, _rings(len(inner), segments, closed=False))


def sweep(path: NDArray, radius: NDArray, closed: bool, sides: int) -> Mesh:
    """A tube along a path, its rings kept from twisting (parallel transport).

    Args:
        path: (N, 3). radius: (N,). closed: the last ring joins the first.
    """
    tangent = np.roll(path, -1, 0) - np.roll(path, 1, 0) if closed else np.gradient(path, axis=0)
    tangent = tangent / np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.empty_like(path)
    u = np.cross(tangent[0], np.eye(3)[np.abs(tangent[0]).argmin()])
    for k, t in enumerate(tangent):
        u = u - t * (u @ t)
        side[k] = u = u / np.linalg.norm(u)
    up = np.cross(tangent, side)
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    ring = side[:, None] * np.cos(angle)[:, None] + up[:, None] * np.sin(angle)[:, None]
    body = (path[:, None] + ring * radius[:, None, None]).reshape(-1, 3)
    ends = np.empty((0, 3)) if closed else path[[0, -1]]
    return Mesh(np.concatenate([body, ends]), _rings(len(path), sides, closed))


def _rings(count: int, sides: int, closed: bool) -> NDArray[np.int64]:
    """Triangles that join rings of vertices, with a fan to the two vertices after them where not closed."""
    k, s = (a.ravel() for a in np.meshgrid(np.arange(count if closed else count - 1), np.arange(sides), indexing="ij"))
    nxt, up = (s + 1) % sides, (k + 1) % count
    a, b, c, d = k * sides + s, k * sides + nxt, up * sides + nxt, up * sides + s
    triangles = [np.stack([a, b, c], 1), np.stack([a, c, d], 1)]
    if not closed:
        first, last = np.arange(sides), np.arange(sides) + (count - 1) * sides
        tip = count * sides
        triangles.append(np.stack([np.roll(first, -1), first, np.full(sides, tip)], 1))
        triangles.append(np.stack([last, np.roll(last, -1), np.full(sides, tip + 1)], 1))
    return np.concatenate(triangles)


def resample(r: NDArray, z: NDArray, count: int) -> tuple[NDArray, NDArray]:
    """A polyline with every corner kept and its longer edges divided, about `count` points in all."""
    length = np.hypot(np.diff(r), np.diff(z))
    pieces = np.maximum(1, np.round(length / max(length.sum(), 1e-12) * count)).astype(int)
    s = np.concatenate([*(i + np.arange(n) / n for i, n in enumerate(pieces)), [len(pieces)]])
    return np.interp(s, np.arange(len(r)), r), np.interp(s, np.arange(len(z)), z)


def smooth_profile(r: NDArray, z: NDArray, count: int) -> tuple[NDArray, NDArray]:
    """Three rounds of corner cutting, ends kept. Source: Chaikin 1974."""
    points = np.stack([r, z], 1)
    for _ in range(3):
        q, p = 0.75 * points[:-1] + 0.25 * points[1:], 0.25 * points[:-1] + 0.75 * points[1:]
        points = np.concatenate([points[:1], np.stack([q, p], 1).reshape(-1, 2), points[-1:]])
    return resample(points[:, 0], points[:, 1], count)


def signed_power(x: NDArray, power: float) -> NDArray:
    """sign(x) |x|^power."""
    return np.sign(x) * np.abs(x) ** power
