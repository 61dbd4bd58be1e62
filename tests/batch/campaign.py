"""Tiny jobs on the workflow, killed in the middle and run again: the same bytes as by hand, and nothing done twice.

    python -m tests.batch.campaign [--jobs 4] [--kills 1] [--distinct 4] [--folder FOLDER]

Jobs repeat the distinct ones, which are also done by hand, so that every job's bytes are compared. What the engine costs is
the CPU time of the whole without that of the commands that it runs. Beside the jobs stands one with a broken mesh, which must
fail alone.
"""

import argparse
import base64
import os
import random
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from dreammat_cli.jobs import read
from stages.batch.jobs import Job, shared
from stages.batch.summary import outputs
from tests.pipeline import cube_sphere, fingerprint

ROOT = Path(__file__).resolve().parents[2]
TINY = {
    "prep": "--texture-size 64 --padding 2 --unwrap-triangles 0",
    "conditions": "--views 3 --size 16 --env overcast --quality draft",
    "distill": "--steps 1",
    "bake": "--size 512 --supersample 1 --relief 0 --preview-size 32 --occlusion-rays 1",
}
PROMPTS = ("copper", "oak", "red plastic", "granite", "rust")
A_MESH = 2
"""Meshes for so many jobs each, at least."""

MESHES = 10
"""Most meshes there are."""

MANY, ENGINE = 100, 0.1
"""From so many jobs on, the engine may add this share of its commands' CPU time: with fewer its start counts."""

TWICE = re.compile(r"^Finished jobid: \d+ \(Rule: (prep|conditions|distill|bake)\)", re.M)


def write_jobs(folder: Path, count: int, distinct: int | None = None, broken: bool = True) -> Path:
    """A jobs file with so many jobs, and their meshes. Args: distinct: jobs after so many repeat the first; all by default."""
    distinct = distinct or count
    meshes = [f"mesh_{i}.obj" for i in range(min(MESHES, -(-distinct // A_MESH)))]
    for i, name in enumerate(meshes):
        cube_sphere(folder / name, 3 + i)
    rows = [
        f"job_{k},{meshes[one % len(meshes)]},{PROMPTS[one % len(PROMPTS)]},{one},{','.join(TINY.values())}"
        for k, one in ((k, k % distinct) for k in range(count))
    ]
    if broken:
        (folder / "broken.obj").write_text("v 0 0\nf 1 2 3\n")
        rows.append(f"broken,broken.obj,oak,0,{','.join(TINY.values())}")
    path = folder / "jobs.csv"
    path.write_text("\n".join(["name,mesh,prompt,seed,prep,conditions,distill,bake", *rows]) + "\n")
    return path


def engine(jobs: Path, *words: str) -> list[str]:
    """The command line of the workflow."""
    where = ["--snakefile", str(ROOT / "workflow/Snakefile"), "--profile", str(ROOT / "profiles/local")]
    return [sys.executable, "-m", "snakemake", *where, "--directory", str(jobs.parent), *words, "--config", f"jobs={jobs}"]


CLOCK = """import os, sys
if "dreammat_cli" in sys.orig_argv:
    command = os.fork()
    if command:
        _, status, used = os.wait4(command, 0)
        with open({path!r}, "a") as file:
            file.write(f"{{used.ru_utime + used.ru_stime}}\\n")
        os._exit(os.waitstatus_to_exitcode(status))
"""
"""A sitecustomize.py: of each command that comes to its end, all of its CPU seconds are noted in a file."""


def environment(clock: Path | None = None) -> dict[str, str]:
    """With this checkout in front. Args: clock: a folder with a CLOCK."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join([*([str(clock)] if clock else []), str(ROOT)])}


def run_until(jobs: Path, share: float, clock: Path) -> str:
    """Run the workflow until a share of its outputs is there, then kill it and everything that it started. Returns: its log."""
    done = every_output(jobs)
    log = jobs.with_name("log.txt")
    with open(log, "w") as stream:
        process = subprocess.Popen(engine(jobs), env=environment(clock), stdout=stream, stderr=stream, start_new_session=True)
        while process.poll() is None and sum(path.exists() for path in done) < share * len(done):
            time.sleep(0.5)
        running = process.poll() is None
        if running:
            time.sleep(1 + 2 * random.Random(len(done)).random())  # into the middle of whatever runs
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    assert running, f"the workflow ended by itself before {share:.0%} was done:\n{log.read_text()[-2000:]}"
    subprocess.run([*engine(jobs), "--unlock"], env=environment(), check=True, capture_output=True)
    return log.read_text()


def every_output(jobs: Path) -> list[Path]:
    """What completes each command of each job that can be done, each once."""
    found = [path for job in read(jobs)[0] if job.name != "broken" for path in outputs(job, jobs.with_suffix("")).values()]
    return list(dict.fromkeys(found))


def times(jobs: Path) -> dict[Path, int]:
    """When each file was written of commands whose end the engine saw, and each view of one cut off, where it will be."""
    marks = jobs.parent / ".snakemake"
    ended = {base64.b64decode(mark.name).decode() for mark in (marks / "metadata").iterdir()}
    ended -= {base64.b64decode(mark.name).decode() for mark in (marks / "incomplete").iterdir()}
    whole = [path for path in every_output(jobs) if {str(path), str(path.parent)} & ended and path.exists()]
    files = [file for path in whole for file in ([path] if str(path) in ended else path.parent.rglob("*")) if file.is_file()]
    found = {file: file.stat().st_mtime_ns for file in files if file.name != ".snakemake_timestamp"}
    for folder in jobs.with_suffix("").glob("shapes/*/*.part"):
        for view in sorted(folder.glob("view_*"))[:-1]:  # the last may have been cut off
            found |= {folder.with_suffix("") / view.name / file.name: file.stat().st_mtime_ns for file in view.iterdir()}
    return found


def cpu() -> float:
    """CPU seconds of all processes that this one has waited for, and theirs; what died with its parent is not in them."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def by_hand(jobs: list[Job], folder: Path) -> None:
    """The same with the four commands, one after the other."""

    def dreammat(*words: str) -> None:
        subprocess.run([sys.executable, "-m", "dreammat_cli", *words, "-q"], env=environment(), check=True)

    shapes, lit = shared(jobs)
    for name, job in shapes.items():
        dreammat("prep", str(job.mesh), "-o", f"{folder}/shapes/{name}/prep.npz", *job.words("prep"))
    for (name, light), job in lit.items():
        shape = f"{folder}/shapes/{name}"
        dreammat("conditions", f"{shape}/prep.npz", "-o", f"{shape}/{light}", *job.words("conditions"))
    for job in jobs:
        shape, material = f"{folder}/shapes/{job.shape}", f"{folder}/{job.name}/material.npz"
        dreammat("distill", f"{shape}/{job.lit}", "-o", material, *job.words("distill"))
        dreammat("bake", f"{shape}/prep.npz", material, "-o", f"{folder}/{job.name}/asset", *job.words("bake"))


def artefacts(folder: Path) -> dict[str, str]:
    """Hashes of what jobs made, by path."""
    extra = (".snakemake_timestamp", "thumbnails/", "logs/", "benchmarks/", "summary.")
    return {name: digest for name, digest in fingerprint(folder).items() if not any(part in name for part in extra)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=4)
    parser.add_argument("--kills", type=int, default=1)
    parser.add_argument("--distinct", type=int, default=4, help="jobs after so many repeat the first")
    parser.add_argument("--folder", type=Path, help="where; kept afterwards")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        campaign(chosen, chosen.folder or Path(scratch))


def campaign(chosen: argparse.Namespace, folder: Path) -> None:
    """Write jobs, run them by hand and through kills, compare."""
    folder.mkdir(parents=True, exist_ok=True)
    jobs = write_jobs(folder.resolve(), chosen.jobs, chosen.distinct)
    once = [job for job in read(jobs)[0] if job.name != "broken"][: chosen.distinct]
    by_hand(once, folder / "by_hand")
    clock = folder.resolve() / "clock"
    clock.mkdir()
    (clock / "sitecustomize.py").write_text(CLOCK.format(path=str(clock / "seconds")))
    begin = cpu()
    twice = through_kills(jobs, chosen.kills, clock)
    whole, commands = cpu() - begin, sum(map(float, (clock / "seconds").read_text().split()))
    told = (jobs.with_suffix("") / "summary.csv").read_text().splitlines()
    states = [line.split(",")[1] for line in told[1:]]
    assert states == ["done"] * chosen.jobs + ["failed"], "\n".join(told)
    assert "broken,failed,prep," in told[-1] and "broken.obj" in told[-1], told[-1]
    look_after_changed_prompt(jobs)
    found, known = artefacts(jobs.with_suffix("")), artefacts(folder / "by_hand")
    due = known | {
        name.replace(f"{first.name}/", f"job_{k}/", 1): digest
        for k, first in ((k, once[k % len(once)]) for k in range(len(once), chosen.jobs))
        for name, digest in known.items() if name.startswith(f"{first.name}/")
    }  # fmt: skip
    differing = [name for name in due | found if found.get(name) != due.get(name)]
    assert not differing, f"other bytes than by hand: {', '.join(differing[:5])}"
    print(f"{chosen.jobs} jobs done, the broken one failed alone; a changed prompt would redo distill and bake of its job")
    print(f"{len(due)} files of {chosen.jobs} jobs have the bytes that they have by hand")
    print(f"CPU: {whole:.0f} s, of which the commands {commands:.0f} s: the engine adds {whole / commands - 1:.1%}")
    if chosen.jobs >= MANY:
        assert whole < (1 + ENGINE) * commands, "the engine costs too much"
    print(f"done twice: {twice or 'nothing'}", flush=True)
    assert not twice


def through_kills(jobs: Path, kills: int, clock: Path) -> int:
    """Run the workflow to its end, killed so often on the way. Returns: how many files were made twice."""
    before: dict[Path, int] = {}
    for kill in range(kills):
        log = run_until(jobs, (kill + 1) / (kills + 1.5), clock)
        before = times(jobs) | before
        print(f"killed: {len(TWICE.findall(log))} commands had been done since the last time", flush=True)
    last = subprocess.run(engine(jobs), env=environment(clock), capture_output=True, text=True)
    assert last.returncode == 1, f"the broken mesh should fail the whole at its end:\n{last.stderr[-2000:]}"
    after = times(jobs)
    return sum(after.get(path) != then for path, then in before.items())


def look_after_changed_prompt(jobs: Path) -> None:
    """The engine would redo distill and bake of the job whose prompt changes, and the broken job."""
    text = jobs.read_text()
    jobs.write_text(text.replace(",copper,", ",brass,", 1))
    again = subprocess.run(engine(jobs, "-n"), env=environment(), capture_output=True, text=True).stdout
    jobs.write_text(text)
    counts = {rule: int(count) for rule, count in re.findall(r"^(\w+) +(\d+)$", again, re.M)}
    left = {"prep": 1, "conditions": 1, "distill": 2, "bake": 2}
    assert {rule: counts.get(rule) for rule in left} == left, again


if __name__ == "__main__":
    main()
