"""preview.png: the baked asset as an engine would draw it, from eight sides; below, its maps without light.

The textures are read back bilinearly at the hits of camera rays, as a renderer does, and shaded by the project's own
transport under an environment that distillation never saw. Geometry and textures are sampled at four points a pixel,
the light at one. The picture is sRGB without a tone curve: Blender's "Standard" view, three.js without tone mapping.
"""

from dataclasses import dataclass

import numpy as np
import OpenImageIO as oiio
import torch
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from stages.bake.raster import Surface
from stages.core.color import srgb_encode
from stages.core.frames import camera_rays, look_at
from stages.core.parallel import in_parallel
from stages.core.progress import Progress
from stages.core.shading import Material, shade
from stages.light.environment import Environment
from stages.light.gbuffer import trace_view
from stages.light.lights import preview_light
from stages.light.scene import Scene
from stages.light.transport import Quality, cached_light_set, light_transport

FOV_Y = np.radians(30.0)
"""Vertical field of view: a mild telephoto, as product pictures have it."""

FILL = 0.86
"""Share of the picture's half-width that the object's bounding sphere, seen from a view, may take."""

VIEWS = tuple((45.0 * k, (18.0, 18.0, 8.0, 38.0)[k % 4]) for k in range(8))
"""Azimuth and elevation of the eight views, degrees."""

GROUND, BACKDROP = 0.105, 0.30
"""Linear grey at the bottom and the top of each picture's background."""

MAP_BACKDROP = (0.16, 0.18, 0.22)
"""Encoded background of the maps: slightly blue, so that no grey value is lost in it."""

EXPOSURE = 0.8
"""Applied to radiance before the picture is encoded."""

COLUMNS = 4

RAYS = Quality(lobe=32, light=12, extra=False)
"""Rays that a pixel traces: a little grain in the shadows stays."""

TEXT_HEIGHT = 14
"""Pixels."""


@dataclass(frozen=True)
class Picture:
    """One view at two samples along each edge of a pixel. alpha: (2H, 2W) bool; color: (2H, 2W, 3) linear."""

    alpha: NDArray[np.bool_]
    color: NDArray[np.float32]

    def over(self, background: NDArray[np.float32]) -> NDArray[np.float32]:
        """The picture at one value a pixel, over a background (H, W, 3) or wider to broadcast. Returns: linear."""
        alpha = _halve(self.alpha[..., None].astype(np.float32))
        return _halve(np.where(self.alpha[..., None], self.color, 0)) + (1 - alpha) * background


def contact_sheet(
    scene: Scene, uv: NDArray[np.float32], maps: NDArray[np.float32], size: int, progress: Progress
) -> NDArray[np.float32]:
    """Draw the preview.

    Args:
        uv: (F, 3, 2) of the triangles' corners. maps: (H, W, 5) baked albedo, roughness, metallic. size: pixels along
        each edge of one view.
    Returns:
        (rows, columns, 3) encoded sRGB in [0, 1].
    """
    light, used = preview_light(), scene.vertices[np.unique(scene.triangles)].astype(np.float64)
    progress("preview", 0, 1)
    cached_light_set((light,))  # once, not in every thread
    views = [camera(used, azimuth, elevation) for azimuth, elevation in VIEWS]
    drawn = in_parallel(lambda c2w: draw_view(scene, light, uv, maps, c2w, size), views)
    cells = [srgb_encode(shaded.over(backdrop(size))) for shaded, _ in drawn]
    cells += [*material_cells(drawn[0][1], size), labelled(atlas(maps, size), "albedo.png")]
    progress("preview", 1, 1)
    return np.concatenate([np.concatenate(cells[k : k + COLUMNS], 1) for k in range(0, len(cells), COLUMNS)], 0)


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


def draw_view(
    scene: Scene, light: Environment, uv: NDArray[np.float32], maps: NDArray[np.float32], c2w: NDArray, size: int
) -> tuple[Picture, tuple[NDArray, NDArray]]:
    """One view. Returns: the shaded picture; where its samples hit (2S, 2S) and their material (N, 5)."""
    fine = scene.intersect(*camera_rays(c2w, FOV_Y, 2 * size, 2 * size))
    surface = Surface(fine.triangle, np.ascontiguousarray(fine.barycentric[:, :2])).where(fine.mask)
    sampled, mask = bilinear(maps, surface.interpolate(uv)), fine.mask.reshape(2 * size, 2 * size)
    color = np.zeros((2 * size, 2 * size, 3), np.float32)
    coarse = trace_view(scene, c2w, FOV_Y, size, size)
    if coarse.mask.any():
        transport = light_transport(scene, coarse, [light], RAYS, seed=0)[0]
        values = torch.from_numpy(sampled[:, :5])
        material = Material.of(values)
        nearest = torch.from_numpy(_nearest_hit(coarse.mask)[mask])
        color[mask] = EXPOSURE * shade(transport[nearest], material).numpy()
    return Picture(mask, color), (mask, sampled)


def bilinear(maps: NDArray[np.float32], uv: NDArray[np.float32]) -> NDArray[np.float32]:
    """Texture look-up, v up, clamped to the edge. Args: maps (H, W, C); uv (N, 2). Returns: (N, C)."""
    height, width, _ = maps.shape
    x = np.clip(uv[:, 0] * width - 0.5, 0, width - 1)
    y = np.clip((1 - uv[:, 1]) * height - 0.5, 0, height - 1)
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    fx, fy = (x - left)[:, None].astype(np.float32), (y - top)[:, None].astype(np.float32)
    upper = maps[top, left] * (1 - fx) + maps[top, right] * fx
    lower = maps[bottom, left] * (1 - fx) + maps[bottom, right] * fx
    return upper * (1 - fy) + lower * fy


def material_cells(material: tuple[NDArray, NDArray], size: int) -> list[NDArray[np.float32]]:
    """Albedo, roughness and metallic of a view without light, encoded as their PNGs are."""
    mask, sampled = material
    cells = []
    for name, columns in (("albedo", slice(0, 3)), ("roughness", slice(3, 4)), ("metallic", slice(4, 5))):
        color = np.zeros((*mask.shape, 3), np.float32)
        color[mask] = srgb_encode(sampled[:, columns]) if name == "albedo" else sampled[:, columns]
        cells.append(labelled(Picture(mask, color).over(np.array(MAP_BACKDROP, np.float32)), name))
    return cells


def atlas(maps: NDArray[np.float32], size: int) -> NDArray[np.float32]:
    """The albedo texture itself, shrunk to one cell, encoded. Returns: (size, size, 3)."""
    linear = oiio.ImageBuf(np.ascontiguousarray(maps[..., :3]))
    small = oiio.ImageBufAlgo.resize(linear, filtername="box", roi=oiio.ROI(0, size, 0, size, 0, 1, 0, 3))
    return srgb_encode(np.asarray(small.get_pixels(oiio.FLOAT), np.float32).reshape(size, size, 3))


def labelled(cell: NDArray[np.float32], text: str) -> NDArray[np.float32]:
    """A picture with its name in a corner; without, where OpenImageIO finds no font."""
    picture = oiio.ImageBuf(np.ascontiguousarray(cell, np.float32))
    left, base = TEXT_HEIGHT // 2, 3 * TEXT_HEIGHT // 2
    oiio.ImageBufAlgo.render_text(picture, left, base, text, TEXT_HEIGHT, "", (0.95, 0.95, 0.95), shadow=2)
    return np.asarray(picture.get_pixels(oiio.FLOAT), np.float32).reshape(cell.shape)


def _nearest_hit(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """For each sample at twice the size, the number of the hit pixel nearest to it. Returns: (2H, 2W)."""
    row, column = distance_transform_edt(~mask, return_distances=False, return_indices=True)
    number = (np.cumsum(mask.reshape(-1)) - 1).reshape(mask.shape)[row, column]
    return np.repeat(np.repeat(number, 2, 0), 2, 1)


def _halve(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Mean of each 2 x 2 block. Args: (2H, 2W, C). Returns: (H, W, C)."""
    height, width, count = values.shape
    return values.reshape(height // 2, 2, width // 2, 2, count).mean((1, 3))


def backdrop(size: int) -> NDArray[np.float32]:
    """A neutral gradient, darker below. Returns: (size, 1, 3) linear."""
    ramp = np.linspace(BACKDROP, GROUND, size, dtype=np.float32)
    return np.repeat(ramp[:, None, None], 3, 2)
