"""dreammat parts"""

from pathlib import Path

import click

from dreammat_cli.common import INPUT, Common, common_options, defaults, examples, plan, show
from stages.asset.options import PartsOptions


@click.command(
    epilog=examples(
        "dreammat parts chair/prep.npz",
        "dreammat parts chair/prep.npz -o chair/parts",
    )
)
@click.argument("prep", type=INPUT, metavar="PREP.npz")
@click.option("-o", "--output", type=INPUT, metavar="FOLDER", help="Also draw them: parts.png and parts.json in this folder.")
@click.option("--size", type=click.IntRange(64, 4096), default=defaults(PartsOptions)["size"], show_default=True,
              metavar="PIXELS", help="Side of each picture.")
@common_options
def command(prep: Path, output: Path | None, common: Common, size: int) -> None:
    """List the parts of PREP.npz by name: objects, material slots, and pieces that hang together.

    A part is called by its name, a pattern (wheel_*), slot:NAME, object:NAME, or its number (#3).
    """
    if plan(common, "draw the parts into" if output else "list the parts of", output or prep, PartsOptions(size)):
        return
    from stages.asset.parts import named_parts
    from stages.core.artifact import load_npz
    from stages.core.schemas import PREP

    mesh = load_npz(prep, PREP)
    parts = named_parts(mesh)
    rows = [part.to_json() for part in parts]
    if output is not None:
        from stages.asset.parts_picture import parts_picture
        from stages.core.artifact import write_json
        from stages.core.images import write_png
        from stages.light.scene import Scene

        scene = Scene(mesh["vertices"], mesh["triangles"], mesh["normals"])
        write_png(output / "parts.png", parts_picture(scene, parts, size))
        write_json(output / "parts.json", {"parts": rows})
    show(common, {"parts": rows}, table(rows))


def table(rows: list[dict]) -> list[str]:
    """One aligned line for each part."""
    heads = ("number", "kind", "name", "faces", "share", "size", "place")
    cells = [heads]
    for row in rows:
        boxes = (" x ".join(map("{:g}".format, row["size"])), ", ".join(map("{:g}".format, row["place"])))
        cells.append((f"#{row['number']}", row["kind"], row["name"], f"{row['faces']:,}", f"{row['share']:.1%}", *boxes))
    widths = [max(len(line[k]) for line in cells) for k in range(len(heads))]
    return ["  ".join(f"{text:{width}}" for text, width in zip(line, widths, strict=True)).rstrip() for line in cells]
