"""Guidance by the embedded diffusion model: Classifier Score Distillation under geometry and light conditions.

Rendered crops and their light maps are exposed alike, put through the model's tone curve, and noised to a random
diffusion time; the score moves the picture. All three branches (prompt, no prompt, negative prompt) get the same
conditions, or colours shift.
"""

import math
from typing import Any

import numpy as np
import torch
from torch import Tensor

from stages.core.color import srgb_decode
from stages.core.shading import light_maps
from stages.distill import schedule
from stages.distill.guidance.base import Budget, Response
from stages.distill.guidance.csd import classifier_score, posterior_score
from stages.distill.options import DistillOptions
from stages.distill.sampling import CropSampler, Images, Sample
from stages.prior.model import Prior
from stages.prior.text import TextEmbedding

BUDGET = Budget(steps=1500, learning_rate=0.01)

OVERHEAD = math.radians(60)
FRONT, BACK = math.radians(45), math.radians(135)


def view_words(azimuth: float, elevation: float) -> str:
    """What a prompt says about the camera. Args: radians; the object's front is at azimuth 0.

    Source: Poole et al. 2022, "DreamFusion", Section 3.2; the bounds are those of the released DreamMat code.
    """
    if elevation > OVERHEAD:
        return "overhead view"
    turned = abs(math.remainder(azimuth, 2 * math.pi))
    return "front view" if turned < FRONT else "back view" if turned > BACK else "side view"


class PriorGuidance:
    """See `Guidance`. Args: prior: a loaded model; sampler: of crops of its size."""

    def __init__(self, prior: Prior, sampler: CropSampler, options: DistillOptions) -> None:
        self.sampler = sampler
        self.identity: dict[str, Any] = prior.identity
        self.inputs = {"prior": prior.identity["weights"]}
        self.budget = BUDGET
        self._prior, self._options = prior, options
        words = ("front view", "side view", "back view", "overhead view")
        self._positive = {word: prior.embed([f"{options.prompt}, {word}"]) for word in words}
        self._null, self._negative = prior.embed([""]), prior.embed([options.negative_prompt])
        expected = prior.expected_material([options.prompt])[0]
        self.start: Tensor | None = torch.cat([srgb_decode(expected[:3]), expected[3:]])

    def respond(self, radiance: Tensor, sample: Sample, progress: float, generator: torch.Generator) -> Response:
        """See `Guidance.respond`; the number for the curve is the root mean square of the score on the picture."""
        assert sample.images is not None
        images, prior = sample.images, self._prior
        exposure, conditions = self._conditions(images, sample)
        if (given := self._options.given) != "full":
            conditions = prior.drop(conditions, geometry=given != "geometry", light=given != "light")
        leaf = radiance.detach().requires_grad_()
        picture = prior.profile_tone(exposure * images.paint(leaf))  # (B, 3, S, S)
        score = self._score(picture.detach(), conditions, images, progress, generator)
        (gradient,) = torch.autograd.grad(picture, leaf, score / len(radiance))
        on_object = images.paint(torch.ones_like(radiance[:, :1]))
        return Response(gradient, float((score * on_object).square().mean().sqrt()))

    def _conditions(self, images: Images, sample: Sample) -> tuple[Tensor, Tensor]:
        """Exposure (B, 1, 1, 1) and condition channels (B, 22, S, S)."""
        ones = torch.ones(len(sample.points), 1, device=sample.points.device)
        mask = images.paint(ones)
        lights = images.paint(light_maps(sample.transport).float().flatten(1))
        exposure = self._prior.exposure(lights, mask)
        depth, normal = images.paint(images.surface.depth[:, None]), images.paint(images.surface.view_normals)
        return exposure, self._prior.prepare(depth, normal, mask, exposure * lights)

    def _score(
        self, picture: Tensor, conditions: Tensor, images: Images, progress: float, generator: torch.Generator
    ) -> Tensor:
        """Weighted gradient with respect to the toned picture (B, 3, S, S)."""
        options, count, device = self._options, images.count, picture.device
        low, high = schedule.time_range(progress)
        t = torch.randint(low, high + 1, (count,), generator=generator).to(device)
        noise = torch.randn(picture.shape, generator=generator).to(device)
        alpha_bar = self._prior.alpha_bar[t][:, None, None, None]
        x_t = alpha_bar.sqrt() * picture + (1 - alpha_bar).sqrt() * noise
        eta2 = schedule.eta2(progress, *options.eta2)
        branches = 3 if eta2 else 2  # a negative prompt without weight is not asked
        text = self._text(images, branches)
        positive, null, *rest = self._prior.predict_noise(
            x_t.repeat(branches, 1, 1, 1), t.repeat(branches), conditions.repeat(branches, 1, 1, 1), text
        ).chunk(branches)
        negative = rest[0] if rest else null
        score = classifier_score(positive, null, negative, options.eta1, eta2)
        return (1 - alpha_bar) * (score + options.posterior * posterior_score(positive, noise))

    def _text(self, images: Images, branches: int) -> TextEmbedding:
        """Prompt with view words, no prompt, and negative prompt, for B images each; the first `branches` of them."""
        places = zip(np.atleast_1d(images.azimuth), np.atleast_1d(images.elevation), strict=True)
        positive = [self._positive[view_words(float(a), float(e))] for a, e in places]
        rest = [self._null, self._negative][: branches - 1]
        return TextEmbedding.cat([*positive, *(text.expand(images.count) for text in rest)])
