"""Light between the sides of an object's cells: radiosity, for whatever material each side has.

Each side knows its direct light under every environment, and where its rays end. One bounce is one
sparse product, of all environments at once: light = direct + what the rays bring, each by its weight.
"""

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stages.core import albedo
from stages.core.frames import tangent_frame
from stages.core.lanes import LANES
from stages.core.parallel import compiled
from stages.light.cells import Cells, probes
from stages.light.ends import DARK, OPEN, STEPS, Ends, from_steps
from stages.light.environment import Environment
from stages.light.gbuffer import GBuffer
from stages.light.leaving import MOST, OwnLight, Sky, make_skies, open_sky, received, reflectance
from stages.light.light_set import MAX_LIGHTS
from stages.light.scene import Scene
from stages.light.terms import Terms, between_cosines
from stages.light.transport import Quality, cached_light_set, trace
from stages.light.transport_kernels import in_lanes, on_square, weigh

RAYS = Quality(64, 24, extra=False, smooth=False)
"""Rays of a side of a cell."""

SIDES = Terms(roughness=(1.0,), shares=(0.94, 0.06), stored=5, mirror=(1, 3), judged=(0,), sharp=())
"""What is summed there: E, the first sum; the others, which the kernels know no way without, are left alone."""


@dataclass(frozen=True)
class Exchange:
    """What the S sides of an object's cells receive under L environments, before any material is known.

    direct: (S, L, 3), direct light, 1 where all around is 1. ends: of all rays of the sides' lobes. weight: (R,) share of each
    in what its side receives from the object. angle: (R,), of `OwnLight.around`. lights: the environments.
    """

    direct: NDArray[np.float32]
    ends: Ends
    weight: NDArray[np.float32]
    angle: NDArray[np.float32]
    lights: tuple[Environment, ...]

    @functools.cached_property
    def skies(self) -> list[Sky]:
        """Each environment, as gloss of the object shows it."""
        return make_skies(self.lights)

    @functools.cached_property
    def sky(self) -> Sky:
        """All of them after each other."""
        return Sky(np.concatenate([sky.texels for sky in self.skies], 1), self.skies[0].first)

    def solved(self, material: NDArray[np.float32], bounces: int) -> OwnLight:
        """What the sides receive with a material each, of paths that meet the object up to `bounces` times before they reach a
        point. Args: material: (S, 5) albedo, roughness, metallic."""
        direct = np.ascontiguousarray(self.direct.reshape(len(self.direct), -1))
        dark = np.zeros_like(direct)
        start, place = in_whole_lanes(self.ends.start)
        assert np.diff(start).max(initial=0) <= MOST
        spread = functools.partial(_spread, place, start[-1])
        rays = start, spread(np.concatenate([from_steps(self.ends.towards), self.angle[None]]))
        shown = open_sky(self.ends, self.angle, self.sky)
        seen = spread(shown.T)
        own = OwnLight(1, np.ascontiguousarray(material, np.float32), direct, dark, dark, *rays, seen)
        reflected = np.tile(reflectance(material), direct.shape[1] // 3)
        for _ in range(bounces - 1):
            more, brought = received(self.ends, self.weight, own, self.sky)
            light, before, sent = direct + more, own.light, reflected * own.before
            seen = spread((shown + brought).T)
            own = OwnLight(own.bounces + 1, own.material, light, before, sent, *rays, seen)
        return own


def in_whole_lanes(start: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Where each side's rays begin if a side has whole vectors of them, and where there each ray is."""
    count = np.diff(start)
    begins = np.concatenate([[0], np.cumsum(-(-count // LANES) * LANES)]).astype(np.int32)
    return begins, np.arange(start[-1]) + (begins[:-1] - start[:-1]).astype(np.int64).repeat(count)


def _spread(place: NDArray[np.int64], count: int, values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Values of rays, one after the other (N, R), at their places among so many, and 0 between."""
    result = np.zeros((len(values), count), np.float32)
    result[:, place] = values
    return result


LEAST = 0.01
"""Share of what its sides see that must be the object itself, on average, for light between surfaces to be worth anything."""


@dataclass(frozen=True)
class Between:
    """What is known of the light between an object's surfaces before any view is traced."""

    cells: Cells
    exchange: Exchange

    @staticmethod
    def of(scene: Scene, environments: list[Environment], seed: int, bounces: int) -> "Between | None":
        """None where the object sees next to nothing of itself."""
        if not scene.horizons.front.any():
            return None
        cells = Cells.of(scene)
        exchange = make_exchange(scene, cells, environments, seed, bounces)
        lit = (exchange.direct.any((1, 2)) | (np.diff(exchange.ends.start) > 0)).sum()
        return Between(cells, exchange) if exchange.weight.sum() > LEAST * lit else None


OPENINGS = 2
"""Rays of a side that must meet nothing for it to lie open: one may have slipped through where the surface meets itself."""


def make_exchange(scene: Scene, cells: Cells, environments: list[Environment], seed: int, bounces: int) -> Exchange:
    """Trace what the sides of the cells receive directly, and where their rays end, for paths of up to so many bounces.

    Sides that no light reaches on the way, as the inner ones of what is closed, are left dark, see `reached`.
    """
    points = cells.sides(scene)
    light = np.zeros((len(points.n), 3 * len(environments)), np.float32)
    place, ends, weights, angles = np.full(len(points.n), -1, np.int64), Ends.none(0), [], []
    opened = open_sides(scene, points)
    new = np.flatnonzero(opened)
    while len(new):
        light[new], found, weight, angle = _traced(scene, points[new], cells, environments, seed)
        place[new] = len(ends.followed) + np.arange(len(new))
        opened[new] |= np.add.reduceat(np.append(found.side == OPEN, 0), found.start[:-1]) >= OPENINGS
        ends = Ends.cat([ends, found])
        weights.append(weight)
        angles.append(angle)
        new = np.flatnonzero(reached(opened, place, ends, bounces) & (place < 0))
    together = Ends.cat([ends, Ends.none(1)])  # the last one stands for all that are not traced
    weight, angle = (np.concatenate([*parts, np.zeros(0, np.float32)])[together.numbers(place)] for parts in (weights, angles))
    return Exchange(light.reshape(len(light), -1, 3), together[place], weight, angle, tuple(environments))


def reached(opened: NDArray[np.bool_], place: NDArray[np.int64], ends: Ends, bounces: int) -> NDArray[np.bool_]:
    """Which of S sides paths of so many bounces may meet that begin in the open and end where a camera looks.

    Both ends lie open; of N sides in between, none is farther than half of N from one of them. Args: opened: (S,) which sides
    lie open. place: (S,) row among `ends` of those that are traced, or -1.
    """
    found = opened
    for _ in range((bounces + 1) // 2):
        rows = place[found & (place >= 0)]
        side = ends.side[ends.numbers(rows)]
        found = found.copy()
        found[side[side < DARK]] = True
    return found


def open_sides(scene: Scene, points: GBuffer) -> NDArray[np.bool_]:
    """Of which sides a few rays, spread by the cosine, meet nothing."""
    found = np.zeros(len(points.n), np.bool_)
    for along in probes(points.n):
        left = np.flatnonzero(~found)
        found[left] = ~scene.occluded(points.surface(left), along[left])
    return found


def _traced(
    scene: Scene, points: GBuffer, cells: Cells, environments: list[Environment], seed: int
) -> tuple[NDArray[np.float32], Ends, NDArray[np.float32], NDArray[np.float32]]:
    """Direct light of some sides (P, 3 L), where their rays end, and the weight and solid angle of each of these."""
    direct, ends = [], Ends.none(0)
    for first in range(0, len(environments), MAX_LIGHTS):
        lights = cached_light_set(tuple(environments[first : first + MAX_LIGHTS]))
        sums = trace(scene, points, lights, RAYS, seed, SIDES, cells=None if first else cells, every=True)
        direct.append(sums.mean[:, 0, : 3 * len(lights.environments)])
        ends = sums.ends or ends
    cosine = (points.n * points.wo).sum(-1).astype(np.float64)
    whole = between_cosines(albedo.diffuse_table()[:, None], cosine)  # what an even light gives
    (weight, angle), counts = np.zeros((2, len(ends.side)), np.float32), SIDES.counts(RAYS.lobe)
    alphas = SIDES.alphas(np.arange(len(points.n)))
    _shares(points.n, *tangent_frame(points.n), points.wo, ends.start, ends.towards, alphas, counts, weight, angle)
    rows = np.repeat(np.arange(len(points.n)), np.diff(ends.start))
    weight /= np.bincount(rows, weight, len(points.n))[rows]
    weight[ends.side >= DARK] = 0
    return np.concatenate(direct, 1) / whole, ends, weight, angle


@compiled
def _shares(n, t, b, wo, start, towards, alphas, counts, weight, angle):  # type: ignore[no-untyped-def]
    """What each ray weighs in its point's E, and the solid angle that it stands for."""
    f32 = np.float32
    most = 1
    for p in range(len(n)):
        most = max(most, start[p + 1] - start[p])
    most = in_lanes(most)
    dx, dy, dz, scratch = np.empty(most, f32), np.empty(most, f32), np.empty(most, f32), np.empty((6, LANES), f32)
    density, inverse, weights = np.empty(most, f32), np.empty(most, f32), np.empty(3 * most, f32)
    for p in range(len(n)):
        count = start[p + 1] - start[p]
        for i in range(count):
            ray = start[p] + i
            dx[i], dy[i], dz[i] = on_square(towards[ray, 0] * f32(1 / STEPS), towards[ray, 1] * f32(1 / STEPS))
        filled = in_lanes(count)
        dx[count:filled], dy[count:filled], dz[count:filled] = n[p, 0], n[p, 1], n[p, 2]
        w = weights[: 3 * filled].reshape((3, filled))
        weigh(n, t, b, wo, p, (dx, dy, dz), filled, alphas, counts, (False, 0.0, 0.0), scratch, density, inverse, w)
        for i in range(count):
            weight[start[p] + i], angle[start[p] + i] = w[0, i], inverse[i]
