"""Which texture sets a layout has, and that its UVs stay what they are in model.glb and model.obj."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.asset.model import source_model
from stages.asset.wavefront import write_obj as write_model
from stages.core.artifact import Artifact, load_npz
from stages.core.errors import InputError
from stages.core.schemas import PREP
from stages.core.texture_sets import texture_sets, triangle_sets
from stages.prep.options import PrepOptions
from stages.prep.read_obj import read_obj
from stages.prep.sets import file_word
from stages.prep.stage import prep
from tests.prep.shapes import GltfBuilder
from tests.uv_campaign import Soup, at, ball, of_tiles, stacked_a_tile_away, together, write_obj

FULL = (0.04, 0.04), (0.92, 0.92)
SMALL = PrepOptions(texture_size=512, padding=4)


def parts(count: int) -> list[Soup]:
    """Balls in a row, each another grid over the whole square."""
    return [ball(5 + k, 9 + 2 * k, (2.2 * k, 0, 0)) for k in range(count)]


def prepared(folder: Path, soups: list[Soup], slots: list[str] | None = None, **options: object) -> Artifact:
    """A prep.npz of soups in an OBJ, each of its slot."""
    path = write_obj(folder / "a.obj", together(*soups))
    if slots:
        starts = np.cumsum([0, *(len(soup[0]) for soup in soups[:-1])])
        lines = path.read_text().splitlines()
        first = next(k for k, line in enumerate(lines) if line.startswith("f "))
        for start, slot in reversed(list(zip(starts.tolist(), slots, strict=True))):
            lines.insert(first + start, f"usemtl {slot}")
        path.write_text("\n".join(lines) + "\n")
    prep(path, folder / "a.npz", PrepOptions(**{"texture_size": 512, "padding": 4, **options}), force=True)  # type: ignore[arg-type]
    return load_npz(folder / "a.npz", PREP)


def names(made: Artifact) -> list[str]:
    return [one.suffix for one in texture_sets(made.provenance)]


def fields(soups: list[Soup], *lows: tuple[float, float], size: float = 0.92) -> list[Soup]:
    """The soups' UVs in fields of the plane."""
    return [at(soup, low, (size, size)) for soup, low in zip(soups, lows, strict=True)]


SAME = [ball(6, 12, (2.2 * k, 0, 0)) for k in range(2)]

TWO = ["shell", "visor"]

FOUND = {
    "one": (fields(parts(1), (0.04, 0.04)), None, [""]),
    "apart": (fields(parts(2), (0.04, 0.04), (0.54, 0.04), size=0.42), TWO, [""]),
    "slots": (fields(parts(2), (0.04, 0.04), (0.04, 0.04)), TWO, ["_shell", "_visor"]),
    "a slot one tile up": (fields(parts(2), (0.04, 1.04), (0.04, 1.04)), TWO, ["_shell", "_visor"]),
    "objects of one slot": (fields(parts(2), (0.04, 0.04), (0.04, 0.04)), None, [""]),
    "tiles": (fields(parts(3), (0.04, 0.04), (1.04, 0.04), (0.04, 1.04)), None, [".1001", ".1002", ".1011"]),
    "tiles of slots": (fields(SAME, (0.04, 0.04), (1.04, 0.04)), TWO, [".1001", ".1002"]),
    "copies": (fields(SAME, (0.04, 0.04), (1.04, 0.04)), None, [""]),
    "a copy, and more": (fields([*SAME, parts(3)[2]], (0.04, 0.04), (1.04, 0.04), (1.04, 0.04)), None, [""]),
    "moved without need": (fields(parts(2), (0.04, 0.04), (1.54, 0.04), size=0.42), None, [""]),
    "no numbers": (fields(parts(2), (0.04, 0.04), (-0.96, 0.04)), None, [""]),
    "across borders": (fields(parts(2), (0.04, 0.04), (0.54, 0.04)), None, [""]),
    "slots in tiles": (
        fields(parts(4), (0.04, 0.04), (1.04, 0.04), (0.04, 0.04), (1.04, 0.04)), ["a", "a", "b", "b"],
        ["_a.1001", "_a.1002", "_b.1001", "_b.1002"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FOUND)
def test_what_the_source_has_is_kept(name: str, tmp_path: Path) -> None:
    soups, slots, expected = FOUND[name]
    made = prepared(tmp_path, soups, slots)
    assert made.provenance.extra["uv_kept"]
    assert names(made) == expected
    assert sum(one.share for one in texture_sets(made.provenance)) == pytest.approx(1, abs=1e-5)
    own = np.concatenate([np.full(len(soup[0]), k) for k, soup in enumerate(soups)])
    if len(expected) == len(soups):
        np.testing.assert_array_equal(made["face_set"], own)
        assert not made.provenance.extra["shared_texels"]


def test_what_is_asked_for_is_done(tmp_path: Path) -> None:
    soups = fields(parts(2), (0.04, 0.04), (1.04, 0.04))
    assert names(prepared(tmp_path, soups, TWO, textures="one")) == [""]
    assert prepared(tmp_path, soups, TWO, textures="one").provenance.extra["shared_texels"]
    assert names(prepared(tmp_path, soups, TWO, textures="slots")) == ["_shell", "_visor"]
    assert names(prepared(tmp_path, soups, TWO, textures="udim")) == [".1001", ".1002"]
    assert names(prepared(tmp_path, soups[:1], TWO[:1], textures="udim")) == [".1001"]
    assert names(prepared(tmp_path, fields(SAME, (0.04, 0.04), (9.04, 2.04)), textures="udim")) == [".1001", ".1030"]


def test_new_uvs_are_made_for_each_slot_where_that_is_asked_for(tmp_path: Path) -> None:
    made = prepared(tmp_path, parts(2), TWO, uv="new", textures="slots", unwrap_seconds=0.0)
    assert (names(made), made.provenance.extra["uv_kept"]) == (["_shell", "_visor"], False)
    for number in (0, 1):
        uv = made["uv"][triangle_sets(made) == number]
        assert np.ptp(uv.reshape(-1, 2), axis=0).max() > 0.9  # each has the whole square
    assert len(set(made["charts"][triangle_sets(made) == 0]) & set(made["charts"][triangle_sets(made) == 1])) == 0
    assert names(prepared(tmp_path, parts(2), TWO, uv="new", unwrap_seconds=0.0)) == [""]


@pytest.mark.parametrize(
    ("soup", "options", "cause"),
    [
        (at(ball(5, 9), (-0.96, 0.04), (0.92, 0.92)), {}, "some of its surface lies in tiles that have no UDIM number"),
        (at(ball(5, 9), (10.04, 0.04), (0.92, 0.92)), {}, "some of its surface lies in tiles that have no UDIM number"),
        ((ball(5, 9)[0], ball(5, 9)[1] * np.nan), {}, "none in the file"),
        (ball(5, 9), {"uv": "new"}, "new ones asked for"),
    ],
)
def test_no_tiles_is_one_line(soup: Soup, options: dict, cause: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=rf"a\.obj: has no UDIM tiles: {cause}; lay it out in tiles") as raised:
        prepared(tmp_path, [soup], textures="udim", **options)
    assert "\n" not in str(raised.value)


def test_names_of_slots_become_names_of_files(tmp_path: Path) -> None:
    assert [file_word(name) for name in ("", "..", "a/b: c", "Gläser", "木", "x" * 99)] == [
        "material", "material", "a_b_c", "Gläser", "木", "x" * 48,
    ]  # fmt: skip
    soups = fields(parts(4), *[FULL[0]] * 4)
    made = prepared(tmp_path, soups, ["a b", "a/b", "A:B", ""], textures="slots")
    assert names(made) == ["_a_b", "_a_b_2", "_A_B_3", "_material"]
    assert [one.slots for one in texture_sets(made.provenance)] == [("a b",), ("a/b",), ("A:B",), ("",)]


def test_faces_without_texels_go_with_a_neighbour_of_their_slot(tmp_path: Path) -> None:
    """A face without area in UV, and one without UVs, in the second slot; a slot that has none at all."""
    one, two = fields(parts(2), *[FULL[0]] * 2)
    lost = two[1].copy()
    lost[3], lost[7] = lost[3, :1], np.nan
    speck = two[0][:1] * 1e-3 + (0, 3, 0), np.full((1, 4, 2), np.nan)
    made = prepared(tmp_path, [one, (two[0], lost), speck], ["shell", "visor", "screw"])
    assert names(made) == ["_shell", "_visor"]
    np.testing.assert_array_equal(made["face_set"][len(one[0]) : -1], 1)
    assert made["face_set"][-1] == 1  # the larger of the two
    face = 2 * (len(one[0]) + 7)
    assert triangle_sets(made)[face] == 1
    near = made["uv"][triangle_sets(made) == 1].reshape(-1, 2)
    assert (np.abs(near - made["uv"][face, 0]).max(1) == 0).sum() > 3  # a texel of its neighbours


def test_what_is_mended_lies_in_its_tile(tmp_path: Path) -> None:
    """And faces in their tiles are not told to be outside of the square."""
    one, two = fields(parts(2), (0.04, 0.04), (1.04, 1.04), size=0.6)
    lost = two[1].copy()
    lost[3] = lost[3, :1]
    made = prepared(tmp_path, [one, (two[0], lost)], uv="mend", textures="udim")
    assert names(made) == [".1001", ".1012"]
    tile = np.floor(made["uv"].mean(1))
    np.testing.assert_array_equal(tile, triangle_sets(made)[:, None] * (1, 1))
    assert made.provenance.extra["findings"]["uv"].split("; ")[1:] == ["2 of 222 faces mended, with charts in free space"]


def test_slots_that_meet_have_charts_of_their_own(tmp_path: Path) -> None:
    """Two halves of one ball share vertices and, in part, UVs."""
    points, uv = at(ball(6, 12), (0.0, 0.0), (1.0, 1.0))
    upper = len(points) // 2
    made = prepared(tmp_path, [(points[:upper], uv[:upper] * (1, 2)), (points[upper:], uv[upper:] * (1, 2) - (0, 1))], TWO)
    assert names(made) == ["_shell", "_visor"]
    charts, sets = made["charts"], triangle_sets(made)
    assert all(len(set(sets[charts == chart])) == 1 for chart in set(charts.tolist()))


def corner_uvs(made: Artifact) -> NDArray[np.float32]:
    """UV of each corner of each triangle in model.glb, face by face of the source, v down."""
    model = source_model(made, double_sided=False)
    rows = np.concatenate([part.uv[part.triangles].reshape(-1, 6) for part in model.parts])
    return np.unique(rows, axis=0)


KEPT: dict[str, tuple[list[Soup], list[str] | None]] = {
    "tiles": ([of_tiles()], None),
    "stacked": ([stacked_a_tile_away()], None),
    "slots": (fields(parts(2), (0.04, 0.04), (0.04, 0.04)), TWO),
}


@pytest.mark.parametrize(("soups", "slots"), KEPT.values(), ids=KEPT)
def test_uvs_are_the_sources_bit_for_bit_in_obj(soups: list[Soup], slots: list[str] | None, tmp_path: Path) -> None:
    made = prepared(tmp_path, soups, slots)
    write_model(tmp_path / "model.obj", made)
    source, model = read_obj(tmp_path / "a.obj"), read_obj(tmp_path / "model.obj")
    np.testing.assert_array_equal(model.uv[model.loop_uv], source.uv[source.loop_uv])
    np.testing.assert_array_equal(model.loop_vertex, source.loop_vertex)
    found = [one.suffix for one in texture_sets(made.provenance)]
    worn = [suffix[1:] if slots else f"material{suffix}" for suffix in found]
    assert [model.parts[part].material for part in model.face_part] == [worn[k] for k in made["face_set"].tolist()]
    told = (tmp_path / "model.mtl").read_text()
    assert all(f"map_Kd albedo{suffix}.png" in told for suffix in found)


def test_uvs_are_the_sources_bit_for_bit_in_glb(tmp_path: Path) -> None:
    """One primitive over three UDIM tiles: a part for each, all with the vertices of the source."""
    built = GltfBuilder()
    soup = together(*fields(parts(3), (0.04, 0.04), (1.04, 0.04), (1.04, 1.04)))
    positions, uv = (values.reshape(-1, values.shape[-1]).astype(np.float32) for values in soup)
    uv[:, 1] = 1 - uv[:, 1]
    quads = np.arange(len(positions), dtype=np.uint32).reshape(-1, 4)
    triangles = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1)
    attributes = {"POSITION": built.accessor(positions, "VEC3"), "TEXCOORD_0": built.accessor(uv, "VEC2")}
    built.root["materials"] = [{"name": "skin"}]
    built.mesh([{"attributes": attributes, "indices": built.accessor(triangles, "SCALAR"), "material": 0}], name="body")
    prep(built.write(tmp_path / "a.glb"), tmp_path / "a.npz", SMALL)
    made = load_npz(tmp_path / "a.npz", PREP)
    assert names(made) == [".1001", ".1002", ".1012"]
    model = source_model(made, double_sided=False)
    assert [part.worn.name for part in model.parts] == ["skin.1001", "skin.1002", "skin.1012"]
    assert {part.worn.slot for part in model.parts} == {"skin"}
    assert all(part.uv is model.parts[0].uv and np.array_equal(part.uv, uv) for part in model.parts)
    assert all(np.array_equal(part.positions, positions) for part in model.parts)
    np.testing.assert_array_equal(np.concatenate([part.triangles for part in model.parts]).ravel(), triangles)


def test_uvs_of_slots_are_the_sources_bit_for_bit_in_glb(tmp_path: Path) -> None:
    """Two primitives that each fill the square: a set for each, every vertex and face as it was."""
    built, given = GltfBuilder(), []
    built.root["materials"] = [{"name": name} for name in TWO]
    for points, uv in parts(2):
        table = [values.reshape(-1, values.shape[-1]).astype(np.float32) for values in (points, uv * 0.92 + 0.04)]
        triangles = np.arange(len(table[0]), dtype=np.uint32).reshape(-1, 4)[:, [0, 1, 2, 0, 2, 3]].reshape(-1)
        given.append((*table, triangles))
    primitives = [
        {
            "attributes": {"POSITION": built.accessor(points, "VEC3"), "TEXCOORD_0": built.accessor(uv, "VEC2")},
            "indices": built.accessor(triangles, "SCALAR"),
            "material": number,
        }
        for number, (points, uv, triangles) in enumerate(given)
    ]
    built.mesh(primitives, name="helmet")
    prep(built.write(tmp_path / "a.glb"), tmp_path / "a.npz", SMALL)
    made = load_npz(tmp_path / "a.npz", PREP)
    assert names(made) == ["_shell", "_visor"]
    model = source_model(made, double_sided=False)
    assert [(part.worn.name, part.worn.set) for part in model.parts] == [("shell", 0), ("visor", 1)]
    for part, (points, uv, triangles) in zip(model.parts, given, strict=True):
        corner = part.triangles.ravel()
        np.testing.assert_array_equal(part.uv[corner], uv[triangles])
        np.testing.assert_array_equal(part.positions[corner], points[triangles])


def test_many_slots(tmp_path: Path) -> None:
    """As many sets, each named, each with its share."""
    soups = fields([ball(3, 4, (2.2 * k, 0, 0)) for k in range(100)], *[FULL[0]] * 100)
    slots = [f"part {k % 50}" if k < 50 else f"PART {k % 50}" for k in range(100)]
    made = prepared(tmp_path, soups, slots, textures="slots")
    found = texture_sets(made.provenance)
    assert len({one.suffix.lower() for one in found}) == len(found) == 100
    assert sum(one.share for one in found) == pytest.approx(1, abs=1e-3)
