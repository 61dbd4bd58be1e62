"""Random environments, far beyond the five of the program, so that light cannot be guessed from a picture.

A light is a sky or a room gradient, soft boxes, suns and lamps, and coloured clutter, drawn at random, with a random
tint; exposure is left to the model's own convention. Latitude-longitude, z up, linear radiance.
"""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from stages.light.environment import Environment, directions_of_texels
from stages.light.lights import disc, panel
from stages.material.patterns import Spectrum, fbm
from stages.material.place import Place

HEIGHT = 128
"""Rows of a training light; 1.4 degrees a texel."""


def random_light(rng: Generator, name: str) -> Environment:
    """Draw an environment."""
    w = directions_of_texels(HEIGHT, 2 * HEIGHT)[0]  # (H, W, 3)
    radiance = backdrop(w, rng)
    kind = rng.choice(["sun", "studio", "lamps", "clutter", "soft"], p=[0.28, 0.27, 0.15, 0.15, 0.15])
    if kind == "sun":
        radiance = radiance + sun(w, rng)
    if kind in ("studio", "clutter") or rng.random() < 0.2:
        radiance = radiance * (0.25 if kind == "studio" else 1.0) + soft_boxes(w, rng, int(rng.integers(1, 6)))
    if kind == "lamps":
        radiance = radiance * 0.2 + lamps(w, rng, int(rng.integers(1, 7)))
    if kind == "clutter":
        radiance = radiance * clutter(w, rng)
    return Environment(name, np.ascontiguousarray(radiance.clip(0, 2e4), np.float32))


def tint(rng: Generator, spread: float) -> NDArray[np.float64]:
    """A random light colour, mean 1: warm or cool mostly, green or magenta a little. Returns: (3,)."""
    warm, green = rng.normal(0, spread), rng.normal(0, spread * 0.35)
    color = np.exp(np.array([warm, green, -warm]))
    return color / color.mean()


def upwards(rng: Generator, lowest: float) -> NDArray[np.float64]:
    """A random unit direction whose z is at least `lowest`."""
    z, angle = rng.uniform(lowest, 1), rng.uniform(0, 2 * np.pi)
    r = np.sqrt(1 - z * z)
    return np.array([r * np.cos(angle), r * np.sin(angle), z])


def backdrop(w: NDArray, rng: Generator) -> NDArray[np.float64]:
    """Ground, horizon and zenith blended, brighter to one side. Returns: (H, W, 3)."""
    z = w[..., 2:3]
    ground, horizon, zenith = (np.exp(rng.normal(m, 0.7)) * tint(rng, 0.25) for m in (-1.8, -0.8, -0.7))
    sky = horizon + (zenith - horizon) * z.clip(0, 1) ** rng.uniform(0.3, 1.2)
    floor = ground + (horizon * 0.7 - ground) * (1 + z.clip(-1, 0)) ** rng.uniform(2, 8)
    blend = (z / rng.uniform(0.02, 0.4) + 0.5).clip(0, 1)
    side = 1 + rng.uniform(0, 0.9) * (w @ upwards(rng, -0.5))[..., None]
    return (floor * (1 - blend) + sky * blend) * side


def sun(w: NDArray, rng: Generator) -> NDArray[np.float64]:
    """A sun with its glow, high or low, sharp or veiled. Returns: (H, W, 3)."""
    towards, radius = upwards(rng, 0.05), rng.uniform(0.8, 4.0)
    irradiance = np.exp(rng.normal(0.8, 0.6))
    solid_angle = 2 * np.pi * (1 - np.cos(np.radians(radius + 0.7)))
    color = tint(rng, 0.2) * irradiance
    glow = np.exp(-np.degrees(np.arccos((w @ towards).clip(-1, 1))) / rng.uniform(6, 25))[..., None]
    return color * (disc(w, towards, radius, 1.4)[..., None] / solid_angle + glow * rng.uniform(0.05, 0.6))


def soft_boxes(w: NDArray, rng: Generator, count: int) -> NDArray[np.float64]:
    """Rectangular panels and round ones anywhere above, a few below. Returns: (H, W, 3)."""
    light = np.zeros_like(w)
    for _ in range(count):
        towards = upwards(rng, -0.3)
        if rng.random() < 0.75:
            width, height = rng.uniform(0.1, 1.6, 2)
            shape = panel(w, towards, width, height, softness=rng.uniform(0.03, 0.25))
            size = width * height
        else:
            radius = rng.uniform(4, 30)
            shape = disc(w, towards, radius, rng.uniform(1, 8))
            size = np.pi * np.radians(radius) ** 2
        light += shape[..., None] * tint(rng, 0.2) * np.exp(rng.normal(0.4, 0.6)) / (size + 0.1)
    return light


def lamps(w: NDArray, rng: Generator, count: int) -> NDArray[np.float64]:
    """Small bright sources, strongly coloured at times. Returns: (H, W, 3)."""
    light = np.zeros_like(w)
    for _ in range(count):
        radius = rng.uniform(1.0, 5.0)
        power = np.exp(rng.normal(0.0, 0.7)) / (np.pi * np.radians(radius) ** 2)
        light += disc(w, upwards(rng, -0.4), radius, 1.5)[..., None] * power * tint(rng, rng.choice([0.15, 0.6]))
    return light


def clutter(w: NDArray, rng: Generator) -> NDArray[np.float64]:
    """A factor with the look of surroundings: patches of light and dark, colours varying. Returns: (H, W, 3)."""
    p = np.ascontiguousarray((w.reshape(-1, 3) * rng.uniform(1.5, 6)).T, np.float32)
    at = Place(p, p[:2], np.zeros(p.shape[1], np.int32), np.full(p.shape[1], 0.05, np.float32), seed=int(rng.integers(2**31)))
    shade = np.exp(rng.uniform(0.4, 1.1) * fbm(at, Spectrum(1.0, 0.125, 0.5)))
    hue = np.exp(0.17 * np.stack([fbm(at, Spectrum(1.4, 0.7, 0.5), k) for k in (1, 2, 3)], -1))
    return (shade[:, None] * hue).reshape(w.shape)
