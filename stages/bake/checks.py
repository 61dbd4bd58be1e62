"""What a lead artist would check of a baked asset, in numbers, for report.html."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from stages.asset.report_page import Check
from stages.bake.raster import Surface
from stages.core.artifact import Artifact
from stages.core.color import log_correlation, srgb_decode
from stages.light.environment import Environment
from stages.light.gbuffer import GBuffer
from stages.light.scene import Scene
from stages.light.transport import Quality, light_transport

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


def checks(
    mesh: Artifact, maps: NDArray[np.float32], touched: Surface, scene: Scene, lights: list[Environment], said: dict[str, Any]
) -> list[Check]:
    """All of them.

    Args:
        maps: (H, W, 5). touched: the surface point of each texel. lights: those whose light might have been baked in. said:
        what bake.json says: "coverage", "unseen".
    """
    on_chart = touched.triangle >= 0
    rows = maps[on_chart]
    return [
        density(mesh, len(maps)),
        coverage(said["coverage"]),
        gutter(touched, islands(mesh)),
        share("Unseen", said["unseen"], 0.25, "of the surface that no view saw; its material is that of the nearest seen"),
        share("Metallic undecided", undecided(rows[:, 4]), 0.05, "of the texels lie between 0.15 and 0.85"),
        out_of_range(rows),
        baked_light(mesh, rows, touched.where(on_chart), scene, lights),
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


def density(mesh: Artifact, size: int) -> Check:
    """Texels per unit of the source, by area: the median, and how much it varies."""
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


def islands(mesh: Artifact) -> NDArray[np.int32]:
    """The UV island of each triangle: those that share a vertex with its UV hang together. Returns: (F,), from 0."""
    bits = np.ascontiguousarray(mesh["uv"]).view(np.uint64).reshape(-1)
    corner = np.stack([mesh["triangles"].reshape(-1).astype(np.uint64), bits], 1)
    _, vertex = np.unique(corner, axis=0, return_inverse=True)
    a, b, c = vertex.reshape(-1, 3).T
    pairs = np.concatenate([a, b]), np.concatenate([b, c])
    graph = coo_matrix((np.ones(2 * len(a), np.int8), pairs), (int(vertex.max()) + 1,) * 2)
    return connected_components(graph, directed=False)[1][a].astype(np.int32)


def gutter(touched: Surface, island: NDArray[np.int32]) -> Check:
    """The narrowest space between two UV islands."""
    labels = np.where(touched.triangle >= 0, island[touched.triangle] + 1, 0).astype(np.int32)
    found = narrowest(labels)
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


def baked_light(
    mesh: Artifact, rows: NDArray[np.float32], surface: Surface, scene: Scene, lights: list[Environment]
) -> Check:
    """Correlation of log albedo and log irradiance over some texels: what a light that was baked in would show."""
    picked = np.sort(np.random.default_rng(0).choice(len(rows), min(POINTS, len(rows)), replace=False))
    points = loose_points(scene, surface[picked])
    irradiance = sum(transport.E.float() for transport in light_transport(scene, points, lights, RAYS, 0))
    value = log_correlation(rows[picked, :3], irradiance.numpy())  # type: ignore[union-attr]
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


def undecided(metallic: NDArray[np.float32]) -> float:
    """Share between UNDECIDED."""
    return float(((metallic > UNDECIDED[0]) & (metallic < UNDECIDED[1])).mean())


def out_of_range(rows: NDArray[np.float32]) -> Check:
    """Share of what is not metal whose albedo no real dielectric has. Args: rows (N, 5)."""
    low, high = (float(srgb_decode(np.array(edge))) for edge in DIELECTRIC)
    dielectric = rows[rows[:, 4] < 0.5, :3]
    note = "of what is not metal; real ones lie between sRGB 30 and 240"
    if not len(dielectric):
        return Check("Albedo out of range", "all metal", "fact", note)
    brightest = dielectric.max(1)
    return share("Albedo out of range", float(((brightest > high) | (brightest < low)).mean()), 0.01, note)
