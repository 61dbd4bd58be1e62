"""Guidance by the embedded diffusion model: Classifier Score Distillation under geometry and light conditions.

Rendered crops and their light maps are exposed alike, put through the model's tone curve, and noised to a random
diffusion time; the score moves the picture. All three branches (prompt, no prompt, negative prompt) get the same
conditions, or colours shift.

What the score says of a pixel is averaged with what it says around it (`evened`). Score distillation heads for the likeliest
picture, and of a grain that words leave to chance that is its mean: left alone it washes patterns out, however well the model
knows them. Tone and colour it does judge, and these are the same all around.
"""

import dataclasses
import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from stages.core.progress import Progress
from stages.core.shading import light_maps
from stages.distill.guidance.base import Budget, Response
from stages.distill.guidance.csd import Weights, chosen_weights, distillation_score
from stages.distill.guidance.view_words import VIEW_WORDS, words_of
from stages.distill.options import DistillOptions
from stages.distill.regions import Areas, Regions, regional
from stages.distill.sampling import CropSampler, Images, Sample
from stages.material.recipe import Recipe
from stages.prior.model import Prior
from stages.prior.text import TextEmbedding

BUDGET = Budget(steps=60, learning_rate=0.002)
"""Few and small: what words call for is right but for what no eye sees, and the residual's own noise, at a rate of 0.01, was
the larger error. 250 steps leave all that is measured where 60 have brought it (README)."""

OWN = Weights(eta1=0.5, eta2=(0.0, 0.0), posterior=1.0)
"""What `--loss csd` means for this model: mostly its posterior mean, which stays where it belongs. The classifier's score by
itself goes past the prompt, most where most light falls: with 2.5 and 0.5, unanchored black rubber ends at 1/30 of its
albedo."""

REACH = 1 / 4
"""Deviation of the Gaussian over which a score is averaged, as a share of the picture's edge."""


@dataclass(frozen=True)
class Given:
    """What the model is told of a sample: exposure (B, 1, 1, 1), condition channels (B, 23, S, S), and which prompts."""

    exposure: Tensor
    conditions: Tensor
    areas: Areas


class PriorGuidance:
    """See `Guidance`. Args: prior: a loaded model; sampler: of crops of its size; begin: finds what the words call for;
    regions: parts that have prompts of their own."""

    def __init__(
        self, prior: Prior, sampler: CropSampler, options: DistillOptions, begin: Callable[[], Recipe], regions: Regions
    ) -> None:
        self.sampler, self._begin = sampler, begin
        self.identity: dict[str, Any] = prior.identity
        self.held, self.looks = True, True
        self.inputs = {"prior": prior.identity["weights"]}
        self.budget, self.weights = BUDGET, chosen_weights(options, OWN)
        self._prior, self._options = prior, options
        self._regions, prompts = regions, [options.prompt, *regions.prompts]
        self._positive = [{words: prior.embed([f"{prompt}, {words}"]) for words in VIEW_WORDS} for prompt in prompts]
        self._null, self._negative = prior.embed([""]), prior.embed([options.score.negative_prompt])

    @functools.cached_property
    def recipe(self) -> Recipe:
        """Found when first asked for: a run that is up to date never does."""
        return self._begin()

    def begin(self, progress: Progress) -> None:
        """Nothing to do."""

    def draw(self, generator: torch.Generator) -> Sample:
        """See `Guidance.draw`."""
        sample, given = self.sampler.draw(generator), self._options.score.given
        assert sample.images is not None
        exposure, conditions = self._conditions(sample.images, sample)
        if given != "full":
            conditions = self._prior.drop(conditions, geometry=given != "geometry", light=given != "light")
        areas = self._regions.areas(sample.images, sample, sample.images.size)
        return dataclasses.replace(sample, given=Given(exposure, conditions, areas))

    def respond(self, radiance: Tensor, sample: Sample, progress: float, generator: torch.Generator) -> Response:
        """See `Guidance.respond`; the number for the curve is the root mean square of the score on the picture."""
        assert sample.images is not None
        images, prior, given = sample.images, self._prior, sample.given
        leaf = radiance.detach().requires_grad_()
        picture = prior.profile_tone(given.exposure * images.paint(leaf))  # (B, 3, S, S)

        def noise(x_t: Tensor, t: Tensor, prompts: list[int], others: int) -> Tensor:
            conditions = given.conditions.repeat(len(prompts) + others, 1, 1, 1)
            return prior.denoise(x_t, t, conditions, self._text(images, prompts, others))[0]

        predict = regional(noise, given.areas)
        raw = distillation_score(predict, picture.detach(), prior.alpha_bar, self.weights, progress, generator)
        on_object = images.paint(torch.ones_like(radiance[:, :1]))
        score = evened(raw, on_object * given.areas.weights)
        (gradient,) = torch.autograd.grad((picture * score).sum() / len(radiance), leaf)
        return Response(gradient, float((score * on_object).square().mean().sqrt()))

    def _conditions(self, images: Images, sample: Sample) -> tuple[Tensor, Tensor]:
        """Exposure (B, 1, 1, 1) and condition channels (B, 23, S, S)."""
        ones = torch.ones(len(sample.points), 1, device=sample.points.device)
        mask = images.paint(ones)
        lights = images.paint(light_maps(sample.transport).float().flatten(1))
        exposure = self._prior.exposure(lights, mask)
        depth, normal = images.paint(images.surface.depth[:, None]), images.paint(images.surface.view_normals)
        height = images.paint(images.surface.points[:, 2:])
        return exposure, self._prior.prepare(depth, normal, height, mask, exposure * lights)

    def _text(self, images: Images, prompts: list[int], others: int) -> TextEmbedding:
        """Prompts with view words, then no prompt and the negative one, or fewer of these, for B images each."""
        positive = [self._positive[prompt][words] for prompt in prompts for words in words_of(images)]
        rest = [self._null, self._negative][:others]
        return TextEmbedding.cat([*positive, *(text.expand(images.count) for text in rest)])


def evened(score: Tensor, areas: Tensor) -> Tensor:
    """A score averaged around each pixel, by a Gaussian, over the pixels of its own area.

    Args:
        score: (B, C, S, S). areas: (N, B, 1, S, S) how much of each pixel is each area's, 0 off the object.
    Returns:
        (B, C, S, S), 0 off the object.
    """
    at = torch.arange(score.shape[-1], dtype=score.dtype, device=score.device)
    blur = torch.exp(-0.5 * ((at[:, None] - at) / (REACH * len(at))).square())  # (S, S)
    mean = (blur @ (areas * score) @ blur) / (blur @ areas @ blur).clamp(min=1e-6)
    return (areas * mean).sum(0)
