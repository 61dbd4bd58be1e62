"""Reference guidance: what it reads of a model, and that it can be satisfied."""

from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from PIL import Image

from stages.core.color import srgb_decode
from stages.core.errors import InputError
from stages.core.shading import Material, shade
from stages.distill.guidance.reference import ReferenceGuidance
from stages.distill.sampling import PixelSampler, Sample
from stages.distill.views import Views
from stages.light.textured_model import TexturedModel
from tests.distill.examples import RADIUS, painted_sphere, write_conditions

CPU = torch.device("cpu")
IDENTITY = np.eye(4)


@pytest.fixture(scope="module")
def conditions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_conditions(tmp_path_factory.mktemp("reference") / "conditions")


def pool(conditions: Path) -> PixelSampler:
    return PixelSampler(Views(conditions), 64, torch.Generator().manual_seed(0), CPU)


def test_material_is_that_of_the_point_seen(conditions: Path, tmp_path: Path) -> None:
    asset = TexturedModel(painted_sphere(tmp_path / "sphere.glb"), IDENTITY)
    seen = pool(conditions)
    material, found = asset.material_at(seen.points.numpy(), seen.eyes.numpy())
    height = seen.points[:, 2].numpy() + RADIUS
    assert found.all()
    expected = srgb_decode((60 + 130 * height) / 255)
    np.testing.assert_allclose(material[:, 1], expected, atol=0.01)  # of the 8-bit texture and the faceted sphere
    np.testing.assert_allclose(material[:, 3], (200 - 120 * height) / 255, atol=0.01)
    clear = abs(height - 0.5) > 0.03
    np.testing.assert_allclose(material[clear, 4], (height > 0.5)[clear], atol=1e-6)


def test_to_world_is_applied(conditions: Path, tmp_path: Path) -> None:
    """The same sphere ten times as large and moved, with the transform that brings it back."""
    shift = np.array([3.0, -2.0, 7.0])
    large = trimesh.creation.icosphere(subdivisions=4, radius=10 * RADIUS)
    large.apply_translation(shift)
    grey = Image.new("RGB", (2, 2), (188, 188, 188))
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=grey, metallicFactor=0.0)
    large.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(large.vertices), 2)), material=material)
    path = tmp_path / "large.glb"
    path.write_bytes(trimesh.Scene(large).export(file_type="glb"))
    to_world = np.diag([0.1, 0.1, 0.1, 1.0])
    to_world[:3, 3] = -0.1 * shift
    seen = pool(conditions)
    found = TexturedModel(path, to_world).material_at(seen.points.numpy(), seen.eyes.numpy())[1]
    assert found.all()
    with pytest.raises(InputError, match="expected the shape"):
        ReferenceGuidance(TexturedModel(path, IDENTITY), seen)


def at_the_truth(conditions: Path, folder: Path, generator: torch.Generator) -> tuple[ReferenceGuidance, Sample, torch.Tensor]:
    """A guidance, a sample of it, and what that shows with the true material."""
    asset, seen = TexturedModel(painted_sphere(folder / "sphere.glb"), IDENTITY), pool(conditions)
    sample = seen.draw(generator)
    assert sample.rows is not None
    truth = torch.from_numpy(asset.material_at(seen.points.numpy(), seen.eyes.numpy())[0])[sample.rows]
    radiance = shade(sample.transport, Material(truth[:, :3].contiguous(), truth[:, 3], truth[:, 4]))
    return ReferenceGuidance(asset, seen), sample, radiance


def test_gradient_vanishes_at_the_truth_and_points_to_it(conditions: Path, tmp_path: Path) -> None:
    generator = torch.Generator().manual_seed(1)
    guidance, sample, radiance = at_the_truth(conditions, tmp_path, generator)
    response = guidance.respond(radiance, sample, 0.0, generator)
    assert response.loss < 1e-5 and float(response.gradient.abs().sum()) < 1e-4
    for factor, sign in ((1.02, 1), (0.98, -1)):
        response = guidance.respond(radiance * factor, sample, 0.0, generator)
        assert response.loss == pytest.approx(0.02, rel=0.15) and bool((response.gradient * sign > 0).all())


def test_curvature_is_the_gradients_slope_for_small_residuals(conditions: Path, tmp_path: Path) -> None:
    generator = torch.Generator().manual_seed(1)
    guidance, sample, radiance = at_the_truth(conditions, tmp_path, generator)
    step = 0.003 * radiance
    up, down = (guidance.respond(radiance + sign * step, sample, 0.0, generator) for sign in (1, -1))
    assert up.curvature is not None
    slope = (up.gradient - down.gradient) / (2 * step)
    torch.testing.assert_close(slope, guidance.respond(radiance, sample, 0.0, generator).curvature, rtol=0.02, atol=0)


def test_far_residuals_weigh_less_but_still_pull(conditions: Path, tmp_path: Path) -> None:
    asset, seen = TexturedModel(painted_sphere(tmp_path / "sphere.glb"), IDENTITY), pool(conditions)
    guidance = ReferenceGuidance(asset, seen)
    sample = seen.draw(torch.Generator().manual_seed(1))
    radiance = 10 * shade(sample.transport, Material(torch.ones(64, 3), torch.full((64,), 0.5), torch.zeros(64)))
    near, far = (guidance.respond(k * radiance, sample, 0.0, torch.Generator()) for k in (1, 10))
    assert near.curvature is not None and far.curvature is not None
    assert bool((far.curvature * 100 < near.curvature).all()) and bool((far.gradient > 0).all())


def test_some_points_of_a_sample_are_those_of_the_pool(conditions: Path) -> None:
    whole = pool(conditions)
    sample, chosen = whole.draw(torch.Generator().manual_seed(1)), torch.tensor([5, 2, 9])
    part, alone = sample.at(chosen), whole.at(sample.rows[chosen])  # type: ignore[index]
    assert torch.equal(part.points, alone.points) and torch.equal(part.normals, alone.normals)
    assert all(torch.equal(getattr(part.transport, n), getattr(alone.transport, n)) for n in ("E", "A", "B", "cosine"))
