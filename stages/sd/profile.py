"""What the released light- and geometry-aware ControlNet was trained on: its 22 condition channels and its pictures.

| channel | content |
|---|---|
| 0 | inverse depth in [0.3, 1] per image; background 0 |
| 1-3 | view-space normal, x right, y up, z to the viewer: 0.5 - 0.5 x, 0.5 + 0.5 y, 0.5 + 0.5 z; background (0.5, 0.5, 1) |
| 4-21 | light maps RGB in the order of `core.shading.LIGHT_MAPS`, Filmic; background 0 |

All in [0, 1]. Pictures are Filmic too, on white.
"""

import torch
from torch import Tensor

from stages.core.depth import inverse_depth
from stages.sd.filmic import filmic

CHANNELS = 22
GEOMETRY = slice(0, 4)
LIGHT = slice(4, 22)


def prepare(depth: Tensor, normal: Tensor, mask: Tensor, lights: Tensor) -> Tensor:
    """The condition channels.

    Args:
        depth: (B, 1, S, S) planar. normal: (B, 3, S, S) view space, unit. mask: (B, 1, S, S), 0 or 1.
        lights: (B, 18, S, S) linear radiance under the environment as it is.
    Returns:
        (B, 22, S, S).
    """
    inside = mask > 0.5
    x, y, z = normal.split(1, 1)
    direction = [torch.where(inside, 0.5 + 0.5 * n, background) for n, background in ((-x, 0.5), (y, 0.5), (z, 1.0))]
    toned = torch.where(inside, filmic(lights).clamp(max=1.0), 0.0)
    return torch.cat([inverse_depth(depth, inside), *direction, toned], 1)


def background() -> Tensor:
    """The condition channels off the object, (22, 1, 1)."""
    nothing = torch.zeros(1, 1, 1, 1)
    return prepare(nothing, nothing.expand(1, 3, 1, 1), nothing, nothing.expand(1, 18, 1, 1))[0]


def without(conditions: Tensor, geometry: bool, light: bool) -> Tensor:
    """The same conditions with geometry, light, or both set to 0: the paper's ablations."""
    kept = conditions.clone()
    if geometry:
        kept[:, GEOMETRY] = 0.0
    if light:
        kept[:, LIGHT] = 0.0
    return kept


def picture(radiance: Tensor, mask: Tensor) -> Tensor:
    """Pictures as the model knows them. Differentiable in: radiance.

    Args:
        radiance: (B, 3, S, S) linear. mask: (B, 1, S, S), 0 or 1.
    Returns:
        (B, 3, S, S) in [0, 1], a highlight of over 16 a little above; 1 off the object.
    """
    return torch.where(mask > 0.5, filmic(radiance), 1.0)
