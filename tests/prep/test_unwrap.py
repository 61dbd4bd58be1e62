"""New UVs, by either way of making charts: no overlap, full gutters, whole polygons, one scale."""

import time
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, maximum_filter1d, minimum_filter1d

from stages.prep import charts, unwrap, xatlas_worker
from stages.prep.merge import SQUASHED
from stages.prep.overlap import overlapping
from stages.prep.pack import _widened, pack
from stages.prep.stitch import stitch
from stages.prep.topology import renumber
from stages.prep.uv import coverage, overlap, signed_area, uv_charts
from tests.prep.shapes import cube, sphere

SIZE, PADDING = 512, 4


def spiral(turns: int = 3, steps: int = 40) -> tuple[NDArray, NDArray]:
    """A ramp that winds over itself: seen from above it overlaps, though every face looks up."""
    angle = np.arange(turns * steps + 1) / steps * 2 * np.pi
    height = angle / (2 * np.pi) * 0.2
    inner, outer = (np.stack([r * np.cos(angle), r * np.sin(angle), height], -1) for r in (0.2, 0.5))
    i = np.arange(len(angle) - 1)
    o = i + len(angle)
    return np.concatenate([inner, outer]), np.concatenate(
        [np.stack([i, o, o + 1], -1), np.stack([i, o + 1, i + 1], -1)]
    )


def boxes(count: int) -> tuple[NDArray, NDArray]:
    """Loose cubes in a row."""
    vertices, triangles = cube()
    moved = [vertices * 0.05 + [0.1 * k - 0.5, 0, 0] for k in range(count)]
    return np.concatenate(moved), np.concatenate([triangles + 8 * k for k in range(count)])


def stone() -> tuple[NDArray, NDArray]:
    """A sphere with a rough surface: many charts with crooked borders."""
    vertices, triangles = sphere(24, 48)
    return vertices * np.random.default_rng(4).uniform(0.4, 0.6, (len(vertices), 1)), triangles


SHAPES = {"cube": cube(), "sphere": sphere(), "spiral": spiral(), "boxes": boxes(10), "stone": stone()}


def polygons_of(name: str, triangles: NDArray) -> NDArray:
    """Quads where the shape is made of them, else one polygon a triangle."""
    return np.arange(len(triangles)) // 2 if name in ("cube", "boxes") else np.arange(len(triangles))


@pytest.mark.parametrize("seconds", [0.0, 30.0], ids=["projection", "xatlas"])
@pytest.mark.parametrize("name", SHAPES)
def test_a_layout_can_be_baked(name: str, seconds: float) -> None:
    vertices, triangles = SHAPES[name]
    polygon = polygons_of(name, triangles)
    layout = unwrap.unwrap(vertices, triangles, polygon, SIZE, PADDING, seconds)
    assert layout.uv.min() >= 0 and layout.uv.max() <= 1
    assert overlap(layout.uv) < 1e-3
    assert (signed_area(layout.uv) > 0).all()
    chart = uv_charts(triangles, layout.uv)
    assert np.array_equal(chart, renumber(layout.chart))  # what is one chart hangs together
    assert all(len(set(chart[polygon == p])) == 1 for p in np.unique(polygon))
    assert layout.packing.gutter == 2 * PADDING
    assert gap(layout.uv, chart, SIZE) >= 2 * PADDING


def gap(uv: NDArray, chart: NDArray, size: int) -> float:
    """Least distance between the first few charts, in texels, by drawing them at twice the size."""
    fine, least = 2 * size, np.inf
    drawn = [coverage(uv[chart == c].astype(float) * fine, fine, fine) > 0 for c in np.unique(chart)[:4]]
    for index, one in enumerate(drawn):
        distance = distance_transform_edt(~one)
        least = min([least, *(distance[other].min() for other in drawn[index + 1 :])])
    return (least + 1) / 2  # a fine texel is covered from its centre


@pytest.mark.parametrize("name", SHAPES)
def test_texels_are_spread_evenly(name: str) -> None:
    """Projection may squash a face to its cosine to the chart, never more; joined charts change lengths within a bound."""
    vertices, triangles = SHAPES[name]
    layout = unwrap.unwrap(vertices, triangles, np.arange(len(triangles)), SIZE, PADDING, 0.0)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    density = signed_area(layout.uv) * SIZE**2 / area / layout.packing.texels_per_unit**2
    assert density.max() < SQUASHED**-2 and density.min() > 0.3
    uneven = (density < 0.6) | (density > 1.2)
    assert area[uneven].sum() < 0.02 * area.sum()


def test_polygons_that_charts_cut_become_charts_of_their_own() -> None:
    """xatlas sees triangles: a quad in two charts, one in none, and one without area in UV are laid flat whole."""
    vertices, triangles = cube()
    polygon = np.arange(12) // 2
    chart = polygon.copy()
    flat = charts.project(vertices, triangles, chart)
    chart[1], chart[4:6], flat[7] = 5, -1, 0.0
    whole, label = unwrap._whole_polygons(vertices, triangles, polygon, flat, chart)
    assert (label[::2] == label[1::2]).all() and len(set(label)) == 6 and label.min() == 0
    np.testing.assert_allclose(signed_area(whole), 0.5)


def test_the_time_limit_stops_xatlas(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A worker that never ends is killed, and the fallback delivers."""
    slow = tmp_path / "slow.py"
    slow.write_text("import time\ntime.sleep(60)\n")
    monkeypatch.setattr(xatlas_worker, "__file__", str(slow))
    vertices, triangles = cube()
    start = time.monotonic()
    layout = unwrap.unwrap(vertices, triangles, np.arange(12), SIZE, PADDING, 0.5)
    assert time.monotonic() - start < 20
    assert layout.method == "projection: xatlas took more than 0.5 s" and overlap(layout.uv) == 0


def test_a_crash_of_xatlas_is_survived(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    crash = tmp_path / "crash.py"
    crash.write_text("import os\nos.abort()\n")
    monkeypatch.setattr(xatlas_worker, "__file__", str(crash))
    vertices, triangles = cube()
    assert unwrap.unwrap(vertices, triangles, np.arange(12), SIZE, PADDING, 5.0).method == "projection: xatlas failed"


def test_xatlas_is_not_waited_for_once_it_has_answered(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Its destructor joins threads that may have missed their wake-up; here it never returns."""
    worker = tmp_path / "worker.py"
    worker.write_text(
        "import runpy, time, xatlas\n"
        "class Atlas(xatlas.Atlas):\n"
        "    def __del__(self):\n"
        "        time.sleep(60)\n"
        "xatlas.Atlas = Atlas\n"
        f"runpy.run_path({xatlas_worker.__file__!r}, run_name='__main__')\n"
    )
    monkeypatch.setattr(xatlas_worker, "__file__", str(worker))
    made, method = unwrap.run_xatlas(*cube(), 20.0)
    assert made is not None and method == "xatlas"


def test_xatlas_charts_have_their_true_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The worker runs by its path, in any folder, and its rounding to texels of its own is undone."""
    monkeypatch.chdir(tmp_path)
    vertices, triangles = cube()
    made, method = unwrap.run_xatlas(vertices, triangles, 30.0)
    assert made is not None and method == "xatlas"
    uv, chart = made
    assert np.abs(np.abs(signed_area(uv)) - 0.5).max() < 0.02
    scaled = unwrap._to_scale(vertices[triangles], uv, chart)
    np.testing.assert_allclose(np.abs(signed_area(scaled)), 0.5, rtol=1e-5)


def test_a_box_unfolds_into_nets() -> None:
    """Six faces apart waste gutters; hinged they are fewer charts, flat and to scale."""
    vertices, triangles = cube()
    chart = np.repeat(np.arange(6), 2).astype(np.int32)
    flat = charts.project(vertices, triangles, chart)
    joined, label = stitch(flat, triangles, chart, SIZE, 16)
    assert len(set(label)) <= 3 and np.array_equal(uv_charts(triangles, joined), label)
    np.testing.assert_allclose(signed_area(joined), 0.5, rtol=1e-6)
    assert not overlapping(joined, label).any()


def test_charts_that_cover_themselves_are_found() -> None:
    vertices, triangles = spiral()
    flat = vertices[triangles][..., :2]
    assert overlapping(flat, np.zeros(len(triangles), np.int32)).tolist() == [True]
    once = triangles[vertices[triangles][..., 2].max(1) < 0.19]
    assert overlapping(vertices[once][..., :2], np.zeros(len(once), np.int32)).tolist() == [False]


@pytest.mark.parametrize("count, gutter", [(40, 8), (3500, 8), (9000, 4)])
def test_packing_many_charts_ends_and_fits(count: int, gutter: int) -> None:
    """Triangles of many sizes, more than the horizon takes too, halve the padding only when they must."""
    rng = np.random.default_rng(0)
    flat = rng.random((count, 3, 2)) * rng.uniform(0.01, 0.2, (count, 1, 1))
    packing = pack(flat, np.arange(3 * count).reshape(-1, 3), np.arange(count, dtype=np.int32), SIZE, PADDING)
    assert overlap(packing.uv) < 1e-3
    assert packing.gutter == gutter
    scaled = np.abs(signed_area(flat)) * (packing.texels_per_unit / SIZE) ** 2
    np.testing.assert_allclose(np.abs(signed_area(packing.uv)), scaled, rtol=0.02, atol=1e-9)


def test_growing_charts_keeps_flat_sides_whole() -> None:
    vertices, triangles = cube()
    chart = charts.grow(vertices, triangles, np.arange(12))
    assert len(set(chart)) <= 6 and (chart[::2] == chart[1::2]).all()


@pytest.mark.parametrize("margin", [0, 1, 5])
def test_a_profile_grows_by_its_margin_on_every_side(margin: int) -> None:
    """Against SciPy's filters over the padded profile; some columns are empty, as where a chart only touches them."""
    rng = np.random.default_rng(margin)
    low, high = rng.integers(0, 30, 60), rng.integers(10, 42, 60)
    low[[3, 40]], high[[3, 40]] = np.iinfo(np.int64).max, 0
    bottom, top = _widened((low, high), margin, 40)
    inner, outer = np.clip(low, 0, 40), np.clip(high, 0, 40)
    size = 2 * margin + 1
    lowest = minimum_filter1d(np.pad(inner, margin, constant_values=40), size, mode="constant", cval=40)
    highest = maximum_filter1d(np.pad(outer, margin), size, mode="constant", cval=0) + 2 * margin
    np.testing.assert_array_equal(bottom, lowest)
    np.testing.assert_array_equal(top, highest)
