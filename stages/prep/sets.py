"""Which texture sets a layout has: one atlas, a set for each material slot, UDIM tiles, or a set for each slot and tile.

Two questions, asked apart. *Tiles* are UDIM's where islands keep to one tile each, in the range that has numbers, and would
cover others' texels if all tiles were laid over each other; where these others are their likes, a whole number of tiles away,
they are copies that mean to share texels, as mirrored halves moved aside before baking are. *Slots* have layouts of their own
where one covers the texels of another: each has a texture in the program that the mesh is from.
"""

import re
import unicodedata
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from stages.core.naming import unique
from stages.core.texture_sets import ONE_SET, TextureSet
from stages.core.tiles import drawn, flat, signed_area, tiles
from stages.prep.source import Source
from stages.prep.uv import covered, loop_uvs, uv_charts

FIRST_TILE, ACROSS, UP = 1001, 10, 900
TILES = ACROSS * UP
"""UDIM: the tile (u, v) is 1001 + u + 10 v, for u below ACROSS and v below UP. Source: Mari's manual, "UDIM"."""

TIDY = 0.999
"""Least share of the surface whose islands keep to a tile."""

CLASH = 0.1
"""Share of the texels of a tile or slot that others cover too, from which they are told apart."""

COPIED = 0.5
"""Share of the surface outside of the fullest tile, from which tiles of which it is a copy are no UDIMs."""

LIKE = 4e-3
"""How far the moments of two islands may differ, in UV, for one to be the other's copy."""

LONGEST = 48
"""Letters of a slot's name that files take."""


@dataclass(frozen=True)
class Divided:
    """of_face: (P,) set of each face of the source. sets: at least one. told: what was found, in words."""

    of_face: NDArray[np.int32]
    sets: list[TextureSet]
    told: str

    def homes(self) -> NDArray[np.int64]:
        """The tile (u, v) of each set, (sets, 2); the unit square where it has none."""
        place = np.array([FIRST_TILE if one.tile is None else one.tile for one in self.sets]) - FIRST_TILE
        return np.stack([place % ACROSS, place // ACROSS], 1)


@dataclass(frozen=True)
class Laid:
    """The layout of T triangles with area in UV. triangles, uv: (T, 3) and (T, 3, 2). area: (T,) in space. slot, face: (T,)
    material slot and face of the source."""

    triangles: NDArray[np.int32]
    uv: NDArray[np.float32]
    area: NDArray[np.float64]
    slot: NDArray[np.int64]
    face: NDArray[np.int64]


NO_NUMBERS = "some of its surface lies in tiles that have no UDIM number"


def undivided(source: Source) -> Divided:
    """One atlas."""
    slots = tuple(dict.fromkeys(part.material for part in source.parts))
    return Divided(np.zeros(len(source.face_part), np.int32), [replace(ONE_SET, slots=slots)], "one")


def by_slots(source: Source, area: NDArray, face: NDArray, textures: str) -> Divided:
    """The sets of a mesh that is given new UVs: one a slot where that is asked for. Args: as for `divided`."""
    if textures != "slots":
        return undivided(source)
    slots, slot = slots_of(source)
    shown = np.isin(slot, slot[face])
    return _named(np.where(shown, slot, slot[face[0]]) * TILES, slot, slots, True, False, area, face)


def slots_of(source: Source) -> tuple[list[str], NDArray[np.int64]]:
    """Names of the material slots, and the slot of each face, (P,)."""
    slots = list(dict.fromkeys(part.material for part in source.parts))
    return slots, np.array([slots.index(part.material) for part in source.parts])[source.face_part]


def divided(
    source: Source, triangles: NDArray, uv: NDArray, area: NDArray, face: NDArray, textures: str
) -> Divided | None:
    """The sets of a layout; None where its tiles have no UDIM numbers but must have.

    Args:
        triangles: (F, 3) of the working mesh. uv: (F, 3, 2), NaN where missing. area: (F,) in space. face: (F,) of the source.
        textures: as in `PrepOptions`.
    """
    slots, slot = slots_of(source)
    shown = np.isfinite(uv).all((1, 2)) & ~flat(np.nan_to_num(uv))
    if not shown.any():
        return undivided(source)
    laid = Laid(triangles[shown], uv[shown], area[shown], slot[face[shown]], face[shown])
    by_tile = textures == "udim" or (textures == "auto" and udim(laid))
    by_slot = textures == "slots" or (textures == "auto" and clashing(laid, by_tile))
    if not (by_tile or by_slot):
        return undivided(source)
    tile = tile_numbers(source) if by_tile else np.zeros(len(slot), np.int64)
    key = np.where(tile >= 0, (slot if by_slot else 0) * TILES + tile, -1)
    known = np.unique(key[laid.face])
    known = known[known >= 0]
    if by_tile and laid.area[key[laid.face] < 0].sum() > (1 - TIDY) * laid.area.sum():
        return None
    key = _with_others(np.where(np.isin(key, known), key, -1), slot, triangles, face, laid)
    return _named(key, slot, slots, by_slot, by_tile, area, face)


# ---------------------------------------------------------------------------------------------------- tiles


def tile_numbers(source: Source) -> NDArray[np.int64]:
    """The tile of each face of the source by its middle, u + 10 v, (P,); -1 where it has no number or no UVs."""
    uv, counts = loop_uvs(source).astype(np.float64), np.diff(source.loop_start)
    with np.errstate(invalid="ignore"):
        middle = np.add.reduceat(uv, source.loop_start[:-1]) / counts[:, None]
        u, v = np.floor(middle.T)
        good = (u >= 0) & (u < ACROSS) & (v >= 0) & (v < UP)
        return np.where(good, u + ACROSS * v, -1).astype(np.int64)


def udim(laid: Laid) -> bool:
    """Whether a layout's tiles are UDIM's."""
    low, count = tiles(laid.uv)
    if not len(low) or (low == low[0]).all():
        return False
    island = uv_charts(laid.triangles, laid.uv)
    own = _extreme(island, low, np.minimum), _extreme(island, low + count - 1, np.maximum)
    tidy = (own[0] == own[1]).all(1) & (own[0] >= 0).all(1) & (own[0] < (ACROSS, UP)).all(1)
    if laid.area[tidy[island]].sum() < TIDY * laid.area.sum():
        return False
    tile = own[0] @ np.array([1, ACROSS])
    return _crowded(laid.uv, tile[island], np.zeros(len(low), int)) and not _copies(laid, island, tile)


def _extreme(island: NDArray, values: NDArray, best: np.ufunc) -> NDArray[np.int64]:
    """The least or the greatest value of each island, (I, 2). Args: values: (T, 2)."""
    found = np.empty((int(island.max()) + 1, 2), np.int64)
    found[island] = values
    best.at(found, island, values)
    return found


def _copies(laid: Laid, island: NDArray, tile: NDArray) -> bool:
    """Whether most of what lies outside of the fullest tile is, whole tiles away, an island of another tile again.

    Islands of one slot are alike whose areas, middles and spreads in UV are, their areas in space and numbers of triangles too.

    Args:
        island: (T,). tile: (I,) of each island.
    """
    count = len(tile)
    local = laid.uv.astype(np.float64) - np.stack([tile % ACROSS, tile // ACROSS], -1)[island][:, None]
    size = np.abs(signed_area(laid.uv))
    total = np.bincount(island, size, count)
    middle = np.stack([np.bincount(island, size * local[..., k].mean(1), count) for k in (0, 1)], 1) / total[:, None]
    apart = local - middle[island][:, None]
    x, y = apart[..., 0], apart[..., 1]
    products = [(a * b).sum(1) + a.sum(1) * b.sum(1) for a, b in ((x, x), (y, y), (x, y))]
    spread = [np.sqrt(np.abs(np.bincount(island, size * product / 12, count) / total)) for product in products]
    area, slot = np.bincount(island, laid.area, count), np.zeros(count)
    slot[island] = laid.slot
    relative = [np.log(np.maximum(area, 1e-30)) / 10, np.log(np.bincount(island, minlength=count)) / 10]  # to 4 %
    moments = np.c_[np.sqrt(total), middle, np.stack([*spread, *relative, slot], 1)]
    copied = np.zeros(count, bool)
    fullest = np.bincount(tile, area).argmax()
    for number in np.unique(tile).tolist():
        mine, others = np.flatnonzero(tile == number), tile != number
        copied[mine] = cKDTree(moments[others]).query(moments[mine], distance_upper_bound=LIKE)[0] < LIKE
    outside = tile != fullest
    return bool(area[outside & copied].sum() > COPIED * area[outside].sum())


# ---------------------------------------------------------------------------------------------------- slots


def clashing(laid: Laid, by_tile: bool) -> bool:
    """Whether slots cover each other's texels. Args: by_tile: whether tiles are apart."""
    if not len(laid.slot) or (laid.slot == laid.slot[0]).all():
        return False
    low = np.floor(laid.uv.mean(1)).astype(np.int64) @ np.array([1, ACROSS])
    return _crowded(laid.uv, laid.slot, low if by_tile else np.zeros(len(low), int))


def _crowded(uv: NDArray, label: NDArray, within: NDArray) -> bool:
    """Whether on any texture triangles of a label cover many texels of another's. Args: label, within: (T,) label, texture."""
    for texture in np.unique(within).tolist():
        mine = np.flatnonzero(within == texture)
        labels = np.unique(label[mine])
        if len(labels) == 1:
            continue
        covers = [np.packbits(_cover(uv[mine[label[mine] == one]], len(labels))) for one in labels.tolist()]
        once, more = np.zeros_like(covers[0]), np.zeros_like(covers[0])
        for cover in covers:
            more, once = more | once & cover, once | cover
        counts = [(_count(cover), _count(cover & more)) for cover in covers]
        if any(shared > CLASH * all_ for all_, shared in counts if all_):
            return True
    return False


def _count(bits: NDArray[np.uint8]) -> int:
    return int(np.unpackbits(bits).sum())


def _cover(uv: NDArray, labels: int) -> NDArray[np.bool_]:
    """The texels that triangles cover, whole tiles laid over each other."""
    return covered(drawn(uv, np.zeros(len(uv), np.int32)).corners, labels) > 0


# ---------------------------------------------------------------------------------------------------- names


def _with_others(key: NDArray, slot: NDArray, triangles: NDArray, face: NDArray, laid: Laid) -> NDArray[np.int64]:
    """Keys (P,) in which faces that have no texels of their own (-1) take those of their slot: a neighbour's, else its first;
    of a slot without any, the largest set's."""
    if (key >= 0).all():
        return key
    key, none = key.copy(), np.iinfo(np.int64).max
    real = key[laid.face] >= 0
    vertices = int(triangles.max()) + 1
    beside = np.full(vertices * (int(slot.max()) + 1), none)
    np.minimum.at(beside, slot[laid.face[real]] * vertices + laid.triangles[real].T, key[laid.face[real]])
    mine = np.flatnonzero(key[face] < 0)
    found = beside[slot[face[mine]] * vertices + triangles[mine].T].min(0)
    there = found < none
    key[face[mine[there]]] = found[there]
    first = np.full(int(slot.max()) + 1, none)
    np.minimum.at(first, slot[laid.face[real]], key[laid.face[real]])
    keys, of = np.unique(key[laid.face[real]], return_inverse=True)
    largest = keys[np.bincount(of, laid.area[real]).argmax()]
    rest = key < 0
    key[rest] = np.where(first[slot[rest]] < none, first[slot[rest]], largest)
    return key


def _named(
    key: NDArray, slot: NDArray, slots: list[str], by_slot: bool, by_tile: bool, area: NDArray, face: NDArray
) -> Divided:
    """Sets in the order of slots, then tiles."""
    keys, of_face = np.unique(key, return_inverse=True)
    own, tile = keys // TILES, keys % TILES
    words = unique([file_word(slots[k]) for k in dict.fromkeys(own.tolist())]) if by_slot else []
    named = dict(zip(dict.fromkeys(own.tolist()), words, strict=False))
    size = np.bincount(of_face.reshape(-1)[face], area, len(keys))
    sets = []
    for k, (number, place) in enumerate(zip(own.tolist(), tile.tolist(), strict=True)):
        suffix = (f"_{named[number]}" if by_slot else "") + (f".{FIRST_TILE + place}" if by_tile else "")
        shown = tuple(slots[s] for s in np.unique(slot[of_face.reshape(-1) == k]).tolist())
        share = round(float(size[k] / size.sum()), 6)
        sets.append(TextureSet(suffix, FIRST_TILE + place if by_tile else None, shown, share))
    kind = "slot and tile" if by_slot and by_tile else "UDIM tile" if by_tile else "slot"
    return Divided(of_face.reshape(-1).astype(np.int32), sets, f"{len(sets)}, one for each {kind}")


def file_word(name: str) -> str:
    """A slot's name as files may have it: letters and digits of any script."""
    safe = re.sub(r"[^\w-]+", "_", unicodedata.normalize("NFC", name)).strip("_")
    return safe[:LONGEST] or "material"
