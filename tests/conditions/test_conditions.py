"""The conditions stage: golden files, what the files hold, and runs that are interrupted, repeated or changed."""

import dataclasses
import hashlib
from pathlib import Path

import numpy as np
import pytest
import torch

from stages.conditions.options import ConditionsOptions
from stages.conditions.stage import check_finite, conditions
from stages.core.artifact import load_npz, read_exr, read_manifest, write_exr
from stages.core.errors import ArtifactError, InputError, NumericalError, OutputError
from stages.core.frames import camera_rays
from stages.core.schemas import CAMERAS, CONDITIONS
from stages.core.shading import F0, KNOTS, Transport
from stages.core.views import light_map_names, read_geometry, read_light_maps, read_transport
from stages.light.bounce import blender_light_maps
from stages.light.gbuffer import trace_view
from stages.light.lights import BUILTIN
from stages.light.transport import QUALITY
from tests.light import scenes
from tests.prepared import save_prep

SMALL = ConditionsOptions(views=3, size=24, env=("clear_sky", "studio"), quality="draft", maps=True)


@pytest.fixture(scope="module")
def prep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scene = scenes.box_in_corner()
    return save_prep(tmp_path_factory.mktemp("prep") / "prep.npz", scene.vertices, scene.triangles, scene.normals)


@pytest.fixture(scope="module")
def made(prep: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("made") / "conditions"
    conditions(prep, out, SMALL)
    return out


def fingerprint(folder: Path) -> dict[str, str]:
    """Hashes of everything but the run's own log."""
    files = [p for p in sorted(folder.rglob("*")) if p.is_file() and p.name != "run.json"]
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def test_golden(made: Path, golden) -> None:  # type: ignore[no-untyped-def]
    geometry = read_geometry(made, 1)
    transport = read_transport(made, 1, "studio", geometry.mask)
    arrays = {"mask": geometry.mask, "depth": geometry.depth, "normal": geometry.normal}
    arrays |= {"E": transport.E.float().numpy(), "A": transport.A.float().numpy(), "B": transport.B.float().numpy()}
    golden.check("conditions/corner", arrays, atol=2e-4, rtol=4e-3)


def test_geometry_is_what_the_rays_hit(made: Path) -> None:
    cameras = load_npz(made / "cameras.npz", CAMERAS)
    assert (int(cameras["width"]), int(cameras["height"])) == (24, 24)
    geometry = read_geometry(made, 0)
    assert geometry.mask.any()
    assert (geometry.depth[~geometry.mask] == 0).all()
    assert np.linalg.norm(geometry.normal[geometry.mask], axis=-1) == pytest.approx(1, abs=1e-5)
    assert (geometry.normal[geometry.mask] @ [0, 0, 1] > -0.5).all()
    origins, directions = camera_rays(cameras["c2w"][0], float(cameras["fov_y"][0]), 24, 24)
    points = (origins + directions * geometry.depth.reshape(-1, 1))[geometry.mask.ravel()]
    assert np.abs(points).max() == pytest.approx(0.5, abs=1e-5)


def test_maps_follow_from_the_transport(made: Path) -> None:
    geometry = read_geometry(made, 2)
    transport = read_transport(made, 2, "clear_sky", geometry.mask)
    maps = read_exr(made / "view_002" / "maps_clear_sky.exr").channels
    assert light_map_names()[1] == "light_m0_r0.5"
    assert set(maps) == {"depth"} | {f"{n}.{c}" for n in ["normal", *light_map_names()] for c in "RGB"}
    k = KNOTS.index(0.5)
    expected = transport.E[:, 1] + F0 * transport.A[:, k, 1] + transport.B[:, k, 1]
    assert maps["light_m0_r0.5.G"].dtype == np.float32
    assert maps["light_m0_r0.5.G"][geometry.mask] == pytest.approx(expected.float().numpy(), rel=5e-3, abs=1e-3)
    metal = (transport.A[:, 0, 2] + transport.B[:, 0, 2]).float().numpy()
    assert maps["light_m1_r0.B"][geometry.mask] == pytest.approx(metal, rel=5e-3, abs=1e-3)
    assert (maps["light_m1_r1.R"][~geometry.mask] == 0).all()


def test_the_profile_sd_adds_smooth_normals_and_light_maps_with_a_bounce(prep: Path, made: Path, tmp_path: Path) -> None:
    out = tmp_path / "conditions"
    options = dataclasses.replace(SMALL, views=1, env=("studio",), maps=False, profile="sd")
    conditions(prep, out, options)
    provenance, files = read_manifest(out, CONDITIONS)
    assert provenance.extra["profile"] == "sd"
    assert {"view_000/sd/geometry.exr", "view_000/sd/studio.exr", "view_000/studio.exr"} <= set(files)
    geometry, smooth = read_geometry(out, 0), read_geometry(out, 0, "sd")
    assert np.array_equal(geometry.mask, smooth.mask) and np.array_equal(geometry.depth, smooth.depth)
    maps = read_light_maps(out, 0, "studio", geometry.mask, "sd").float()
    scene = scenes.box_in_corner().shaded_smooth()
    cameras = load_npz(out / "cameras.npz", CAMERAS)
    points = trace_view(scene, cameras["c2w"][0], float(cameras["fov_y"][0]), 24, 24)
    assert smooth.normal[smooth.mask] == pytest.approx(points.n @ cameras["c2w"][0][:3, :3], abs=1e-5)
    expected = blender_light_maps(scene, points, [BUILTIN["studio"]()], QUALITY["draft"], 0)[0]
    torch.testing.assert_close(maps, expected, rtol=5e-3, atol=1e-3)


def test_manifest_names_what_it_was_made_from(made: Path) -> None:
    provenance, files = read_manifest(made, CONDITIONS)
    assert provenance.extra["environments"] == ["clear_sky", "studio"]
    assert {"prep"} <= set(provenance.inputs)
    assert "environments/studio.exr" in files
    assert (made / "sheet.png").stat().st_size > 1000


def test_again_is_up_to_date_and_force_redoes(prep: Path, made: Path) -> None:
    before = fingerprint(made)
    assert conditions(prep, made, SMALL).up_to_date
    again = conditions(prep, made, SMALL, force=True)
    assert (again.up_to_date, again.made) == (False, 3)
    assert fingerprint(made) == before


class Stop(Exception):
    """Stands for a kill."""


@pytest.mark.parametrize("after", (0, 1, 2))
def test_interrupted_run_continues_to_the_same_bytes(prep: Path, made: Path, tmp_path: Path, after: int) -> None:
    def stop(what: str, done: int, total: int) -> None:
        if done > after:
            raise Stop

    out = tmp_path / "conditions"
    with pytest.raises(Stop):
        conditions(prep, out, SMALL, progress=stop)
    with pytest.raises(ArtifactError):
        read_manifest(out, CONDITIONS)
    result = conditions(prep, out, SMALL)
    assert (result.made, result.found) == (2 - after, after + 1)
    assert fingerprint(out) == fingerprint(made)


def test_interrupted_run_with_the_profile_sd_continues_to_the_same_bytes(prep: Path, tmp_path: Path) -> None:
    """Also where a view lacks its light maps alone."""

    def stop(what: str, done: int, total: int) -> None:
        if done > 0:
            raise Stop

    options = dataclasses.replace(SMALL, views=2, env=("studio",), maps=False, profile="sd")
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    conditions(prep, whole, options)
    with pytest.raises(Stop):
        conditions(prep, stopped, options, progress=stop)
    lost = sorted(stopped.glob("view_*/sd/studio.exr"))
    assert lost
    lost[0].unlink()
    assert conditions(prep, stopped, options).made == 2
    assert fingerprint(stopped) == fingerprint(whole)


def test_other_options_start_afresh(prep: Path, tmp_path: Path) -> None:
    out = tmp_path / "conditions"
    conditions(prep, out, dataclasses.replace(SMALL, views=4))
    result = conditions(prep, out, SMALL)
    assert (result.made, result.found) == (3, 0)
    assert not (out / "view_003").exists()


def test_own_light_is_used_clamped_and_saved(prep: Path, tmp_path: Path) -> None:
    pixels = np.ones((16, 32, 3), np.float32)
    pixels[2, 3] = -1
    write_exr(tmp_path / "hall.exr", {c: pixels[..., i] for i, c in enumerate("RGB")})
    options = dataclasses.replace(SMALL, views=1, env=(str(tmp_path / "hall.exr"), "night"), maps=False)
    result = conditions(prep, tmp_path / "out", options)
    assert result.clamped == {"hall": 1, "night": 0}
    saved = read_exr(tmp_path / "out" / "environments" / "hall.exr").channels
    assert saved["R"][2, 3] == 0
    assert saved["G"][0, 0] == 1


def test_clashing_names_are_refused(prep: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="taken by another"):
        conditions(prep, tmp_path / "out", dataclasses.replace(SMALL, env=("night", "night")))


def test_foreign_and_damaged_prep(tmp_path: Path, made: Path) -> None:
    (tmp_path / "noise.npz").write_bytes(b"noise")
    for path in (tmp_path / "noise.npz", tmp_path / "none.npz", made / "cameras.npz"):
        with pytest.raises(ArtifactError, match=path.name):
            conditions(path, tmp_path / "out", SMALL)
    assert not (tmp_path / "out").exists()


def test_output_that_cannot_be_a_folder(prep: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="expected a folder"):
        conditions(prep, tmp_path / "file", SMALL)


def test_transports_that_are_not_finite_are_told_by_view_and_pixel_and_very_large_ones_pass() -> None:
    large = torch.full((40, 9, 3), 3e38)  # the sum of which is infinite
    check_finite(Transport(torch.zeros(40, 3), large, large, torch.ones(40)), "sun", 2, 7)
    broken = torch.zeros(40, 9, 3)
    broken[13, 4, 1] = torch.nan
    with pytest.raises(NumericalError, match="B is not finite: environment sun, view 2, pixel 13 of the object, seed 7"):
        check_finite(Transport(torch.zeros(40, 3), large, broken, torch.ones(40)), "sun", 2, 7)
