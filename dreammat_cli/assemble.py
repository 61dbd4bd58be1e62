"""dreammat assemble"""

import dataclasses
from pathlib import Path

import click

from dreammat_cli.common import INPUT, Common, common_options, examples, reporter, show


@click.command(
    epilog=examples(
        "dreammat assemble room/table/asset room/chair_1/asset -o room/scene.glb",
    )
)
@click.argument("assets", type=INPUT, nargs=-1, required=True, metavar="ASSET...")
@click.option("-o", "--output", type=INPUT, required=True, metavar="SCENE.glb", help="The scene to write.")
@common_options
def command(assets: tuple[Path, ...], output: Path, common: Common) -> None:
    """Put the folders ASSET, made of one scene's objects (`prep --split`), together again.

    Names, hierarchy and places are those of the scene; what stood there several times shares its mesh. An object without an
    asset stands there in grey, if its job is still beside the others.
    """
    if common.dry_run:
        show(common, {"would": "assemble", "output": str(output)}, [f"would assemble {len(assets)} assets into {output}"])
        return
    from stages.asset.assemble import assemble

    with reporter(common) as progress:
        made = assemble(list(assets), output, common.force, progress)
    state = ": up to date" if made.up_to_date else ""
    lines = [f"  {len(made.objects)} objects with their assets"]
    lines += [f"  in grey, without an asset: {', '.join(made.grey)}"] if made.grey else []
    lines += [f"  nodes left empty, nothing there of: {', '.join(made.empty)}"] if made.empty else []
    show(common, {**dataclasses.asdict(made), "path": str(output)}, [f"{output}{state}", *lines])
