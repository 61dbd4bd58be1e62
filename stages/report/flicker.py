"""How much a view changes with the size of the textures that it is rendered with: band limits that work change nothing."""

import numpy as np
from numpy.typing import NDArray

from stages.core.brdf import MIN_ALPHA, alpha_from_roughness, rougher
from stages.core.color import srgb_encode
from stages.material.directions import WHOLE
from stages.material.evaluate import COLUMNS, coated
from stages.material.place import Place
from stages.material.recipe import Coat
from stages.material.relief import STEEPEST, gentle
from stages.material.substances import METRES
from stages.material.surface import Surface
from stages.material.uneven import patterns, uneven

SIZES = 1024, 4096
"""Texels along an edge of the two textures."""

LIGHT = np.array([0.45, 0.35, 0.82]) / np.linalg.norm([0.45, 0.35, 0.82])
"""Towards the light of the view: right, up, out."""


def flicker(look: str, share: float = 1 / 8, supersample: int = 1, relief: float = 1.0) -> float:
    """RMSE between two views of a substance's square, with textures of both `SIZES`; 1 is white.

    A pixel of the view is as large as two texels of the smaller texture, and both are shaded texel by texel.

    Args: share: of the square's edge that is looked at. supersample: of the smaller one's texels, as in `bake`.
    relief: 0 looks at a flat plate.
    """
    small, large = (textures(look, size, share, s) for size, s in zip(SIZES, (supersample, 1), strict=True))
    pixels = round(SIZES[0] * share) // 2
    one, other = (view(maps, 1 / size, pixels, relief) for maps, size in zip((small, large), SIZES, strict=True))
    return float(np.sqrt(np.square(one - other).mean()))


def textures(look: str, size: int, share: float, supersample: int) -> NDArray[np.float32]:
    """(N + 2, N + 2, 6) texels of a part of a square, see `COLUMNS`, and one beyond each side. size: along the whole edge."""
    first, others = patterns(supersample)
    one = sampled(look, size, share, first)
    if not others.any():
        return one
    borders = uneven(one, np.ones(one.shape[:2], np.bool_))[..., None]
    return np.where(borders, one + (sampled(look, size, share, others) - one) * np.float32(others.mean()), one)


def sampled(look: str, size: int, share: float, pattern: NDArray[np.bool_]) -> NDArray[np.float32]:
    """The same, each the mean of some points. Args: pattern: of `patterns`."""
    count, samples = round(size * share) + 2, len(pattern)
    inside = (np.argwhere(pattern).T + 0.5) / samples - 1  # rows, columns
    down, across = (np.arange(count)[:, None] + shift for shift in inside)
    v, u = (a.astype(np.float32).ravel() / np.float32(size) for a in np.broadcast_arrays(down[:, None], across[None]))
    point = np.stack([u, v, np.zeros_like(u)], 1)
    normal = np.broadcast_to(np.array([0, 0, 1], np.float32), point.shape)
    surface = Surface.bare(point, normal, 1 / (size * samples))
    world = Place(np.ascontiguousarray(point.T), np.stack([u, v]), np.zeros(len(u), np.int32), surface.footprint)
    values = coated(Coat(look, metres=METRES[look]), surface, world, WHOLE, 0)
    return values.reshape(count, count, -1, COLUMNS).mean(2)


def view(maps: NDArray[np.float32], texel: float, pixels: int, relief: float) -> NDArray[np.float64]:
    """Encoded picture (pixels, pixels, 3) of `textures`, seen from above in the light of `LIGHT`: what normals differ by within
    a texel is in its roughness, as in `bake`. Args: texel: edge of one, squares."""
    height = maps[..., 5].astype(np.float64) * relief / texel
    slope = np.stack([height[1:-1, 2:] - height[1:-1, :-2], height[2:, 1:-1] - height[:-2, 1:-1]], -1) / 2
    right, up = np.moveaxis(gentle(slope), -1, 0)
    normal = np.stack([-right, -up, np.ones_like(right)], -1) / np.sqrt(right**2 + up**2 + 1)[..., None]
    material = maps[1:-1, 1:-1].astype(np.float64)
    color = shaded(material[..., :3], rougher(material[..., 3], hidden(height)), material[..., 4:5], normal)
    step = len(color) // pixels
    return srgb_encode(color[: pixels * step, : pixels * step].reshape(pixels, step, pixels, step, 3).mean((1, 3)))


def hidden(height: NDArray[np.float64]) -> NDArray[np.float64]:
    """`relief.bend` of each texel but the outermost. Args: (N + 2, N + 2) texels. Returns: (N, N)."""
    middle = height[1:-1, 1:-1]
    across, down = height[1:-1, :-2] + height[1:-1, 2:] - 2 * middle, height[:-2, 1:-1] + height[2:, 1:-1] - 2 * middle
    twist = (height[2:, 2:] - height[2:, :-2] - height[:-2, 2:] + height[:-2, :-2]) / 4
    return np.square(np.minimum(abs(np.stack([across, down, twist, twist])), STEEPEST)).sum(0) / 24


def shaded(albedo: NDArray, roughness: NDArray, metallic: NDArray, normal: NDArray) -> NDArray[np.float64]:
    """Radiance straight up: two fifths of an even light, three of a lamp towards `LIGHT`; a white matt plate sends 1.

    Source: glTF 2.0, App. B (GGX, height-correlated Smith, Schlick Fresnel).
    """
    up = np.array([0.0, 0.0, 1.0])
    half = (LIGHT + up) / np.linalg.norm(LIGHT + up)
    alpha = np.maximum(alpha_from_roughness(roughness), MIN_ALPHA)[..., None]
    to_light, to_eye = (np.maximum(normal @ w, 1e-3)[..., None] for w in (LIGHT, up))
    frame = (to_half := (normal @ half)[..., None]) * normal - half  # what of it lies across the normal
    q = np.square(frame).sum(-1, keepdims=True) + (alpha * to_half) ** 2
    shadowed = 1 + sum((np.sqrt(1 + alpha**2 * (1 / z**2 - 1)) - 1) / 2 for z in (to_light, to_eye))
    f0 = 0.04 * (1 - metallic) + metallic * albedo
    fresnel = f0 + (1 - f0) * (1 - half @ up) ** 5
    mirrored = fresnel * alpha**2 / (q**2 * 4 * to_eye * shadowed)  # times pi, as matt reflection is
    matt = (1 - metallic) * albedo
    return 0.4 * (matt + f0) + 0.6 / LIGHT[2] * np.where(normal @ LIGHT > 0, 1.0, 0.0)[..., None] * (matt * to_light + mirrored)
