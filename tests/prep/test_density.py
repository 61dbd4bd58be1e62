"""How much of the texture some 475 charts of a scan fill, and that smaller mip levels keep them apart."""

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.bake.fill import pad
from stages.bake.raster import Layout, touched_texels
from stages.prep.pack import Packing, affordable_padding, pack
from stages.prep.uv import overlap, signed_area

SIZE, COUNT, CORNERS = 2048, 475, 40


def crooked_charts(seed: int) -> tuple[NDArray, NDArray, NDArray]:
    """Flat charts with crooked rims, long and round, of areas that differ a hundredfold: flat (F, 3, 2), triangles, chart."""
    rng = np.random.default_rng(seed)
    angle = np.arange(CORNERS) / CORNERS * 2 * np.pi
    waves = [rng.normal(0, 0.25 / k, (COUNT, 2, 1)) * np.stack([np.cos(k * angle), np.sin(k * angle)]) for k in range(2, 9)]
    radius = np.exp(rng.normal(-4, 0.7, (COUNT, 1))) * np.exp(np.sum(waves, (0, 2)))
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle)], -1) * rng.uniform(1, 3, (COUNT, 1, 1)) ** [0.5, -0.5]
    middle = np.zeros_like(rim)
    flat = np.stack([middle, rim, np.roll(rim, -1, 1)], 2).reshape(-1, 3, 2)
    first = np.arange(COUNT)[:, None] * (CORNERS + 1)
    corner = np.arange(CORNERS)
    triangles = np.stack([first + CORNERS + 0 * corner, first + corner, first + (corner + 1) % CORNERS], -1).reshape(-1, 3)
    return flat, triangles, np.repeat(np.arange(COUNT, dtype=np.int32), CORNERS)


@pytest.fixture(scope="module")
def packed() -> tuple[Packing, NDArray]:
    flat, triangles, chart = crooked_charts(0)
    padding = affordable_padding(flat, chart, SIZE)
    return pack(flat, triangles, chart, SIZE, padding), chart


def test_crooked_charts_fill_nearly_half_of_the_texture(packed: tuple[Packing, NDArray]) -> None:
    packing, _ = packed
    assert packing.gutter >= 4
    assert np.abs(signed_area(packing.uv)).sum() >= 0.45
    assert overlap(packing.uv) == 0


def test_nothing_bleeds_down_to_an_eighth_of_the_size(packed: tuple[Packing, NDArray]) -> None:
    """Each chart in a colour of its own, filled, and averaged level by level: texels on a chart hold what is left of it."""
    packing, chart = packed
    touched = touched_texels(Layout.of(packing.uv, SIZE))
    on_chart = touched.triangle >= 0
    colour = np.where(on_chart, chart[touched.triangle], 0).astype(np.float32)
    pad(on_chart, colour)
    for level in (1, 2, 3):
        edge = 1 << level
        blocks = colour.reshape(SIZE // edge, edge, SIZE // edge, edge)
        shown = np.repeat(np.repeat(blocks.max((1, 3)) != blocks.min((1, 3)), edge, 0), edge, 1)
        mixed = float((shown & on_chart).sum() / on_chart.sum())
        assert mixed == 0, (level, mixed)


def test_padding_is_wide_where_it_costs_little() -> None:
    square = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], float)
    assert affordable_padding(square, np.zeros(2, np.int32), SIZE) == 16
    flat, _, chart = crooked_charts(0)
    assert affordable_padding(flat, chart, SIZE) == 8
    assert affordable_padding(flat, chart, SIZE // 8) < 4
    assert affordable_padding(flat, chart, 8192) == 4 * affordable_padding(flat, chart, SIZE)
