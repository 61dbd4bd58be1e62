"""What is counted and joined here is what PyMeshLab, SciPy and NumPy count and join."""

import numpy as np
import pymeshlab
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from stages.prep.measure import topology
from stages.prep.topology import components, edges, pinched_vertices
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


@pytest.mark.parametrize("count", [0, 1, 7, 400, 4000])
def test_components_are_those_of_scipy_by_their_first_member(count: int) -> None:
    links = np.random.default_rng(count).integers(0, max(count, 1), (2 * count // 3, 2))
    labels = components(count, links)
    graph = coo_matrix((np.ones(len(links)), links.T), shape=(count, count))
    theirs = connected_components(graph, directed=False)[1] if count else np.zeros(0, int)
    _, first, inverse = np.unique(theirs, return_index=True, return_inverse=True)
    np.testing.assert_array_equal(labels, np.argsort(np.argsort(first))[inverse])


@pytest.mark.parametrize("kind", ["voxels", "leaves", "bicone"])
def test_edges_are_the_pairs_of_vertices_however_often_used(kind: str) -> None:
    triangles = KINDS[kind](1500)[1]
    table = edges(triangles)
    ends = np.stack([triangles.reshape(-1), np.roll(triangles, -1, 1).reshape(-1)], -1)
    _, edge, faces = np.unique(np.sort(ends, 1), axis=0, return_inverse=True, return_counts=True)
    np.testing.assert_array_equal(table.edge, edge.reshape(-1))
    np.testing.assert_array_equal(table.faces, faces)
    np.testing.assert_array_equal(table.forward, ends[:, 0] < ends[:, 1])
    assert len(table.pairs) == (faces == 2).sum()
    assert (np.diff(table.edge[table.pairs], axis=1) == 0).all() and (table.pairs[:, 0] < table.pairs[:, 1]).all()
    assert edges(np.zeros((0, 3), np.int32)).pairs.shape == (0, 2)
