"""Losses on the material itself."""

import torch

from stages.core.shading import Material
from stages.distill import regularizers
from stages.material.residual import combined


def material(value: float) -> Material:
    return Material(torch.full((5, 3), value), torch.full((5,), value), torch.full((5,), value))


def test_displacement_stays_in_the_tangent_plane_and_has_the_papers_spread() -> None:
    generator = torch.Generator().manual_seed(0)
    points, normals = torch.zeros(20000, 3), torch.tensor([[0.0, 0.6, 0.8]]).expand(20000, 3)
    moved = regularizers.displaced(points, normals, generator)
    assert (moved * normals).sum(-1).abs().max() < 1e-6
    assert abs(float(moved.square().sum(-1).mean().sqrt()) / (regularizers.REACH * 2**0.5) - 1) < 0.02


def test_smoothness_is_the_squared_distance() -> None:
    here, nearby = torch.full((7, 5), 0.5), torch.full((7, 5), 0.2)
    assert float(regularizers.smoothness(here, here)) == 0
    torch.testing.assert_close(regularizers.smoothness(here, nearby), torch.tensor(5 * 0.09 * regularizers.SLOPE**2))


def test_bimodality_is_zero_at_both_ends_and_pushes_away_from_the_middle() -> None:
    metallic = torch.tensor([0.0, 1.0, 0.4, 0.6], requires_grad=True)
    loss = regularizers.bimodality(metallic)
    assert float(regularizers.bimodality(torch.tensor([0.0, 1.0]))) == 0
    (gradient,) = torch.autograd.grad(loss, metallic)
    assert gradient[2] > 0 > gradient[3]


def test_the_hold_is_how_far_the_material_has_moved() -> None:
    """To first order, of a material in the middle of its range."""
    learnt = 0.1 * torch.randn(400, 5, generator=torch.Generator().manual_seed(0))
    moved = combined(torch.full((400, 5), 0.5), learnt) - 0.5
    torch.testing.assert_close(regularizers.hold(learnt), moved.square().sum(1).mean(), rtol=0.02, atol=0)


def test_baked_light_is_what_varies_with_the_light_within_a_coat() -> None:
    generator = torch.Generator().manual_seed(0)
    light = torch.rand(2000, 1, generator=generator).exp() * torch.ones(3)
    texture = 0.2 + 0.3 * torch.rand(2000, 1, generator=generator) * torch.ones(3)
    coats = torch.full((2000, 3), 0.35)

    def loss(albedo: torch.Tensor) -> float:
        values = torch.full((2000,), 0.5)
        return float(regularizers.baked_light(Material(albedo, values, values), coats, light))

    assert loss(coats) == 0 and loss(texture) < 1e-3  # a texture that knows nothing of the light
    even, lit = loss(texture * 1.2), loss(texture * (light / light.mean()) ** 0.5)
    assert lit > 50 * even
    dark = regularizers.baked_light(material(0.3), torch.full((5, 3), 0.5), torch.zeros(5, 3))
    assert float(dark) == 0  # where no light falls, none is baked in
