"""Speed against error of the light transport, and of a distillation step made from it.

One view, in which the object fills about 42 % of the pixels, is traced at every setting. Errors are those of the six
light maps, tone-mapped by x / (1 + x), at random object pixels, against a converged result: far more rays, no smoothing,
other seeds. That result itself is held against float64 quadrature at a few pixels. Written: conditions.csv, a line for
each setting, environment and map, then those of `stages.report.bounce_rows`, whose map is a material; steps.csv; conditions.png
and bounces.png; and renderers.csv where Mitsuba or Cycles is at hand.
"""

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.asset.traced import traced_scene
from stages.conditions.cameras import place_cameras
from stages.conditions.options import ConditionsOptions
from stages.conditions.stage import read_lights
from stages.core.artifact import Artifact, load_npz
from stages.core.color import reinhard
from stages.core.progress import Progress, silent
from stages.core.schemas import PREP
from stages.core.shading import F0, KNOTS, LIGHT_MAPS, Transport, interpolate, light_maps
from stages.core.views import rounded
from stages.light.environment import Environment
from stages.light.gbuffer import GBuffer, trace_view
from stages.light.light_set import LightSet
from stages.light.reference import reference_transport
from stages.light.scene import Scene
from stages.light.transport import QUALITY, Quality, cached_light_set, integrate
from stages.report import bounce_rows, plots, renderers, steps
from stages.report.options import ReportOptions
from stages.report.rows import Row, write_csv

COVERAGE = 0.42
"""Share of the view's pixels that the object fills."""

SWEEP = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 32.0, 128.0)
"""Rays, as a multiple of the standard quality's."""

WINDOWED = 8.0
"""From this multiple on, only a window of the view is traced and its seconds are scaled to the view."""

WINDOW = 0.05
"""Share of the object's pixels in that window."""

SAMPLE = 8000
"""Object pixels at which errors are taken."""

CONVERGED = Quality(6144, 3072, extra=False, smooth=False)
SEEDS = (7_001, 7_002)

QUADRATURE_PIXELS, QUADRATURE_ROWS = 8, 1024
"""Pixels and rows of directions of the float64 quadrature."""


@dataclass(frozen=True)
class Subject:
    """What is measured: a view, its lights, the pixels at which errors are taken and the maps that are true there."""

    scene: Scene
    c2w: NDArray[np.float64]
    fov_y: float
    points: GBuffer
    lights: LightSet
    pixels: NDArray[np.int64]
    converged: list[Transport]
    truth: list[Tensor]
    floor: NDArray[np.float64]


def report_conditions(prep: Path, out: Path, options: ReportOptions, progress: Progress = silent) -> list[Row]:
    """Measure one view of a mesh and write the report's files into a folder.

    Raises: ArtifactError, InputError, OutputError.
    """
    mesh = load_npz(prep, PREP)
    progress("converged result", 0, 1)
    subject = make_subject(mesh, list(read_lights(options.env)[0]), options)
    rows = []
    for i, factor in enumerate(SWEEP):
        progress("settings", i, len(SWEEP) + 4)
        rows += measure_quality(subject, factor, options.seed)
    rows += ablations(subject, options.seed, lambda i: progress("settings", len(SWEEP) + i, len(SWEEP) + 4))
    progress("settings", len(SWEEP) + 4, len(SWEEP) + 4)
    title = f"{Path(prep).stem}, {options.size}², {len(subject.points.n)} pixels"
    if options.bounces:
        progress("light between surfaces", 0, 1)
        between = bounce_rows.bounce_rows(subject, options.bounces, options.seed)
        if between:
            plots.bounces(out / "bounces.png", between, title)
        rows += between
        progress("light between surfaces", 1, 1)
    write_csv(out / "conditions.csv", rows)
    progress("steps", 0, 1)
    write_csv(out / "steps.csv", steps.measure(subject.scene, subject.points, subject.lights, options.seed))
    progress("steps", 1, 1)
    plots.frontier(out / "conditions.png", rows, title)
    others = [(name, python) for name, python in (("mitsuba", options.mitsuba), ("cycles", options.cycles)) if python]
    if others:
        progress("other renderers", 0, 1)
        job = renderers.Job(subject.scene, subject.c2w, subject.fov_y, options.size, subject.lights.environments)
        ours = {r.environment: (r.seconds, r.rmse_percent) for r in rows if (r.setting, r.map) == ("standard", renderers.MAP)}
        made = [r for name, python in others for r in renderers.measure(name, python, job, subject.points.mask, ours)]
        write_csv(out / "renderers.csv", made)
        progress("other renderers", 1, 1)
    return rows


def make_subject(mesh: Artifact, lights: list[Environment], options: ReportOptions) -> Subject:
    """The view and its converged result."""
    scene = traced_scene(mesh)
    camera = place_cameras(mesh["vertices"].astype(np.float64), ConditionsOptions(views=1, seed=options.seed))
    c2w, fov_y = camera.c2w[0], covering(scene, camera.c2w[0], float(camera.fov_y[0]))
    points = trace_view(scene, c2w, fov_y, options.size, options.size)
    light_set = cached_light_set(tuple(lights))
    integrate(scene, points[np.arange(min(64, len(points.n)))], light_set, Quality(8, 2), 0)  # compiles
    count = min(SAMPLE, len(points.n))
    pixels = np.sort(np.random.default_rng(options.seed).choice(len(points.n), count, replace=False))
    some = points[pixels]
    pair = [integrate(scene, some, light_set, CONVERGED, seed) for seed in SEEDS]
    maps = [[reinhard(light_maps(t)) for t in one] for one in pair]
    floor = np.array([rms(a - b) / 2 for a, b in zip(*maps, strict=True)]) * 100  # of their mean
    converged = [mean_of(a, b) for a, b in zip(*pair, strict=True)]
    truth = [reinhard(light_maps(t)) for t in converged]
    return Subject(scene, c2w, fov_y, points, light_set, pixels, converged, truth, floor)


def covering(scene: Scene, c2w: NDArray, fov_y: float) -> float:
    """The field of view, radians, in which the object fills about COVERAGE of the picture; near it if it cannot."""
    for _ in range(8):
        share = float(trace_view(scene, c2w, fov_y, 96, 96).mask.mean())
        fov_y *= (max(share, 0.01) / COVERAGE) ** 0.4
    return fov_y


def measure_quality(subject: Subject, factor: float, seed: int) -> list[Row]:
    """The standard quality with `factor` times its rays."""
    quality = QUALITY["standard"].scaled(factor)
    names = [name for name, named in QUALITY.items() if named == quality]
    setting = names[0] if names else f"{factor:g} x standard"
    rows = window(subject) if factor >= WINDOWED else np.arange(len(subject.points.n))
    start = time.perf_counter()
    found = integrate(subject.scene, subject.points[rows], subject.lights, quality, seed)
    seconds = (time.perf_counter() - start) * len(subject.points.n) / len(rows)
    inside = np.isin(subject.pixels, rows)
    place = torch.from_numpy(np.searchsorted(rows, subject.pixels[inside]))
    maps = [light_maps(t[place]) for t in found]
    return compare(subject, setting, quality, maps, seconds, torch.from_numpy(inside))


def window(subject: Subject) -> NDArray[np.int64]:
    """Rows of the points in a square around the middle of the object's pixels."""
    y, x = np.nonzero(subject.points.mask)
    distance = np.maximum(np.abs(y - np.median(y)), np.abs(x - np.median(x)))
    return np.flatnonzero(distance <= np.quantile(distance, WINDOW))


def ablations(subject: Subject, seed: int, step: Callable[[int], None]) -> list[Row]:
    """The standard quality without one of its parts, or stored in another form."""
    standard = QUALITY["standard"]
    rows = []
    step(0)
    for name, quality in (
        ("no smoothing", dataclasses.replace(standard, smooth=False)),
        ("no further rays where it is noisy", dataclasses.replace(standard, extra=False)),
    ):
        start = time.perf_counter()
        found = integrate(subject.scene, subject.points, subject.lights, quality, seed)
        maps = [light_maps(t[torch.from_numpy(subject.pixels)]) for t in found]
        rows += compare(subject, name, quality, maps, time.perf_counter() - start, slice(None))
        step(1 + len(rows) // (6 * len(subject.truth)))
    stored = [light_maps(Transport.unpack(rounded(t.packed(), plain=1).float())) for t in subject.converged]
    rows += compare(subject, "as stored", Quality(0, 0), stored, 0.0, slice(None))
    return rows + knots_left_out(subject) + quadrature(subject)


def knots_left_out(subject: Subject) -> list[Row]:
    """The converged result at every second knot, interpolated from the others: spacing twice as wide as it is."""
    rows = []
    for e, (light, t) in enumerate(zip(subject.lights.environments, subject.converged, strict=True)):
        for k in range(1, len(KNOTS), 2):
            A, B = interpolate(t, torch.full_like(t.cosine, KNOTS[k]), range(0, len(KNOTS), 2))
            pairs = ((t.E + F0 * A + B, t.E + F0 * t.A[:, k] + t.B[:, k]), (A + B, t.A[:, k] + t.B[:, k]))
            for m, (found, exact) in enumerate(pairs):
                error = (reinhard(found) - reinhard(exact)).abs()
                name, p999 = f"m{m}_r{KNOTS[k]:g}", float(np.quantile(error.numpy(), 0.999)) * 100
                percent = rms(error) * 100
                rows.append(Row("every second knot left out", 0, 0, light.name, name, 0.0, percent, p999, subject.floor[e]))
    return rows


def compare(
    subject: Subject, setting: str, quality: Quality, maps: list[Tensor], seconds: float, inside: Any
) -> list[Row]:
    """Rows of one setting. Args: maps: (P', 6, 3) of each environment; inside: which of the sampled pixels P' are."""
    rows = []
    for e, environment in enumerate(subject.lights.environments):
        error = (reinhard(maps[e]) - subject.truth[e][inside]).abs()
        for k, (m, r) in enumerate(LIGHT_MAPS):
            rmse, p999 = rms(error[:, k]) * 100, float(np.quantile(error[:, k].numpy(), 0.999)) * 100
            counts = (quality.lobe, quality.light)
            rows.append(Row(setting, *counts, environment.name, f"m{m}_r{r:g}", seconds, rmse, p999, subject.floor[e]))
    return rows


def quadrature(subject: Subject) -> list[Row]:
    """The converged result itself against float64 quadrature at a few pixels; roughness 0.5 and 1, what its grid resolves."""
    some = np.linspace(0, len(subject.pixels) - 1, QUADRATURE_PIXELS).astype(np.int64)
    kept = [k for k, (_, r) in enumerate(LIGHT_MAPS) if r > 0]
    rows = []
    for e, light in enumerate(subject.lights.environments):
        cells = -(-QUADRATURE_ROWS // len(light.radiance))
        exact = reference_transport(subject.scene, subject.points, light, cells, subject.pixels[some])
        error = (subject.truth[e][some] - reinhard(light_maps(exact)))[:, kept].abs()
        percent, largest = rms(error) * 100, float(error.max()) * 100
        rows.append(Row("converged, against quadrature", 0, 0, light.name, "rough", 0.0, percent, largest, subject.floor[e]))
    return rows


def summary(rows: list[Row]) -> list[str]:
    """Lines to read: per setting and environment, the worst map."""
    lines = [f"{'setting':34}{'environment':24}{'seconds':>9}{'RMSE %':>9}{'99.9th %':>10}  worst map"]
    for key in dict.fromkeys((row.setting, row.environment) for row in rows):
        own = [row for row in rows if (row.setting, row.environment) == key]
        worst, p999 = max(own, key=lambda row: row.rmse_percent), max(row.p999_percent for row in own)
        lines.append(f"{key[0]:34}{key[1]:24}{worst.seconds:9.2f}{worst.rmse_percent:9.2f}{p999:10.2f}  {worst.map}")
    return lines


def mean_of(a: Transport, b: Transport) -> Transport:
    return Transport((a.E + b.E) / 2, (a.A + b.A) / 2, (a.B + b.B) / 2, a.cosine)


def rms(x: Tensor) -> float:
    return float(x.double().square().mean().sqrt())
