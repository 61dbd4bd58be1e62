"""Fast evaluation of the residual, for inference only.

Texels are visited row by row, so neighbouring points mostly share their cells of the coarser grids: a cell's corners
are fetched once and kept until a point leaves it; the network is two products of matrices.
`Residual.forward` is the plain form of the same; a test holds the two together.
"""

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled, in_parallel, slices
from stages.material.stored import HASH_PRIMES, OUTPUTS, StoredResidual

BLOCK = 1 << 12
"""Points that go through the network at a time, so that what is between its layers stays in the cache."""

TASK = 1 << 18
"""Points of one thread's task."""

PRIME_Y, PRIME_Z = np.uint32(HASH_PRIMES[1]), np.uint32(HASH_PRIMES[2])


def evaluate(residual: StoredResidual, points: NDArray[np.float32]) -> NDArray[np.float32]:
    """What was learnt at world points.

    Args:
        points: (N, 3).
    Returns:
        (N, 5) logits for red, green and blue of the linear albedo, roughness, metallic.
    """
    arrays, layout = residual.to_arrays(), residual.config.layout()
    w0, b0, w1, b1 = (arrays[name] for name in ("weights_0", "bias_0", "weights_1", "bias_1"))
    result = np.empty((len(points), OUTPUTS), np.float32)

    def part(rows: slice) -> None:
        features = np.empty((w0.shape[1], len(points[rows])), np.float32)
        _encode(points[rows], arrays["table"], layout, features)
        for some in slices(features.shape[1], BLOCK):
            hidden = w0 @ features[:, some]
            hidden += b0[:, None]
            np.maximum(hidden, 0, out=hidden)
            result[rows][some] = (w1 @ hidden).T + b1

    in_parallel(part, slices(len(points), TASK))
    return result


@compiled
def _encode(points, table, layout, features):  # type: ignore[no-untyped-def]
    """Features (2 L, N): all points of one level first, whose part of the table stays in the cache."""
    for level in range(len(layout)):
        resolution, first, entries = layout[level]
        _encode_level(points, table, resolution, first, entries, features[2 * level : 2 * level + 2])


@compiled
def _encode_level(points, table, resolution, first, entries, features):  # type: ignore[no-untyped-def]
    """Trilinear features of one level into `features` (2, N); see `stages.material.residual.encode_reference`."""
    corners = np.empty((8, 2), np.float32)
    side = resolution + 1
    direct = side * side * side <= entries
    cell_x, cell_y, cell_z = -1, -1, -1
    one, half, scale = np.float32(1), np.float32(0.5), np.float32(resolution)
    for i in range(len(points)):
        px = min(max(points[i, 0] + half, np.float32(0)), one) * scale
        py = min(max(points[i, 1] + half, np.float32(0)), one) * scale
        pz = min(max(points[i, 2] + half, np.float32(0)), one) * scale
        x, y, z = min(int(px), resolution - 1), min(int(py), resolution - 1), min(int(pz), resolution - 1)
        if x != cell_x or y != cell_y or z != cell_z:
            cell_x, cell_y, cell_z = x, y, z
            for c in range(8):
                cx, cy, cz = x + (c & 1), y + ((c >> 1) & 1), z + (c >> 2)
                if direct:
                    row = first + cx + side * (cy + side * cz)
                else:
                    row = first + ((np.uint32(cx) ^ np.uint32(cy) * PRIME_Y ^ np.uint32(cz) * PRIME_Z) & (entries - 1))
                corners[c, 0], corners[c, 1] = table[row, 0], table[row, 1]
        fx, fy, fz = px - np.float32(x), py - np.float32(y), pz - np.float32(z)
        gx, gy, gz = one - fx, one - fy, one - fz
        for k in range(2):
            near = gy * (gx * corners[0, k] + fx * corners[1, k]) + fy * (gx * corners[2, k] + fx * corners[3, k])
            far = gy * (gx * corners[4, k] + fx * corners[5, k]) + fy * (gx * corners[6, k] + fx * corners[7, k])
            features[k, i] = gz * near + fz * far
