"""How well the embedded prior answers prompts: a fixed evaluation through all four stages.

Every prompt is distilled on one of several meshes, for several seeds, baked at 512², and held against what the words mean,
over the texels that a view saw. A second set of runs, the ladder, takes conditions away from the model, as the paper's
ablation does; there nothing but the model holds the field (`--anchor 0`).
Runs are kept: the same call continues where it was stopped. Written: prior.csv, a line for each run; summary.csv, a line
for each measure with its 95 % interval and target; prior.png, a picture of each result under its prompt.
"""

import dataclasses
import functools
import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from stages.bake.options import BakeOptions
from stages.bake.stage import bake
from stages.conditions.options import ConditionsOptions
from stages.conditions.stage import conditions, read_lights
from stages.core.artifact import load_npz
from stages.core.color import log_correlation, reinhard, srgb_decode, srgb_encode
from stages.core.progress import Progress, silent
from stages.core.schemas import PREP
from stages.core.shading import Material, Transport, shade
from stages.distill.options import GIVEN, DistillOptions
from stages.distill.stage import distill
from stages.light.environment import Environment
from stages.light.gbuffer import GBuffer
from stages.light.lights import preview_light
from stages.light.transport import Quality, light_transport
from stages.prep.options import PrepOptions
from stages.prep.stage import prep
from stages.report import measures, plots
from stages.report.baked import Baked, read_baked
from stages.report.conditions import write_csv
from stages.report.options import PriorReportOptions
from stages.report.prompts import IDENTIFIED, PROMPTS, Prompt
from stages.report.shapes import SHAPES

TEXTURE = 512
PREVIEW = 192

POINTS = 3000
"""Seen texels at which light is traced."""

RAYS = Quality(96, 32, extra=False, smooth=False)
"""Points are loose: neighbours in memory are none on the surface."""

LIFT = 1e-4
"""Distance from the surface at which rays start, object sizes."""

REGION = 0.25
"""The upper and the lower region of a composition leave out this share of the height on either side of the middle."""

TALL = 0.5
"""Compositions are judged on meshes at least this high, in object sizes."""

TURNS = (0.0, 0.33, 0.67)
"""Turns of the relighting environment, shares of a circle: three lights that were never trained on."""


@dataclass(frozen=True)
class Run:
    """One distillation. lights: "all" or "one". alone: nothing holds the field near what the words call for."""

    prompt: Prompt
    mesh: str
    seed: int
    given: str = "full"
    lights: str = "all"
    alone: bool = False

    @property
    def name(self) -> str:
        """A folder's name."""
        words = self.prompt.text.replace(" ", "_")
        return f"{words}-{self.mesh}-{self.seed}" + ("" if self.given == "full" else f"-{self.given}") + (
            "" if self.lights == "all" else "-one") + ("-alone" if self.alone else "")  # fmt: skip


@dataclass(frozen=True)
class Row:
    """What a run gave. Colours are sRGB; what does not apply to a run is empty.

    decided: share of texels that are metal or not. light_correlation: of log albedo and log irradiance. shared_pattern: of log
    albedo with the first seed's, texel by texel. identified: nearest to its own truth of `prompts.IDENTIFIED`. regions: share
    of a composition's two regions nearer to their own material. relight_percent: tone-mapped RMSE against the ideal
    material, under lights never trained on.
    """

    prompt: str
    mesh: str
    seed: int
    given: str
    lights: str
    alone: bool
    unseen: bool
    red: float
    green: float
    blue: float
    roughness: float
    metallic: float
    metal_right: bool
    decided: float
    roughness_error: float
    color_difference: float
    light_correlation: float
    relight_percent: float
    shared_pattern: str
    identified: str
    regions: str


@dataclass(frozen=True)
class Summary:
    """One line of the table: a measure, its group of runs, how many, the value with its interval, and what is asked."""

    measure: str
    group: str
    runs: int
    value: float
    low: float
    high: float
    target: str
    met: str


def report_prior(out: Path, options: PriorReportOptions, progress: Progress = silent) -> list[Summary]:
    """Run what is missing, measure, and write the report's files into a folder.

    Raises: InputError, ArtifactError, OutputError, NumericalError.
    """
    meshes = prepared(out / "meshes", options, progress)
    rows = []
    runs = list(plan(options, meshes))
    lights = list(read_lights(())[0])
    for i, run in enumerate(runs):
        progress(f"prior: {run.prompt.text}", i, len(runs))
        twin = carry_out(dataclasses.replace(run, seed=0), out, options) if run.seed else None
        rows.append(measure(run, carry_out(run, out, options), lights, twin))
        write_csv(out / "prior.csv", rows)
    progress("prior", len(runs), len(runs))
    summary = [line for line in summarise(rows) if line.runs]
    write_csv(out / "summary.csv", summary)
    shown = [run for run in runs if run.seed == 0 and not run.alone]
    plots.contact_sheet(
        out / "prior.png",
        [(run.prompt.text, out / "runs" / run.name / "asset" / "preview.png") for run in shown],
        PREVIEW,
    )
    return summary


def prepared(folder: Path, options: PriorReportOptions, progress: Progress) -> dict[str, float]:
    """Prepare the meshes and make their conditions. Returns: the height of each, by name."""
    folder.mkdir(parents=True, exist_ok=True)
    if options.mesh:
        files = {Path(mesh).stem: Path(mesh) for mesh in options.mesh}
    else:
        files = {name: folder / f"{name}.obj" for name in SHAPES}
        for name, make in SHAPES.items():
            make().export(files[name])
    heights = {}
    for name, path in files.items():
        ready, up = folder / name / "prep.npz", "y" if options.mesh else "z"
        ready.parent.mkdir(exist_ok=True)
        prep(path, ready, PrepOptions(up=up, texture_size=TEXTURE, padding=4))
        asked = ConditionsOptions(views=options.views, quality="draft")
        conditions(ready, folder / name / "conditions", asked, progress=progress)
        heights[name] = float(np.ptp(load_npz(ready, PREP)["vertices"][:, 2]))
    return heights


def plan(options: PriorReportOptions, meshes: dict[str, float]) -> Iterable[Run]:
    """All runs: prompts in turn over the meshes, then the ladder of conditions for the prompts to identify."""
    chosen = PROMPTS if options.prompts == 0 else PROMPTS[:: max(1, len(PROMPTS) // options.prompts)]
    every, tall = itertools.cycle(meshes), itertools.cycle([m for m, height in meshes.items() if height >= TALL] or meshes)
    placed = [(prompt, next(tall if prompt.top else every)) for prompt in chosen]
    for seed in range(options.seeds):
        yield from (Run(prompt, mesh, seed) for prompt, mesh in placed)
    if options.ladder:
        for prompt, mesh in placed:
            if prompt in IDENTIFIED:
                yield from (Run(prompt, mesh, 0, given, alone=True) for given in GIVEN)
                yield Run(prompt, mesh, 0, lights="one", alone=True)


def carry_out(run: Run, out: Path, options: PriorReportOptions) -> Baked:
    """Distill and bake a run, unless that is there, and read its seen texels."""
    folder, source = out / "runs" / run.name, out / "meshes" / run.mesh
    folder.mkdir(parents=True, exist_ok=True)
    asked = DistillOptions(prompt=run.prompt.text, seed=run.seed, steps=options.steps, given=run.given, lights=run.lights)
    if run.alone:
        asked = dataclasses.replace(asked, anchor=0.0)
    distill(source / "conditions", folder / "material.npz", asked)
    bake(source / "prep.npz", folder / "material.npz", folder / "asset", BakeOptions(TEXTURE, 1, PREVIEW, occlusion_rays=1))
    return read_baked(source / "prep.npz", folder / "material.npz", folder / "asset")


def measure(run: Run, baked: Baked, lights: list[Environment], twin: Baked | None) -> Row:
    """Everything of one run. twin: the same of the first seed."""
    wanted, maps = run.prompt.meaning.row(), baked.maps
    colors = srgb_encode(maps[:, :3])
    found = np.r_[colors.mean(0), maps[:, 3:].mean(0)]
    if run.prompt.top is not None:  # on the whole it is half of each
        wanted = (wanted + run.prompt.top.row()) / 2
    correlation, relit = float("nan"), float("nan")
    if run.prompt.top is None:
        rows = np.sort(np.random.default_rng(0).choice(len(maps), min(POINTS, len(maps)), replace=False))
        points = loose_points(baked, rows)
        irradiance = sum(t.E for t in light_transport(baked.scene, points, lights, RAYS, 0))
        correlation = log_correlation(maps[rows, :3], irradiance.numpy())  # type: ignore[union-attr]
        relit = relight(baked, points, maps[rows], wanted)
    truths = np.stack([p.meaning.row() for p in IDENTIFIED])
    own = run.prompt in IDENTIFIED and IDENTIFIED[measures.nearest(found, truths)] == run.prompt
    red, green, blue, roughness, metallic = found.tolist()
    return Row(
        prompt=run.prompt.text,
        mesh=run.mesh,
        seed=run.seed,
        given=run.given,
        lights=run.lights,
        alone=run.alone,
        unseen=run.prompt.unseen,
        red=red,
        green=green,
        blue=blue,
        roughness=roughness,
        metallic=metallic,
        metal_right=bool((found[4] > 0.5) == (wanted[4] > 0.5)),
        decided=measures.decided(maps[:, 4]),
        roughness_error=abs(float(found[3] - wanted[3])),
        color_difference=measures.color_difference(found[:3], wanted[:3]),
        light_correlation=correlation,
        relight_percent=relit,
        shared_pattern="" if twin is None else f"{log_correlation(maps[:, :3], twin.maps[:, :3]):.3f}",
        identified=str(own) if run.prompt in IDENTIFIED else "",
        regions="" if run.prompt.top is None else f"{regions_right(run.prompt, baked, colors):.2f}",
    )


def regions_right(prompt: Prompt, baked: Baked, colors: NDArray) -> float:
    """Share of the two regions, top and base, whose mean is nearer to its own material than to the other's."""
    assert prompt.top is not None
    truths = np.stack([prompt.meaning.row(), prompt.top.row()])
    z = baked.point[:, 2]
    middle, height = (z.max() + z.min()) / 2, np.ptp(z)
    values = np.c_[colors, baked.maps[:, 3:]]
    right = 0
    for own, inside in enumerate((z < middle - REGION * height / 2, z > middle + REGION * height / 2)):
        right += bool(inside.any()) and measures.nearest(values[inside].mean(0), truths) == own
    return right / 2


def loose_points(baked: Baked, rows: NDArray[np.int64]) -> GBuffer:
    """Texels as points that are looked at from straight above."""
    triangle, weights, scene = baked.triangle[rows], baked.barycentric[rows], baked.scene
    ng = scene.geometric_normal(triangle).astype(np.float32)
    n = scene.shading_normal(triangle, weights).astype(np.float32)
    point = baked.point[rows].astype(np.float32)
    mask, depth = np.ones((1, len(rows)), bool), np.ones((1, len(rows)), np.float32)
    return GBuffer(mask, depth, point, point + LIFT * ng, n, ng, n, triangle, weights)


def relight(baked: Baked, points: GBuffer, maps: NDArray[np.float32], wanted: NDArray) -> float:
    """Tone-mapped RMSE, percent, of the points' pictures against those of the ideal, even material."""
    found = torch.from_numpy(maps)
    ideal = torch.tensor([*srgb_decode(wanted[:3]).tolist(), *wanted[3:].tolist()]).float().expand(len(maps), 5)
    squares = []
    for transport in light_transport(baked.scene, points, new_lights(), RAYS, 0):
        a, b = (reinhard(shade(_float(transport), Material.of(values))) for values in (found, ideal))
        squares.append(float((a - b).square().mean()))
    return float(np.sqrt(np.mean(squares))) * 100


@functools.cache
def new_lights() -> list[Environment]:
    """Environments that nothing was trained on."""
    light = preview_light()
    width = light.radiance.shape[1]
    return [Environment(f"{light.name}_{i}", np.roll(light.radiance, int(t * width), 1)) for i, t in enumerate(TURNS)]


def _float(transport: Transport) -> Transport:
    return transport.to(torch.float32)


def summarise(rows: list[Row]) -> Iterable[Summary]:
    """The table."""
    full = [row for row in rows if not row.alone]
    one = [row for row in full if not row.regions]
    taught, unseen = ([row for row in one if row.unseen == kind] for kind in (False, True))

    def line(measure: str, group: str, values: list[float], target: str, median: bool = False) -> Summary:
        value, low, high = measures.interval(values, np.median if median else np.mean)
        met = ""
        if target and len(values):
            bound = float(target.split()[1])
            met = str(value >= bound if target.startswith(">=") else value <= bound)
        return Summary(measure, group, len(values), value, low, high, target, met)

    yield line("metal or not, %", "one material", [100.0 * r.metal_right for r in one], ">= 97")
    yield line("metal or not, %", "unseen words", [100.0 * r.metal_right for r in unseen], ">= 90")
    yield line("texels decided, %", "one material", [100 * r.decided for r in one], ">= 90")
    yield line("roughness error", "one material", [r.roughness_error for r in one], "<= 0.12")
    yield line("CIEDE2000, median", "taught words", [r.color_difference for r in taught], "<= 8", median=True)
    yield line("CIEDE2000, median", "unseen words", [r.color_difference for r in unseen], "<= 14", median=True)
    yield line("regions right, %", "two materials", [100 * float(r.regions) for r in full if r.regions], ">= 85")
    yield line("identified, %", "ten prompts", [100.0 * (r.identified == "True") for r in full if r.identified], ">= 85")
    yield line("relight RMSE, %", "one material", [r.relight_percent for r in one], "")
    for label, given, lights in (("a none", "none", "all"), ("b geometry", "geometry", "all"), ("c light", "light", "all"),
                                 ("d full, one light", "full", "one"), ("e full", "full", "all")):  # fmt: skip
        of = [abs(r.light_correlation) for r in rows if r.alone and (r.given, r.lights) == (given, lights)]
        yield line("baked light, |correlation|", label, of, "")
    yield line("baked light, |correlation|", "one material", [abs(r.light_correlation) for r in one], "<= 0.10")
    yield line("two seeds, distance of means", "all", distances(full), "")
    shared = [abs(float(r.shared_pattern)) for r in one if r.shared_pattern]
    yield line("two seeds, |correlation| of patterns", "one material", shared, "")


def distances(rows: list[Row]) -> list[float]:
    """How far apart the mean materials of two seeds of a prompt are: Euclidean, sRGB albedo, roughness, metallic."""
    means: dict[tuple[str, str], list[NDArray]] = {}
    for row in rows:
        mean = np.array([row.red, row.green, row.blue, row.roughness, row.metallic])
        means.setdefault((row.prompt, row.mesh), []).append(mean)
    return [float(np.linalg.norm(m[0] - m[1])) for m in means.values() if len(m) > 1]
