"""An asset beside other renderers: what they draw is laid over preview.png, and what cannot be compared is said."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from dreammat_cli.main import cli
from stages.core.artifact import Provenance, write_json, write_manifest
from stages.core.color import srgb_encode
from stages.core.errors import ArtifactError, InputError
from stages.core.images import write_png
from stages.core.schemas import ASSET
from stages.light.environment import Environment, directions_of_texels
from stages.report import preview, three
from stages.report.options import PreviewReportOptions
from stages.report.preview import VIEWS, report_preview
from tests.asset.examples import save_asset

SIZE, EXPOSURE = 24, 0.8


def disc() -> np.ndarray:
    """Alpha of a round thing that fills half of the picture's width, (S, S, 1)."""
    y, x = (np.indices((SIZE, SIZE)) + 0.5) / SIZE - 0.5
    return (x * x + y * y < 0.25**2).astype("f4")[..., None]


def radiance(view: int) -> np.ndarray:
    """What is seen of the disc in a view: another grey in each, (S, S, 4) premultiplied."""
    return np.concatenate([np.full((SIZE, SIZE, 3), 0.2 + 0.05 * view, "f4") * disc(), disc()], -1)


def pictured(folder: Path, source: str = "thing.obj") -> Path:
    """An asset whose preview.png shows the disc in eight views, over its backdrop."""
    save_asset(folder)
    ends = {"top": 0.3, "bottom": 0.1}
    backdrop = np.linspace(ends["top"], ends["bottom"], SIZE)[:, None, None]
    cells = [radiance(view)[..., :3] * EXPOSURE + (1 - disc()) * backdrop for view in range(8)]
    rows = [np.concatenate(cells[first : first + 4], 1) for first in (0, 4)]
    write_png(folder / "preview.png", srgb_encode(np.concatenate(rows, 0)))
    views = [{"c2w": (np.eye(4) * (1 + k)).tolist(), "column": k % 4, "row": k // 4} for k in range(8)]
    write_json(folder / "preview.json", {"size": SIZE, "fov_y": 0.5, "exposure": EXPOSURE, "background": ends, "views": views})
    (folder / "preview_light.exr").write_bytes(b"light")
    files = [path.name for path in folder.iterdir() if path.name != ASSET.manifest]
    write_manifest(folder, ASSET, Provenance({}, 5, {"prep": "0" * 64}, {"source_name": source}), files)
    return folder


def drawn(factor: float):  # type: ignore[no-untyped-def]
    """A renderer that sees the very disc, so many times as bright."""

    def drawing(given: str, asset: Path, views: list[dict], studio: dict) -> list[np.ndarray]:
        chosen = [round(view["c2w"][0][0]) - 1 for view in views]
        assert given and chosen == list(VIEWS)
        return [radiance(view) * (factor, factor, factor, 1) for view in chosen]

    return drawing


def test_the_same_picture_and_a_brighter_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One renderer sees the same, to the rounding of a PNG; the other's error is that of its brightness, over the object."""
    monkeypatch.setattr(preview, "in_blender", drawn(1.0))
    monkeypatch.setattr(three, "draw", drawn(1.1))
    both = PreviewReportOptions(cycles="python", three="modules")
    rows = report_preview([pictured(tmp_path / "asset")], tmp_path / "out", both)
    said = [(row.asset, row.renderer, row.view) for row in rows]
    assert said == [("thing", renderer, view) for renderer in ("cycles", "three") for view in VIEWS]
    assert min(row.psnr for row in rows[:3]) > -20 * np.log10(0.5 / 255)
    for row in rows[3:]:
        linear = (0.2 + 0.05 * row.view) * EXPOSURE
        off = srgb_encode(np.float64(linear * 1.1)) - srgb_encode(np.float64(linear))
        assert row.psnr == pytest.approx(-20 * np.log10(off), abs=0.8)  # a byte of the PNG is 0.8 dB of so small a difference
    lines = (tmp_path / "out" / "preview.csv").read_text().splitlines()
    assert lines[0] == "asset,renderer,view,psnr_db" and len(lines) == 7
    for renderer in ("cycles", "three"):
        assert (tmp_path / "out" / f"preview_thing_{renderer}.png").is_file()


@pytest.mark.parametrize("bounces", (0, 3))
def test_blender_is_asked_for_as_many_bounces_as_the_picture_has(
    bounces: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A picture of an earlier day, which says nothing of them, has none."""
    asked = []

    def run(command: list[str], **_: object) -> None:
        folder = Path(command[-1])
        asked.append(json.loads((folder / "job.json").read_text()))
        np.save(folder / "0.npy", radiance(0))

    monkeypatch.setattr(preview.subprocess, "run", run)
    studio = {"size": SIZE, "fov_y": 0.5, **({"bounces": bounces} if bounces else {})}
    preview.in_blender("python", tmp_path, [{"c2w": np.eye(4).tolist()}], studio)
    assert [job["bounces"] for job in asked] == [bounces]


def test_two_assets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(preview, "in_blender", drawn(1.0))
    assets = [pictured(tmp_path / "a", "urn.obj"), pictured(tmp_path / "b", "egg.obj")]
    rows = report_preview(assets, tmp_path / "out", PreviewReportOptions(cycles="python"))
    assert [row.asset for row in rows] == ["urn"] * 3 + ["egg"] * 3
    with pytest.raises(InputError, match="two assets of one name"):
        report_preview(assets[:1] * 2, tmp_path / "out", PreviewReportOptions(cycles="python"))


def test_a_sun_becomes_lamps_that_bring_the_light_that_they_take() -> None:
    """three.js looks a direction (x, y, z) up at column W (0.5 + atan2(z, x) / 2 pi), row H (0.5 - asin(y) / pi)."""
    radiance = np.full((32, 64, 3), 0.5, np.float32)
    sun = {(9, 50): (600.0, 500.0, 300.0), (20, 3): (200.0, 200.0, 250.0)}
    for texel, colour in sun.items():
        radiance[texel] = colour
    rest, lamps = three.divided(Environment("sunny", radiance))
    found = {
        (int(32 * (0.5 - np.arcsin(y) / np.pi)), int(64 * (0.5 + np.arctan2(z, x) / (2 * np.pi)))): irradiance
        for (x, y, z), irradiance in lamps
    }
    assert found.keys() == sun.keys()
    solid_angle = directions_of_texels(32, 64)[1]
    for (row, column), irradiance in found.items():
        left = rest.radiance[row, column]
        assert left.mean() < 30 and irradiance == pytest.approx((radiance[row, column] - left) * solid_angle[row], rel=1e-5)
    assert (np.delete(rest.radiance.reshape(-1, 3), [9 * 64 + 50, 20 * 64 + 3], 0) == 0.5).all()


def test_an_even_sky_has_no_lamps() -> None:
    light = Environment("grey", np.full((8, 16, 3), 0.7, np.float32))
    rest, lamps = three.divided(light)
    assert not lamps and (rest.radiance == light.radiance).all()


def test_what_cannot_be_compared_is_said_in_one_line(tmp_path: Path) -> None:
    asset = pictured(tmp_path / "asset")
    result = CliRunner().invoke(cli, ["report", "preview", str(asset), "-o", str(tmp_path / "out")], standalone_mode=False)
    assert isinstance(result.exception, InputError) and "--cycles" in str(result.exception)
    with pytest.raises(InputError, match=r"bpy, 4\.2 or newer"):
        report_preview([asset], tmp_path / "out", PreviewReportOptions(cycles=str(shutil.which("false"))))
    with pytest.raises(InputError, match="has no three"):
        report_preview([asset], tmp_path / "out", PreviewReportOptions(three=str(tmp_path)))
    (asset / "preview.png").write_bytes(b"another")
    with pytest.raises(ArtifactError, match=r"preview\.png: damaged"):
        report_preview([asset], tmp_path / "out", PreviewReportOptions(cycles="python"))
