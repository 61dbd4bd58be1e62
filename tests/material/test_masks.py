"""Where layers lie: veins, fades and sides. The plate is a square of edge 1 that stands upright, seen from its front."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage
from scipy.ndimage import label

from stages.material.masks import coverage, settled
from stages.material.place import Place
from stages.material.recipe import Coat, Layer, Mask, Recipe
from stages.material.surface import Surface


def plate(size: int, extent: float = 1.0) -> Surface:
    """(size²) points, row by row from the top."""
    across = (np.arange(size) + 0.5) / size * extent
    y, z = (a.ravel() for a in np.meshgrid(across, across[::-1]))
    point = np.stack([0 * y, y, z], 1).astype(np.float32)
    return Surface.bare(point, np.broadcast_to(np.array([1, 0, 0], np.float32), point.shape), extent / size)


def covered(mask: Mask, size: int, extent: float = 1.0) -> np.ndarray:
    """How much of each point a mask covers that was settled on the whole plate: (size, size)."""
    layer = settled(Recipe(Coat("even"), (Layer(Coat("even"), (mask,)),), 3), plate(128)).layers[0]
    surface = plate(size, extent)
    flat = np.ascontiguousarray(surface.point.T[1:])
    place = Place(np.ascontiguousarray(surface.point.T), flat, np.zeros(len(surface), np.int32), surface.footprint, seed=3)
    return coverage(layer.masks, surface, place.seeded(1)).reshape(size, size)


def test_veins_cover_their_share_thinly_and_crisply() -> None:
    veins = Mask("veins", 0.06, 0.22, 0.0)
    whole = covered(veins, 256)
    assert abs(whole.mean() - 0.06) < 0.02
    coarse, fine = (((near > 0.05) & (near < 0.95)).mean() for near in (covered(veins, size, 0.25) for size in (128, 512)))
    assert 0 < fine < 0.4 * coarse  # borders a texel wide: a quarter of the area where texels are a quarter as long
    inside = whole > 0.5
    eroded = inside[4:-4, 4:-4] & inside[8:, 4:-4] & inside[:-8, 4:-4] & inside[4:-4, 8:] & inside[4:-4, :-8]
    assert eroded.sum() < 0.25 * inside.sum()


def test_a_share_is_one_of_what_shows() -> None:
    """A vessel's inside hides more than any crease outside, and would take the whole share of crevices."""
    count = 4_000
    dice = np.random.default_rng(0)
    inside = np.arange(count) < count // 3
    occlusion = np.where(inside, dice.uniform(0.93, 0.99, count), dice.uniform(0, 0.5, count)).astype(np.float32)
    point = dice.uniform(-0.5, 0.5, (count, 3)).astype(np.float32)
    bare = Surface.bare(point, np.tile(np.float32([0, 0, 1]), (count, 1)), 1e-3)
    surface = replace(bare, occlusion=occlusion)
    mask = Mask("crevices", 0.22, wear=0.0)
    recipe = settled(Recipe(Coat("even"), (Layer(Coat("rust"), (mask,)),)), surface)
    place = Place(np.ascontiguousarray(point.T), np.zeros((2, count), np.float32), np.zeros(count, np.int32), surface.footprint)
    cover = coverage(recipe.layers[0].masks, surface, place)
    assert cover[inside].mean() > 0.99
    assert 0.1 < cover[~inside].mean() < 0.3


def test_a_fade_rises_from_nothing_to_all() -> None:
    rows = covered(Mask("fade", 0.5, 0.6, 0.0), 64).mean(1)
    assert rows[:6].min() > 0.95 and rows[-6:].max() < 0.05 and abs(rows.mean() - 0.5) < 0.08
    assert np.all(np.diff(rows[::8]) <= 0.02)


@pytest.mark.parametrize(
    ("kind", "side"),
    [("left", np.s_[:, 40:]), ("right", np.s_[:, :24]), ("above", np.s_[:24]), ("below", np.s_[40:])],
)
def test_halves_are_where_words_say(kind: str, side: tuple[slice, ...]) -> None:
    cover = covered(Mask(kind, 0.5, 0.05, 0.0), 64)
    assert cover[side].min() == 1 and abs(cover.mean() - 0.5) < 0.02


def test_a_boxs_walls_keep_no_snow() -> None:
    """A share of half of a box is more than its top: walls do not make up for it."""
    wall, top = (np.tile(np.float32(n), (2000, 1)) for n in ([1, 0, 0], [0, 0, 1]))
    point = np.random.default_rng(0).uniform(-0.5, 0.5, (4000, 3)).astype(np.float32)
    surface = Surface.bare(point, np.concatenate([wall, top[:1000], -top[:1000]]), 1e-3)
    recipe = settled(Recipe(Coat("even"), (Layer(Coat("snow"), (Mask("up", 0.5, wear=0.4),)),)), surface)
    place = Place(np.ascontiguousarray(point.T), np.zeros((2, 4000), np.float32), np.zeros(4000, np.int32), surface.footprint)
    cover = coverage(recipe.layers[0].masks, surface, place)
    assert cover[:2000].max() < 0.02 and cover[2000:3000].min() > 0.98 and cover[3000:].max() < 0.02


def test_a_soft_mask_thins_out() -> None:
    """Dust lies thinner where a surface turns away from the sky; snow ends."""
    hard, soft = (covered(Mask("patches", 0.4, 0.3, 0.2, soft=soft), 256) for soft in (0.0, 0.4))
    assert abs(hard.mean() - soft.mean()) < 0.08
    assert ((soft > 0.1) & (soft < 0.9)).mean() > 2 * ((hard > 0.1) & (hard < 0.9)).mean()


def test_dots_are_equal_and_stand_in_staggered_rows() -> None:
    whole = covered(Mask("dots", 0.25, 0.125, 0.0), 512)
    assert abs(whole.mean() - 0.25) < 0.02
    near = np.roll(whole, (32, 32), (0, 1))  # half of the spacing each way
    assert abs(whole - near)[64:, 64:].mean() < 0.01 < abs(whole - np.roll(whole, 32, 1)).mean()


def test_flowers_are_apart_and_crisp() -> None:
    flowers = covered(Mask("flowers", 0.3, 0.25, 0.0), 256)
    assert 0.25 < flowers.mean() < 0.4 and ((flowers > 0.05) & (flowers < 0.95)).mean() < 0.1
    _, count = label(flowers[32:-32, 32:-32] > 0.5)
    assert 12 <= count <= 32  # two in each square, those at the border cut


def test_gingham_has_three_tones() -> None:
    whole = covered(Mask("gingham", 0.5, 0.125, 0.0), 512)
    shares = [(abs(whole - tone) < 0.02).mean() for tone in (0.0, 0.5, 1.0)]
    assert np.allclose(shares, (0.25, 0.5, 0.25), atol=0.03)


def test_chevrons_turn_back_on_themselves() -> None:
    whole = covered(Mask("zigzag", 0.5, 0.125, 0.0), 512)
    assert abs(whole.mean() - 0.5) < 0.02
    assert abs(whole - whole[:, ::-1]).mean() < 0.02  # a mirror image of itself
    assert abs(whole - np.roll(whole, 32, 1)).mean() > 0.2  # and not of straight bands


def cube(size: int) -> Surface:
    """Points on the six sides of a cube of edge 1 about the origin, size² each."""
    across = (np.arange(size) + 0.5) / size - 0.5
    u, v = (a.ravel() for a in np.meshgrid(across, across))
    sides = [(axis, sign) for axis in range(3) for sign in (-0.5, 0.5)]
    point = np.concatenate([np.insert(np.stack([u, v], 1), axis, sign, 1) for axis, sign in sides]).astype(np.float32)
    normal = np.concatenate([np.broadcast_to(2 * sign * np.eye(3)[axis], (len(u), 3)) for axis, sign in sides])
    return Surface.bare(point, normal.astype(np.float32), 1 / size)


def on_cube(mask: Mask, size: int = 64) -> tuple[Surface, np.ndarray]:
    """A cube, and whether a mask settled on it covers each of its points."""
    surface = cube(size)
    layer = settled(Recipe(Coat("even"), (Layer(Coat("even"), (mask,)),), 3), surface).layers[0]
    place = Place(surface.point.T.copy(), surface.point.T[:2].copy(), np.zeros(len(surface), np.int32), surface.footprint)
    return surface, coverage(layer.masks, surface, place) > 0.5


def test_a_badge_lies_in_the_middle_of_the_front_and_nowhere_else() -> None:
    surface, covered_ = on_cube(Mask("badge", 0.3, 0.05, 0.0))
    front = surface.normal[:, 0] > 0.5
    assert not covered_[~front].any()
    assert (abs(surface.point[covered_, 1:]) < 0.15 + 1 / 64).all()
    assert 0.8 * 0.3**2 < covered_[front].mean() < 0.3**2  # a square with round corners
    surface, covered_ = on_cube(Mask("badge", 3.0, 0.05, 0.0))
    assert (covered_ == (surface.normal[:, 0] > 0.5)).mean() > 0.99  # all of the front


def test_a_waist_and_arms_are_where_words_say() -> None:
    surface, waist = on_cube(Mask("middle", 0.25, 0.05, 0.0))
    assert (waist == (abs(surface.point[:, 2]) < 0.125)).mean() > 0.99
    surface, arms = on_cube(Mask("sides", 0.5, 0.05, 0.0))
    assert (arms == (abs(surface.point[:, 1]) > 0.25)).mean() > 0.99


def test_scratches_are_thin_strokes_that_run_any_way() -> None:
    whole = covered(Mask("scratches", 0.05, 0.1), 1024)
    assert 0.03 < whole.mean() < 0.07
    assert abs(covered(Mask("scratches", 0.05, 0.1), 128).mean() - whole.mean()) < 0.012  # those that are too thin to see count
    thick = ndimage.minimum_filter(whole, 7)
    assert (thick > 0.5).mean() < 0.001  # hardly anything is seven texels wide
    along, across = np.gradient(ndimage.gaussian_filter(whole, 1.0))
    steep = np.hypot(along, across) > 0.05
    turn = np.arctan2(along, across)[steep]
    assert abs(np.exp(2j * turn).mean()) < 0.25  # no way is preferred
    pieces, _ = label(whole > 0.4, np.ones((3, 3)))
    lengths = [max(rows.stop - rows.start, columns.stop - columns.start) for rows, columns in ndimage.find_objects(pieces)]
    on_strokes = np.array(lengths)[pieces[pieces > 0] - 1] > 40
    assert on_strokes.mean() > 0.5  # and not specks
    twice = covered(Mask("scratches", 0.1, 0.1), 512).mean()
    assert 1.6 < twice / covered(Mask("scratches", 0.05, 0.1), 512).mean() < 2.4
