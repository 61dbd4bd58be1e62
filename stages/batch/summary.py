"""What became of the jobs of a batch: summary.csv for programs, summary.html for people, with a small picture of each.

Everything follows from the files of the jobs and the logs of the engine; nothing of the engine itself is asked.
"""

import csv
import html
import io
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from importlib import resources
from pathlib import Path
from string import Template
from urllib.parse import quote

import numpy as np

from stages.batch.costs import recorded
from stages.batch.jobs import STAGES, Job
from stages.core.artifact import write_text
from stages.core.errors import DreammatError
from stages.core.images import read_image, write_png

DONE, FAILED, BEGUN, WAITING, LEFT_OUT = STATES = ("done", "failed", "begun", "waiting", "left out")
SILENT = "ended without a word: killed, out of memory or time, or its machine failed; the engine's log says which"
THUMBNAIL = 320
"""Width of a small picture, at least."""


@dataclass(frozen=True)
class Outcome:
    """One job: what it was asked, where it stands, what it took. error: one line, of the stage. Seconds and peak are those of
    its own distill and bake, MiB of its asset."""

    name: str
    status: str
    stage: str = ""
    error: str = ""
    mesh: str = ""
    prompt: str = ""
    seed: int = 0
    seconds: float = 0.0
    cpu_seconds: float = 0.0
    peak_memory_gib: float = 0.0
    asset_mib: float = 0.0


def outputs(job: Job, out: Path) -> dict[str, Path]:
    """What completes each of a job's commands, in their order."""
    shape, own = out / "shapes" / job.shape, out / job.name
    files = [shape / "prep.npz", shape / job.lit / "manifest.json", own / "material.npz", own / "asset/bake.json"]
    return dict(zip(STAGES, files, strict=True)) | {f"export {target}": own / target for target in job.export}


def logs(job: Job, out: Path) -> dict[str, list[Path]]:
    """Where the workflow keeps what each of a job's commands says; of conditions also what its parts say."""
    folder = out / "logs"
    names = [f"prep/{job.shape}", f"conditions/{job.shape}/{job.lit}", f"distill/{job.name}", f"bake/{job.name}"]
    found = {stage: [folder / f"{name}.log"] for stage, name in zip(STAGES, names, strict=True)}
    found["conditions"] += sorted((folder / "part" / job.shape).glob(f"{job.lit}.*.log"))
    return found | {f"export {target}": [folder / f"export/{job.name}/{target}.log"] for target in job.export}


def run_logs(job: Job, out: Path) -> dict[str, Path]:
    """The run.json of each of a job's four stages."""
    there = outputs(job, out)
    files = {stage: there[stage].with_name(f"{there[stage].name}.run.json") for stage in ("prep", "distill")}
    return files | {stage: there[stage].with_name("run.json") for stage in ("conditions", "bake")}


def outcome(job: Job, out: Path, ended: bool = False) -> Outcome:
    """Where a job stands: its last output is there, or else what is missing was begun, has failed, or waits.

    Args: ended: nothing runs any more, so what was begun has failed.
    """
    there = outputs(job, out)
    missing = [stage for stage, path in there.items() if not path.exists()]
    status, stage, error = WAITING, "", ""
    if there["bake"].exists():  # kept conditions or not, what was asked for is what counts
        missing = [stage for stage in missing if stage.startswith("export")]
    if not missing:
        status = DONE
    for stage in missing:
        heard = [log for log in logs(job, out)[stage] if log.is_file()]
        if heard:
            error = next(filter(None, map(last_words, heard)), SILENT if ended else "")
            status = FAILED if error else BEGUN
            break
    own = [recorded(path) for stage, path in run_logs(job, out).items() if stage in ("distill", "bake")]
    size = sum(file.stat().st_size for file in there["bake"].parent.glob("*"))
    return Outcome(
        job.name, status, stage if status != DONE else "", error, job.mesh.as_posix(), job.prompt, job.seed,
        round(sum(run.get("seconds", 0.0) for run in own), 1), round(sum(run.get("cpu_seconds", 0.0) for run in own), 1),
        max(run.get("peak_memory_gib", 0.0) for run in own), round(size / 2**20, 1),
    )  # fmt: skip


def last_words(log: Path) -> str:
    """The error that a command ended with: its line, or the last that anybody said."""
    lines = [line.strip() for line in log.read_text(encoding="utf-8", errors="replace").splitlines() if line.strip()]
    said = [line.removeprefix("error: ") for line in lines if line.startswith("error: ")]
    return " ".join((said or lines or [""])[-1].split())


def summarise(jobs: Sequence[Job], mistakes: Sequence[str], out: Path, ended: bool = False) -> str:
    """Write summary.csv, summary.html and thumbnails/ into a batch's folder.

    Args: mistakes: of lines of the jobs file that make no job. ended: nothing runs any more.
    Returns: one line on all of it.
    """
    said = [line.partition(": ") for line in mistakes]
    found = [outcome(job, out, ended) for job in jobs] + [Outcome(where, LEFT_OUT, error=what) for where, _, what in said]
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow([field.name for field in fields(Outcome)])
    table.writerows(asdict(one).values() for one in found)
    runs = {path for job in jobs for path in run_logs(job, out).values()}
    told = totals(found, sum(recorded(path).get("cpu_seconds", 0.0) for path in runs))
    write_text(out / "summary.csv", text.getvalue())
    write_text(out / "summary.html", page(found, told, out))
    return told


def totals(found: Sequence[Outcome], cpu_seconds: float) -> str:
    """One line on all jobs."""
    count = Counter(one.status for one in found)
    states = ", ".join(f"{count[state]} {state}" for state in STATES if count[state])
    peak, size = max((one.peak_memory_gib for one in found), default=0.0), sum(one.asset_mib for one in found) / 1024
    return f"{states}; {cpu_seconds / 3600:.2f} CPU hours, at most {peak:.1f} GiB of memory, {size:.2f} GiB of assets"


def thumbnail(job: str, out: Path) -> str:
    """Path, from the page, of a small picture of a job's preview, made where it is not there; "" without a preview."""
    preview, small = out / job / "asset/preview.png", out / "thumbnails" / f"{job}.png"
    if not preview.is_file():
        return ""
    if not small.is_file() or small.stat().st_mtime < preview.stat().st_mtime:
        try:
            pixels = read_image(preview)[..., :3]
        except DreammatError:  # half a picture of a job at work
            return ""
        side = pixels.shape[1] // 4  # its first row is the asset from four sides, of which two are enough here
        pixels = pixels[:side, : 2 * side]
        step = max(1, pixels.shape[1] // THUMBNAIL)
        height, width = (size // step * step for size in pixels.shape[:2])
        blocks = pixels[:height, :width].reshape(height // step, step, width // step, step, 3)
        write_png(small, blocks.mean((1, 3), dtype=np.float32))
    return small.relative_to(out).as_posix()


def page(found: Sequence[Outcome], told: str, out: Path) -> str:
    """summary.html: what failed first, then by state in the order of the file."""
    order = (FAILED, LEFT_OUT, BEGUN, WAITING, DONE)
    items = [item(one, out) for one in sorted(found, key=lambda one: order.index(one.status))]
    text = Template(resources.files("stages.batch").joinpath("summary_page.html").read_text(encoding="utf-8"))
    return text.substitute(title=html.escape(out.name), told=html.escape(told), items="\n".join(items))


def item(one: Outcome, out: Path) -> str:
    """A job on the page; its name leads to its report."""
    small, report = thumbnail(one.name, out) if one.status != LEFT_OUT else "", out / one.name / "asset/report.html"
    name = html.escape(one.name)
    picture = f'<img loading="lazy" src="{quote(small)}" alt="{html.escape(one.prompt)}">' if small else ""
    lines = [f'<b><a href="{quote(one.name)}/asset/report.html">{name}</a></b>' if report.is_file() else f"<b>{name}</b>"]
    lines += [f"<small>{one.status}{f': {html.escape(one.stage)}' if one.stage else ''}</small>", html.escape(one.prompt)]
    lines += [f'<span class="error">{html.escape(one.error)}</span>'] if one.error else []
    if one.seconds:
        took = f"{one.seconds:.0f} s, {one.cpu_seconds:.0f} s of CPU, {one.peak_memory_gib:.1f} GiB, {one.asset_mib:.1f} MiB"
        lines += [f"<small>{took}</small>"]
    return f'<li class="{one.status.split()[0]}">{picture}{"<br>".join(lines)}</li>'
