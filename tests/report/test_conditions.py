"""The report's own arithmetic, and a small report from beginning to end."""

import csv
from pathlib import Path

import pytest

from stages.report import conditions as module
from stages.report.options import ReportOptions
from tests.light import scenes
from tests.prepared import save_prep


def test_small_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scenes.box_in_corner()
    prep = save_prep(tmp_path / "prep.npz", scene.vertices, scene.triangles, scene.normals)
    monkeypatch.setattr(module, "SWEEP", (0.5, 1.0, 8.0))
    monkeypatch.setattr(module, "CONVERGED", module.Quality(768, 256, extra=False, smooth=False))
    monkeypatch.setattr(module, "QUADRATURE_PIXELS", 4)
    monkeypatch.setattr(module.steps, "PIXELS", 4)
    rows = module.report_conditions(prep, tmp_path / "out", ReportOptions(size=48, env=("studio", "clear_sky")))
    with (tmp_path / "out" / "conditions.csv").open() as stream:
        written = list(csv.DictReader(stream))
    assert len(written) == len(rows)
    assert (tmp_path / "out" / "conditions.png").stat().st_size > 10_000
    assert (tmp_path / "out" / "steps.csv").read_text().count("Monte Carlo") == 2

    def worst(setting: str) -> float:
        return max(row.rmse_percent for row in rows if row.setting == setting)

    assert worst("high") < worst("standard") < worst("draft")
    assert worst("standard") < worst("no smoothing")
    assert worst("as stored") < 0.1
    assert worst("converged, against quadrature") < 0.5
    mirrors = [row.rmse_percent for row in rows if row.map == "m1_r0" and row.setting == "standard"]
    assert max(mirrors) < 1e-3  # looked up, not sampled
