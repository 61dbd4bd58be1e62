"""Blender's Filmic view transform, per channel: what the pictures that the ControlNet was trained on look like.

The curve is 65 points measured in Blender, evenly spaced in log2 of radiance from 0.000176 to 16.3 and linear in it between
them; within 5e-4 of Blender there. Radiance 1 is 0.807.
"""

import functools
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

FILE = Path(__file__).with_name("filmic.csv")


def filmic(radiance: Tensor) -> Tensor:
    """Display value of linear radiance >= 0.

    Below the curve it falls linearly to 0 at 0. Above it, where Blender shows 1, it goes on as the curve ends, by 0.011 a stop
    (1.13 at 65,000), so that a highlight keeps a gradient.

    Differentiable in: radiance, with a finite positive gradient everywhere.
    """
    value, start, step = _curve(radiance.dtype, radiance.device)
    black = 2.0**start
    x = (torch.log2(radiance.clamp(min=black)) - start) / step
    left = x.detach().long().clamp(0, len(value) - 2)
    y = value[left] + (x - left) * (value[left + 1] - value[left])
    return torch.where(radiance < black, radiance * (value[0] / black), y)


@functools.cache
def _curve(dtype: torch.dtype, device: torch.device) -> tuple[Tensor, float, float]:
    """The value of each point (65,); log2 of the first radiance, and its step from point to point."""
    _, radiance, value = np.loadtxt(FILE, delimiter=",").T
    stops = np.log2(radiance)
    return torch.from_numpy(value).to(device, dtype), float(stops[0]), float(stops[-1] - stops[0]) / (len(stops) - 1)
