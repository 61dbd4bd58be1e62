"""xatlas in a process of its own, so that a time limit, or a crash in it, cannot take the program along.

Run by its path, with the width of xatlas's own sheet and its padding in texels; needs nothing of this package. stdin: V and
F as int64, vertices (V, 3) float32, triangles (F, 3) uint32. stdout: UVs (F, 3, 2) float32 in units of length, then the chart
(F,) int32 of each face, -1 for none.
"""

import os
import sys

import numpy as np
import xatlas


def main() -> None:
    """Make charts for the mesh on stdin, write them to stdout, and end without a clean-up.

    xatlas's own can wait for ever: it wakes its idle threads without their lock, so one about to sleep misses it.
    """
    request = sys.stdin.buffer.read()
    count, faces = np.frombuffer(request, np.int64, 2)
    vertices = np.frombuffer(request, np.float32, 3 * count, 16).reshape(-1, 3)
    triangles = np.frombuffer(request, np.uint32, 3 * faces, 16 + vertices.nbytes).reshape(-1, 3)
    atlas = xatlas.Atlas()
    atlas.add_mesh(vertices, triangles)
    pack = xatlas.PackOptions()
    pack.resolution, pack.padding = map(int, sys.argv[1:])
    pack.bilinear, pack.rotate_charts = False, pack.padding > 0
    atlas.generate(xatlas.ChartOptions(), pack)
    _, corners, uv = atlas.get_mesh(0)
    sheet, chart = atlas.get_mesh_vertex_assignment(0)
    size = np.array([atlas.width, atlas.height]) / atlas.texels_per_unit
    labels = np.where(sheet.astype(np.int64) == 0xFFFFFFFF, -1, chart.astype(np.int64)).astype(np.int32)[corners]
    whole = (labels == labels[:, :1]).all(1)
    sys.stdout.buffer.write((uv * size)[corners].astype(np.float32).tobytes())
    sys.stdout.buffer.write(np.where(whole, labels[:, 0], -1).astype(np.int32).tobytes())
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
