"""Environment files and their checks; look-up at seam, poles and under rotation; the octahedral map; the split."""

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from stages.core.artifact import write_exr
from stages.core.errors import InputError
from stages.light import environment as env
from stages.light.lights import BUILTIN, preview_light


def write_rgb(path: Path, pixels: np.ndarray) -> Path:
    """A float picture, .hdr or .exr by the suffix."""
    pixels = pixels.astype(np.float32)
    if path.suffix == ".exr":
        write_exr(path, {c: pixels[..., i] for i, c in enumerate("RGB")})
        return path
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "float"))
    assert output.write_image(pixels)
    output.close()
    return path


def gradient(rows: int = 16) -> np.ndarray:
    generator = np.random.default_rng(0)
    return generator.uniform(0.1, 2.0, (rows, 2 * rows, 3)).astype(np.float32)


@pytest.mark.parametrize("suffix", (".hdr", ".exr"))
@pytest.mark.parametrize("rows", (2, 7, 64))
def test_reads_any_two_to_one_size(tmp_path: Path, suffix: str, rows: int) -> None:
    pixels = gradient(rows)
    light, mended = env.load_environment(write_rgb(tmp_path / f"sky{suffix}", pixels))
    assert (light.name, mended, light.radiance.shape) == ("sky", 0, pixels.shape)
    assert light.radiance == pytest.approx(pixels, abs=float(pixels.max()) / 200)  # RGBE shares an exponent


def test_mends_and_counts_single_bad_pixels(tmp_path: Path) -> None:
    pixels = gradient(32)
    pixels[0, 0, 1], pixels[3, 3, 0], pixels[5, 5, 2] = np.nan, np.inf, -1.0
    light, mended = env.load_environment(write_rgb(tmp_path / "bad.exr", pixels))
    assert mended == 3
    assert (light.radiance[0, 0, 1], light.radiance[5, 5, 2]) == (0, 0)
    assert light.radiance[3, 3, 0] == np.nanmax(pixels[np.isfinite(pixels)])


@pytest.mark.parametrize(
    ("pixels", "finding"),
    [
        (np.ones((16, 16, 3)), "16 x 16 pixels, expected width = 2 x height"),
        (np.full((8, 16, 3), np.nan), "infinite or not a number"),
        (np.full((8, 16, 3), -1.0), "negative"),
        (np.zeros((8, 16, 3)), "black everywhere"),
    ],
)
def test_refuses_what_is_no_light(tmp_path: Path, pixels: np.ndarray, finding: str) -> None:
    with pytest.raises(InputError, match=finding):
        env.load_environment(write_rgb(tmp_path / "light.exr", pixels))


def test_refuses_other_files(tmp_path: Path) -> None:
    (tmp_path / "noise.hdr").write_bytes(b"#?RADIANCE\nnot really")
    (tmp_path / "noise.exr").write_bytes(b"v/1\x01 and nothing more")
    (tmp_path / "sky.jpg").write_bytes(b"")
    for name in ("noise.hdr", "noise.exr", "sky.jpg", "missing.hdr"):
        with pytest.raises(InputError, match=name):
            env.load_environment(tmp_path / name)


def test_lookup_at_texel_centres_seam_and_poles() -> None:
    pixels = gradient()
    directions, _ = env.directions_of_texels(*pixels.shape[:2])
    assert env.lookup(pixels, directions.reshape(-1, 3)).reshape(pixels.shape) == pytest.approx(pixels, abs=1e-6)
    seam = np.array([[-1.0, 1e-12, 0.0], [-1.0, -1e-12, 0.0]])
    assert env.lookup(pixels, seam)[0] == pytest.approx(env.lookup(pixels, seam)[1], abs=1e-6)
    beyond = np.array([[0.0, 0.0, 1.0 + 1e-7], [0.0, 0.0, -1.0 - 1e-7]])
    assert np.isfinite(env.lookup(pixels, beyond)).all()


def test_rolling_the_picture_turns_the_light_about_z() -> None:
    pixels = gradient()
    directions = np.random.default_rng(1).normal(size=(50, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    quarter = np.roll(pixels, pixels.shape[1] // 4, 1)  # u grows as azimuth falls
    turned = np.stack([directions[:, 1], -directions[:, 0], directions[:, 2]], -1)
    assert env.lookup(quarter, turned) == pytest.approx(env.lookup(pixels, directions), abs=1e-6)


def test_own_lights_are_hdr_and_differ() -> None:
    lights = [make() for make in BUILTIN.values()] + [preview_light()]
    assert len({light.name for light in lights}) == 6
    means = []
    for light in lights:
        assert light.radiance.shape == (256, 512, 3)
        assert np.isfinite(light.radiance).all()
        assert light.radiance.min() >= 0
        assert light.radiance.any()
        means.append(light.radiance.mean((0, 1)))
    assert BUILTIN["clear_sky"]().radiance.max() > 1000  # a sun
    assert BUILTIN["night"]().radiance.max() > 100 * np.median(BUILTIN["night"]().radiance)
    small = [np.log1p(light.radiance[::8, ::8]).ravel() for light in lights]
    closest = max(abs(np.corrcoef(small)[i, j]) for i in range(6) for j in range(i))
    assert closest < 0.9


def test_real_lights_load(assets: Path) -> None:
    counts = {path.stem: env.load_environment(path)[1] for path in sorted((assets / "hdr").iterdir())}
    assert counts.pop("spruit_sunrise_1k") > 0
    assert set(counts.values()) == {0}
