"""Shading normals per triangle corner: the file's where they are usable, otherwise smooth up to a crease angle."""

import numpy as np
from numpy.typing import NDArray

from stages.prep.source import Source, rows_of
from stages.prep.topology import components, corner_links, edges

_UNIT = (0.9, 1.1)  # lengths that pass for a unit normal
_AGREES = 1e-3  # least cosine between a corner's normal and its face
_SMOOTH = 0.05  # likewise for an averaged normal; below it the face's own is taken


def face_normals(vertices: NDArray, triangles: NDArray) -> tuple[NDArray, NDArray]:
    """Unit normals (F, 3) and areas (F,) of triangles with an area."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    length = np.linalg.norm(cross, axis=1)
    return cross / length[:, None], length / 2


def creased(vertices: NDArray, triangles: NDArray, crease_angle: float) -> NDArray[np.float64]:
    """Unit normals (F, 3, 3), smooth over edges less sharp than `crease_angle` degrees.

    Corners at a vertex share a normal when a fan of such edges joins them: the mean of their faces' normals, weighted
    by area and by the angle at the vertex.
    Source: Thürmer and Wüthrich 1998, "Computing Vertex Normals from Polygonal Facets", with Max's area weight.
    """
    normal, area = face_normals(vertices, triangles)
    pairs = edges(triangles).pairs
    face = pairs // 3
    smooth = (normal[face[:, 0]] * normal[face[:, 1]]).sum(-1) > np.cos(np.radians(crease_angle))
    fan = components(3 * len(triangles), corner_links(triangles, pairs[smooth]))
    weight = (area[:, None] * corner_angles(vertices, triangles)).reshape(-1, 1)
    weighted = np.repeat(normal, 3, 0) * weight
    mean = np.stack([np.bincount(fan, weighted[:, k]) for k in range(3)], -1)[fan].reshape(-1, 3, 3)
    length = np.linalg.norm(mean, axis=-1, keepdims=True)
    mean = np.divide(mean, length, out=np.zeros_like(mean), where=length > 0)
    agrees = (mean * normal[:, None]).sum(-1, keepdims=True) > _SMOOTH
    return np.where(agrees, mean, normal[:, None])


def corner_angles(vertices: NDArray, triangles: NDArray) -> NDArray[np.float64]:
    """Angles (F, 3) at the corners, radians."""
    corners = vertices[triangles]
    out, back = np.roll(corners, -1, 1) - corners, np.roll(corners, 1, 1) - corners
    return np.arctan2(np.linalg.norm(np.cross(out, back), axis=-1), (out * back).sum(-1))


def authored(source: Source, loops: NDArray, to_world: NDArray) -> NDArray[np.float64]:
    """The file's normals (F, 3, 3) in the world frame, unit; NaN where there is none that could be one."""
    rows = source.loop_normal[loops]
    result = np.full((*loops.shape, 3), np.nan)
    if not len(source.normals) or (rows < 0).all():
        return result
    raw = source.normals[np.maximum(rows, 0)].astype(np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.linalg.norm(raw, axis=-1)
        usable = (rows >= 0) & (length > _UNIT[0]) & (length < _UNIT[1])
    face_part = source.loop_part()[loops[:, 0]]
    for part, faces in zip(source.parts, rows_of(face_part, len(source.parts)), strict=True):
        linear = to_world[:3, :3] @ np.reshape(part.transform, (4, 4))[:3, :3]
        if np.linalg.det(linear) != 0:
            # rows times the inverse: the inverse transpose of columns
            turned = np.where(usable[faces, :, None], raw[faces], np.nan) @ np.linalg.inv(linear)
            result[faces] = turned / np.linalg.norm(turned, axis=-1, keepdims=True)
    return result


def shading_normals(
    given: NDArray, vertices: NDArray, triangles: NDArray, patch: NDArray, crease_angle: float
) -> tuple[NDArray[np.float32], int]:
    """Normals (F, 3, 3) for ray tracing and shading alike, and how many corners have the file's.

    Args:
        given: (F, 3, 3) authored normals, NaN where missing. Where most of a patch's oppose its winding, they belong
        to the inside-out mesh that it was, and are turned round with it.
    """
    own, area = face_normals(vertices, triangles)
    cosine = np.nan_to_num((given * own[:, None]).sum(-1))  # (F, 3)
    sign = np.sign(np.bincount(patch, area * np.sign(cosine).sum(-1)))
    sign = np.where(sign < 0, -1.0, 1.0)[patch]
    usable = cosine * sign[:, None] > _AGREES
    if usable.all():
        return (given * sign[:, None, None]).astype(np.float32), usable.size
    smooth = creased(vertices, triangles, crease_angle)
    chosen = np.where(usable[..., None], given * sign[:, None, None], smooth)
    return chosen.astype(np.float32), int(usable.sum())
