"""report.html: what is packed comes out again, the page needs nothing else, and Chromium draws it."""

import base64
import json
import re
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from stages.asset.read_glb import read_model
from stages.asset.report_mesh import PageMesh, octahedral, page_mesh, simplified
from stages.asset.report_page import Check, Page, PageView, Shot, fill, write_page
from stages.asset.report_view import PageLight, packed, shared_exponent, white_albedos
from stages.core.color import srgb_encode
from stages.light.lights import preview_light
from stages.light.prefilter import cosine_harmonics, mip_levels, split_lamp
from tests.asset.browser import canvas, chromium, messages, open_page, requests, set_input, wait_for
from tests.asset.examples import MAPS, save_asset


def small_light() -> PageLight:
    radiance = preview_light().radiance.reshape(64, 4, 128, 4, 3).mean((1, 3))
    rest, lamp = split_lamp(radiance)
    return PageLight(mip_levels(rest), cosine_harmonics(rest), lamp.towards, lamp.power, lamp.spread, 0.8)


def small_page() -> Page:
    return Page(
        name="a <thing>", prompt='gold & "rust" </script>{{data}}', meta="one.obj",
        checks=[Check("Padding", "6 texels", "good", "between"), Check("Unseen", "70 %", "look", "of it")],
        shots=[Shot("Dusk", np.full((8, 8, 3), 0.5, np.float32))], facts={"Seed": "5"}, licences=["Apache-2.0."],
        light=small_light(), view=PageView(20.0, 15.0, np.radians(30), 2.6, (0.1, 0.3)),
    )  # fmt: skip


def save_report(folder: Path, maps: tuple[str, ...] = ("albedo", "orm"), **how: object) -> Path:
    asset = save_asset(folder / "asset", maps, **how)  # type: ignore[arg-type]
    write_page(asset / "report.html", small_page(), ["model.glb", "albedo.png"])
    return asset / "report.html"


def unpacked(streams: list[dict], blob: bytes) -> dict[str, NDArray]:
    """What viewer.js reads, by the same rule."""
    data, at, found = np.frombuffer(zlib.decompress(blob), np.uint8), 0, {}
    for stream in streams:
        size, count = stream["size"], stream["count"]
        columns = []
        for _ in range(stream["columns"]):
            planes = data[at : at + size * count].reshape(size, count)
            values = np.ascontiguousarray(planes.T).view(f"<u{size}")[:, 0]
            columns.append(np.cumsum(values, dtype=values.dtype) if stream["delta"] else values)
            at += size * count
        found[stream["name"]] = np.stack(columns, 1)
    assert at == len(data)
    return found


def sphere() -> PageMesh:
    ball = trimesh.creation.icosphere(5)
    vertices = (ball.vertices / 2).astype("f4")
    uv = np.column_stack([np.arctan2(vertices[:, 1], vertices[:, 0]) / 7 + 0.5, vertices[:, 2] + 0.5]).astype("f4")
    half = (ball.triangles_center[:, 2] > 0).astype(int)  # two islands: the upper half has vertices of its own
    triangles = ball.faces + len(vertices) * half[:, None]
    twice = PageMesh(np.tile(vertices, (2, 1)), np.tile(2 * vertices, (2, 1)), np.concatenate([uv, uv * 0.5]), triangles, half)
    return replace(twice, triangles=twice.triangles[np.argsort(half, kind="stable")], look=np.sort(half))


def test_geometry_and_light_come_out_of_the_block_as_they_went_in() -> None:
    mesh, light = sphere(), small_light()
    found = unpacked(*packed(mesh, light))
    np.testing.assert_array_equal(found["triangles"].reshape(-1, 3), mesh.triangles)
    np.testing.assert_allclose(found["position"] / 65535 - 0.5, mesh.positions, atol=1 / 65535)
    np.testing.assert_allclose(found["uv"] / 65535, mesh.uv, atol=1 / 65535)
    x, y = found["normal"].view(np.int16).T / 32767
    n = np.stack([x, y, 1 - np.abs(x) - np.abs(y)], 1)
    folded = (1 - np.abs(n[:, 1::-1])) * np.where(n[:, :2] < 0, -1, 1)
    n[:, :2] = np.where(n[:, 2:] < 0, folded, n[:, :2])
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    assert ((n * mesh.normals).sum(1) > 1 - 1e-7).all()
    words = found["environment"][: 64 * 128, 0].astype(np.int64)
    mantissa = np.stack([words & 511, words >> 9 & 511, words >> 18 & 511], 1)
    radiance = mantissa * 2.0 ** ((words >> 27) - 24)[:, None]
    level = light.levels[0].reshape(-1, 3)
    assert (np.abs(radiance - level) <= level.max(1, keepdims=True) / 511).all()


def test_shared_exponents_at_the_edges_of_their_range() -> None:
    values = np.array([[0, 0, 0], [1, 1, 1], [511.9, 0, 0], [1e9, 1, 0], [1e-9, 0, 0]], np.float32)
    words = shared_exponent(values).astype(np.int64)
    red = (words & 511) * 2.0 ** ((words >> 27) - 24)
    np.testing.assert_allclose(red, [0, 1, 512, 65408, 0], rtol=1e-6, atol=1e-7)


def test_the_white_albedos_are_in_the_viewers_order() -> None:
    table = white_albedos().reshape(33, 64, 4).astype(float)
    np.testing.assert_allclose(table[0, 32:, :2].sum(-1), 1, atol=5e-3)  # a mirror of F0 = 1
    assert table[-1, -1, 0] < 0.4 < 0.9 < table[0, -1, 0]  # seen from above, rough and smooth
    assert (np.diff(table[0, :, 2]) > -1e-3).all()  # diffuse falls towards grazing


def test_a_large_mesh_is_simplified_without_cracks_or_smears() -> None:
    mesh = sphere()
    few = simplified(mesh, 3000)
    assert 1000 < len(few.triangles) <= 3000
    assert (np.diff(few.look) >= 0).all()
    solid = trimesh.Trimesh(few.positions, few.triangles, process=False)
    solid.merge_vertices(merge_tex=True, merge_norm=True)
    _, uses = np.unique(np.sort(solid.edges, axis=1), axis=0, return_counts=True)
    assert (uses > 1).all()  # an edge that one triangle has alone would be a crack
    assert solid.area == pytest.approx(np.pi, rel=0.03)
    assert (np.abs(np.linalg.norm(few.positions, axis=1) - 0.5) < 0.02).all()
    upper = few.uv[few.triangles[few.look == 1]].reshape(-1, 2)
    assert upper[:, 0].max() <= mesh.uv[len(mesh.uv) // 2 :, 0].max() + 1e-6  # its own half of the texture
    assert simplified(mesh, 10**6) is mesh


def test_octahedral_normals_stay_in_their_range() -> None:
    axes = np.concatenate([np.eye(3), -np.eye(3)]).astype("f4")
    np.testing.assert_array_equal(octahedral(axes)[[0, 3, 1, 4]] / 32767, [[1, 0], [-1, 0], [0, 1], [0, -1]])


def test_the_model_stands_upright_in_unit_size(tmp_path: Path) -> None:
    mesh, count = page_mesh(read_model(save_asset(tmp_path / "asset") / "model.glb"))
    assert count == len(mesh.triangles)
    used = mesh.positions[np.unique(mesh.triangles)]
    np.testing.assert_allclose(used.max(0) + used.min(0), 0, atol=1e-6)
    assert np.ptp(used, axis=0).max() == pytest.approx(1, abs=1e-6)


def test_the_page_says_all_and_asks_nobody(tmp_path: Path) -> None:
    page = save_report(tmp_path, ("albedo", "orm", "normal", "occlusion"), apart=True)
    text = page.read_text()
    assert "gold &amp; &quot;rust&quot; &lt;/script&gt;{{data}}" in text  # escaped, and no place to fill
    assert "a &lt;thing&gt;" in text
    addresses = re.findall(r"""(?:src|href)=["']([^"']{0,8})""", text)
    assert set(addresses) <= {"data:,", "data:ima"}
    assert "default-src 'none'" in text
    assert "http" not in re.sub(r'http-equiv|base64,[^"]*', "", text)
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.S).group(1))  # type: ignore[union-attr]
    blob = base64.b64decode(re.search(r'id="blob">(.*?)</script>', text, re.S).group(1))  # type: ignore[union-attr]
    assert set(unpacked(data["streams"], blob)) == {"position", "normal", "uv", "triangles", "environment", "albedos"}
    assert [group["set"] for group in data["groups"]] == [0, 1]
    assert len(re.findall("data-map=", text)) == 2 * 5
    again = save_report(tmp_path / "again", ("albedo", "orm", "normal", "occlusion"), apart=True)
    assert again.read_bytes() == page.read_bytes()


def test_maps_that_are_absent_are_not_spoken_of(tmp_path: Path) -> None:
    text = save_report(tmp_path).read_text()
    assert 'data-map="normal"' not in text and 'data-map="occlusion"' not in text
    assert "<span>Occlusion</span>" not in text


def test_a_value_that_looks_like_a_place_is_left_alone(tmp_path: Path) -> None:
    fill(tmp_path / "x.html", "<{{a}}|{{b}}>", a="{{b}}", b="}}{{a}}")
    assert (tmp_path / "x.html").read_text() == "<{{b}}|}}{{a}}>"


# ---------------------------------------------------------------------------------------------------- Chromium


def test_chromium_draws_it_from_disk_and_the_light_turns(tmp_path: Path) -> None:
    page = save_report(tmp_path, ("albedo", "orm", "normal", "occlusion"))
    with chromium() as browser:
        open_page(browser, page)
        first = canvas(browser)
        assert np.ptp(first.mean(-1)) > 0.3  # an object before a backdrop, not an empty canvas
        set_input(browser, "#light", "140")
        wait_for(lambda: browser.find_element("id", "degrees").text == "140°")
        turned = canvas(browser)
        changed = np.abs(turned - first).max(-1) > 0.02
        assert changed.mean() > 0.05
        assert not changed[:4].any() and not changed[-4:].any()  # the backdrop stays
        set_input(browser, "#light", "0")
        wait_for(lambda: browser.find_element("id", "degrees").text == "0°")
        np.testing.assert_array_equal(canvas(browser), first)
        seen = {}
        for number in range(7):
            set_input(browser, f"input[name=shown][value='{number}']", None)
            seen[number] = canvas(browser)
        for a in seen:
            assert all(np.abs(seen[a] - seen[b]).mean() > 1e-3 for b in seen if b > a), a
        browser.find_element("id", "view").send_keys("\ue014")  # arrow to the right
        wait_for(lambda: np.abs(canvas(browser) - seen[6]).mean() > 1e-3)
        assert messages(browser) == []
        assert requests(browser) == [page.resolve().as_uri()]


def test_chromium_shows_the_albedo_that_is_in_the_file(tmp_path: Path) -> None:
    """The mean colour of the albedo view over the object is that of the texture: no curve twice, none forgotten."""
    page = save_report(tmp_path)
    with chromium() as browser:
        open_page(browser, page)
        set_input(browser, "input[name=shown][value='1']", None)
        albedo = canvas(browser)
        set_input(browser, "input[name=shown][value='2']", None)
        roughness = canvas(browser)
        assert messages(browser) == []
    on_object = np.abs(albedo - roughness).max(-1) > 0.05
    linear = (MAPS["albedo"] / 255.0) ** 2.2
    wanted = srgb_encode(linear.reshape(-1, 3).mean(0))
    # minified textures are averaged in linear light, magnified ones are near it
    np.testing.assert_allclose((albedo[on_object] ** 2.2).mean(0) ** (1 / 2.2), wanted, atol=0.06)
    assert roughness[on_object].mean() == pytest.approx(MAPS["orm"][..., 1].mean() / 255, abs=0.06)
