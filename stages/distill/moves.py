"""The recipe's own numbers, moved by what pictures say: of each coat its colour, its roughness and its contrast.

While a run lasts they are logits beside the residual's, one row for each coat, weighed by how much of a point is that
coat's; at its end they are written into the recipe (`moved`), which holds nothing else of them. They stay near what the words
mean: within `BOUND`, and held by `--anchor`.
"""

from dataclasses import replace

import numpy as np
import torch
from torch import Tensor, nn

from stages.core.color import srgb_decode, srgb_encode
from stages.material.recipe import Coat, Recipe
from stages.material.residual import MARGIN

BOUND = 0.3
"""Most that a logit of colour or roughness moves, and the logarithm of contrast: 0.07 of a value of 0.5, a factor of 1.35."""

PACE = 1.5
"""Logits for one unit of a parameter: so few numbers, of which every picture speaks, may go faster than the residual."""

COLUMNS = 5
"""Logits of red, green, blue and roughness; logarithm of contrast."""


class Moves(nn.Module):
    """Offsets of the K coats of a recipe, 0 before the first step. What a recipe leaves to its looks does not move.

    Args: recipe: settled.
    """

    level: Tensor
    free: Tensor

    def __init__(self, recipe: Recipe) -> None:
        super().__init__()
        self.offsets = nn.Parameter(torch.zeros(len(recipe.coats), COLUMNS))
        self.register_buffer("level", torch.tensor([_level(coat) for coat in recipe.coats]), persistent=False)  # (K, 3)
        free = [[coat.color is not None] * 3 + [coat.roughness is not None, coat.color is not None] for coat in recipe.coats]
        self.register_buffer("free", torch.tensor(free, dtype=torch.float32), persistent=False)

    def bounded(self) -> Tensor:
        """Offsets within ± `BOUND`, (K, 5)."""
        return BOUND * torch.tanh(PACE * self.offsets / BOUND) * self.free

    def forward(self, base: Tensor, shares: Tensor) -> Tensor:
        """Logits (P, 5) to add to a recipe's material. Args: base: (P, 5). shares: (P, K), of `evaluate_coats`."""
        mine = shares @ self.bounded()  # (P, 5)
        about = torch.logit(base[:, :3].clamp(MARGIN, 1 - MARGIN)) - shares @ self.level  # (P, 3)
        return torch.cat([mine[:, :3] + about * torch.expm1(mine[:, 4:]), mine[:, 3:4], torch.zeros_like(mine[:, :1])], 1)

    def even(self, shares: Tensor) -> Tensor:
        """Albedo (P, 3) of the recipe if each coat were of one colour."""
        return torch.sigmoid(shares @ self.level)

    def hold(self) -> Tensor:
        """Squared norm of the moves, mean over the coats."""
        return self.bounded().square().sum(1).mean()

    def moved(self, recipe: Recipe) -> Recipe:
        """The recipe with the moves in it."""
        offsets = self.bounded().detach().cpu().double().numpy()
        return recipe.with_coats([_moved(coat, row) for coat, row in zip(recipe.coats, offsets, strict=True)])


def told(before: Recipe, after: Recipe) -> list[str]:
    """A line for each coat that moved."""
    lines = []
    for old, new in zip(before.coats, after.coats, strict=True):
        numbers = [("colour", _hex(old), _hex(new)), ("contrast", f"{old.contrast:.2f}", f"{new.contrast:.2f}")]
        if old.roughness is not None and new.roughness is not None:
            numbers.insert(1, ("roughness", f"{old.roughness:.2f}", f"{new.roughness:.2f}"))
        changed = [f"{name} {a} to {b}" for name, a, b in numbers if a != b]
        lines += [f"{old.said or old.look}: moved {', '.join(changed)}"] if changed else []
    return lines


def _hex(coat: Coat) -> str:
    return "" if coat.color is None else "#" + "".join(f"{round(255 * c):02x}" for c in coat.color)


def _level(coat: Coat) -> list[float]:
    """Logits of a coat's linear colour."""
    linear = srgb_decode(np.array(coat.color or (0.5, 0.5, 0.5))).clip(MARGIN, 1 - MARGIN)
    return np.log(linear / (1 - linear)).tolist()


def _moved(coat: Coat, row: np.ndarray) -> Coat:
    color, rough = coat.color, coat.roughness
    if color is not None:
        red, green, blue = srgb_encode(_shifted(srgb_decode(np.array(color)), row[:3])).tolist()
        color = red, green, blue
    if rough is not None:
        rough = float(_shifted(np.array(rough), row[3]))
    return replace(coat, color=color, roughness=rough, contrast=float(coat.contrast * np.exp(row[4])))


def _shifted(value: np.ndarray, logits: np.ndarray) -> np.ndarray:
    """As `material.residual.combined`: values moved on the scale of logits, exactly the same where these are 0."""
    inside = value.clip(MARGIN, 1 - MARGIN)
    moved = 1 / (1 + np.exp(-(np.log(inside / (1 - inside)) + logits)))
    return (value + moved - inside).clip(0, 1)
