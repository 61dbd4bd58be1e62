"""dreammat conditions"""

from pathlib import Path
from typing import Any

import click

from dreammat_cli.common import (
    INPUT,
    Common,
    Shard,
    common_options,
    defaults,
    examples,
    lines_of,
    plan,
    reporter,
    show,
)
from stages.conditions.options import ConditionsOptions

DEFAULT = defaults(ConditionsOptions)


@click.command(
    epilog=examples(
        "dreammat conditions chair/prep.npz -o chair/conditions",
        "dreammat conditions chair/prep.npz -o chair/conditions --views 32 --env studio --env my_office.hdr",
        "dreammat conditions chair/prep.npz -o chair/conditions --size 512 --profile sd",
        "dreammat conditions chair/prep.npz -o chair/part_1 --shard 1/4",
    )
)
@click.argument("prep", type=INPUT, metavar="PREP.npz")
@click.option("-o", "--output", type=INPUT, required=True, metavar="FOLDER", help="The conditions folder to write.")
@click.option("--views", type=click.IntRange(1, 9999), default=DEFAULT["views"], show_default=True, help="Cameras.")
@click.option("--size", type=click.IntRange(16, 4096), default=DEFAULT["size"], show_default=True, metavar="PIXELS",
              help="Side of a view; 512 for Stable Diffusion.")
@click.option("--env", multiple=True, metavar="NAME|FILE",
              help="An environment: a built-in name (clear_sky, overcast, studio, interior, night) or a "
                   "latitude-longitude .hdr or .exr file. Repeat for more.  [default: the five built-in ones]")
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=DEFAULT["seed"], show_default=True,
              help="Of cameras and rays.")
@click.option("--quality", type=click.Choice(["draft", "standard", "high"]), default=DEFAULT["quality"],
              show_default=True, help="Rays a point.")
@click.option("--error", type=click.FloatRange(0, 10), default=DEFAULT["error"], metavar="PERCENT",
              help="Choose the fewest rays predicted to reach this tone-mapped RMSE, instead of --quality.")
@click.option("--fov", type=(click.FloatRange(1, 120),) * 2, default=DEFAULT["fov"], show_default=True,
              metavar="LOW HIGH", help="Vertical field of view, degrees.")
@click.option("--elevation", type=(click.FloatRange(-89, 89),) * 2, default=DEFAULT["elevation"], show_default=True,
              metavar="LOW HIGH", help="Camera elevation, degrees.")
@click.option("--frame", type=(click.FloatRange(0.05, 1),) * 2, default=DEFAULT["frame"], show_default=True,
              metavar="LOW HIGH", help="Share of the half-frame that the object reaches.")
@click.option("--profile", type=click.Choice(["gltf", "sd"]), default=DEFAULT["profile"], show_default=True,
              help="sd: also smooth normals and Blender's light maps with a bounce, as the released ControlNet knows them.")
@click.option("--bounces", type=click.IntRange(0, 8), default=DEFAULT["bounces"], show_default=True,
              help="Of light between the object's surfaces; 0 for direct light alone.")
@click.option("--maps", is_flag=True, help="Also write maps_<environment>.exr for every view.")
@click.option("--shard", type=Shard(), default=DEFAULT["shard"], metavar="I/N",
              help="Make the I-th of N parts of the views, for N machines, each in a folder of its own.")
@click.option("--merge", type=INPUT, multiple=True, metavar="FOLDER",
              help="A part that --shard made; with all N of them, and else the same options, nothing is left to be traced.")
@common_options
def command(prep: Path, output: Path, common: Common, **chosen: Any) -> None:
    """Ray-trace depth, normals and light transport around the mesh of PREP.npz.

    An interrupted run continues with the views that are missing.
    """
    for name in ("fov", "elevation", "frame"):
        low, high = chosen[name]
        if low > high:
            raise click.BadParameter(f"{low:g} {high:g}: expected LOW <= HIGH", param_hint=f"--{name}")
    if chosen["merge"] and chosen["shard"] != (1, 1):
        raise click.UsageError("give --shard to make a part, or --merge to bring all parts together")
    options = ConditionsOptions(**chosen)
    if plan(common, "trace conditions into", output, options):
        return
    from stages.conditions.stage import conditions

    with reporter(common) as progress:
        result = conditions(prep, output, options, common.force, progress)
    if result.up_to_date:
        show(common, {"output": str(output), "up_to_date": True}, [f"{output}: up to date"])
        return
    mended = {name: count for name, count in result.clamped.items() if count}
    facts = {
        "views": f"{result.made} made, {result.found} found",
        "environments": ", ".join(result.environments),
        **({"expected error": f"{result.expected_percent:.2f} %"} if result.expected_percent is not None else {}),
        **({"mended texels": ", ".join(f"{n} {c}" for n, c in mended.items())} if mended else {}),
    }
    data = {"output": str(output), "made": result.made, "found": result.found, "clamped": result.clamped,
            "expected_percent": result.expected_percent}
    show(common, data, [str(output), *lines_of(facts)])
