"""What plan, summary and the workflow share: a jobs file with its options checked by the commands that they are for."""

import functools
import shlex
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from stages.batch import costs
from stages.batch.jobs import STAGES, Job, read_jobs

INPUTS = {"prep": ["MESH"], "conditions": ["PREP.npz"], "distill": ["CONDITIONS"], "bake": ["PREP.npz", "MATERIAL.npz"],
          "export": ["ASSET"]}  # fmt: skip
"""Arguments of each command, in whose place the workflow puts paths of its own."""

COLUMNS = {"prompt", "parts", "seed"}
"""Options of `distill` for which a jobs file has columns."""

UNFIT = {"folder", "prompts", "explain", "dry_run"}
"""Options of which no file comes, or another one."""


def wrong(stage: str, words: list[str]) -> str:
    """What a command says against its options, or ""."""
    command = import_module(f"dreammat_cli.{stage}").command
    if "--help" in words:
        return "--help: does nothing; leave it out"
    try:
        context = command.make_context(stage, [*INPUTS[stage], "-o", "OUTPUT", *words])
    except click.UsageError as error:
        return error.format_message().rstrip(".")
    said = [name for name in context.params if context.get_parameter_source(name) == ParameterSource.COMMANDLINE]
    for name in said:
        if name in UNFIT or (name == "output" and {"-o", "--output"} & set(words)):
            return f"--{name.replace('_', '-')}: not for one of many jobs; leave it out"
        if stage == "distill" and name in COLUMNS:
            return f"--{name.removesuffix('s')}: the jobs file has a column for it"
    return ""


@functools.cache
def given(stage: str, text: str) -> dict[str, Any]:
    """All options of a stage, those that a job's text sets and the others as they are by default."""
    command = import_module(f"dreammat_cli.{stage}").command
    words = [*INPUTS[stage], "-o", "OUTPUT", *shlex.split(text)]
    return command.make_context(stage, words).params


def needs(job: Job, prepared: Path, further: Sequence[tuple[str, str]] = ()) -> dict[str, costs.Need]:
    """What each of a job's commands needs. Args: prepared: its prep.npz, if that is there. further: options of stages."""
    texts = {stage: [text for name, text in further if name == stage] + [job.options.get(stage, "")] for stage in STAGES}
    options = {stage: given(stage, " ".join(of_stage)) for stage, of_stage in texts.items()}
    return costs.of(options, costs.triangles_of(job.mesh, prepared))


def read(path: Path, there: bool = True) -> tuple[list[Job], list[str]]:
    """Jobs that can be done and a line for every mistake. Args: there: meshes must be. Raises: InputError."""
    return read_jobs(path, wrong, there)


def folder_of(path: Path) -> Path:
    """Where the workflow writes the jobs of a file: beside it, under its name without the ending."""
    return path.with_suffix("") if path.suffix else path.with_name(path.name + "-assets")
