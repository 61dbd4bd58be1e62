"""Small analytic scenes and lights for the tests of light transport."""

import numpy as np
from numpy.typing import NDArray

from stages.core.frames import look_at
from stages.light.environment import Environment
from stages.light.gbuffer import GBuffer, trace_view
from stages.light.scene import Scene


def flat_normals(vertices: NDArray, triangles: NDArray) -> NDArray:
    """The triangle's own normal at each of its corners."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    n = np.cross(b - a, c - a)
    n = n / np.linalg.norm(n, axis=-1, keepdims=True)
    return np.repeat(n[:, None], 3, 1)


def sphere(subdivisions: int, radius: float = 0.5) -> Scene:
    """A subdivided icosahedron with smooth normals."""
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions, radius)
    normals = mesh.vertices[mesh.faces] / radius
    return Scene(mesh.vertices, mesh.faces, normals)


def square(axis: int, offset: float, low: float, high: float) -> NDArray:
    """Four corners of an axis-aligned square that faces along +axis."""
    corners = np.full((4, 3), offset)
    corners[:, (axis + 1) % 3] = (low, high, high, low)
    corners[:, (axis + 2) % 3] = (low, low, high, high)
    return corners


def box_in_corner() -> Scene:
    """A box standing in the corner of a floor and two walls."""
    sides = []
    for axis in range(3):
        sides.append(square(axis, -0.5, -0.5, 0.5))
        sides.append(square(axis, -0.25, -0.25, 0.1)[::-1])
        sides.append(square(axis, 0.1, -0.25, 0.1))
    return quads(*sides)


def bowl() -> Scene:
    """The lower half of a sphere, open above, of one sheet with smooth normals."""
    import trimesh

    mesh = trimesh.creation.icosphere(3, 0.5)
    faces = mesh.faces[mesh.triangles_center[:, 2] < 0]
    return Scene(mesh.vertices, faces, mesh.vertices[faces] / 0.5)


def quads(*corners: NDArray) -> Scene:
    """Flat squares, (4, 3) each, which face where they wind counter-clockwise."""
    vertices = np.concatenate(corners)
    base = 4 * np.arange(len(corners))[:, None]
    triangles = np.concatenate([base + [0, 1, 2], base + [0, 2, 3]], 0)
    return Scene(vertices, triangles, flat_normals(vertices, triangles))


def cut(scene: Scene, parts: int) -> Scene:
    """The same surface with each triangle in parts² equal ones."""
    i, j = np.nonzero(np.tri(parts, dtype=bool)[::-1])  # corners on a triangular grid: i + j < parts
    up = np.stack([[i, j], [i + 1, j], [i, j + 1]])
    down = np.stack([[i + 1, j], [i + 1, j + 1], [i, j + 1]])[..., i + j < parts - 1]
    b = np.concatenate([up, down], 2) / parts  # corner, first or second coordinate, part
    a, b1, b2 = (scene.vertices[scene.triangles[:, k], None, None] for k in range(3))
    x, y = b[:, 0].T[..., None], b[:, 1].T[..., None]
    corners = (a + x * (b1 - a) + y * (b2 - a)).reshape(-1, 3)
    triangles = np.arange(len(corners)).reshape(-1, 3)
    return Scene(corners, triangles, flat_normals(corners, triangles))


def view_of(scene: Scene, size: int, eye: tuple[float, float, float] = (2.2, 1.5, 1.3)) -> GBuffer:
    """The scene from a corner of the room, `size` pixels square."""
    c2w = look_at(np.array(eye), np.zeros(3), np.array([0.0, 0.0, 1.0]))
    return trace_view(scene, c2w, float(np.radians(26)), size, size)


def open_point(cosine: float, count: int = 1) -> GBuffer:
    """Points that nothing occludes, seen at the given N·V."""
    zeros = np.zeros((count, 3), np.float32)
    wo = np.tile(np.array([np.sqrt(1 - cosine**2), 0, cosine], np.float32), (count, 1))
    up = np.tile(np.array([0, 0, 1], np.float32), (count, 1))
    far = zeros + np.float32(100)
    mask = np.ones((1, count), bool)
    index = np.zeros(count, np.int32)
    corner = np.tile(np.array([1, 0, 0], np.float32), (count, 1))
    return GBuffer(mask, mask.astype(np.float32), far, far, up, up, wo, index, corner)


def even_light(radiance: float = 1.0) -> Environment:
    """The same from everywhere: a white furnace."""
    return Environment("even", np.full((32, 64, 3), radiance, np.float32))


def sunny_light(sun: float = 5000.0, rows: int = 64) -> Environment:
    """An uneven coloured sky with a sun of one texel."""
    generator = np.random.default_rng(3)
    radiance = generator.uniform(0.05, 0.4, (rows, 2 * rows, 3)).astype(np.float32)
    radiance[int(rows * 0.28), int(2 * rows * 0.36)] = sun
    return Environment("sunny", radiance)


def single_texel_light(radiance: float = 1000.0, rows: int = 32) -> Environment:
    """Black but for one texel high up."""
    pixels = np.zeros((rows, 2 * rows, 3), np.float32)
    pixels[rows // 4, int(2 * rows * 0.4)] = radiance
    return Environment("texel", pixels)
