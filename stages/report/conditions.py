"""Speed against error of the light transport: one view, every quality, against a converged result of its own."""

import csv
import dataclasses
import io
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from stages.conditions.cameras import place_cameras
from stages.conditions.options import ConditionsOptions
from stages.conditions.stage import read_lights
from stages.core.artifact import load_npz, write_text, written_atomically
from stages.core.color import reinhard
from stages.core.progress import Progress, silent
from stages.core.schemas import PREP
from stages.core.shading import LIGHT_MAPS, light_maps
from stages.light.gbuffer import trace_view
from stages.light.scene import Scene
from stages.light.transport import QUALITY, Quality, cached_light_set, integrate
from stages.report.options import ReportOptions

CONVERGED = Quality(3072, 512)
"""Rays a point of the result that errors are measured against; its own error is under a tenth of the best setting's."""


@dataclass(frozen=True)
class Row:
    """One measurement. Errors: of the six light maps, tone-mapped by x / (1 + x), over the object, in percent."""

    quality: str
    lobe_rays: int
    light_rays: int
    environment: str
    seconds: float
    rmse_percent: float
    p999_percent: float
    worst_map: str


def report_conditions(prep: Path, out: Path, options: ReportOptions, progress: Progress = silent) -> list[Row]:
    """Measure every quality on one view of a mesh; write conditions.csv and conditions.png into a folder.

    Raises: ArtifactError, InputError, OutputError.
    """
    mesh = load_npz(prep, PREP)
    lights, _, _ = read_lights(options.env)
    scene = Scene(mesh["vertices"], mesh["triangles"], mesh["normals"])
    camera = place_cameras(mesh["vertices"].astype(np.float64), ConditionsOptions(views=1, seed=options.seed))
    points = trace_view(scene, camera.c2w[0], float(camera.fov_y[0]), options.size, options.size)
    light_set = cached_light_set(tuple(lights))
    integrate(scene, points, light_set, Quality(8, 1), 0)  # compiles
    rows = []
    progress("converged result", 0, len(QUALITY))
    converged = [reinhard(light_maps(t)) for t in integrate(scene, points, light_set, CONVERGED, options.seed + 1)]
    for i, (name, quality) in enumerate(QUALITY.items()):
        progress("qualities", i, len(QUALITY))
        start = time.perf_counter()
        transports = integrate(scene, points, light_set, quality, options.seed)
        seconds = time.perf_counter() - start
        for light, transport, exact in zip(lights, transports, converged, strict=True):
            error = (reinhard(light_maps(transport)) - exact).abs()  # (P, 6, 3)
            by_map = error.square().mean((0, 2)).sqrt()
            m, r = LIGHT_MAPS[int(by_map.argmax())]
            rmse = float(error.square().mean().sqrt()) * 100
            p999 = float(np.quantile(error.numpy(), 0.999)) * 100
            rows.append(Row(name, quality.lobe, quality.light, light.name, seconds, rmse, p999, f"m{m}_r{r:g}"))
    progress("qualities", len(QUALITY), len(QUALITY))
    write_csv(out / "conditions.csv", rows)
    plot(out / "conditions.png", rows, f"{prep.parent.name}/{prep.name}, {int(torch.tensor(points.mask).sum())} pixels")
    return rows


def write_csv(path: Path, rows: list[Row]) -> None:
    """One line a measurement."""
    stream = io.StringIO()
    writer = csv.DictWriter(stream, [f.name for f in dataclasses.fields(Row)], lineterminator="\n")
    writer.writeheader()
    writer.writerows(dataclasses.asdict(row) for row in rows)
    write_text(path, stream.getvalue())


def plot(path: Path, rows: list[Row], title: str) -> None:
    """Error over seconds, a line for each environment."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6, 4), layout="constrained")
    for environment in dict.fromkeys(row.environment for row in rows):
        own = [row for row in rows if row.environment == environment]
        axes.loglog([row.seconds for row in own], [row.rmse_percent for row in own], "o-", label=environment)
    for row in rows[:: len({row.environment for row in rows})]:
        axes.annotate(row.quality, (row.seconds, 0.03), xycoords=("data", "axes fraction"), ha="center", fontsize=8)
    axes.set(xlabel="seconds a view, all environments", ylabel="tone-mapped RMSE of the six maps, %", title=title)
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(fontsize=8)
    with written_atomically(path) as temporary:
        figure.savefig(temporary, dpi=120)
    pyplot.close(figure)
