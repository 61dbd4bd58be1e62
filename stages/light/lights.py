"""The five environments the project makes itself, and a sixth that only previews use.

Each is a function of nothing: latitude-longitude, z up, the object's front on +x. Radiance is HDR and its scale such
that a white diffuse surface facing the main light comes out near 0.5-1 in the day lights.
"""

import functools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from stages.light.environment import Environment, directions_of_texels

HEIGHT = 256
"""Rows of a generated light; 0.7 degrees a texel."""


def direction(azimuth: float, elevation: float) -> NDArray[np.float64]:
    """Unit vector at an azimuth from +x and an elevation from the horizon, degrees."""
    a, e = np.radians(azimuth), np.radians(elevation)
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def disc(w: NDArray, towards: NDArray, radius: float, softness: float) -> NDArray[np.float64]:
    """1 within an angular radius of a direction, falling smoothly to 0 over `softness`; degrees. Returns: (H, W)."""
    angle = np.degrees(np.arccos((w @ towards).clip(-1, 1)))
    x = ((radius + softness - angle) / softness).clip(0, 1)
    return x * x * (3 - 2 * x)


def panel(w: NDArray, towards: NDArray, width: float, height: float, softness: float = 0.06) -> NDArray[np.float64]:
    """A rectangular light facing the object at distance 1: 1 inside, soft edges. width, height: world units."""
    up = np.array([0.0, 0.0, 1.0]) if abs(towards[2]) < 0.95 else np.array([1.0, 0.0, 0.0])
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    top = np.cross(towards, right)
    depth = w @ towards
    ahead = np.maximum(depth, 1e-6)
    x, y = np.abs(w @ right) / ahead, np.abs(w @ top) / ahead
    inside = ((width / 2 - x) / softness + 0.5).clip(0, 1) * ((height / 2 - y) / softness + 0.5).clip(0, 1)
    return inside * (depth > 0)


def gradient(w: NDArray, ground: tuple, horizon: tuple, zenith: tuple, haze: float = 0.5) -> NDArray[np.float64]:
    """A sky over a ground: colours at straight down, at the horizon and straight up. haze: exponent. (H, W, 3)."""
    z = w[..., 2:3]
    sky = np.array(horizon) + (np.array(zenith) - np.array(horizon)) * z.clip(0, 1) ** haze
    floor = np.array(horizon) * 0.6 + (np.array(ground) - np.array(horizon) * 0.6) * (-z).clip(0, 1) ** 0.3
    blend = (z / 0.04 + 0.5).clip(0, 1)
    return floor * (1 - blend) + sky * blend


def _make(name: str, radiance: NDArray) -> Environment:
    return Environment(name, np.ascontiguousarray(radiance, np.float32))


def _texels() -> NDArray[np.float64]:
    return directions_of_texels(HEIGHT, 2 * HEIGHT)[0]


@functools.cache
def clear_sky() -> Environment:
    """Blue sky, brown ground, and a sun of 1.2 degrees at 42 degrees of elevation."""
    w = _texels()
    sun = direction(35, 42)
    light = gradient(w, (0.10, 0.08, 0.06), (0.45, 0.52, 0.60), (0.10, 0.20, 0.48), 0.45)
    glow = np.exp(-np.degrees(np.arccos((w @ sun).clip(-1, 1))) / 12.0)[..., None] * np.array([0.8, 0.7, 0.5])
    return _make("clear_sky", light + glow + disc(w, sun, 0.9, 0.6)[..., None] * np.array([2500.0, 2250.0, 1900.0]))


@functools.cache
def overcast() -> Environment:
    """A white sky three times as bright at the zenith as at the horizon (CIE overcast), dim grey ground."""
    w = _texels()
    z = w[..., 2:3]
    sky = (1 + 2 * z.clip(0, 1)) / 3 * np.array([0.92, 0.96, 1.02])
    ground = np.array([0.16, 0.155, 0.15])
    blend = (z / 0.05 + 0.5).clip(0, 1)
    return _make("overcast", ground * (1 - blend) + sky * blend)


@functools.cache
def studio() -> Environment:
    """A dark room with a large key, a cool fill, a warm rim strip and a top light."""
    w = _texels()
    light = np.full((*w.shape[:2], 3), 0.025) + gradient(w, (0.05,) * 3, (0.03,) * 3, (0.02,) * 3)
    for towards, width, height, colour in (
        (direction(50, 35), 0.9, 0.9, (6.5, 6.2, 5.8)),
        (direction(-60, 15), 0.7, 1.1, (1.7, 2.0, 2.4)),
        (direction(165, 25), 0.25, 1.6, (6.0, 5.1, 4.0)),
        (direction(0, 88), 0.8, 0.5, (4.0, 4.0, 4.0)),
    ):
        light = light + panel(w, towards, width, height)[..., None] * np.array(colour)
    return _make("studio", light)


@functools.cache
def interior() -> Environment:
    """A room with warm walls, a white ceiling, a wooden floor, two windows and a lamp."""
    w = _texels()
    light = gradient(w, (0.10, 0.06, 0.035), (0.30, 0.25, 0.19), (0.42, 0.40, 0.36), 0.8)
    for azimuth in (70, 118):
        window = panel(w, direction(azimuth, 12), 0.55, 0.8, 0.03)
        bars = 1 - panel(w, direction(azimuth, 12), 0.04, 0.8, 0.02)
        light = light + (window * bars)[..., None] * np.array([5.5, 6.2, 7.2])
    lamp = disc(w, direction(-95, 38), 4.0, 1.5)[..., None] * np.array([60.0, 42.0, 22.0])
    return _make("interior", light + lamp)


@functools.cache
def night() -> Environment:
    """A dark blue sky with a small moon, and sodium lamps and lit windows along the horizon."""
    w = _texels()
    light = gradient(w, (0.004, 0.004, 0.005), (0.035, 0.03, 0.035), (0.006, 0.010, 0.025), 0.4)
    light = light + disc(w, direction(-40, 50), 1.2, 0.6)[..., None] * np.array([95.0, 105.0, 125.0])
    generator = np.random.default_rng(7)
    for azimuth in np.linspace(0, 360, 9)[:-1] + generator.uniform(-14, 14, 8):
        lamp = disc(w, direction(azimuth, generator.uniform(6, 16)), 1.3, 0.7)
        light = light + lamp[..., None] * np.array([46.0, 27.0, 9.0]) * generator.uniform(0.5, 1.3)
    for azimuth in generator.uniform(0, 360, 14):
        window = panel(w, direction(azimuth, generator.uniform(2, 10)), 0.05, 0.08, 0.02)
        light = light + window[..., None] * np.array([1.9, 1.5, 0.9])
    return _make("night", light)


@functools.cache
def preview_light() -> Environment:
    """A bright late-afternoon terrace: low warm sun, pale sky, a reflecting floor. No conditions are made with it."""
    w = _texels()
    sun = direction(-55, 28)
    light = gradient(w, (0.20, 0.18, 0.16), (0.85, 0.74, 0.62), (0.28, 0.38, 0.60), 0.55)
    glow = np.exp(-np.degrees(np.arccos((w @ sun).clip(-1, 1))) / 20.0)[..., None] * np.array([1.4, 1.0, 0.6])
    soft = panel(w, direction(60, 30), 1.1, 0.9, 0.2)[..., None] * np.array([1.6, 1.8, 2.1])
    return _make("terrace", light + glow + soft + disc(w, sun, 1.6, 1.0)[..., None] * np.array([620.0, 520.0, 390.0]))


BUILTIN: dict[str, Callable[[], Environment]] = {
    f.__name__: f for f in (clear_sky, overcast, studio, interior, night)
}
"""The environments that `conditions` uses when none is given, by name."""
