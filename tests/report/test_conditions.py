"""The report's own arithmetic, and a small report from beginning to end."""

import csv
from pathlib import Path

import numpy as np
import pytest

from stages.light.cells import Cells
from stages.light.transport import cached_light_set
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
    monkeypatch.setattr(module.bounce_rows, "SWEEP", (0.5, 2.0))
    monkeypatch.setattr(module.bounce_rows, "CONVERGED", module.Quality(608, 288, extra=False, smooth=False))
    monkeypatch.setattr(module.bounce_rows, "QUADRATURE_PIXELS", 3)
    plain = Cells.of
    monkeypatch.setattr(Cells, "of", staticmethod(lambda scene: plain(scene, 300)))
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

    def plaster(setting: str) -> float:
        return max(row.rmse_percent for row in rows if row.setting == setting and row.map == "white plaster")

    assert plaster("2 x standard, 2 bounces") < plaster("draft, 2 bounces") < plaster("2 x standard, no bounces") / 2
    assert 0 < plaster("converged, one bounce, against quadrature") < 1
    assert (tmp_path / "out" / "bounces.png").stat().st_size > 10_000


def test_what_is_convex_has_no_rows_with_bounces() -> None:
    """Nothing to be measured, and nothing asked of its rays."""
    scene, lights = scenes.sphere(3), cached_light_set((scenes.even_light(),))
    points = scenes.view_of(scene, 16)
    subject = module.Subject(scene, np.eye(4), 0.5, points, lights, np.arange(4), [], [], np.zeros(1))
    assert module.bounce_rows.bounce_rows(subject, 2, 0) == []
