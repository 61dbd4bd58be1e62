"""Cracks, pebbles, ripples and averaged palettes: they tile, and their means do not change with the footprint."""

import numpy as np
import pytest

from stages.material.heap_kernels import FACETS, bedding, plane, rise
from stages.material.look import averaged, each, palette
from stages.material.noise_kernels import mixed
from stages.material.patterns import (
    PEBBLES,
    STONES,
    Spectrum,
    cracks,
    fbm,
    heap,
    lost,
    marks,
    masked,
    pebbles,
    ripples,
    seed_of,
    spots,
)
from stages.material.place import Place
from stages.material.scatter_kernels import point_in

POINTS = 60_000


def place(footprint: float, period: float = 0.0, offset: float = 0.0, points: int = POINTS) -> Place:
    """Random points of a cube 2 m wide, with this footprint; the same ones at every call but for the offset along x."""
    p = np.random.default_rng(1).uniform(0, 2, (3, points)).astype(np.float32)
    p[0] += offset
    return Place(p, p[:2], np.zeros(points, np.int32), np.full(points, footprint, np.float32), (period, period, 0.0), 5)


COVERS = {
    "cracks": lambda at: cracks(at, 0.05, 0.002, 0.5, 3).cover,
    "cracks of one level": lambda at: cracks(at, 0.05, 0.004, 0.8, 3, levels=1).cover,
    "pebbles": lambda at: pebbles(at, 0.02, 0.002, 0.6, 3).cover,
    "pebbles in a face": lambda at: pebbles(at, 0.02, 0.002, 0.6, 3, depth=0.0).cover,
    "backs of pebbles": lambda at: pebbles(at, 0.02, 0.002, 0.6, 3).dome,
    "heap": lambda at: heap(at, 0.02, STONES, 3).cover,
    "height of a heap": lambda at: 50 * heap(at, 0.02, PEBBLES, 3).height,
    "nooks of a heap": lambda at: heap(at, 0.02, STONES, 3).nook,
    "spots": lambda at: spots(at, 0.01, (0.0005, 0.004), 0.85, 3).cover,
    "masked": lambda at: masked(at, Spectrum(0.05, 0.0005, 0.9), 0.1, 3),
    "masked, soft": lambda at: masked(at, Spectrum(0.05, 0.0005, 0.9), 0.2, 3, 0.5),
    "marks": lambda at: marks(at, 0.05, 0.004, 6, 0.0, 6.28, 3).cover,
}


@pytest.mark.parametrize("name", COVERS)
def test_what_the_footprint_hides_keeps_its_mean(name):
    # a hidden border is a smooth step in place of a normal distribution: at a share of 0.1 that is 0.16 too much
    fine, coarse = COVERS[name](place(1e-4)).mean(), COVERS[name](place(0.1)).mean()
    assert abs(coarse / fine - 1) < 0.2, f"{fine:.4f} seen closely, {coarse:.4f} from afar"
    assert np.ptp(COVERS[name](place(0.2))) < 0.02, "single ones still show"


@pytest.mark.parametrize("name", COVERS)
def test_covers_repeat_after_the_period(name):
    here, there = (COVERS[name](place(1e-3, 0.5, offset, 4000)) for offset in (0.0, 0.5))
    assert np.mean(abs(here - there) > 0.02) < 0.005  # a point on a border may fall to either side in float32


def test_cracks_are_widest_where_they_are_near():
    found = cracks(place(1e-4), 0.05, 0.002, 3.0, 3, levels=1)  # all of them open
    assert found.near[found.cover > 0.9].max() <= 0.001
    assert found.cover[found.near > 0.0011].max() == 0


def test_pebbles_leave_their_gap():
    packed, apart = (pebbles(place(1e-4), 0.02, gap, 0.3, 3) for gap in (0.0, 0.004))
    assert apart.cover.mean() < 0.8 * packed.cover.mean()
    assert apart.inside.max() < 0.02
    assert (apart.dome[apart.inside <= 0] == 0).all()


def test_a_heap_shows_what_lies_on_top():
    """The compiled loop, which draws what is around a cell once, against all pieces around one point after the other."""
    at = place(1e-4)[:60]
    found, number, one = heap(at, 0.02, STONES, 3), seed_of(at, 3), np.float32(1)
    for k in range(len(at)):
        p = at.p[:, k] * np.float32(50)
        cell, seen = np.floor(p), [(0.0, 0)]
        with np.errstate(over="ignore"):
            for near in range(27):
                *middle, h = point_in.py_func(near, *cell, (np.float32(0),) * 3, (np.float32(0),) * 3, one, number)
                away = p - cell - np.array(middle)
                radius = np.float32(STONES.radius * (1 - STONES.vary * (int(h) & 0xFFFF) / 65536))
                turned = mixed.py_func(np.uint32(h ^ np.uint32(0x5BD1E995)))
                faces = [plane.py_func(turned, j, radius, np.float32(STONES.sharp)) for j in range(FACETS)]
                inside = min(radius - np.linalg.norm(away), *(face[3] - away @ np.array(face[:3]) for face in faces))
                level, *lean = bedding.py_func(turned, STONES)
                if inside > 0:
                    height = level + rise.py_func(inside, STONES)[0] + away[:2] @ np.array(lean)
                    seen.append((max(float(height), 0.001), int(h)))
        seen.sort()
        assert found.height[k] == pytest.approx(0.02 * seen[-1][0], abs=5e-5)
        assert found.ident[k] == seen[-1][1] or seen[-1][0] - seen[-2][0] < 1e-3


def test_ripples_are_as_long_as_asked_and_tile():
    y = np.linspace(0, 1, 20_001, dtype=np.float32)[:-1]
    lines = []
    for x in (0.1, 1.1):
        p = np.stack([np.full_like(y, x), y, np.full_like(y, 0.2)])
        at = Place(p, p[:2], np.zeros(len(y), np.int32), np.full(len(y), 1e-4, np.float32), (1.0, 1.0, 0.0), 2)
        lines.append(ripples(at, 0.05, 0.6, 4))
    steps = np.sum(lines[0].along[1:] < lines[0].along[:-1] - 0.5)
    assert 16 <= steps <= 24  # 20 in a metre, but for forks
    assert np.mean(abs(lines[0].crest - lines[1].crest) > 0.02) < 0.005
    crest = ripples(place(1e-4), 0.05, 0.6, 4).crest
    assert abs(crest.mean()) < 0.03 and crest.min() >= -1 and crest.max() <= 1
    assert abs(ripples(place(0.06), 0.05, 0.6, 4).crest).max() == 0


def test_averaged_is_the_mean_of_what_is_hidden():
    stops, spectrum = ("#101820", "#e0e0d0", "#902010"), Spectrum(0.02, 0.001, 0.9)
    fine = palette(0.5 + 0.3 * fbm(place(1e-4), spectrum, 3), *stops).mean(1)
    far = place(0.05)
    coarse = averaged(0.5 + 0.3 * fbm(far, spectrum, 3), 0.3 * lost(far, spectrum), *stops).mean(1)
    np.testing.assert_allclose(coarse, fine, rtol=0.04)
    t = np.linspace(0, 1, 50).astype(np.float32)
    np.testing.assert_allclose(averaged(t, 0 * t, *stops), palette(t, *stops), atol=0.01)  # steps of 1/255


def test_each_fades_to_the_mean_of_its_stops():
    t = np.random.default_rng(0).uniform(0, 1, POINTS).astype(np.float32)
    stops = ("#202020", "#f0e0c0", "#803010")
    np.testing.assert_allclose(each(t, 1.0, *stops).mean(1), each(t, 0.0, *stops)[:, 0], rtol=0.02)
