"""dreammat prep"""

import dataclasses
from pathlib import Path

import click

from dreammat_cli.common import INPUT, Common, common_options, defaults, examples, lines_of, plan, reporter, show
from stages.prep.options import PrepOptions

DEFAULT = defaults(PrepOptions)


@click.command(
    epilog=examples(
        "dreammat prep chair.obj -o chair/prep.npz",
        "dreammat prep scan.ply -o scan/prep.npz --up z --unwrap-seconds 20",
        "dreammat prep room.glb --split room --prompts prompts.toml",
    )
)
@click.argument("mesh", type=INPUT, metavar="MESH")
@click.option("-o", "--output", type=INPUT, metavar="PREP.npz", help="The file to write.")
@click.option("--split", "folder", type=INPUT, metavar="FOLDER",
              help="Instead: a job for each object of a scene, in place, FOLDER/NAME/prep.npz; the others cast shadows.")
@click.option("--prompts", type=INPUT, metavar="PROMPTS.toml",
              help="With --split: prompts by name or pattern; checked first, then written as FOLDER/NAME/prompt.txt.")
@click.option("--up", type=click.Choice(["y", "z"]), default=DEFAULT["up"], show_default=True,
              help="The source's up axis: y with front +z, or z with front -y (Blender).")
@click.option("--texture-size", type=click.IntRange(64, 16384), default=DEFAULT["texture_size"], show_default=True,
              metavar="TEXELS", help="Texture size that new UVs are laid out for.")
@click.option("--padding", type=click.IntRange(0, 256), default=DEFAULT["padding"], metavar="TEXELS",
              help="Padding around each chart; charts stand twice this apart.  "
                   "[default: the widest of 16, 8, 4 and 2 that is worth its cost]")
@click.option("--crease-angle", type=click.FloatRange(0, 180), default=DEFAULT["crease_angle"], show_default=True,
              metavar="DEGREES", help="A sharper edge stays sharp where the file has no usable normals.")
@click.option("--weld-tolerance", type=click.FloatRange(0, 0.1), default=DEFAULT["weld_tolerance"], show_default=True,
              metavar="DIAGONALS", help="Vertices closer than this are one.")
@click.option("--uv", type=click.Choice(["auto", "keep", "mend", "new"]), default=DEFAULT["uv"], show_default=True,
              help="Keep the source's UVs where they give texels to the surface, insist on them, also give the few faces "
                   "without texels charts in free space, or always make new ones.")
@click.option("--own-instances", is_flag=True,
              help="Texels for each place that a mesh stands in, in new UVs, instead of one texture for all of them.")
@click.option("--textures", type=click.Choice(["auto", "one", "slots", "udim"]), default=DEFAULT["textures"], show_default=True,
              help="Texture sets: those that the UVs are laid out for, one for all, one for each material slot, or UDIM tiles.")
@click.option("--unwrap-seconds", type=click.FloatRange(0), default=DEFAULT["unwrap_seconds"], show_default=True,
              metavar="SECONDS", help="Time that xatlas may take before simpler charts are made.")
@click.option("--unwrap-triangles", type=click.IntRange(0), default=DEFAULT["unwrap_triangles"], show_default=True,
              metavar="N", help="A larger mesh does not try xatlas.")
@common_options
def command(
    mesh: Path, output: Path | None, folder: Path | None, prompts: Path | None, common: Common, **chosen: object
) -> None:
    """Read, check, mend, orient and unwrap MESH (.obj .ply .stl .off .glb .gltf .fbx .usd).

    The source's vertices, faces, UVs and frame are kept beside the working mesh, for `bake` to give back.
    """
    options = PrepOptions(**chosen)  # type: ignore[arg-type]
    if output is None:
        split_scene(mesh, folder, prompts, options, common)
        return
    if folder is not None or prompts is not None:
        raise click.UsageError("give -o PREP.npz for one mesh, or --split FOLDER (with --prompts, if you like) for a scene")
    if plan(common, "prepare", output, options):
        return
    from stages.prep.stage import prep

    with reporter(common) as progress:
        result = prep(mesh, output, options, common.force, progress)
    data = {"output": str(output), "up_to_date": result.up_to_date, "findings": result.findings}
    state = ": up to date" if result.up_to_date else ""
    show(common, data, [f"{output}{state}", *([] if result.up_to_date else lines_of(result.findings))])


def split_scene(mesh: Path, folder: Path | None, prompts: Path | None, options: PrepOptions, common: Common) -> None:
    """A job for each object of a scene."""
    if folder is None:
        raise click.UsageError("give -o PREP.npz for one mesh, or --split FOLDER for a scene")
    if plan(common, "split into", folder, options):
        return
    from stages.prep.split import split

    with reporter(common) as progress:
        made = split(mesh, folder, options, prompts, common.force, progress)
    for name, why in made.unusable.items():
        click.echo(f"{name}: left out: {why}", err=True)
    state = ": up to date" if made.up_to_date else ""
    lines = [f"{folder}{state}: {len(made.objects)} objects", *(f"  {name}" for name in made.objects)]
    if made.unprompted:
        lines.append(f"without a prompt, they only cast shadows: {', '.join(made.unprompted)}")
    show(common, {"output": str(folder), **dataclasses.asdict(made)}, lines)
