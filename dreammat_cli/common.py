"""What every command shares: its common options, progress on the terminal, and how a result is shown.

Messages and progress go to stderr, results to stdout. On a terminal progress is a bar with rate and time left;
elsewhere it is a plain line now and then. NO_COLOR is honoured.
"""

import dataclasses
import itertools
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar
from rich.text import Text

from dreammat_cli.whole import Whole, told
from stages.core.naming import guess
from stages.core.progress import Progress, silent

LINE_EVERY = 15.0
"""Seconds between progress lines where stderr is not a terminal."""

INPUT = click.Path(path_type=Path)
"""A path to read; whether it can be read is the stage's to say, in its own words."""


class Guessing(click.Group):
    """A group that says which command was probably meant by one that is not there."""

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        known = self.list_commands(context)
        if name not in known and not context.resilient_parsing:
            raise click.UsageError(f"No such command {name!r}; {guess(name, known)}expected {', '.join(known)}", context)
        return self.commands.get(name)


class Shard(click.ParamType):
    """i/n, the i-th of n parts."""

    name = "shard"

    def convert(self, value: Any, param: click.Parameter | None, context: click.Context | None) -> tuple[int, int]:
        if isinstance(value, tuple):
            return value
        part, _, parts = value.partition("/")
        if not (part.isdecimal() and parts.isdecimal() and 1 <= int(part) <= int(parts)):
            self.fail(f"{value}: expected i/n with 1 <= i <= n, such as 2/8", param, context)
        return int(part), int(parts)


library_option = click.option(
    "--library", type=INPUT, metavar="FOLDER", envvar="DREAMMAT_LIBRARY",
    help="Scanned PBR sets (Poly Haven, ambientCG); what words name of them is used.  [env: DREAMMAT_LIBRARY]",
)  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Common:
    """The options that every command has."""

    force: bool
    quiet: bool
    verbose: bool
    as_json: bool
    dry_run: bool

    def flags(self) -> list[str]:
        """The same options, for another command."""
        return [f"--{name.removeprefix('as_').replace('_', '-')}" for name, on in dataclasses.asdict(self).items() if on]


def common_options(function: Callable) -> Callable:
    """Add --force, --quiet, --verbose, --json and --dry-run, and pass them on as one `Common`."""

    def call(force: bool, quiet: bool, verbose: bool, as_json: bool, dry_run: bool, **rest: Any) -> Any:
        return function(common=Common(force, quiet, verbose, as_json, dry_run), **rest)

    call.__doc__, call.__name__ = function.__doc__, function.__name__
    call.__click_params__ = list(getattr(function, "__click_params__", []))  # type: ignore[attr-defined]
    for option in reversed(
        [
            click.option("-f", "--force", is_flag=True, help="Redo the work even if the output is up to date."),
            click.option("-q", "--quiet", is_flag=True, help="Only errors."),
            click.option("-v", "--verbose", is_flag=True, help="More of what is found and done, and the seconds of each part."),
            click.option("--json", "as_json", is_flag=True, help="Print the result as JSON on stdout."),
            click.option("--dry-run", is_flag=True, help="Say what would be done, and stop."),
        ]
    ):
        call = option(call)
    return call


def examples(*lines: str) -> str:
    """What --help ends with: calls as they are typed, each on a line of its own."""
    return "\n".join(["\b", "Examples:", *(f"  {line}" for line in lines)])


def defaults(options: type) -> dict[str, Any]:
    """The defaults of an options dataclass, so that the command line has none of its own."""
    return {field.name: field.default for field in dataclasses.fields(options)}


def plan(common: Common, verb: str, output: Path, options: Any) -> bool:
    """For --dry-run: print the plan. Returns: whether to stop here."""
    if common.dry_run:
        chosen = dataclasses.asdict(options)
        show(common, {"would": verb, "output": str(output), **chosen}, [f"would {verb} {output}", *lines_of(chosen)])
    return common.dry_run


def lines_of(values: dict[str, Any]) -> list[str]:
    """One aligned line for each entry."""
    width = max(map(len, values), default=0)
    return [f"  {key.replace('_', ' '):{width}}  {value}" for key, value in values.items()]


def show(common: Common, data: dict[str, Any], lines: list[str]) -> None:
    """Print a result: JSON on stdout with --json, lines on stdout otherwise, nothing with --quiet."""
    if common.as_json:
        click.echo(json.dumps(data, default=str))
    elif not common.quiet:
        for line in lines:
            click.echo(line)


class Rate(ProgressColumn):
    """Units a second, or seconds a unit when slow."""

    def render(self, task: Task) -> Text:
        if task.fields.get("seconds"):
            return Text("")
        speed = task.finished_speed or task.speed
        if not speed:
            return Text("")
        return Text(f"{speed:.1f}/s" if speed >= 1 else f"{1 / speed:.1f} s each", style="dim")


class Count(MofNCompleteColumn):
    """Units done of all, where they are not seconds."""

    def render(self, task: Task) -> Text:
        return Text("") if task.fields.get("seconds") else super().render(task)


class Left(TimeRemainingColumn):
    """Time left: by the pace of the units, or what a run of stages makes of it."""

    def render(self, task: Task) -> Text:
        if task.fields.get("seconds"):
            return Text(told(task.remaining or 0.0), style="progress.remaining")
        return super().render(task)


class reporter:
    """Context manager that gives a stage its `Progress`: a bar on a terminal, lines elsewhere, nothing when quiet."""

    def __init__(self, common: Common) -> None:
        self.common = common
        self.bar: Bar | None = None
        self.tasks: dict[str, Any] = {}
        self.started: dict[str, tuple[float, int]] = {}
        self.told = time.monotonic()
        self.parts: list[tuple[str, float]] = []
        """What was begun, and when."""
        context = click.get_current_context(silent=True)
        self.whole: Whole | None = context.obj if context else None
        """The run that this stage is a part of, if it is."""

    def __enter__(self) -> Progress:
        if self.common.quiet:
            return silent
        shown = self.begin_showing()
        return self.timed(shown) if self.common.verbose else shown

    def begin_showing(self) -> Progress:
        """What shows progress where stderr goes to."""
        if not sys.stderr.isatty():
            return self.line
        columns = (TextColumn("{task.description}"), BarColumn(), Count(), Rate(), Left())
        self.bar = Bar(*columns, console=Console(stderr=True), transient=True)
        self.bar.start()
        if self.whole:
            self.tasks["all"] = self.bar.add_task("all of it", seconds=True)
        return self.draw

    def __exit__(self, *error: object) -> None:
        if self.bar:
            self.bar.stop()
        for (label, start), (_, after) in itertools.pairwise([*self.parts, ("", time.monotonic())]):
            click.echo(f"{after - start:8.1f} s  {label}", err=True)

    def timed(self, shown: Progress) -> Progress:
        """The same, and it notes when each part began."""

        def call(what: str, done: int, total: int) -> None:
            label = what.split(" (")[0]
            if not self.parts or self.parts[-1][0] != label:
                self.parts.append((label, time.monotonic()))
            shown(what, done, total)

        return call

    def draw(self, what: str, done: int, total: int) -> None:
        """Progress on a terminal."""
        assert self.bar is not None
        label = what.split(" (")[0]
        if label not in self.tasks:
            self.tasks[label] = self.bar.add_task(what, total=total or None)
        self.bar.update(self.tasks[label], description=what, completed=done, total=total or None)
        if self.whole:
            self.whole.heed(label, done, total)
            spent = self.whole.elapsed()
            self.bar.update(self.tasks["all"], completed=spent, total=spent + self.whole.left())

    def line(self, what: str, done: int, total: int) -> None:
        """Progress in a log: one line at most every LINE_EVERY seconds."""
        now = time.monotonic()
        if self.whole:
            self.whole.heed(what.split(" (")[0], done, total)
        start, first = self.started.setdefault(what.split(" (")[0], (now, done))
        if now - self.told < LINE_EVERY:
            return
        self.told = now
        left = f", {(now - start) / (done - first) * (total - done):.0f} s left" if first < done < total else ""
        count = f" {done}/{total}" if total else ""
        whole = f"; {told(self.whole.left())} in all" if self.whole else ""
        click.echo(f"{what}{count}{left}{whole}", err=True)
