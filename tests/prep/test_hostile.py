"""What `tests.prep.hostile` makes, small, is mended and oriented; `make hostile` takes large ones through the stage."""

from pathlib import Path

import numpy as np
import pytest

from stages.prep.read_ply import read_ply
from stages.prep.repair import repair
from stages.prep.stage import oriented
from stages.prep.topology import edges
from tests.prep.hostile import KINDS, write_ply


@pytest.mark.parametrize("kind", KINDS)
def test_small_ones_are_mended_and_oriented(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    """Normals are unit vectors on their face's side; neighbours agree, but for the edges that are said not to."""
    monkeypatch.setattr("stages.prep.orient._EFFORT", 1e5)
    path = write_ply(tmp_path / "a.ply", *KINDS[kind](2000))
    source = read_ply(path)
    working = repair(source, "y", 1e-6, path)
    normals, findings = oriented(source, working, 40.0)
    corners = working.vertices[working.triangles]
    own = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.abs(np.linalg.norm(normals, axis=-1) - 1).max() < 1e-5
    assert ((normals * own[:, None]).sum(-1) > 0).all()
    table = edges(working.triangles)
    clashes = table.forward[table.pairs[:, 0]] == table.forward[table.pairs[:, 1]]
    assert clashes.sum() == findings["non_orientable_edges"]
