"""Points, normals and ray origins on triangles, compiled; `stages.light.hit_reference` is their plain form, to the bit.

triangle: (P,). weights: (P, 3) barycentric. vertices: (V, 3), triangles: (F, 3), normals: (F, 3, 3) of corners, flat: (F, 3)
of triangles; float32, summed in float64. result: (P, 3) float32, written.
"""

import numpy as np

from stages.core.parallel import compiled


@compiled
def points(vertices, triangles, triangle, weights, result):  # type: ignore[no-untyped-def]
    """World positions."""
    for i in range(len(triangle)):
        for d in range(3):
            total = 0.0
            for k in range(3):
                total += np.float64(weights[i, k]) * np.float64(vertices[triangles[triangle[i], k], d])
            result[i, d] = total


@compiled
def smooth_normals(normals, flat, triangle, weights, result):  # type: ignore[no-untyped-def]
    """Unit interpolated normals; the triangle's own where the corners' cancel out."""
    n = np.empty(3)
    for i in range(len(triangle)):
        for d in range(3):
            n[d] = 0.0
            for k in range(3):
                n[d] += np.float64(weights[i, k]) * np.float64(normals[triangle[i], k, d])
        length = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        for d in range(3):
            result[i, d] = n[d] / length if length > 1e-3 else flat[triangle[i], d]


@compiled
def origins(vertices, triangles, normals, flat, triangle, weights, lifts, result):  # type: ignore[no-untyped-def]
    """Where rays start: see `stages.light.scene.Scene.ray_origin`. lifts: (P, 2), the side, and how far it is lifted there."""
    p, smooth = np.empty(3), np.empty(3)
    for i in range(len(triangle)):
        f, side = triangle[i], lifts[i, 0]
        for d in range(3):
            p[d], smooth[d] = 0.0, 0.0
            for k in range(3):
                p[d] += np.float64(weights[i, k]) * np.float64(vertices[triangles[f, k], d])
        for k in range(3):
            below = 0.0
            for d in range(3):
                below += (p[d] - np.float64(vertices[triangles[f, k], d])) * (np.float64(normals[f, k, d]) * side)
            below = np.float64(weights[i, k]) * min(below, 0.0)
            for d in range(3):
                smooth[d] += below * (np.float64(normals[f, k, d]) * side)
        for d in range(3):
            result[i, d] = p[d] - smooth[d] + lifts[i, 1] * np.float64(flat[f, d])
