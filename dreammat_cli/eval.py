"""dreammat eval"""

import dataclasses
from pathlib import Path
from typing import Any

import click

from dreammat_cli.common import INPUT, Common, common_options, defaults, examples, lines_of, plan, reporter, show
from stages.report.options import EvalOptions

DEFAULT = defaults(EvalOptions)


@click.command(
    epilog=examples(
        "dreammat eval jobs/*/asset -o table2 --sd-model models/sd --clip models/clip --inception inception.pt",
    )
)
@click.argument("assets", nargs=-1, required=True, type=INPUT, metavar="ASSET...")
@click.option("-o", "--output", type=INPUT, required=True, metavar="FOLDER", help="Where to write pictures and scores.")
@click.option("--sd-model", required=True, metavar="FOLDER|ID", help="Stable Diffusion, whose pictures the FID compares with.")
@click.option("--clip", required=True, metavar="FOLDER", help="A CLIP model as transformers writes it.")
@click.option("--inception", required=True, metavar="FILE.pt",
              help="The FID's Inception network as TorchScript (inception-2015-12-05.pt).")
@click.option("--views", type=click.IntRange(2), default=DEFAULT["views"], show_default=True, help="Views of each asset.")
@click.option("--samples", type=click.IntRange(2), default=DEFAULT["samples"], show_default=True, metavar="N",
              help="Pictures that Stable Diffusion draws for each asset's prompt.")
@click.option("--size", type=click.IntRange(16, 4096), default=DEFAULT["size"], show_default=True, metavar="PIXELS",
              help="Side of a picture.")
@click.option("--env", multiple=True, metavar="NAME|FILE",
              help="As for `conditions`; views take them in turn.  [default: the five built-in ones]")
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=DEFAULT["seed"], show_default=True,
              help="Of views, rays and samples.")
@click.option("--device", default=DEFAULT["device"], show_default=True, help="A torch device: cpu, cuda, mps.")
@common_options
def command(assets: tuple[Path, ...], output: Path, common: Common, **chosen: Any) -> None:
    """Measure baked assets as the paper's Table 2 does: CLIP score with their prompts, FID against Stable Diffusion.

    Every ASSET is a folder that `bake` wrote. Run again, it keeps the pictures that are there.
    """
    options = EvalOptions(**chosen)
    if plan(common, "evaluate into", output, options):
        return
    from stages.report.evaluate import evaluate

    with reporter(common) as progress:
        result = evaluate(assets, output, options, common.force, progress)
    data = {**result.summary, "scores": [dataclasses.asdict(score) for score in result.scores]}
    show(common, data, [str(output / "eval.json"), *lines_of({k: round(v, 3) for k, v in result.summary.items()})])
