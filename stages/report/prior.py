"""How well the embedded prior answers prompts: a fixed evaluation of what `distill` makes of them.

Every prompt is distilled on one of several meshes, for several seeds, and held against what the words mean, over the texels
of a 512² bake that a view saw (`ground.py`). A second set of runs, the ladder, takes conditions away from the model, as the
paper's ablation does; there nothing but the model holds the field (`--anchor 0`).
Runs are kept: the same call continues where it was stopped. Written: prior.csv, a line for each run; summary.csv, a line
for each measure with its 95 % interval and target; prior.png, a picture of each result under its prompt.
"""

import dataclasses
import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from stages.conditions.options import ConditionsOptions
from stages.conditions.stage import conditions
from stages.core.artifact import load_npz
from stages.core.color import DARKEST, log_correlation, reinhard, srgb_decode, srgb_encode
from stages.core.progress import Progress, silent
from stages.core.schemas import PREP
from stages.core.shading import Material, shade
from stages.distill.options import GIVEN, DistillOptions, HoldOptions, ScoreOptions
from stages.distill.stage import distill
from stages.prep.options import PrepOptions
from stages.prep.stage import prep
from stages.report import measures, plots
from stages.report.contrast import WAVES
from stages.report.ground import Ground
from stages.report.kept import contrast_kept
from stages.report.options import PriorReportOptions
from stages.report.prompts import IDENTIFIED, LADDER, PROMPTS, Prompt
from stages.report.rows import write_csv
from stages.report.shapes import SHAPES

TEXTURE = 512
PREVIEW = 128
"""Pixels of a view's picture in the preview of `distill`."""

ALONE_STEPS, ALONE_RATE = 250, 0.01
"""Of the ladder's runs, in which the model is to show what it would do by itself."""

REGION = 0.25
"""The upper and the lower region of a composition leave out this share of the height on either side of the middle."""

TALL = 0.5
"""Compositions are judged on meshes at least this high, in object sizes."""

CAVITIES = 0.1
"""Standard deviation of the log of how much of the sky is seen, from which on a shape has cavities."""


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

    decided: share of texels that are metal or not. light_correlation: of log albedo and log irradiance.
    cavity_correlation: of log albedo and the log of how much of an even sky is seen; nan of a shape without cavities.
    shared_pattern: of log albedo with the first seed's, texel by texel. identified: nearest to its own truth of
    `prompts.IDENTIFIED`. regions: share of a composition's two regions nearer to their own material. contrast_kept: percent
    of the recipe's, at wavelengths of 2 … 64 pixels, of the ladder's runs; nan where it has none. relight_percent:
    tone-mapped RMSE against the ideal material, under lights never trained on.
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
    cavity_correlation: float
    relight_percent: float
    shared_pattern: str
    identified: str
    regions: str
    contrast_kept: str


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
    heights = prepared(out / "meshes", options, progress)
    grounds = {name: Ground.of(folder / "prep.npz", folder / "conditions", TEXTURE) for name, folder in folders(out, heights)}
    rows = []
    runs = list(plan(options, heights))
    for i, run in enumerate(runs):
        progress(f"prior: {run.prompt.text}", i, len(runs))
        ground = grounds[run.mesh]
        made = carry_out(run, out, options)
        twin = ground.material(carry_out(dataclasses.replace(run, seed=0), out, options)) if run.seed else None
        row = measure(run, ground, ground.material(made), twin)
        if run.alone:
            words = carry_out(Run(run.prompt, run.mesh, run.seed), out, options)
            row = dataclasses.replace(row, contrast_kept=kept(ground, made, words))
        rows.append(row)
        write_csv(out / "prior.csv", rows)
    progress("prior", len(runs), len(runs))
    summary = [line for line in summarise(rows) if line.runs]
    write_csv(out / "summary.csv", summary)
    shown = [run for run in runs if run.seed == 0 and not run.alone]
    plots.contact_sheet(
        out / "prior.png",
        [(run.prompt.text, out / "runs" / run.name / "material.preview.png") for run in shown],
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
        asked = ConditionsOptions(views=options.views, quality="draft", bounces=options.bounces)
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
            if prompt in LADDER:
                yield from (Run(prompt, mesh, 0, given, alone=True) for given in GIVEN)
                yield Run(prompt, mesh, 0, lights="one", alone=True)


def folders(out: Path, meshes: Iterable[str]) -> Iterable[tuple[str, Path]]:
    """Each mesh with its folder."""
    return ((name, out / "meshes" / name) for name in meshes)


def carry_out(run: Run, out: Path, options: PriorReportOptions) -> Path:
    """Distill a run, unless that is there. Returns: material.npz."""
    made = out / "runs" / run.name / "material.npz"
    made.parent.mkdir(parents=True, exist_ok=True)
    chosen = ScoreOptions(given=run.given, lights=run.lights)
    asked = DistillOptions(prompt=run.prompt.text, seed=run.seed, steps=options.steps, score=chosen)
    if run.alone:
        steps = options.steps or ALONE_STEPS
        asked = dataclasses.replace(asked, hold=HoldOptions(anchor=0.0), steps=steps, learning_rate=ALONE_RATE)
    distill(out / "meshes" / run.mesh / "conditions", made, asked)
    return made


def measure(run: Run, ground: Ground, maps: NDArray[np.float32], twin: NDArray[np.float32] | None) -> Row:
    """Everything of one run. Args: maps: (T, 5) of the ground's texels; twin: the same of the first seed."""
    wanted = run.prompt.meaning.row()
    colors = srgb_encode(maps[:, :3])
    found = np.r_[colors.mean(0), maps[:, 3:].mean(0)]
    if run.prompt.top is not None:  # on the whole it is half of each
        wanted = (wanted + run.prompt.top.row()) / 2
    correlation = cavities = relit = float("nan")
    if run.prompt.top is None:
        correlation = log_correlation(maps[ground.lit, :3], ground.irradiance)
        if np.log(ground.openness[:, 0] + DARKEST).std() > CAVITIES:
            cavities = log_correlation(maps[ground.lit, :3], ground.openness)
        relit = relight(ground, maps[ground.lit], wanted)
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
        cavity_correlation=cavities,
        relight_percent=relit,
        shared_pattern="" if twin is None else f"{log_correlation(maps[:, :3], twin[:, :3]):.3f}",
        identified=str(own) if run.prompt in IDENTIFIED else "",
        regions="" if run.prompt.top is None else f"{regions_right(run.prompt, ground.point[:, 2], maps):.2f}",
        contrast_kept="",
    )


def kept(ground: Ground, made: Path, words: Path) -> str:
    """`contrast_kept` of a material, beside the recipe of one that was held near to it, percent."""
    found, recipe = ground.pictures(made), ground.pictures(words)
    return " ".join(f"{100 * share:.1f}" for share in contrast_kept(found.found, recipe.recipe, found.masks))


def regions_right(prompt: Prompt, z: NDArray, maps: NDArray) -> float:
    """Share of the two regions, top and base, whose mean is nearer to its own material than to the other's.

    Args:
        z: (T,) height of the texels. maps: (T, 5) linear.
    """
    assert prompt.top is not None
    truths = np.stack([prompt.meaning.row(), prompt.top.row()])
    middle, height = (z.max() + z.min()) / 2, np.ptp(z)
    values = np.c_[srgb_encode(maps[:, :3]), maps[:, 3:]]
    right = 0
    for own, inside in enumerate((z < middle - REGION * height / 2, z > middle + REGION * height / 2)):
        right += bool(inside.any()) and measures.nearest(values[inside].mean(0), truths) == own
    return right / 2


def relight(ground: Ground, maps: NDArray[np.float32], wanted: NDArray) -> float:
    """Tone-mapped RMSE, percent, of the lit texels' pictures against those of the ideal, even material."""
    found = torch.from_numpy(maps)
    ideal = torch.tensor([*srgb_decode(wanted[:3]).tolist(), *wanted[3:].tolist()]).float().expand(len(maps), 5)
    squares = []
    for transport in ground.new_lights:
        a, b = (reinhard(shade(transport, Material.of(values))) for values in (found, ideal))
        squares.append(float((a - b).square().mean()))
    return float(np.sqrt(np.mean(squares))) * 100


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
    yield line("regions right, %", "two materials", [100 * float(r.regions) for r in full if r.regions], ">= 92")
    yield line("identified, %", "ten prompts", [100.0 * (r.identified == "True") for r in full if r.identified], ">= 85")
    yield line("relight RMSE, %", "one material", [r.relight_percent for r in one], "")
    for label, given, lights in (("a none", "none", "all"), ("b geometry", "geometry", "all"), ("c light", "light", "all"),
                                 ("d full, one light", "full", "one"), ("e full", "full", "all")):  # fmt: skip
        of = [abs(r.light_correlation) for r in rows if r.alone and (r.given, r.lights) == (given, lights)]
        yield line("baked light, |correlation|", label, of, "")
    alone = [r for r in rows if r.alone and (r.given, r.lights) == ("full", "all")]
    yield line("metal or not, %", "e full", [100.0 * r.metal_right for r in alone], ">= 95")
    yield line("CIEDE2000, median", "e full", [r.color_difference for r in alone], "<= 8", median=True)
    for k, wave in enumerate(WAVES):
        shares = [float(r.contrast_kept.split()[k]) for r in alone]
        yield line("contrast kept, %", f"e full, {wave} pixels", [x for x in shares if not np.isnan(x)], ">= 50")
    yield line("baked light, |correlation|", "one material", [abs(r.light_correlation) for r in one], "<= 0.06")
    hollow = [abs(r.cavity_correlation) for r in one if not np.isnan(r.cavity_correlation)]
    yield line("baked light in cavities, |correlation|", "one material", hollow, "<= 0.08")
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
