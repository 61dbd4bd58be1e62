"""dreammat export"""

from pathlib import Path

import click

from dreammat_cli.common import INPUT, Common, common_options, examples, plan, reporter, show
from stages.asset.options import TARGETS, ExportOptions


@click.command(
    epilog=examples(
        "dreammat export chair/asset -o chair/unreal --for unreal",
        "dreammat export chair/asset -o chair/usd --for usd",
    )
)
@click.argument("asset", type=INPUT, metavar="ASSET")
@click.option("-o", "--output", type=INPUT, required=True, metavar="FOLDER", help="The folder to write.")
@click.option("--for", "target", type=click.Choice(TARGETS), required=True, metavar="TARGET",
              help=f"{', '.join(TARGETS[:-1])} or {TARGETS[-1]}.")
@common_options
def command(asset: Path, output: Path, common: Common, target: str) -> None:
    """Write the folder ASSET, which `bake` made, as one program wants it.

    \b
    blender three godot   the GLB as it is
    web                   a small GLB: Draco geometry, WebP textures       (extra: web)
    unreal                T_NAME_BC, T_NAME_ORM, T_NAME_N (-Y) and a GLB
    unity-hdrp unity-urp  base map, mask maps, normal (+Y), OBJ and GLB
    usd                   .usdc with its textures, and one .usdz           (extra: usd)
    materialx             .mtlx with gltf_pbr and standard_surface         (extra: materialx)
    """
    options = ExportOptions(target)
    if plan(common, "export into", output, options):
        return
    from stages.asset.export import export

    with reporter(common) as progress:
        result = export(asset, output, options, common.force, progress)
    data = {"output": str(output), "target": target, "up_to_date": result.up_to_date, "bytes": result.sizes}
    width = max(map(len, result.sizes))
    lines = [f"  {name:{width}}  {size / 2**20:8.2f} MiB" for name, size in result.sizes.items()]
    show(common, data, [f"{output}: up to date"] if result.up_to_date else [str(output), *lines])
