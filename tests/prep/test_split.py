"""A scene as one job for each object: names, places, shadow casters, prompts."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from dreammat_cli.main import cli
from stages.asset.traced import traced_scene
from stages.core.artifact import Artifact, load_npz
from stages.core.errors import DreammatError, InputError
from stages.core.schemas import PREP
from stages.light.scene import Scene
from stages.prep.casters import LEAST, Placed, casters, placed
from stages.prep.options import PrepOptions
from stages.prep.prompts import prompts_of, read_prompts
from stages.prep.read_gltf import read_gltf
from stages.prep.split import split
from tests.prep.scenes import OBJECTS, room, solid
from tests.prep.shapes import GltfBuilder, cube, sphere

FAST = PrepOptions(texture_size=256, padding=2, unwrap_triangles=0)


@pytest.fixture(scope="module")
def jobs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("split")
    made = split(room(folder / "room.glb"), folder / "jobs", FAST)
    assert made.objects == OBJECTS and not made.unusable
    return folder


def job(jobs: Path, name: str) -> Artifact:
    return load_npz(jobs / "jobs" / name / "prep.npz", PREP)


def test_there_is_a_job_for_each_mesh_and_the_same_request_is_done_once(jobs: Path) -> None:
    assert {path.parent.name for path in (jobs / "jobs").glob("*/prep.npz")} == set(OBJECTS)
    assert split(jobs / "room.glb", jobs / "jobs", FAST).up_to_date
    scene = job(jobs, "stool").provenance.extra["scene"]
    nodes = json.loads((jobs / "room.glb").read_bytes()[20:].split(b"BIN\0")[0][:-4].decode().rstrip())["nodes"]
    for told, node in zip(scene["nodes"], nodes, strict=True):
        assert {k: v for k, v in told.items() if k != "object"} == {k: v for k, v in node.items() if k != "mesh"}
        assert told.get("object") == node.get("mesh")
    assert (scene["roots"], scene["objects"], scene["object"]) == ([0], OBJECTS, 4)


def test_an_object_stands_alone_and_all_others_around_it_cast_shadows(jobs: Path) -> None:
    stool, whole = job(jobs, "stool"), read_gltf(jobs / "room.glb")
    assert [part["node"] for part in stool.provenance.extra["parts"]] == ["stool"]
    assert len(stool["triangles"]) == 12 and len(stool["caster_triangles"]) == len(whole.face_part) - 12
    back = np.linalg.inv(stool["to_world"])
    around = stool["caster_vertices"] @ back[:3, :3].T + back[:3, 3]
    points = whole.placed_vertices()
    np.testing.assert_allclose(around.min(0), points.min(0), atol=1e-4)  # the floor's corner: in place, at the same scale
    np.testing.assert_allclose(around.max(0), points.max(0), atol=1e-4)


def test_casters_take_light_away_and_are_not_seen(jobs: Path) -> None:
    scene = traced_scene(job(jobs, "stool"))
    up, down = np.array([[0, 0, 1.0]]), np.array([[0, 0, -1.0]])
    above = np.array([[0.0, 0, 2.0]])
    assert scene.intersect(above, down).mask.all()
    beside = np.array([[1.5, 0, 0.0]])  # nothing but the floor below, seen from it
    assert scene.occluded(beside, down).all() and not scene.hidden(beside, down).any()
    assert not scene.alone().occluded(beside, down).any()
    assert not scene.intersect(beside, down).mask.any() and not scene.occluded(beside, up).any()


def test_what_encloses_an_object_casts_no_shadow() -> None:
    vertices, faces = sphere()
    ball = Scene(vertices, faces, np.zeros((len(faces), 3, 3)))
    sky = Placed(np.asarray(vertices, float) * 50, np.asarray(faces, np.int64))
    floor = Placed(np.array([(-9, -9, -2), (9, -9, -2), (9, 9, -2), (-9, 9, -2.0)]), np.array([(0, 1, 2), (0, 2, 3)]))
    found = casters([sky, floor], np.eye(4), ball)
    assert (len(found[1]), found[2]) == (2, 1)
    assert casters([floor], np.eye(4), ball)[2] == 0


def test_a_large_scene_has_fewer_triangles_in_its_shadows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built = GltfBuilder()
    built.mesh([solid(built, sphere(20, 40), (1, 1, 1))], name="large")
    built.mesh([solid(built, cube(), (1, 1, 1))], name="small", translation=[3, 0, 0])
    built.root["scenes"] = [{"nodes": [0, 1]}]
    source = read_gltf(built.write(tmp_path / "a.glb"))
    monkeypatch.setattr("stages.prep.casters.MOST", 400)
    large, small = placed(source, [[0], [1]])
    assert len(source.face_part) > 1200 and LEAST < len(large.triangles) <= 400 and len(small.triangles) == 12
    np.testing.assert_allclose(np.ptp(large.vertices, axis=0), 1, atol=0.05)


# ----------------------------------------------------------------------------------------------------------- prompts


def test_prompts_are_written_where_names_and_patterns_fit(jobs: Path, tmp_path: Path) -> None:
    prompts = tmp_path / "prompts.toml"
    prompts.write_text('"*" = "grey plaster"\n"vase/blue" = "blue glaze"\nTABLE = "oak"\n"#4" = "porcelain"\n')
    made = split(jobs / "room.glb", jobs / "jobs", FAST, prompts)
    assert made.up_to_date and made.unprompted == []
    said = {path.parent.name: path.read_text() for path in (jobs / "jobs").glob("*/prompt.txt")}
    special = {"vase_blue": "blue glaze", "table": "oak", "cup": "porcelain"}
    assert said == dict.fromkeys(OBJECTS, "grey plaster") | special
    prompts.write_text('"stool*" = "elm"\n')
    made = split(jobs / "room.glb", jobs / "jobs", FAST, prompts)
    assert made.unprompted == [name for name in OBJECTS if name != "stool"]
    assert [path.parent.name for path in (jobs / "jobs").glob("*/prompt.txt")] == ["stool"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('tabel = "oak"', "'tabel' names no object of the scene; did you mean 'table'? expected floor"),
        ('sofa = "velvet"', "'sofa' names no object of the scene; expected floor, table, vase/blue"),
        ("stool.001 = 'elm'", 'stool is a table; expected "NAME" = "prompt", names with dots in quotes'),
        ("table = 3", "table is 3; expected a prompt in quotes"),
        ("table = ' '", "table is ' '; expected a prompt in quotes"),
        ("table oak", "not TOML"),
        ("", "holds no prompt"),
        (None, "no such file"),
    ],
)
def test_prompts_are_checked_before_anything_is_made(tmp_path: Path, text: str | None, message: str) -> None:
    prompts = tmp_path / "prompts.toml"
    if text is not None:
        prompts.write_text(text)
    with pytest.raises(InputError) as caught:
        split(room(tmp_path / "room.glb"), tmp_path / "jobs", FAST, prompts)
    assert message in str(caught.value) and str(prompts) in str(caught.value) and "\n" not in str(caught.value)
    assert not (tmp_path / "jobs").exists()


def test_the_later_of_two_prompts_counts(tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text('"a*" = "oak"\nab = "elm"\n')
    objects = [{"name": "aa", "title": "aa"}, {"name": "ab", "title": "ab"}]
    assert prompts_of(objects, read_prompts(tmp_path / "p.toml"), tmp_path) == {"aa": "oak", "ab": "elm"}


def test_a_job_is_run_without_preparing_it_again(jobs: Path, tmp_path: Path) -> None:
    words = ["run", str(tmp_path / "prep.npz"), "--prompt", "oak", "-o", str(tmp_path), "--dry-run"]
    said = CliRunner().invoke(cli, words, catch_exceptions=False).output
    assert "would prepare" not in said and "[1 of 3] conditions" in said
    prep = str(jobs / "jobs" / "stool" / "prep.npz")
    words = ["run", prep, "--prompt", "oak", "-o", str(tmp_path), "--dry-run", "--json"]
    plans = [json.loads(line) for line in CliRunner().invoke(cli, words, catch_exceptions=False).output.splitlines()]
    assert [plan["object_size"] for plan in plans if "object_size" in plan] == [0.45]  # metres, as the scene has it
    words = ["run", prep, "--prompt", "oak", "-o", str(tmp_path), "--with", "distill", "--part wheel rubber"]
    result = CliRunner().invoke(cli, words)
    assert isinstance(result.exception, InputError) and "wheel" in str(result.exception)  # before anything long begins
    assert not list(tmp_path.iterdir())
    result = CliRunner().invoke(cli, ["run", prep, "--prompt", "oak", "-o", str(tmp_path), "--with", "prep", "--uv new"])
    assert result.exit_code == 2 and "is prepared already" in result.output


@pytest.mark.parametrize("words", [[], ["-o", "p.npz", "--split", "jobs"], ["-o", "p.npz", "--prompts", "p.toml"]])
def test_one_file_or_a_split_is_asked_for(words: list[str]) -> None:
    result = CliRunner().invoke(cli, ["prep", "a.glb", *words])
    assert result.exit_code == 2 and "-o PREP.npz for one mesh, or --split FOLDER" in result.output


# ---------------------------------------------------------------------------------------------------------- bad scenes


def test_a_scene_without_meshes_is_one_line(tmp_path: Path) -> None:
    built = GltfBuilder()
    built.root["nodes"], built.root["scenes"] = [{"name": "nothing"}], [{"nodes": [0]}]
    with pytest.raises(DreammatError, match="0 vertices and 0 faces, expected a surface") as caught:
        split(built.write(tmp_path / "a.glb"), tmp_path / "jobs", FAST)
    assert "\n" not in str(caught.value)


def test_an_object_without_a_surface_is_left_out_and_told(tmp_path: Path) -> None:
    built = GltfBuilder()
    built.mesh([solid(built, cube(), (1, 1, 1))], name="box")
    line = np.float32([(0, 0, 0), (1, 0, 0), (2, 0, 0)])
    indices = built.accessor(np.uint32([0, 1, 2]), "SCALAR")
    built.mesh([{"attributes": {"POSITION": built.accessor(line, "VEC3")}, "indices": indices}], name="line")
    built.root["scenes"] = [{"nodes": [0, 1]}]
    made = split(built.write(tmp_path / "a.glb"), tmp_path / "jobs", FAST)
    assert made.objects == ["box"] and "none of its 1 faces has an area" in made.unusable["line"]


def test_a_format_without_a_tree_is_split_by_its_objects(tmp_path: Path) -> None:
    lines, base = [], 0
    for name, shift in (("стол", 0), ("a b", 3), ("A_b", 6)):
        lines.append(f"o {name}")
        lines += [f"v {x + shift} {y} {z}" for x, y, z in np.asarray(cube()[0]).tolist()]
        lines += ["f " + " ".join(str(base + corner + 1) for corner in face) for face in np.asarray(cube()[1]).tolist()]
        base += len(cube()[0])
    (tmp_path / "a.obj").write_text("\n".join(lines) + "\n")
    made = split(tmp_path / "a.obj", tmp_path / "jobs", FAST)
    assert made.objects == ["object_1", "a_b", "A_b_2"]
    mesh = load_npz(tmp_path / "jobs" / "a_b" / "prep.npz", PREP)
    assert len(mesh["triangles"]) == 12 and len(mesh["caster_triangles"]) == 24
