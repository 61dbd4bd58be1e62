"""The stage as a whole: its file, its promises to `bake`, and that it is repeatable."""

import json
import time
from pathlib import Path

import numpy as np
import pytest

from stages.core.artifact import Artifact, load_npz
from stages.core.errors import InputError
from stages.core.frames import transform_points
from stages.core.schemas import PREP
from stages.prep.options import PrepOptions
from stages.prep.stage import prep
from stages.prep.uv import overlap
from tests.conftest import Golden
from tests.prep.shapes import CUBE_QUADS, cube, cube_corners, sphere, write_obj

SMALL = PrepOptions(texture_size=512, padding=4)

BEVELLED = """o block
v 0 0 0
v 2 0 0
v 2 1 0
v 0 1 0
v 0 0 1
v 2 0 1
v 2 0.75 1
v 2 1 0.75
v 0 1 0.75
v 0 0.75 1
usemtl stone
f 1 4 3 2
f 1 2 6 5
f 5 6 7 10
f 7 8 9 10
f 3 4 9 8
usemtl paint
f 2 3 8 7 6
f -10 -6 -1 -2 -7
"""


def prepared(mesh: Path, options: PrepOptions = SMALL) -> Artifact:
    out = mesh.with_suffix(".prep.npz")
    prep(mesh, out, options)
    return load_npz(out, PREP)


def check_promises(made: Artifact) -> None:
    """What every prep.npz holds, whatever the mesh."""
    v, t, loops = made["vertices"], made["triangles"], made["triangle_loops"]
    assert np.ptp(v, axis=0).max() == pytest.approx(1, abs=1e-6)
    placed = made["source_vertices"].copy()
    for index, part in enumerate(made.provenance.extra["parts"]):
        mine = np.unique(made["loop_vertex"][np.repeat(made["face_part"] == index, np.diff(made["loop_start"]))])
        placed[mine] = transform_points(np.reshape(part["transform"], (4, 4)), made["source_vertices"][mine])
    corners = transform_points(made["to_world"], placed[made["loop_vertex"][loops]])
    assert np.abs(corners - v[t]).max() < 1e-5  # welding moves a corner by its tolerance at most
    np.testing.assert_allclose(np.linalg.norm(made["normals"], axis=-1), 1, atol=1e-5)
    np.testing.assert_array_equal(np.clip(made["loop_uv"][loops], 0, 1), made["uv"])
    assert overlap(made["uv"]) < 1e-3
    assert not made.provenance.extra["uv_kept"] or (made["loop_source_uv"][loops] >= 0).all()
    check_seams(made)


def check_seams(made: Artifact) -> None:
    """UVs of one vertex in one chart are the same bits, or apart by more than a texel: a seam, never a crack."""
    corners = np.stack([made["triangles"].reshape(-1), np.repeat(made["charts"], 3)], -1)
    rows = np.unique(np.concatenate([corners, made["uv"].reshape(-1, 2).view(np.int32)], 1), axis=0)
    uv = rows[:, 2:].astype(np.int32).view(np.float32)
    same = (rows[1:, :2] == rows[:-1, :2]).all(1)
    apart = np.abs(uv[1:] - uv[:-1]).max(1)[same]
    assert (apart > 1e-4).all() or made.provenance.extra["uv_kept"]


def test_golden_block(tmp_path: Path, golden: Golden) -> None:
    """A bevelled block of quads and pentagons with two materials; charts by projection, so that xatlas may change."""
    mesh = tmp_path / "block.obj"
    mesh.write_text(BEVELLED)
    made = prepared(mesh, PrepOptions(texture_size=512, padding=4, unwrap_triangles=0))
    check_promises(made)
    golden.check("prep/block", made.arrays, atol=1e-5)
    extra = made.provenance.extra
    assert [(part["name"], part["material"]) for part in extra["parts"]] == [("block", "stone"), ("block", "paint")]
    assert extra["findings"]["watertight"] and extra["findings"]["parts"] == 1


def test_the_same_request_gives_the_same_bytes_and_is_done_once(tmp_path: Path) -> None:
    mesh = write_obj(tmp_path / "a.obj", *sphere())
    first = prep(mesh, tmp_path / "a.npz", SMALL)
    again = prep(mesh, tmp_path / "a.npz", SMALL)
    prep(mesh, tmp_path / "b.npz", SMALL)
    assert (first.up_to_date, again.up_to_date) == (False, True) and first.findings == again.findings
    data = (tmp_path / "a.npz").read_bytes()
    assert data == (tmp_path / "b.npz").read_bytes()
    assert not prep(mesh, tmp_path / "a.npz", SMALL, force=True).up_to_date
    assert (tmp_path / "a.npz").read_bytes() == data
    assert not prep(mesh, tmp_path / "a.npz", PrepOptions(texture_size=256, padding=4)).up_to_date
    mesh.write_text(mesh.read_text() + "# touched\n")
    assert not prep(mesh, tmp_path / "a.npz", PrepOptions(texture_size=256, padding=4)).up_to_date
    assert json.loads((tmp_path / "a.npz.run.json").read_text())["seconds"] > 0


@pytest.mark.parametrize("scale", [1e-4, 1e4, 1e-30, 3e38, 1e-100])
@pytest.mark.filterwarnings("error:.*encountered")
def test_scale_does_not_matter(tmp_path: Path, scale: float) -> None:
    vertices, triangles = sphere()
    one = prepared(write_obj(tmp_path / "one.obj", vertices, triangles))
    other = prepared(write_obj(tmp_path / "other.obj", vertices * scale, triangles))
    np.testing.assert_array_equal(one["triangles"], other["triangles"])
    np.testing.assert_allclose(one["vertices"], other["vertices"], atol=1e-7)
    check_promises(other)


@pytest.mark.parametrize("scale", [1e38, 1e-30, 1e-100])
def test_concave_faces_are_cut_at_any_scale(tmp_path: Path, scale: float) -> None:
    """A fan from the first corner would fold over."""
    arrow = np.array([(0.3, 0.5, 0), (0, 0, 0), (1, 0.5, 0), (0, 1, 0)])
    made = prepared(write_obj(tmp_path / "a.obj", arrow * scale, [[2, 3, 0, 1]]))
    a, b, c = (made["vertices"][made["triangles"][:, k]].astype(float) for k in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(0.35)


def unfolded() -> np.ndarray:
    """UVs of a cube of loose quads, each quad in a cell of its own."""
    cell = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * 0.2 + 0.05
    return np.concatenate([cell + [0.3 * (k % 3), 0.3 * (k // 3)] for k in range(6)])


def loose_cube(path: Path, uv: np.ndarray) -> Path:
    soup = np.concatenate([cube_corners()[list(quad)] for quad in CUBE_QUADS])
    return write_obj(path, soup, np.arange(24).reshape(6, 4), uv)


def test_good_uvs_are_kept_bit_for_bit(tmp_path: Path) -> None:
    uv = unfolded().astype(np.float32)
    made = prepared(loose_cube(tmp_path / "a.obj", uv.astype(np.float64)))
    assert made.provenance.extra["uv_kept"] and made.provenance.extra["findings"]["charts"] == 6
    assert np.array_equal(made["loop_uv"], uv)
    check_promises(made)


def test_uvs_across_the_border_of_a_tile_are_kept_bit_for_bit(tmp_path: Path) -> None:
    uv = (unfolded() + (0.5, 2.5)).astype(np.float32)
    made = prepared(loose_cube(tmp_path / "a.obj", uv.astype(np.float64)))
    assert made.provenance.extra["uv_kept"] and not made.provenance.extra["shared_texels"]
    assert made.provenance.extra["findings"]["uv"] == "kept; 12 of 12 faces outside the unit square, whose textures repeat"
    assert np.array_equal(made["loop_uv"], uv)
    assert np.array_equal(made["source_uv"][made["loop_source_uv"]], uv)


@pytest.mark.parametrize("scale", [16.0, 0.0])
def test_uv_traps_are_replaced_or_refused(tmp_path: Path, scale: float) -> None:
    """Tiled, and all in one point: new ones, and the reason; refused where they must be kept."""
    mesh = loose_cube(tmp_path / "a.obj", unfolded() * scale)
    made = prepared(mesh)
    assert not made.provenance.extra["uv_kept"] and made.provenance.extra["findings"]["unusable_uv"]
    check_promises(made)
    with pytest.raises(InputError, match="cannot be kept"):
        prep(mesh, tmp_path / "b.npz", PrepOptions(uv="keep"))
    assert not (tmp_path / "b.npz").exists()


def test_new_uvs_may_be_asked_for(tmp_path: Path) -> None:
    made = prepared(loose_cube(tmp_path / "a.obj", unfolded()), PrepOptions(texture_size=512, padding=4, uv="new"))
    assert not made.provenance.extra["uv_kept"]


def test_a_card_drawn_on_both_sides_shares_its_texels(tmp_path: Path) -> None:
    vertices, triangles = cube()
    made = prepared(write_obj(tmp_path / "a.obj", vertices, [*triangles, *triangles[:, ::-1]]))
    front, back = np.split(made["loop_uv"].reshape(-1, 3, 2), 2)
    np.testing.assert_array_equal(front, back[:, ::-1])
    assert made.provenance.extra["findings"]["duplicates"] == 12


@pytest.mark.parametrize(
    "name, content, cause",
    [
        ("missing.obj", None, "no such file"),
        ("a.obj", b"", "is empty"),
        ("a.blend", b"x", "format '.blend' is not read"),
        ("folder.obj", "folder", "is a folder"),
    ],
)
def test_files_that_are_none(tmp_path: Path, name: str, content: bytes | str | None, cause: str) -> None:
    path = tmp_path / name
    if content == "folder":
        path.mkdir()
    elif isinstance(content, bytes):
        path.write_bytes(content)
    with pytest.raises(InputError, match=cause) as raised:
        prep(path, tmp_path / "out.npz", SMALL)
    assert str(raised.value).startswith(str(path)) and "\n" not in str(raised.value)
    assert not (tmp_path / "out.npz").exists()


def test_progress_is_told(tmp_path: Path) -> None:
    told: list[tuple[str, int, int]] = []
    mesh = write_obj(tmp_path / "a.obj", *cube())
    prep(mesh, tmp_path / "a.npz", SMALL, progress=lambda *step: told.append(step))
    assert [step[1] for step in told] == [0, 1, 2, 3, 4] and all(step[2] == 4 for step in told)


# ------------------------------------------------------------------------------------------ real meshes, where present


def test_every_broken_file_gives_a_result_or_one_line(assets: Path, tmp_path: Path) -> None:
    files = sorted((assets / "broken_micro").iterdir())
    refused = set()
    assert len(files) >= 11
    for path in files:
        start = time.monotonic()
        try:
            prep(path, tmp_path / f"{path.name}.npz", SMALL)
            check_promises(load_npz(tmp_path / f"{path.name}.npz", PREP))
        except InputError as error:
            refused.add(path.name)
            assert str(error).startswith(str(path)) and "\n" not in str(error)
        assert time.monotonic() - start < 20
    assert refused == {"assimp_box_infinities.glb", "draco_inf_nan.obj", "xatlas_zero_area_face.obj"}


@pytest.mark.parametrize(
    "name, kept, expected",
    [
        ("meshes/featuretype.stl", False, {"watertight": True, "welded_vertices": 1722}),
        ("meshes/buffalo_insideout.off", False, {"parts": 51}),
        ("meshes/gazebo.obj", False, {"parts": 56, "boundary_edges": 8}),
        ("meshes/spider_degenerate.stl", False, {"degenerate": 56, "boundary_edges": 72, "parts": 18}),
        ("meshes/wingnut.obj", False, {"watertight": True}),
        ("meshes/bob_uv.obj", True, {"watertight": True, "authored_normals": 32064}),
        ("pbr/avocado.glb", True, {"boundary_edges": 38, "parts": 2}),
        ("pbr/babylon_shaderball.glb", True, {"parts": 18}),
    ],
)
def test_real_meshes(assets: Path, tmp_path: Path, name: str, kept: bool, expected: dict[str, object]) -> None:
    prep(assets / name, tmp_path / "a.npz", PrepOptions(unwrap_triangles=0))
    made = load_npz(tmp_path / "a.npz", PREP)
    assert made.provenance.extra["uv_kept"] is kept
    findings = made.provenance.extra["findings"]
    assert {key: findings[key] for key in expected} == expected
    check_promises(made)


def test_the_inside_out_buffalo_is_turned(assets: Path, tmp_path: Path) -> None:
    prep(assets / "meshes/buffalo_insideout.off", tmp_path / "a.npz", PrepOptions(unwrap_triangles=0))
    made = load_npz(tmp_path / "a.npz", PREP)
    share = made.provenance.extra["findings"]["inverted_winding"] / len(made["triangles"])
    corners = made["vertices"][made["triangles"]].astype(float)
    volume = np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert share > 0.95 and volume > 0
