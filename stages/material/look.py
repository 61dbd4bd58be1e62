"""What a substance looks like at some points: colour, roughness, metallic and height, made of the same events."""

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stages.core.color import from_oklab as from_any_oklab
from stages.core.color import srgb_decode, to_oklab
from stages.core.parallel import compiled
from stages.material.place import Place

Array = NDArray[Any]
"""float32, or what it was mixed with."""


class Look(NamedTuple):
    """color: (3, P) linear Rec. 709. roughness, metallic: (P,) or a number. height: (P,) or a number, metres above the
    surface, about 0 on average. dye: (P,) or a number, how far a colour that words name applies here: a brick's clay takes
    it, its mortar does not. """

    color: Array
    roughness: Array | float
    metallic: Array | float = 0.0
    height: Array | float = 0.0
    dye: Array | float = 1.0


Substance = Callable[[Place], Look]
"""A substance is a function of the place: small, readable, beside its kin in `looks/`."""


def over(below: Look, above: Look, cover: Array) -> Look:
    """One look where it covers, the other elsewhere. Args: cover (P,) 0 … 1."""
    return Look(*(mix(a, b, cover) for a, b in zip(below, above, strict=True)))


STEPS = 256


@cache
def _ramp(stops: tuple[str, ...]) -> Array:
    """(3, STEPS) linear colours between sRGB hex colours, evenly spaced, mixed in OKLab."""
    linear = srgb_decode(np.array([[int(c[i : i + 2], 16) / 255 for i in (1, 3, 5)] for c in stops])).T  # (3, N)
    lab = to_oklab(linear)
    at, known = np.linspace(0, 1, STEPS), np.linspace(0, 1, len(stops))
    return from_oklab(np.stack([np.interp(at, known, axis) for axis in lab])).astype(np.float32)


def palette(t: Array, *stops: str) -> Array:
    """Colours along evenly spaced sRGB hex stops. Args: t (P,), clamped to 0 … 1. Returns: (3, P) linear."""
    t = np.ascontiguousarray(t, np.float32)
    color = np.empty((3, len(t)), np.float32)
    _along_ramp(_ramp(stops if len(stops) > 1 else stops * 2), t, color)
    return color


@compiled
def _along_ramp(ramp, t, color):  # type: ignore[no-untyped-def]
    for i in range(len(t)):
        x = min(max(t[i], np.float32(0)), np.float32(1)) * np.float32(STEPS - 1.001)
        low = int(x)
        within = x - np.float32(low)
        for c in range(3):
            color[c, i] = ramp[c, low] + (ramp[c, low + 1] - ramp[c, low]) * within


def mix(a: Array | float, b: Array | float, t: Array | float) -> Array:
    """From a at t = 0 to b at 1. Args: (3, P) or (P,) or numbers; t (P,)."""
    return np.asarray(a + (b - a) * t)


def shade(color: Array, amount: Array) -> Array:
    """Lighter (amount > 0) or darker, in natural logarithms of the luminance. Args: color (3, P); amount (P,)."""
    return color * np.exp(np.clip(amount, -3, 1.5))


WARM = np.array([[0.45], [0.0], [-0.75]], np.float32)
GREEN = np.array([[-0.45], [0.3], [-0.3]], np.float32)


def tint(color: Array, warm: Array, green: Array | float = 0.0) -> Array:
    """Hue shifted along warm–cold and green–magenta at about the same luminance; 0.05 is just seen. Args: (3, P); (P,)."""
    return color * np.exp(WARM * warm + GREEN * green)


def from_oklab(lab: NDArray) -> NDArray:
    """OKLab to linear Rec. 709, clamped to 0 … 1. Args: (3, P). Returns: (3, P)."""
    return np.clip(from_any_oklab(lab), 0, 1)


def each(t: Array, shown: Array | float, *stops: str) -> Array:
    """Colours of units that differ, and the mean of all where the footprint hides single ones.

    Args: t (P,) a random number of the unit that a point lies in; shown (P,) 0 … 1, see `patterns.fading`; stops sRGB hex.
    Returns: (3, P).
    """
    mean = _ramp(stops if len(stops) > 1 else stops * 2).mean(1, keepdims=True)
    return mean + (palette(t, *stops) - mean) * shown


@cache
def _blurred(stops: tuple[str, ...]) -> Array:
    """(BLURS, 3, STEPS) the ramp averaged over a normal distribution of its argument, of deviation 0 … 1 in even steps."""
    known = np.linspace(0, 1, STEPS)
    wide = np.linspace(-3, 4, 7 * STEPS)
    ramp = np.stack([np.interp(wide, known, axis) for axis in _ramp(stops)])
    out = [_ramp(stops)]
    for deviation in np.linspace(0, 1, BLURS)[1:]:
        weights = np.exp(-0.5 * ((known[:, None] - wide) / deviation) ** 2)
        out.append((ramp @ (weights / weights.sum(1, keepdims=True)).T).astype(np.float32))
    return np.stack(out)


BLURS = 17


def averaged(t: Array, hidden: Array, *stops: str) -> Array:
    """`palette` of a noise of which the footprint hides a part: the mean colour over what is hidden.

    Args: t (P,); hidden (P,) deviation of the hidden part in units of t, see `patterns.lost`; stops sRGB hex.
    Returns: (3, P) linear.
    """
    ramps = _blurred(stops if len(stops) > 1 else stops * 2)
    x = (np.clip(t, 0, 1) * np.float32(STEPS - 1) + np.float32(0.5)).astype(np.int32)
    y = np.clip(hidden, 0, 1) * np.float32(BLURS - 1.001)
    low = y.astype(np.int32)
    sharp, soft = ramps[low, :, x].T, ramps[low + 1, :, x].T
    return sharp + (soft - sharp) * (y - low)
