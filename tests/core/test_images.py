"""Pictures as files."""

from pathlib import Path

import numpy as np
import pytest

from stages.core.images import MATCHES, RUNS, read_image, write_png


@pytest.mark.parametrize("strategy", [MATCHES, RUNS])
@pytest.mark.parametrize("shape", [(40, 30), (40, 30, 3), (40, 30, 4), (1, 1, 3)])
def test_pixels_come_back_as_they_were(tmp_path: Path, shape: tuple[int, ...], strategy: str) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, shape, np.uint8)
    write_png(tmp_path / "a.png", pixels, strategy)
    found = np.round(read_image(tmp_path / "a.png") * 255).astype(np.uint8)
    np.testing.assert_array_equal(found.reshape(shape), pixels)


def test_grain_takes_no_more_bytes_where_runs_are_looked_for(tmp_path: Path) -> None:
    """Grain over a gradient, as textures are: nothing in it was there before."""
    rng, down = np.random.default_rng(0), np.linspace(60, 180, 256)[:, None, None]
    grain = (down + rng.normal(0, 6, (256, 256, 3))).astype(np.uint8)
    for strategy in (MATCHES, RUNS):
        write_png(tmp_path / f"{strategy}.png", grain, strategy)
    assert (tmp_path / f"{RUNS}.png").stat().st_size < (tmp_path / f"{MATCHES}.png").stat().st_size
