"""What the files of a texture set are called, and which faces show it."""

from pathlib import Path

import numpy as np

from stages.core.artifact import load_npz
from stages.core.schemas import PREP
from stages.core.texture_sets import ONE_SET, TextureSet, map_files, texture_sets, triangle_sets
from tests.bake.examples import cube, save_prep

VISOR = TextureSet("_visor", None, ("visor",), 0.25, 512)
TILE = TextureSet(".1002", 1002, ("skin", "cloth"), 0.5, 1024)


def test_files_are_named_by_slot_or_by_tile() -> None:
    assert [of.file("albedo.exr") for of in (ONE_SET, VISOR, TILE)] == ["albedo.exr", "albedo_visor.exr", "albedo.1002.exr"]
    assert [of.name for of in (ONE_SET, VISOR, TILE)] == ["", "visor", "1002"]
    assert TextureSet.from_json(TILE.to_json()) == TILE


def test_the_files_of_a_set_are_those_that_there_are() -> None:
    files = {"albedo_visor.exr", "orm_visor.png", "albedo_shell.exr", "model.glb", "preview_light.exr"}
    assert map_files(VISOR, files) == {"albedo.exr": "albedo_visor.exr", "orm.png": "orm_visor.png"}


def test_triangles_show_the_set_of_their_face(tmp_path: Path) -> None:
    example = cube().with_(set=[0, 1, 0, 1, 1, 0], sets=(VISOR, TILE))
    mesh = load_npz(save_prep(tmp_path / "prep.npz", example), PREP)
    assert texture_sets(mesh.provenance) == [VISOR, TILE]
    np.testing.assert_array_equal(triangle_sets(mesh), np.repeat([0, 1, 0, 1, 1, 0], 2))
