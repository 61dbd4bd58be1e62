"""Guidance by Stable Diffusion and the light- and geometry-aware ControlNet: the paper's own.

The rendered view, Filmic on white, is encoded; its latents are noised to a random diffusion time, and the score on them
goes back through the encoder to the pixels. All three branches (prompt, no prompt, negative prompt) get the same
conditions, or colours shift.

Light maps and normals are those of the conditions' profile: with `conditions --profile sd` what the released ControlNet has
seen, Blender's light with a bounce (`stages.light.bounce`) and smooth normals; else glTF's direct light, as
`dreammat train pictures` renders it.
"""

from typing import Any

import torch
from torch import Tensor

from stages.core.errors import InputError
from stages.core.progress import Progress
from stages.core.shading import light_maps
from stages.distill import schedule
from stages.distill.guidance.base import Budget, Response
from stages.distill.guidance.csd import CSD, chosen_weights, distillation_score
from stages.distill.guidance.view_words import VIEW_WORDS, words_of
from stages.distill.options import DistillOptions
from stages.distill.regions import Regions, regional
from stages.distill.sampling import CropSampler, Images, Sample
from stages.distill.views import Views
from stages.material.recipe import EVEN
from stages.sd import profile
from stages.sd.files import ModelFiles
from stages.sd.models import StableDiffusion

BUDGET = Budget(steps=4000, learning_rate=0.01)
"""Source: Zhang et al. 2024, DreamMat, Section 4.1."""


def view_size(views: Views, files: ModelFiles) -> int:
    """Edge of the square that shows a whole view, pixel for pixel. Raises: InputError when the model cannot take it."""
    size = max(views.width, views.height)
    if size % files.multiple:
        raise InputError(
            f"{views.folder}: views are {views.width} x {views.height} pixels, expected a multiple of {files.multiple} for "
            "--guidance sd; make the conditions with --size 512, the size that Stable Diffusion 2.1 base knows"
        )
    return size


class StableDiffusionGuidance:
    """See `Guidance`. Args: model: loaded; sampler: of crops of `view_size`; regions: parts that have prompts of their own."""

    def __init__(self, model: StableDiffusion, sampler: CropSampler, options: DistillOptions, regions: Regions) -> None:
        self.sampler = sampler
        self.identity: dict[str, Any] = model.identity
        self.inputs: dict[str, str] = model.hashes
        self.recipe, self.held, self.looks = EVEN, False, True
        self.budget, self.weights = BUDGET, chosen_weights(options, CSD)
        self._model, self._given = model, options.score.given
        self._regions = regions
        prompts = [f"{prompt}, {words}" for prompt in (options.prompt, *regions.prompts) for words in VIEW_WORDS]
        self._text = model.embed(["", options.score.negative_prompt, *prompts])  # (2 + 4 K, T, D) of K prompts

    def begin(self, progress: Progress) -> None:
        """Nothing to do."""

    def draw(self, generator: torch.Generator) -> Sample:
        """See `Guidance.draw`."""
        return self.sampler.draw(generator)

    def respond(self, radiance: Tensor, sample: Sample, progress: float, generator: torch.Generator) -> Response:
        """See `Guidance.respond`; the number for the curve is the root mean square of the score on the latents."""
        assert sample.images is not None
        images, model = sample.images, self._model
        mask = images.paint(torch.ones_like(radiance[:, :1]))
        conditions = self._conditions(images, sample, mask)
        leaf = radiance.detach().requires_grad_()
        latents = model.encode(profile.picture(images.paint(leaf), mask))

        def noise(x_t: Tensor, t: Tensor, prompts: list[int], others: int) -> Tensor:
            given = None if conditions is None else conditions.repeat(len(prompts) + others, 1, 1, 1)
            text = self._branches(images, prompts, others)
            return model.predict_noise(x_t, t, text, given, schedule.control_scale(progress))

        predict = regional(noise, self._regions.areas(images, sample, latents.shape[-1]))
        score = distillation_score(predict, latents.detach(), model.alpha_bar, self.weights, progress, generator)
        (gradient,) = torch.autograd.grad(latents, leaf, score)
        return Response(gradient / len(radiance), float(score.square().mean().sqrt()))

    def _conditions(self, images: Images, sample: Sample, mask: Tensor) -> Tensor | None:
        """Condition channels (B, 22, S, S), what is not given 0; None without any, for the base alone."""
        if self._given == "none":
            return None
        if images.maps is None:
            normal, lights = images.surface.view_normals, light_maps(sample.transport.to(torch.float32))
        else:
            normal, lights = images.maps
        shown = (images.paint(values) for values in (images.surface.depth[:, None], normal, lights.flatten(1)))
        depth, normal, lights = shown
        conditions = profile.prepare(depth, normal, mask, lights)
        return profile.without(conditions, geometry=self._given == "light", light=self._given == "geometry")

    def _branches(self, images: Images, prompts: list[int], others: int) -> Tensor:
        """Text (N B, T, D): prompts with view words, then no prompt and the negative one, or fewer, for B images each."""
        null, negative, first, views = 0, 1, 2, len(VIEW_WORDS)
        rows = [first + views * prompt + VIEW_WORDS.index(words) for prompt in prompts for words in words_of(images)]
        rows += [row for row in (null, negative)[:others] for _ in range(images.count)]
        return self._text[torch.tensor(rows).to(self._text.device, non_blocking=True)]
