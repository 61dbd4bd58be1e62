"""Tangents by the MikkTSpace rule, beside those of mikktspace.c on the same corners.

`mikktspace/reference.npz` holds its answers: `python -m tests.core.test_tangents` makes it again by node, with the npm
package `mikktspace` (that C code, compiled) where NODE_PATH finds it.
"""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.core.tangents import mikktspace

FOLDER = Path(__file__).parent / "mikktspace"

Corners = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]


def ball(rows: int = 6, columns: int = 10, mirrored: bool = False) -> Corners:
    """A sphere with poles of triangles without area; mirrored: its other half shows the first half's UVs reversed."""
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    a, e = 2 * np.pi * u, np.pi * (v - 0.5)
    points = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], -1)
    points[0], points[-1], points[:, -1] = points[0, :1], points[-1, :1], points[:, 0]
    uv = np.stack([np.abs(u - 0.5) if mirrored else u, v], -1)
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    corner = [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)]
    cut = [[corner[0], corner[1], corner[2]], [corner[0], corner[2], corner[3]]]
    pick = [np.stack([np.stack([grid[c] for c in triangle], 2) for triangle in cut], 2) for grid in (points, points, uv)]
    p, n, t = (values.reshape(-1, 3, values.shape[-1]).astype(np.float32) for values in pick)
    return p, n, t


def without_uv(corners: Corners) -> Corners:
    """Every fifth triangle has one UV at all its corners, and borrows its tangents from its neighbours."""
    p, n, t = (values.copy() for values in corners)
    t[::5] = t[::5, :1]
    return p, n, t


def crumpled(seed: int) -> Corners:
    """A sheet of random heights, normals and UVs, whose triangles are wound either way in UV."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(8), np.arange(8), indexing="ij")
    points = np.stack([x, y, rng.normal(0, 0.5, x.shape)], -1).reshape(-1, 3)
    normals = rng.normal(0, 0.4, points.shape) + [0, 0, 1]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    uv = rng.random((64, 2))
    index = np.arange(64).reshape(8, 8)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    p, n, t = (values[triangles].astype(np.float32) for values in (points, normals, uv))
    return p, n, t


CASES = {
    "ball": ball(),
    "mirrored": ball(mirrored=True),
    "borrowed": without_uv(ball()),
    "crumpled": crumpled(0),
    "crumpled_again": crumpled(1),
}


@pytest.mark.parametrize("name", CASES)
def test_tangents_are_those_of_the_reference(name: str) -> None:
    corners = CASES[name]
    with np.load(FOLDER / "reference.npz") as held:
        np.testing.assert_array_equal(held[f"{name}_corners"], flat(corners))  # the same question
        wanted = held[name].reshape(-1, 3, 4)
    made = mikktspace(*corners)
    answered = np.linalg.norm(wanted[..., :3], axis=-1) > 0.5
    assert answered.mean() > 0.95
    np.testing.assert_allclose(made[answered], wanted[answered], atol=3e-6)
    np.testing.assert_allclose(np.linalg.norm(made[..., :3], axis=-1), 1, atol=1e-6)


def test_tangent_follows_u_and_the_sign_tells_mirrored_uvs() -> None:
    """A quad in the plane z = 0, its UVs turned by 90 degrees, and the same mirrored."""
    p = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], "f4")
    n = np.zeros_like(p) + np.array([0, 0, 1], "f4")
    turned = np.stack([p[..., 1], -p[..., 0]], -1)
    np.testing.assert_allclose(mikktspace(p, n, turned), np.broadcast_to([0, 1, 0, 1], (2, 3, 4)), atol=1e-7)
    mirrored = np.stack([p[..., 1], p[..., 0]], -1)
    np.testing.assert_allclose(mikktspace(p, n, mirrored), np.broadcast_to([0, 1, 0, -1], (2, 3, 4)), atol=1e-7)


def test_nothing_to_do_and_nothing_to_go_by() -> None:
    """No triangles; triangles without UVs or without size still get unit vectors, which glTF asks for."""
    assert mikktspace(np.zeros((0, 3, 3), "f4"), np.zeros((0, 3, 3), "f4"), np.zeros((0, 3, 2), "f4")).shape == (0, 3, 4)
    p, n, t = ball()
    for made in (mikktspace(p, n, 0 * t), mikktspace(0 * p, n, t)):
        np.testing.assert_allclose(np.linalg.norm(made[..., :3], axis=-1), 1, atol=1e-6)
        assert (np.abs(made[..., 3]) == 1).all()


def flat(corners: Corners) -> NDArray[np.float32]:
    """All positions, then all normals, then all UVs, as `reference.mjs` reads them."""
    return np.concatenate([values.reshape(-1) for values in corners])


def make_reference(folder: Path) -> None:
    """Ask mikktspace.c. It is given v as it is here, up, so that its sign is ours."""
    held = {}
    for name, corners in CASES.items():
        question = folder / "corners.bin"
        flat(corners).tofile(question)
        run = subprocess.run(["node", str(FOLDER / "reference.mjs"), str(question)], capture_output=True, check=True)
        question.unlink()
        held |= {name: np.frombuffer(run.stdout, np.float32), f"{name}_corners": flat(corners)}
    np.savez_compressed(FOLDER / "reference.npz", **held)


if __name__ == "__main__":
    make_reference(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
