import pytest
import torch

from stages.prior import profile

S = profile.SIZE


def test_tone_is_monotone_and_comes_back() -> None:
    radiance = torch.cat([torch.zeros(1), torch.logspace(-6, 5, 200)]).double()
    toned = profile.tone(radiance)
    assert (toned.diff() > 0).all() and toned[0] == 0
    assert torch.allclose(profile.untone(toned), radiance, rtol=1e-9, atol=0)
    assert profile.profile_tone(torch.tensor([0.0, profile.TONE_WHITE])).tolist() == pytest.approx([-1, 1])


def test_tone_has_a_useful_gradient_from_black_to_the_sun() -> None:
    radiance = torch.tensor([0.0, 1e-6, 1.0, 1e4, 1e6], dtype=torch.float64, requires_grad=True)
    (gradient,) = torch.autograd.grad(profile.profile_tone(radiance).sum(), radiance)
    assert torch.isfinite(gradient).all() and (gradient > 0).all()
    some = torch.tensor([0.3, 2.0], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(profile.profile_tone, (some,))


def scene() -> tuple[torch.Tensor, ...]:
    generator = torch.Generator().manual_seed(0)
    mask = torch.zeros(2, 1, S, S)
    mask[:, :, 10:40, 20:50] = 1
    depth = mask * (1.5 + torch.rand(2, 1, S, S, generator=generator))
    normal = torch.nn.functional.normalize(torch.randn(2, 3, S, S, generator=generator), dim=1)
    height = torch.linspace(0.5, -0.5, S)[None, None, :, None].expand_as(mask)
    return depth, normal * mask, height, mask, torch.rand(2, 18, S, S, generator=generator) * 5


def test_conditions_are_in_range_and_black_off_the_object() -> None:
    depth, normal, height, mask, lights = scene()
    conditions = profile.prepare(depth, normal, height, mask, lights)
    assert conditions.shape == (2, 23, S, S)
    inside, outside = conditions[..., 10:40, 20:50], conditions[..., :5, :5]
    assert inside[:, 0].amin().item() == pytest.approx(0.3) and inside[:, 0].amax().item() == pytest.approx(1.0)
    assert (inside >= 0).all() and (inside <= 1).all()
    assert outside[:, 0].eq(0).all() and outside[:, 4:].eq(0).all()
    assert outside[0, 1:4, 0, 0].tolist() == [0.5, 0.5, 1.0]
    assert torch.equal(conditions[:, 22] * mask[:, 0], (height + 0.5)[:, 0] * mask[:, 0])


def test_nearer_is_brighter() -> None:
    depth, normal, height, mask, lights = scene()
    near = profile.prepare(depth, normal, height, mask, lights)[0, 0][mask[0, 0] > 0]
    assert torch.equal(near.argsort(), depth[0, 0][mask[0, 0] > 0].argsort(descending=True))


@pytest.mark.parametrize("cover", ["nothing", "one depth"])
def test_degenerate_views_stay_finite(cover: str) -> None:
    depth, normal, height, mask, lights = scene()
    if cover == "nothing":
        mask = torch.zeros_like(mask)
    conditions = profile.prepare(torch.full_like(depth, 2.0) * mask, normal, height, mask, lights)
    assert torch.isfinite(conditions).all()
    assert torch.isfinite(profile.exposure(lights * 0, mask)).all()


def test_exposure_cancels_the_strength_of_the_light() -> None:
    *_, mask, lights = scene()
    k = profile.exposure(lights, mask)
    assert torch.allclose(profile.exposure(lights * 50, mask) * 50, k, rtol=1e-5)


def test_dropped_parts_are_marked_and_the_rest_is_kept() -> None:
    conditions = profile.prepare(*scene())
    dropped = profile.drop(conditions, torch.tensor([True, False]), torch.tensor([False, True]))
    geometry, light = profile.GEOMETRY, profile.LIGHT
    assert dropped[0, geometry].eq(profile.DROPPED).all() and torch.equal(dropped[0, light], conditions[0, light])
    assert dropped[1, light].eq(profile.DROPPED).all() and torch.equal(dropped[1, geometry], conditions[1, geometry])
    assert sorted([*geometry, *range(profile.CHANNELS)[light]]) == list(range(profile.CHANNELS))
