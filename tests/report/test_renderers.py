"""What can be tested of the side-by-side without the other renderers."""

import sys
from pathlib import Path

import numpy as np
import pytest

from stages.core.errors import InputError
from stages.report.renderers import NEEDS, Job, measure, read_arrays, write_arrays
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
