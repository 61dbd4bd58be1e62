"""Noise goes, edges stay, and what has no noise is left alone."""

import numpy as np
import pytest

from stages.light import reconstruction
from stages.light.reconstruction import Neighbours, largest, noise_left, smoothed, variance


def plane(height: int = 32, width: int = 40) -> Neighbours:
    """A flat wall that fills the image."""
    y, x = np.mgrid[:height, :width].reshape(2, -1)
    index = np.arange(height * width, dtype=np.int32).reshape(height, width)
    n = np.tile(np.array([0, 0, 1], np.float32), (len(x), 1))
    point = np.stack([x, y, 0 * x], -1).astype(np.float32)
    return Neighbours(index, np.stack([x, y], -1).astype(np.int32), n, point)


def noisy(truth: np.ndarray, sigma: float) -> tuple[np.ndarray, np.ndarray]:
    """The mean of two halves, each of deviation sigma sqrt(2), and their difference."""
    halves = truth + sigma * 2**0.5 * np.random.default_rng(0).normal(size=(2, *truth.shape))
    return halves.mean(0).astype(np.float32), (halves[0] - halves[1]).astype(np.float32)


def test_variance_is_that_of_the_mean() -> None:
    near = plane()
    _, gap = noisy(np.ones((len(near.n), 2)), 0.1)
    found = variance(gap[:, :1], near)
    assert float(np.median(found)) == pytest.approx(0.01, rel=0.3)


def test_noise_on_a_wall_falls_threefold() -> None:
    near = plane()
    truth = np.full((len(near.n), 1, 3), 2.0)
    mean, gap = noisy(truth, 0.1)
    before, after = (np.sqrt(np.square(a - truth).mean()) for a in (mean, smoothed(mean, variance(gap, near), near)))
    assert after < 0.33 * before


def test_an_edge_beyond_the_noise_stays() -> None:
    near = plane()
    truth = np.where(near.pixel[:, :1, None] < 20, 1.0, 3.0)
    mean, gap = noisy(truth, 0.05)
    result = smoothed(mean, variance(gap, near), near)
    assert np.abs(result - truth).max() < 0.2


def test_what_has_no_noise_is_left_alone() -> None:
    near = plane()
    mean = np.random.default_rng(1).random((len(near.n), 1, 4)).astype(np.float32)
    assert smoothed(mean, np.zeros_like(mean), near) == pytest.approx(mean, abs=1e-6)


def test_another_surface_is_not_mixed_in() -> None:
    near = plane()
    right = near.pixel[:, 0] >= 20
    near.point[right, 2] = 0.5 * 40  # behind a silhouette
    truth = np.where(right, 1.0, 1.02)[:, None, None]
    mean, _ = noisy(truth, 0.0)
    result = smoothed(mean, np.full_like(mean, 0.01), near)
    assert result == pytest.approx(truth, abs=1e-5)


def test_joint_sums_keep_what_they_have_in_common() -> None:
    """Two sums share most of their noise, as lobes of one point share rays: it is no noise of their difference."""
    near = plane()
    shape = len(near.n), 1, 1
    common, gap = noisy(np.full(shape, 2.0), 0.1)
    own, own_gap = (np.roll(a, 7, 0) * np.array([0.2, -0.2])[:, None] for a in noisy(np.zeros(shape), 0.1))
    mean, noise = (common + own).astype(np.float32), variance((gap + own_gap).astype(np.float32), near)

    def error(joint: tuple[int, ...]) -> float:
        result = smoothed(mean, noise, near, joint)
        return float((result[:, 0] - result[:, 1]).std())

    assert error((0, 1)) < 0.85 * error(())


def alone(count: int) -> Neighbours:
    """Points in a row, each on a surface of its own."""
    near = plane(1, count)
    near.point[:, 2] = 100 * np.arange(count)
    return near


def test_noise_is_judged_as_seen() -> None:
    """A bright point's noise is not seen; that of each light, three channels, counts for itself."""
    mean, noise = np.ones((3, 1, 6), np.float32), np.zeros((3, 1, 6), np.float32)
    mean[1, 0, :3] = 99.0
    noise[:2, 0, :3] = 1.0
    noise[2, 0, 3] = 4.0
    left = noise_left(mean, noise, alone(3), (0,))
    assert left == pytest.approx(np.array([[3 / 2**4, 0], [3 / 100**4, 0], [0, 4 / 2**4]], np.float32))


def test_noise_left_is_what_smoothing_leaves() -> None:
    """A thin rim in front of a wall: as noisy as the wall, but with fewer neighbours to share the noise with."""
    near = plane()
    rim = near.pixel[:, 1] == 12
    near.point[rim, 2] = 20.0
    near.n[rim] = [0, 1, 0]
    mean, noise = np.ones((len(rim), 1, 3), np.float32), np.full((len(rim), 1, 3), 0.01, np.float32)
    left = noise_left(mean, noise, near, (0,))
    assert (largest(left, rim.mean())[:, 0] == rim).all()


def test_largest() -> None:
    values = np.array([[3, 1], [2, 9], [4, 0]], np.float32)
    assert largest(values, 0.5).tolist() == [[True, False], [False, True], [True, False]]
    assert not largest(values, 0.0).any()
    assert largest(np.ones((10, 1), np.float32), 0.3).sum() == 3


def averaged_plainly(mean: np.ndarray, noise: np.ndarray, near: Neighbours, power: int, joint: tuple[int, ...]) -> np.ndarray:
    """`_weighted`, one point and one neighbour after the other, in float64."""
    mean, noise = mean.astype(np.float64), noise.astype(np.float64)
    values, result = mean if power == 1 else noise, np.empty_like(mean)
    noisy = (noise > 0).any((0, 2))
    shared = [k for k in joint if noisy[k]]
    for p, (x, y) in enumerate(near.pixel):
        total, weight = values[p].copy(), np.ones_like(mean[p])
        window = near.index[max(y - 2, 0) : y + 3, max(x - 2, 0) : x + 3].ravel()
        for q in window[(window >= 0) & (window != p)]:
            step = (near.point[q] - near.point[p]).astype(np.float64)
            out = step @ near.n[p]
            same = max(0, 1 - reconstruction.NORMALS * np.square(near.n[p] - near.n[q]).sum())
            same *= max(0, 1 - out**2 / (step @ step * reconstruction.BEND))
            unlike = np.square(mean[p] - mean[q]) / (noise[p] + np.minimum(noise[p], noise[q]) + 1e-20)
            counts = noise[p, 0] > 0
            same *= max(0, 1 - unlike[0][counts].clip(0, 1e9).sum() / (reconstruction.TOGETHER * max(counts.sum(), 1)))
            unlike[shared] = unlike[shared].mean(0) if shared else 0
            w = same * np.maximum(0, 1 - unlike / reconstruction.TOLERANCE) ** 2 * noisy[:, None]
            total, weight = total + w**power * values[q], weight + w
        result[p] = total / weight**power
    return result


@pytest.mark.parametrize("power", (1, 2))
@pytest.mark.parametrize(("channels", "joint"), ((3, ()), (16, (1, 3))))
def test_averages_are_what_they_are_one_by_one(channels: int, joint: tuple[int, ...], power: int) -> None:
    generator, near = np.random.default_rng(2), plane(9, 11)
    near.n[near.pixel[:, 0] > 7] = [0, 0.6, 0.8]  # a bend
    near.n[near.pixel[:, 1] > 6] = [0, 0.06, 0.998]
    mean = generator.uniform(0, 1, (len(near.n), 4, channels)).astype(np.float32)
    noise = generator.uniform(0, 0.2, mean.shape).astype(np.float32)
    noise[:, 2] = noise[::3, :, 1] = 0
    found = reconstruction._weighted(mean, noise, near, power, joint)
    assert found == pytest.approx(averaged_plainly(mean, noise, near, power, joint), rel=2e-5, abs=1e-6)
