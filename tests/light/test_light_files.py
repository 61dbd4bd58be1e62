"""Lights that other programs wrote: turned, decoded, padded, converted, or refused with a word, never wrong in silence."""

from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

from stages.core.color import REC709, rgb_to_xyz, to_rec709
from stages.core.errors import InputError
from stages.light.environment import load_environment
from tests.light import light_files as files

AP0 = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)
P3 = (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329)


@pytest.fixture
def pixels() -> NDArray[np.float32]:
    """A picture without symmetry, with runs long and short: (8, 16, 3)."""
    picture = np.random.default_rng(3).uniform(0.2, 2.0, (8, 16, 3)).astype(np.float32)
    picture[2, 3:12], picture[5] = (0.5, 4.0, 0.25), (1.0, 0.5, 2.0)
    return picture


@pytest.fixture
def texels(pixels: NDArray[np.float32]) -> NDArray[np.uint8]:
    return files.rgbe(pixels)


def radiance(path: Path) -> NDArray[np.float32]:
    return load_environment(path)[0].radiance


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as error:
        load_environment(path)
    message = str(error.value)
    assert message.startswith(f"{path}: ")
    assert len(message.splitlines()) == 1
    return message


# ---------------------------------------------------------------------------------------------------- Radiance


@pytest.mark.parametrize("line", (files.flat, files.old_runs, files.new_runs), ids=lambda line: line.__name__)
@pytest.mark.parametrize("axes", files.AXES)
def test_every_orientation_and_encoding(tmp_path: Path, texels: NDArray, axes: str, line) -> None:  # type: ignore[no-untyped-def]
    found = radiance(files.write_hdr(tmp_path / "sky.hdr", texels, axes, line))
    np.testing.assert_array_equal(found, files.decoded(texels))


def test_old_runs_longer_than_a_byte(tmp_path: Path) -> None:
    texels = np.full((300, 600, 4), 130, np.uint8)
    texels[:, -1] = 140
    path = files.write_hdr(tmp_path / "sky.hdr", texels, line=files.old_runs)
    assert path.stat().st_size < 300 * 20
    np.testing.assert_array_equal(radiance(path), files.decoded(texels))


def test_exposure_and_colour_correction_are_undone(tmp_path: Path, texels: NDArray) -> None:
    header = "EXPOSURE=2\nEXPOSURE= 0.25\nCOLORCORR=1 2 4\nPIXASPECT=1\nVIEW=-vtv -vp 0 0 0\nPRIMARIES=0 0 0 0 0 0 0 0\n"
    found = radiance(files.write_hdr(tmp_path / "sky.hdr", texels, header=header))
    np.testing.assert_allclose(found, files.decoded(texels) / 0.5 / (1, 2, 4), rtol=1e-6)


def test_lines_may_end_as_on_windows(tmp_path: Path, texels: NDArray) -> None:
    path = files.write_hdr(tmp_path / "sky.hdr", texels)
    head, body = path.read_bytes().split(b"+X 16\n")
    path.write_bytes((head + b"+X 16\n").replace(b"\n", b"\r\n") + body)
    np.testing.assert_array_equal(radiance(path), files.decoded(texels))


def test_xyze_becomes_rec709(tmp_path: Path, pixels: NDArray) -> None:
    texels = files.rgbe(pixels @ rgb_to_xyz(REC709).T)
    path = files.write_hdr(tmp_path / "sky.hdr", texels)
    path.write_bytes(path.read_bytes().replace(b"rgbe", b"xyze"))
    assert radiance(path) == pytest.approx(pixels, abs=0.05)  # an exponent is shared by X, Y and Z


def test_primaries_become_rec709(tmp_path: Path, texels: NDArray) -> None:
    header = f"PRIMARIES={' '.join(map(str, P3))}\n"
    found = radiance(files.write_hdr(tmp_path / "sky.hdr", texels, header=header))
    expected = files.decoded(texels) @ to_rec709(P3).T
    np.testing.assert_allclose(found, expected.clip(0), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize(
    ("header", "finding"),
    [
        ("PIXASPECT=0.5\n", "PIXASPECT=0.5, expected square pixels"),
        ("GAMMA=2.2\n", "GAMMA=2.2, expected linear"),
        ("EXPOSURE=0\n", "exposure of 0, expected more"),
        ("EXPOSURE=bright\n", "EXPOSURE=bright, expected a number;"),
        ("COLORCORR=1 2\n", "COLORCORR=1 2, expected 3 numbers;"),
        ("PRIMARIES=.3 .3 .3 .3 .3 .3 .3 .3\n", "lie on one line"),
        ("FORMAT=16-bit_float\n", "FORMAT=16-bit_float, expected one of"),
    ],
)
def test_refuses_what_the_header_makes_of_it(tmp_path: Path, texels: NDArray, header: str, finding: str) -> None:
    assert finding in refusal(files.write_hdr(tmp_path / "sky.hdr", texels, header=header))


@pytest.mark.parametrize("line", (files.flat, files.old_runs, files.new_runs), ids=lambda line: line.__name__)
def test_refuses_a_cut_or_damaged_radiance_file(tmp_path: Path, texels: NDArray, line) -> None:  # type: ignore[no-untyped-def]
    whole = files.write_hdr(tmp_path / "sky.hdr", texels, line=line).read_bytes()
    begin = whole.index(b"+X 16\n") + 6
    for end in (5, 20, begin - 8, begin, begin + 3, begin + 40, len(whole) - 1):
        (tmp_path / "cut.hdr").write_bytes(whole[:end])
        refusal(tmp_path / "cut.hdr")
    for name, there in (("run.hdr", b"\x02\x02\0\x10\xff"), ("first.hdr", b"\1\1\1\5"), ("none.hdr", b"\x02\x02\0\x10\0")):
        (tmp_path / name).write_bytes(whole[:begin] + there + whole[begin + len(there) :])
        assert "line 1 of 8" in refusal(tmp_path / name)


def test_refuses_pixels_that_no_file_of_its_size_can_hold(tmp_path: Path, texels: NDArray) -> None:
    path = files.write_hdr(tmp_path / "sky.hdr", texels)
    path.write_bytes(path.read_bytes().replace(b"-Y 8 +X 16", b"-Y 99999 +X 199998"))
    assert "announces 19999600002 pixels" in refusal(path)


# ---------------------------------------------------------------------------------------------------- EXR


def test_what_the_data_window_leaves_out_is_black(tmp_path: Path, pixels: NDArray) -> None:
    whole = np.zeros((10, 20, 3), np.float32)
    whole[1:9, 3:19] = pixels
    windows = {"dataWindow": files.window(8, 3, 24, 11), "displayWindow": files.window(5, 2, 25, 12)}
    np.testing.assert_array_equal(radiance(files.write_exr(tmp_path / "sky.exr", files.rgb(pixels), **windows)), whole)


def test_what_reaches_beyond_the_display_window_is_cut_off(tmp_path: Path, pixels: NDArray) -> None:
    windows = {"dataWindow": files.window(-3, -1, 13, 7), "displayWindow": files.window(0, 0, 10, 5)}
    found = radiance(files.write_exr(tmp_path / "sky.exr", files.rgb(pixels), **windows))
    np.testing.assert_array_equal(found, pixels[1:6, 3:13])


@pytest.mark.parametrize("left", (-40, 40))
def test_a_data_window_outside_of_the_display_window_is_black(tmp_path: Path, pixels: NDArray, left: int) -> None:
    windows = {"dataWindow": files.window(left, left, left + 16, left + 8), "displayWindow": files.window(0, 0, 10, 5)}
    assert "black everywhere" in refusal(files.write_exr(tmp_path / "sky.exr", files.rgb(pixels), **windows))


@pytest.mark.parametrize("space", (AP0, P3), ids=("AP0", "P3"))
def test_chromaticities_become_rec709(tmp_path: Path, pixels: NDArray, space: tuple[float, ...]) -> None:
    """Colours of Rec. 709 come back; neutral stays neutral."""
    pixels[0, :4] = 0.75
    stored = (pixels @ np.linalg.inv(to_rec709(space)).T).astype(np.float32)
    light, mended = load_environment(files.write_exr(tmp_path / "sky.exr", files.rgb(stored), chromaticities=space))
    assert mended == 0
    np.testing.assert_allclose(light.radiance, pixels, atol=1e-5)
    np.testing.assert_allclose(stored[0, :4], 0.75, atol=1e-5)
    assert np.abs(stored - pixels).max() > 0.05


def test_the_matrix_of_ap0_is_the_published_one() -> None:
    """Academy TB-2014-004's primaries, adapted by Bradford, as colour-science and OpenColorIO give it."""
    published = [[2.521686, -1.134131, -0.387555], [-0.276480, 1.372719, -0.096239], [-0.015378, -0.152975, 1.168353]]
    np.testing.assert_allclose(to_rec709(AP0), published, atol=2e-6)


def test_colours_outside_rec709_are_counted(tmp_path: Path, pixels: NDArray) -> None:
    pixels[:] = 1.0
    pixels[4, 4] = (0, 2, 0)
    light, mended = load_environment(files.write_exr(tmp_path / "sky.exr", files.rgb(pixels), chromaticities=P3))
    assert mended == 1
    assert light.radiance[4, 4].tolist() == pytest.approx((0, 2 * to_rec709(P3)[1, 1], 0), abs=1e-5)


def test_a_named_colour_space_counts_where_there_are_no_chromaticities(tmp_path: Path, pixels: NDArray) -> None:
    found = radiance(files.write_exr(tmp_path / "sky.exr", files.rgb(pixels), colorInteropID="lin_ap1_scene"))
    assert np.abs(found - pixels).max() > 0.05
    path = files.write_exr(tmp_path / "srgb.exr", files.rgb(pixels), colorInteropID="srgb_rec709_scene")
    assert "'srgb_rec709_scene', expected linear" in refusal(path)


def test_the_part_in_colour_is_the_light(tmp_path: Path, pixels: NDArray) -> None:
    depth, colour = {"Z": pixels[..., 0].copy()}, {**files.rgb(pixels), "A": np.ones((8, 16), np.float32)}
    np.testing.assert_array_equal(radiance(files.write_exr(tmp_path / "sky.exr", depth, colour)), pixels)
    luminous = {"Y": pixels[..., 0].copy()}
    np.testing.assert_array_equal(radiance(files.write_exr(tmp_path / "sky2.exr", luminous, files.rgb(pixels))), pixels)


@pytest.mark.parametrize("main", ("", "ViewLayer.Combined.", "beauty."))
def test_the_main_layer_is_the_light(tmp_path: Path, pixels: NDArray, main: str) -> None:
    layers = {**files.rgb(0 * pixels + 9, "A.first."), **files.rgb(pixels, main), **files.rgb(0 * pixels + 9, "z.last.")}
    np.testing.assert_array_equal(radiance(files.write_exr(tmp_path / "sky.exr", layers)), pixels)


def test_a_single_layer_of_any_name_is_the_light(tmp_path: Path, pixels: NDArray) -> None:
    np.testing.assert_array_equal(radiance(files.write_exr(tmp_path / "sky.exr", files.rgb(pixels, "dome."))), pixels)


def test_luminance_alone_is_grey(tmp_path: Path, pixels: NDArray) -> None:
    found = radiance(files.write_exr(tmp_path / "sky.exr", {"Y": pixels[..., 1].copy()}))
    np.testing.assert_array_equal(found, pixels[..., [1, 1, 1]])


@pytest.mark.parametrize("compression", ("NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A", "DWAA", "DWAB"))
def test_every_compression(tmp_path: Path, pixels: NDArray, compression: str) -> None:
    how = getattr(OpenEXR, f"{compression}_COMPRESSION")
    found = radiance(files.write_exr(tmp_path / "sky.exr", files.rgb(pixels), compression=how))
    assert found == pytest.approx(pixels, abs=0.04 if "DWA" in compression else 1e-4)  # DWA drops what is hardly seen


def test_tiles_mipmaps_and_lines_from_below(tmp_path: Path, pixels: NDArray) -> None:
    tiles = OpenEXR.TileDescription()
    tiles.xSize, tiles.ySize = 5, 3
    header = {"type": OpenEXR.tiledimage, "tiles": tiles}
    np.testing.assert_array_equal(radiance(files.write_exr(tmp_path / "tiled.exr", files.rgb(pixels), **header)), pixels)
    below = files.write_exr(tmp_path / "below.exr", files.rgb(pixels), lineOrder=OpenEXR.DECREASING_Y)
    np.testing.assert_array_equal(radiance(below), pixels)
    oiio = pytest.importorskip("OpenImageIO")
    assert oiio.ImageBufAlgo.make_texture(oiio.MakeTxTexture, oiio.ImageBuf(pixels), str(tmp_path / "mipmap.exr"))
    np.testing.assert_array_equal(radiance(tmp_path / "mipmap.exr"), pixels)


def test_refuses_what_it_cannot_read_right(tmp_path: Path, pixels: NDArray) -> None:
    half = pixels[::2, ::2, 0].copy()
    chroma = {"Y": (pixels[..., 0].copy(), 1), "RY": (half, 2), "BY": (half, 2)}
    assert "subsampled" in refusal(files.write_sampled(tmp_path / "chroma.exr", chroma))
    full = {name: pixels[..., 0].copy() for name in ("Y", "RY", "BY")}
    assert "R, G and B" in refusal(files.write_exr(tmp_path / "chroma_full.exr", full))
    assert "R, G and B" in refusal(files.write_exr(tmp_path / "depth.exr", {"Z": pixels[..., 0].copy()}))
    whole = {c: (100 * pixels[..., i]).astype(np.uint32) for i, c in enumerate("RGB")}
    assert "half or float" in refusal(files.write_exr(tmp_path / "whole.exr", whole))
    two = {**files.rgb(pixels, "left."), **files.rgb(pixels, "right.")}
    assert "left, right" in refusal(files.write_exr(tmp_path / "two.exr", two))
    wide = files.write_exr(tmp_path / "wide.exr", files.rgb(pixels), pixelAspectRatio=2.0)
    assert "2 times as wide" in refusal(wide)
    cube = files.write_exr(tmp_path / "cube.exr", files.rgb(pixels), envmap=OpenEXR.ENVMAP_CUBE)
    assert "cube faces" in refusal(cube)
    point = files.write_exr(tmp_path / "point.exr", files.rgb(pixels), chromaticities=(0.3,) * 8)
    assert "lie on one line" in refusal(point)


def test_an_uncompressed_file_made_byte_by_byte_is_read(tmp_path: Path, pixels: NDArray) -> None:
    channels = {name: (values, 1) for name, values in files.rgb(pixels).items()}
    np.testing.assert_array_equal(radiance(files.write_sampled(tmp_path / "sky.exr", channels)), pixels)


def test_refuses_a_display_window_of_gigabytes(tmp_path: Path, pixels: NDArray) -> None:
    windows = {"dataWindow": files.window(0, 0, 16, 8), "displayWindow": files.window(0, 0, 200_000, 100_000)}
    assert "200000 x 100000" in refusal(files.write_exr(tmp_path / "sky.exr", files.rgb(pixels), **windows))
