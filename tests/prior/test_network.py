import torch

from stages.core.color import srgb_decode
from stages.core.shading import KNOTS, LIGHT_MAPS, Material, shade
from stages.prior.network import Denoiser, relight
from stages.prior.profile import DROPPED
from stages.prior.text import TextEmbedding
from tests.prior.lit import lit_points


def text(count: int) -> TextEmbedding:
    return TextEmbedding(torch.randn(count, 25, 128), torch.ones(count, 25, dtype=torch.bool), torch.randn(count, 128))


def test_shapes_for_every_set_of_conditions() -> None:
    torch.manual_seed(0)
    denoiser = Denoiser().eval()
    conditions = torch.rand(3, 23, 64, 64)
    conditions[1, 4:], conditions[2] = DROPPED, DROPPED
    with torch.no_grad():
        x, t, a = torch.randn(3, 3, 64, 64), torch.tensor([0, 500, 999]), torch.full((3, 1, 1, 1), 0.5)
        v, material = denoiser(x, t, a, conditions, text(3))
    assert v.shape == (3, 3, 64, 64) and material.shape == (3, 5, 64, 64)
    assert torch.isfinite(v).all() and (material > 0).all() and (material < 1).all()


def test_light_enters_the_guess_only_where_it_is_given() -> None:
    torch.manual_seed(0)
    denoiser = Denoiser().eval()
    for parameter in denoiser.leave.parameters():
        torch.nn.init.zeros_(parameter)
    x, t, a = torch.randn(1, 3, 64, 64), torch.tensor([500]), torch.full((1, 1, 1, 1), 0.5)
    dark, unknown = torch.zeros(1, 23, 64, 64), torch.full((1, 23, 64, 64), DROPPED)
    gain = torch.tensor(0.5).rsqrt()
    with torch.no_grad():
        with_light, without = denoiser(x, t, a, dark, text(1))[0], denoiser(x, t, a, unknown, text(1))[0]
    assert torch.allclose(with_light - without, gain.expand_as(x), atol=1e-5)  # the guess is black: -1


def test_relight_is_shading_but_for_the_fresnel_part() -> None:
    transport, maps = lit_points(400)
    parameters = torch.rand(400, 5, generator=torch.Generator().manual_seed(1))
    parameters[:, 4] = (parameters[:, 4] > 0.5).float()
    knot = torch.tensor([0, KNOTS.index(0.5), KNOTS.index(1.0)])[torch.arange(400) % 3]  # where maps know roughness
    parameters[:, 3] = torch.tensor(KNOTS)[knot]
    albedo, metal = srgb_decode(parameters[:, :3]), parameters[:, 4] > 0.5
    exact = shade(transport, Material(albedo, parameters[:, 3], parameters[:, 4]))
    lights = maps.reshape(400, 3 * len(LIGHT_MAPS)).T.reshape(1, 18, 20, 20)
    guess = relight(parameters.T.reshape(1, 5, 20, 20), lights)[0].reshape(3, 400).T
    fresnel = transport.B[torch.arange(400), knot]
    assert torch.allclose((guess - exact)[metal], -((1 - albedo) * fresnel)[metal], atol=2e-3)
    facing = ~metal & (transport.cosine > 0.5)
    assert (guess - exact)[facing].square().mean().sqrt() < 0.02


def test_padding_tokens_do_not_matter() -> None:
    torch.manual_seed(0)
    denoiser = Denoiser().eval()
    for block in (denoiser.words_coarse, denoiser.words_middle):
        torch.nn.init.normal_(block.out.weight)
    embedding = text(1)
    present = torch.arange(25)[None] < 4
    moved = torch.where(present[..., None], embedding.tokens, embedding.tokens + 3)
    x, t, a = torch.randn(1, 3, 64, 64), torch.tensor([300]), torch.full((1, 1, 1, 1), 0.5)
    conditions = torch.rand(1, 23, 64, 64)
    with torch.no_grad():
        one = denoiser(x, t, a, conditions, TextEmbedding(embedding.tokens, present, embedding.pooled))[0]
        two = denoiser(x, t, a, conditions, TextEmbedding(moved, present, embedding.pooled))[0]
    assert torch.allclose(one, two, atol=1e-5)
