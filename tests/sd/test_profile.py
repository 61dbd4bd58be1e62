"""The condition channels, pixel by pixel, against the formulas of the released code written out by hand."""

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from stages.core.shading import LIGHT_MAPS, Transport, light_maps
from stages.sd import profile
from stages.sd.filmic import FILE, filmic

S = 12


def scene() -> tuple[torch.Tensor, ...]:
    """Depth, normal, mask and light maps of two views."""
    generator = torch.Generator().manual_seed(0)
    mask = torch.zeros(2, 1, S, S)
    mask[0, :, 2:9, 3:10] = 1
    mask[1, :, 5:, :4] = 1
    depth = mask * (1.5 + torch.rand(2, 1, S, S, generator=generator))
    normal = torch.nn.functional.normalize(torch.randn(2, 3, S, S, generator=generator), dim=1) * mask
    return depth, normal, mask, torch.rand(2, 18, S, S, generator=generator) * 30 * mask


def by_hand(depth: NDArray, normal: NDArray, mask: NDArray, lights: NDArray) -> NDArray:
    """(22, S, S) of one view."""
    curve = np.loadtxt(FILE, delimiter=",")
    out = np.zeros((22, S, S))
    inverse = 1 / (depth + 1e-6)
    low, high = inverse[mask].min(), inverse[mask].max()
    for y in range(S):
        for x in range(S):
            out[1:4, y, x] = 0.5, 0.5, 1.0
            if mask[y, x]:
                nx, ny, nz = normal[:, y, x]
                out[0, y, x] = 0.3 + 0.7 * (inverse[y, x] - low) / (high - low + 1e-6)
                out[1:4, y, x] = 0.5 - 0.5 * nx, 0.5 + 0.5 * ny, 0.5 + 0.5 * nz
                t = (np.log2(lights[:, y, x].clip(1e-30)) + 12.473931188) / 16.5
                out[4:, y, x] = np.interp(t, curve[:, 0], curve[:, 2])
    return out


def test_channels_are_those_of_the_released_checkpoint() -> None:
    depth, normal, mask, lights = scene()
    found = profile.prepare(depth, normal, mask, lights)
    assert found.shape == (2, profile.CHANNELS, S, S)
    for i in range(2):
        inside = mask[i, 0].numpy() > 0.5
        expected = by_hand(*(t.double().numpy() for t in (depth[i, 0], normal[i])), inside, lights[i].double().numpy())
        assert found[i].numpy() == pytest.approx(expected, abs=2e-5)  # 1e-6 in a denominator of 0.2, and float32
    assert found.min() >= 0 and found.max() <= 1


def test_light_maps_fill_channels_4_to_21_in_the_papers_order() -> None:
    """Metallic, roughness: (0, 0), (0, 0.5), (0, 1), (1, 0), (1, 0.5), (1, 1), RGB each."""
    assert LIGHT_MAPS == ((0, 0.0), (0, 0.5), (0, 1.0), (1, 0.0), (1, 0.5), (1, 1.0))
    rows = torch.rand(S * S, 58, generator=torch.Generator().manual_seed(1))
    maps = light_maps(Transport.unpack(rows))
    ones = torch.ones(1, 1, S, S)
    lights = maps.flatten(1).T.reshape(1, 18, S, S)
    found = profile.prepare(ones, ones.expand(1, 3, S, S), ones, lights)
    for i in range(6):
        toned = filmic(maps[:, i]).T.reshape(3, S, S).clamp(max=1)
        assert torch.equal(found[0, 4 + 3 * i : 7 + 3 * i], toned)


def test_a_sun_in_a_light_map_is_1() -> None:
    depth, normal, mask, lights = scene()
    assert profile.prepare(depth, normal, mask, lights + 6e4)[:, 4:].max() == 1.0


@pytest.mark.parametrize("cover", ["nothing", "one depth"])
def test_degenerate_views_stay_finite(cover: str) -> None:
    depth, normal, mask, lights = scene()
    mask = torch.zeros_like(mask) if cover == "nothing" else mask
    assert torch.isfinite(profile.prepare(torch.full_like(depth, 2.0) * mask, normal, mask, lights)).all()


def test_picture_is_filmic_on_white() -> None:
    _, _, mask, lights = scene()
    radiance = lights[:, :3].clone().requires_grad_()
    picture = profile.picture(radiance, mask)
    inside = (mask > 0.5).expand_as(picture)
    assert torch.equal(picture[inside], filmic(radiance)[inside]) and picture[~inside].eq(1).all()
    (gradient,) = torch.autograd.grad(picture.sum(), radiance)
    assert (gradient[inside] > 0).all() and gradient[~inside].eq(0).all()


def test_dropped_conditions_are_0_and_the_rest_is_kept() -> None:
    conditions = profile.prepare(*scene())
    no_geometry = profile.without(conditions, geometry=True, light=False)
    no_light = profile.without(conditions, geometry=False, light=True)
    assert no_geometry[:, :4].eq(0).all() and torch.equal(no_geometry[:, 4:], conditions[:, 4:])
    assert no_light[:, 4:].eq(0).all() and torch.equal(no_light[:, :4], conditions[:, :4])
