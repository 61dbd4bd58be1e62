"""dreammat summary"""

from pathlib import Path

import click

from dreammat_cli.common import INPUT, Common, common_options, examples, show
from dreammat_cli.jobs import folder_of, read


@click.command(epilog=examples("dreammat summary jobs.csv"))
@click.argument("jobs", type=INPUT, metavar="JOBS")
@click.option("-o", "--output", type=INPUT, metavar="FOLDER", help="Where the batch is.  [default: JOBS without its ending]")
@click.option("--ended", is_flag=True, help="Nothing runs any more: what was begun and is not done has failed.")
@common_options
def command(jobs: Path, output: Path | None, ended: bool, common: Common) -> None:
    """Say what has become of JOBS so far, and write summary.csv and summary.html, with a picture of each asset.

    The workflow calls it at its end; it can be called at any time while it runs.
    """
    out = output or folder_of(jobs)
    if common.dry_run:
        show(common, {"would": "summarise", "output": str(out)}, [f"would summarise {out}"])
        return
    from stages.batch.summary import summarise

    told = summarise(*read(jobs), out, ended)
    show(common, {"output": str(out / "summary.html"), "told": told}, [str(out / "summary.html"), f"  {told}"])
