"""What is read of a textured model."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from stages.core.color import srgb_decode
from stages.core.errors import InputError
from stages.light.textured_model import TexturedModel, bilinear

IDENTITY = np.eye(4)


def test_bilinear_decodes_before_it_blends_and_repeats() -> None:
    texture = np.array([[[0], [255]], [[100], [200]]], np.uint8)
    decode = srgb_decode(np.arange(256) / 255).astype(np.float32)
    centres = np.array([[0.25, 0.75], [0.75, 0.75], [0.25, 0.25], [1.25, -0.25]])  # v is up, the first row on top
    expected = decode[[0, 255, 100, 0]]
    np.testing.assert_allclose(bilinear(texture, centres, decode)[:, 0], expected, atol=1e-6)
    middle = bilinear(texture, np.array([[0.5, 0.75], [0.0, 0.75]]), decode)[:, 0]
    np.testing.assert_allclose(middle, [0.5, 0.5], atol=1e-6)  # the mean of linear 0 and 1, also across the edge


def test_factors_multiply_and_stand_in_for_textures(tmp_path: Path) -> None:
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
    plain = trimesh.visual.material.PBRMaterial(baseColorFactor=[255, 128, 0, 255], metallicFactor=0.25, roughnessFactor=0.5)
    mesh.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(mesh.vertices), 2)), material=plain)
    path = tmp_path / "plain.glb"
    path.write_bytes(trimesh.Scene(mesh).export(file_type="glb"))
    points = mesh.triangles_center[:5]
    material, found = TexturedModel(path, IDENTITY).material_at(points, 3 * points)
    assert found.all()
    np.testing.assert_allclose(material, np.tile([1, 128 / 255, 0, 0.5, 0.25], (5, 1)), atol=1e-6)


def test_bad_models_are_one_line_errors(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nothing\.glb: no such file"):
        TexturedModel(tmp_path / "nothing.glb", IDENTITY)
    with pytest.raises(InputError, match=r"mesh\.obj: expected a \.glb"):
        TexturedModel(tmp_path / "mesh.obj", IDENTITY)
    garbage = tmp_path / "garbage.glb"
    garbage.write_bytes(b"glTF but not really")
    with pytest.raises(InputError, match=r"garbage\.glb: not a readable glTF model"):
        TexturedModel(garbage, IDENTITY)
    bare = tmp_path / "bare.glb"
    bare.write_bytes(trimesh.Scene(trimesh.creation.icosphere(subdivisions=1)).export(file_type="glb"))
    with pytest.raises(InputError, match="no metallic-roughness material"):
        TexturedModel(bare, IDENTITY)


def test_a_damaged_texture_is_a_one_line_error(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).integers(0, 256, (64, 64, 3)).astype(np.uint8)
    mesh = trimesh.creation.icosphere(subdivisions=1)
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=Image.fromarray(noise))
    mesh.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(mesh.vertices), 2)), material=material)
    whole = trimesh.Scene(mesh).export(file_type="glb")
    inside = whole.index(b"IDAT") + 2000
    path = tmp_path / "damaged.glb"
    path.write_bytes(whole[:inside] + bytes(4000) + whole[inside + 4000 :])
    with pytest.raises(InputError, match=r"damaged\.glb: broken data stream"):
        TexturedModel(path, IDENTITY)
