"""Shading from transport: exact where it claims to be, differentiable, and the same compiled or not."""

import numpy as np
import pytest
import torch
from torch import Tensor

from stages.core.albedo import specular_albedo
from stages.core.shading import (
    F0,
    KNOTS,
    LIGHT_MAPS,
    WIDTH,
    Material,
    Transport,
    derivatives,
    light_maps,
    shade,
    shade_reference,
)
from stages.core.shading_kernels import logarithms


def generator(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def transport(count: int, seed: int = 0, dtype: torch.dtype = torch.float32) -> Transport:
    return Transport.unpack(torch.rand(count, WIDTH, generator=generator(seed), dtype=dtype) + 0.01)


def material(count: int, seed: int = 1, dtype: torch.dtype = torch.float32) -> Material:
    values = torch.rand(count, 5, generator=generator(seed), dtype=dtype)
    return Material(values[:, :3].contiguous(), values[:, 3].contiguous(), values[:, 4].contiguous())


def leaves(m: Material) -> tuple[Tensor, Tensor, Tensor]:
    albedo, roughness, metallic = (t.clone().requires_grad_() for t in (m.albedo, m.roughness, m.metallic))
    return albedo, roughness, metallic


@pytest.mark.parametrize("points, lights", [(0, 1), (1, 1), (301, 1), (97, 5)])
def test_kernel_matches_the_plain_form(points: int, lights: int) -> None:
    light, m = transport(points * lights), material(points)
    fast, slow = leaves(m), leaves(Material(m.albedo.double(), m.roughness.double(), m.metallic.double()))
    radiance, expected = shade(light, Material(*fast)), shade_reference(light.to(torch.float64), Material(*slow))
    assert radiance.shape == (points * lights, 3)
    torch.testing.assert_close(radiance.double(), expected, rtol=1e-5, atol=1e-5)
    weight = torch.randn(radiance.shape, generator=generator(2))
    found = torch.autograd.grad((radiance * weight).sum(), fast)
    wanted = torch.autograd.grad((expected * weight).sum(), slow)
    for a, b in zip(found, wanted, strict=True):
        torch.testing.assert_close(a.double(), b, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("roughness", [0.0, 1e-7, *KNOTS[1:-1], 0.9999999, 1.0])
def test_kernel_matches_at_and_beside_knots(roughness: float) -> None:
    light, m = transport(50), material(50)
    at = Material(m.albedo, torch.full((50,), roughness), m.metallic)
    exact = Material(*(t.double() for t in (at.albedo, at.roughness, at.metallic)))
    torch.testing.assert_close(shade(light, at).double(), shade_reference(light.to(torch.float64), exact), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("dtype, bound", [(torch.float64, 1e-6), (torch.float32, 1e-3)])
def test_derivatives_are_differences_of_the_radiance(dtype: torch.dtype, bound: float) -> None:
    """Central differences in float64 against the derivatives, compiled (float32) and plain (float64)."""
    light, m, h = transport(40 * 3, dtype=torch.float64), material(40, dtype=torch.float64), 1e-6
    by = derivatives(light.to(dtype), Material(*(t.to(dtype) for t in (m.albedo, m.roughness, m.metallic))))

    def difference(c: float, r: float, k: float) -> Tensor:
        ends = (Material(m.albedo + s * c, m.roughness + s * r, m.metallic + s * k) for s in (h, -h))
        high, low = (shade_reference(light, end) for end in ends)
        return (high - low) / (2 * h)

    for found, wanted in ((by.albedo, (1, 0, 0)), (by.roughness, (0, 1, 0)), (by.metallic, (0, 0, 1))):
        torch.testing.assert_close(found.double(), difference(*wanted), rtol=bound, atol=bound)


def test_gradcheck_of_the_radiance_by_the_material() -> None:
    light, m = transport(6, dtype=torch.float64), material(6, dtype=torch.float64)
    inputs = leaves(m)
    assert torch.autograd.gradcheck(lambda c, r, k: shade(light, Material(c, r, k)), inputs)


@pytest.mark.parametrize("k, roughness", list(enumerate(KNOTS)))
def test_stored_transport_comes_back_at_the_knots(k: int, roughness: float) -> None:
    light, m = transport(40), material(40)
    at = Material(m.albedo, torch.full((40,), roughness), m.metallic)
    c, metallic = m.albedo, m.metallic[:, None]
    A, B = light.A[:, k], light.B[:, k]
    expected = (1 - metallic) * c * light.E + (F0 * (1 - metallic) + metallic * c) * A + B
    torch.testing.assert_close(shade(light, at), expected, rtol=1e-4, atol=1e-5)


def test_white_furnace_is_exact_between_knots() -> None:
    roughness = torch.linspace(0, 1, 61).repeat_interleave(8)
    cosine = torch.linspace(0.05, 1, 8).repeat(61)
    albedo = torch.stack([specular_albedo(torch.full_like(cosine, r), cosine) for r in KNOTS], 1)  # (P, K, 2)
    A, B = (albedo[..., i, None].expand(-1, -1, 3) for i in (0, 1))
    light = Transport(torch.zeros(len(cosine), 3), A, B, cosine)
    white = Material(torch.ones(len(cosine), 3), roughness, torch.ones(len(cosine)))
    expected = specular_albedo(roughness, cosine).sum(-1, keepdim=True).expand(-1, 3)
    torch.testing.assert_close(shade(light, white), expected, rtol=2e-4, atol=2e-4)


def test_light_maps_are_shadings_of_white() -> None:
    light = transport(30)
    for i, (metallic, roughness) in enumerate(LIGHT_MAPS):
        white = Material(torch.ones(30, 3), torch.full((30,), roughness), torch.full((30,), float(metallic)))
        torch.testing.assert_close(light_maps(light)[:, i], shade(light, white), rtol=1e-4, atol=1e-5)


def test_dark_grey_has_a_metallic_twin() -> None:
    """Albedo and metallic are known from pictures only up to the exchange of c / F0 and 1 - m (grey, c <= F0)."""
    light, roughness = transport(25), torch.rand(25, generator=generator(3))
    c, m = 0.3 * F0, 0.1
    dark = Material(torch.full((25, 3), c), roughness, torch.full((25,), m))
    twin = Material(torch.full((25, 3), F0 * (1 - m)), roughness, torch.full((25,), 1 - c / F0))
    torch.testing.assert_close(shade(light, dark), shade(light, twin), rtol=1e-5, atol=1e-6)


def test_packed_rows_come_back() -> None:
    rows = torch.rand(7, WIDTH, generator=generator(4))
    assert torch.equal(Transport.unpack(rows).packed(), rows)


def test_logarithms_of_many_numbers_at_once_are_those_of_single_ones() -> None:
    values = np.exp(np.random.default_rng(0).uniform(-80, 80, 50_001)).astype(np.float32)
    values[:3] = 1, np.sqrt(0.5), np.nextafter(np.float32(2**0.5), np.float32(2))
    found = np.empty_like(values)
    logarithms(values.view(np.int32), np.empty((2, len(values)), np.float32), found)
    np.testing.assert_allclose(found, np.log(values.astype(np.float64)), rtol=2e-7, atol=1e-7)
