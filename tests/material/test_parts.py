"""Named parts are found where they are: legs, handles, blades, and nothing where the shape shows none."""

from dataclasses import replace

import numpy as np
import pytest

from stages.material.directions import Pieces
from stages.material.masks import coverage, settled
from stages.material.parts import found
from stages.material.place import Place
from stages.material.recipe import Coat, Layer, Mask, Recipe
from stages.material.surface import Surface

RNG = np.random.default_rng(0)


def box(low: tuple[float, ...], high: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Points spread evenly over a box, and their normals."""
    low_, size = np.array(low), np.array(high) - np.array(low)
    points, normals = [], []
    for axis in range(3):
        for side in (0.0, 1.0):
            area = np.delete(size, axis).prod()
            p = RNG.random((max(4, int(40000 * area)), 3))
            p[:, axis] = side
            points.append(low_ + p * size)
            normals.append(np.broadcast_to(np.eye(3)[axis] * (2 * side - 1), p.shape))
    return np.concatenate(points), np.concatenate(normals)


def tube(radius: float, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """An upright cylinder without ends."""
    count = int(12000 * 2 * np.pi * radius * (high - low))
    angle = RNG.random(count) * 2 * np.pi
    normal = np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)
    return normal * radius + np.stack([0 * angle, 0 * angle, RNG.uniform(low, high, count)], 1), normal


def ring(centre: tuple[float, ...], large: float, small: float) -> tuple[np.ndarray, np.ndarray]:
    """A torus that stands upright in the plane of x and z."""
    a, b = RNG.random((2, 4000)) * 2 * np.pi
    normal = np.stack([np.cos(a) * np.cos(b), np.sin(b), np.sin(a) * np.cos(b)], 1)
    return np.array(centre) + large * np.stack([np.cos(a), 0 * a, np.sin(a)], 1) + small * normal, normal


def surface(*pieces: tuple[np.ndarray, np.ndarray], apart: bool = False) -> Surface:
    point = np.concatenate([p for p, _ in pieces]).astype(np.float32)
    normal = np.concatenate([n for _, n in pieces]).astype(np.float32)
    number = np.concatenate([np.full(len(p), k if apart else 0, np.int32) for k, (p, _) in enumerate(pieces, 1)])
    zero = np.zeros(len(point), np.float32)
    return Surface(point, normal, zero + np.float32(1e-3), zero, zero, number, 0 * number)


LEGS = [box((x, y, -0.5), (x + 0.04, y + 0.04, 0.2)) for x in (-0.3, 0.26) for y in (-0.3, 0.26)]
TABLE = [*LEGS, box((-0.32, -0.32, 0.2), (0.32, 0.32, 0.25))]
SWORD = [box((-0.012, -0.012, -0.5), (0.012, 0.012, -0.3)), box((-0.02, -0.1, -0.3), (0.02, 0.1, -0.27)),
         box((-0.004, -0.025, -0.27), (0.004, 0.025, 0.5))]  # fmt: skip
HAMMER = [box((-0.015, -0.015, -0.5), (0.015, 0.015, 0.4)), box((-0.04, -0.15, 0.38), (0.04, 0.15, 0.48))]
MUG = [tube(0.25, -0.3, 0.3), ring((0.25, 0, 0), 0.15, 0.03)]


PIECES = Pieces(
    np.zeros((8, 3), np.float32), np.repeat(np.eye(3, dtype=np.float32)[None], 8, 0), np.zeros(8, np.float32),
    np.repeat(np.array([[0, 0, 1]], np.float32), 8, 0),
)  # fmt: skip


def covered(surface_: Surface, word: str, *, region: str = "below") -> np.ndarray:
    """Share of each point that a part covers."""
    layer = Layer(Coat("oak"), (Mask(region, 0.3, 0.05, 0.0, said=word),))
    recipe = settled(Recipe(Coat("steel"), (layer,)), surface_, PIECES)
    place = Place(np.ascontiguousarray(surface_.point.T), surface_.point.T[:2].copy(), surface_.piece, surface_.footprint)
    return coverage(recipe.layers[0].masks, surface_, place)


@pytest.mark.parametrize("apart", [True, False])
def test_legs_end_where_the_top_begins(apart: bool) -> None:
    table = surface(*TABLE, apart=apart)
    cover, leg = covered(table, "legs") > 0.5, table.point[:, 2] < 0.199
    assert (cover == leg).mean() > 0.97
    assert (covered(table, "with the legs") == covered(table, "legs")).all()


@pytest.mark.parametrize("turn", [np.eye(3), np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]]), np.diag([1, -1, -1])])
@pytest.mark.parametrize(("thing", "handle_below"), [(SWORD, -0.3), (HAMMER, 0.37)])
def test_handles_of_long_things_are_found_however_they_lie(thing: list, handle_below: float, turn: np.ndarray) -> None:
    one = surface(*thing)
    handle = one.point[:, 2] < handle_below
    turned = Surface(one.point @ turn.T.astype(np.float32), one.normal @ turn.T.astype(np.float32), one.footprint,
                     one.convexity, one.occlusion, one.piece, one.label)  # fmt: skip
    assert ((covered(turned, "handle") > 0.5) == handle).mean() > 0.93
    other = covered(turned, "blade" if thing is SWORD else "head", region="above") > 0.5
    assert (other != handle).mean() > 0.93


def test_a_mugs_handle_is_at_its_side() -> None:
    mug = surface(*MUG)
    cover = covered(mug, "on its handle") > 0.5
    ringed = np.hypot(mug.point[:, 0], mug.point[:, 1]) > 0.27
    assert (cover == ringed).mean() > 0.95 and cover.mean() < 0.3


def test_what_the_shape_does_not_show_lies_where_words_put_it() -> None:
    crate = surface(box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)))
    for word in ("legs", "handle", "blade", "spout", "sole"):
        assert found(Mask("below", 0.3, said=word), crate) is None
    assert covered(crate, "handle").mean() == pytest.approx((crate.point[:, 2] < -0.2).mean(), abs=0.02)
    assert found(Mask("below", 0.3, said="handle"), Surface.bare(crate.point[:50], crate.normal[:50], 1e-3)) is None


def test_a_guard_lies_between_blade_and_handle_and_a_pommel_at_its_end() -> None:
    sword = surface(*SWORD)
    z = sword.point[:, 2]
    guard, handle, pommel = (covered(sword, word) > 0.5 for word in ("guard", "handle", "pommel"))
    shown = guard & ~handle  # the handle lies over it
    assert (shown & (z > -0.31) & (z < -0.2)).sum() > 0.8 * shown.sum() > 0
    assert shown[(abs(sword.point[:, 1]) > 0.05)].mean() > 0.5  # the guard itself
    assert pommel.any() and (z[pommel] < -0.42).all() and not (pommel & ~handle).any()


@pytest.mark.parametrize("lies", [False, True])
def test_one_end_is_a_quarter_of_a_long_thing(lies: bool) -> None:
    beam = box((-0.05, -0.05, -0.5), (0.05, 0.05, 0.5))
    beam = (beam[0][:, [2, 1, 0]], beam[1][:, [2, 1, 0]]) if lies else beam
    end = surface(beam)
    along = end.point[:, 0 if lies else 2]
    assert ((covered(end, "end") > 0.5) == (along > 0.25)).mean() > 0.99


def disc(centre: tuple[float, ...], radius: float, thick: float) -> tuple[np.ndarray, np.ndarray]:
    """A wheel that rolls along x: its rim and its two faces."""
    angle, y = RNG.random(1500) * 2 * np.pi, RNG.uniform(-0.5, 0.5, 1500) * thick
    out = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], 1)
    inner = np.sqrt(RNG.random(1500))[:, None] * radius * out
    side = np.where(RNG.random(1500) < 0.5, 1.0, -1.0)[:, None] * np.array([0, 1, 0])
    rim = radius * out + y[:, None] * np.array([0, 1, 0])
    return np.array(centre) + np.concatenate([rim, inner + 0.5 * thick * side]), np.concatenate([out, side])


def test_wheels_are_the_round_pieces_on_the_floor() -> None:
    body = box((-0.5, -0.2, -0.1), (0.5, 0.2, 0.2))
    crate = box((-0.1, -0.05, -0.2), (0.1, 0.05, 0.0))  # stands on the floor, too, as long as it is high
    wheels = [disc((x, y, -0.1), 0.1, 0.06) for x in (-0.3, 0.3) for y in (-0.2, 0.2)]
    car = surface(body, crate, *wheels, apart=True)
    assert ((covered(car, "tyres") > 0.5) == (car.piece > 2)).all()
    assert covered(surface(body, crate, apart=True), "wheels").max() > 0.5  # where words alone put them


BELT = [box((-0.5, -0.02, -0.1), (0.5, 0.02, 0.1)), box((-0.06, -0.05, -0.06), (0.06, -0.02, 0.06))]


@pytest.mark.parametrize(("word", "region"), [("buckle", "spots"), ("brass buckles", "spots"), ("ferrule", "details")])
def test_details_are_small_pieces_where_there_are_any(word: str, region: str) -> None:
    belt = surface(*BELT, apart=True)
    belt = replace(belt, piece=np.where(belt.piece == 2, 0, belt.piece))  # too small to have directions of its own
    assert ((covered(belt, word, region=region) > 0.5) == (belt.piece == 0)).all()


def test_details_lie_on_edges_where_there_are_no_small_pieces_or_nothing_else() -> None:
    for piece in (0, 1):
        belt = surface(*BELT)
        sharp = np.where(abs(belt.point[:, 0]) > 0.45, 0.4, 0).astype("f4")
        belt = replace(belt, piece=belt.piece * 0 + piece, convexity=sharp)
        cover = covered(belt, "ferrule", region="details") > 0.5
        assert 0.05 < cover.mean() < 0.2 and (abs(belt.point[cover, 0]) > 0.44).all()


BACK = [box((-0.32, y, 0.2), (-0.28, y + 0.04, 0.5)) for y in (-0.32, 0.28)] + [box((-0.32, -0.32, 0.42), (-0.28, 0.32, 0.5))]
CHAIR_LEGS = [box((x, y, -0.5), (x + 0.04, y + 0.04, -0.05)) for x in (-0.32, 0.28) for y in (-0.32, 0.28)]
CHAIR = [box((-0.32, -0.32, -0.05), (0.32, 0.32, 0.0)), *CHAIR_LEGS, *BACK]
ARMS = [box((-0.32, y, 0.18), (0.2, y + 0.05, 0.2)) for y in (-0.32, 0.27)]
SLATS = [box((-0.32, -0.32 + 0.08 * k, -0.03), (0.32, -0.26 + 0.08 * k, 0.0)) for k in range(8)]


@pytest.mark.parametrize("word", ["seat", "its seat"])
def test_a_seat_of_its_own_piece_is_that_piece_and_nothing_else(word: str) -> None:
    chair = surface(*CHAIR, *ARMS, apart=True)
    assert ((covered(chair, word, region="up") > 0.5) == (chair.piece == 1)).all()
    slatted = surface(*SLATS, *CHAIR_LEGS, *BACK, *ARMS, apart=True)
    assert ((covered(slatted, word, region="up") > 0.5) == (slatted.piece <= 8)).all()


def test_a_seat_of_a_chair_in_one_piece_is_what_faces_up_at_its_height() -> None:
    chair = surface(*CHAIR, *ARMS)
    faces_up = (chair.normal[:, 2] > 0.9) & (abs(chair.point[:, 2]) < 0.01)
    assert ((covered(chair, "seat", region="up") > 0.5) == faces_up).all() and faces_up.any()


def test_a_tabletop_is_the_top_with_its_edges() -> None:
    table = surface(*TABLE, apart=True)
    assert ((covered(table, "tabletop", region="up") > 0.5) == (table.piece == 5)).all()


def test_what_has_no_level_part_wears_its_seat_where_it_faces_up() -> None:
    ball = RNG.normal(size=(8000, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    round_ = surface((0.5 * ball, ball))
    up = covered(round_, "seat", region="up") > 0.5
    assert up.mean() == pytest.approx(0.3, abs=0.02) and ball[up, 2].min() > ball[~up, 2].max() - 1e-3


@pytest.mark.parametrize("word", ["backrest", "seat back"])
def test_a_backrest_rises_from_the_seat(word: str) -> None:
    panel = box((-0.32, -0.3, 0.05), (-0.28, 0.3, 0.5))
    chair = surface(*CHAIR[:5], *ARMS, panel, apart=True)
    assert ((covered(chair, word, region="above") > 0.5) == (chair.piece == 8)).all()
    whole = surface(*CHAIR[:5], panel)
    assert ((covered(whole, word, region="above") > 0.5) == (whole.point[:, 2] > 0.05)).mean() > 0.99
    stool = surface(*CHAIR[:5], apart=True)
    low = covered(stool, word, region="above") > 0.5
    assert (low == (stool.point[:, 2] > -0.5 + 0.5 * 0.7)).mean() > 0.95  # where words alone put it: the highest 30 %
