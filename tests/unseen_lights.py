"""Four lights that nothing is tuned to, written as EXR files: what `dreammat report conditions --env` may be held against.

    python -m tests.unseen_lights FOLDER

street: a small sun in the gap between two rows of houses, one of which it lights; alley: a smaller one in a strip of sky
between dark, tall houses; room: dark walls, three windows with bars, sky over a lit lawn in them, and a lamp; square: a night
sky, lamps on two rows of masts, their light on the ground, some lit windows.
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.light.environment import Environment, directions_of_texels, save_environment

HEIGHT = 512

Picture = NDArray[np.float64]


def street(rng: np.random.Generator) -> Picture:
    """A sun of half a degree, 20 degrees high, of six times the sky's illumination."""
    direction, azimuth, elevation = sphere()
    sky = np.array([0.35, 0.55, 1.0]) * (0.5 + 0.9 * np.exp(-np.maximum(elevation, 0) / 25))[..., None]
    sun = towards(-62, 20)
    sky += np.array([1.0, 0.8, 0.5]) * (1.5 * np.exp(-away(direction, sun) / 12))[..., None]
    image = np.where((elevation > 0)[..., None], sky, np.array([0.14, 0.13, 0.12]))
    for side, light in ((0, 0.08), (180, 0.55)):  # rows of houses, one in its own shadow
        at = (azimuth - side + 180) % 360 - 180
        number = np.floor(at / 13).astype(int)
        tall, tone = rng.uniform(22, 46, 64)[number % 64], rng.uniform(0.5, 1.3, (64, 3))[number % 64]
        house = (np.abs(at) < 56) & (elevation > -6) & (elevation < tall * np.cos(np.radians(at * 0.8)))
        pane = (at % 4.3 > 2.6) & (elevation % 7 > 3.5)
        image = np.where(house[..., None], light * tone * np.where(pane, 0.3, 1.0)[..., None], image)
    image[away(direction, sun) < 0.27] = np.array([1.0, 0.86, 0.66]) * 60_000
    return image


def alley(rng: np.random.Generator) -> Picture:
    """A sun of 0.4 degrees in a strip of sky ten degrees wide between dark, tall houses, one front of which it lights."""
    direction, azimuth, elevation = sphere()
    across = np.degrees(np.arctan2(direction[..., 1], np.maximum(direction[..., 2], 1e-6)))  # from straight up
    sky = np.array([0.7, 0.9, 1.3]) * (1 + rng.normal(0, 0.05, elevation.shape))[..., None]
    wall = 0.06 * rng.uniform(0.6, 1.4, (40, 90))[(elevation.clip(0) / 5).astype(int), ((azimuth % 360) / 4).astype(int)]
    lit = (azimuth > 0) & (elevation > 15) & (elevation < 40)
    image = np.where(lit, 1.1, wall)[..., None] * np.array([1.0, 0.9, 0.8])
    image = np.where((elevation > 8)[..., None] & (np.abs(across) < 5)[..., None], sky, image)
    image = np.where((elevation > 0)[..., None], image, np.array([0.05, 0.05, 0.05]))
    image[away(direction, towards(-4, 42)) < 0.2] = np.array([1.0, 0.9, 0.75]) * 90_000
    return image


def room(rng: np.random.Generator) -> Picture:
    direction, azimuth, elevation = sphere()
    walls = np.where(elevation < -35, 0.05, np.where(elevation > 50, 0.14, 0.1))
    image = walls[..., None] * np.array([1.0, 0.9, 0.75]) * rng.uniform(0.9, 1.1, walls.shape)[..., None]
    for side, wide, low, high in ((-30, 12, -8, 28), (8, 9, -8, 28), (130, 20, 5, 35)):
        at = (azimuth - side + 180) % 360 - 180
        window = (np.abs(at) < wide) & (elevation > low) & (elevation < high)
        bar = (np.abs(at) < 0.5) | (np.abs(elevation - (low + high) / 2) < 0.5)
        outside = np.where((elevation > 3)[..., None], np.array([9.0, 11.0, 14.0]), np.array([2.0, 3.2, 1.2]))
        image = np.where((window & ~bar)[..., None], outside, image)
    image[away(direction, towards(-140, 40)) < 1.5] = np.array([1.0, 0.8, 0.5]) * 180
    return image


def square(rng: np.random.Generator) -> Picture:
    direction, azimuth, elevation = sphere()
    sky = np.array([0.004, 0.005, 0.009]) + 0.003 * np.exp(-np.maximum(elevation, 0) / 10)[..., None]
    image = np.where((elevation > 0)[..., None], sky, np.array([0.01, 0.009, 0.008]))
    skyline = rng.uniform(4, 14, 72)[np.floor((azimuth % 360) / 5).astype(int) % 72]
    lit = rng.random((40, 240)) < 0.12
    pane = lit[(elevation / 2).astype(int) % 40, np.floor((azimuth % 360) / 1.5).astype(int) % 240]
    houses = (elevation > -2) & (elevation < skyline)
    image = np.where(houses[..., None], np.where(pane[..., None], np.array([0.9, 0.6, 0.3]), 0.01), image)
    for row in (-1.0, 1.0):
        for place in np.arange(-3, 4) + 0.2 * row:
            lamp = np.array([2 * place, 2.5 * row, 1.3])  # half a mast over the eye
            lamp += rng.normal(0, 0.1, 3)
            distance = np.linalg.norm(lamp)
            pool = away(direction, np.array([lamp[0], lamp[1], -1.2]) / np.linalg.norm([*lamp[:2], 1.2]))
            image += np.array([1.0, 0.7, 0.35]) * (np.exp(-pool / 8) / distance**2 * (elevation < -2))[..., None]
            image[away(direction, lamp / distance) < np.degrees(0.04 / distance)] = np.array([1.0, 0.7, 0.35]) * 2_500
    return image


def sphere() -> tuple[Picture, Picture, Picture]:
    """Directions of the texels, (H, W, 3), their azimuth and elevation, degrees."""
    direction = directions_of_texels(HEIGHT, 2 * HEIGHT)[0]
    return direction, np.degrees(np.arctan2(direction[..., 1], direction[..., 0])), np.degrees(np.arcsin(direction[..., 2]))


def towards(azimuth: float, elevation: float) -> Picture:
    """A direction by degrees."""
    a, e = np.radians([azimuth, elevation])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def away(direction: Picture, other: Picture) -> Picture:
    """Angle between directions, degrees."""
    return np.asarray(np.degrees(np.arccos((direction @ other).clip(-1, 1))))


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for make in (street, alley, room, square):
        image = make(np.random.default_rng(11)).astype(np.float32)
        save_environment(folder / f"{make.__name__}.exr", Environment(make.__name__, image))
