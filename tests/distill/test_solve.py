"""The material of a pixel by itself: found exactly where its lights tell, and not trusted where they do not."""

import torch
from torch import Tensor

from stages.core.knots import F0
from stages.core.shading import KNOTS, Material, Transport, shade_reference
from stages.distill.solve import solved

POINTS, LIGHTS = 150, 5
FLOOR = torch.full((LIGHTS,), 1e-3)


def lobes(seed: int = 0) -> Transport:
    """Transport of points under lights whose specular terms fall off with roughness, each at its own rate."""
    g = torch.Generator().manual_seed(seed)
    rows = POINTS * LIGHTS
    rate = 8 * torch.rand(rows, 1, 1, generator=g)
    level = torch.rand(rows, 1, 3, generator=g) + 0.2
    A = level * torch.exp(-rate * torch.tensor(KNOTS)[None, :, None]) + 0.1
    return Transport(torch.rand(rows, 3, generator=g) + 0.3, A, 0.02 * A, torch.rand(rows, generator=g) * 0.8 + 0.2)


def materials(metallic: float | None = None) -> Tensor:
    values = torch.rand(POINTS, 5, generator=torch.Generator().manual_seed(1))
    values[:, 4] = values[:, 4] if metallic is None else metallic
    return values


def seen(transport: Transport, material: Tensor) -> Tensor:
    """By the plain form of shading, in float64: the compiled search has its own."""
    radiance = shade_reference(transport.to(torch.float64), Material.of(material.double()))
    return radiance.view(len(material), LIGHTS, 3).float()


def test_every_material_is_found_from_its_pixel_alone() -> None:
    transport, truth = lobes(), materials()
    found = solved(transport, seen(transport, truth), FLOOR)
    assert float((found.material - truth).abs().median()) < 1e-4
    assert float(((found.material - truth).abs().amax(1) < 0.02).float().mean()) > 0.95
    assert float(found.misfit.quantile(0.95)) < 1e-9


def test_a_metal_whose_narrow_mirror_shows_black_is_no_black_plastic() -> None:
    """The lobe of the truth shows next to nothing, wider ones much: what plain gradients, and black, would explain by half."""
    transport, truth = lobes(), materials(metallic=1.0)
    truth[:, 3] = 0.2
    shaded = 0.003 + (torch.tensor(KNOTS) - 0.15).clamp(min=0)[None, :, None]
    transport = Transport(transport.E, transport.A * shaded, 0.02 * transport.A * shaded, transport.cosine)
    found = solved(transport, seen(transport, truth), FLOOR)
    assert float(((found.material - truth).abs().amax(1) < 0.05).float().mean()) > 0.95


def test_of_two_dark_greys_that_look_alike_the_duller_is_taken() -> None:
    transport, truth = lobes(), materials(metallic=0.0)
    truth[:, :3] = 0.5 * F0 * truth[:, :1]
    twin = truth.clone()
    twin[:, :3], twin[:, 4] = F0, 1 - truth[:, 0] / F0
    radiance = seen(transport, twin)
    torch.testing.assert_close(radiance, seen(transport, truth))
    assert float((solved(transport, radiance, FLOOR).material - truth).abs().median()) < 1e-3


def test_a_direction_that_nothing_shows_is_not_trusted() -> None:
    """Without a specular term no light tells the roughness."""
    transport, truth = lobes(), materials(metallic=0.0)
    dull = Transport(transport.E, 0 * transport.A, 0 * transport.B, transport.cosine)
    trust = solved(dull, seen(dull, truth), FLOOR).trust
    assert float(trust[:, 3].abs().max()) < 1e-3 and float((trust - trust.mT).abs().max()) < 1e-3
    there = torch.linalg.eigvalsh(trust)
    assert float(there.min()) > -1e-3 and float(there.max()) < 1 + 1e-3 and float(there[:, -1].median()) > 0.99
