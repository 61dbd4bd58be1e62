"""Bytes of maps: the fast form beside the obvious one."""

import numpy as np

from stages.asset.eight_bits import BAND, normal_8bit, srgb_8bit, to_8bit
from stages.core.color import srgb_encode


def test_srgb_bytes_are_the_rounded_curve() -> None:
    linear = np.concatenate([np.linspace(0, 1, 100_006), [-1, 2]]).astype("f4").reshape(-1, 2, 3)
    exact = srgb_encode(linear.astype(float)) * 255
    assert np.abs(srgb_8bit(linear) - exact).max() <= 0.5 + 1e-4


def test_normals_are_dithered_alike_however_many_rows_go_together() -> None:
    """The noise is one stream: whether a map fits into one band or takes several changes nothing of its bytes."""
    vectors = np.random.default_rng(1).normal(size=(2 * BAND // (3 * 256) + 5, 256, 3)).astype(np.float32)
    vectors[:9, :9] = (0, 0, 1)
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    noise = np.random.default_rng(0).random(vectors.shape, np.float32)
    obvious = np.clip((vectors + 1) * np.float32(127.5) + noise, 0, 255).astype(np.uint8)
    obvious[:9, :9] = (128, 128, 255)
    np.testing.assert_array_equal(normal_8bit(vectors), obvious)


def test_bytes_are_rounded_to_nearest() -> None:
    values = np.array([-1, 0, 0.5 / 255 - 1e-4, 0.5 / 255 + 1e-4, 1, 2], np.float32)
    assert to_8bit(values).tolist() == [0, 0, 0, 1, 255, 255]
