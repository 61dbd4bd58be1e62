"""Error against seconds of light between surfaces, as `stages.report.conditions` has it for direct light.

What is compared is the radiance of six materials of the whole object, direct light alone and with bounces, with the converged
result of both: far more rays of the pixels, the same cells. What cells and their one point each leave out it shares; so it is
itself held against float64 recursion at a few pixels, of one bounce, under a coarse light. `stages.report.bounces` lays all of
it beside a path tracer.
"""

import functools
import time
from typing import TYPE_CHECKING

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.core.color import reinhard
from stages.core.shading import Material, Transport, shade
from stages.light.ends import Ends
from stages.light.environment import Environment
from stages.light.exchange import Between
from stages.light.gbuffer import GBuffer
from stages.light.light_set import LightSet
from stages.light.lights import studio
from stages.light.own_light import with_own_light
from stages.light.reconstruction import Neighbours
from stages.light.reference import halved, reference_radiance
from stages.light.scene import Scene
from stages.light.terms import BOUNCED
from stages.light.transport import QUALITY, Quality, cached_light_set, integrate_with_ends
from stages.report.bounces import MATERIALS, material
from stages.report.rows import Row

if TYPE_CHECKING:
    from stages.report.conditions import Subject

SWEEP = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Rays, as a multiple of the standard quality's."""

PIXELS = 1000
"""Object pixels at which errors are taken."""

CONVERGED = Quality(2432, 1152, extra=False, smooth=False)

SEEDS = (7_001, 7_002)

COARSE_ROWS, QUADRATURE_PIXELS = 16, 8
"""Rows of the light, and pixels, of the float64 recursion."""

LEAST_ROUGHNESS = 0.45
"""Of a material whose lobe that light resolves."""


def bounce_rows(subject: "Subject", bounces: int, seed: int) -> list[Row]:
    """Rows of the table, none where the object sees next to nothing of itself. Their `map` is the material."""
    between = Between.of(subject.scene, list(subject.lights.environments), seed, bounces)
    if between is None:
        return []
    count = min(PIXELS, len(subject.points.n))
    pixels = np.sort(np.random.default_rng(seed).choice(len(subject.points.n), count, replace=False))
    view = _View(subject.scene, subject.points, subject.lights, pixels, between, bounces)
    truth, floor = view.truth()
    rows: list[Row] = []
    for factor in SWEEP:
        quality = QUALITY["standard"].scaled(factor)
        names = [name for name, named in QUALITY.items() if named == quality]
        setting = names[0] if names else f"{factor:g} x standard"
        for label, found, seconds in view.timed(quality, seed):
            rows += view.compared((f"{setting}, {label}", quality, seconds), found, truth, floor)
    return rows + against_quadrature(subject.scene, subject.points[pixels], seed)


class _View:
    """A view, and the light between the surfaces that it shows in each of MATERIALS."""

    def __init__(
        self, scene: Scene, points: GBuffer, lights: LightSet, pixels: NDArray[np.int64], between: Between, bounces: int
    ) -> None:
        self._scene, self._points, self._lights, self._pixels = scene, points, lights, pixels
        self._some, self._between, self._bounces = points[pixels], between, bounces
        sides = between.cells.sides(scene)
        self._own = {
            name: between.exchange.solved(material(sides, pair), bounces).by_light() for name, pair in MATERIALS.items()
        }

    def truth(self) -> tuple[dict[str, list[Tensor]], dict[str, list[float]]]:
        """Tone-mapped radiance of each material under each light, and how far it may be off, percent, from two seeds."""
        traced = (self._scene, self._some, self._lights, CONVERGED)
        pair = [self._full(*integrate_with_ends(*traced, seed, self._between.cells), CONVERGED, self._some) for seed in SEEDS]
        mean = {n: [(a + b) / 2 for a, b in zip(pair[0][n], pair[1][n], strict=True)] for n in MATERIALS}
        off = {n: [_percent(a - b) / 2 for a, b in zip(pair[0][n], pair[1][n], strict=True)] for n in MATERIALS}
        return mean, off

    def timed(self, quality: Quality, seed: int) -> list[tuple[str, dict[str, list[Tensor]], float]]:
        """Of a quality: direct light alone and all of it, each with its seconds, of the view and all environments."""
        job = self._scene, self._points, self._lights, quality, seed
        start = time.perf_counter()
        integrate_with_ends(*job)
        alone = time.perf_counter() - start
        start = time.perf_counter()
        transports, ends = integrate_with_ends(*job, self._between.cells)
        traced = time.perf_counter() - start
        start = time.perf_counter()
        lit = self._full(transports, ends, quality, self._points)
        added = (time.perf_counter() - start) / len(MATERIALS)
        some = torch.from_numpy(self._pixels)
        direct = [t[some] for t in transports]  # the same, whether it is asked where rays end
        full = {name: [values[some] for values in of_all] for name, of_all in lit.items()}
        plain = {name: [reinhard(shade(t, self._values(name, self._some))) for t in direct] for name in MATERIALS}
        return [("no bounces", plain, alone), (f"{self._bounces} bounces", full, traced + added)]

    def compared(
        self,
        what: tuple[str, Quality, float],
        found: dict[str, list[Tensor]],
        truth: dict[str, list[Tensor]],
        floor: dict[str, list[float]],
    ) -> list[Row]:
        """Rows of one setting. Args: what: its name, quality and seconds."""
        setting, quality, seconds = what
        rows = []
        for name in MATERIALS:
            for e, light in enumerate(self._lights.environments):
                off = found[name][e] - truth[name][e]
                p999 = 100 * float(np.quantile(off.abs().numpy(), 0.999))
                errors = (_percent(off), p999, floor[name][e])
                rows.append(Row(setting, quality.lobe, quality.light, light.name, name, seconds, *errors))
        return rows

    def _full(
        self, transports: list[Transport], ends: Ends | None, quality: Quality, points: GBuffer
    ) -> dict[str, list[Tensor]]:
        """Tone-mapped radiance of some points, of each material under each light; its noise is averaged if it is a view."""
        assert ends is not None
        counts, exchange = BOUNCED.counts(quality.lobe), self._between.exchange
        near = Neighbours.of(points) if quality.smooth else None
        result: dict[str, list[Tensor]] = {}
        for name, own in self._own.items():
            lit = (
                with_own_light(t, points.n, points.wo, ends, light, sky, counts, near)
                for t, light, sky in zip(transports, own, exchange.skies, strict=True)
            )
            values = self._values(name, points)
            result[name] = [reinhard(shade(t, values)) for t in lit]
        return result

    def _values(self, name: str, points: GBuffer) -> Material:
        return Material.of(torch.from_numpy(material(points, MATERIALS[name])))


def against_quadrature(scene: Scene, points: GBuffer, seed: int) -> list[Row]:
    """The converged result of one bounce against float64 recursion, in each material that its coarse grid resolves."""
    light = coarse(studio())
    some = points[np.linspace(0, len(points.n) - 1, QUADRATURE_PIXELS).astype(np.int64)]
    between, lights = Between.of(scene, [light], seed, 1), cached_light_set((light,))
    if between is None:
        return []
    sides = between.cells.sides(scene)
    (direct,), ends = integrate_with_ends(scene, some, lights, CONVERGED, seed, between.cells)
    counts, rows = BOUNCED.counts(CONVERGED.lobe), []
    assert ends is not None
    for name, pair in MATERIALS.items():
        if min(values[3] for values in pair) < LEAST_ROUGHNESS:
            continue
        exact = reference_radiance(scene, some, light, 1, functools.partial(material, pair=pair), 1)
        own = between.exchange.solved(material(sides, pair), 1)
        lit = with_own_light(direct, some.n, some.wo, ends, own, between.exchange.sky, counts)
        found = shade(lit, Material.of(torch.from_numpy(material(some, pair))))
        off = reinhard(found) - reinhard(torch.from_numpy(exact))
        errors = (_percent(off), 100 * float(off.abs().max()), 0.0)
        rows.append(Row("converged, one bounce, against quadrature", 0, 0, light.name, name, 0.0, *errors))
    return rows


def coarse(light: Environment) -> Environment:
    """The mean over texels of COARSE_ROWS rows."""
    while len(light.radiance) > COARSE_ROWS:
        light = halved(light)
    return light


def _percent(x: Tensor) -> float:
    return 100 * float(x.double().square().mean().sqrt())
