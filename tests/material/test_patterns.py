"""Noise, cells, strokes, tiles and threads: their scale, their spectrum, their period, and what a footprint leaves of them."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from stages.material import patterns
from stages.material.noise_kernels import GRADIENT_SCALE, Octave, Period, Shape, add_octave, corner, slope_at, unit
from stages.material.patterns import Spectrum, cells, edge, fbm, line, lost, marks, masked, noise, spots, tiles, weave
from stages.material.place import Place
from tests.material.places import square


def test_noise_is_what_a_plain_reading_of_perlin_says() -> None:
    """The compiled loop against one point after the other, corner by corner."""
    rng = np.random.default_rng(0)
    x, y, z = rng.uniform(-20, 20, (3, 200)).astype(np.float32)
    found, fine, even = np.zeros(200, np.float32), np.full(200, 1e-6, np.float32), np.empty(0, np.float32)
    octave = Octave((1.0, 1.0, 1.0), Period(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), np.uint32(5), 1.0, 1.0)
    add_octave(x, y, z, octave, fine, even, Shape(0.0, 0.0), found)

    def plain(p: np.ndarray) -> float:
        cell = np.floor(p)
        offset, total = p - cell, 0.0
        fade = offset**3 * (offset * (offset * 6 - 15) + 10)
        for k in range(8):
            step = np.array([k & 1, k >> 1 & 1, k >> 2], np.float32)
            weight = np.prod(np.where(step == 1, fade, 1 - fade))
            h = corner.py_func(*(cell + step).astype(np.float32), np.uint32(5)) if hasattr(corner, "py_func") else 0
            total += weight * slope_at.py_func(h, *(offset - step))
        return total * float(GRADIENT_SCALE)

    with np.errstate(over="ignore"):
        wanted = [plain(np.array(p, np.float32)) for p in zip(x, y, z, strict=True)]
    np.testing.assert_allclose(found, wanted, atol=2e-5)
    assert 0 <= unit.py_func(np.uint32(0xFFFFFFFF)) < 1


@pytest.mark.parametrize("size", [0.3, 0.05, 0.011])
def test_noise_has_mean_0_and_deviation_1(size: float) -> None:
    at = square(4.0, 300, footprint=1e-6)
    value = noise(at, size)
    assert abs(value.mean()) < 0.1 and abs(value.std() - 1) < 0.12


@pytest.mark.parametrize("rise", [0.6, 1.0, 1.2])
def test_a_spectrum_has_the_contrast_it_names_at_every_octave(rise: float) -> None:
    at = square(1.0, 256, footprint=1e-6)
    spectrum = Spectrum(0.2, 0.0125, rise)
    strengths = spectrum.strengths()
    assert spectrum.octaves == 5 and abs(sum(s * s for s in strengths) - 1) < 1e-9
    for wide, narrow in itertools.pairwise(strengths):
        assert narrow == pytest.approx(rise * wide)
    assert fbm(at, spectrum).std() == pytest.approx(1, abs=0.15)


def test_tails_skew_and_patches_do_what_they_say() -> None:
    at = square(1.0, 400, footprint=1e-6)
    plain = Spectrum(0.02, 0.01)

    def moment(value: np.ndarray, k: int) -> float:
        return float((((value - value.mean()) / value.std()) ** k).mean())

    even = fbm(at, plain)
    assert moment(fbm(at, plain._replace(tails=0.6)), 4) > moment(even, 4) + 1
    assert moment(fbm(at, plain._replace(skew=0.4)), 3) > 0.5 and moment(fbm(at, plain._replace(skew=-0.4)), 3) < -0.5
    blocks = lambda v: v.reshape(20, 20, 20, 20).std((1, 3))  # noqa: E731
    patchy = fbm(at, plain._replace(patch=0.8))
    assert blocks(patchy).std() / blocks(patchy).mean() > 1.3 * blocks(even).std() / blocks(even).mean()


def test_what_a_footprint_hides_is_gone_and_counted() -> None:
    spectrum = Spectrum(0.2, 0.0125, 1.0)
    for footprint in (1e-6, 0.02, 0.09, 0.5):
        at = square(2.0, 300, footprint)
        assert fbm(at, spectrum).std() ** 2 + float(lost(at, spectrum)[0]) ** 2 == pytest.approx(1, abs=0.2)
    assert fbm(square(2.0, 50, 0.5), spectrum).std() == 0


@pytest.mark.parametrize("footprint", [1e-5, 0.01, 0.05, 0.3])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.8])
def test_a_mask_covers_its_share_at_any_footprint(share: float, footprint: float) -> None:
    at = square(3.0, 256, footprint)
    assert masked(at, Spectrum(0.15, 0.002, 0.8), share).mean() == pytest.approx(share, abs=0.06)


PATTERNS = {
    "noise": lambda at: noise(at, 0.13),
    "fbm": lambda at: fbm(at, Spectrum(0.2, 0.004, 0.9, (1, 3, 1), 0.3, 0.2, 0.4)),
    "cells": lambda at: cells(at, 0.07).border,
    "stretched cells": lambda at: cells(at, 0.04, stretch=(1, 5, 1)).near,
    "spots": lambda at: spots(at, 0.1, (0.02, 0.04)).inside,
    "marks": lambda at: marks(at, 0.1, 0.004, 3, 0.4, 6.28).cover,
    "running bond": lambda at: tiles(at, 0.21, 0.06).border + tiles(at, 0.21, 0.06).random(1),
    "random bond": lambda at: tiles(at, 0.3, 0.1, "random").border + tiles(at, 0.3, 0.1, "random").random(1),
    "twill": lambda at: weave(at, 0.03, "twill").height + weave(at, 0.03, "twill").random(1),
    "warped": lambda at: noise(patterns.warped(at, 0.02, 0.1), 0.1),
}


@pytest.mark.parametrize("name", PATTERNS)
def test_patterns_repeat_with_their_period(name: str) -> None:
    """The same square, and one a whole period further along both axes."""
    here, there = square(1.0, 64, 1e-4), square(1.0, 64, 1e-4, shift=1.0)
    one, other = PATTERNS[name](here), PATTERNS[name](there)
    assert np.quantile(abs(one - other), 0.97) < 0.02 and one.std() > 0


@pytest.mark.parametrize("name", PATTERNS)
def test_patterns_are_functions_of_the_place(name: str) -> None:
    at = square(1.0, 48, 1e-3)
    order = np.random.default_rng(0).permutation(len(at))
    np.testing.assert_array_equal(PATTERNS[name](at)[order], PATTERNS[name](at[order]))


def test_some_points_of_a_place_lie_row_by_row_as_kernels_want_them() -> None:
    """Coordinates with others between them take kernels up to twice the time."""
    at = replace(square(1.0, 16), bend=np.ones((3, 256), np.float32))
    for rows in (np.flatnonzero(np.arange(256) % 3), slice(5, 90)):
        some = at[rows]
        for values, whole in ((some.p, at.p), (some.uv, at.uv), (some.bend, at.bend)):
            np.testing.assert_array_equal(values, whole[:, rows])
            assert all(row.flags.c_contiguous for row in values)


def test_cells_are_worley_s() -> None:
    """Distances fall to nothing at the points, borders to nothing between two; each cell has numbers of its own."""
    at = square(1.0, 300, 1e-4)
    found = cells(at, 0.1)
    assert (found.near <= found.second).all() and found.near.min() < 0.01 and found.border.min() < 0.002
    np.testing.assert_allclose(np.linalg.norm(found.offset, axis=0), found.near, rtol=1e-4)
    near = found.border > 0.01
    assert len(np.unique(found.random(1)[near])) > 60
    assert abs(found.random(1).mean() - 0.5) < 0.1 and abs(np.corrcoef(found.random(1), found.random(2))[0, 1]) < 0.2


@pytest.mark.parametrize("around", [200, 30, 8, 2])
def test_neighbours_in_a_row_are_told_what_each_is_told_alone(around: int) -> None:
    """Cells and strokes draw what is near once for points of one cell; in any other order they are told the same."""
    count = 4000
    across = (np.arange(count) / (around * 20)).astype(np.float32)
    row = Place(np.stack([across, 0 * across + 0.31, 0.2 * across]), np.stack([across, across]), np.zeros(count, np.int32),
                np.full(count, 1e-3, np.float32))  # fmt: skip
    order = np.random.default_rng(1).permutation(count)
    for jitter in (0.6, 1.0):
        together, alone = cells(row, 0.05, 3, jitter), cells(row[order], 0.05, 3, jitter)
        np.testing.assert_array_equal(together.ident[order], alone.ident)
        np.testing.assert_allclose(together.border[order], alone.border, atol=1e-6)
        np.testing.assert_allclose(together.offset[:, order], alone.offset, atol=1e-7)
    lain, each = (marks(at, 0.05, 0.006, 8, 0.3, 2 * np.pi, 5, 0.5, 0.3) for at in (row, row[order]))
    assert (lain.cover > 0.5).mean() > 0.2
    np.testing.assert_array_equal(lain.ident[order], each.ident)
    np.testing.assert_allclose(lain.across[order], each.across, atol=1e-4)


def test_strokes_have_the_direction_and_width_they_are_given() -> None:
    at = square(1.0, 500, 1e-4)
    found = marks(at, 0.2, 0.006, 4, 0.0, 0.1, vary=0.0)
    on = found.cover.reshape(500, 500) > 0.5
    assert 0.02 < on.mean() < 0.2
    along, across = np.diff(on, axis=1).mean(), np.diff(on, axis=0).mean()
    assert across > 4 * along  # they run along the first axis


def test_edges_and_lines_are_averages_over_the_footprint() -> None:
    distance = np.linspace(-1, 1, 2001).astype(np.float32)
    for footprint in (0.05, 0.4):
        width = np.full(len(distance), footprint, np.float32)
        boxed = np.array([np.clip((d + footprint / 2) / footprint, 0, 1) for d in distance])
        np.testing.assert_allclose(edge(distance, width), boxed, atol=1e-5)
        assert line(distance, 0.1, width).sum() * 0.001 == pytest.approx(0.2, abs=2e-3)  # as much as is there


def test_a_running_bond_is_offset_by_half() -> None:
    found = tiles(square(1.2, 240), 0.2, 0.1)
    x = found.x.reshape(240, 240)
    joints = lambda row: np.flatnonzero(np.diff(x[row]) < 0)  # noqa: E731
    first, second = joints(5), joints(25)
    assert len(first) in (5, 6) and abs((second[0] - first[0]) % 40) == 20


def test_a_weave_goes_over_and_under() -> None:
    found = weave(square(0.12, 240, 1e-5), 0.01, "plain")
    warp = found.warp.reshape(240, 240)[10::20, 10::20]
    assert (warp[::2, ::2] == warp[0, 0]).all() and (warp[1::2, ::2] == 1 - warp[0, 0]).all()


def test_what_is_finer_than_a_displacement_is_not_drawn_out_by_it() -> None:
    """Else it would follow the displacement's contour lines: along them it would vary little, across them much."""
    at = square(0.2, 200, 1e-4)
    bent = patterns.warped(at, 0.008, 0.03, 1, 4)
    fine, along = noise(bent, 0.0015), np.abs(bent.bend).max()
    assert along > 0.01 and np.corrcoef(fine, noise(at, 0.0015))[0, 1] > 0.3  # displaced by a third of its size
    steps = [np.abs(np.diff(fine.reshape(200, 200), axis=axis)).mean() for axis in (0, 1)]
    still = [np.abs(np.diff(noise(at, 0.0015).reshape(200, 200), axis=axis)).mean() for axis in (0, 1)]
    np.testing.assert_allclose(steps, still, rtol=0.3)
    np.testing.assert_array_equal(noise(bent, 0.05), noise(replace(bent, bend=None), 0.05))  # what is wider follows wholly
    assert not patterns.warped(at.flat, 0.008, 0.03, 1).bend[2].any()  # a surface's two axes stay on it


def test_fading_is_what_makes_samples_most_like_the_mean_over_their_area() -> None:
    """Of the mean of 2 x 2 samples that stand for a square, beside that of 16 x 16."""
    corner = np.random.default_rng(0).uniform(0, 300, (2, 4000))
    for share in (0.3, 0.6, 1.0, 1.3):

        def mean(count: int, footprint: float = share) -> np.ndarray:
            step = (np.arange(count) + 0.5) / count * 2 * footprint
            u, v = (np.add.outer(axis, steps.ravel()) for axis, steps in zip(corner, np.meshgrid(step, step), strict=True))
            p = np.stack([u.ravel(), v.ravel(), 0 * u.ravel()]).astype(np.float32)
            at = Place(p, p[:2], np.zeros(p.shape[1], np.int32), np.full(p.shape[1], 1e-6, np.float32))
            return noise(at, 1.0).reshape(len(corner.T), -1).mean(1)

        samples, truth = mean(2), mean(16)
        best = (samples @ truth) / (samples @ samples)
        assert patterns.fading(1.0, np.float32(share)) == pytest.approx(best, abs=0.1)


def test_seeds_draw_other_patterns_of_the_same_kind() -> None:
    at = square(2.0, 200, 1e-4)
    one, other = noise(at, 0.1), noise(at.seeded(1), 0.1)
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.1 and abs(one.std() - other.std()) < 0.1


def test_nothing_breaks_far_out_or_without_points() -> None:
    at = square(1.0, 8, 1e-3)
    far = Place(at.p + np.float32(1e4), at.uv + np.float32(1e4), at.face, at.footprint)
    for pattern in PATTERNS.values():
        assert np.isfinite(pattern(far)).all()
        assert len(pattern(at[:0])) == 0
