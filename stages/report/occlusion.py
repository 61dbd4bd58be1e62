"""Speed against error of the ambient occlusion that `bake` writes, beside float64 that knows no rays."""

import csv
import math
import time
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.bake.occlusion import both_sides, lookouts_of, occlusion_map
from stages.bake.raster import Surface
from stages.bake.stage import Subject, subjects
from stages.core.artifact import load_npz, written_atomically
from stages.core.progress import Progress, silent
from stages.core.schemas import PREP
from stages.core.texture_sets import texture_sets
from stages.light.openness import reference_openness
from stages.report.options import OcclusionReportOptions

CELLS = 512
"""Across the disc of the reference: its own error is about 0.05 %."""


@dataclass(frozen=True)
class OcclusionRow:
    """One measurement. seconds: of wall time and of all cores together. Errors of texels, in percent of full light."""

    rays: int
    seconds: float
    cpu_seconds: float
    rmse_percent: float
    p99_percent: float
    largest_percent: float


def report_occlusion(
    prep: Path, out: Path, options: OcclusionReportOptions, progress: Progress = silent
) -> list[OcclusionRow]:
    """Measure on a mesh, all of its texture sets; write occlusion.csv and occlusion.png into a folder.

    Raises: ArtifactError.
    """
    mesh = load_npz(prep, PREP)
    sets = [replace(of, size=options.size) for of in texture_sets(mesh.provenance)]
    rays = sorted(options.rays)
    seconds, errors, maps = np.zeros((len(rays), 2)), [[np.zeros(0)] for _ in rays], []
    for subject in subjects(prep, mesh, sets):
        on_chart = subject.touched.triangle >= 0
        wanted = math.ceil(options.texels * subject.set.share)
        chosen = np.random.default_rng(options.seed).permutation(int(on_chart.sum()))[:wanted]
        progress("reference", 0, 1)
        truth = reference_occlusion(subject, subject.touched.where(on_chart)[chosen])
        compile_kernels(subject)
        found = np.ones(on_chart.shape, np.float32)
        for row, count in enumerate(rays):
            before = np.array([time.perf_counter(), time.process_time()])
            found = occlusion_map(subject.scene, subject.touched, mesh["charts"], count, subject.open, progress)
            seconds[row] += [time.perf_counter(), time.process_time()] - before
            errors[row].append(100 * np.abs(found[on_chart][chosen] - truth))
        maps.append(np.where(on_chart, found, np.nan))
    rows = [OcclusionRow(*of) for of in zip(rays, *seconds.T.tolist(), *summed(errors), strict=True)]
    out.mkdir(parents=True, exist_ok=True)
    write_csv(out / "occlusion.csv", rows)
    shown = f"{prep}: {sum(int(np.isfinite(one).sum()) for one in maps)} texels of {options.size}²"
    picture(out / "occlusion.png", rows, np.concatenate(maps, 1), shown)
    return rows


def summed(errors: list[list[NDArray]]) -> tuple[list[float], list[float], list[float]]:
    """Root of the mean square, 99th percentile and largest of each row's errors."""
    each = [np.concatenate(row) for row in errors]
    roots = [float(np.square(row).mean() ** 0.5) for row in each]
    return roots, [float(np.quantile(row, 0.99)) for row in each], [float(row.max()) for row in each]


def reference_occlusion(subject: Subject, surface: Surface) -> NDArray:
    """Occlusion (N,) of surface points in float64."""

    def measure(rows: NDArray, side: float) -> NDArray:
        return reference_openness(subject.scene, lookouts_of(subject.scene, surface[rows], side), CELLS)

    return both_sides(measure, len(surface.triangle), subject.open)


def compile_kernels(subject: Subject) -> None:
    """Run all code once, so that no measurement contains its compilation."""
    small = Surface(subject.touched.triangle[::16, ::16], subject.touched.barycentric[::16, ::16])
    occlusion_map(subject.scene, small, subject.mesh["charts"], 1, subject.open, silent)


def summary(rows: list[OcclusionRow]) -> list[str]:
    """Lines for a reader."""
    return [
        f"{row.rays:6} rays {row.seconds:8.1f} s, {row.cpu_seconds:8.1f} s of cores: RMSE {row.rmse_percent:.2f} %, "
        f"99 % of texels within {row.p99_percent:.2f}, all within {row.largest_percent:.2f}"
        for row in rows
    ]


def write_csv(path: Path, rows: list[OcclusionRow]) -> None:
    """A line for each measurement."""
    with written_atomically(path) as temporary, open(temporary, "w", newline="") as stream:
        table = csv.DictWriter(stream, [field.name for field in fields(OcclusionRow)])
        table.writeheader()
        table.writerows(asdict(row) for row in rows)


def picture(path: Path, rows: list[OcclusionRow], found: NDArray[np.float32], title: str) -> None:
    """Error over seconds on the left, the map of the most rays on the right."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (graph, image) = pyplot.subplots(1, 2, figsize=(11, 5), layout="constrained")
    seconds = [row.cpu_seconds for row in rows]
    for name, label in (("rmse_percent", "RMSE"), ("p99_percent", "99th percentile"), ("largest_percent", "largest")):
        graph.loglog(seconds, [getattr(row, name) for row in rows], "o-", label=label)
    for row in rows:
        graph.annotate(f"{row.rays} rays", (row.cpu_seconds, row.rmse_percent), xytext=(4, 4), textcoords="offset points")
    graph.set(xlabel="seconds of cores, all texels", ylabel="error of a texel, % of full light")
    graph.grid(True, which="both", alpha=0.3)
    graph.legend()
    colours = matplotlib.colormaps["gray"].with_extremes(bad=(0.25, 0.35, 0.5))
    image.imshow(found, cmap=colours, vmin=0, vmax=1, interpolation="antialiased")
    image.set_axis_off()
    figure.suptitle(title, fontsize=10)
    with written_atomically(path) as temporary:
        figure.savefig(temporary, dpi=120)
    pyplot.close(figure)
