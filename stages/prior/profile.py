"""What the prior sees: its tone curve, its exposure and its 23 condition channels. Training and guidance share them.

Convention: images are S x S point samples on black; radiance is linear and exposed by `exposure` before the tone curve,
images and light maps alike. Conditions lie in [0, 1] (bright light maps a little above); dropped ones are `DROPPED`.
"""

import math

import torch
from torch import Tensor

from stages.core.color import luminance
from stages.core.depth import inverse_depth

SIZE = 64
"""Pixels along an edge of the model's images."""

TONE_GAIN = 20.0
TONE_WHITE = 32.0
"""Radiance that the tone curve maps to 1; a sun's mirror image goes beyond."""

TARGET = 0.6
"""Luminance to which `exposure` brings the mean of the white, rough light map over the object."""

DROPPED = -1.0
"""Value of every pixel of a condition that is not given."""

CHANNELS = 23
GEOMETRY = [0, 1, 2, 3, 22]
LIGHT = slice(4, 22)
"""Channels of inverse depth, normal and height, and of the light maps."""


def tone(radiance: Tensor) -> Tensor:
    """log(1 + 20 x) / log(1 + 20 * 32): linear near black, logarithmic above. Differentiable in: radiance (>= 0)."""
    return torch.log1p(TONE_GAIN * radiance) / math.log1p(TONE_GAIN * TONE_WHITE)


def untone(encoded: Tensor) -> Tensor:
    """Radiance whose `tone` this is."""
    return torch.expm1(encoded * math.log1p(TONE_GAIN * TONE_WHITE)) / TONE_GAIN


def profile_tone(radiance: Tensor) -> Tensor:
    """Radiance as the model's images hold it: 0 becomes -1, `TONE_WHITE` becomes 1. Differentiable in: radiance."""
    return 2 * tone(radiance) - 1


def exposure(lights: Tensor, mask: Tensor) -> Tensor:
    """Factor that brings each image and its light maps to the model's brightness.

    Args:
        lights: (B, 18, S, S) linear radiance. mask: (B, 1, S, S).
    Returns:
        (B, 1, 1, 1); 1 where the object is unlit.
    """
    white = luminance(lights[:, 6:9].movedim(1, -1))[:, None]  # metallic 0, roughness 1
    mean = (white * mask).sum((1, 2, 3), keepdim=True) / mask.sum((1, 2, 3), keepdim=True).clamp(min=1)
    return torch.where(mean > 1e-6, TARGET / mean.clamp(min=1e-6), torch.ones_like(mean))


def prepare(depth: Tensor, normal: Tensor, height: Tensor, mask: Tensor, lights: Tensor) -> Tensor:
    """The condition channels.

    Args:
        depth: (B, 1, S, S) planar. normal: (B, 3, S, S) view space, unit. height: (B, 1, S, S) over
        the object's middle, in object sizes: where top and base are, also in a crop. mask: (B, 1, S, S), 0 or 1.
        lights: (B, 18, S, S) exposed linear radiance, maps in the order of `core.shading.LIGHT_MAPS`.
    Returns:
        (B, 23, S, S): inverse depth in [0.3, 1] per image (METHOD.md), normal / 2 + 0.5, toned light maps, height + 0.5.
    """
    inside = mask > 0.5
    background = torch.tensor([0.5, 0.5, 1.0], dtype=normal.dtype, device=normal.device)[:, None, None]
    direction = torch.where(inside, normal * 0.5 + 0.5, background)
    others = (torch.where(inside, values, 0.0) for values in (tone(lights), height + 0.5))
    return torch.cat([inverse_depth(depth, inside), direction, *others], 1)


def drop(conditions: Tensor, geometry: Tensor, light: Tensor) -> Tensor:
    """Conditions with parts taken away. Args: geometry, light (B,) bool, which images lose that part."""
    out = conditions.clone()
    out[:, GEOMETRY] = torch.where(geometry[:, None, None, None], DROPPED, out[:, GEOMETRY])
    out[:, LIGHT] = torch.where(light[:, None, None, None], DROPPED, out[:, LIGHT])
    return out
