"""dreammat train"""

from pathlib import Path
from typing import Any

import click

from dreammat_cli.common import INPUT, Common, common_options, defaults, lines_of, plan, reporter, show
from stages.train.options import TrainPriorOptions

DEFAULT = defaults(TrainPriorOptions)


def number(name: str, text: str, least: int = 1) -> Any:
    """An integer option that takes its default from the stage."""
    flag = "--" + name.replace("_", "-")
    return click.option(flag, type=click.IntRange(least), default=DEFAULT[name], show_default=True, metavar="N", help=text)


@click.group()
def command() -> None:
    """Train the diffusion models."""


@command.command()
@click.option("-o", "--out", type=INPUT, required=True, metavar="FOLDER", help="Data, checkpoint, curve, samples, weights.")
@number("steps", "Optimiser steps, those of the text encoder included.")
@number("text_steps", "First steps, in which the text encoder learns alone.", 0)
@number("batch", "Pictures a step.")
@click.option("--learning-rate", type=click.FloatRange(0, 1), default=DEFAULT["learning_rate"], show_default=True,
              help="Of Adam, after warming up.")
@number("shards", "Files of light transport to train on.")
@number("tiles", "Pictures in each file.")
@number("seed", "Of shapes, lights, materials and noise.", 0)
@click.option("--device", default=DEFAULT["device"], show_default=True, help="A torch device: cpu, cuda, mps.")
@number("workers", "Processes that make batches; 0: the training process itself.", 0)
@number("checkpoint_every", "Steps between checkpoints.")
@number("sample_every", "Steps between sample sheets.")
@common_options
def prior(out: Path, common: Common, **chosen: Any) -> None:
    """Make data and weights of the embedded prior from nothing; the same command continues a run that was stopped.

    prior.npz in the folder is what `dreammat distill --guidance prior` uses when it is put in place of the shipped weights.
    """
    options = TrainPriorOptions(**chosen)
    if plan(common, "train into", out, options):
        return
    from stages.train.prior import train_prior

    with reporter(common) as progress:
        result = train_prior(out, options, common.force, progress)
    data = {"weights": str(result.weights), "step": result.step, "up_to_date": result.up_to_date}
    state = ": up to date" if result.up_to_date else ""
    show(common, data, [f"{result.weights}{state}", *lines_of({"step": result.step})])
