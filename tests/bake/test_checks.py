"""What the report says of an asset, on cases whose answer is known."""

from pathlib import Path

import numpy as np
import pytest

from stages.bake.checks import (
    FARTHEST,
    Facts,
    albedo_range,
    baked_light,
    density,
    gutter,
    islands,
    narrowest,
    out_of_range,
    rounded,
    share,
)
from stages.bake.raster import Layout, touched_texels
from stages.core.artifact import Artifact, load_npz
from stages.core.color import srgb_decode
from stages.core.schemas import PREP
from stages.light.lights import overcast
from stages.light.scene import Scene
from tests.bake.examples import Example, cube, grid, save_prep


def prepared(folder: Path, example: Example) -> Artifact:
    return load_npz(save_prep(folder / "prep.npz", example), PREP)


@pytest.mark.parametrize("gap", [0, 1, 2, 3, 4, 7, FARTHEST - 1])
@pytest.mark.parametrize("diagonal", [False, True])
def test_the_narrowest_gap_is_counted_in_texels(gap: int, diagonal: bool) -> None:
    labels = np.zeros((80, 80), np.int32)
    labels[5:20, 5:20] = 1
    start = 20 + gap
    labels[start : start + 9, start : start + 9] = 2 if diagonal else 0
    if not diagonal:
        labels[5:20, start : start + 9] = 7
    labels[70:, 70:] = 1  # the same region again is no neighbour of itself
    assert narrowest(labels) == gap


def test_a_wide_gap_or_one_region_is_not_measured() -> None:
    labels = np.zeros((64, 64), np.int32)
    labels[:10] = 1
    assert narrowest(labels) is None
    labels[10 + FARTHEST :] = 2
    assert narrowest(labels) is None


def test_faces_that_share_uvs_are_one_island_and_cut_ones_are_not(tmp_path: Path) -> None:
    sheet, box = prepared(tmp_path / "a", grid(3)), prepared(tmp_path / "b", cube())
    assert len(set(islands(sheet, np.ones(18, bool)))) == 1
    assert len(set(islands(box, np.ones(12, bool)))) == 6
    assert len(set(islands(box, np.ones(12, bool)).reshape(6, 2)[:, 0])) == 6  # the two triangles of a face together


def test_gutter_of_a_cube(tmp_path: Path) -> None:
    """Charts keep 0.02 of a third of the square to their cell's border: 2 x 0.02 / 3 x 512 = 6.8 texels between them."""
    box = prepared(tmp_path, cube())
    touched = touched_texels(Layout.of(box["uv"], 512))
    check = gutter(Facts.of(np.zeros((512, 512, 5), "f4"), touched, islands(box, np.ones(12, bool)), 1.0).gap)
    assert int(check.value.split()[0]) in (5, 6)
    assert check.state == "good"


def test_density_of_a_cube_is_that_of_its_charts(tmp_path: Path) -> None:
    """Each face, a unit square, is 0.96 thirds of 1536 texels wide."""
    check = density(prepared(tmp_path, cube()), np.full(12, 1536))
    assert check.value == f"{rounded(0.96 * 512)} per unit"
    assert check.state == "good"
    stretched = cube().with_(loop_uv=cube().loop_uv * np.where(np.arange(24) < 4, 0.4, 1)[:, None].astype("f4"))
    assert density(prepared(tmp_path / "s", stretched), np.full(12, 1536)).state == "look"


def test_dielectrics_out_of_range_are_counted_and_metals_are_not() -> None:
    grey = [float(srgb_decode(np.array(v / 255))) for v in (10, 30.5, 128, 239, 250)]
    rows = np.array([[g, g, g, 0.5, m] for g in grey for m in (0, 1)], np.float32)
    check = albedo_range(*out_of_range(rows))
    assert (check.value, check.state) == ("40 %", "look")
    assert albedo_range(*out_of_range(rows[1::2])).state == "fact"
    assert albedo_range(*out_of_range(rows[4:5])).value == "0 %"


def test_light_that_was_baked_in_is_found(tmp_path: Path) -> None:
    box = prepared(tmp_path, cube())
    scene = Scene(box["vertices"], box["triangles"], box["normals"])
    touched = touched_texels(Layout.of(box["uv"], 512))
    surface = touched.where(touched.triangle >= 0)
    surface = surface[np.linspace(0, len(surface.triangle) - 1, 3000).astype(int)]
    up = surface.interpolate(box["normals"])[:, 2]
    lit = np.repeat((0.3 + 0.2 * up)[:, None], 5, 1).astype(np.float32)
    found = baked_light(lit, surface, scene, [overcast()])
    assert found.state == "look" and float(found.value) > 0.9
    even = baked_light(np.full_like(lit, 0.4), surface, scene, [overcast()])
    assert (float(even.value), even.state) == (0, "good")


def test_shares_are_judged() -> None:
    assert share("x", 0.04, 0.05, "").state == "good"
    assert share("x", 0.06, 0.05, "").state == "look"
