"""Cameras around the object: each variable stratified by itself, deterministic for a seed.

All azimuths, elevations -20 to 45 degrees, fields of view 25 to 45 degrees, and a distance at which the object's
outermost point reaches 0.6 to 0.85 of the half-frame.
Source: Zhang et al. 2024, "DreamMat", sec. 4.1, and its released code, which this framing replaces.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.conditions.options import ConditionsOptions
from stages.core.frames import look_at


@dataclass(frozen=True)
class Cameras:
    """N pinhole cameras: c2w (N, 4, 4) float64; fov_y (N,) radians."""

    c2w: NDArray[np.float64]
    fov_y: NDArray[np.float64]


def place_cameras(vertices: NDArray, options: ConditionsOptions) -> Cameras:
    """Draw the cameras of a run.

    Args:
        vertices: (V, 3) world; the object that must fit the frame.
    """
    generator = np.random.default_rng([options.seed, 0x63616D])
    azimuth = 2 * np.pi * stratified(options.views, generator)
    elevation = np.radians(between(options.elevation, stratified(options.views, generator)))
    fov_y = np.radians(between(options.fov, stratified(options.views, generator)))
    frame = between(options.frame, stratified(options.views, generator))
    horizontal = np.cos(elevation)
    towards = np.stack([horizontal * np.cos(azimuth), horizontal * np.sin(azimuth), np.sin(elevation)], -1)
    distance = framing_distance(vertices, towards, np.tan(fov_y / 2) * frame)
    c2w = look_at(towards * distance[:, None], np.zeros(3), np.array([0.0, 0.0, 1.0]))
    return Cameras(c2w, fov_y)


def stratified(count: int, generator: np.random.Generator) -> NDArray[np.float64]:
    """One uniform number in each of `count` equal parts of [0, 1), in random order."""
    return (generator.permutation(count) + generator.random(count)) / count


def between(limits: tuple[float, float], u: NDArray) -> NDArray[np.float64]:
    """Linear interpolation from limits[0] to limits[1]."""
    return limits[0] + (limits[1] - limits[0]) * u


def framing_distance(vertices: NDArray, towards: NDArray, slope: NDArray) -> NDArray[np.float64]:
    """Distance at which the farthest vertex lies exactly at the given slope from the camera's axis.

    A vertex at height h from the axis and depth z towards the camera is seen at slope h / (distance - z).

    Args:
        vertices: (V, 3). towards: (N, 3) unit, object to camera. slope: (N,) tangent of the half-angle to reach.
    Returns:
        (N,), at least 0.1 beyond the nearest vertex.
    """
    result = np.empty(len(towards))
    for i, w in enumerate(towards):
        frame = look_at(w, np.zeros(3), np.array([0.0, 0.0, 1.0]))[:3, :3]
        x, y, z = (vertices @ frame).T
        result[i] = max((z + np.maximum(abs(x), abs(y)) / slope[i]).max(), z.max() + 0.1)
    return result
