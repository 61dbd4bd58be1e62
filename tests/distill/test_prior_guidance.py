"""Guidance by a diffusion model, with a model whose answer is known: it wants every picture to be one flat colour."""

import dataclasses
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import torch
from torch import Tensor

from stages.core.shading import Material, shade
from stages.distill.guidance import prior
from stages.distill.guidance.prior import PriorGuidance
from stages.distill.options import DistillOptions, ScoreOptions
from stages.distill.parts import Claim
from stages.distill.regions import Regions
from stages.distill.sampling import CropSampler
from stages.distill.views import Views
from stages.material.recipe import EVEN
from stages.prior import profile
from stages.prior.text import TextEmbedding
from tests.distill.examples import write_conditions

SIZE = 16


@dataclass
class FlatPrior:
    """Predicts the noise that is left when the picture is `colour`, for the prompt; no noise at all otherwise."""

    colour: float
    size: int = SIZE
    identity: dict[str, Any] = field(default_factory=lambda: {"name": "flat", "weights": "0" * 64})
    alpha_bar: Tensor = field(default_factory=lambda: torch.linspace(0.999, 0.01, 1000))
    calls: list[tuple[Tensor, Tensor]] = field(default_factory=list)
    profile_tone = staticmethod(profile.profile_tone)
    exposure = staticmethod(profile.exposure)
    prepare = staticmethod(profile.prepare)

    def embed(self, prompts: list[str]) -> TextEmbedding:
        kind = [0.0 if p == "" else 2.0 if p == "bad" else 1.0 for p in prompts]
        tokens = torch.tensor(kind)[:, None, None]
        return TextEmbedding(tokens, torch.ones(len(prompts), 1, dtype=torch.bool), tokens[:, 0])

    def denoise(
        self, x_t: Tensor, t: Tensor, conditions: Tensor, text: TextEmbedding
    ) -> tuple[Tensor, Tensor]:
        self.calls.append((t, conditions))
        a = self.alpha_bar[t][:, None, None, None]
        wanted = (x_t - a.sqrt() * self.colour) / (1 - a).sqrt()
        noise = torch.where(text.pooled[:, :, None, None] == 1.0, wanted, torch.zeros_like(wanted))
        return noise, torch.full((len(x_t), 5, self.size, self.size), 0.5)


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> Views:
    return Views(write_conditions(tmp_path_factory.mktemp("prior") / "conditions"))


def guidance(views: Views, colour: float, batch: int = 2, **score: Any) -> PriorGuidance:
    chosen = DistillOptions(prompt="flat", batch=batch, score=ScoreOptions(negative_prompt="bad", **score))
    sampler = CropSampler(views, SIZE, batch, torch.device("cpu"))
    return PriorGuidance(FlatPrior(colour), sampler, chosen, lambda: EVEN, Regions())  # type: ignore[arg-type]


def shown(made: PriorGuidance, seed: int = 0) -> tuple[Any, Tensor, torch.Generator]:
    generator = torch.Generator().manual_seed(seed)
    sample = made.draw(generator)
    count = len(sample.points)
    grey = Material(torch.full((count, 3), 0.3), torch.full((count,), 0.5), torch.zeros(count))
    return sample, shade(sample.transport, grey), generator


@pytest.mark.parametrize("colour, sign", [(3.0, -1), (-3.0, 1)])
def test_descent_moves_the_picture_towards_what_the_model_wants(views: Views, colour: float, sign: int) -> None:
    """With no weight on the negative branch and the posterior term, mean over many draws, the gradient has one sign."""
    made = guidance(views, colour, eta1=0.0, eta2=(0.0, 0.0), posterior=1.0)
    sample, radiance, generator = shown(made)
    gradients = [made.respond(radiance, sample, 0.0, generator).gradient for _ in range(4)]
    assert torch.stack(gradients).mean(0).mul(sign).gt(0).float().mean() > 0.99


def test_gradient_is_that_of_the_toned_picture_and_a_mean_over_pixels(views: Views) -> None:
    made = guidance(views, 0.2, batch=1)
    sample, radiance, _ = shown(made)
    response = made.respond(radiance, sample, 0.0, torch.Generator().manual_seed(5))
    gradient, loss = response.gradient, response.loss
    exposure, _ = made._conditions(sample.images, sample)
    k = float(exposure)
    gain = profile.TONE_GAIN
    slope = 2 * gain * k / (1 + gain * k * radiance) / math.log1p(gain * profile.TONE_WHITE)
    score = gradient * len(radiance) / slope
    assert gradient.shape == radiance.shape
    assert loss == pytest.approx(float((score.square().sum() / (3 * SIZE**2)).sqrt()), rel=1e-3)


def test_all_branches_get_the_same_conditions_and_time(views: Views) -> None:
    made = guidance(views, 0.0, eta2=(1.0, 0.5))
    sample, radiance, generator = shown(made)
    made.respond(radiance, sample, 0.9, generator)
    t, conditions = made._prior.calls[-1]  # type: ignore[attr-defined]
    assert conditions.shape == (6, 23, SIZE, SIZE)
    assert torch.equal(conditions[:2], conditions[2:4]) and torch.equal(conditions[:2], conditions[4:])
    assert torch.equal(t[:2], t[2:4]) and torch.equal(t[:2], t[4:]) and int(t.max()) <= 500


def test_a_negative_prompt_without_weight_is_not_asked(views: Views) -> None:
    made = guidance(views, 0.0, eta2=(0.0, 0.0))
    sample, radiance, generator = shown(made)
    made.respond(radiance, sample, 0.9, generator)
    _, conditions = made._prior.calls[-1]  # type: ignore[attr-defined]
    assert conditions.shape == (4, 23, SIZE, SIZE)


def test_same_generator_same_gradient(views: Views) -> None:
    made = guidance(views, 0.3)
    sample, radiance, _ = shown(made)
    a, b, c = (made.respond(radiance, sample, 0.1, torch.Generator().manual_seed(s)).gradient for s in (1, 1, 2))
    assert torch.equal(a, b) and not torch.equal(a, c)


def test_inputs_name_the_weights(views: Views) -> None:
    assert guidance(views, 0.0).inputs == {"prior": "0" * 64}


def test_conditions_files_are_enough(views: Views, tmp_path: Path) -> None:
    """The light maps that condition the model are those of the shown pixels, exposed like the picture."""
    made = guidance(views, 0.0, batch=1)
    sample, _, _ = shown(made)
    exposure, conditions = made._conditions(sample.images, sample)
    count = len(sample.points)
    white = Material(torch.ones(count, 3), torch.ones(count), torch.zeros(count))
    toned = profile.tone(float(exposure) * shade(sample.transport, white))
    lit = conditions[0, 4 + 6 : 4 + 9].flatten(1)[:, sample.images.pixel].T  # metallic 0, roughness 1
    torch.testing.assert_close(lit, toned, rtol=1e-3, atol=1e-4)


class TwoPrior(FlatPrior):
    """Wants pictures of `colour` for the prompt "flat", of minus that for any other."""

    def embed(self, prompts: list[str]) -> TextEmbedding:
        kind = [0.0 if p == "" else 2.0 if p == "bad" else 1.0 if p.startswith("flat") else -1.0 for p in prompts]
        tokens = torch.tensor(kind)[:, None, None]
        return TextEmbedding(tokens, torch.ones(len(prompts), 1, dtype=torch.bool), tokens[:, 0])

    def denoise(self, x_t: Tensor, t: Tensor, conditions: Tensor, text: TextEmbedding) -> tuple[Tensor, Tensor]:
        self.calls.append((t, conditions))
        a, sign = self.alpha_bar[t][:, None, None, None], text.pooled[:, :, None, None]
        wanted = (x_t - a.sqrt() * sign * self.colour) / (1 - a).sqrt()
        return torch.where(sign.abs() == 1.0, wanted, torch.zeros_like(wanted)), x_t


def test_each_pixel_follows_its_own_parts_prompt(views: Views) -> None:
    """Above the gradient goes where the part's prompt alone would send it, below where the whole's would, up to the border."""
    options = DistillOptions(prompt="flat", batch=2, score=ScoreOptions(negative_prompt="bad", eta1=1.0))

    def gradient(prompt: str, *claims: Claim) -> tuple[Any, Tensor, int]:
        sampler = CropSampler(views, SIZE, 2, torch.device("cpu"))
        asked, model = dataclasses.replace(options, prompt=prompt), TwoPrior(3.0)
        made = PriorGuidance(model, sampler, asked, lambda: EVEN, Regions(claims))  # type: ignore[arg-type]
        sample, radiance, generator = shown(made, 3)
        return sample, made.respond(radiance, sample, 0.1, generator).gradient, len(model.calls)

    sample, mixed, calls = gradient("flat", Claim(0, "upper", "other", (1,)))
    upper = sample.label == 1
    assert 0 < int(upper.sum()) < len(upper) and calls == 1
    for prompt, mine in (("other", upper), ("flat", ~upper)):
        alone = gradient(prompt)[1]
        assert torch.equal(mixed[mine].sign(), alone[mine].sign()) and torch.equal(mixed[~mine].sign(), -alone[~mine].sign())


def test_a_score_is_evened_over_the_object_and_over_each_part_by_itself() -> None:
    """Grain goes, an even score stays to the outline, and nothing crosses from one part to the other."""
    row, column = torch.meshgrid(torch.arange(32.0), torch.arange(32.0), indexing="ij")
    disc = (torch.hypot(row - 15, column - 17) < 13).float()
    left = disc * (column < 16)
    areas = torch.stack([left, disc - left])[:, None, None]
    even = 2.0 * left - 1.0 * (disc - left)
    torch.testing.assert_close(prior.evened(even[None, None], areas)[0, 0], even, rtol=1e-4, atol=1e-5)
    grain = torch.randn(1, 3, 32, 32, generator=torch.Generator().manual_seed(0))
    assert prior.evened(grain, areas)[..., disc > 0].std() < 0.15
    slow = torch.sin(row / 32)
    kept = prior.evened((disc * slow)[None, None], disc[None, None, None])[0, 0]
    assert torch.corrcoef(torch.stack([kept[disc > 0], slow[disc > 0]]))[0, 1] > 0.99
