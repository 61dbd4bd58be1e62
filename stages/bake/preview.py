"""preview.png: the baked asset as an engine would draw it, from eight sides; below, its maps without light.

Geometry, textures and light are sampled at four points a pixel, the object's outline at more. Textures and normal maps
are averaged over what each point stands for, as seen by the camera; where the normals of a patch differ, the patch is
rougher by as much. The light is the project's own transport under an environment that distillation never saw
(`stages.bake.studio`). The picture is sRGB without a tone curve: Blender's "Standard" view, three.js without tone mapping.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter

from stages.bake.raster import Layout, touched_texels
from stages.bake.studio import COLUMNS, EXPOSURE, FOV_Y, backdrop, cameras
from stages.core.artifact import Artifact
from stages.core.brdf import rougher
from stages.core.color import srgb_encode
from stages.core.frames import camera_rays, tangent_frame
from stages.core.images import labelled
from stages.core.parallel import compiled, in_parallel
from stages.core.texture_sets import triangle_sets
from stages.core.tiles import repeats
from stages.light.environment import Environment
from stages.light.exchange import Between
from stages.light.gbuffer import GBuffer, facing, surface_points
from stages.light.known import reflected
from stages.light.lights import preview_light
from stages.light.lookup import CLAMP, REPEAT, look_up
from stages.light.own_light import Thrown
from stages.light.scene import Hits, Scene
from stages.light.transport import Quality, cached_light_set

MAP_BACKDROP = (0.16, 0.18, 0.22)
"""Encoded background of the maps: slightly blue, so that no grey value is lost in it."""

RAYS = Quality(lobe=16, light=6, extra=False)
"""Rays that a point traces, a quarter of its pixel."""

OUTLINE = 6
"""Points along each edge of a pixel through which the object's outline may run."""

GAP = 2
"""Pixels between the maps of several sets."""

TILE, MARGIN = 640, 16
"""Points along an edge that are traced at once, which bounds memory, and how many around them know of each other's noise."""

STRETCH = 4.0
"""How many times longer than wide what a point stands for may be: towards the horizon it would reach beyond the surface."""


@dataclass(frozen=True)
class Picture:
    """One view at two samples along each edge of a pixel.

    alpha: (2H, 2W) bool. color: (2H, 2W, 3) linear. material: (2H, 2W, 5) albedo, roughness, metallic. covered: (H, W, 1)
    share of each pixel that the object covers.
    """

    alpha: NDArray[np.bool_]
    color: NDArray[np.float32]
    material: NDArray[np.float32]
    covered: NDArray[np.float32]

    def over(self, background: NDArray[np.float32]) -> NDArray[np.float32]:
        """The picture at one value a pixel, over a background (H, W, 3) or wider to broadcast. Returns: linear."""
        return self.shown(self.color, background)

    def shown(self, values: NDArray[np.float32], background: NDArray[np.float32]) -> NDArray[np.float32]:
        """Values (2H, 2W, C) of the object's samples at one a pixel, over a background. Returns: (H, W, C)."""
        hit = _halve(self.alpha[..., None].astype(np.float32))
        mean = _halve(np.where(self.alpha[..., None], values, 0)) / np.maximum(hit, 1 / 4)  # a quarter is one sample
        return mean * self.covered + (1 - self.covered) * background


def contact_sheet(look: "Look", size: int, bounces: int = 0) -> NDArray[np.float32]:
    """Draw the preview.

    Args:
        size: pixels along each edge of one view. bounces: of light between surfaces.
    Returns:
        (rows, columns, 3) encoded sRGB in [0, 1].
    """
    light, scene = preview_light(), look.scene
    cached_light_set((light,))  # once, not in every thread
    look = look.under([light], bounces)
    drawn = in_parallel(lambda c2w: draw_view(look, light, c2w, size), cameras(scene.vertices, scene.triangles))
    cells = [srgb_encode(picture.over(backdrop(size))) for picture in drawn]
    named = "albedo.png" if len(look.maps) == 1 else "albedo of each set"
    cells += [*material_cells(drawn[0]), labelled(atlases(look, size), named)]
    return np.concatenate([np.concatenate(cells[k : k + COLUMNS], 1) for k in range(0, len(cells), COLUMNS)], 0)


@dataclass(frozen=True)
class Look:
    """A mesh and its textures.

    uv: (F, 3, 2), v down. maps: (H, W, 5) of each texture set. of_triangle: (F,) row of its maps. thrown: what it throws on
    itself under the lights that it is drawn in, or None.
    """

    scene: Scene
    uv: NDArray
    maps: list[NDArray[np.float32]]
    of_triangle: NDArray[np.int32]
    thrown: Thrown | None = None
    wraps: list[int] = field(init=False)  # how the textures go on beyond their edges, as in model.glb

    def __post_init__(self) -> None:
        mine = [self.uv[self.of_triangle == number] for number in range(len(self.maps))]
        object.__setattr__(self, "wraps", [REPEAT if repeats(uv) else CLAMP for uv in mine])

    @staticmethod
    def of(mesh: Artifact, scene: Scene, maps: list[NDArray[np.float32]]) -> "Look":
        """Of a prep.npz."""
        return Look(scene, mesh["uv"] * (1, -1) + (0, 1), maps, triangle_sets(mesh))

    def material(self, points: GBuffer, across: NDArray) -> NDArray[np.float32]:
        """Albedo, roughness and metallic (P, 5), the mean over a patch around each point. Args: across: of `footprint`."""
        uv, row = self.uv[points.triangle], self.of_triangle[points.triangle]
        middle, edges = np.einsum("pk,pkd->pd", points.barycentric, uv), np.einsum("pek,pkd->ped", across, uv)
        result = np.empty((len(row), 5), np.float32)
        for number in np.unique(row).tolist():
            mine, wrap = np.flatnonzero(row == number), self.wraps[number]
            result[mine] = look_up(self.maps[number], middle[mine], edges[mine], (wrap, wrap))[:, :5]
        return result

    def under(self, lights: Sequence[Environment], bounces: int) -> "Look":
        """The same with what it throws on itself under some lights, where it sees more than next to nothing of itself."""
        between = Between.of(self.scene, list(lights), 0, bounces) if bounces else None
        if between is None:
            return self
        sides = between.cells.sides(self.scene)
        across = np.stack(tangent_frame(sides.ng), 1) * between.cells.width
        material = self.material(sides, edges(self.scene, sides.triangle, across))
        thrown = Thrown(between.cells, between.exchange.solved(material, bounces), between.exchange.sky)
        return replace(self, thrown=thrown)

    def points(
        self, hits: Hits, directions: NDArray, mask: NDArray[np.bool_], c2w: NDArray, step: float
    ) -> tuple[GBuffer, NDArray, NDArray]:
        """What some rays hit, its normals averaged as textures are.

        Args:
            step: between rays, at distance 1 along the camera's axis.
        Returns:
            the points; (P, 2, 3) of `footprint`; (P,) by how much normals differ within a patch, as a squared slope.
        """
        smooth = surface_points(self.scene.bumped(None), hits, directions, mask)
        across = footprint(self.scene, smooth, directions[hits.mask], c2w, step)
        if self.scene.bumps is None:
            return smooth, across, np.zeros(len(smooth.n), np.float32)
        side = np.sign((self.scene.geometric_normal(smooth.triangle) * smooth.ng).sum(1, keepdims=True))
        outer = self.scene.smooth_normal(smooth.triangle, smooth.barycentric)
        n, length = self.scene.bumps.filtered(outer, smooth.triangle, smooth.barycentric, across)
        spread = (1 - length) / np.maximum(length, 1e-3)
        return replace(smooth, n=facing(n * side, smooth.wo)), across, spread


def draw_view(look: Look, light: Environment, c2w: NDArray, size: int) -> Picture:
    """One view under one light."""
    return draw_views(look, [light], c2w, size)[0]


def draw_views(look: Look, lights: Sequence[Environment], c2w: NDArray, size: int) -> list[Picture]:
    """One view under each light: all are lit by the same rays."""
    across = 2 * size
    directions = camera_rays(c2w, FOV_Y, across, across)[1].reshape(across, across, 3)
    alpha, material, colors = (np.zeros((across, across, k), np.float32) for k in (1, 5, 3 * len(lights)))
    for top in range(0, across, TILE):
        for left in range(0, across, TILE):
            wide = [slice(max(first - MARGIN, 0), first + TILE + MARGIN) for first in (top, left)]
            inner = tuple(slice(first, first + TILE) for first in (top, left))
            kept = tuple(
                slice(first - part.start, first - part.start + TILE) for first, part in zip((top, left), wide, strict=True)
            )
            drawn = _draw(look, lights, directions[wide[0], wide[1]], c2w, 2 * np.tan(FOV_Y / 2) / across)
            for whole, part in zip((alpha, material, colors), drawn, strict=True):
                whole[inner] = part[kept]
    share = covered(look.scene, alpha, c2w)
    return [Picture(alpha[..., 0] > 0, color, material, share) for color in np.split(colors, len(lights), 2)]


def covered(scene: Scene, alpha: NDArray[np.float32], c2w: NDArray) -> NDArray[np.float32]:
    """Share of each pixel that a mesh covers, by more points where its outline runs.

    Args:
        alpha: (2S, 2S, 1), 1 where a sample hits.
    Returns:
        (S, S, 1); 0 where no sample hits, since nothing is known of what there is.
    """
    share = _halve(alpha)
    nearby = (share > 0) & (minimum_filter(share, (3, 3, 1)) < 1)
    row, column, _ = np.nonzero(nearby)
    offset = (np.arange(OUTLINE) + 0.5) / OUTLINE
    x, y = (np.tan(FOV_Y / 2) * (2 * (at[:, None] + offset) / len(share) - 1) for at in (column, row))
    grid = np.broadcast_arrays(x[:, None, :], -y[:, :, None], -1.0)  # (R, OUTLINE, OUTLINE) each
    rays = np.stack(grid, -1).reshape(-1, 3) @ c2w[:3, :3].T
    hit = scene.hidden(np.broadcast_to(c2w[:3, 3], rays.shape), rays)
    share[nearby] = hit.reshape(len(row), OUTLINE**2).mean(1)
    return share


def _draw(
    look: Look, lights: Sequence[Environment], directions: NDArray, c2w: NDArray, step: float
) -> tuple[NDArray, NDArray, NDArray]:
    """Alpha (h, w, 1), material, and the colour under each light (h, w, 3 lights) of a tile. Args: directions: (h, w, 3)."""
    shape, rays = directions.shape[:2], directions.reshape(-1, 3)
    hits = look.scene.intersect(np.broadcast_to(c2w[:3, 3], rays.shape), rays)
    mask = hits.mask.reshape(shape)
    alpha, material, colors = (np.zeros((*shape, k), np.float32) for k in (1, 5, 3 * len(lights)))
    if mask.any():
        points, across, spread = look.points(hits, rays, mask, c2w, step)
        values = look.material(points, across)
        alpha[mask], material[mask] = 1, values
        values[:, 3] = rougher(values[:, 3], spread)
        radiance = reflected(look.scene, points, list(lights), values, RAYS, 0, look.thrown)  # (lights, P, 3)
        if look.scene.emission is not None:
            radiance += look.scene.emission.at(points.triangle, points.barycentric, across)
        colors[mask] = np.concatenate(np.float32(EXPOSURE) * radiance, 1)
    return alpha, material, colors


def footprint(scene: Scene, points: GBuffer, directions: NDArray, c2w: NDArray, step: float) -> NDArray[np.float32]:
    """The part of the surface that each point stands for: a parallelogram, by its edges in barycentric coordinates.

    The neighbouring ray meets the point's own plane. Source: Igehy 1999, "Tracing Ray Differentials".

    Args:
        directions: (P, 3) of the rays. step: between rays, at distance 1 along the camera's axis.
    Returns:
        (P, 2, 3).
    """
    depth = points.depth[points.mask][:, None].astype(np.float64)
    towards = (directions * points.ng).sum(1, keepdims=True)
    least = np.linalg.norm(directions, axis=1, keepdims=True) / STRETCH
    towards = -np.maximum(np.abs(towards), least)  # ng faces the viewer
    moved = np.empty((len(depth), 2, 3))
    for axis in (0, 1):
        aside = np.broadcast_to(c2w[:3, axis] * step, directions.shape)
        moved[:, axis] = depth * (aside - directions * (aside * points.ng).sum(1, keepdims=True) / towards)
    return edges(scene, points.triangle, moved)


def edges(scene: Scene, triangle: NDArray, across: NDArray) -> NDArray[np.float32]:
    """Vectors in the planes of triangles in barycentric coordinates, 0 where a triangle has no area.

    Args: (P,), (P, 2, 3). Returns: (P, 2, 3)."""
    result = np.zeros(across.shape, np.float32)
    _edges(scene.vertices, scene.triangles, triangle, np.asarray(across, np.float64), result)
    return result


@compiled
def _edges(vertices, triangles, triangle, across, result):  # type: ignore[no-untyped-def]
    first, second, normal = np.empty(3), np.empty(3), np.empty(3)
    for p in range(len(triangle)):
        a, b, c = triangles[triangle[p]]
        for d in range(3):
            first[d] = np.float64(vertices[b, d]) - np.float64(vertices[a, d])
            second[d] = np.float64(vertices[c, d]) - np.float64(vertices[a, d])
        _cross(first, second, normal)
        squared = normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2
        if squared > 0:
            for axis in range(across.shape[1]):
                v = across[p, axis]
                one, other = _volume(v, second, normal) / squared, _volume(first, v, normal) / squared
                result[p, axis, 0], result[p, axis, 1], result[p, axis, 2] = -(one + other), one, other


@compiled
def _cross(a, b, result):  # type: ignore[no-untyped-def]
    result[0], result[1], result[2] = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def _volume(a, b, c):  # type: ignore[no-untyped-def]
    """(a x b) · c."""
    x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    return x * c[0] + y * c[1] + z * c[2]


def material_cells(picture: Picture) -> list[NDArray[np.float32]]:
    """Albedo, roughness and metallic of a view without light, encoded as their PNGs are."""
    cells = []
    for name, columns in (("albedo", slice(0, 3)), ("roughness", slice(3, 4)), ("metallic", slice(4, 5))):
        values = picture.material[..., columns]
        shown = srgb_encode(values) if name == "albedo" else np.repeat(values, 3, 2)
        cells.append(labelled(picture.shown(shown, np.array(MAP_BACKDROP, np.float32)), name))
    return cells


def atlases(look: Look, size: int) -> NDArray[np.float32]:
    """The albedo textures beside each other in one cell, encoded, without what fills them beyond their charts. Returns:
    (size, size, 3)."""
    across = math.ceil(math.sqrt(len(look.maps)))
    edge = size // across
    sheet = np.empty((size, size, 3), np.float32)
    sheet[:] = MAP_BACKDROP
    inner = max(edge - (GAP if across > 1 else 0), 1)
    up = look.uv * np.array([1, -1], np.float32) + np.array([0, 1], np.float32)
    for number, one in enumerate(look.maps if edge else []):
        layout = Layout.of(up, inner, mine=look.of_triangle == number)
        shown = touched_texels(layout).triangle >= 0
        row, column = edge * (number // across), edge * (number % across)
        sheet[row : row + inner, column : column + inner][shown] = atlas(one, inner)[shown]
    return sheet


def atlas(maps: NDArray[np.float32], size: int) -> NDArray[np.float32]:
    """The albedo texture itself, shrunk to one cell, encoded. Returns: (size, size, 3)."""
    linear = oiio.ImageBuf(np.ascontiguousarray(maps[..., :3]))
    small = oiio.ImageBufAlgo.resize(linear, filtername="box", roi=oiio.ROI(0, size, 0, size, 0, 1, 0, 3))
    return srgb_encode(np.asarray(small.get_pixels(oiio.FLOAT), np.float32).reshape(size, size, 3))


def _halve(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Mean of each 2 x 2 block. Args: (2H, 2W, C). Returns: (H, W, C)."""
    height, width, count = values.shape
    return values.reshape(height // 2, 2, width // 2, 2, count).mean((1, 3))
