"""Parts by name: what there is, how it is called, and what is said where nothing is called so."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.asset.parts import LabelledPart, NamedPart, find, labelled_parts, labels, named_parts
from stages.asset.parts_picture import BACKDROP, color, parts_picture
from stages.core.artifact import load_npz
from stages.core.errors import InputError
from stages.core.schemas import PREP
from stages.light.scene import Scene
from stages.prep.options import PrepOptions
from stages.prep.stage import prep
from tests.prep.shapes import CUBE_QUADS, cube_corners
from tests.test_cli import ARTIFACT, OK, dreammat, expect_error

CUBES = (
    ("seat", "", "velvet", (0, 4, 0), 2.0),
    ("leg_1", "legs", "steel", (0, 0, 0), 1.0),
    ("leg_2", "legs", "steel", (3, 0, 0), 1.0),
)
"""Object, group, slot, place and edge."""


@pytest.fixture(scope="module")
def chair(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three cubes as an OBJ with objects, groups and slots, through prep."""
    folder, lines = tmp_path_factory.mktemp("chair"), []
    for k, (name, group, slot, place, edge) in enumerate(CUBES):
        lines += [f"o {name}", f"g {group}".rstrip(), f"usemtl {slot}"]
        lines += [f"v {x} {y} {z}" for x, y, z in cube_corners() * edge + place]
        lines += ["f " + " ".join(str(8 * k + c + 1) for c in quad) for quad in CUBE_QUADS]
    (folder / "chair.obj").write_text("\n".join(lines) + "\n")
    prep(folder / "chair.obj", folder / "prep.npz", PrepOptions(unwrap_triangles=0, texture_size=128))
    return folder / "prep.npz"


@pytest.fixture(scope="module")
def parts(chair: Path) -> list[NamedPart]:
    return named_parts(load_npz(chair, PREP))


def calls(parts: list[NamedPart], pattern: str) -> list[str]:
    return [f"{part.kind}:{part.call}" for part in find(parts, pattern)]


def test_objects_groups_slots_and_pieces_are_listed(parts: list[NamedPart]) -> None:
    assert [(part.kind, part.call, part.faces) for part in parts] == [
        ("object", "seat", 6), ("object", "leg_1", 6), ("object", "leg_2", 6), ("object", "legs", 12),
        ("slot", "velvet", 6), ("slot", "steel", 12), ("piece", "#7", 6), ("piece", "#8", 6), ("piece", "#9", 6),
    ]  # fmt: skip
    assert [part.share for part in parts] == pytest.approx([4 / 6, 1 / 6, 1 / 6, 2 / 6, 4 / 6, 2 / 6, 4 / 6, 1 / 6, 1 / 6])
    np.testing.assert_allclose(parts[0].size, 2, atol=1e-5)
    np.testing.assert_allclose([parts[0].place, parts[2].place], [(1, 5, 1), (3.5, 0.5, 0.5)], atol=1e-5)
    assert sorted(np.concatenate([part.triangles for part in parts[:3]])) == list(range(36))


def test_every_part_is_made_of_whole_labels(chair: Path, parts: list[NamedPart]) -> None:
    label, found = labels(load_npz(chair, PREP)), labelled_parts(load_npz(chair, PREP))
    assert np.unique(label).tolist() == [0, 1, 2]
    for part, other in zip(parts, found, strict=True):
        assert (part.number, part.kind, part.call, part.share) == (other.number, other.kind, other.call, other.share)
        assert np.array_equal(np.flatnonzero(np.isin(label, other.labels)), part.triangles)
        assert LabelledPart.from_json(json.loads(json.dumps(other.to_json()))) == other
    assert [len(part.labels) for part in find(found, "legs")] == [2]


def test_parts_are_called_by_name_pattern_kind_and_number(parts: list[NamedPart]) -> None:
    assert calls(parts, "seat") == ["object:seat"]
    assert calls(parts, "leg_*") == ["object:leg_1", "object:leg_2"]
    assert calls(parts, "slot:s*") == ["slot:steel"]
    assert calls(parts, "object:s*") == ["object:seat"]
    assert calls(parts, "#8") == ["piece:#8"]
    assert calls(parts, "Velvet") == ["slot:velvet"]
    for wrong in ("sofa", "#10", "slot:seat", "piece:seat"):
        with pytest.raises(InputError, match=r"none of this name; .*expected seat, leg_1, leg_2, legs, velvet, steel, #7"):
            find(parts, wrong)
    for slip, meant in (("saet", "seat"), ("slot:Velvt", "velvet")):
        with pytest.raises(InputError, match=rf"did you mean '{meant}'\?"):
            find(parts, slip)


def test_three_hundred_parts_are_not_all_listed_in_an_error(parts: list[NamedPart]) -> None:
    many = [replace(parts[0], number=k, name=f"bolt_{k}") for k in range(1, 301)]
    with pytest.raises(InputError, match=r"bolt_1, .*bolt_12 and 288 more \(dreammat parts lists them\)"):
        find(many, "nut")
    assert len(find(many, "bolt_2*")) == 111


def test_the_picture_shows_every_part_in_its_colour(chair: Path, parts: list[NamedPart]) -> None:
    mesh = load_npz(chair, PREP)
    picture = parts_picture(Scene(mesh["vertices"], mesh["triangles"], mesh["normals"]), parts, 160)
    assert picture.shape == (480, 320, 3)
    assert np.allclose(picture[80, 2], BACKDROP, atol=1e-3)
    for part in parts[4:6]:
        assert hue_share(picture[160:320], color(part.number)) > 0.03


def hue_share(picture: NDArray, wanted: NDArray) -> float:
    """Share of the pixels that are a colour in some light."""
    length = np.linalg.norm(picture, axis=-1)
    cosine = picture @ wanted / np.maximum(length * np.linalg.norm(wanted), 1e-9)
    return float(((cosine > 0.9999) & (length > 0.3)).mean())


def test_the_command(chair: Path, tmp_path: Path) -> None:
    result = dreammat("parts", chair, "-o", tmp_path / "parts", "--size", 64, "--json")
    assert result.returncode == OK
    rows = json.loads(result.stdout)["parts"]
    assert [row["call"] for row in rows[:4]] == ["seat", "leg_1", "leg_2", "legs"]
    assert json.loads((tmp_path / "parts" / "parts.json").read_text())["parts"] == rows
    assert (tmp_path / "parts" / "parts.png").exists()
    listed = dreammat("parts", chair).stdout.splitlines()
    assert listed[0].split() == ["number", "kind", "name", "faces", "share", "size", "place"]
    assert listed[1].split()[:5] == ["#1", "object", "seat", "6", "66.7%"]
    expect_error(dreammat("parts", tmp_path / "none.npz"), ARTIFACT, "none.npz")
