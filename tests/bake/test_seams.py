"""Textures where two charts meet: a step from one to the other is no larger than one within a chart."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from stages.bake.texels import texel_size
from stages.material.directions import measure
from stages.material.evaluate import evaluate
from stages.material.recipe import Coat, Recipe
from stages.material.surface import Surface
from tests.bake.test_relief import subject_of

STEP = 0.0052
"""Somewhat more than a texel of the sphere of diameter 1, in space."""


@pytest.mark.parametrize(("look", "metres"), [("rust", 0.5), ("marble", 1.0), ("oak", 0.5), ("brushed steel", 0.3)])
def test_no_step_across_a_seam_is_larger_than_those_within_a_chart(tmp_path: Path, look: str, metres: float) -> None:
    subject = subject_of(tmp_path, "ball")
    on = subject.touched.triangle >= 0
    charted = subject.touched.where(on)
    point, normal = subject.points(charted)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    chart = subject.mesh["charts"][charted.triangle]
    pairs = cKDTree(point).query_pairs(STEP, output_type="ndarray")
    same = chart[pairs[:, 0]] == chart[pairs[:, 1]]
    pieces, _ = measure(point[::7], normal[::7], np.ones(len(point[::7])), np.zeros(len(point[::7]), np.int64))
    corners = subject.mesh["vertices"][subject.mesh["triangles"]]
    footprint = texel_size(corners, subject.layout)[charted.triangle]
    surface = Surface.bare(point.astype(np.float32), normal.astype(np.float32), footprint)
    values = evaluate(Recipe(Coat(look, metres=metres)), surface, pieces)[:, :5]
    step = abs(values[pairs[:, 0]] - values[pairs[:, 1]]).max(1)
    across, within = step[~same], step[same]
    assert len(across) > 500 and across.max() <= within.max()
    assert np.quantile(across, 0.9) <= 1.1 * np.quantile(within, 0.9)
