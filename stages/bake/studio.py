"""Where the preview is taken: its cameras, light, exposure and background, and the files by which others repeat it.

`preview.json` gives the cameras in the frame of model.glb (glTF: +y up), and `preview_light.exr` is turned so that Blender,
once it has imported model.glb, and three.js read it as it is: its middle column lies towards glTF's +x.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.asset.model import upright
from stages.core.artifact import Artifact, write_json
from stages.core.frames import look_at
from stages.light.environment import Environment, save_environment
from stages.light.lights import preview_light

FOV_Y = np.radians(30.0)
"""Vertical field of view: a mild telephoto, as product pictures have it."""

FILL = 0.86
"""Share of the picture's half-width that the object's bounding sphere, seen from a view, may take."""

VIEWS = tuple((45.0 * k, (18.0, 18.0, 8.0, 38.0)[k % 4]) for k in range(8))
"""Azimuth and elevation of the eight views, degrees."""

COLUMNS = 4
"""Views beside each other."""

GROUND, BACKDROP = 0.105, 0.30
"""Linear grey at the bottom and the top of each picture's background."""

EXPOSURE = 0.8
"""Applied to radiance before the picture is encoded."""


def cameras(vertices: NDArray, triangles: NDArray) -> list[NDArray[np.float64]]:
    """c2w (4, 4), world, of every view of a mesh."""
    used = vertices[np.unique(triangles)].astype(np.float64)
    return [camera(used, azimuth, elevation) for azimuth, elevation in VIEWS]


def camera(points: NDArray[np.float64], azimuth: float, elevation: float) -> NDArray[np.float64]:
    """c2w (4, 4) of a view, degrees, at the distance from which the object's points (N, 3) fill the picture."""
    a, e = np.radians(azimuth), np.radians(elevation)
    towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    center = (points.min(0) + points.max(0)) / 2
    c2w = look_at(center + towards, center, np.array([0.0, 0.0, 1.0]))
    local = (points - center) @ c2w[:3, :3]  # x right, y up, z to the camera
    distance = (local[:, 2] + np.maximum(np.abs(local[:, 0]), np.abs(local[:, 1])) / (FILL * np.tan(FOV_Y / 2))).max()
    c2w[:3, 3] = center + towards * distance
    return c2w


def backdrop(size: int) -> NDArray[np.float32]:
    """A neutral gradient, darker below. Returns: (size, 1, 3) linear."""
    ramp = np.linspace(BACKDROP, GROUND, size, dtype=np.float32)
    return np.repeat(ramp[:, None, None], 3, 2)


def write_studio(folder: Path, mesh: Artifact, size: int, bounces: int = 0) -> list[str]:
    """Write preview.json and preview_light.exr.

    Args: mesh: of prep.npz. size: pixels of a view. bounces: of light between surfaces, in the picture. Returns: their names.
    """
    to_gltf = upright(mesh["to_world"]) @ np.linalg.inv(mesh["to_world"])
    views = [
        {"c2w": in_frame(to_gltf, c2w).tolist(), "column": k % COLUMNS, "row": k // COLUMNS}
        for k, c2w in enumerate(cameras(mesh["vertices"], mesh["triangles"]))
    ]
    said = {
        "picture": "preview.png",
        "size": size,
        "fov_y": float(FOV_Y),
        "exposure": EXPOSURE,
        "transfer": "sRGB",
        "background": {"top": BACKDROP, "bottom": GROUND},
        "light": "preview_light.exr",
        "bounces": bounces,
        "views": views,
    }
    write_json(folder / "preview.json", said)
    light = preview_light()
    quarter = light.radiance.shape[1] // 4
    save_environment(folder / "preview_light.exr", Environment(light.name, np.roll(light.radiance, quarter, 1)))
    return ["preview.json", "preview_light.exr"]


def in_frame(transform: NDArray[np.float64], c2w: NDArray[np.float64]) -> NDArray[np.float64]:
    """A camera (4, 4) carried along by a similarity (4, 4): its axes stay unit."""
    carried = transform @ c2w
    carried[:3, :3] /= np.cbrt(np.linalg.det(transform[:3, :3]))
    return carried
