"""Interpolation in roughness: exact at knots and in a white furnace, no overshoot, gradients everywhere."""

import numpy as np
import pytest
import torch

from stages.core.albedo import cosines, specular_albedo
from stages.core.brdf import alpha_from_roughness, directional_albedo
from stages.core.shading import F0, KNOTS, WIDTH, Material, Transport, interpolate, shade


def random_transport(count: int = 40, dtype: torch.dtype = torch.float64) -> Transport:
    rows = torch.rand(count, WIDTH, generator=torch.Generator().manual_seed(0), dtype=dtype) * 3
    rows[:, -1] = rows[:, -1] / 3 * 0.98 + 0.02
    return Transport.unpack(rows)


def random(*shape: int) -> torch.Tensor:
    return torch.rand(shape, generator=torch.Generator().manual_seed(1), dtype=torch.float64)


def furnace(cosine: torch.Tensor) -> Transport:
    """An open point in an even light, from the table at the knots."""
    knots = torch.stack([specular_albedo(torch.full_like(cosine, r), cosine) for r in KNOTS], 1)
    A, B = (knots[..., i, None].expand(-1, -1, 3) for i in (0, 1))
    return Transport(torch.ones(len(cosine), 3, dtype=cosine.dtype), A, B, cosine)


def test_radiance_is_the_formula_at_a_knot() -> None:
    t, c, m = random_transport(), random(40, 3), random(40)
    for k, roughness in enumerate(KNOTS):
        material = Material(c, torch.full((40,), roughness, dtype=torch.float64), m)
        rest = 1 - m[:, None]
        expected = rest * c * t.E + (F0 * rest + m[:, None] * c) * t.A[:, k] + t.B[:, k]
        assert torch.allclose(shade(t, material), expected, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("cosine", (0.05, 0.1, 0.2, 0.5, 1.0))
def test_white_furnace_between_knots(cosine: float) -> None:
    """Specular A + B within 0.2 % of float64 quadrature over the whole range of roughness."""
    roughness = torch.linspace(0.012, 1, 34, dtype=torch.float64)
    A, B = interpolate(furnace(torch.full_like(roughness, cosine)), roughness)
    for i, r in enumerate(roughness.tolist()):
        exact = directional_albedo(np.array([cosine]), alpha_from_roughness(r), 350)[0, 1:]
        assert float(A[i, 0] + B[i, 0]) == pytest.approx(exact.sum(), abs=2e-3)
        assert float(B[i, 0]) == pytest.approx(exact[1], abs=2e-3)


def test_shipped_table_is_the_quadrature() -> None:
    for r, column in ((0.25, 40), (0.5, 70), (1.0, 12)):
        exact = directional_albedo(cosines()[column : column + 1], alpha_from_roughness(r), 300)[0, 1:]
        found = specular_albedo(torch.tensor([r], dtype=torch.float64), torch.tensor([cosines()[column]]))[0]
        assert found.numpy() == pytest.approx(exact, abs=1e-3)


def test_interpolation_stays_near_its_knots() -> None:
    """Even where every knot is drawn by itself: no negative light, and no highlight more than half as bright again."""
    t = random_transport(200)
    for r in np.linspace(0, 1, 41):
        roughness = torch.full((200,), float(r), dtype=torch.float64)
        left = min(int(np.searchsorted(KNOTS, r, side="right")) - 1, len(KNOTS) - 2)
        relative = interpolate(t, roughness)[0] / specular_albedo(roughness, t.cosine)[:, :1]
        knots = [torch.full_like(t.cosine, KNOTS[k]) for k in (left, left + 1)]
        ends = [t.A[:, left + i] / specular_albedo(knot, t.cosine)[:, :1] for i, knot in enumerate(knots)]
        high = torch.maximum(*ends)
        assert bool((relative >= 0).all())
        assert bool((relative <= 1.5 * high).all())


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_no_negative_light_beside_a_steep_fall(dtype: torch.dtype) -> None:
    """Compiled (float32) and plain (float64): one lamp in the mirror, black beside it, some light for the roughest lobe."""
    A = torch.zeros(61, len(KNOTS), 3, dtype=dtype)
    A[:, 3], A[:, -1] = 1000.0, 1.0
    dark = torch.zeros(61, 3, dtype=dtype)
    t = Transport(dark, A, torch.zeros_like(A), torch.full((61,), 0.7, dtype=dtype))
    roughness = torch.linspace(0, 1, 61, dtype=dtype)
    assert float(shade(t, Material(dark + 1, roughness, torch.ones(61, dtype=dtype))).min()) >= 0


def test_gradients_of_all_inputs() -> None:
    t = random_transport(6)
    inputs = [random(*shape).mul(0.9).add(0.05).requires_grad_() for shape in ((6, 3), (6,), (6,))]
    assert torch.autograd.gradcheck(lambda c, r, m: shade(t, Material(c, r, m)), inputs)


@pytest.mark.parametrize("value", (0.0, *KNOTS[1:3], 1.0))
def test_gradient_is_finite_at_knots_and_in_the_dark(value: float) -> None:
    dark = Transport.unpack(torch.zeros(3, WIDTH) + torch.tensor([0.0] * (WIDTH - 1) + [1e-3]))
    for t in (dark, random_transport(3, torch.float32)):
        r = torch.full((3,), value, requires_grad=True)
        shade(t, Material(random(3, 3).float(), r, random(3).float())).sum().backward()
        assert r.grad is not None
        assert bool(r.grad.isfinite().all())
