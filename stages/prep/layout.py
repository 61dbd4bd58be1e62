"""Whether a source's UVs can be kept, and what is unusual of them: told, not mended.

Kept are UVs that give texels to nearly all of the surface, wherever in the plane they lie and however many places share a
texel: mirrored and stacked islands are what artists mean. They are not kept where they repeat so often that little of the
texture would be each place's own.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core.tiles import Representatives, drawn, flat, signed_area, tiles
from stages.prep.source import rows_of
from stages.prep.topology import face_components
from stages.prep.uv import covered, uv_vertices

TEXTURED = 0.98
"""Least share of the surface that must have texels."""

OFTEN = 4.0
"""Most tiles that an island may go through, on average over the surface: each border shows a seam."""

STACKED = 16.0
"""Most times that the covered texels may be covered, where what shares them differs in size."""

ALIKE, SCALE = 0.9, 1.5
"""Share of the surface that must lie on its representative's texels at its own scale, to within this factor, to be alike."""

SAMPLES = 4096
"""Points of the surface at which that is asked."""

FAR, WIDE = 4096.0, 64.0
"""Tiles away from the square beyond which float32 knows no texel, and tiles that one face may go through."""

COPIES = 8.0
"""Most tiles that a face may lie in, on average over the faces."""

SHARED = 1e-3
"""Share of the covered texels that more than one place may claim without being told."""


@dataclass(frozen=True)
class Kept:
    """chart: (F,), of those that share texels the lowest represents. shared: whether a texel may show more than one place.
    told: what was found and done, in words."""

    chart: NDArray[np.int32]
    shared: bool
    told: list[str]


def sound(uv: NDArray[np.float32]) -> NDArray[np.float32]:
    """UVs (F, 3, 2), NaN for faces that lack some, lie too far away or go through too many tiles."""
    with np.errstate(invalid="ignore", over="ignore"):
        good = (np.abs(uv) <= FAR).all((1, 2)) & (np.ptp(uv, axis=1) <= WIDE).all(1)
    return np.where(good[:, None, None], uv, np.float32(np.nan))


def unusable(triangles: NDArray, uv: NDArray, area: NDArray, sets: NDArray) -> str | None:
    """Why UVs cannot be kept, or None.

    Args:
        triangles: (F, 3). uv: (F, 3, 2), NaN where missing. area: (F,) of the faces in space. sets: (F,) texture of each.
    """
    uv = sound(uv)
    finite = np.isfinite(uv).all((1, 2))
    if not finite.any():
        return "none in the file"
    textured = finite & ~flat(np.nan_to_num(uv))
    if area[textured].sum() < TEXTURED * area.sum():
        found = f"{int((~finite).sum())} of {len(uv)} faces have none and {int((finite & ~textured).sum())} no area"
        return f"{found}: {_percent(1 - area[textured].sum() / area.sum())} of the surface would have no texels"
    if tiles(uv[finite])[1].prod(1).sum() > COPIES * len(uv) + 100_000:
        return "faces go through many tiles: little of the texture would be a place's own"
    triangles, uv, area, sets = triangles[textured], uv[textured], area[textured], sets[textured]
    often = _tiled(set_charts(triangles, uv, sets), uv, area)
    if often > OFTEN:
        return f"islands go through {often:.0f} tiles each: little of the texture would be a place's own"
    times = _times(uv, sets)
    if times > STACKED and not _alike(triangles, uv, area, sets):
        return f"islands of many sizes cover the same texels {times:.0f} times: little of the texture would be a place's own"
    return None


def keep(
    triangles: NDArray, uv: NDArray, area: NDArray, sets: NDArray, missing: NDArray, new: NDArray | None = None,
    home: NDArray | int = 0,
) -> Kept:  # fmt: skip
    """Charts of a layout that is kept, and what is unusual of it.

    Args:
        triangles: (F, 3). uv: (F, 3, 2) finite. area: (F,) in space. sets: (F,) texture of each. missing: (F,) faces without
        UVs in the file. new: (F,) faces that were given charts of their own. home: (F, 2) tiles where they are meant to lie.
    """
    told, lost = ["kept"], flat(uv) & ~missing
    if new is not None and new.any():
        told.append(f"{_faces(new)} mended, with charts in free space")
        missing = missing & ~new
    low, count = tiles(uv)
    outside = (low != home).any(1) | (count != 1).any(1)
    if outside.any():
        told.append(f"{_faces(outside)} outside the {'unit square' if np.all(home == 0) else 'tile'}, whose textures repeat")
    if lost.any():
        told.append(f"{_faces(lost)} without area in UV, each shows the texel that it touches")
    if missing.any():
        told.append(f"{_faces(missing)} without UVs, each shows a neighbour's texel")
    shared = _shared(uv, sets)
    if shared < SHARED:
        return Kept(set_charts(triangles, uv, sets), bool(lost.any() or missing.any()), told)
    told.append(f"{_percent(shared)} of the texels are shared by stacked, mirrored or repeated islands")
    return Kept(sharing(triangles, uv, area, sets), True, told)


def sharing(triangles: NDArray, uv: NDArray, area: NDArray, sets: NDArray) -> NDArray[np.int32]:
    """Charts (F,) of a layout whose islands share texels; of those that do the largest in space is the lowest."""
    return _ranked(_one_sided(triangles, uv, sets), area)


def with_neighbours(uv: NDArray[np.float32], triangles: NDArray, polygon: NDArray) -> NDArray[np.float32]:
    """UVs (F, 3, 2) in which a polygon that lacks some shows one texel: its own, its neighbour's, or the mesh's first."""
    good = np.asarray(np.isfinite(uv).all(-1))
    if good.all():
        return uv
    corner = np.arange(good.size).reshape(good.shape)
    least = good.size  # the first corner with UVs, by vertex and by polygon
    at_vertex, of_polygon = np.full(int(triangles.max()) + 1, least), np.full(int(polygon.max()) + 1, least)
    np.minimum.at(at_vertex, triangles[good], corner[good])
    np.minimum.at(of_polygon, polygon, np.where(good, corner, least).min(1))
    beside = np.full_like(of_polygon, least)
    np.minimum.at(beside, polygon, at_vertex[triangles].min(1))
    first = np.where(of_polygon < least, of_polygon, beside)
    first = np.where(first < least, first, corner[good][0])
    return np.where(good[..., None], uv, uv.reshape(-1, 2)[first[polygon]][:, None])


def _faces(chosen: NDArray[np.bool_]) -> str:
    return f"{int(chosen.sum()):,} of {len(chosen):,} faces"


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def _tiled(chart: NDArray, uv: NDArray, area: NDArray) -> float:
    """Tiles that an island goes through, along u times along v, mean over the surface; 1 where none is larger than a tile."""
    low, high = (np.full((int(chart.max()) + 1, 2), sign * np.inf) for sign in (1, -1))
    np.minimum.at(low, np.repeat(chart, 3), uv.reshape(-1, 2))
    np.maximum.at(high, np.repeat(chart, 3), uv.reshape(-1, 2))
    return float(np.average(np.maximum(high - low, 1.0).prod(1)[chart], weights=area))


def _times(uv: NDArray, sets: NDArray) -> float:
    """How often the covered texels are covered."""
    once = sum(float((cover > 0).mean()) for cover in _covers(uv, sets))
    return float(np.abs(signed_area(uv)).sum()) / once if once else 1.0


def _shared(uv: NDArray, sets: NDArray) -> float:
    """Share of the covered texels that more than one place claims."""
    counts = [((cover > 1).sum(), (cover > 0).sum()) for cover in _covers(uv, sets)]
    return float(sum(more for more, _ in counts)) / max(int(sum(once for _, once in counts)), 1)


def _covers(uv: NDArray, sets: NDArray) -> Iterator[NDArray[np.int32]]:
    """How many faces cover each texel, of one texture after the other."""
    count = int(sets.max(initial=0)) + 1
    for mine in rows_of(sets, count):
        yield covered(drawn(uv[mine], np.zeros(len(mine), np.int32)).corners, count)


def _alike(triangles: NDArray, uv: NDArray, area: NDArray, sets: NDArray) -> bool:
    """Whether islands that share texels are of one size."""
    found = Representatives(uv, sharing(triangles, uv, area, sets), sets)
    rng = np.random.default_rng(0)
    face = rng.choice(len(uv), SAMPLES, p=area / area.sum()).astype(np.int32)
    scale = found.scale(area, face, found.of(face, rng.dirichlet((1, 1, 1), SAMPLES))[0])
    return bool((np.abs(np.log(scale)) < np.log(SCALE)).mean() >= ALIKE)


def set_charts(triangles: NDArray, uv: NDArray, sets: NDArray) -> NDArray[np.int32]:
    """`uv_charts` (F,), each on one texture."""
    return face_components((int(sets.max(initial=0)) + 1) * uv_vertices(triangles, uv) + sets[:, None])


def _one_sided(triangles: NDArray, uv: NDArray, sets: NDArray) -> NDArray[np.int32]:
    """The same, one way up: a mirrored half is another chart than what it mirrors."""
    return set_charts(triangles, uv, 2 * sets + (signed_area(uv) < 0))


def _ranked(chart: NDArray, area: NDArray) -> NDArray[np.int32]:
    """Charts (F,) numbered by their area in space, the largest first; alike ones by their first face."""
    size = np.round(np.bincount(chart, area) / area.sum(), 4)
    rank = np.empty(len(size), np.int32)
    rank[np.argsort(-size, kind="stable")] = np.arange(len(size), dtype=np.int32)
    return rank[chart]
