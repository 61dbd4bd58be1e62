"""Faces without texels get charts of their own, in free space, and nothing else moves."""

from pathlib import Path

import numpy as np
import pytest

from stages.core.artifact import load_npz
from stages.core.errors import InputError
from stages.core.schemas import PREP
from stages.core.tiles import flat, signed_area
from stages.prep.mend import CELLS, free_square
from stages.prep.options import PrepOptions
from stages.prep.stage import prep
from stages.prep.uv import overlap
from tests.prep.shapes import write_obj
from tests.prep.test_uv import grid


def sheet(path: Path, scale: float) -> Path:
    """A sheet of 200 triangles over part of the square, and two beside it that lie on a point in UV."""
    uv = grid(10).astype(np.float32)
    vertices = np.concatenate([uv[:2] + np.float32(2), uv]).reshape(-1, 2)
    uv = np.concatenate([np.repeat(uv[:2, :1], 3, 1), uv]) * np.float32(scale)
    faces = np.arange(len(vertices)).reshape(-1, 3)
    return write_obj(path, np.c_[vertices, 0 * vertices[:, 0]], faces, uv.reshape(-1, 2).astype(float))


def test_the_largest_free_square() -> None:
    row, column, edge = free_square(np.array([[(0, 0), (1, 0), (1, 0.25)], [(0, 0), (1, 0.25), (0, 0.25)]], np.float32))
    assert (column, edge) == (0, row * 0 + CELLS - row)
    assert row == CELLS // 4 + 1


def test_faces_without_area_get_texels_of_their_own(tmp_path: Path) -> None:
    mesh = sheet(tmp_path / "a.obj", 0.7)
    findings = prep(mesh, tmp_path / "a.npz", PrepOptions(uv="mend")).findings
    assert findings["uv"] == "kept; 2 of 202 faces mended, with charts in free space"
    made = load_npz(tmp_path / "a.npz", PREP)
    assert not flat(made["uv"]).any()
    assert overlap(made["uv"]) == 0
    density = np.abs(signed_area(made["uv"]))
    np.testing.assert_allclose(density[:2], density[2:].mean(), rtol=0.2)
    untouched = made["triangle_loops"][2:]
    assert np.array_equal(made["loop_uv"][untouched], made["source_uv"][made["loop_source_uv"][untouched]].astype(np.float32))


def test_no_room_is_an_error_that_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"leave no room .* --uv keep lets them show a neighbour's texel"):
        prep(sheet(tmp_path / "a.obj", 1.0), tmp_path / "a.npz", PrepOptions(uv="mend"))
    findings = prep(tmp_path / "a.obj", tmp_path / "a.npz", PrepOptions()).findings
    assert "2 of 202 faces without area in UV" in findings["uv"]
