"""dreammat material"""

from pathlib import Path

import click

from dreammat_cli.common import INPUT, Common, common_options, defaults, examples, library_option, plan, reporter, show
from stages.swatch.options import SIZES, SwatchOptions

DEFAULT = defaults(SwatchOptions)


@click.command(
    epilog=examples(
        'dreammat material "rusty iron" -o rust',
        'dreammat material "red brick" -o brick --size 4096 --metres 2',
    )
)
@click.argument("prompt", metavar="PROMPT")
@click.option("-o", "--output", type=INPUT, required=True, metavar="FOLDER", help="The folder to write.")
@click.option("--size", type=click.Choice(SIZES), default=DEFAULT["size"], show_default=True, metavar="TEXELS",
              help=f"Texture size: {', '.join(map(str, SIZES))}.")
@click.option("--metres", type=float, metavar="M", help="Edge of the square; without it, what shows the structure best.")
@library_option
@click.option("--seed", type=click.IntRange(0), default=DEFAULT["seed"], show_default=True, metavar="N",
              help="Another seed draws other patterns of the same material.")
@click.option("--preview-size", type=click.IntRange(32, 2048), default=DEFAULT["preview_size"], show_default=True,
              metavar="PIXELS", help="Side of each picture in preview.png.")
@common_options
def command(output: Path, common: Common, **chosen: object) -> None:
    """Write tiling maps of a material from a prompt alone: albedo, roughness, metallic, normal, height, and a preview.

    dreammat material "rusty iron" -o rust
    """
    options = SwatchOptions(**chosen)  # type: ignore[arg-type]
    if plan(common, "material", output, options):
        return
    from stages.swatch.stage import make_swatch

    with reporter(common) as progress:
        result = make_swatch(output, options, common.force, progress)
    data = {"output": str(output), "up_to_date": result.up_to_date, "files": result.files, "report": result.report}
    rows = [f"  {r['what']}: {r['where']}, {r['look']}, {r['colour']}" for r in result.report["understood"]]
    show(common, data, [f"{output}{': up to date' if result.up_to_date else ''}", *rows])
