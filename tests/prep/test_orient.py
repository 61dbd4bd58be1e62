"""Winding ends up consistent and outward, whatever it was."""

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.light.scene import Scene
from stages.prep.orient import outward
from stages.prep.topology import edges
from tests.prep.hostile import leaves, slivers
from tests.prep.shapes import cube, moebius, sphere


def wound(vertices: NDArray, triangles: NDArray) -> NDArray:
    flip = outward(vertices, triangles).flip
    return np.where(flip[:, None], triangles[:, [0, 2, 1]], triangles)


def volume(vertices: NDArray, triangles: NDArray) -> float:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


def turned(triangles: NDArray, mask: NDArray) -> NDArray:
    return np.where(mask[:, None], triangles[:, [0, 2, 1]], triangles)


@pytest.mark.parametrize("seed", range(3))
def test_random_winding_of_a_closed_mesh_is_mended(seed: int) -> None:
    vertices, triangles = sphere()
    mixed = turned(triangles, np.random.default_rng(seed).random(len(triangles)) < 0.5)
    assert np.array_equal(wound(vertices / 2, mixed), turned(mixed, (mixed != triangles).any(1)))


def test_each_part_is_told_apart() -> None:
    """Three cubes, two of them inside out, one nested in another."""
    vertices, triangles = cube()
    vertices = (vertices - 0.5) / 4
    stack = np.concatenate([vertices, vertices / 3, vertices + [0.4, 0, 0]])
    faces = np.concatenate([triangles[:, ::-1], triangles[:, ::-1] + 8, triangles + 16])
    result = wound(stack, faces)
    assert all(volume(stack, result[12 * k : 12 * k + 12]) > 0 for k in range(3))


def test_parts_that_share_an_edge_do_not_confuse_each_other() -> None:
    """Two cubes with a common edge, one inside out: four faces meet there."""
    vertices, triangles = cube()
    ids = np.arange(8) + 8
    ids[[0, 4]] = [2, 6]  # the second cube's edge (0, 4) is the first one's (2, 6)
    both = np.concatenate([vertices, vertices + [1, 1, 0]]) / 2 - 0.5
    result = wound(both, np.concatenate([triangles, ids[triangles[:, ::-1]]]))
    assert volume(both, result[:12]) > 0 and volume(both, result[12:]) > 0


@pytest.mark.parametrize("inside_out", [False, True])
def test_an_open_shell_turns_its_front_to_the_sky(inside_out: bool) -> None:
    """A sphere with a hole has no volume of its own; the side that sees more sky is outside."""
    vertices, triangles = sphere()
    shell = triangles[vertices[triangles].mean(1)[:, 2] < 0.8]
    result = wound(vertices / 2, shell[:, ::-1] if inside_out else shell)
    normal = np.cross(*(vertices[result[:, k]] - vertices[result[:, 0]] for k in (1, 2)))
    assert ((normal * vertices[result].mean(1)).sum(1) > 0).all()


@pytest.mark.parametrize("reverse", [False, True])
def test_a_sheet_keeps_its_side(reverse: bool) -> None:
    """Both sides of a flat sheet see as much: the file's winding decides."""
    grid = np.array([(x, y, 0) for y in range(4) for x in range(4)], float) / 4
    cells = [(4 * y + x, 4 * y + x + 1, 4 * y + x + 5, 4 * y + x + 4) for y in range(3) for x in range(3)]
    faces = np.array([(q[0], q[k], q[k + 1]) for q in cells for k in (1, 2)])
    faces = faces[:, ::-1] if reverse else faces
    assert not outward(grid, faces).flip.any()
    odd = np.arange(len(faces)) == 4
    assert np.array_equal(outward(grid, turned(faces, odd)).flip, odd)


def test_a_moebius_band_ends_with_one_seam() -> None:
    vertices, triangles = moebius()
    winding = outward(vertices / 3, triangles)
    result = turned(triangles, winding.flip)
    table = edges(result)
    clashes = (table.forward[table.pairs[:, 0]] == table.forward[table.pairs[:, 1]]).sum()
    assert winding.non_orientable == clashes == 1


def test_a_consistent_mesh_is_left_alone() -> None:
    vertices, triangles = sphere()
    winding = outward(vertices / 2, triangles)
    assert not winding.flip.any() and winding.non_orientable == 0 and set(winding.patch) == {0}


@pytest.fixture
def rays(monkeypatch: pytest.MonkeyPatch) -> NDArray[np.int64]:
    """Counts rays, none of which is blocked."""
    count = np.zeros(1, np.int64)

    def none_blocked(scene: Scene, origins: NDArray, directions: NDArray) -> NDArray:
        count[0] += len(origins)
        return np.zeros(len(origins), bool)

    monkeypatch.setattr(Scene, "occluded", none_blocked)
    return count


@pytest.mark.parametrize("count, effort, samples", [(2, 1e6, 256), (200, 1.5e5, 30), (10_000, 4e5, 1), (10_000, 1e4, 0)])
def test_the_rays_of_all_open_patches_together_are_bounded(
    monkeypatch: pytest.MonkeyPatch, rays: NDArray, count: int, effort: float, samples: int
) -> None:
    """Each patch has as many points as there is time for, or only the largest have one; a free leaf keeps its side."""
    monkeypatch.setattr("stages.prep.orient._EFFORT", effort)
    vertices, triangles = leaves(count)
    assert not outward(vertices, triangles).flip.any()
    assert samples * count <= rays[0] / 32 <= max(2 * samples, 0.1) * count


def test_slow_rays_are_fewer(monkeypatch: pytest.MonkeyPatch, rays: NDArray) -> None:
    """A ray among slivers meets many boxes with nothing in them: as many slivers as leaves have a tenth of the rays."""
    monkeypatch.setattr("stages.prep.orient._EFFORT", 1e5)
    outward(*leaves(5000))
    among_leaves = int(rays[0])
    outward(*slivers(5000))
    assert 0 < rays[0] - among_leaves < among_leaves / 10


def test_the_side_of_many_open_shells_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four hundred cups on a grid, half of them inside out, from 20 points each."""
    vertices, triangles = sphere(6, 12)
    cup = triangles[vertices[triangles].mean(1)[:, 2] < 0.8]
    place = np.stack([*np.mgrid[:20, :20], np.zeros((20, 20))], -1).reshape(-1, 1, 3) / 20
    faces = (cup + len(vertices) * np.arange(400)[:, None, None]).reshape(-1, 3)
    turn = np.repeat(np.arange(400) % 2 == 1, len(cup))
    monkeypatch.setattr("stages.prep.orient._EFFORT", 1e5)
    assert np.array_equal(outward((vertices / 50 + place).reshape(-1, 3), turned(faces, turn)).flip, turn)
