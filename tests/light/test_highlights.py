"""Highlights that are known: right in the open, taken out and put back without a trace, and not flattened by smoothing."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from stages.light import highlights
from stages.light.environment import Environment
from stages.light.gbuffer import GBuffer
from stages.light.light_set import CHANNELS, light_set
from stages.light.reconstruction import Neighbours
from stages.light.reference import reference_transport
from stages.light.terms import GLTF
from stages.light.transport import Quality, gather, smoothed
from tests.light import scenes

PLACES = GLTF.places_of_highlights()
LOBES = len(GLTF.highlights)


def night() -> Environment:
    """A dim room with small lamps and a window."""
    pixels = np.full((64, 128, 3), 0.02, np.float32)
    pixels[24, ::9] = (30.0, 24.0, 12.0)
    pixels[28:34, 100:106] = 4.0
    return Environment("night", pixels)


def alphas(points: GBuffer) -> NDArray[np.float32]:
    """Of the lobes whose highlights are taken out, for each point."""
    return GLTF.alphas(np.arange(len(points.n)))[:, list(GLTF.highlights)]


@pytest.mark.parametrize("cosine", (0.3, 0.7, 1.0))
def test_open_highlights_are_what_an_open_point_shows(cosine: float) -> None:
    """Of a lamp alone, nearly mirrored: within 8 % of float64 quadrature; a fifth where the lobe is as narrow as a cluster."""
    pixels = np.zeros((128, 256, 3), np.float32)
    points = scenes.open_point(cosine)
    mirrored = 2 * cosine * points.n[0] - points.wo[0]
    row = int(np.arccos(np.clip(mirrored[2], -1, 1)) / np.pi * 128) + 2
    column = int((0.5 - np.arctan2(mirrored[1], mirrored[0]) / (2 * np.pi)) * 256) % 256
    pixels[row : row + 2, column : column + 2] = (50, 40, 10)
    lights = light_set([Environment("lamp", pixels)])
    shown = highlights.open_highlights(points, lights.lamps, alphas(points))[:, :, :3]
    exact = reference_transport(scenes.sphere(1), points, lights.environments[0], 16, np.arange(1))
    expected = torch.cat([exact.E[:, None], exact.A, exact.B], 1).numpy()[:, PLACES]
    narrow = np.array([0, LOBES])
    assert shown[:, narrow] == pytest.approx(expected[:, narrow], rel=0.2, abs=1e-3 * expected.max())
    wide = np.setdiff1d(np.arange(2 * LOBES), narrow)
    assert shown[:, wide] == pytest.approx(expected[:, wide], rel=0.08, abs=1e-3 * expected.max())


def test_put_back_without_a_trace_where_nothing_was_smoothed() -> None:
    """Bit for bit, in the shadow of a sun whose highlight is far brighter than all that is left."""
    _, shown, mean = sunny_sums(in_view=0.0)
    before = mean.copy()
    mean[:, PLACES] -= shown
    assert mean.min() < -100
    smooth = mean.copy()
    highlights.put_back(smooth, mean, before[:, PLACES], PLACES)
    assert np.array_equal(smooth, before)


@pytest.mark.parametrize("in_view", (0.0, 0.5, 1.0))
def test_as_much_is_taken_out_as_is_seen(in_view: float) -> None:
    near, shown, mean = sunny_sums(in_view)
    before = mean[:, PLACES].copy()
    highlights.take_out(mean, np.full_like(mean, 0.01), shown, PLACES, near)
    bright = shown[:, :, :3] > 0.1 * shown[:, :, :3].max()
    taken = (before - mean[:, PLACES])[:, :, :3][bright] / shown[:, :, :3][bright]
    assert taken == pytest.approx(in_view, abs=0.02)


def sunny_sums(in_view: float):  # type: ignore[no-untyped-def]
    """A sphere's pixels, what they show of a sun in the open, and sums that hold a share of it and something else."""
    lights = light_set([scenes.sunny_light(65_000.0)])
    points = scenes.view_of(scenes.sphere(3), 32)
    shown = highlights.open_highlights(points, lights.lamps, alphas(points))
    mean = np.random.default_rng(0).random((len(points.n), GLTF.stored, CHANNELS)).astype(np.float32)
    mean[:, PLACES] += in_view * shown
    return Neighbours.of(points), shown, mean


def test_no_lamps_no_highlights() -> None:
    points, near = scenes.view_of(scenes.sphere(2), 16), Neighbours.of(scenes.view_of(scenes.sphere(2), 16))
    shown = highlights.open_highlights(points, light_set([scenes.even_light()]).lamps, alphas(points))
    assert not shown.any()
    mean = np.ones((len(points.n), GLTF.stored, CHANNELS), np.float32)
    highlights.take_out(mean, np.ones_like(mean), shown, PLACES, near)
    assert (mean == 1).all()


def test_smoothing_leaves_highlights_their_height() -> None:
    """Against a converged result, where lamps are mirrored: half the bias that smoothing has when they are not taken out."""
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
