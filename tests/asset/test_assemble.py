"""Assets of a scene's objects put together: names, hierarchy, places and sharing as the scene's file has them."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from dreammat_cli.main import cli
from stages.asset.assemble import assemble
from stages.bake.options import BakeOptions
from stages.bake.stage import bake
from stages.core.artifact import load_npz, read_manifest, save_npz, write_manifest
from stages.core.errors import ArtifactError, DreammatError, InputError, OutputError
from stages.core.schemas import ASSET, PREP
from stages.edit.options import EditOptions
from stages.edit.stage import edit
from stages.prep.options import PrepOptions
from stages.prep.read_gltf import read_gltf
from stages.prep.split import split
from tests.asset.glb import Glb
from tests.asset.test_models import khronos_issues
from tests.bake.examples import constant, cube, save_material, save_prep
from tests.prep.scenes import OBJECTS, room, solid
from tests.prep.shapes import GltfBuilder
from tests.prep.shapes import cube as cube_shape

FAST = PrepOptions(texture_size=256, padding=2, unwrap_triangles=0)
SMALL = BakeOptions(size=512, preview_size=32, occlusion_rays=4)


def blank(page: Path, *args: object) -> None:
    page.write_text("")


@contextmanager
def no_pictures() -> Iterator[None]:
    """Assets without preview and report, which these tests do not look at."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("stages.bake.stage.contact_sheet", lambda *args: np.zeros((4, 4, 3), np.float32))
        patched.setattr("stages.bake.stage.page_of", lambda *args: None)
        patched.setattr("stages.bake.stage.write_page", blank)
        yield


def baked_blank(prep: Path, asset: Path, color: tuple[float, float, float] = (0.5, 0.5, 0.5)) -> None:
    """An asset of one material."""
    material = save_material(prep.with_name("material.npz"), prep, constant((*color, 0.5, 0.1)))
    with no_pictures():
        bake(prep, material, asset, SMALL)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A split scene of which stool and cup are baked, without pictures."""
    folder = tmp_path_factory.mktemp("assemble")
    split(room(folder / "room.glb"), folder / "jobs", FAST)
    for name, color in (("stool", (0.6, 0.2, 0.1)), ("cup", (0.1, 0.2, 0.6))):
        baked_blank(folder / "jobs" / name / "prep.npz", folder / "jobs" / name / "asset", color)
    return folder


def transplanted(asset: Path, prep: Path, folder: Path) -> Path:
    """The files of an asset as one of another mesh."""
    shutil.copytree(asset, folder)
    provenance, files = read_manifest(folder, ASSET)
    (folder / "mesh.npz").unlink()
    shutil.copyfile(prep, folder / "mesh.npz")
    write_manifest(folder, ASSET, provenance, list(files))
    return folder


def baked(scene: Path) -> list[Path]:
    return [scene / "jobs" / name / "asset" for name in ("stool", "cup")]


def test_names_hierarchy_places_and_sharing_are_the_scenes(scene: Path) -> None:
    out = scene / "scene.glb"
    made = assemble(baked(scene), out)
    assert (made.objects, made.empty) == (["cup", "stool"], []) and len(made.grey) == 6
    source, root = Glb.read(scene / "room.glb").root, Glb.read(out).root
    assert root["scenes"] == source["scenes"]
    for node, own in zip(root["nodes"], source["nodes"], strict=True):
        assert {k: v for k, v in node.items() if k != "mesh"} == {k: v for k, v in own.items() if k != "mesh"}
        assert ("mesh" in node) == ("mesh" in own)
    pairs = {(node["mesh"], own["mesh"]) for node, own in zip(root["nodes"], source["nodes"], strict=True) if "mesh" in own}
    assert len(pairs) == len(root["meshes"]) == 8  # one mesh for each of the source's: the stools share theirs
    before, after = read_gltf(scene / "room.glb"), read_gltf(out)
    assert [part.node for part in after.parts] == [part.node for part in before.parts]
    corners = [found.placed_vertices()[found.loop_vertex] for found in (after, before)]
    np.testing.assert_array_equal(*corners)  # every corner of every object, to the bit
    assert assemble(baked(scene), out).up_to_date


def test_khronos_validator_finds_nothing(scene: Path) -> None:
    assemble(baked(scene), scene / "valid.glb")
    issues = khronos_issues(scene / "valid.glb")
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]


def test_every_object_shows_its_own_pictures(scene: Path) -> None:
    out = scene / "own.glb"
    assemble(baked(scene), out)
    glb = Glb.read(out)
    for name, node in (("stool", 7), ("cup", 5)):
        primitive = glb.root["meshes"][glb.root["nodes"][node]["mesh"]]["primitives"][0]
        texture = glb.root["materials"][primitive["material"]]["pbrMetallicRoughness"]["baseColorTexture"]["index"]
        image = glb.root["images"][glb.root["textures"][texture]["source"]]
        assert glb.view(image["bufferView"]) == (scene / "jobs" / name / "asset" / "albedo.png").read_bytes()
    floor = glb.root["meshes"][glb.root["nodes"][1]["mesh"]]["primitives"][0]
    assert "baseColorFactor" in glb.root["materials"][floor["material"]]["pbrMetallicRoughness"]


def test_assets_elsewhere_leave_the_others_empty_and_edits_count(scene: Path, tmp_path: Path) -> None:
    shutil.copytree(scene / "jobs" / "stool" / "asset", tmp_path / "stool")
    made = assemble([tmp_path / "stool"], tmp_path / "a.glb")
    assert made.objects == ["stool"] and set(made.empty) == set(OBJECTS) - {"stool"}
    with no_pictures():
        edit(tmp_path / "stool", tmp_path / "red", EditOptions(hue=40))
    assert not assemble([tmp_path / "red"], tmp_path / "a.glb").up_to_date


def test_instances_of_one_node_come_back(scene: Path, tmp_path: Path) -> None:
    """EXT_mesh_gpu_instancing stays on its node."""
    built = GltfBuilder()
    shift = built.accessor(np.float32([(0, 0, 5), (0, 0, 8)]), "VEC3")
    extension = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": shift}}}
    built.mesh([solid(built, cube_shape(), (1, 1, 1))], name="many", extensions=extension, translation=[1, 2, 3])
    split(built.write(tmp_path / "a.glb"), tmp_path / "jobs", FAST)
    asset = transplanted(baked(scene)[0], tmp_path / "jobs" / "many" / "prep.npz", tmp_path / "many")
    assemble([asset], tmp_path / "b.glb")
    glb = Glb.read(tmp_path / "b.glb")
    (node,) = glb.root["nodes"]
    assert (node["name"], node["translation"], node["mesh"]) == ("many", [1, 2, 3], 0)
    (column,) = node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"].values()
    np.testing.assert_array_equal(glb.accessor(column), [(0, 0, 5), (0, 0, 8)])
    assert read_gltf(tmp_path / "b.glb").applied == {"instances": 2}


def test_bad_input_is_one_line(scene: Path, tmp_path: Path) -> None:
    stool, cup = baked(scene)
    other, alone = tmp_path / "other", tmp_path / "alone"
    found = load_npz(stool / "mesh.npz", PREP)
    elsewhere = found.provenance.extra["scene"] | {"name": "garden.glb", "source": "1" * 64}
    garden = replace(found.provenance, extra=found.provenance.extra | {"scene": elsewhere})
    save_npz(tmp_path / "garden.npz", PREP, found.arrays, garden)
    transplanted(stool, save_prep(tmp_path / "prep.npz", cube()), alone)
    transplanted(stool, tmp_path / "garden.npz", other)
    shutil.copytree(stool, tmp_path / "again")
    cases: list[tuple[type[DreammatError], str, list[Path], Path]] = [
        (InputError, "alone: no object of a scene; expected assets of jobs", [stool, alone], tmp_path / "a.glb"),
        (InputError, r"other: of another scene \(garden\.glb\) than .*stool", [stool, other], tmp_path / "a.glb"),
        (InputError, r"again: is stool of room\.glb, and so is", [stool, tmp_path / "again"], tmp_path / "a.glb"),
        (ArtifactError, r"holds no bake\.json", [stool, tmp_path], tmp_path / "a.glb"),
        (OutputError, r"expected the name of a \.glb file", [cup], tmp_path / "a.obj"),
    ]
    for kind, message, assets, out in cases:
        with pytest.raises(kind, match=message) as caught:
            assemble(assets, out)
        assert "\n" not in str(caught.value) and not out.exists()


def test_the_command_says_what_is_there(scene: Path, tmp_path: Path) -> None:
    words = ["assemble", *map(str, baked(scene)), "-o", str(tmp_path / "s.glb")]
    result = CliRunner().invoke(cli, words, catch_exceptions=False)
    assert result.exit_code == 0 and "2 objects with their assets" in result.output
    assert "in grey, without an asset: floor, table, vase_blue, lamp, lamp_2, mesh_7" in result.output
