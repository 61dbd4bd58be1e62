"""Rays for an error that was asked for: measured on a few windows of the first view, then extrapolated."""

import math

import numpy as np
import torch
from numpy.typing import NDArray

from stages.core.color import reinhard
from stages.core.errors import InputError
from stages.core.shading import light_maps
from stages.light.environment import Environment
from stages.light.gbuffer import GBuffer
from stages.light.light_set import MAX_LIGHTS
from stages.light.scene import Scene
from stages.light.transport import QUALITY, Quality, cached_light_set, integrate

WINDOWS, SIDE = 6, 32
"""Windows that are measured, and their side in pixels: wide enough for smoothing to work as it does in a whole view."""

FACTORS = (0.25, 1.0)
"""Multiples of the standard quality's rays that are measured."""

TRUTH = Quality(768, 384, extra=False, smooth=False)

FALL = (0.3, 0.6)
"""The error falls with rays to the power of minus this; measured, and held to what was seen on many meshes."""

STEP = math.sqrt(2.0)
LIMITS = (0.125, 64.0)
"""Multiples of the standard quality that can be chosen, a STEP apart."""


def choose_quality(
    scene: Scene, points: GBuffer, lights: list[Environment], target: float, seed: int
) -> tuple[Quality, float]:
    """The cheapest quality predicted to reach an error, and what it is expected to reach.

    Args:
        points: of one view. target: tone-mapped RMSE, percent, of the worst light map under the worst environment.
    Raises: InputError when it is out of reach.
    """
    low, high = LIMITS
    some = points[windows(points, seed)]
    if len(some.n) == 0:
        return QUALITY["standard"].scaled(low), 0.0
    few, one = measured(scene, some, lights, [QUALITY["standard"].scaled(f) for f in FACTORS], seed)
    fall = float(np.clip(math.log(max(few, 1e-9) / max(one, 1e-9)) / math.log(FACTORS[1] / FACTORS[0]), *FALL))
    factor = low
    while one * factor**-fall > target and factor < high:
        factor *= STEP
    expected = one * factor**-fall
    if expected > target:
        raise InputError(f"--error {target:g}: {expected:.2g} % is what {high:g} times the standard rays reach; ask for that")
    return QUALITY["standard"].scaled(factor), expected


def measured(
    scene: Scene, points: GBuffer, lights: list[Environment], qualities: list[Quality], seed: int
) -> list[float]:
    """Error of each quality at some points, percent: of the worst light map under the worst environment."""
    worst = [0.0] * len(qualities)
    for first in range(0, len(lights), MAX_LIGHTS):
        light_set = cached_light_set(tuple(lights[first : first + MAX_LIGHTS]))
        truth = integrate(scene, points, light_set, TRUTH, seed + 1)
        for i, quality in enumerate(qualities):
            for a, b in zip(integrate(scene, points, light_set, quality, seed), truth, strict=True):
                error = reinhard(light_maps(a)) - reinhard(light_maps(b))
                worst[i] = max(worst[i], 100 * float(torch.sqrt(error.double().square().mean((0, 2))).max()))
    return worst


def windows(points: GBuffer, seed: int) -> NDArray[np.int64]:
    """Rows of the points in some windows around random object pixels, ascending."""
    y, x = np.nonzero(points.mask)
    if len(y) == 0:
        return np.zeros(0, np.int64)
    chosen = np.random.default_rng(seed).integers(len(y), size=WINDOWS)
    inside = [(np.abs(y - y[i]) <= SIDE // 2) & (np.abs(x - x[i]) <= SIDE // 2) for i in chosen]
    return np.flatnonzero(np.any(inside, 0))
