"""Topology of the working mesh as PyMeshLab measures it, for the report: what would trouble a modeller."""

import pymeshlab
from numpy.typing import NDArray

from stages.prep.topology import edges, pinched_vertices


def topology(vertices: NDArray, triangles: NDArray) -> dict[str, int | None]:
    """Non-manifold vertices, holes and genus of a welded mesh; holes and genus are None where it is not two-manifold.

    PyMeshLab is asked where no edge has more than two faces: its time grows with their square, to hours.

    Args:
        vertices: (V, 3). triangles: (F, 3).
    """
    if (edges(triangles).faces > 2).any():
        return {"non_manifold_vertices": pinched_vertices(triangles), "holes": None, "genus": None}
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertices.astype(float), triangles))
    found = meshes.get_topological_measures()
    manifold = found["is_mesh_two_manifold"]
    return {
        "non_manifold_vertices": int(found["non_two_manifold_vertices"]),
        "holes": int(found["number_holes"]) if manifold else None,
        "genus": int(found["genus"]) if manifold else None,
    }
