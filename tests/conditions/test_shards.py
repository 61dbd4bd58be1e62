"""Views divided over machines and merged: the same bytes as undivided, and what does not belong together is named."""

import dataclasses
import shutil
from pathlib import Path

import pytest

from stages.conditions.options import ConditionsOptions
from stages.conditions.stage import conditions
from stages.core.artifact import read_manifest
from stages.core.errors import ArtifactError
from stages.core.schemas import CONDITIONS
from tests.conditions.test_conditions import fingerprint
from tests.light import scenes
from tests.prepared import save_prep

SMALL = ConditionsOptions(views=3, size=16, env=("overcast",), quality="draft")


@pytest.fixture(scope="module")
def prep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scene = scenes.box_in_corner()
    return save_prep(tmp_path_factory.mktemp("prep") / "prep.npz", scene.vertices, scene.triangles, scene.normals)


@pytest.fixture(scope="module")
def parts(prep: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, ...]:
    folder = tmp_path_factory.mktemp("parts")
    for i in (1, 2):
        made = conditions(prep, folder / f"part_{i}", dataclasses.replace(SMALL, shard=(i, 2)))
        assert (made.made, made.found) == ((2, 0), (1, 0))[i - 1]
    return folder / "part_1", folder / "part_2"


def merged(prep: Path, out: Path, *parts: Path, **options: object) -> None:
    made = conditions(prep, out, dataclasses.replace(SMALL, merge=parts, **options))  # type: ignore[arg-type]
    assert (made.made, made.found) == (0, 3)


def test_merged_parts_have_the_bytes_of_one_folder(prep: Path, parts: tuple[Path, ...], tmp_path: Path) -> None:
    conditions(prep, tmp_path / "whole", SMALL)
    merged(prep, tmp_path / "merged", *reversed(parts))
    assert fingerprint(tmp_path / "merged") == fingerprint(tmp_path / "whole")
    assert conditions(prep, tmp_path / "merged", SMALL).up_to_date
    assert conditions(prep, parts[0], dataclasses.replace(SMALL, shard=(1, 2))).up_to_date


def test_a_part_is_continued_and_is_no_conditions_folder(prep: Path, parts: tuple[Path, ...], tmp_path: Path) -> None:
    half = shutil.copytree(parts[0], tmp_path / "half")
    with pytest.raises(ArtifactError, match=r"manifest\.json"):
        read_manifest(half, CONDITIONS)
    (half / "view_002/geometry.exr").unlink()
    (half / "shard.json").unlink()
    shutil.copytree(half, tmp_path / "other")
    made = conditions(prep, tmp_path / "other", dataclasses.replace(SMALL, shard=(1, 2)))
    assert made.made == 2  # nothing tells any more what the views were asked for
    assert fingerprint(tmp_path / "other") == fingerprint(parts[0])


def test_what_does_not_belong_together_is_named(prep: Path, parts: tuple[Path, ...], tmp_path: Path) -> None:
    one, two = parts
    with pytest.raises(ArtifactError, match=r"part 2/2 is not among those to merge; make it with --shard 2/2"):
        merged(prep, tmp_path / "out", one)
    with pytest.raises(ArtifactError, match=r"part_1: part 1/2, as .*part_1 is; expected each part once"):
        merged(prep, tmp_path / "out", one, one)
    with pytest.raises(ArtifactError, match=r"part_1: a part of another run: its seed is 0, expected 5"):
        merged(prep, tmp_path / "out", one, two, seed=5)
    scene = scenes.box_in_corner()
    other = save_prep(tmp_path / "prep.npz", scene.vertices * 0.5, scene.triangles, scene.normals)
    with pytest.raises(ArtifactError, match=r"part_1: a part of another run: its prep is "):
        merged(other, tmp_path / "out", one, two)
    with pytest.raises(ArtifactError, match=r"absent/shard.json: no such file"):
        merged(prep, tmp_path / "out", one, tmp_path / "absent")
    conditions(prep, tmp_path / "third", dataclasses.replace(SMALL, shard=(3, 3)))
    with pytest.raises(ArtifactError, match=r"third: part 3/3, but .*part_1 is one of 2"):
        merged(prep, tmp_path / "out", one, two, tmp_path / "third")
    bad = shutil.copytree(two, tmp_path / "bad")
    view = bad / "view_001/overcast.exr"
    view.write_bytes(view.read_bytes()[:-1] + b"x")
    with pytest.raises(ArtifactError, match=r"bad/view_001/overcast.exr: damaged"):
        merged(prep, tmp_path / "out", one, bad)
    merged(prep, tmp_path / "out", one, two)
