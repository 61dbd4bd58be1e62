"""Knits, ropes, wickerwork, scales, honeycomb and lines within strokes: they tile, and are built as they are said to be."""

import numpy as np
import pytest

from stages.material.patterns import hexagons, knit, laid, marks, scales, strands, wickerwork
from stages.material.place import Place

POINTS = 40_000

PATTERNS = {
    "knit": lambda at: knit(at, 0.007, 0.005, 3),
    "laid": lambda at: laid(at, 0.014, 0.012, 3),
    "wickerwork": lambda at: wickerwork(at, 0.02, 0.005, 3),
    "scales": lambda at: scales(at, 0.01, 0.006, 3),
    "hexagons": lambda at: hexagons(at, 0.006, 3),
}


def place(footprint: float, period: float = 0.0, offset: tuple[float, float] = (0.0, 0.0)) -> Place:
    """The same random points of a square of 30 cm at every call, but for the offset."""
    p = np.random.default_rng(1).uniform(0, 0.3, (3, POINTS)).astype(np.float32)
    p[:2] += np.array(offset, np.float32)[:, None]
    return Place(p, p[:2], np.zeros(POINTS, np.int32), np.full(POINTS, footprint, np.float32), (period, period, 0.0), 5)


@pytest.mark.parametrize("name", PATTERNS)
@pytest.mark.parametrize("offset", [(0.3, 0.0), (0.0, 0.3)])
def test_they_repeat_after_the_period_with_every_piece_its_own(name, offset):
    here, there = (PATTERNS[name](place(1e-4, 0.3, o)) for o in ((0.0, 0.0), offset))
    assert np.mean(here.ident != there.ident) < 0.005  # a point on a border may fall to either side in float32
    for a, b in zip(here, there, strict=True):
        assert np.mean(abs(a.astype(np.float64) - b.astype(np.float64)) > 0.02 * np.ptp(a) + 1e-9) < 0.01


@pytest.mark.parametrize("name", PATTERNS)
def test_single_pieces_fade_with_the_footprint(name):
    assert (PATTERNS[name](place(1e-5)).seen == 1).all() and (PATTERNS[name](place(0.03)).seen == 0).all()


def area_of_a_piece(ident: np.ndarray) -> float:
    """Square metres, of pieces in the square of 30 cm that `place` fills."""
    return 0.09 / len(np.unique(ident))


AREAS = {"knit": 0.0035 * 0.005, "scales": 6e-5, "hexagons": 0.006**2 * 0.75**0.5}


@pytest.mark.parametrize(("name", "area"), AREAS.items())
def test_pieces_have_the_size_asked_for(name, area):
    # on a square that tiles sizes are rounded so that a whole number fits
    assert area_of_a_piece(PATTERNS[name](place(1e-4, 0.3)).ident) == pytest.approx(area, rel=0.06)


def test_a_hexagon_is_as_wide_as_asked_and_all_its_points_are_nearest_to_its_own_middle():
    found = hexagons(place(1e-4), 0.006, 3)
    away = np.hypot(found.x, found.y)
    assert found.border.min() > -1e-6 and found.border.max() == pytest.approx(0.003, abs=5e-5)
    assert away.max() == pytest.approx(0.006 / 3**0.5, rel=0.01)  # a corner
    assert (found.border <= 0.003 - away * 3**0.5 / 2 + 1e-6).all()  # no wall lies farther than towards a corner


def test_legs_of_a_stitch_mirror_each_other():
    y = np.linspace(0, 0.1, 500, dtype=np.float32)
    left, right = (
        knit(
            Place(np.stack([x, y, 0 * y]), np.stack([x, y]), np.zeros(500, np.int32), np.full(500, 1e-4, np.float32)),
            0.008,
            0.005,
        )
        for x in (np.full_like(y, 0.0029), np.full_like(y, 0.0051))
    )
    assert np.median(abs(left.height - right.height)) < 1e-3 and not np.intersect1d(left.ident, right.ident).size


def test_a_scale_hides_the_root_of_the_one_below():
    found = scales(place(1e-4), 0.01, 0.006, 3)
    behind = found.along > 0.5
    assert found.rim.min() > -1e-6 and found.under.min() > -1e-6
    assert 0.1 < behind.mean() < 0.35  # between round tips: 1 − π/4
    assert found.rim[found.along < 0.05].max() < 0.0025


def test_a_stake_is_seen_behind_every_other_cane():
    middles = (np.arange(60, dtype=np.float32) + np.float32(0.5)) * np.float32(0.005)  # of the canes
    seen = []
    for stake in (4, 5):
        p = np.stack([np.full(60, (stake + 0.5) * 0.3 / 16, np.float32), middles, 0 * middles])
        at = Place(p, p[:2], np.zeros(60, np.int32), np.full(60, 1e-4, np.float32), (0.3, 0.3, 0.0))
        ident = wickerwork(at, 0.02, 0.005).ident
        number, count = np.unique(ident, return_counts=True)
        seen.append(ident == number[count.argmax()])
        assert count.max() == 30
    assert (seen[0] != seen[1]).all()  # the next stake behind the others


def test_strands_run_along_their_stroke_with_mean_0_and_deviation_1():
    at = place(1e-5)
    mark = marks(at, 0.05, 0.008, 8, 0.3, 1.0, 2)
    line = strands(at, mark, 0.008, 8.0, 3)[mark.cover > 0.5]
    assert abs(line.mean()) < 0.1 and line.std() == pytest.approx(1, abs=0.15)
    assert abs(strands(place(0.004), mark, 0.008, 8.0, 3)).max() == 0
