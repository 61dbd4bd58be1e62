"""dreammat bake"""

from pathlib import Path

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
from stages.bake.options import SIZES, BakeOptions

DEFAULT = defaults(BakeOptions)


@click.command(
    epilog=examples(
        "dreammat bake chair/prep.npz chair/material.npz -o chair/asset",
        "dreammat bake chair/prep.npz chair/material.npz -o chair/asset --size 4096 --relief 0.5",
    )
)
@click.argument("prep", type=INPUT, metavar="PREP.npz")
@click.argument("material", type=INPUT, metavar="MATERIAL.npz")
@click.option("-o", "--output", type=INPUT, required=True, metavar="FOLDER", help="The asset folder to write.")
@click.option("--size", type=click.Choice(SIZES), default=DEFAULT["size"], metavar="TEXELS",
              help=f"Texture size: {', '.join(map(str, SIZES))}.  [default: 2048; of several texture sets, by their share of "
                   "the surface]")
@click.option("--supersample", type=click.IntRange(1, 8), default=DEFAULT["supersample"], show_default=True,
              metavar="N", help="N samples on a texel's diagonal; N x N in texels that borders run through.")
@click.option("--relief", type=click.FloatRange(0, 2), default=DEFAULT["relief"], show_default=True, metavar="X",
              help="How strongly the material's relief is shown, as a multiple; 0 writes no normal and height maps of it.")
@library_option
@click.option("--occlusion-rays", type=click.IntRange(1, 1 << 16), default=DEFAULT["occlusion_rays"], show_default=True,
              metavar="N", help="Rays from each point whose ambient occlusion is traced; others take the mean of those nearby.")
@click.option("--preview-size", type=click.IntRange(32, 2048), default=DEFAULT["preview_size"], show_default=True,
              metavar="PIXELS", help="Side of each view in preview.png.")
@common_options
def command(prep: Path, material: Path, output: Path, common: Common, **chosen: object) -> None:
    """Write textures (EXR and PNG), model.glb and a preview of PREP.npz with the material of MATERIAL.npz.

    The model has the source's own vertices, faces, UVs and frame; charts were made only where the source's UVs cannot
    be baked.
    """
    options = BakeOptions(**chosen)  # type: ignore[arg-type]
    if plan(common, "bake", output, options):
        return
    from stages.bake.stage import bake

    with reporter(common) as progress:
        result = bake(prep, material, output, options, common.force, progress)
    data = {"output": str(output), "up_to_date": result.up_to_date, "files": result.files, "report": result.report}
    facts = {key: value for key, value in result.report.items() if isinstance(value, int | float | str)}
    state = ": up to date" if result.up_to_date else ""
    show(common, data, [f"{output}{state}", *([] if result.up_to_date else lines_of(facts))])
