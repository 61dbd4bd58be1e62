"""How the weights of a run change with its progress.

The paper's numbers are for 3,000 steps; here each is a share of the steps, so that a short run passes through the same
stages. `progress` is steps done / steps in all, in [0, 1).
"""

import math

STEPS = 3000
"""The run that the numbers below were given for (Zhang et al. 2024, and the released code)."""

ETA2_STEPS = 2000 / STEPS
EARLY_STEPS = 500 / STEPS
EARLY_TIMES = (200, 800)
LATE_TIMES = (20, 500)
"""Diffusion times of 1,000, drawn uniformly: structure first, then detail."""

CONTROL_STEPS = 700 / STEPS
CONTROL_END = 0.8

BIMODAL_START = 0.5
RATE_HOLD = 0.4
RATE_END = 0.02


def _ramp(progress: float, start: float, end: float) -> float:
    """0 before `start`, 1 after `end`, linear between."""
    return min(max((progress - start) / (end - start), 0.0), 1.0)


def eta2(progress: float, start: float, end: float) -> float:
    """Weight of the negative prediction: linear from start to end over the first two thirds."""
    return start + (end - start) * _ramp(progress, 0.0, ETA2_STEPS)


def time_range(progress: float) -> tuple[int, int]:
    """First and last diffusion time, both inclusive."""
    return EARLY_TIMES if progress < EARLY_STEPS else LATE_TIMES


def control_scale(progress: float) -> float:
    """Strength of the geometry and light conditions: from 1 to 0.8, gradually, by step 700 of 3,000."""
    return 1.0 + (CONTROL_END - 1.0) * _ramp(progress, 0.0, CONTROL_STEPS)


def bimodal(progress: float) -> float:
    """Share of the weight that pulls metallic to 0 or 1: nothing in the first half, then growing to all of it."""
    return _ramp(progress, BIMODAL_START, 1.0)


def learning_rate(progress: float) -> float:
    """Share of the learning rate: held, then falling by a half cosine, so that the last steps average out the noise."""
    fall = _ramp(progress, RATE_HOLD, 1.0)
    return RATE_END + (1 - RATE_END) * 0.5 * (1 + math.cos(math.pi * fall))
