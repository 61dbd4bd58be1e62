"""The report on occlusion: rows whose error falls with the rays, and its files."""

import csv
from pathlib import Path

from stages.report.occlusion import report_occlusion, summary
from stages.report.options import OcclusionReportOptions
from tests.bake.examples import grid, save_prep


def test_errors_fall_with_the_rays(tmp_path: Path) -> None:
    prep = save_prep(tmp_path / "prep.npz", grid(8, lambda x, y: 0.2 * abs((4 * x) % 2 - 1)))  # an open, folded sheet
    rows = report_occlusion(prep, tmp_path / "out", OcclusionReportOptions(size=96, texels=60, rays=(256, 4)))
    assert [row.rays for row in rows] == [4, 256]
    assert 0 < rows[1].rmse_percent < rows[0].rmse_percent
    assert rows[1].rmse_percent <= rows[1].p99_percent <= rows[1].largest_percent < 5
    written = list(csv.DictReader((tmp_path / "out" / "occlusion.csv").open()))
    assert [float(line["rmse_percent"]) for line in written] == [row.rmse_percent for row in rows]
    assert (tmp_path / "out" / "occlusion.png").read_bytes().startswith(b"\x89PNG")
    assert len(summary(rows)) == 2
