"""The texels that UVs cover, told without being misled by shared edges."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.prep.read_gltf import read_gltf
from stages.prep.read_obj import read_obj
from stages.prep.uv import coverage, loop_uvs, overlap, uv_charts
from tests.prep.shapes import GltfBuilder, write_obj


def grid(n: int, low: float = 0.0, high: float = 1.0, seed: int | None = None) -> NDArray[np.float64]:
    """(2 n n, 3, 2) a square cut into triangles, inner points moved about where a seed is given."""
    x = np.linspace(low, high, n + 1)
    points = np.stack(np.meshgrid(x, x), -1)
    if seed is not None:
        moves = np.random.default_rng(seed).uniform(-0.3, 0.3, (n - 1, n - 1, 2)) * (high - low) / n
        points[1:-1, 1:-1] += moves
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    return np.concatenate([np.stack(t, 2).reshape(-1, 3, 2) for t in ((a, b, c), (a, c, d))])


@pytest.mark.parametrize("n, seed", [(1, None), (8, None), (13, 1), (97, 2)])
def test_a_tiling_covers_every_texel_exactly_once(n: int, seed: int | None) -> None:
    """Also where edges pass through texel centres, and with half the triangles mirrored."""
    triangles = grid(n, seed=seed) * 64
    triangles[::2] = triangles[::2, ::-1]
    assert (coverage(triangles, 64, 64) == 1).all()


def test_coverage_against_half_planes() -> None:
    """Random triangles, also partly outside, against a test of every centre."""
    triangles = np.random.default_rng(3).uniform(-8, 40, (20, 3, 2))
    y, x = np.mgrid[:32, :32] + 0.5
    expected = np.zeros((32, 32), int)
    for a, b, c in triangles:
        sides = [(q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) for p, q in ((a, b), (b, c), (c, a))]
        expected += np.all([s > 0 for s in sides], 0) | np.all([s < 0 for s in sides], 0)
    assert (coverage(triangles, 32, 32) == expected).all()


def test_overlap_is_measured() -> None:
    apart = np.concatenate([grid(4, 0, 0.4), grid(4, 0.5, 0.9)])
    assert overlap(apart) == 0
    assert overlap(np.concatenate([grid(4, 0, 0.4), grid(3, 0.2, 0.6)])) == pytest.approx(0.04 / 0.28, rel=0.01)
    assert overlap(np.full((1, 3, 2), 0.5)) == 1


def test_v_up_keeps_its_bits_and_v_down_is_turned(tmp_path: Path) -> None:
    uv = np.random.default_rng(1).random((3, 2)).astype(np.float32)
    up = read_obj(write_obj(tmp_path / "a.obj", np.eye(3), [(2, 0, 1)], uv.astype(np.float64)))
    assert np.array_equal(loop_uvs(up), uv[[2, 0, 1]])
    built = GltfBuilder()
    attributes = {"POSITION": built.accessor(np.eye(3, dtype=np.float32), "VEC3"),
                  "TEXCOORD_0": built.accessor(uv, "VEC2")}  # fmt: skip
    built.mesh([{"attributes": attributes}])
    down = loop_uvs(read_gltf(built.write(tmp_path / "a.glb")))
    assert np.array_equal(down[:, 0], uv[:, 0])
    np.testing.assert_allclose(down[:, 1], 1 - uv[:, 1].astype(np.float64), atol=6e-8)


def test_charts_follow_uv_seams() -> None:
    triangles = np.array([(0, 1, 2), (2, 1, 3), (2, 3, 4)])
    uv = np.array([(0, 0), (1, 0), (0, 1), (1, 1), (0, 2)], np.float32)[triangles] / 4
    assert uv_charts(triangles, uv).tolist() == [0, 0, 0]
    uv[2] += np.float32(0.5)
    assert uv_charts(triangles, uv).tolist() == [0, 0, 1]
