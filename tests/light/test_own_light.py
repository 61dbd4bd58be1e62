"""Light that an object throws on itself, beside float64 recursion and where it breaks renderers."""

import functools

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from stages.core.color import reinhard
from stages.core.shading import KNOTS, Material, Transport, shade
from stages.light.cells import MOST, Cells, part_of
from stages.light.ends import Ends
from stages.light.environment import Environment
from stages.light.exchange import Exchange, make_exchange, reached
from stages.light.gbuffer import GBuffer
from stages.light.leaving import OwnLight, make_skies, reflectance
from stages.light.lights import studio
from stages.light.own_light import with_own_light
from stages.light.reconstruction import Neighbours
from stages.light.reference import reference_radiance
from stages.light.scene import Scene
from stages.light.terms import BOUNCED
from stages.light.transport import QUALITY, Quality, cached_light_set, integrate_with_ends, trace
from tests.light import scenes
from tests.light.paths import path_traced

STANDARD = QUALITY["standard"]
FEW = 300
"""Cells of these small scenes."""

WHITE, RED = (0.9, 0.9, 0.9, 0.9, 0.0), (0.8, 0.05, 0.05, 0.5, 0.0)
GOLD, STEEL, MIRROR = (1.0, 0.77, 0.34, 0.5, 1.0), (0.56, 0.57, 0.58, 0.8, 1.0), (0.9, 0.9, 0.9, 0.0, 1.0)


@functools.cache
def corner() -> tuple[Scene, GBuffer, Environment, Cells, Exchange, Transport, Ends]:
    """A box in a corner, seen by 32² pixels under a sky with a large lamp."""
    scene, light = scenes.box_in_corner(), scenes.sunny_light(20.0, 16)
    points, cells, lights = scenes.view_of(scene, 32), Cells.of(scene, FEW), cached_light_set((light,))
    transports, ends = integrate_with_ends(scene, points, lights, STANDARD, 0, cells)
    assert ends is not None
    return scene, points, light, cells, make_exchange(scene, cells, [light], 0, 2), transports[0], ends


def everywhere(values: tuple[float, ...]) -> NDArray[np.float32]:
    return np.array([values], np.float32)


def lit(transport: Transport, points: GBuffer, ends: Ends, own: OwnLight, exchange: Exchange) -> Transport:
    return with_own_light(transport, points.n, points.wo, ends, own, exchange.sky, BOUNCED.counts(STANDARD.lobe))


def shaded(
    scene: Scene, points: GBuffer, light: Environment, values: tuple[float, ...], bounces: int, count: int = FEW
) -> NDArray[np.float32]:
    """Radiance (P, 3) of a scene of one material, of direct light and with the object's own."""
    cells = Cells.of(scene, count)
    transports, ends = integrate_with_ends(scene, points, cached_light_set((light,)), STANDARD, 0, cells)
    exchange = make_exchange(scene, cells, [light], 0, bounces)
    own = exchange.solved(everywhere(values).repeat(2 * len(cells), 0), bounces)
    assert ends is not None
    material = Material.of(torch.from_numpy(everywhere(values).repeat(len(points.n), 0)))
    return np.stack([shade(t, material).numpy() for t in (transports[0], lit(transports[0], points, ends, own, exchange))])


def percent(a: NDArray, b: NDArray) -> float:
    """Tone-mapped root mean square difference."""
    x, y = (reinhard(torch.from_numpy(np.asarray(v, np.float64))) for v in (a, b))
    return 100 * float((x - y).square().mean().sqrt())


@pytest.mark.parametrize(("values", "energy"), ((WHITE, 0.02), (RED, 0.02), (GOLD, 0.06), (STEEL, 0.06)))
def test_one_bounce_is_that_of_the_quadrature(values: tuple[float, ...], energy: float) -> None:
    """Four of five parts of the error that direct light has are gone, or what is left is under 1.2 %."""
    scene, points, light, cells, exchange, transport, ends = corner()
    pixels = np.arange(5, len(points.n), len(points.n) // 30)
    own = exchange.solved(everywhere(values).repeat(2 * len(cells), 0), 1)
    material = Material.of(torch.from_numpy(everywhere(values).repeat(len(points.n), 0)))
    direct, found = (shade(t, material).numpy()[pixels] for t in (transport, lit(transport, points, ends, own, exchange)))
    exact = reference_radiance(scene, points[pixels], light, 2, lambda p: everywhere(values).repeat(len(p.n), 0), 1)
    assert percent(found, exact) < max(1.2, 0.2 * percent(direct, exact))
    assert percent(direct, exact) > 1
    assert found.mean() == pytest.approx(exact.mean(), rel=energy)


@pytest.mark.parametrize(
    ("roughness", "energy", "error"), ((0.45, 0.02, 2), (0.3, 0.04, 4), (0.25, 0.04, 6), (0.22, 0.06, 8.5))
)
def test_a_metal_bowl_keeps_its_light(roughness: float, energy: float, error: float) -> None:
    """Gold seen in gold, where the sky is bright above: of a lobe that the bowl half hides, the brighter half is left.

    Direct light alone is off by 21 to 32 %.
    """
    scene, values = scenes.bowl(), (1.0, 0.77, 0.34, roughness, 1.0)
    up = np.linspace(1, -1, 32)[:, None, None]
    light = Environment("overhead", np.exp(1.2 * up).repeat(64, 1).repeat(3, 2).astype(np.float32))
    points = scenes.view_of(scene, 24, (1.6, 1.0, 1.7))
    pixels = np.flatnonzero(points.n[:, 2] > 0)[::37]
    direct, found = (radiance[pixels] for radiance in shaded(scene, points, light, values, 1))
    exact = reference_radiance(scene, points[pixels], light, 1, lambda p: everywhere(values).repeat(len(p.n), 0), 1)
    assert len(pixels) > 5 and direct.mean() < 0.7 * exact.mean()
    assert percent(found, exact) < error
    assert found.mean() == pytest.approx(exact.mean(), rel=energy)


@pytest.mark.parametrize(("roughness", "error"), ((0.05, 1.6), (0.16, 3.2), (0.25, 3.5)))
def test_a_chrome_bowl_mirrors_itself(roughness: float, error: float) -> None:
    """Gloss in gloss, sharper than a quadrature resolves, under small lamps: as paths that are drawn at random have it."""
    scene, values, light = scenes.bowl(), (0.55, 0.56, 0.56, roughness, 1.0), studio()
    points = scenes.view_of(scene, 64, (1.6, 1.0, 1.7))
    pixels = np.flatnonzero(points.n[:, 2] > 0)[::9]
    direct, found = (radiance[pixels] for radiance in shaded(scene, points, light, values, 2, 3000))
    exact = path_traced(scene, points[pixels], light, values, 2)
    assert len(pixels) > 50 and percent(direct, exact) > 10
    assert percent(found, exact) < error
    assert found.mean() < 1.01 * exact.mean()


def test_a_mirror_shows_the_object_as_it_is() -> None:
    """Of the radiance that a mirror's ray brings from a matt red surface, the error is under 3 % of the light."""
    scene, points, light, cells, exchange, transport, ends = corner()
    sides = cells.sides(scene)
    box = lambda p: np.where((p.point.max(1) < 0.1 + 1e-4)[:, None] & (p.point.min(1) > -0.26)[:, None], MIRROR, RED)  # noqa: E731
    pixels = np.flatnonzero((box(points)[:, 4] == 1) & ends.mirror)[::7]
    own = exchange.solved(box(sides).astype(np.float32), 1)
    material = Material.of(torch.from_numpy(box(points).astype(np.float32)))
    found = shade(lit(transport, points, ends, own, exchange), material).numpy()[pixels]
    exact = reference_radiance(scene, points[pixels], light, 1, box, 1)
    assert len(pixels) > 4
    assert percent(found, exact) < 3


def test_noise_of_what_is_added_is_averaged_over_a_picture() -> None:
    """Of plaster in a bowl: with neighbours less than half of the error that its own few rays leave, and the same energy."""
    scene, light = scenes.bowl(), scenes.even_light()
    points, cells, lights = scenes.view_of(scene, 48, (1.6, 1.0, 1.7)), Cells.of(scene, FEW), cached_light_set((light,))
    own = make_exchange(scene, cells, [light], 0, 2).solved(everywhere(WHITE).repeat(2 * len(cells), 0), 2)
    sky = make_skies([light])[0]

    def added(quality: Quality, near: Neighbours | None) -> NDArray:
        transports, ends = integrate_with_ends(scene, points, lights, quality, 0, cells)
        assert ends is not None
        full = with_own_light(transports[0], points.n, points.wo, ends, own, sky, BOUNCED.counts(quality.lobe), near)
        return (full.E - transports[0].E).numpy()

    exact, inside = added(STANDARD.scaled(64), None), points.n[:, 2] > 0
    alone, averaged = (added(STANDARD, near) for near in (None, Neighbours.of(points)))
    error = [np.sqrt(np.square(found - exact)[inside].mean()) for found in (alone, averaged)]
    assert error[1] < 0.5 * error[0]
    assert averaged.mean() == pytest.approx(exact.mean(), rel=0.02)


def test_pixels_of_a_crop_are_neighbours_on_its_lattice() -> None:
    """Every third pixel from (5, 2): next to each other as the pixels of a picture are."""
    x, y = 5 + 3 * np.array([0, 1, 0, 2]), 2 + 3 * np.array([0, 0, 1, 1])
    near = Neighbours.on_lattice(x, y, np.zeros((4, 3)), np.zeros((4, 3)))
    found = near.index[near.pixel[:, 1].min() :, near.pixel[:, 0].min() :]
    assert found.tolist() == [[0, 1, -1], [2, -1, 3]]
    assert Neighbours.on_lattice(x[:1], y[:1], np.zeros((1, 3)), np.zeros((1, 3))).index[2, 5] == 0


def test_direct_light_is_the_same_bit_for_bit() -> None:
    """Asking where rays end changes no sum."""
    scene, points, light, cells, *_ = corner()
    lights = cached_light_set((light,))
    with_ends, without = trace(scene, points, lights, STANDARD, 0, cells=cells), trace(scene, points, lights, STANDARD, 0)
    assert (with_ends.mean == without.mean).all() and (with_ends.variance == without.variance).all()


def test_what_is_convex_has_no_ends() -> None:
    """An open sphere sees nothing of itself, and sends nothing to itself."""
    scene, light = scenes.sphere(3), scenes.even_light()
    points, cells = scenes.view_of(scene, 16), Cells.of(scene, FEW)
    _, ends = integrate_with_ends(scene, points, cached_light_set((light,)), STANDARD, 0, cells)
    assert ends is not None and len(ends.side) == 0
    assert make_exchange(scene, cells, [light], 0, 2).weight.sum() < 0.01 * len(cells)


def test_a_white_furnace_is_never_brighter_than_white() -> None:
    """A corner of the whitest plaster, whose BRDF reflects 0.975 of an even light: every point sends nearly 1."""
    scene = scenes.box_in_corner()
    points = scenes.view_of(scene, 16)
    direct, full = shaded(scene, points, scenes.even_light(), (1.0, 1.0, 1.0, 1.0, 0.0), 12)
    assert direct.mean() < 0.85
    assert 0.93 < full.mean() <= 1.0 and np.percentile(full, 99) < 1.12


def test_a_black_corner_throws_nothing() -> None:
    """Albedo 0 and the roughest gloss: under 4 % of white's light are added."""
    scene = scenes.box_in_corner()
    direct, full = shaded(scene, scenes.view_of(scene, 16), scenes.even_light(), (0.0, 0.0, 0.0, 1.0, 0.0), 4)
    assert 0 <= (full - direct).mean() < 0.04 and np.isfinite(full).all()


def test_parallel_mirrors_a_hair_apart_keep_their_energy() -> None:
    """Two plates that face each other at a thousandth of their size: finite, and never brighter than the light."""
    near, far = scenes.square(2, 0.0, -0.5, 0.5), scenes.square(2, 0.001, -0.5, 0.5)[::-1]
    direct, full = shaded(scenes.quads(near, far), scenes.view_of(scenes.quads(near, far), 24), scenes.even_light(), MIRROR, 8)
    assert np.isfinite(full).all() and full.max() < 1.02
    assert (full >= direct - 1e-9).all()  # what is dark is 0 but for the rounding of interpolation, 1e-10


def test_a_closed_box_with_a_slit_is_lit_through_it_alone() -> None:
    """Inside of a box with a narrow slit: some light, all of it less than a hundredth of what is outside."""
    sides = [scenes.square(axis, at, -0.5, 0.5)[:: (-1 if at > 0 else 1)] for axis in range(3) for at in (-0.5, 0.5)]
    lid = sides[5].copy()
    lid[:, 0] = np.where(lid[:, 0] > 0, 0.49, lid[:, 0])  # a hundredth of the lid is open
    scene = scenes.quads(*sides[:5], lid)
    cells = Cells.of(scene, FEW)
    exchange = make_exchange(scene, cells, [scenes.even_light()], 0, 8)
    own = exchange.solved(everywhere((0.8, 0.8, 0.8, 0.9, 0.0)).repeat(2 * len(cells), 0), 8)
    inner = own.light[0::2]
    assert 0 < inner.mean() < 0.05 and np.isfinite(inner).all()


@pytest.mark.parametrize(("bounces", "met"), ((1, 2), (2, 2), (3, 3), (4, 3), (5, 4)))
def test_sides_that_no_light_reaches_on_the_way_are_not_traced(bounces: int, met: int) -> None:
    """Side 0 lies open and sees side 1, which sees 0 and 2, which sees 1 and 3: light of N bounces gets half as deep."""
    sees = ((1,), (0, 2), (1, 3), (2,))
    side = np.concatenate(sees).astype(np.uint16)
    start = np.cumsum([0, *map(len, sees)]).astype(np.int32)
    pairs = np.zeros((len(side), 2), np.uint16)
    none = np.zeros(4, np.uint8), np.zeros((4, 0), np.float16)
    ends = Ends(start, *none, side, pairs, pairs, none[0][:0], side[:0], side[:0], pairs[:0])
    found = reached(np.arange(4) == 0, np.arange(4), ends, bounces)
    assert found.tolist() == [number < met for number in range(4)]


def test_of_what_is_all_but_closed_few_bounces_meet_little() -> None:
    """Inside of a box that a few rays enter through a slit: two bounces meet those walls that it shows, six all."""
    sides = [scenes.square(axis, at, -0.3, 0.3)[:: (-1 if at < 0 else 1)] for axis in range(3) for at in (-0.3, 0.3)]
    sides[5][:, 0] = np.where(sides[5][:, 0] > 0, 0.29, sides[5][:, 0])
    scene = scenes.quads(*sides, scenes.square(2, 0.4, -0.5, 0.5))
    cells = Cells.of(scene, FEW)
    inner = 1 + 2 * np.flatnonzero(cells.triangle % 7 < 6)
    few, many = (np.diff(make_exchange(scene, cells, [scenes.even_light()], 0, n).ends.start)[inner] > 0 for n in (2, 6))
    assert 0 < few.mean() < 0.5 and many.mean() > 0.95


def test_thin_walls_do_not_leak() -> None:
    """A sheet lit from above: what stands under it sees its dark side, though both sides are one triangle."""
    sheet, floor = scenes.square(2, 0.0, -0.5, 0.5), scenes.square(2, -0.1, -0.5, 0.5)
    scene = scenes.quads(sheet, floor)
    light = Environment("above", np.concatenate([np.ones((8, 64, 3)), np.zeros((24, 64, 3))]).astype(np.float32))
    cells = Cells.of(scene, FEW)
    exchange = make_exchange(scene, cells, [light], 0, 1)
    own = exchange.solved(everywhere(WHITE).repeat(2 * len(cells), 0), 1)
    height = cells.sides(scene).point[:, 2]
    above, under = own.light[0::2][height[0::2] > -0.05], own.light[1::2][height[1::2] > -0.05]
    assert above.mean() == pytest.approx(0.5, abs=0.04) and under.max() < 1e-6


def test_a_sun_in_a_cavity_does_not_sparkle() -> None:
    """Three polished walls under a sun of one texel: they add no more to a matt point than three more suns, straight above."""
    scene, light = scenes.box_in_corner(), scenes.single_texel_light()
    points, cells = scenes.view_of(scene, 16), Cells.of(scene, FEW)
    transports, ends = integrate_with_ends(scene, points, cached_light_set((light,)), STANDARD, 0, cells)
    exchange = make_exchange(scene, cells, [light], 0, 3)
    own = exchange.solved(everywhere((0.9, 0.9, 0.9, 0.1, 1.0)).repeat(2 * len(cells), 0), 3)
    assert ends is not None
    added = lit(transports[0], points, ends, own, exchange).E - transports[0].E
    sun = light.radiance.max() * np.pi / 32 * 2 * np.pi / 64 / np.pi
    assert float(added.median()) > 0 and float(added.max()) < 3 * sun


def test_coincident_faces_are_finite() -> None:
    """A floor that is there twice, and once more turned over."""
    floor = scenes.square(2, 0.0, -0.5, 0.5)
    scene = scenes.quads(floor, floor, floor[::-1], scenes.square(0, -0.5, -0.5, 0.5))
    direct, full = shaded(scene, scenes.view_of(scene, 16), scenes.even_light(), WHITE, 4)
    assert np.isfinite(full).all() and full.max() < 1.1 and (full >= direct).all()


def test_touching_pieces_are_lit_as_the_one_that_they_make() -> None:
    """A stepped pyramid of 56 cubes, whose inner faces touch, and without those: the same light between the steps."""
    steps = [(x, y, layer) for layer, half in enumerate((3, 2, 1)) for x in range(-half, half) for y in range(-half, half)]
    faces: dict[tuple[float, ...], list[NDArray]] = {}
    for cube in steps:
        for axis in range(3):
            for k in (0, 1):
                face = scenes.square(axis, cube[axis] + k, 0.0, 1.0)[:: 1 if k else -1]
                face[:, [a for a in range(3) if a != axis]] += np.delete(cube, axis)
                faces.setdefault((axis, *face.mean(0)), []).append(face / 6)
    touching = scenes.quads(*(face for same in faces.values() for face in same))
    outside = scenes.quads(*(same[0] for same in faces.values() if len(same) == 1))
    assert len(steps) == 56 and len(touching.triangles) == 2 * 6 * 56 > len(outside.triangles)
    parts, whole = (
        shaded(scene, scenes.view_of(scene, 24), scenes.even_light(), WHITE, 4, 3000)[1] for scene in (touching, outside)
    )
    assert np.isfinite(parts).all() and np.percentile(parts, 99) < 1.05
    assert percent(parts, whole) < 0.1


def test_a_million_triangles_are_lit_as_the_few_that_they_lie_in() -> None:
    """The corner, each of its 18 triangles cut in 62,500: as many cells, and the same light between them."""
    few = scenes.box_in_corner()
    many = scenes.cut(few, 250)
    assert len(many.triangles) == 1_125_000 and len(Cells.of(many, 4 * FEW)) < 2 * len(Cells.of(few, 4 * FEW)) < MOST
    light = scenes.sunny_light(20.0, 16)
    (_, exact), (direct, found) = (shaded(scene, scenes.view_of(scene, 24), light, WHITE, 2) for scene in (few, many))
    assert percent(found, exact) < 0.5 < 0.2 * percent(direct, exact)
    assert found.mean() == pytest.approx(exact.mean(), rel=0.005)


def test_every_point_lies_in_its_cell() -> None:
    """The point that stands for a cell is found in it, and there are no more cells than numbers for them."""
    for scene in (scenes.box_in_corner(), scenes.sphere(4)):
        cells = Cells.of(scene)
        where = zip(cells.first[cells.triangle], cells.cuts[cells.triangle], cells.barycentric, strict=True)
        own = [first + part_of(cuts, b[0], b[2]) for first, cuts, b in where]
        assert own == list(range(len(cells))) and len(cells) <= MOST


def test_a_cell_half_within_another_piece_is_stood_for_by_what_is_seen() -> None:
    """A floor through a cube: no cell that reaches out of the cube by a third of itself is stood for by a point within."""
    cube = [scenes.square(axis, at, -0.23, 0.23)[:: (-1 if at < 0 else 1)] for axis in range(3) for at in (-0.23, 0.23)]
    scene = scenes.quads(scenes.square(2, 0.0, -0.5, 0.5), *cube)
    cells = Cells.of(scene, 100)
    point, flat = scene.point(cells.triangle, cells.barycentric), cells.triangle < 2
    within = flat & (np.abs(point[:, :2]).max(1) < 0.23)
    assert 0 < within.sum() < flat.sum() / 4
    assert np.abs(point[within, :2]).max() < 0.23 - cells.width / 3


def test_a_cell_is_stood_for_by_a_point_like_most_of_it() -> None:
    """A floor under strips that hide a quarter of it, each a hair above: no cell is stood for by what lies under one."""
    strips = []
    for k in range(12):
        strip = scenes.square(2, 0.004, -0.5, 0.5)[::-1]
        strip[:, 0] = np.where(strip[:, 0] > 0, 0.02, 0.0) + (k - 5.75) * 0.08
        strips.append(strip)
    cells = Cells.of(scenes.quads(scenes.square(2, 0.0, -0.5, 0.5), *strips), 60)
    floor = cells.triangle < 2
    point = scenes.quads(scenes.square(2, 0.0, -0.5, 0.5)).point(cells.triangle[floor], cells.barycentric[floor])
    under = (point[:, 0] / 0.08 + 5.75) % 1 < 0.25
    assert len(under) > 30 and not under.any()


def test_a_material_reflects_no_more_than_all() -> None:
    """White metal at most 1, white plaster what glTF's BRDF has: 1.04 where its gloss is a mirror."""
    rows = np.array([(1, 1, 1, r, m) for r in (0, 0.3, 0.6, 1) for m in (0, 1)], np.float32)
    found = reflectance(rows)
    assert found.max() < 1.05 and found[rows[:, 4] == 1].max() < 1.001 and found[rows[:, 4] == 1].min() > 0.4


def test_only_what_is_asked_is_interpolated() -> None:
    """What is added is linear in the receiver's albedo and metallic: at the knots, E, A and B are what is stored."""
    _, points, _, cells, exchange, transport, ends = corner()
    own = exchange.solved(everywhere(RED).repeat(2 * len(cells), 0), 2)
    full = lit(transport, points, ends, own, exchange)
    assert full.A.shape == (len(points.n), len(KNOTS), 3)
    assert bool((full.E >= transport.E).all() and (full.A >= transport.A).all() and (full.B >= transport.B).all())
