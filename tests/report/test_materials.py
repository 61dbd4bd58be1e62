"""The report of materials: sheets and figures of all substances, and how far real textures are."""

import csv
from pathlib import Path

import numpy as np
import pytest

from stages.core.errors import InputError
from stages.core.images import read_image, write_png
from stages.report import contrast, materials


def noisy(seed: int, size: int = contrast.SIZE) -> np.ndarray:
    return 0.4 + 0.1 * np.random.default_rng(seed).standard_normal((size, size))


def test_white_noise_falls_by_an_octave_and_is_normal() -> None:
    found = contrast.measure(noisy(0))
    assert found.slope < -0.8 and abs(found.kurtosis[0] - 3) < 0.1 and abs(found.skew[0]) < 0.05
    assert abs(found.direction) < 0.05 and np.isnan(found.with_height)


def test_a_texture_is_near_to_its_like_and_far_from_another() -> None:
    smooth = [np.repeat(np.repeat(noisy(k, 64), 8, 0), 8, 1) for k in (1, 2)]
    sets = {"a_01": noisy(3), "a_02": noisy(4), "b_01": smooth[0], "b_02": smooth[1]}
    known = {name: contrast.measure(image) for name, image in sets.items()}
    scale = contrast.spread(known)
    assert contrast.distance(known["a_01"], known["a_02"], scale) < contrast.distance(known["a_01"], known["b_01"], scale)


def test_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(materials, "LOOKS", {name: materials.LOOKS[name] for name in ("granite", "rust")})
    for name in ("rust_01", "rust_02", "moss_01"):
        picture = np.repeat(noisy(len(name) + int(name[-1]))[..., None], 3, 2)
        (tmp_path / "real" / name).mkdir(parents=True)
        write_png(tmp_path / "real" / name / "basecolor.png", picture)
    rows = materials.report_materials(tmp_path / "out", tmp_path / "real")
    with (tmp_path / "out" / "materials.csv").open() as stream:
        told = {row["substance"]: row for row in csv.DictReader(stream)}
    assert set(told) == {"granite", "rust"} and told["granite"]["own"] == "nan" and float(told["rust"]["own"]) > 0
    assert read_image(tmp_path / "out" / "whole.png").shape[:2] == (materials.CELL, materials.CELL * materials.COLUMNS)
    assert all(0 < float(row["flicker"]) < 0.02 for row in told.values())
    assert len(materials.summary(rows)) == 4


def test_a_folder_without_sets_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected folders"):
        materials.read_references(tmp_path)
