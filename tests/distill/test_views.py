"""Views and samples: the points lie where the camera saw them, and what is drawn depends on the generator alone."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from stages.core.artifact import MANIFEST
from stages.core.errors import ArtifactError
from stages.core.frames import project
from stages.core.views import view_folder
from stages.distill.sampling import CropSampler, PixelSampler
from stages.distill.views import Views
from tests.distill.examples import LIGHTS, RADIUS, write_conditions

CPU = torch.device("cpu")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_conditions(tmp_path_factory.mktemp("views") / "conditions")


def generator(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def test_points_lie_on_the_sphere_and_project_back_to_their_pixels(folder: Path) -> None:
    views = Views(folder)
    for view in range(len(views.c2w)):
        pixels = views.pixels(view)
        surface = views.surface(view, np.arange(len(pixels)))
        p = surface.points.double().numpy()
        np.testing.assert_allclose(np.linalg.norm(p, axis=1), RADIUS, atol=2e-6)
        np.testing.assert_allclose(surface.normals.numpy(), p / RADIUS, atol=2e-3)  # normals are kept in half precision
        xy, depth = project(p, views.c2w[view], views.fov_y[view], views.width, views.height)
        np.testing.assert_allclose(xy, np.stack([pixels % views.width, pixels // views.width], -1) + 0.5, atol=1e-4)
        np.testing.assert_allclose(depth, surface.depth.numpy(), atol=1e-5)


def test_pixel_size_is_that_of_the_camera(folder: Path) -> None:
    views = Views(folder)
    assert views.pixel_size() == pytest.approx(2 * np.tan(np.radians(17.5)) * 2.0 / 24, rel=0.1)


def test_small_cache_gives_the_same_as_a_large_one(folder: Path) -> None:
    small, large = Views(folder, cache_bytes=1), Views(folder)
    for seed in range(12):
        a, b = (CropSampler(views, 16, 2, CPU).draw(generator(seed)) for views in (small, large))
        assert torch.equal(a.points, b.points) and torch.equal(a.transport.A, b.transport.A) and a.source == b.source


def test_prefetch_changes_nothing(folder: Path) -> None:
    with_it, without = (CropSampler(Views(folder), 16, 2, CPU) for _ in range(2))
    for seed in range(6):
        with_it.prefetch(generator(seed))
        a, b = with_it.draw(generator(seed)), without.draw(generator(seed))
        assert torch.equal(a.points, b.points) and torch.equal(a.transport.E, b.transport.E)


@pytest.mark.parametrize("size", [4, 8, 16, 64])
def test_crops_show_pixels_of_the_view_at_one_stride(folder: Path, size: int) -> None:
    views = Views(folder)
    sampler = CropSampler(views, size, 1, CPU)
    for seed in range(20):
        sample = sampler.draw(generator(seed))
        assert sample.images is not None and len(sample.points) > 0
        view, _ = sample.source[0]
        xy, _ = project(sample.points.double().numpy(), views.c2w[view], views.fov_y[view], views.width, views.height)
        square = np.stack(np.divmod(sample.images.pixel.numpy(), size), -1)[:, ::-1]  # (P, 2) as x, y
        offsets = {stride: np.ptp(xy - stride * square, axis=0).max() for stride in (1, 2, 3, 6)}
        assert min(offsets.values()) < 1e-3, offsets
        expected = views.transport(*sample.source[0])
        assert any(torch.equal(sample.transport.E[0], E) for E in expected.E)


def test_painting_puts_values_in_their_places(folder: Path) -> None:
    sample = CropSampler(Views(folder), 24, 2, CPU).draw(generator(1))
    assert sample.images is not None
    values = torch.arange(1.0, len(sample.points) + 1)[:, None].requires_grad_()
    picture = sample.images.paint(values)
    assert picture.shape == (2, 1, 24, 24)
    assert torch.equal(picture.flatten()[sample.images.pixel], values[:, 0])
    assert int((picture == 0).sum()) == picture.numel() - len(values)
    (gradient,) = torch.autograd.grad(picture.sum(), values)
    assert torch.equal(gradient, torch.ones_like(values))


def test_pool_holds_every_pixel_under_every_light(folder: Path) -> None:
    views = Views(folder)
    pool = PixelSampler(views, 50, generator(), CPU)
    assert len(pool.points) == sum(len(views.pixels(view)) for view in views.seen)
    rows, transport = pool.lit(1)
    assert (rows.start, rows.stop) == (len(views.pixels(0)), len(views.pixels(0)) + len(views.pixels(1)))
    assert torch.equal(pool.points[rows], views.surface(1, np.arange(len(views.pixels(1)))).points)
    for light in range(len(LIGHTS)):
        assert torch.equal(transport.A[light :: len(LIGHTS)], views.transport(1, light).A.float())


def test_pool_holds_no_more_than_it_may(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stages.distill.sampling.MOST", 100)
    pool = PixelSampler(Views(folder), 50, generator(), CPU)
    rows, transport = pool.lit(len(pool.seen) - 1)
    assert 90 < len(pool.points) <= 100 == pytest.approx(rows.stop, abs=10)
    assert len(transport.E) == (rows.stop - rows.start) * len(LIGHTS)


def broken(folder: Path, tmp_path: Path) -> Path:
    copy = tmp_path / "conditions"
    copy.mkdir()
    for path in folder.rglob("*"):
        if path.is_file():
            target = copy / path.relative_to(folder)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
    return copy


def test_incomplete_and_foreign_folders_are_named(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(ArtifactError, match="no such file"):
        Views(tmp_path / "nowhere")
    copy = broken(folder, tmp_path)
    (copy / view_folder(2) / "left.exr").unlink()
    with pytest.raises(ArtifactError, match=r"view_002/left\.exr"):
        Views(copy)
    manifest = json.loads((copy / MANIFEST).read_text())
    (copy / MANIFEST).write_text(json.dumps({**manifest, "schema": "dreammat.asset"}))
    with pytest.raises(ArtifactError, match=r"dreammat\.asset"):
        Views(copy)


def test_a_damaged_view_file_is_named(folder: Path, tmp_path: Path) -> None:
    copy = broken(folder, tmp_path)
    (copy / view_folder(1) / "above.exr").write_bytes(b"not an image")
    views = Views(copy)
    with pytest.raises(ArtifactError, match=r"view_001/above\.exr"):
        views.transport(1, list(LIGHTS).index("above"))
