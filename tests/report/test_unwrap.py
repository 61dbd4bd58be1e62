"""The report on a layout: both rows, and the measures of layouts that are known."""

from pathlib import Path

import numpy as np
import pytest

from stages.prep.options import PrepOptions
from stages.prep.stage import prep
from stages.prep.uv import stretch
from stages.report.options import UnwrapReportOptions
from stages.report.unwrap import report_unwrap, summary
from tests.prep.shapes import cube


def test_a_cube_beside_xatlas(tmp_path: Path) -> None:
    vertices, triangles = cube()
    lines = ["v " + " ".join(map(str, v)) for v in vertices] + ["f " + " ".join(map(str, t + 1)) for t in triangles]
    (tmp_path / "cube.obj").write_text("\n".join(lines))
    findings = prep(tmp_path / "cube.obj", tmp_path / "prep.npz", PrepOptions(texture_size=256)).findings
    ours, xatlas = report_unwrap(tmp_path / "prep.npz", UnwrapReportOptions())
    assert (ours.charts, round(ours.filled, 3)) == (findings["charts"], findings["texture_filled"])
    assert ours.texel_density == pytest.approx(findings["texel_density"], rel=1e-3)
    assert ours.stretch == pytest.approx(1, abs=0.01) and xatlas.stretch == pytest.approx(1, abs=0.03)
    assert 1 <= ours.charts <= 6 and xatlas.charts == 6
    assert 0.2 < xatlas.filled < 1
    assert len(summary([ours, xatlas])) == 2


def test_stretch_of_a_rectangle_laid_out_as_a_square() -> None:
    """Sides 1 and 2: singular values 1 and 2 at texture area 1, surface area 2: sqrt((1 + 4) / 2 / 2)."""
    uv = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], float)
    corners = np.concatenate([uv * (1, 2), np.zeros((2, 3, 1))], -1)
    assert stretch(corners, uv) == pytest.approx(1.25**0.5)
    assert stretch(corners * 7, uv * 0.1) == pytest.approx(1.25**0.5)
    assert stretch(corners, uv * (1, 2)) == pytest.approx(1)
