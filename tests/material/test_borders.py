"""Borders between coats at the texels of a 2048² map: as sharp as paint where words ask for it, ragged where it is worn."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.material.directions import WHOLE
from stages.material.evaluate import evaluate
from stages.material.masks import settled
from stages.material.recipe import Coat, Layer, Mask, Recipe
from stages.material.surface import Surface
from stages.material.survey import Lookup, make_survey

TEXEL = 1 / 2048
"""Of the object's longest edge."""

GREY, RED = Coat("even", metallic=0.0), Coat("even", color=(0.8, 0.1, 0.1), metallic=1.0)


@cache
def cube() -> Lookup:
    """The survey of a cube of edge 1."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)], np.float32)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = np.array([[q[0], q[a], q[b]] for q in quads for a, b in ((1, 2), (2, 3))], np.int32)
    p = corners[triangles]
    flat = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    normals = np.repeat(flat[:, None], 3, 1).astype(np.float32)
    label = np.zeros(len(triangles), np.int32)
    return Lookup(make_survey(corners, triangles, normals, lambda origin, direction: np.zeros(len(origin), bool), label))


def metal(mask: Mask, count: int, extent: float, corner: tuple[float, float] = (-0.5, -0.5)) -> NDArray[np.float32]:
    """(count, count) where a layer lies on the front of the cube, from one of its corners on. extent: of what is seen."""
    lookup = cube()
    known = lookup.survey.surface()
    recipe = settled(Recipe(GREY, (Layer(RED, (mask,)),), 3), known[np.arange(0, len(known), 4)], lookup.survey.pieces)
    across = ((np.arange(count) + 0.5) / count * extent).astype(np.float32)
    y, z = (a.ravel() for a in np.meshgrid(across + np.float32(corner[0]), across + np.float32(corner[1])))
    point = np.stack([np.full_like(y, 0.5), y, z], 1)
    normal = np.broadcast_to(np.array([1, 0, 0], np.float32), point.shape)
    footprint = np.full(len(y), extent / count, np.float32)
    surface = lookup.surface(point, normal, footprint) if mask.kind == "edges" else Surface.bare(point, normal, footprint)
    return evaluate(recipe, surface, WHOLE)[:, 4].reshape(count, count)


def length(covered: NDArray[np.bool_]) -> float:
    """Of the border of a region, texels; its steps run along rows and columns, which are 4 / π times as long on average."""
    return float(np.pi / 4 * (np.diff(covered, axis=0).sum() + np.diff(covered, axis=1).sum()))


SHARP = ("below", "front", "stripes", "bands", "zigzag", "spots", "dots", "checks", "patches", "edges")


@pytest.mark.parametrize("kind", SHARP)
def test_a_border_that_words_want_sharp_is_three_texels_wide_at_most(kind: str) -> None:
    count = 256
    corner = (-0.06, -0.06) if kind == "below" else (-0.5, -0.5)
    seen = metal(Mask(kind, 0.5 if kind == "below" else 0.3, 0.08, 0.0), count, count * TEXEL, corner)
    if kind == "front":  # its border is not on the front
        assert seen.min() > 0.98
        return
    low, high = float(seen.min()), float(seen.max())
    assert high - low > 0.5
    share = (seen - low) / (high - low)
    partly = ((share > 0.05) & (share < 0.95)).sum()
    assert length(share > 0.5) > 50 and partly / length(share > 0.5) <= 3


@pytest.mark.parametrize("kind", ["below", "spots", "patches", "chips", "edges"])
def test_a_worn_border_is_irregular_at_every_scale(kind: str) -> None:
    """Measured with texels a quarter as long it is longer, from the object's 128th part to its 2048th."""
    extent = 0.25
    corner = (-0.12, -0.12) if kind == "below" else (-0.5, -0.5)
    mask = Mask(kind, 0.5 if kind == "below" else 0.3, 0.08, 1.0)
    lengths = [length(metal(mask, count, extent, corner) > 0.55) * extent / count for count in (32, 128, 512)]
    assert lengths[1] > 1.12 * lengths[0] > 0 and lengths[2] > 1.12 * lengths[1]
