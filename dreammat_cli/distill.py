"""dreammat distill"""

import functools
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from dreammat_cli.common import (
    INPUT,
    Common,
    common_options,
    defaults,
    examples,
    library_option,
    lines_of,
    plan,
    reporter,
    show,
)
from stages.core.progress import Tell, untold
from stages.distill.options import GIVEN, LOSSES, QUALITY, DistillOptions, HoldOptions, ScoreOptions
from stages.sd.options import SdOptions

SCORE, HOLD, SD = defaults(ScoreOptions), defaults(HoldOptions), defaults(SdOptions)
DEFAULT = defaults(DistillOptions) | SCORE | HOLD
UNIT = click.FloatRange(0)


def weight(name: str, text: str) -> Any:
    """A non-negative weight that takes its default from the stage."""
    flag = "--" + name.replace("_", "-")
    return click.option(flag, type=UNIT, default=DEFAULT[name], show_default=True, metavar="X", help=text)


def understood(options: DistillOptions) -> Any:
    """The recipe that the prompt's words call for, before any mesh is known. Raises: InputError."""
    from stages.core.errors import InputError
    from stages.material.library import Library
    from stages.prior.prompt import read_parts, read_prompt
    from stages.prior.vocabulary import ShippedWords

    if options.guidance != "prior":
        raise InputError(f"--explain with --guidance {options.guidance}: it reads no words; expected --guidance prior")
    if not options.prompt.strip():
        raise InputError("--explain: no --prompt is given; say what the object is made of")
    library = Library(options.library) if options.library else None
    prior = ShippedWords()
    recipe = read_prompt(options.prompt, prior, options.seed, options.object_size, library)
    return replace(recipe, parts=read_parts(options.parts, recipe, prior, options.seed, library))


def claims(conditions: Path, options: DistillOptions) -> list[str]:
    """What is to be said of the parts, where the conditions are there already. Raises: InputError."""
    from stages.core.artifact import read_manifest
    from stages.core.schemas import CONDITIONS
    from stages.distill.parts import claimed
    from stages.distill.views import read_parts

    if not options.parts or not conditions.exists():
        return []
    return claimed(options.parts, read_parts(conditions, read_manifest(conditions, CONDITIONS)[0])[0])[1]


def explain_words(common: Common, conditions: Path, options: DistillOptions) -> None:
    """Print what is understood of the prompts, a row for each coat."""
    from stages.prior.explain import HEADINGS, explained, table

    lines, recipe = claims(conditions, options), understood(options)
    rows = [dict(zip(HEADINGS, row, strict=True)) for row in explained(recipe)]
    show(common, {"prompt": options.prompt, "metres": recipe.base.metres, "coats": rows}, [*table(recipe), *lines])


@click.command(
    epilog=examples(
        'dreammat distill chair/conditions --prompt "a carved oak chair" -o chair/material.npz',
        'dreammat distill chair/conditions --prompt "a carved oak chair" -o chair/material.npz --explain',
        'dreammat distill chair/conditions --prompt "walnut" --part seat "navy velvet" -o chair/material.npz',
        "dreammat distill other/conditions --like chair/material.npz -o other/material.npz",
    )
)
@click.argument("conditions", type=INPUT, metavar="CONDITIONS")
@click.option("-o", "--output", type=INPUT, required=True, metavar="MATERIAL.npz", help="The file to write.")
@click.option("--prompt", default=DEFAULT["prompt"], metavar="TEXT", help='What it is made of: "oak", "rusty iron".')
@click.option("--part", "parts", type=(str, str), multiple=True, default=DEFAULT["parts"], metavar="NAME PROMPT",
              help="What a part is made of in place of that: its name, pattern or number as dreammat parts lists it, and its "
                   "words. Repeat for more; where two claim the same, the later has it.")
@click.option("--like", type=INPUT, default=DEFAULT["like"], metavar="OTHER.npz",
              help="In place of --prompt: another mesh's material, whose words, recipe and draw are taken over, as large in "
                   "space as there: by --object-size, or else by the two meshes' own units.")
@click.option("--object-size", type=click.FloatRange(1e-3, 1e4), default=DEFAULT["object_size"], metavar="METRES",
              help="Length of its longest edge, which sizes bricks, grain and threads.  [default: what the words say]")
@click.option("--explain", is_flag=True, help="Print what is understood of --prompt as a table, and stop.")
@library_option
@click.option("--negative-prompt", default=DEFAULT["negative_prompt"], show_default=True, metavar="TEXT",
              help="What the picture should not look like.")
@click.option("--guidance", type=click.Choice(["prior", "sd", "reference"]), default=DEFAULT["guidance"], show_default=True,
              help="The embedded diffusion model, Stable Diffusion, or the known material of --reference.")
@click.option("--reference", type=INPUT, default=DEFAULT["reference"], metavar="MODEL.glb",
              help="A textured model of the same shape, for --guidance reference.")
@click.option("--sd-model", default=SD["sd_model"], metavar="FOLDER|ID",
              help="Stable Diffusion, for --guidance sd: a folder in the layout of diffusers, or an id of the hub.")
@click.option("--controlnet", default=SD["controlnet"], metavar="FOLDER|ID",
              help="Its light and geometry ControlNet, likewise.")
@click.option("--vram", type=click.IntRange(8), default=SD["vram"], metavar="GIB",
              help="For --guidance sd: GPU memory to stay within; 8, 12 and 16 save ever less.  [default: what it has]")
@click.option("--quality", type=click.Choice(list(QUALITY)), default=DEFAULT["quality"], show_default=True,
              help="A quarter of the steps that the guidance calls for, as many, or four times that.")
@click.option("--steps", type=click.IntRange(1), default=DEFAULT["steps"], show_default=True, metavar="N",
              help="Optimiser steps, in place of that.")
@click.option("--batch", type=click.IntRange(1, 256), default=DEFAULT["batch"], show_default=True, metavar="N",
              help="Images a step.")
@click.option("--learning-rate", type=click.FloatRange(0, 1, min_open=True), default=DEFAULT["learning_rate"],
              show_default=True, metavar="X", help="Of Adam, at the start.")
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=DEFAULT["seed"], show_default=True,
              help="Same seed, same result.")
@click.option("--device", default=DEFAULT["device"], show_default=True, help="A torch device: cpu, cuda, mps.")
@weight("smoothness", "Weight of the difference between neighbouring points' materials.")
@click.option("--loss", type=click.Choice(LOSSES), default=DEFAULT["loss"], show_default=True,
              help="Classifier score distillation, with weights that suit the model, or DreamFusion's.")
@weight("eta1", "Weight of the positive prediction (paper, Eq. 7), in place of the loss's own.")
@click.option("--eta2", type=(UNIT, UNIT), default=DEFAULT["eta2"], show_default=True, metavar="START END",
              help="Of the negative one, at the first step and from two thirds of the steps on; likewise.")
@weight("posterior", "Share of the posterior-mean term, 0 in the paper's pure classifier score; likewise.")
@weight("anchor", "Weight of the squared distance from what the words alone call for.")
@weight("bimodal", "How strongly metallic is sent to 0 or 1 towards the end.")
@click.option("--given", type=click.Choice(GIVEN), default=DEFAULT["given"], show_default=True,
              help="Conditions the model gets: the paper's ablations.")
@click.option("--lights", type=click.Choice(("all", "one")), default=DEFAULT["lights"], show_default=True,
              help="Environments of CONDITIONS that steps are lit by; one: the first.")
@common_options
def command(conditions: Path, output: Path, common: Common, explain: bool, **chosen: Any) -> None:
    """Optimise the material of the mesh in the folder CONDITIONS until it looks like --prompt in every light.

    Stopped by Ctrl-C or a kill, the same command continues; on a CPU the result has the same bytes either way.
    """
    sd, score, hold = ({name: chosen.pop(name) for name in group} for group in (SD, SCORE, HOLD))
    options = DistillOptions(**chosen, sd=SdOptions(**sd), score=ScoreOptions(**score), hold=HoldOptions(**hold))
    if explain:
        explain_words(common, conditions, options)
        return
    if plan(common, "distill", output, options):
        if options.guidance == "prior" and options.prompt.strip() and not common.as_json:
            explain_words(common, conditions, options)
        return
    from stages.distill.stage import distill

    tell: Tell = untold if common.quiet else functools.partial(click.echo, err=True)
    with reporter(common) as progress:
        result = distill(conditions, output, options, common.force, progress, tell)
    if result.up_to_date:
        show(common, {"output": str(output), "up_to_date": True}, [f"{output}: up to date"])
        return
    facts = {"steps": result.steps, "resumed at": result.resumed, "loss": round(result.loss, 6)}
    show(common, {"output": str(output), **facts}, [str(output), *lines_of(facts)])
