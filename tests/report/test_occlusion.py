"""The report on occlusion: rows whose error falls with the rays, and its files."""

import csv
from pathlib import Path

import numpy as np
import pytest

from stages.core.texture_sets import TextureSet
from stages.report import occlusion
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


def test_every_texture_set_counts_by_its_share(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter of a folded sheet in one set, the rest in another: every face has texels, as many as its share."""
    sets = (TextureSet("_a", None, ("a",), 0.25), TextureSet("_b", None, ("b",), 0.75))
    sheet = grid(8, lambda x, y: 0.2 * abs((4 * x) % 2 - 1))
    prep = save_prep(tmp_path / "prep.npz", sheet.with_(set=[0] * 16 + [1] * 48, sets=sets))
    faces, counts, reference = set(), [], occlusion.reference_occlusion

    def watched(subject, surface):  # type: ignore[no-untyped-def]
        faces.update(np.unique(subject.touched.triangle).tolist())
        counts.append(len(surface.triangle))
        return reference(subject, surface)

    monkeypatch.setattr(occlusion, "reference_occlusion", watched)
    (row,) = report_occlusion(prep, tmp_path / "out", OcclusionReportOptions(size=96, texels=40, rays=(256,)))
    assert faces >= set(range(128)) and counts == [10, 30]
    assert 0 < row.largest_percent < 5
