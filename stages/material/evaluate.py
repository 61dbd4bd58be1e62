"""The material that a recipe gives to points of a surface: the one function that bake, distill, previews and swatches share."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stages.core.color import srgb_decode
from stages.core.parallel import compiled
from stages.material.directions import WHOLE, Pieces, along
from stages.material.look import Look, from_oklab, to_oklab
from stages.material.masks import coverage
from stages.material.place import Place, columns
from stages.material.recipe import Coat, Recipe
from stages.material.substances import ALONG_GRAIN, LOOKS, METRES
from stages.material.surface import Array, Surface

COLUMNS = 6
"""Red, green and blue of the linear albedo, roughness, metallic, height in object sizes."""

DARKEST = 0.004
"""Least albedo of a channel: soot's. Colours that words name may lie outside of what any surface has."""

SAMPLES = 96
"""Edge of the square of samples from which a look's means are told."""


def evaluate(recipe: Recipe, surface: Surface, pieces: Pieces = WHOLE) -> Array:
    """Material of points: (P, 6), see `COLUMNS`. The recipe is settled (`masks.settled`)."""
    return evaluate_coats(recipe, surface, pieces)[0]


def evaluate_coats(recipe: Recipe, surface: Surface, pieces: Pieces = WHOLE) -> tuple[Array, Array]:
    """The same, and how much of each point is each coat's: (P, K), which sum to 1."""
    result = np.empty((len(surface), COLUMNS), np.float32)
    shares = np.zeros((len(surface), len(recipe.coats)), np.float32)
    first = 0
    for own, rows in by_part(recipe, surface.label):
        columns = slice(first, first + len(own.coats))
        result[rows], shares[rows, columns] = _alone(own, surface[rows], pieces)
        first = columns.stop
    return result, shares


def by_part(recipe: Recipe, label: NDArray[np.int32]) -> Iterator[tuple[Recipe, NDArray[np.int64] | slice]]:
    """The recipe of what is no part, and of each part, with the points that have it. Args: label: (P,)."""
    if not recipe.parts:
        yield recipe, slice(None)
        return
    owner = owners([part.labels for part in recipe.parts], label)
    for number, own in enumerate((replace(recipe, parts=()), *(part.recipe for part in recipe.parts))):
        yield own, np.flatnonzero(owner == number)


def owners(parts: Sequence[Sequence[int]], label: NDArray) -> NDArray[np.int64]:
    """(P,) the part, from 1, that each point belongs to; 0 for those of none. Args: parts: labels of each. label: (P,)."""
    most = max((max(labels) for labels in parts if labels), default=0)
    owner = np.zeros(max(most, int(label.max(initial=0))) + 1, np.int64)
    for number, labels in enumerate(parts, 1):
        owner[list(labels)] = number
    return owner[label]


def _alone(recipe: Recipe, surface: Surface, pieces: Pieces) -> tuple[Array, Array]:
    """`evaluate_coats` of a recipe without parts."""
    result = np.empty((len(surface), COLUMNS), np.float32)
    shares = np.empty((len(surface), len(recipe.coats)), np.float32)
    uv, face = along(pieces, surface.piece, surface.point, surface.normal)
    for rows, around in _groups(face, pieces):
        part = surface[rows]
        p = np.ascontiguousarray(part.point.T)
        world = Place(p, columns(uv, rows), face[rows], part.footprint, (around, 0, 0), recipe.seed)
        result[rows], shares[rows] = layered(recipe, part, world, pieces)
    return result, shares


def _groups(face, pieces: Pieces):  # type: ignore[no-untyped-def]
    """Points that share a period: those of each round piece, and all others. Yields (rows, way around).

    Its floor and ceiling have the period of its wall, though they are narrower: what is solid then runs on from one to the
    other.
    """
    piece = face // 16
    for k in np.flatnonzero(pieces.radius > 0):
        rows = np.flatnonzero(piece == k)
        if len(rows):
            yield rows, float(2 * np.pi * pieces.radius[k])
    rows = np.flatnonzero(pieces.radius[piece] == 0)
    if len(rows):
        yield rows, 0.0


def layered(recipe: Recipe, surface: Surface, world: Place, pieces: Pieces = WHOLE) -> tuple[Array, Array]:
    """As `evaluate_coats`, of points that share a period. Args: world: the same points in object sizes."""
    values = coated(recipe.base, surface, world, pieces, 0)
    shares = np.zeros((len(values), len(recipe.coats)), np.float32)
    shares[:, 0] = 1
    for number, layer in enumerate(recipe.layers, 1):
        cover = coverage(layer.masks, surface, world.seeded(number)) * np.float32(layer.strength)
        some = np.flatnonzero(cover > 0)
        if len(some):
            over = coated(layer.coat, surface[some], world[some], pieces, number)
            relief = layer.strength**2 * over[:, 5]  # what lies thinly stands out little
            over[:, 5] = relief + 0.5 * values[some, 5] + layer.thickness / layer.coat.metres
            values[some] += (over - values[some]) * cover[some, None]
            shares[some] *= 1 - cover[some, None]
            shares[some, number] = cover[some]
    return values, shares


def coated(coat: Coat, surface: Surface, world: Place, pieces: Pieces, number: int) -> Array:
    """One coat at points: (P, 6). Args: number: of the coat in its recipe, which seeds it."""
    metres = np.float32(coat.metres)
    place = Place(
        _solid(coat, surface, world, pieces, number) * metres, world.uv * metres, world.face, world.footprint * metres,
        (world.period[0] * coat.metres, world.period[1] * coat.metres, 0.0), world.seed * 31 + number,
    )  # fmt: skip
    found = LOOKS[coat.look](place)
    found = turned(found._replace(color=found.color * steadying(coat.look, place.footprint)), coat)
    columns = [*found.color, found.roughness, found.metallic, found.height / metres * np.float32(coat.relief)]
    return np.stack([np.broadcast_to(c, len(world)) for c in columns], 1).astype(np.float32)


def _solid(coat: Coat, surface: Surface, world: Place, pieces: Pieces, number: int) -> Array:
    """Positions in the coat's own frame, (3, P) object sizes: turned and shifted by chance; wood is sawn along each piece."""
    dice = np.random.default_rng([world.seed, number])
    shift = dice.uniform(0, 4, (3, 1)).astype(np.float32)
    if world.period[1]:  # a square that tiles lies as it is
        return world.p + shift
    if coat.look not in ALONG_GRAIN:
        angle = dice.uniform(0, 2 * np.pi)
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]], np.float32)
        return turn @ surface.point.T + shift
    frames = np.stack([_grain_frame(axis) for axis in pieces.grain])  # (K, 3, 3)
    own = dice.uniform(0, 0.3, (len(frames), 3)).astype(np.float32)[surface.piece]  # every piece is cut elsewhere
    local = np.einsum("pij,pj->pi", frames[surface.piece], surface.point - pieces.centre[surface.piece])
    return np.ascontiguousarray((local + own).T, np.float32)


def _grain_frame(grain: Array) -> Array:
    """A rotation whose second axis is the grain's. Args: (3,) unit. Returns: (3, 3)."""
    other = np.array([0, 0, 1]) if abs(grain[2]) < 0.9 else np.array([1, 0, 0])
    first = np.cross(grain, other)
    first /= np.linalg.norm(first)
    return np.stack([first, grain, np.cross(first, grain)]).astype(np.float32)


FOOTPRINTS = tuple(2.0**k for k in range(-13, -5))
"""At which a look's mean is told, shares of its `METRES`; the first is the truth."""


def steadying(look: str, footprint: Array) -> Array:
    """By what a look's colours are multiplied so that their mean is the same at every footprint: what is too fine to be seen
    leaves it a little darker or lighter where colours are not linear in it. Args: (P,) metres. Returns: (3, P)."""
    result = np.empty((3, len(footprint)), np.float32)
    _between(_gains(look), footprint, np.float32(METRES[look] * FOOTPRINTS[0]), result)
    return result


@compiled
def _between(gains, footprint, finest, result):  # type: ignore[no-untyped-def]
    """Gains (3, K), an octave apart from the finest footprint on, between which they are interpolated."""
    last, most = np.float32(-1), gains.shape[1] - 1
    low, within = 0, np.float32(0)
    for i in range(len(footprint)):
        if footprint[i] != last:  # most points have their neighbour's
            last = footprint[i]
            octave = min(max(np.float32(math.log2(last / finest)), np.float32(0)), np.float32(most))
            low = min(int(octave), most - 1)
            within = octave - np.float32(low)
        for c in range(3):
            result[c, i] = gains[c, low] + (gains[c, low + 1] - gains[c, low]) * within


@cache
def _gains(look: str) -> Array:
    """Mean at the finest footprint over that at each of `FOOTPRINTS`, (3, K)."""
    found = np.stack([_sampled(look, METRES[look] * share, 64).color.mean(1) for share in FOOTPRINTS], 1)
    return np.clip(found[:, :1] / np.maximum(found, 1e-6), 0.7, 1.4).astype(np.float32)


def _sampled(look: str, footprint: float, count: int) -> Look:
    """A look at count x count points of a square of the size at which it is legible. Args: footprint: metres."""
    across = (np.arange(count, dtype=np.float32) + 0.5) * np.float32(METRES[look] / count)
    u, v = (a.ravel() for a in np.meshgrid(across, across))
    size = np.full(len(u), footprint, np.float32)
    return LOOKS[look](Place(np.stack([u, v, 0 * u]), np.stack([u, v]), np.zeros(len(u), np.int32), size))


class Means(NamedTuple):
    """Of a look: OKLab of its dyed share, (3,); roughness; metallic."""

    lab: Array
    roughness: float
    metallic: float


@cache
def means(look: str) -> Means:
    """A look's means over a square of the size at which it is legible."""
    found = _sampled(look, METRES[look] / 512, SAMPLES)
    dye = np.broadcast_to(np.asarray(found.dye, np.float64), SAMPLES**2) + 1e-6
    color = (found.color * dye).sum(1) / dye.sum()
    lab = to_oklab(color[:, None])[:, 0]
    return Means(lab.astype(np.float32), float(np.mean(found.roughness)), float(np.mean(found.metallic)))


def turned(found: Look, coat: Coat) -> Look:
    """A look with its dyed share's colours, its roughness and metallic moved to the means that the coat asks for."""
    mean = means(coat.look)
    color, roughness, metallic = found.color, found.roughness, found.metallic
    if coat.color is not None or coat.contrast != 1:
        color = color + (recolored(color, mean.lab, coat) - color) * found.dye
    if coat.roughness is not None:
        room = (1 - coat.roughness) / max(1 - mean.roughness, 1e-3) + 0.3
        spread = min(1.0, coat.roughness / max(mean.roughness, 1e-3), room)
        roughness = coat.roughness + (roughness - mean.roughness) * np.float32(spread)
    if coat.metallic is not None:
        metallic = metallic + np.float32(coat.metallic - mean.metallic)
    roughness, metallic = (np.clip(a, 0, 1) for a in (roughness, metallic))
    return Look(np.clip(color, DARKEST, 1), roughness, metallic, found.height, found.dye)


CLEAN = 0.35
"""Least share of its contrast that a look keeps in a light colour: dye varies, and white has little of it."""


def recolored(color: Array, mean: Array, coat: Coat) -> Array:
    """Colours about another mean, at the same contrast, or less where that mean is lighter than the look's own.

    Args: color (3, P) linear; mean (3,) OKLab. Returns: (3, P).
    """
    wanted = mean
    if coat.color is not None:
        wanted = to_oklab(srgb_decode(np.array(coat.color, np.float64))[:, None])[:, 0].astype(np.float32)
    lab = to_oklab(np.maximum(color, 1e-5)).astype(np.float32)
    density = np.log(min(wanted[0], 0.999)) / np.log(min(mean[0], 0.99))
    kept = np.float32(coat.contrast * min(1.0, max(density, CLEAN)))
    lightness = wanted[0] * (1 + kept * (lab[0] / mean[0] - 1))
    gain = np.minimum(kept, np.float32(coat.contrast * max(wanted[0] / mean[0], 0.3)))
    return from_oklab(np.stack([np.clip(lightness, 0.02, 1), *(wanted[k] + gain * (lab[k] - mean[k]) for k in (1, 2))]))
