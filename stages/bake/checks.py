"""What a lead artist would check of a baked asset, in numbers, for report.html."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from stages.asset.report_page import Check
from stages.bake.raster import Surface, joined
from stages.core.artifact import Artifact
from stages.core.color import log_correlation, srgb_decode
from stages.core.texture_sets import TextureSet, triangle_sets
from stages.light.environment import Environment
from stages.light.gbuffer import GBuffer
from stages.light.scene import Scene
from stages.light.transport import Quality, cached_light_set, trace

POINTS = 3000
"""Texels at which light is traced for the correlation."""

RAYS = Quality(64, 24, extra=False, smooth=False)
"""Points are loose: neighbours in memory are none on the surface."""

LIFT = 1e-4

UNDECIDED = (0.15, 0.85)
"""Metallic between these is neither metal nor not."""

DIELECTRIC = (30 / 255, 240 / 255)
"""sRGB in which the albedo of what is not metal lies: charcoal to fresh snow."""

GUTTER = 4
"""Texels that must lie between two charts at least, so that mip levels do not bleed."""

FARTHEST = 16
"""Texels under which the space between charts is measured."""


@dataclass(frozen=True)
class Facts:
    """What the maps of one texture set tell, before they are put away.

    texels: on charts. undecided: of these, in metallic. dielectric, odd: those that are no metal, and of these whose albedo is
    out of range. gap: see `narrowest`. rows, surface: (K, 5) and where on the surface, of some texels.
    """

    texels: int
    undecided: int
    dielectric: int
    odd: int
    gap: int | None
    rows: NDArray[np.float32]
    surface: Surface

    @staticmethod
    def of(maps: NDArray[np.float32], touched: Surface, island: NDArray[np.int32], part: float) -> "Facts":
        """Args: maps: (H, W, 5). touched: (H, W) surface points. island: (F,). part: the set's share of the surface."""
        on_chart = touched.triangle >= 0
        rows, surface = maps[on_chart], touched.where(on_chart)
        count = min(math.ceil(POINTS * part), len(rows))
        picked = np.sort(np.random.default_rng(0).choice(len(rows), count, replace=False))
        gap = narrowest(np.where(on_chart, island[touched.triangle] + 1, 0).astype(np.int32))
        dielectric, odd = out_of_range(rows)
        return Facts(len(rows), undecided(rows[:, 4]), dielectric, odd, gap, rows[picked], surface[picked])


def checks(
    mesh: Artifact, sets: list[TextureSet], facts: list[Facts], scene: Scene, lights: list[Environment], said: dict[str, Any]
) -> list[Check]:
    """All of them.

    Args:
        sets, facts: one for each texture set. lights: those whose light might have been baked in. said: what bake.json says:
        "coverage", "unseen".
    """
    texels = sum(of.texels for of in facts)
    rows = np.concatenate([of.rows for of in facts])
    between = sum(of.undecided for of in facts) / texels
    return [
        density(mesh, np.array([of.size for of in sets])[triangle_sets(mesh)]),
        coverage(said["coverage"]),
        gutter(min((of.gap for of in facts if of.gap is not None), default=None)),
        share("Unseen", said["unseen"], 0.25, "of the surface that no view saw; its material is that of the nearest seen"),
        share("Metallic undecided", between, 0.05, "of the texels lie between 0.15 and 0.85"),
        albedo_range(sum(of.dielectric for of in facts), sum(of.odd for of in facts)),
        baked_light(rows, joined([of.surface for of in facts]), scene, lights),
    ]


def percent(value: float) -> str:
    """A share in three digits at most."""
    return f"{100 * value:.2g} %" if value < 0.1 else f"{100 * value:.0f} %"


def share(name: str, value: float, most: float, note: str) -> Check:
    """A share that should be small."""
    return Check(name, percent(value), "good" if value <= most else "look", f"{note}; at most {percent(most)} is usual")


def rounded(value: float) -> str:
    """Three digits, without an exponent."""
    return f"{float(f'{value:.3g}'):,.10g}"


def coverage(value: float) -> Check:
    """How much of the texture is used."""
    return Check("Texture used", percent(value), "fact", "of the texels lie on a chart; the others are filled from the nearest")


def density(mesh: Artifact, size: NDArray[np.int64]) -> Check:
    """Texels per unit of the source, by area: the median, and how much it varies. Args: size: (F,) of their textures."""
    scale = np.cbrt(abs(np.linalg.det(mesh["to_world"][:3, :3])))
    corners = mesh["vertices"][mesh["triangles"]].astype(np.float64) / scale
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    (ux, uy), (vx, vy) = ((mesh["uv"][:, k] - mesh["uv"][:, 0]).T.astype(np.float64) for k in (1, 2))
    per_unit = np.sqrt(np.abs(ux * vy - uy * vx) / np.where(area > 0, area, np.inf)) * size
    order = np.argsort(per_unit)
    cumulative = np.cumsum(area[order]) / max(area.sum(), np.finfo(float).tiny)
    low, middle, high = per_unit[order][np.searchsorted(cumulative, (0.05, 0.5, 0.95)).clip(0, len(order) - 1)]
    state = "good" if high <= 2 * low else "look"
    across = f"{rounded(middle / scale)} along the object's longest edge"
    note = f"{rounded(low)} to {rounded(high)} over 90 % of the area; {across}"
    return Check("Texel density", f"{rounded(middle)} per unit", state, note)


def islands(mesh: Artifact, mine: NDArray[np.bool_]) -> NDArray[np.int32]:
    """The UV island of each triangle: those that share a vertex with its UV hang together.

    Args:
        mine: (F,) triangles that are asked about.
    Returns:
        (F,), from 0; -1 of others.
    """
    bits = np.ascontiguousarray(mesh["uv"][mine]).view(np.uint64).reshape(-1)
    corner = np.stack([mesh["triangles"][mine].reshape(-1).astype(np.uint64), bits], 1)
    _, vertex = np.unique(corner, axis=0, return_inverse=True)
    a, b, c = vertex.reshape(-1, 3).T
    pairs = np.concatenate([a, b]), np.concatenate([b, c])
    graph = coo_matrix((np.ones(2 * len(a), np.int8), pairs), (int(vertex.max()) + 1,) * 2)
    result = np.full(len(mine), -1, np.int32)
    result[mine] = connected_components(graph, directed=False)[1][a]
    return result


def gutter(found: int | None) -> Check:
    """The narrowest space between two UV islands. Args: found: by `narrowest`."""
    value = f"{found} texels" if found is not None else f"{FARTHEST} texels or more"
    state = "good" if found is None or found >= GUTTER else "look"
    return Check("Padding", value, state, f"between the nearest two UV islands; {GUTTER} or more keep mip levels from bleeding")


def narrowest(labels: NDArray[np.int32]) -> int | None:
    """Empty texels between the nearest two of the regions (labels from 1, 0 is empty), or None when FARTHEST or more.

    Regions grow a texel at a time, over corners too, until two of them touch or want the same texel.
    """
    highest = labels.copy()
    lowest = np.where(labels == 0, np.iinfo(np.int32).max, labels)
    for step in range(FARTHEST // 2):
        empty, high, low = highest == 0, _neighbours(highest, np.maximum), _neighbours(lowest, np.minimum)
        two = (high != low) & (high > 0)
        if (two & ~empty).any():
            return 2 * step
        if two.any():
            return 2 * step + 1
        highest, lowest = np.where(empty, high, highest), np.where(empty, low, lowest)
    return None


def _neighbours(values: NDArray[np.int32], best: np.ufunc) -> NDArray[np.int32]:
    """The largest, or smallest, of each texel and its eight neighbours."""
    for axis in (0, 1):
        now, before = np.moveaxis(values.copy(), axis, 0), np.moveaxis(values, axis, 0)
        best(now[1:], before[:-1], out=now[1:])
        best(now[:-1], before[1:], out=now[:-1])
        values = np.moveaxis(now, 0, axis)
    return values


def baked_light(rows: NDArray[np.float32], surface: Surface, scene: Scene, lights: list[Environment]) -> Check:
    """Correlation of log albedo and log irradiance over some texels: what a light that was baked in would show."""
    points = loose_points(scene, surface)
    sums = trace(scene, points, cached_light_set(tuple(lights)), RAYS, 0).of_lights(len(lights))
    irradiance = sums.mean[:, 0].reshape(len(rows), len(lights), 3).sum(1)
    value = log_correlation(rows[:, :3], irradiance)
    note = "correlation of albedo and light, where 0 is none; under 0.2 either way is usual"
    return Check("Baked light", f"{value:+.2f}", "good" if abs(value) <= 0.2 else "look", note)


def loose_points(scene: Scene, surface: Surface) -> GBuffer:
    """Surface points that are looked at from straight above."""
    weights = np.c_[surface.barycentric, 1 - surface.barycentric.sum(1)].astype(np.float32)
    ng = scene.geometric_normal(surface.triangle).astype(np.float32)
    n = scene.shading_normal(surface.triangle, weights).astype(np.float32)
    point = scene.point(surface.triangle, weights).astype(np.float32)
    mask, depth = np.ones((1, len(point)), bool), np.ones((1, len(point)), np.float32)
    return GBuffer(mask, depth, point, point + LIFT * ng, n, ng, n, surface.triangle, weights)


def undecided(metallic: NDArray[np.float32]) -> int:
    """How many lie between UNDECIDED."""
    return int(((metallic > UNDECIDED[0]) & (metallic < UNDECIDED[1])).sum())


def out_of_range(rows: NDArray[np.float32]) -> tuple[int, int]:
    """How many are not metal, and of these have an albedo that no real dielectric has. Args: rows (N, 5)."""
    low, high = (float(srgb_decode(np.array(edge))) for edge in DIELECTRIC)
    brightest = rows[rows[:, 4] < 0.5, :3].max(1)
    return len(brightest), int(((brightest > high) | (brightest < low)).sum())


def albedo_range(dielectric: int, odd: int) -> Check:
    """Share of what is not metal that is odd. Args: of `out_of_range`."""
    note = "of what is not metal; real ones lie between sRGB 30 and 240"
    if not dielectric:
        return Check("Albedo out of range", "all metal", "fact", note)
    return share("Albedo out of range", odd / dielectric, 0.01, note)
