"""Texel values: the right point in space, nothing from outside a chart, and the fast field equal to the plain one."""

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from stages.bake import texels
from stages.bake.evaluate import evaluate
from stages.bake.raster import Layout, touched_texels
from stages.bake.raster import Surface as UvSurface
from stages.bake.visibility import Patches
from stages.core.progress import silent
from stages.material.directions import Pieces
from stages.material.learnt import LearntMaterial
from stages.material.recipe import EVEN, Recipe
from stages.material.residual import Residual, ResidualConfig
from stages.material.surface import Surface
from stages.material.survey import EMPTY, Lookup
from tests.bake.examples import cube, grid, prep_arrays, small_residual


@pytest.mark.parametrize("config", [ResidualConfig(levels=5, log2_entries=10, base=3), ResidualConfig(levels=1, hidden=7)])
@pytest.mark.parametrize("count", [0, 1, 257, 70_001])
def test_fast_evaluation_equals_the_plain_one(config: ResidualConfig, count: int) -> None:
    made = Residual(config, torch.Generator().manual_seed(3))
    with torch.no_grad():
        made.table.mul_(3e4)
    points = np.random.default_rng(0).uniform(-0.6, 0.6, (count, 3)).astype("f4")
    points[: count // 2] = np.sort(points[: count // 2], 0)  # neighbours share cells
    with torch.no_grad():
        plain = made(torch.from_numpy(points)).numpy()
    np.testing.assert_allclose(evaluate(made, points), plain, atol=2e-5)


def where(recipe: Recipe, surface: Surface, pieces: Pieces) -> NDArray:
    """In place of a recipe: each point's own position, twice."""
    return np.c_[surface.point, surface.point]


def single(touched: UvSurface) -> Patches:
    """Each texel a patch of its own."""
    count = int((touched.triangle >= 0).sum())
    return Patches(np.arange(count), np.arange(count), np.arange(count))


def baked(arrays: dict[str, NDArray], layout: Layout, touched: UvSurface) -> texels.Texels:
    made = LearntMaterial(EVEN, Lookup(EMPTY), small_residual().stored())
    label = np.zeros(len(arrays["triangles"]), np.int32)
    return texels.Texels(made, arrays["vertices"][arrays["triangles"]], arrays["normals"], label, layout, touched)


@pytest.mark.parametrize("supersample", [1, 2, 3])
def test_a_texel_holds_its_own_place_on_the_surface(monkeypatch: pytest.MonkeyPatch, supersample: int) -> None:
    """Baking the position of a flat sheet gives each texel the position of its centre."""
    monkeypatch.setattr(texels, "evaluate", where)
    arrays, size = prep_arrays(grid(3)), 40
    layout = Layout.of(arrays["uv"], size)
    touched = touched_texels(layout)
    maps = baked(arrays, layout, touched).recipe(supersample, single(touched), silent)
    row, column = np.mgrid[3 : size - 3, 3 : size - 3]  # whole texels: the sheet begins at 0.05 * 40 = 2
    x, y = ((column + 0.5) / size - 0.05) / 0.9 - 0.5, ((size - row - 0.5) / size - 0.05) / 0.9 - 0.5
    np.testing.assert_allclose(maps[3:-3, 3:-3, 0], x, atol=1e-6)
    np.testing.assert_allclose(maps[3:-3, 3:-3, 1], y, atol=1e-6)
    assert (maps[touched.triangle < 0] == 0).all()


def test_a_rim_texel_holds_nothing_from_outside_its_chart(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each face of a cube bakes its own axis exactly, though its charts' rims cut through texels."""
    monkeypatch.setattr(texels, "evaluate", where)
    arrays = prep_arrays(cube(gap=0.013))
    layout = Layout.of(arrays["uv"], 64)
    touched = touched_texels(layout)
    corners = arrays["vertices"][arrays["triangles"]]
    maps = baked(arrays, layout, touched).recipe(2, single(touched), silent)
    flat = [np.flatnonzero(np.ptp(face, axis=0) < 1e-6) for face in corners]
    for f, axis in enumerate(flat):
        mine = touched.triangle == f
        assert mine.any()
        np.testing.assert_allclose(maps[mine][:, axis[0]], corners[f, 0, axis[0]], atol=1e-6)
