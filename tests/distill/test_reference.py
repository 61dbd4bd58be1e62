"""Reference guidance: what it reads of a model, and that it can be satisfied."""

from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from PIL import Image

from stages.core.color import srgb_decode
from stages.core.errors import InputError
from stages.core.progress import silent
from stages.core.shading import WIDTH, Transport
from stages.distill.guidance.reference import ReferenceGuidance
from stages.distill.sampling import PixelSampler
from stages.distill.solve import solved
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


@pytest.fixture(scope="module")
def guidance(conditions: Path, tmp_path_factory: pytest.TempPathFactory) -> ReferenceGuidance:
    asset = TexturedModel(painted_sphere(tmp_path_factory.mktemp("asset") / "sphere.glb"), IDENTITY)
    guidance = ReferenceGuidance(asset, pool(conditions))
    guidance.begin(silent)
    return guidance


def test_pixels_are_found_to_be_of_the_material_that_lit_them(guidance: ReferenceGuidance) -> None:
    truth, found = guidance.truth, guidance.material
    assert float((found - truth).abs().median()) < 1e-4
    assert float(((found - truth).abs().amax(1) < 0.02).float().mean()) > 0.97


def test_the_pull_vanishes_at_what_was_found_and_points_to_it(guidance: ReferenceGuidance) -> None:
    generator = torch.Generator().manual_seed(1)
    sample = guidance.draw(generator)
    there = guidance.material[sample.rows]
    assert guidance.respond(there, sample, 0.0, generator).loss == 0
    for step in (0.05, -0.05):
        moved = there.clone()
        moved[:, 1] = (there[:, 1] + step).clamp(0, 1)
        response = guidance.respond(moved, sample, 0.0, generator)
        assert response.loss > 0.005 and bool((response.gradient[:, 1] * step > 0).all())


def test_what_no_light_reaches_is_not_pulled(guidance: ReferenceGuidance) -> None:
    black = Transport.unpack(torch.zeros(30, WIDTH))
    found = solved(black, torch.zeros(10, 3, 3), torch.ones(3))
    assert float(found.trust.abs().max()) < 1e-6 and bool(torch.isfinite(found.material).all())
