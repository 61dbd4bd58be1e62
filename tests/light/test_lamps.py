"""Highlights that are known: right in the open, taken out and put back without a trace, and not flattened by smoothing."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from stages.core.color import luminance
from stages.light import lamps
from stages.light.environment import Environment
from stages.light.light_set import CHANNELS, FINE, light_set
from stages.light.reconstruction import Neighbours
from stages.light.reference import reference_transport
from stages.light.terms import GLTF
from stages.light.transport import Quality, gather, smoothed
from tests.light import scenes

PLACES = GLTF.places_of_highlights()
ALPHAS = GLTF.alphas[list(GLTF.highlights)]


def night() -> Environment:
    """A dim room with small lamps and a window."""
    pixels = np.full((64, 128, 3), 0.02, np.float32)
    pixels[24, ::9] = (30.0, 24.0, 12.0)
    pixels[28:34, 100:106] = 4.0
    return Environment("night", pixels)


def test_clusters_hold_all_of_the_excess_and_are_small_where_it_is_bright() -> None:
    peaks = np.zeros((2, FINE, FINE, 3), np.float32)
    peaks[0, 100, 200] = (9, 5, 1)
    peaks[1, :96, :96] = np.random.default_rng(0).random((96, 96, 3))
    found = lamps.cluster(peaks, luminance(peaks).mean((1, 2)), CHANNELS)
    total = peaks.sum((1, 2)) * 4 * np.pi / FINE**2
    assert found.flux.sum(0)[:6] == pytest.approx(total.ravel(), rel=1e-5)
    assert np.linalg.norm(found.direction, axis=0) == pytest.approx(1, abs=1e-6)
    alone = found.flux[:, 0] > 0
    assert alone.sum() == 1 and found.spread[alone] == pytest.approx(0, abs=1e-6)
    share = luminance(found.flux[~alone, 3:6]) / luminance(total[1])
    finest = 4 * np.pi / lamps.FINEST**2  # a patch of that many steradians spreads by less than that
    assert ((share * found.spread[~alone] <= lamps.BLUR) | (found.spread[~alone] < finest)).all()


def test_no_light_has_no_lamps() -> None:
    assert lamps.cluster(np.zeros((1, FINE, FINE, 3)), np.zeros(1), CHANNELS).flux.shape == (0, CHANNELS)


@pytest.mark.parametrize("cosine", (0.3, 0.7, 1.0))
def test_what_is_taken_out_is_what_an_open_point_shows(cosine: float) -> None:
    """Of a lamp alone, nearly mirrored: within 8 % of float64 quadrature; a fifth where the lobe is as narrow as a cluster."""
    pixels = np.zeros((128, 256, 3), np.float32)
    points = scenes.open_point(cosine)
    mirrored = 2 * cosine * points.n[0] - points.wo[0]
    row = int(np.arccos(np.clip(mirrored[2], -1, 1)) / np.pi * 128) + 2
    column = int((0.5 - np.arctan2(mirrored[1], mirrored[0]) / (2 * np.pi)) * 256) % 256
    pixels[row : row + 2, column : column + 2] = (50, 40, 10)
    lights = light_set([Environment("lamp", pixels)])
    mean = np.zeros((1, GLTF.stored, CHANNELS), np.float32)
    lamps.take_out(mean, points, lights.lamps, ALPHAS, PLACES)
    exact = reference_transport(scenes.sphere(1), points, lights.environments[0], 16, np.arange(1))
    expected = torch.cat([exact.E[:, None], exact.A, exact.B], 1).numpy()[:, PLACES]
    shown = -mean[:, PLACES, :3]
    narrow = np.array([0, len(ALPHAS)])
    assert shown[:, narrow] == pytest.approx(expected[:, narrow], rel=0.2, abs=1e-3 * expected.max())
    wide = np.setdiff1d(np.arange(2 * len(ALPHAS)), narrow)
    assert shown[:, wide] == pytest.approx(expected[:, wide], rel=0.08, abs=1e-3 * expected.max())


def test_put_back_without_a_trace_where_nothing_was_smoothed() -> None:
    lights = light_set([scenes.sunny_light(65_000.0)])
    points = scenes.view_of(scenes.sphere(3), 32)
    mean = np.random.default_rng(0).random((len(points.n), GLTF.stored, CHANNELS)).astype(np.float32)
    before = mean.copy()
    kept = lamps.take_out(mean, points, lights.lamps, ALPHAS, PLACES)
    assert np.abs(mean - before).max() > 100
    smooth = mean.copy()
    lamps.put_back(smooth, mean, kept, PLACES)
    assert np.array_equal(smooth, before)


def test_smoothing_leaves_highlights_their_height() -> None:
    """Against float64 quadrature, where lamps are mirrored: half the bias that smoothing has when they are not taken out."""
    scene, lights = scenes.sphere(5), light_set([night()])
    points = scenes.view_of(scene, 64)
    near = Neighbours.of(points)
    place = 1 + GLTF.highlights[1] + 1  # of A at roughness 0.25
    many = gather(scene, points, lights, Quality(2432, 1152, extra=False), 99, near).mean[:, place, :3]
    brightest = np.argsort(-many.sum(-1))[:60]
    bias = []
    for terms in (GLTF, replace(GLTF, highlights=())):
        runs = [gather(scene, points, lights, Quality(12, 6, extra=False), seed, near, terms) for seed in range(8)]
        mean = np.mean([smoothed(sums, points, lights, near, terms)[:, place, :3] for sums in runs], 0)
        bias.append(np.sqrt(np.square(mean - many)[brightest].mean()) / many[brightest].mean())
    assert bias[0] < 0.5 * bias[1], bias
