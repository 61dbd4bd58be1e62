"""What can be tested of the side-by-side without the other renderers."""

import sys
from pathlib import Path

import numpy as np
import pytest

from stages.core.errors import InputError
from stages.light.environment import lookup
from stages.report.renderers import NEEDS, Job, measure, pole_to_pole, read_arrays, write_arrays
from tests.light import scenes


def test_arrays_come_back(tmp_path: Path) -> None:
    write_arrays(tmp_path / "a", {"x": np.arange(3.0), "size": 512})
    found = read_arrays(tmp_path / "a")
    assert found["x"].tolist() == [0, 1, 2]
    assert int(found["size"]) == 512


@pytest.mark.parametrize("renderer", NEEDS)
@pytest.mark.parametrize("python", ("/no/such/python", sys.executable))
def test_an_interpreter_without_the_renderer_is_named(python: str, renderer: str) -> None:
    job = Job(scenes.sphere(0), np.eye(4), 0.5, 8, (scenes.even_light(),))
    with pytest.raises(InputError, match=r"expected a Python with the packages? (mitsuba|bpy)"):
        measure(renderer, python, job, np.ones((8, 8), bool), {})


def test_a_light_with_rows_on_the_poles_is_the_same_light() -> None:
    random = np.random.default_rng(0)
    light, way = random.random((6, 12, 3)).astype(np.float32), random.normal(size=(500, 3))
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    rows = pole_to_pole(light)
    v = np.arccos(way[:, 2]) / np.pi * (len(rows) - 1)  # Mitsuba's: row i at i / (H - 1)
    u = (0.5 - np.arctan2(way[:, 1], way[:, 0]) / (2 * np.pi)) * 12 - 0.5
    top, left = np.floor(v).astype(int).clip(0, len(rows) - 2), np.floor(u).astype(int)
    x, y = (u - left)[:, None], (v - top)[:, None]
    above, below = (rows[r, left % 12] * (1 - x) + rows[r, (left + 1) % 12] * x for r in (top, top + 1))
    np.testing.assert_allclose(above * (1 - y) + below * y, lookup(light, way), atol=1e-6)
