"""xatlas in a process of its own, so that a time limit, or a crash in it, cannot take the program along.

Run as `python xatlas_worker.py IN.npz OUT.npz`; needs nothing of this package. In: `vertices` (V, 3) float32,
`triangles` (F, 3) uint32. Out: `uv` (F, 3, 2) float32 in units of length, `chart` (F,) int32, -1 for faces without one.
"""

import sys

import numpy as np
import xatlas

_TEXELS = 256.0  # xatlas packs what it makes; at this size and without gutters that costs next to nothing


def main(request: str, answer: str) -> None:
    """Make charts for the mesh in `request`, write them to `answer`."""
    with np.load(request, allow_pickle=False) as mesh:
        vertices, triangles = mesh["vertices"], mesh["triangles"]
    atlas = xatlas.Atlas()
    atlas.add_mesh(vertices, triangles)
    pack = xatlas.PackOptions()
    pack.padding, pack.resolution, pack.bilinear, pack.rotate_charts = 0, int(_TEXELS), False, False
    atlas.generate(xatlas.ChartOptions(), pack)
    _, corners, uv = atlas.get_mesh(0)
    sheet, chart = atlas.get_mesh_vertex_assignment(0)
    size = np.array([atlas.width, atlas.height]) / atlas.texels_per_unit
    labels = np.where(sheet.astype(np.int64) == 0xFFFFFFFF, -1, chart.astype(np.int64)).astype(np.int32)
    per_corner = labels[corners]
    whole = (per_corner == per_corner[:, :1]).all(1)
    np.savez(answer, uv=(uv * size)[corners].astype(np.float32), chart=np.where(whole, per_corner[:, 0], -1))


if __name__ == "__main__":
    main(*sys.argv[1:])
