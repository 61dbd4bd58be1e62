"""Parts in a bake: each texel has its own part's material, up to the texel through which the border runs."""

import numpy as np

from stages.bake.raster import Layout, touched_texels
from stages.bake.texels import Texels
from stages.core.progress import silent
from stages.material.learnt import LearntMaterial
from stages.material.recipe import Coat, Part, Recipe
from stages.material.survey import EMPTY, Lookup
from tests.bake.examples import grid, prep_arrays, small_residual
from tests.bake.test_texels import single

SIZE = 96


def test_a_border_within_a_chart_is_one_texel_wide() -> None:
    """A sheet of one chart whose right half is another part; the border runs through the middle of texels."""
    arrays = prep_arrays(grid(4))
    corners = arrays["vertices"][arrays["triangles"]]
    label = (corners[..., 0].mean(1) > 0).astype(np.int32)
    grey, gold = Coat("even", (0.5, 0.5, 0.5), metallic=0.0), Coat("even", (0.8, 0.6, 0.2), metallic=1.0)
    recipe = Recipe(grey, parts=(Part("right", "gold", (1,), Recipe(gold)),))
    layout = Layout.of(arrays["uv"] + np.float32(0.5 / SIZE), SIZE)
    touched = touched_texels(layout)
    made = LearntMaterial(recipe, Lookup(EMPTY), small_residual().stored())
    maps = Texels(made, corners, arrays["normals"], label, layout, touched).recipe(4, single(touched), silent)
    middle = SIZE // 2  # u = 0.5 and half a texel
    shown = touched.triangle >= 0
    left, right = (np.s_[:, :middle], np.s_[:, middle + 1 :])
    assert shown[left].any() and (maps[left][shown[left]][:, 4] < 1e-6).all()
    assert shown[right].any() and (maps[right][shown[right]][:, 4] > 1 - 1e-6).all()
    np.testing.assert_allclose(maps[10:-10, middle, 4], 0.5, atol=1e-6)  # as much of one as of the other
