"""dreammat run: the four stages, one after the other, in one folder."""

import shlex
from importlib import import_module
from pathlib import Path

import click

from dreammat_cli.common import INPUT, Common, common_options, examples
from dreammat_cli.whole import Whole, foretold

STAGES = ("prep", "conditions", "distill", "bake")

IN_METRES = ("glb", "fbx", "usd")
"""Formats whose unit of length is the metre."""

LARGEST = (0.005, 200.0)
"""Metres between which an object of a scene is believed to be as large as its file says."""


@click.command(
    epilog=examples(
        'dreammat run chair.obj --prompt "a carved oak chair" -o chair',
        'dreammat run chair.obj --prompt "rusty iron" -o chair --with conditions "--views 64" --with bake "--size 4096"',
        "dreammat run chair.obj --prompt \"walnut\" -o chair --with distill \"--part seat 'navy velvet'\"",
    )
)
@click.argument("mesh", type=INPUT, metavar="MESH")
@click.option("--prompt", required=True, metavar="TEXT", help='What it is made of: "oak", "rusty iron".')
@click.option("-o", "--output", type=INPUT, required=True, metavar="FOLDER",
              help="The folder to write: prep.npz, conditions/, material.npz, and the result in asset/.")
@click.option("--with", "further", type=(click.Choice(STAGES), str), multiple=True, metavar="STAGE OPTIONS",
              help='Options of a stage, as dreammat STAGE --help lists them: --with bake "--size 4096". Repeat for more.')
@common_options
def command(mesh: Path, prompt: str, output: Path, further: tuple[tuple[str, str], ...], common: Common) -> None:
    """Texture MESH: prep, conditions, distill and bake in one call.

    The same files as the four commands write, with the same bytes; what is up to date is not done again, and a run that
    was stopped continues. MESH may be a prep.npz, such as an object's of `prep --split`. With --json every stage prints a
    line of its own.
    """
    prep, conditions, material = output / "prep.npz", output / "conditions", output / "material.npz"
    stages: tuple[str, ...] = STAGES
    size: list[str] = []
    if mesh.suffix.lower() == ".npz":
        prep, stages, size = mesh, STAGES[1:], size_in_scene(mesh)
        if any(name == "prep" and text.strip() for name, text in further):
            raise click.UsageError(f"--with prep: {mesh} is prepared already; give its options to dreammat prep")
    arguments = {
        "prep": [mesh, "-o", prep],
        "conditions": [prep, "-o", conditions],
        "distill": [conditions, "--prompt", prompt, "-o", material, *size],
        "bake": [prep, material, "-o", output / "asset"],
    }
    above, contexts = click.get_current_context().parent, {}
    for stage in stages:  # all options are read before anything long begins
        options = [word for name, text in further if name == stage for word in split(text)]
        words = [*map(str, arguments[stage]), *options, *common.flags()]
        contexts[stage] = import_module(f"dreammat_cli.{stage}").command.make_context(stage, words, above)
    whole = Whole({stage: foretold(stage, context.params) for stage, context in contexts.items()})
    for stage, context in contexts.items():
        if stage == "conditions" and not common.dry_run:
            expect_parts(prep, contexts["distill"].params["parts"])
        context.obj, line = whole, whole.begin(stage)
        if not (common.quiet or common.as_json):
            click.echo(line, err=True)
        with context:
            context.command.invoke(context)


def size_in_scene(prep: Path) -> list[str]:
    """How large an object of a scene is, as an option of distill, where its format has metres; nothing for any other mesh."""
    if not prep.is_file():  # a later stage says so
        return []
    import numpy as np

    from stages.core.artifact import load_npz
    from stages.core.schemas import PREP

    mesh = load_npz(prep, PREP)
    said = mesh.provenance.extra
    if "scene" not in said or said["source_format"] not in IN_METRES:
        return []
    metres = float(1 / np.cbrt(abs(np.linalg.det(mesh["to_world"][:3, :3]))))
    return ["--object-size", f"{metres:.4g}"] if LARGEST[0] <= metres <= LARGEST[1] else []


def expect_parts(prep: Path, asked: tuple[tuple[str, str], ...]) -> None:
    """See that --part names what there is before anything long begins. Raises: InputError."""
    if not asked:
        return
    from stages.asset.parts import labelled_parts
    from stages.core.artifact import load_npz
    from stages.core.schemas import PREP
    from stages.distill.parts import claimed

    claimed(asked, labelled_parts(load_npz(prep, PREP)))


def split(text: str) -> list[str]:
    """Options as a shell would split them. Raises: BadParameter where a quote is left open."""
    try:
        return shlex.split(text)
    except ValueError as error:
        raise click.BadParameter(f"{text!r}: {error}", param_hint="--with") from error
