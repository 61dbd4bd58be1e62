"""dreammat edit"""

import dataclasses
from pathlib import Path

import click

from dreammat_cli.common import INPUT, Common, common_options, defaults, examples, lines_of, plan, reporter, show
from stages.edit.options import EditOptions

DEFAULT = defaults(EditOptions)


@click.command(
    epilog=examples(
        "dreammat edit chair/asset -o chair/red --part seat --hue 20 --saturation 1.2",
        "dreammat edit chair/red --part 'leg_*' --metallic 1",
        "dreammat edit chair/red --undo",
    )
)
@click.argument("asset", type=INPUT, metavar="ASSET")
@click.option("-o", "--output", type=INPUT, metavar="FOLDER",
              help="The asset folder to write; an asset that is edited already may be changed itself, without this.")
@click.option("--part", multiple=True, metavar="NAME",
              help="Only these parts: names, patterns (leg_*), slot:NAME, object:NAME or numbers (#3), as for `parts`. Repeat.")
@click.option("--hue", type=click.FloatRange(-360, 360), default=DEFAULT["hue"], metavar="DEGREES",
              help="Turn the hue, at the same lightness (OKLCh).")
@click.option("--saturation", type=click.FloatRange(0, 100), default=DEFAULT["saturation"], metavar="X",
              help="Multiply the chroma, at the same lightness (OKLCh); 0 is grey.")
@click.option("--brightness", type=click.FloatRange(0, 100), default=DEFAULT["brightness"], metavar="X",
              help="Multiply the linear albedo.")
@click.option("--tint", default=DEFAULT["tint"], metavar="COLOUR", help="Multiply the albedo by a colour, '#8a5' or '#88aa55'.")
@click.option("--roughness-scale", type=click.FloatRange(0, 100), default=DEFAULT["roughness_scale"], metavar="X",
              help="Multiply the roughness.")
@click.option("--roughness-offset", type=click.FloatRange(-1, 1), default=DEFAULT["roughness_offset"], metavar="X",
              help="Add to the roughness.")
@click.option("--metallic", type=click.FloatRange(0, 1), default=DEFAULT["metallic"], metavar="X", help="Set metallic.")
@click.option("--invert-metallic", is_flag=True, help="Make metal of what is none, and the other way round.")
@click.option("--list", "listing", is_flag=True, help="Only list the edits of ASSET.")
@click.option("--undo", "undoing", is_flag=True, help="Take the last edit away.")
@common_options
def command(
    asset: Path, output: Path | None, common: Common, listing: bool, undoing: bool, part: tuple[str, ...], **chosen: object
) -> None:
    """Change the colours, roughness and metallic of the folder ASSET, which `bake` or this made.

    Works on the linear EXR masters; PNG, GLB, preview and report follow. ASSET as it was baked is never changed; an edited
    asset keeps what it was made from and the list of its edits, which add up. Values that leave 0 … 1 are brought back and
    counted, colours towards the grey of their lightness.
    """
    options = EditOptions(part=tuple(part), **chosen)  # type: ignore[arg-type]
    changes = options != EditOptions()
    if listing + undoing + changes != 1:
        raise click.UsageError("give one of --list, --undo, and something to change (--hue, --saturation, --metallic, …)")
    verb = "list the edits of" if listing else "undo the last edit into" if undoing else "edit into"
    if plan(common, verb, output or asset, options):
        return
    from stages.edit.stage import edit, edits_of, undo

    if listing:
        edits = edits_of(asset)
        data = {"asset": str(asset), "edits": [one.changes() for one in edits]}
        show(common, data, [f"{number:4}  {one.told()}" for number, one in enumerate(edits, 1)] or [f"{asset}: no edits"])
        return
    with reporter(common) as progress:
        made = (
            undo(asset, output, common.force, progress) if undoing else edit(asset, output, options, common.force, progress)
        )
    clamped = {f"{name}_clamped": f"{count:,} texels" for name, count in made.clamped.items() if count}
    shared = {"shared_with_other_parts": f"{made.shared_texels:,} texels"} if made.shared_texels else {}
    lines = [f"{number:4}  {told}" for number, told in enumerate(made.edits, 1)]
    state = ": up to date" if made.up_to_date else ""
    data = dataclasses.asdict(made)
    show(common, {**data, "folder": str(made.folder)}, [f"{made.folder}{state}", *lines, *lines_of(clamped | shared)])
