"""Texture look-up at points and over patches."""

import numpy as np
import pytest

from stages.light.lookup import CLAMP, MIRROR, MOST, REPEAT, look_up


def test_points_at_texel_centres_between_them_and_beyond() -> None:
    image = np.array([[[0.0], [1.0]], [[2.0], [3.0]]], "f4")
    uv = np.array([[0.25, 0.25], [0.75, 0.75], [0.5, 0.5], [-1, -1], [0.5, 0.25]])
    np.testing.assert_allclose(look_up(image, uv)[:, 0], [0, 3, 1.5, 0, 0.5], atol=1e-6)


@pytest.mark.parametrize(("mode", "beyond"), [(REPEAT, [3, 0, 1]), (CLAMP, [0, 3, 3]), (MIRROR, [0, 3, 2])])
def test_wrapping(mode: int, beyond: list[float]) -> None:
    image = np.arange(4, dtype="f4").reshape(1, 4, 1)
    uv = np.array([[-0.125, 0.5], [1.125, 0.5], [1.375, 0.5]])
    np.testing.assert_allclose(look_up(image, uv, wrap=(mode, CLAMP))[:, 0], beyond, atol=1e-6)


def test_a_patch_is_the_mean_of_its_points() -> None:
    """Beside a hundred times as many points; patches turned, sheared, and up to 30 texels long."""
    rng = np.random.default_rng(0)
    image = rng.random((64, 64, 3)).astype("f4")
    uv, across = rng.uniform(0.4, 0.6, (20, 2)), rng.uniform(-0.15, 0.15, (20, 2, 2))
    grid = (np.arange(200) + 0.5) / 200 - 0.5
    a, b = (axis.ravel() for axis in np.meshgrid(grid, grid))
    for k in range(len(uv)):
        points = uv[k] + a[:, None] * across[k, 0] + b[:, None] * across[k, 1]
        assert look_up(image, uv[k : k + 1], across[k : k + 1])[0] == pytest.approx(look_up(image, points).mean(0), abs=0.03)


def test_detail_of_one_texel_does_not_show_in_wide_patches() -> None:
    """A checkerboard under patches of many sizes and places: the point flickers between 0 and 1, the patch does not."""
    board = (np.indices((256, 256)).sum(0) % 2).astype("f4")[..., None]
    rng = np.random.default_rng(1)
    uv, size = rng.uniform(0.2, 0.8, (500, 2)), rng.uniform(8, MOST, 500) / 256
    across = size[:, None, None] * np.eye(2)
    assert look_up(board, uv).std() > 0.15
    assert look_up(board, uv, across) == pytest.approx(0.5, abs=0.03)


def test_no_places_and_no_channels_lost() -> None:
    assert look_up(np.ones((2, 2, 5), "f4"), np.zeros((0, 2))).shape == (0, 5)
