"""What was learnt on top of a recipe, as it is stored: its sizes and its numbers, without the tensors that learn.

`stages.material.residual` is the same while it learns, and explains it. Who only evaluates it, as `bake` does, need not spend
the two seconds that tensors take to load.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FEATURES = 2
"""Features per table entry."""

OUTPUTS = 5
"""Red, green and blue of the albedo, roughness, metallic."""

MARGIN = 0.03
"""A recipe's values are kept this far from 0 and 1 before the logit, where the sigmoid has no slope left to learn by."""

HASH_PRIMES = (1, 2654435761, 805459861)
"""Source: Müller et al. 2022, Equation 4."""


@dataclass(frozen=True)
class ResidualConfig:
    """Sizes of the residual; the defaults are the paper's.

    levels: grids, coarse to fine. log2_entries: most table entries of a level, as a power of two. base: cells along an
    axis of the coarsest level. growth: ratio of cells between levels. hidden: width of the network's one hidden layer.
    """

    levels: int = 16
    log2_entries: int = 19
    base: int = 16
    growth: float = 1.4473
    hidden: int = 64

    @staticmethod
    def for_detail(spacing: float) -> "ResidualConfig":
        """The paper's sizes with just enough levels that the finest cell is no longer than `spacing` (world units)."""
        paper = ResidualConfig()
        wanted = math.log(max(1.0 / (spacing * paper.base), 1.0)) / math.log(paper.growth)
        return ResidualConfig(levels=min(1 + math.ceil(wanted), paper.levels))

    def resolution(self, level: int) -> int:
        """Cells along one axis of a level."""
        return math.floor(self.base * self.growth**level)

    def entries(self, level: int) -> int:
        """Table entries of a level."""
        return min((self.resolution(level) + 1) ** 3, 2**self.log2_entries)

    def layout(self) -> NDArray[np.int64]:
        """Resolution, first table row and number of rows of every level: (levels, 3)."""
        counts = [self.entries(level) for level in range(self.levels)]
        starts = np.cumsum([0, *counts[:-1]])
        return np.stack([[self.resolution(level) for level in range(self.levels)], starts, counts], 1).astype(np.int64)

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shape of each parameter by name."""
        rows, inputs = int(self.layout()[:, 2].sum()), self.levels * FEATURES
        network = {"weights_0": (self.hidden, inputs), "bias_0": (self.hidden,)}
        return {"table": (rows, FEATURES), **network, "weights_1": (OUTPUTS, self.hidden), "bias_1": (OUTPUTS,)}


@dataclass(frozen=True)
class StoredResidual:
    """A residual as material.npz holds it. arrays: its parameters by name, float32, of `ResidualConfig.shapes`."""

    config: ResidualConfig
    arrays: dict[str, NDArray[np.float32]]

    @staticmethod
    def of(config: dict[str, Any], arrays: dict[str, NDArray]) -> "StoredResidual":
        """From ResidualConfig as a dict, and arrays of which some are the parameters.

        Raises: KeyError, TypeError or ValueError if they disagree.
        """
        known = ResidualConfig(**config)
        for name, shape in known.shapes().items():
            if arrays[name].shape != shape:
                raise ValueError(f"'{name}' is {arrays[name].shape}, expected {shape}")
        return StoredResidual(known, {name: np.asarray(arrays[name], np.float32) for name in known.shapes()})

    def to_arrays(self) -> dict[str, NDArray[np.float32]]:
        """The parameters by name."""
        return self.arrays


def with_residual(base: NDArray[np.float32], residual: NDArray[np.float32]) -> NDArray[np.float32]:
    """`stages.material.residual.combined` of arrays. Args: (P, 5) each. Returns: (P, 5)."""
    inside = np.clip(base, np.float32(MARGIN), np.float32(1 - MARGIN))
    moved = 1 / (1 + (1 / inside - 1) * np.exp(np.minimum(-residual, 80)))  # the sigmoid of the logit and what is added to it
    return np.clip(base + moved - inside, 0, 1).astype(np.float32)
