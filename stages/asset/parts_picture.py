"""A picture of the parts of a mesh: each in a colour of its own, with its name, from two sides."""

import colorsys

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from stages.asset.parts import KINDS, NamedPart
from stages.core.frames import camera_rays, look_at
from stages.core.images import TEXT_HEIGHT, labelled
from stages.light.scene import Scene

FOV_Y = np.radians(30.0)

SIDES = ((35.0, 20.0), (215.0, 20.0))
"""Azimuth and elevation of the two pictures, degrees."""

GOLDEN = 0.618034
"""Step of the hue from one part to the next: neighbours in the list differ most."""

BACKDROP = (0.13, 0.14, 0.16)

NAMED = 24
"""Parts of a kind that have their names in the picture, the largest; more would hide each other."""

LEAST = 30
"""Pixels that a part must show to be named."""


def parts_picture(scene: Scene, parts: list[NamedPart], size: int) -> NDArray[np.float32]:
    """Rows of objects, slots and pieces, each from two sides; a kind with a single part is left out, if another has more.

    Args:
        size: pixels along an edge of one picture.
    Returns:
        (rows * size, 2 * size, 3) encoded.
    """
    kinds = [kind for kind in KINDS if sum(part.kind == kind for part in parts) > 1] or ["object"]
    rows = []
    for kind in kinds:
        mine = [part for part in parts if part.kind == kind]
        drawn = [labelled(_view(scene, mine, *side, size), f"{kind}s: {len(mine)}") for side in SIDES]
        rows.append(np.concatenate(drawn, 1))
    return np.concatenate(rows, 0)


def color(number: int) -> NDArray[np.float64]:
    """A colour (3,) for a row of the list, encoded."""
    return np.array(colorsys.hsv_to_rgb(number * GOLDEN % 1, 0.45 + 0.3 * (number % 3) / 2, 0.95))


def _view(scene: Scene, parts: list[NamedPart], azimuth: float, elevation: float, size: int) -> NDArray[np.float32]:
    """One picture: colour by part, light by how far the surface turns away; names where most of the part is seen."""
    c2w = _camera(scene, azimuth, elevation)
    origins, directions = camera_rays(c2w, FOV_Y, size, size)
    hits = scene.intersect(origins, directions)
    of_triangle = np.full(len(scene.triangles), -1)
    for number, part in enumerate(parts):
        of_triangle[part.triangles] = number
    row = np.where(hits.mask, of_triangle[hits.triangle], -1).reshape(size, size)
    colors = np.array([*(color(part.number) for part in parts), (0.5, 0.5, 0.5)])
    towards = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    light = 0.35 + 0.65 * np.abs((scene.geometric_normal(hits.triangle) * towards).sum(1))
    shown = np.where(hits.mask[:, None], colors[row.reshape(-1)] * light[:, None], BACKDROP).reshape(size, size, 3)
    return _with_names(shown.astype(np.float32), row, parts)


def _camera(scene: Scene, azimuth: float, elevation: float) -> NDArray[np.float64]:
    """c2w (4, 4) from which the whole object fills the picture."""
    used = scene.vertices[np.unique(scene.triangles)].astype(np.float64)
    centre = (used.min(0) + used.max(0)) / 2
    a, e = np.radians(azimuth), np.radians(elevation)
    towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    c2w = look_at(centre + towards, centre, np.array([0.0, 0.0, 1.0]))
    local = (used - centre) @ c2w[:3, :3]
    distance = (local[:, 2] + np.abs(local[:, :2]).max(1) / (0.92 * np.tan(FOV_Y / 2))).max()
    c2w[:3, 3] = centre + towards * distance
    return c2w


def _with_names(picture: NDArray[np.float32], row: NDArray, parts: list[NamedPart]) -> NDArray[np.float32]:
    """The picture with the names of the parts that show most, none over another."""
    image, taken = oiio.ImageBuf(np.ascontiguousarray(picture)), np.zeros(row.shape, bool)
    seen = np.bincount(row[row >= 0], minlength=len(parts))
    for number in np.argsort(-seen, kind="stable")[:NAMED].tolist():
        if seen[number] < LEAST:
            break
        text = parts[number].call
        pixels = np.argwhere(row == number)
        y, x = pixels[np.abs(pixels - np.median(pixels, axis=0)).sum(1).argmin()].tolist()
        half = 4 * len(text)
        left = int(np.clip(x - half, 2, max(row.shape[1] - 2 * half - 2, 2)))
        box = slice(max(y - TEXT_HEIGHT, 0), y + 3), slice(left, left + 2 * half)
        if not taken[box].any():
            taken[box] = True
            oiio.ImageBufAlgo.render_text(image, left, y, text, TEXT_HEIGHT, "", (1.0, 1.0, 1.0), shadow=2)
    return np.asarray(image.get_pixels(oiio.FLOAT), np.float32).reshape(picture.shape)
