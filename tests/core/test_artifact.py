"""Files are written whole or not at all, and a killed run leaves nothing behind."""

from pathlib import Path

import pytest

from stages.core.artifact import write_text, written_atomically


def test_what_a_killed_run_left_is_removed_and_what_belongs_to_others_is_not(tmp_path: Path) -> None:
    ours = tmp_path / ".studio.4711.tmp.exr"
    others = [tmp_path / name for name in (".studio.1.4711.tmp.exr", ".studio.4711.tmp.npz", "studio.4711.tmp.exr")]
    for path in (ours, *others):
        path.write_text("half")
    write_text(tmp_path / "studio.exr", "whole")
    assert (tmp_path / "studio.exr").read_text() == "whole"
    assert not ours.exists()
    assert all(path.exists() for path in others)


def test_a_failed_write_leaves_the_old_file_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    write_text(path, "old")
    with pytest.raises(ZeroDivisionError), written_atomically(path) as temporary:
        temporary.write_text("new")
        raise ZeroDivisionError
    assert [p.name for p in tmp_path.iterdir()] == ["run.json"]
    assert path.read_text() == "old"
