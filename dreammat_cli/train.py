"""dreammat train"""

from pathlib import Path
from typing import Any

import click

from dreammat_cli.common import (
    INPUT,
    Common,
    Guessing,
    Shard,
    common_options,
    defaults,
    examples,
    lines_of,
    plan,
    reporter,
    show,
)
from stages.train.options import PicturesOptions, TrainControlnetOptions, TrainPriorOptions

PRIOR, PICTURES, CONTROLNET = defaults(TrainPriorOptions), defaults(PicturesOptions), defaults(TrainControlnetOptions)
RATE = click.FloatRange(0, 1)


def number(default: dict[str, Any], name: str, text: str, least: int = 1) -> Any:
    """An integer option that takes its default from the stage."""
    flag = "--" + name.replace("_", "-")
    return click.option(flag, type=click.IntRange(least), default=default[name], show_default=True, metavar="N", help=text)


def share(name: str, text: str) -> Any:
    """A share of the pictures, likewise."""
    flag = "--" + name.replace("_", "-")
    return click.option(flag, type=RATE, default=CONTROLNET[name], show_default=True, metavar="X", help=text)


@click.group(cls=Guessing)
def command() -> None:
    """Train the diffusion models."""


@command.command(epilog=examples("dreammat train prior -o prior --device cuda"))
@click.option("-o", "--out", type=INPUT, required=True, metavar="FOLDER", help="Data, checkpoint, curve, samples, weights.")
@number(PRIOR, "steps", "Optimiser steps, those of the reader included.")
@number(PRIOR, "text_steps", "First steps, in which the reader of prompts learns alone.", 0)
@number(PRIOR, "batch", "Pictures a step.")
@click.option("--learning-rate", type=RATE, default=PRIOR["learning_rate"], show_default=True,
              help="Of Adam, after warming up.")
@number(PRIOR, "shards", "Files of light transport to train on.")
@number(PRIOR, "tiles", "Pictures in each file.")
@click.option("--from", "start", type=INPUT, default=PRIOR["start"], metavar="WEIGHTS.npz",
              help="Weights to begin with, as far as they fit; random ones without it.")
@number(PRIOR, "seed", "Of shapes, lights, materials and noise.", 0)
@click.option("--device", default=PRIOR["device"], show_default=True, help="A torch device: cpu, cuda, mps.")
@number(PRIOR, "workers", "Processes that make batches; 0: the training process itself.", 0)
@number(PRIOR, "checkpoint_every", "Steps between checkpoints.")
@number(PRIOR, "sample_every", "Steps between sample sheets.")
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


@command.command(epilog=examples("dreammat train pictures models -o pictures --captions captions.json"))
@click.argument("models", type=INPUT, metavar="MODELS")
@click.option("-o", "--output", type=INPUT, required=True, metavar="FOLDER", help="Where to write the pictures.")
@click.option("--captions", type=INPUT, default=PICTURES["captions"], metavar="FILE.json",
              help='{"chair.glb": "an oak chair", ...}; with tags: {"caption": ..., "tags": [...]}.')
@click.option("--captioner", type=INPUT, default=PICTURES["captioner"], metavar="FOLDER",
              help="A BLIP model as transformers writes it, for models without a caption.")
@click.option("--env", multiple=True, metavar="NAME|FILE",
              help="An environment to draw from, as for `conditions`; repeat.  [default: random ones, new for each model]")
@number(PICTURES, "lights", "Environments of a model.")
@number(PICTURES, "views", "Random views of a model, each in all of its environments.")
@click.option("--size", type=click.IntRange(16, 4096), default=PICTURES["size"], show_default=True, metavar="PIXELS",
              help="Side of a view.")
@click.option("--quality", type=click.Choice(["draft", "standard", "high"]), default=PICTURES["quality"],
              show_default=True, help="Rays a point.")
@number(PICTURES, "seed", "Of views, environments and rays.", 0)
@click.option("--shard", type=Shard(), default=PICTURES["shard"], metavar="I/N",
              help="Do the I-th of N parts of the work, for N machines.")
@common_options
def pictures(models: Path, output: Path, common: Common, **chosen: Any) -> None:
    """Render the textured .glb files in the folder MODELS for `train controlnet`; run again, it continues.

    What is transparent, a plane, too simple, stylised or without a caption is left out; manifest.json says why.
    """
    options = PicturesOptions(**chosen)
    if plan(common, "render into", output, options):
        return
    from stages.train.pictures import render_pictures

    with reporter(common) as progress:
        result = render_pictures(models, output, options, common.force, progress)
    counts = {**result.content, "refused": len(result.content["refused"]), "made now": result.made}
    reasons = result.content["refused"] if common.verbose else {}
    show(common, result.content, [str(result.manifest), *lines_of(counts), *lines_of(reasons)])


@command.command(epilog=examples("dreammat train controlnet pictures -o run --sd-model models/stable-diffusion-2-1-base"))
@click.argument("pictures", type=INPUT, metavar="PICTURES")
@click.option("-o", "--output", type=INPUT, required=True, metavar="FOLDER",
              help="controlnet/, checkpoint, curve and samples.")
@click.option("--sd-model", default=CONTROLNET["sd_model"], metavar="FOLDER|ID",
              help="Stable Diffusion: a folder in the layout of diffusers, or an id of the hub.")
@number(CONTROLNET, "steps", "Optimiser steps.")
@number(CONTROLNET, "batch", "Pictures a step, on all devices together.")
@number(CONTROLNET, "at_once", "Of them on a device at a time; gradients of the rest are accumulated.")
@click.option("--learning-rate", type=RATE, default=CONTROLNET["learning_rate"], show_default=True, help="Of AdamW.")
@share("no_prompt", "Share of pictures learnt without their caption.")
@share("no_geometry", "Share of pictures learnt without depth and normals.")
@share("no_light", "Share of pictures learnt without light maps.")
@click.option("--precision", type=click.Choice(["no", "fp16", "bf16"]), default=CONTROLNET["precision"],
              help="Of the networks' arithmetic.  [default: bf16 on a GPU, else no]")
@number(CONTROLNET, "seed", "Of the new layers, pictures and noise.", 0)
@number(CONTROLNET, "workers", "Processes that read pictures; 0: the training process itself.", 0)
@number(CONTROLNET, "checkpoint_every", "Steps between checkpoints.")
@number(CONTROLNET, "sample_every", "Steps between sample sheets.")
@common_options
def controlnet(pictures: Path, output: Path, common: Common, **chosen: Any) -> None:
    """Train a ControlNet for --sd-model on the folder PICTURES of `train pictures`; run again, it continues.

    controlnet/ in the folder is what `distill --controlnet` takes. On several GPUs: accelerate launch -m dreammat_cli train
    controlnet ...
    """
    options = TrainControlnetOptions(**chosen)
    if plan(common, "train into", output, options):
        return
    from stages.train.controlnet import train_controlnet

    with reporter(common) as progress:
        result = train_controlnet(pictures, output, options, common.force, progress)
    data = {"controlnet": str(result.controlnet), "step": result.step, "up_to_date": result.up_to_date}
    state = ": up to date" if result.up_to_date else ""
    show(common, data, [f"{result.controlnet}{state}", *lines_of({"step": result.step})])
