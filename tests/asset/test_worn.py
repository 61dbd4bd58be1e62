"""The materials of a model, by slot and texture set."""

from pathlib import Path

import pytest

from stages.asset.worn import worn_materials
from stages.core.artifact import load_npz
from stages.core.schemas import PREP
from stages.core.texture_sets import TextureSet
from tests.bake.examples import cube, one_part, save_prep

TILES = (TextureSet(".1001", 1001), TextureSet(".1002", 1002))
SLOTS = (TextureSet("_a", None), TextureSet("_b", None))


@pytest.mark.parametrize(
    ("slots", "sets", "of_part", "names"),
    [
        (("a", "b"), SLOTS, (0, 1), ["a", "b"]),
        (("a", "b"), TILES, (1, 0), ["a", "b"]),
        (("a", "a"), TILES, (0, 1), ["a.1001", "a.1002"]),
        (("", ""), TILES, (0, 1), ["material.1001", "material.1002"]),
        (("", "material"), SLOTS, (0, 1), ["", "material_2"]),
        (("", "material"), TILES[:1], (0, 0), ["", "material"]),
        (("a", "A"), SLOTS, (0, 1), ["a", "A"]),
    ],
)
def test_a_slot_keeps_its_name_unless_it_has_several_sets(
    slots: tuple[str, ...], sets: tuple[TextureSet, ...], of_part: tuple[int, ...], names: list[str], tmp_path: Path
) -> None:
    part = [0, 0, 0, 1, 1, 1]
    example = cube().with_(
        parts=one_part(material=slots[0]) + one_part(material=slots[1]), part=part, sets=sets, set=[of_part[p] for p in part]
    )
    found, of_face = worn_materials(load_npz(save_prep(tmp_path / "prep.npz", example), PREP))
    assert [worn.name for worn in found] == names
    assert [found[row].slot for row in of_face] == [slots[p] for p in part]
    assert [found[row].set for row in of_face] == [of_part[p] for p in part]
