"""dreammat report"""

import dataclasses
from pathlib import Path
from typing import Any

import click

from dreammat_cli.common import INPUT, Common, common_options, defaults, plan, reporter, show
from stages.report.options import ReportOptions

DEFAULT = defaults(ReportOptions)


@click.group()
def command() -> None:
    """Measure speed against error."""


@command.command()
@click.argument("prep", type=INPUT, metavar="PREP.npz")
@click.option("-o", "--output", type=INPUT, required=True, metavar="FOLDER", help="Where to write the CSV and the plot.")
@click.option("--size", type=click.IntRange(16, 2048), default=DEFAULT["size"], show_default=True, metavar="PIXELS",
              help="Side of the view that is measured.")
@click.option("--env", multiple=True, metavar="NAME|FILE", help="As for `conditions`.")
@click.option("--seed", type=click.IntRange(0, 2**31 - 2), default=DEFAULT["seed"], show_default=True,
              help="Of camera and rays.")
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
