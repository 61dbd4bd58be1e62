"""Regional prompts: each part's own prompt counts on the part's pixels, the whole's on all others.

Every prompt predicts the noise of the whole picture, and each pixel takes the prediction of its own. Source: Bar-Tal et al.
2023, "MultiDiffusion", Eq. 5 with masks that do not overlap; where a latent shows several parts, they count by their share.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn import functional as F

from stages.distill.parts import Claim
from stages.distill.sampling import Images, Sample
from stages.material.evaluate import owners

Noise = Callable[[Tensor, Tensor, list[int], int], Tensor]
"""(x_t, t, prompts, others) -> noise in x_t for each of some prompts, by number, and then for no prompt and the negative one,
or the first of these two; x_t and t hold B of each."""


class Areas(NamedTuple):
    """prompts: numbers of those that a sample shows, 0 the whole's. weights: (N, B, 1, S, S) of each, which sum to 1; all else
    goes with the first."""

    prompts: list[int]
    weights: Tensor


class Regions:
    """Which prompt each pixel follows. prompts: those of the parts."""

    def __init__(self, claims: Sequence[Claim] = ()) -> None:
        self.prompts = [claim.prompt for claim in claims]
        self._labels = [claim.labels for claim in claims]

    def areas(self, images: Images, sample: Sample, size: int) -> Areas:
        """What a sample shows. Args: size: S, of the pictures or latents that are weighed."""
        owner = torch.from_numpy(owners(self._labels, sample.label.cpu().numpy())).to(sample.points.device)
        prompts = owner.unique().tolist() or [0]
        rest = [F.adaptive_avg_pool2d(images.paint((owner == prompt).float()[:, None]), size) for prompt in prompts[1:]]
        all_of_it = owner.new_ones((images.count, 1, size, size), dtype=torch.float32)
        return Areas(prompts, torch.stack([all_of_it - sum(rest), *rest]))


def regional(noise: Noise, areas: Areas) -> Callable[[Tensor, Tensor, int], Tensor]:
    """What `distillation_score` asks, each pixel by its own prompt."""

    def predict(x_t: Tensor, t: Tensor, branches: int) -> Tensor:
        count, prompts, others = len(x_t) // branches, areas.prompts, branches - 1
        times = len(prompts) + others
        found = noise(x_t[:count].repeat(times, 1, 1, 1), t[:count].repeat(times), prompts, others).unflatten(0, (times, count))
        positive = (areas.weights * found[: len(prompts)]).sum(0)
        return torch.cat([positive, *found[len(prompts) :]])

    return predict
