"""dreammat report"""

import dataclasses
from pathlib import Path
from typing import Any

import click

from dreammat_cli.common import INPUT, Common, Guessing, common_options, defaults, examples, plan, reporter, show
from stages.bake.options import SIZES
from stages.report.options import (
    DistillReportOptions,
    OcclusionReportOptions,
    PreviewReportOptions,
    PriorReportOptions,
    ReportOptions,
    TransferReportOptions,
    TransfersReportOptions,
    UnwrapReportOptions,
)

DEFAULT, PRIOR, DISTILL = defaults(ReportOptions), defaults(PriorReportOptions), defaults(DistillReportOptions)
OCCLUSION, UNWRAP = defaults(OcclusionReportOptions), defaults(UnwrapReportOptions)
TRANSFERS = defaults(TransfersReportOptions)


@click.group(cls=Guessing)
def command() -> None:
    """Measure speed against error."""


@command.command(epilog=examples("dreammat report conditions demo/prep.npz -o bench"))
@click.argument("prep", type=INPUT, metavar="PREP.npz")
@click.option("-o", "--output", type=INPUT, required=True, metavar="FOLDER", help="Where to write the CSV and the plot.")
@click.option("--size", type=click.IntRange(16, 2048), default=DEFAULT["size"], show_default=True, metavar="PIXELS",
              help="Side of the view that is measured.")
@click.option("--env", multiple=True, metavar="NAME|FILE", help="As for `conditions`.")
@click.option("--seed", type=click.IntRange(0, 2**31 - 2), default=DEFAULT["seed"], show_default=True,
              help="Of camera and rays.")
@click.option("--bounces", type=click.IntRange(0, 8), default=DEFAULT["bounces"], show_default=True,
              help="Of light between surfaces, measured beside direct light alone; 0 for none.")
@click.option("--mitsuba", default=DEFAULT["mitsuba"], metavar="PYTHON",
              help="A Python that has the package mitsuba, for a side-by-side with it.")
@click.option("--cycles", default=DEFAULT["cycles"], metavar="PYTHON",
              help="A Python that has the package bpy (Blender), for a side-by-side with Cycles.")
@common_options
def conditions(prep: Path, output: Path, common: Common, **chosen: Any) -> None:
    """Light transport of one view of PREP.npz: seconds and error of every setting, and the cost of a step."""
    options = ReportOptions(**chosen)
    if plan(common, "measure into", output, options):
        return
    from stages.report.conditions import report_conditions, summary

    with reporter(common) as progress:
        rows = report_conditions(prep, output, options, progress)
    show(common, {"rows": [dataclasses.asdict(row) for row in rows]}, summary(rows))


@command.command(
    epilog=examples(
        "dreammat report prior -o prior --seeds 2",
        "dreammat report prior chair.obj -o prior --prompts 12 --no-ladder",
    )
)
@click.argument("mesh", nargs=-1, metavar="[MESH]...")
@click.option("-o", "--output", type=INPUT, required=True, metavar="FOLDER", help="Where to write runs, CSV and pictures.")
@click.option("--seeds", type=click.IntRange(1, 100), default=PRIOR["seeds"], show_default=True, help="Runs of every prompt.")
@click.option("--prompts", type=click.IntRange(0), default=PRIOR["prompts"], metavar="N",
              help="About this many of the prompts, evenly spread.  [default: all]")
@click.option("--steps", type=click.IntRange(1), default=PRIOR["steps"], metavar="N",
              help="Of every distillation.  [default: as `distill`]")
@click.option("--views", type=click.IntRange(1, 9999), default=PRIOR["views"], show_default=True, help="Cameras of a mesh.")
@click.option("--bounces", type=click.IntRange(0, 8), default=PRIOR["bounces"], show_default=True,
              help="As for `conditions`.")
@click.option("--ladder/--no-ladder", default=PRIOR["ladder"], show_default=True,
              help="Also let the model alone hold the material, and take conditions away from it, as the paper does.")
@common_options
def prior(mesh: tuple[str, ...], output: Path, common: Common, **chosen: Any) -> None:
    """Judge the embedded prior by a fixed list of prompts on MESH files, or on six shapes of its own.

    A run of all prompts takes hours; stopped, the same command continues.
    """
    options = PriorReportOptions(mesh=mesh, **chosen)
    if plan(common, "measure into", output, options):
        return
    from stages.report.prior import report_prior

    with reporter(common) as progress:
        lines = report_prior(output, options, progress)
    table = [f"{s.measure:30} {s.group:18} {s.value:8.3f} [{s.low:.3f}, {s.high:.3f}]  {s.target} {s.met}" for s in lines]
    show(common, {"summary": [dataclasses.asdict(line) for line in lines]}, table)


@command.command(epilog=examples("dreammat report distill chair/conditions -o cost --device cuda"))
@click.argument("conditions", type=INPUT, metavar="CONDITIONS")
@click.option("-o", "--output", type=INPUT, required=True, metavar="FOLDER", help="Where to write the CSV.")
@click.option("--sd-model", default=DISTILL["sd_model"], metavar="PATH|ID", help="As for `distill`.  [default: random weights]")
@click.option("--controlnet", default=DISTILL["controlnet"], metavar="PATH|ID", help="As for `distill`.")
@click.option("--vram", type=click.IntRange(8), default=DISTILL["vram"], metavar="GIB", help="As for `distill`.")
@click.option("--batch", type=click.IntRange(1), default=DISTILL["batch"], show_default=True, help="Views a step.")
@click.option("--warm-up", type=click.IntRange(0), default=DISTILL["warm_up"], show_default=True, metavar="N",
              help="Steps before those that are measured.")
@click.option("--steps", type=click.IntRange(1), default=DISTILL["steps"], show_default=True, metavar="N",
              help="Steps that are measured part by part, and as many again as a whole.")
@click.option("--device", default=DISTILL["device"], show_default=True, help="A torch device: cpu, cuda.")
@common_options
def distill(conditions: Path, output: Path, common: Common, **chosen: Any) -> None:
    """What a step with Stable Diffusion costs on views of CONDITIONS, part by part: FLOPs, bytes, time, share of the peak."""
    options = DistillReportOptions(**chosen)
    if plan(common, "measure into", output, options):
        return
    from stages.report.distill import report_distill, summary

    with reporter(common) as progress:
        report = report_distill(conditions, output, options, progress)
    show(common, dataclasses.asdict(report), summary(report))


@command.command(
    epilog=examples(
        "dreammat report transfer models -o transfers",
        "dreammat report transfer chair/prep.npz chair/material.npz chair/asset --reference textured.glb",
    )
)
@click.argument("paths", type=INPUT, nargs=-1, required=True, metavar="FOLDER|PREP.npz MATERIAL.npz ASSET")
@click.option("-o", "--output", type=INPUT, metavar="FOLDER", help="Of a folder of models: where all is written.")
@click.option("--views", type=click.IntRange(1, 9999), default=TRANSFERS["views"], show_default=True, help="Of each model.")
@click.option("--size", type=click.IntRange(16, 4096), default=TRANSFERS["size"], show_default=True, metavar="PIXELS",
              help="Side of a view.")
@click.option("--steps", type=click.IntRange(1), default=TRANSFERS["steps"], metavar="N",
              help="Of every distillation.  [default: as `distill`]")
@click.option("--texture", type=click.Choice(SIZES), default=TRANSFERS["texture"], show_default=True,
              metavar="TEXELS", help="Side of the baked textures.")
@click.option("--reference", type=INPUT, metavar="MODEL.glb", help="Of an asset: the textured model of the same shape.")
@common_options
def transfer(
    paths: tuple[Path, ...], output: Path | None, common: Common, reference: Path | None, **chosen: Any
) -> None:
    """How exactly `distill --guidance reference` and `bake` bring the material of textured models over.

    For each .glb or .gltf in FOLDER all four stages are run, into the folder of -o: a table, and a picture of the truth beside
    what was found. Stopped, the same command continues. Or for one asset that was made so, of the model of --reference.
    """
    if len(paths) == 1 and output and not reference:
        options = TransfersReportOptions(**chosen)
        if plan(common, "measure into", output, options):
            return
        from stages.report.transfers import report_transfers, summary

        with reporter(common) as progress:
            rows = report_transfers(paths[0], output, options, progress)
        show(common, {"rows": [dataclasses.asdict(row) for row in rows]}, summary(rows))
        return
    if len(paths) != 3 or output or not reference:
        raise click.UsageError("expected FOLDER with --output, or PREP.npz MATERIAL.npz ASSET with --reference")
    prep, material, asset = paths
    if plan(common, "measure", asset, TransferReportOptions(reference)):
        return
    from stages.report.transfer import report_transfer

    found = dataclasses.asdict(report_transfer(prep, material, asset, reference))
    show(common, found, [f"{name.replace('_', ' '):18} {value:.4g}" for name, value in found.items()])


@command.command(epilog=examples("dreammat report occlusion chair/prep.npz -o occlusion --rays 64 --rays 256"))
@click.argument("prep", type=INPUT, metavar="PREP.npz")
@click.option("-o", "--output", type=INPUT, required=True, metavar="FOLDER", help="Where to write the CSV and the picture.")
@click.option("--size", type=click.IntRange(64, 8192), default=OCCLUSION["size"], show_default=True, metavar="TEXELS",
              help="Side of the texture.")
@click.option("--texels", type=click.IntRange(1), default=OCCLUSION["texels"], show_default=True, metavar="N",
              help="Texels that are compared with float64.")
@click.option("--rays", type=click.IntRange(1, 1 << 16), multiple=True, default=OCCLUSION["rays"], show_default=True,
              metavar="N", help="Rays of each point; repeat for more measurements.")
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=OCCLUSION["seed"], show_default=True, help="Of the texels.")
@common_options
def occlusion(prep: Path, output: Path, common: Common, **chosen: Any) -> None:
    """Ambient occlusion of PREP.npz as `bake` makes it: seconds, and errors beside float64 without rays."""
    options = OcclusionReportOptions(**chosen)
    if plan(common, "measure into", output, options):
        return
    from stages.report.occlusion import report_occlusion, summary

    with reporter(common) as progress:
        rows = report_occlusion(prep, output, options, progress)
    show(common, {"rows": [dataclasses.asdict(row) for row in rows]}, [str(output / "occlusion.png"), *summary(rows)])


@command.command(epilog=examples("dreammat report unwrap chair/prep.npz"))
@click.argument("prep", type=INPUT, metavar="PREP.npz")
@click.option("--gutter", type=click.IntRange(0, 512), default=UNWRAP["gutter"], show_default=True, metavar="TEXELS",
              help="Between xatlas's charts, where PREP.npz kept the source's UVs.")
@click.option("--seconds", type=click.FloatRange(1), default=UNWRAP["seconds"], show_default=True,
              help="That xatlas may take.")
@common_options
def unwrap(prep: Path, common: Common, **chosen: Any) -> None:
    """Texture layout of PREP.npz beside what xatlas alone makes: charts, stretch, density."""
    options = UnwrapReportOptions(**chosen)
    if plan(common, "measure", prep, options):
        return
    from stages.report.unwrap import report_unwrap, summary

    rows = report_unwrap(prep, options)
    show(common, {"rows": [dataclasses.asdict(row) for row in rows]}, summary(rows))


@command.command(epilog=examples("dreammat report materials -o materials"))
@click.option("-o", "--output", type=INPUT, required=True, metavar="FOLDER", help="Where to write sheets and CSV.")
@click.option("--references", type=INPUT, metavar="FOLDER", help="Real sets, NAME_01/basecolor.png each, to measure beside.")
@common_options
def materials(output: Path, references: Path | None, common: Common) -> None:
    """Every substance as a swatch: contact sheets, and its contrast scale by scale."""
    from stages.report.materials import report_materials, summary

    with reporter(common) as progress:
        rows = report_materials(output, references, progress)
    show(common, {"rows": [{"name": row.name, "slope": row.contrast.slope, "own": row.own} for row in rows]}, summary(rows))


@command.command(epilog=examples("dreammat report preview chair/asset -o beside --three node_modules"))
@click.argument("assets", type=INPUT, nargs=-1, required=True, metavar="ASSET...")
@click.option("-o", "--output", type=INPUT, required=True, metavar="FOLDER", help="Where to write the CSV and the pictures.")
@click.option("--cycles", default="", metavar="PYTHON", help="A Python that has the package bpy (Blender).")
@click.option("--three", default="", metavar="FOLDER", help="A folder node_modules that has three; needs Chromium.")
@common_options
def preview(assets: tuple[Path, ...], output: Path, common: Common, **chosen: Any) -> None:
    """Render the model of each folder ASSET in other programs, as preview.json says, and compare with preview.png."""
    options = PreviewReportOptions(**chosen)
    if plan(common, "compare into", output, options):
        return
    from stages.report.preview import report_preview

    rows = report_preview(assets, output, options)
    show(common, {"rows": [dataclasses.asdict(row) for row in rows]},
         [f"{row.asset:12} {row.renderer:7} view {row.view}  {row.psnr:.2f} dB" for row in rows])
