"""Directions of a surface, along which courses, threads, boards and brushing run.

A *piece* is a part that hangs together. Its `turn` is a rotation that takes the world to the piece: the third axis stays up,
the first two are the piece's own horizontal axes, so that a wall which stands at an angle has level courses that start
square. A piece that is round about an upright axis is measured around that axis, in whole turns; any other by its sides, like
a box. `grain` is its longest direction, along which wood is sawn. """

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled
from stages.material.surface import Array

ROUND = 0.93
"""A piece is round if its level normals point away from its axis by this cosine, on average over its area."""

FLOOR = 0.707
"""A point whose normal rises by more than this is floor or ceiling, not wall."""

LEAST_SHARE = 0.02
"""A piece with a smaller share of the surface lies in the directions of the whole."""

TURNS, FIRST_ROUND = 4, 8
"""Sides of a box, and the first face number of round pieces; 4 and 5 are floor and ceiling."""


class Pieces(NamedTuple):
    """What is known of K pieces; row 0 is the whole object. centre: (K, 3). turn: (K, 3, 3) rows are the piece's axes.
    radius: (K,) mean distance from the axis of a round piece, 0 for one that is not round. grain: (K, 3) unit."""

    centre: Array
    turn: Array
    radius: Array
    grain: Array


WHOLE = Pieces(
    np.zeros((1, 3), np.float32), np.eye(3, dtype=np.float32)[None], np.zeros(1, np.float32), np.array([[0, 0, 1]], np.float32)
)
"""The pieces of a thing of which nothing is known."""


def measure(point: Array, normal: Array, area: Array, piece: NDArray[np.int64]) -> tuple[Pieces, NDArray[np.int32]]:
    """The pieces of a surface, from points on it.

    Args:
        point, normal: (P, 3) world. area: (P,) that each stands for. piece: (P,) which hangs together with which, from 0.
    Returns:
        the pieces; (P,) the row of each point.
    """
    share = np.bincount(piece, area) / area.sum()
    large = np.flatnonzero(share >= LEAST_SHARE) if (share >= LEAST_SHARE).sum() > 1 else np.zeros(0, np.int64)
    row = np.zeros(len(share), np.int32)
    row[large] = np.arange(1, len(large) + 1)
    groups = [np.ones(len(point), bool), *(piece == k for k in large)]
    found = [_piece(point[g].astype(np.float64), normal[g].astype(np.float64), area[g]) for g in groups]
    centre, turn, radius, grain = (np.array(column, np.float32) for column in zip(*found, strict=True))
    return Pieces(centre, turn, radius, grain), row[piece]


def _piece(point: NDArray, normal: NDArray, area: NDArray) -> tuple[NDArray, NDArray, float, NDArray]:
    weight = area / max(area.sum(), 1e-30)
    centre = (point * weight[:, None]).sum(0)
    away = point - centre
    spread, axes = np.linalg.eigh((away * weight[:, None]).T @ away)
    grain = axes[:, -1] if spread[-1] > 1.2 * spread[-2] else np.array([0.0, 0, 1])
    wall = abs(normal[:, 2]) < FLOOR
    return centre, _turn(normal[wall], weight[wall]), _radius(away[wall], normal[wall], weight[wall]), grain


def _turn(normal: NDArray, weight: NDArray) -> NDArray:
    """The rotation about z to which most walls are square: the mean of their azimuth modulo a quarter turn."""
    quarter = np.angle((weight * np.exp(4j * np.arctan2(normal[:, 1], normal[:, 0]))).sum()) / 4 if len(normal) else 0.0
    c, s = np.cos(quarter), np.sin(quarter)
    return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def _radius(away: NDArray, normal: NDArray, weight: NDArray) -> float:
    """Mean radius of walls that stand round an upright axis through the centre; 0 where they do not."""
    radius = np.hypot(away[:, 0], away[:, 1])
    level = np.hypot(normal[:, 0], normal[:, 1])
    if not weight.sum() > 0 or not (radius * weight).sum() > 0:
        return 0.0
    outward = abs((away[:, :2] * normal[:, :2]).sum(1)) / np.maximum(radius * level, 1e-9)
    azimuth = np.exp(1j * np.arctan2(away[:, 1], away[:, 0]))
    all_around = abs((weight * azimuth).sum()) / weight.sum() < 0.35
    is_round = all_around and (outward * weight).sum() / weight.sum() > ROUND
    return float((radius * weight).sum() / weight.sum()) if is_round else 0.0


def along(pieces: Pieces, piece: NDArray[np.int32], point: Array, normal: Array) -> tuple[Array, NDArray[np.int32]]:
    """Coordinates along the surface, across and up, world units, and the face each point belongs to.

    Args:
        piece: (P,) rows of `pieces`. point, normal: (P, 3).
    Returns:
        (2, P); (P,) int32, at least `FIRST_ROUND` on round pieces.
    """
    uv, face = np.empty((2, len(piece)), np.float32), np.empty(len(piece), np.int32)
    _along(piece, point, normal, pieces.turn, pieces.centre, pieces.radius, uv, face)
    return uv, face


@compiled
def _along(piece, point, normal, turns, centres, radii, uv, face):  # type: ignore[no-untyped-def]
    half, quarter = np.float32(0.5), np.float32(2 * np.pi / TURNS)
    for i in range(len(piece)):
        k = piece[i]
        turn = turns[k]
        x, y, z = point[i, 0] - centres[k, 0], point[i, 1] - centres[k, 1], point[i, 2] - centres[k, 2]
        px, py = turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z, turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z
        pz = turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z
        nx, ny, nz = normal[i, 0], normal[i, 1], normal[i, 2]
        mx, my = turn[0, 0] * nx + turn[0, 1] * ny + turn[0, 2] * nz, turn[1, 0] * nx + turn[1, 1] * ny + turn[1, 2] * nz
        mz = turn[2, 0] * nx + turn[2, 1] * ny + turn[2, 2] * nz
        if abs(mz) >= np.float32(FLOOR):
            uv[0, i], uv[1, i] = px, py
            own = 4 if mz > 0 else 5
        elif radii[k] > 0:
            uv[0, i], uv[1, i] = math.atan2(y, x) * radii[k], pz
            own = FIRST_ROUND
        else:
            own = int(math.floor(math.atan2(my, mx) / quarter + half)) % TURNS
            uv[0, i] = py if own == 0 else -px if own == 1 else -py if own == 2 else px
            uv[1, i] = pz
        face[i] = own + 16 * k


def along_reference(pieces: Pieces, piece: NDArray[np.int32], point: Array, normal: Array) -> tuple[Array, NDArray[np.int32]]:
    """`along`, slowly and plainly."""
    turn, away = pieces.turn[piece], point - pieces.centre[piece]
    p, n = np.einsum("pij,pj->pi", turn, away), np.einsum("pij,pj->pi", turn, normal)
    side = (np.floor(np.arctan2(n[:, 1], n[:, 0]) / (2 * np.pi / TURNS) + 0.5) % TURNS).astype(np.int32)
    angle = side * np.float32(2 * np.pi / TURNS)
    across = p[:, 1] * np.cos(angle) - p[:, 0] * np.sin(angle)
    flat = abs(n[:, 2]) >= FLOOR
    uv = np.stack([np.where(flat, p[:, 0], across), np.where(flat, p[:, 1], p[:, 2])])
    face = np.where(flat, np.where(n[:, 2] > 0, 4, 5), side)
    round_wall = (pieces.radius[piece] > 0) & ~flat
    around = np.arctan2(away[:, 1], away[:, 0]) * pieces.radius[piece]
    uv[0] = np.where(round_wall, around, uv[0])
    face = np.where(round_wall, FIRST_ROUND, face) + 16 * piece
    return uv.astype(np.float32), face.astype(np.int32)
