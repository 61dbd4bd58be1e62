"""What is counted without PyMeshLab is what PyMeshLab counts."""

import numpy as np
import pymeshlab
import pytest

from stages.prep.measure import topology
from stages.prep.topology import pinched_vertices
from tests.prep.hostile import KINDS, book


@pytest.mark.parametrize("kind", ["voxels", "honeycomb", "leaves", "crumbs", "bicone", "shells"])
def test_pinched_vertices_are_those_of_pymeshlab(kind: str) -> None:
    vertices, triangles = KINDS[kind](1500)
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertices, triangles.astype(np.int32)))
    meshes.meshing_remove_unreferenced_vertices()
    assert pinched_vertices(triangles) == meshes.get_topological_measures()["non_two_manifold_vertices"]


def test_a_hundred_thousand_faces_on_one_edge_are_measured() -> None:
    assert topology(*book(100_000)) == {"non_manifold_vertices": 0, "holes": None, "genus": None}


def test_two_fans_that_share_a_vertex_are_counted() -> None:
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)], float)
    assert topology(vertices, np.array([(0, 1, 2), (0, 3, 4)], np.int32))["non_manifold_vertices"] == 1
