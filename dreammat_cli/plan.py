"""dreammat plan"""

import functools
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dreammat_cli.common import INPUT, Common, common_options, examples, show
from dreammat_cli.doctor import free_memory
from dreammat_cli.jobs import folder_of, needs, read, wrong
from dreammat_cli.run import STAGES, split
from stages.core.errors import InputError

if TYPE_CHECKING:
    from stages.batch.costs import Need
    from stages.batch.plan import Plan

MEMORY = 0.8
"""Share of the free memory that jobs may take."""

ROW = "  {:11}{:>7}{:>7}{:>11}{:>11}{:>12}{:>10}{:>11}"
HEADS = ("", "done", "to do", "CPU hours", "GPU hours", "GiB memory", "GiB disk", "files")


@click.command(epilog=examples("dreammat plan jobs.csv", "dreammat plan jobs.csv --from older_jobs"))
@click.argument("jobs", type=INPUT, metavar="JOBS")
@click.option("-o", "--output", type=INPUT, metavar="FOLDER", help="Where the batch is.  [default: JOBS without its ending]")
@click.option("--from", "others", type=INPUT, multiple=True, metavar="FOLDER",
              help="A folder of earlier runs on this machine, whose recorded times count too. Repeat for more.")
@click.option("--with", "further", type=(click.Choice(STAGES), str), multiple=True, metavar="STAGE OPTIONS",
              help="Options of a stage for all jobs, as for dreammat run. Repeat for more.")
@click.option("--at-once", is_flag=True, help="Print only how many jobs this machine can run at once, by its cores and memory.")
@common_options
def command(
    jobs: Path,
    output: Path | None,
    others: tuple[Path, ...],
    further: tuple[tuple[str, str], ...],
    at_once: bool,
    common: Common,
) -> None:
    """Check JOBS, and say what is left to do and what it will cost: time, memory, disk, files.

    JOBS is a .csv or .toml file, or a folder of jobs as for `make batch`. Every mistake in it is named, a line each.
    """
    if common.dry_run:
        show(common, {"would": "plan", "jobs": str(jobs)}, [f"would plan {jobs}"])
        return
    from stages.batch.plan import plan

    for stage, text in further:
        if problem := wrong(stage, split(text)):
            raise click.UsageError(f"--with {stage}: {problem}")
    found, mistakes = read(jobs)
    made = plan(found, functools.partial(needs, further=further), output or folder_of(jobs), others)
    room = fitting(made.total)
    if at_once:
        click.echo(room)
        return
    for line in mistakes:
        click.echo(f"error: {line}", err=True)
    data = {"jobs": len(found), "mistakes": mistakes, **asdict(made), "total": asdict(made.total), "at_once": room}
    show(common, data, [f"{jobs}: {len(found)} jobs", *table(made), *remarks(made, room)])
    if mistakes:
        raise InputError(f"{jobs}: {len(mistakes)} mistakes; mend these lines, they are not counted above")


def fitting(total: "Need") -> int:
    """Jobs that this machine can run at once."""
    from stages.core.parallel import cores

    return max(1, min(cores(), int(MEMORY * free_memory() / max(total.memory, 0.1))))


def table(made: "Plan") -> list[str]:
    """A line a command, and one of sums."""
    rows = [(kind, made.done.get(kind, 0), made.left.get(kind, 0), made.needs.get(kind)) for kind in {**made.done, **made.left}]
    lines = [ROW.format(*HEADS)]
    for kind, done, left, need in [*rows, ("total", sum(made.done.values()), sum(made.left.values()), made.total)]:
        if need is None:
            lines.append(ROW.format(kind, f"{done:,}", left, *[""] * 5).rstrip())
            continue
        hours = (f"{need.cpu / 3600:,.2f}", f"{need.gpu / 3600:,.2f}")
        sizes = (f"{need.memory:.1f}", f"{need.disk:,.2f}", f"{need.files:,}")
        lines.append(ROW.format(kind, f"{done:,}", f"{left:,}", *hours, *sizes))
    return lines


def remarks(made: "Plan", room: int) -> list[str]:
    """How long it takes here, and how well that is known."""
    lines = [f"  here: {room} at once, about {made.total.cpu / 3600 / room:,.1f} hours"]
    if made.records:
        times = ", ".join(f"{stage} {factor:g}" for stage, factor in made.speed.items())
        lines.append(f"  by {made.records} recorded runs: CPU time {times} times what it was where the laws were measured")
    else:
        lines.append("  no run of this machine is recorded yet: times are those of the machine where the laws were measured")
    return lines
