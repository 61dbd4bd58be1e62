"""How far relief may go: it must be seen in the light, and never fight the mesh that it lies on.

A recipe holds true heights; how strongly they are shown is asked for where they are written (`bake --relief`), so that the
same material, learnt once, can be baked flat or deep. """

import numpy as np

from stages.core.parallel import compiled
from stages.material.surface import Array

HIGHEST = 0.02
"""How far relief may stand out or be sunk, object sizes: what is larger is the mesh's own business."""

STEEPEST = 2.0
"""Slope of the steepest side that is shown, 63 degrees: a step narrower than a texel has no other slope than that."""


def bounded(height: Array, relief: float) -> Array:
    """Heights as they are shown: multiplied, and bent softly towards `HIGHEST`. Args: height: object sizes."""
    asked = np.float32(relief) * height
    return (np.float32(HIGHEST) * np.tanh(asked / np.float32(HIGHEST))).astype(np.float32)


def gentle(gradient: Array, axis: int = -1) -> Array:
    """Gradients no longer than `STEEPEST`, their direction kept. Args: axis: of the components."""
    length = np.linalg.norm(gradient, axis=axis, keepdims=True)
    return gradient * np.minimum(1, STEEPEST / np.maximum(length, STEEPEST / 2))


@compiled(inline="always")
def bend(above, here, below, columns, across, down):  # type: ignore[no-untyped-def]
    """Variance along one axis of the slopes within a texel, which its one normal does not tell; as the surface through its
    neighbours' heights has it, slopes being spread evenly from one border to the other.

    Source: Olano & Baker 2010, "LEAN Mapping" (variance of slopes, kept for roughness).

    Args: three rows of heights. columns: of the texel's left neighbour, its own, the right one's. across, down: texels that
    are as long as a unit of height.
    """
    left, middle, right = columns
    twist = (below[right] - below[left] - above[right] + above[left]) / 4
    changes = (
        (here[left] + here[right] - 2 * here[middle]) * across,
        (above[middle] + below[middle] - 2 * here[middle]) * down,
        twist * across,
        twist * down,
    )
    total = 0.0
    for change in changes:
        total += min(change * change, STEEPEST * STEEPEST)  # no slope is shown that is steeper
    return total / 24  # of evenly spread values over the width squared 1/12, of two axes
