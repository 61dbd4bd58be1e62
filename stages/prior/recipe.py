"""What a material is made of, as a procedure that gives every point of a surface its albedo, roughness and metallic.

A recipe is a base coat, or two coats and where the second one lies: trim on the edges, top and base, spots, stripes,
patches, crevices. It reads the surface by position, convexity and occlusion, never by UV. The prior is taught with
random recipes, and a prompt is read as one, from which distillation starts.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from stages.core.color import srgb_decode
from stages.prior.patterns import DARK_BELOW, LEVEL, PATTERNS, average, fbm, noise, placement

LAYOUTS = ("none", "edges", "top", "spots", "stripes", "patches", "crevices")
"""Ways to lay a second coat over the first."""

BOUND = ("edges", "top", "crevices")
"""Those that the surface decides, not chance."""


@dataclass(frozen=True)
class Surface:
    """Points of a shape. point, normal: (P, 3) world. convexity: (P,), -1 in a crease to 1 on an edge.

    occlusion: (P,), share of the hemisphere that is blocked.
    """

    point: NDArray[np.float32]
    normal: NDArray[np.float32]
    convexity: NDArray[np.float32]
    occlusion: NDArray[np.float32]


@dataclass(frozen=True)
class Coat:
    """One substance. color: sRGB (3,) at the pattern's zero; second: sRGB (3,) at its one.

    scale: pattern units per object size. turn, shift: the pattern's placement.
    """

    color: NDArray
    second: NDArray
    roughness: float
    roughness_spread: float
    metallic: float
    pattern: str
    scale: float
    turn: NDArray
    shift: NDArray

    def evaluate(self, surface: Surface) -> NDArray[np.float32]:
        """(P, 5): linear albedo (3), roughness, metallic."""
        p = (surface.point * self.scale) @ self.turn.T + self.shift
        value = PATTERNS[self.pattern](p)[:, None]
        color = np.clip(self.color + (self.second - self.color) * value, 0.012, 0.985)
        roughness = np.clip(self.roughness + self.roughness_spread * value, 0.0, 1.0)
        metallic = np.full_like(roughness, self.metallic)
        return np.concatenate([srgb_decode(color), roughness, metallic], 1).astype(np.float32)


SCALES = 2.5, 6.0
"""Pattern units per object size that a coat is drawn with: fine enough to hold many of them."""


def draw_coat(rng: Generator, mean: NDArray, spread: NDArray, pattern: str) -> Coat:
    """A coat of a given mean, its pattern's placement left to chance.

    Args:
        mean: (5,) sRGB albedo, roughness, metallic. spread: (2,) how far sRGB and roughness go from the pattern's zero to
        its one.
    """
    step = spread[0] * (1 + rng.normal(0, 0.12, 3)) * (1 if pattern in DARK_BELOW else -1)
    middle = average(pattern)
    color, roughness = mean[:3] - middle * step, float(mean[3] - middle * spread[1])
    scale = float(np.exp(rng.uniform(*np.log(SCALES))))
    turn, shift = placement(rng, pattern in LEVEL)
    return Coat(color, color + step, roughness, float(spread[1]), float(mean[4]), pattern, scale, turn, shift)


@dataclass(frozen=True)
class Layout:
    """Where the second coat lies. kind: one of `LAYOUTS`. amount: share or level, [0, 1]. shift: (3,) of its noise."""

    kind: str
    amount: float
    frequency: float
    axis: NDArray
    shift: NDArray


def draw_layout(rng: Generator, kind: str, coarsest: float = 1.2) -> Layout:
    """A layout of a kind, what is left open drawn. coarsest: least frequency of its spots and stripes."""
    return Layout(kind, rng.uniform(0, 1), rng.uniform(coarsest, 1.8), rng.normal(size=3), rng.uniform(0, 32, 3))


@dataclass(frozen=True)
class Recipe:
    """Coats, and where the second one lies; None where there is but one."""

    coats: tuple[Coat, ...]
    layout: Layout | None = None

    def evaluate(self, surface: Surface) -> NDArray[np.float32]:
        """(P, 5): linear albedo (3), roughness, metallic."""
        base = self.coats[0].evaluate(surface)
        if self.layout is None:
            return base
        cover = coverage(self.layout, surface)[:, None]
        return base + (self.coats[1].evaluate(surface) - base) * cover


def coverage(layout: Layout, surface: Surface) -> NDArray[np.float32]:
    """Share of the second coat at each point, (P,) in [0, 1]; its borders are narrow."""
    p = surface.point
    wobble = fbm(p * 5 + layout.shift, 2)
    if layout.kind == "edges":
        return ramp(surface.convexity + 0.06 * wobble, 0.22 + 0.15 * layout.amount, 0.06)
    if layout.kind == "top":
        return ramp(p[:, 2] + 0.02 * wobble, 0.24 * (layout.amount - 0.5), 0.012)
    if layout.kind == "spots":
        return ramp(noise(p * 7 * layout.frequency + layout.shift), 0.2 + 0.25 * layout.amount, 0.06)
    if layout.kind == "stripes":
        axis = layout.axis if layout.amount < 0.4 else np.array([0.0, 0, 1])
        phase = p @ (axis / np.linalg.norm(axis)) * 26 * layout.frequency
        return ramp(np.sin(phase + layout.shift[0]), 0.0, 0.15)
    if layout.kind == "patches":
        return ramp(fbm(p * 2.2 * layout.frequency + layout.shift, 4), 0.25 * layout.amount, 0.06)
    hidden = np.maximum(surface.occlusion - 0.25, -surface.convexity * 0.9)
    return ramp(hidden + 0.15 * wobble, 0.12 + 0.1 * layout.amount, 0.08)


def ramp(x: NDArray, edge: float, width: float) -> NDArray[np.float32]:
    """0 below the edge, 1 above, a straight ramp of twice the width between."""
    return np.clip((x - edge) / (2 * width) + 0.5, 0, 1).astype(np.float32)
