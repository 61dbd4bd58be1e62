"""A campaign against the four stages: every artefact damaged in many ways, and every stage killed at random moments.

    python -m tests.campaign --reads 1000 --damages 100 --kills 100

A damaged artefact ends in code 4 and one line, or in code 0 and the very result that an undamaged one gives: a file that nobody
reads may be damaged. A killed stage, run again, ends in the same bytes.

Most damages are tried on all that a stage reads, in one process; a part on the whole stage, in a fork of a process that has
imported everything, which saves two seconds; every eighth of these in a process of its own.
"""

import argparse
import contextlib
import json
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np

from stages.core.artifact import load_npz, read_exr
from stages.core.errors import ArtifactError
from stages.core.schemas import MATERIAL, PREP
from stages.distill.views import Views
from stages.material.learnt import LearntMaterial
from tests import damages
from tests.pipeline import cube_sphere, fingerprint
from tests.pipeline import stages as commands

SECONDS = 20.0
"""CPU time that a damaged artefact may cost; other jobs of the machine do not count."""

GIBIBYTES = 2.0
"""Memory that it may take."""

CUT_OFF = 240.0
"""Seconds on the clock after which a run is stopped."""

UNFINISHED, ALONE, STEPS = "unfinished", 8, 12


@dataclass(frozen=True)
class Outcome:
    """How a run ended. code: negative for a signal. seconds: of CPU. memory: GiB."""

    code: int
    stderr: str
    seconds: float
    memory: float


def launch(arguments: list[str], stderr: int, alone: bool) -> int:
    """Start a command, its messages going to a file descriptor. Returns: its process id."""
    process = os.fork()
    if process:
        return process
    code = 70
    try:
        os.dup2(stderr, 2)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        resource.setrlimit(resource.RLIMIT_AS, (32 << 30, 32 << 30))  # what runs away shall not take the machine along
        if alone:
            os.execv(sys.executable, [sys.executable, "-m", "dreammat_cli", *arguments, "-q"])
        code = called([*arguments, "-q"])
    except KeyboardInterrupt:  # before the command line was there to note it
        code = 130
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(code)


def called(arguments: list[str]) -> int:
    """The command in this process. Returns: its exit code."""
    from dreammat_cli.main import main

    sys.argv = ["dreammat", *arguments]
    try:
        main()
    except SystemExit as error:
        return int(error.code or 0)
    return 0


def run(arguments: list[str], alone: bool = False, kill: tuple[float, signal.Signals] | None = None) -> Outcome:
    """Run a command to its end. Args: kill: after how many seconds of its own CPU time which signal is sent."""
    with tempfile.TemporaryFile() as stream:
        process = launch(arguments, stream.fileno(), alone)
        begin = time.monotonic()
        while not (ended := os.wait4(process, os.WNOHANG))[0]:
            if kill and cpu_seconds(process) > kill[0]:
                os.kill(process, kill[1])
                kill = None
            elif time.monotonic() - begin > CUT_OFF:
                os.kill(process, signal.SIGKILL)
            time.sleep(0.005)
        stream.seek(0)
        text = stream.read().decode(errors="replace")
    used = ended[2]
    return Outcome(os.waitstatus_to_exitcode(ended[1]), text, used.ru_utime + used.ru_stime, used.ru_maxrss / 2**20)


def cpu_seconds(process: int) -> float:
    """CPU time that a process has used so far. Source: proc(5), utime and stime."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def warm_up() -> None:
    """Import what the stages need, without starting any thread."""
    os.environ["OMP_NUM_THREADS"] = "1"
    import torch

    import dreammat_cli.main  # noqa: F401
    import stages.conditions.stage
    import stages.distill.guidance.prior
    import stages.distill.stage
    import stages.prep.stage  # noqa: F401

    torch.set_num_threads(1)


# ---------------------------------------------------------------------------------------------------- damages


@dataclass(frozen=True)
class Situation:
    """files: what may be damaged, a pattern. command: the stage that then runs. gone: what it is to make, taken away before.

    result: what of that must be as without the damage, when the stage succeeds.
    """

    files: str
    command: str
    gone: tuple[str, ...] = ()
    result: str = ""


SITUATIONS = (
    Situation("prep.npz", "conditions", ("conditions",), "conditions/view_*/*.exr"),
    Situation("prep.npz", "bake", ("asset",), "asset/*.png"),
    Situation("conditions/**/*", "distill", ("material.npz",), "material.npz"),
    Situation("conditions/**/*", "distill", ("material.npz",), "material.npz"),
    Situation("conditions/**/*", "conditions"),
    Situation(f"{UNFINISHED}/**/*", "conditions", ("conditions",), "conditions/view_*/*.exr"),
    Situation("material.npz", "bake", ("asset",), "asset/*.png"),
    Situation("material.npz.checkpoint", "distill", ("material.npz",), "material.npz"),
    Situation("asset/*", "bake"),
)


READ = (
    Situation("prep.npz", "conditions"),
    Situation("conditions/**/*", "distill"),
    Situation("conditions/**/*", "distill"),
    Situation("material.npz", "bake"),
)
"""Those of which `what_is_read` is a short form."""


def build(folder: Path) -> None:
    """All artefacts of a tiny pipeline, a checkpoint, and a conditions folder that a run left unfinished."""
    folder.mkdir(parents=True, exist_ok=True)
    cube_sphere(folder / "mesh.obj")
    for name, arguments in commands(folder, STEPS).items():
        outcome = run(arguments)
        assert outcome.code == 0, f"{name}: {outcome.stderr}"
    unfinish(folder)


def unfinish(folder: Path) -> None:
    """Leave beside finished artefacts what a stopped run leaves: `unfinished/` of conditions, and a checkpoint of distill."""
    shutil.copytree(folder / "conditions", folder / UNFINISHED)
    damages.unfinish(folder / UNFINISHED)
    (folder / "material.npz").rename(folder / "whole.npz")
    preview = (folder / "material.preview.png").read_bytes()
    if (process := os.fork()) == 0:
        stopped(commands(folder, STEPS)["distill"])
        os._exit(0)
    os.waitpid(process, 0)
    (folder / "whole.npz").rename(folder / "material.npz")
    (folder / "material.preview.png").write_bytes(preview)  # the stopped run has made one of what it began with
    assert (folder / "material.npz.checkpoint").exists()


def stopped(arguments: list[str]) -> None:
    """Run distill, and interrupt it in the middle of its steps."""

    def interrupt(what: str, done: int, total: int) -> None:
        if what.startswith("distill") and done >= total // 2:
            raise KeyboardInterrupt

    with patch("dreammat_cli.common.silent", interrupt), contextlib.suppress(KeyboardInterrupt, SystemExit):
        called([*arguments, "-q"])


def results(folder: Path, pattern: str) -> dict[str, bytes]:
    """The content of a stage's results, without what tells where they come from."""
    found = {}
    for path in sorted(folder.glob(pattern)):
        name = str(path.relative_to(folder))
        if path.suffix == ".npz":
            with np.load(path, allow_pickle=False) as archive:
                found |= {f"{name}:{key}": archive[key].tobytes() for key in archive.files if key != "header"}
        else:
            found[name] = read_exr(path).pixels.tobytes() if path.suffix == ".exr" else path.read_bytes()
    return found


@dataclass(frozen=True)
class Done:
    """One damage: what was done to which file of a copy, which stage reads it, and whether no hash tells of it."""

    damage: str
    file: str
    command: str
    sealed: bool


@dataclass(frozen=True)
class Report:
    """How a damage ended, and what was wrong with that, if anything."""

    done: Done
    outcome: Outcome
    fault: str


@contextlib.contextmanager
def damaged_copy(reference: Path, situation: Situation, dice: random.Random) -> Iterator[tuple[Path, Done]]:
    """A copy of all artefacts, by hard links, in which one of them is damaged."""
    with tempfile.TemporaryDirectory(dir=reference.parent) as name:
        scratch = Path(name) / "copy"
        shutil.copytree(reference, scratch, copy_function=os.link)
        for gone in situation.gone:
            shutil.rmtree(scratch / gone) if (scratch / gone).is_dir() else (scratch / gone).unlink()
        if not situation.files.startswith("material.npz.c"):
            (scratch / "material.npz.checkpoint").unlink(missing_ok=True)
        if situation.files.startswith(UNFINISHED):
            (scratch / UNFINISHED).rename(scratch / "conditions")
        path = chosen_file(scratch, situation, dice)
        what, sealed = damages.damage(path, scratch, reference, dice)
        yield scratch, Done(what, str(path.relative_to(scratch)), situation.command, sealed)


def what_is_read(folder: Path, command: str) -> dict[str, bytes]:
    """All that a stage reads of the artefacts before it. Raises: ArtifactError."""
    mesh = load_npz(folder / "prep.npz", PREP)
    if command == "distill":
        views = Views(folder / "conditions")
        surfaces = {f"{v}": views.surface(v, np.arange(len(views.pixels(v)))).points.numpy().tobytes() for v in views.seen}
        keys = [(view, light) for view in views.seen for light in range(len(views.environments))]
        return surfaces | {f"{key}": views.read_transport(key).packed().numpy().tobytes() for key in keys}
    if command == "bake":
        made = load_npz(folder / "material.npz", MATERIAL)
        learnt = LearntMaterial.of(folder / "material.npz", made)
        survey, residual = learnt.lookup.survey.to_arrays(), learnt.residual.to_arrays()
        known = {name: array.tobytes() for name, array in {**survey, **residual}.items()}
        return known | {"recipe": json.dumps(learnt.recipe.to_json()).encode()}
    return {name: array.tobytes() for name, array in mesh.arrays.items()}


def fault_of(outcome: Outcome, scratch: Path, reference: Path, situation: Situation, done: Done) -> str:
    """What a run should not have done, or nothing. A folder may stand where a file is to be written: code 5."""
    lines = outcome.stderr.strip().splitlines()
    if outcome.code not in ((0, 4, 5) if done.damage == damages.FOLDER else (0, 4)):
        return f"code {outcome.code}: {lines[-1] if lines else ''}"
    if len(lines) != (outcome.code != 0) or not all(line.startswith("error: ") for line in lines):
        return f"{len(lines)} lines with code {outcome.code}: {lines[0]}"
    if outcome.seconds > SECONDS or outcome.memory > GIBIBYTES:
        return f"{outcome.seconds:.1f} s, {outcome.memory:.2f} GiB"
    if outcome.code != 0 or not situation.result or done.sealed:
        return ""
    same = results(scratch, situation.result) == results(reference, situation.result)
    return "" if same else "code 0, but another result"


def damage_one(reference: Path, number: int, seed: int) -> Report:
    """Damage one artefact of a copy, and run the stage that reads it."""
    situation = SITUATIONS[number % len(SITUATIONS)]
    with damaged_copy(reference, situation, random.Random(seed * 1_000_003 + number)) as (scratch, done):
        outcome = run(commands(scratch, STEPS)[situation.command], number % ALONE == ALONE - 1)
        fault = fault_of(outcome, scratch, reference, situation, done)
        return Report(done, outcome, fault.replace(str(scratch), ""))


def chosen_file(scratch: Path, situation: Situation, dice: random.Random) -> Path:
    """One of the files that may be damaged, every name as likely as the other, however many views have it."""
    files = sorted(p for p in scratch.glob(situation.files.replace(UNFINISHED, "conditions")) if p.is_file())
    name = dice.choice(sorted({p.name for p in files}))
    return dice.choice([p for p in files if p.name == name])


def read_one(reference: Path, number: int, seed: int, expected: dict[str, dict[str, bytes]]) -> tuple[Done, str, str]:
    """Damage one artefact of a copy, and read all that the stage after it reads, in this process.

    Args:
        expected: what is read of the undamaged artefacts, by stage.
    Returns:
        what was done; "read" or "refused"; what was wrong with that, if anything.
    """
    dice = random.Random(seed * 1_000_003 + number)
    with damaged_copy(reference, READ[number % len(READ)], dice) as (scratch, done):
        try:
            same = what_is_read(scratch, done.command) == expected[done.command]
            return done, "read", "" if same or done.sealed else f"{done} is read as something else"
        except ArtifactError as error:
            return done, "refused", "" if len(str(error).splitlines()) == 1 else f"{done}: {error}"
        except Exception as error:
            return done, "raised", f"{done}: {error!r}"


def read_all(reference: Path, count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """So many damages by `read_one`. Returns: how many were read and refused; what was wrong."""
    expected = {command: what_is_read(reference, command) for command in ("conditions", "distill", "bake")}
    ends = [read_one(reference, number, seed, expected) for number in range(count)]
    return Counter(end for _, end, _ in ends), [fault for _, _, fault in ends if fault]


# ---------------------------------------------------------------------------------------------------- kills


def killed(reference: Path, folder: Path, count: int, seed: int, tell: Callable[[str], None]) -> list[str]:
    """Kill each stage a few times in a row at random moments, and then let it end. Returns: what then differed."""
    dice, faults, done = random.Random(seed), [], 0
    left = (UNFINISHED, "material.npz.checkpoint")
    expected = {name: digest for name, digest in fingerprint(reference).items() if not name.startswith(left)}
    while done < count:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        shutil.copy(reference / "mesh.obj", folder)
        for name, arguments in commands(folder, STEPS).items():
            for _ in range(IN_A_ROW):
                how, seconds = dice.choice((signal.SIGKILL, signal.SIGINT, signal.SIGTERM)), dice.expovariate(1 / TYPICAL[name])
                ended = run(arguments, kill=(seconds, how))
                done += ended.code != 0
                tell(f"kill {done}: {name}, {how.name} after {ended.seconds:.2f} s of CPU, code {ended.code}")
                if ended.code not in (0, 130, -how):
                    faults.append(f"{name} after {how.name}: code {ended.code}, {ended.stderr}")
            ended = run(arguments)
            if ended.code != 0:
                faults.append(f"{name}, killed and run again: code {ended.code}, {ended.stderr}")
        found = fingerprint(folder)
        faults += [f"{name} differs" for name in expected.keys() | found.keys() if expected.get(name) != found.get(name)]
    return faults


IN_A_ROW = 3

TYPICAL = {"prep": 0.2, "conditions": 1.5, "distill": 3.0, "bake": 1.5}
"""Seconds of CPU time after which a stage is killed, on average."""


def main() -> int:
    """Run the campaign. Returns: the number of faults."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--reads", type=int, default=1000, help="damages of which what a stage reads is read")
    parser.add_argument("--damages", type=int, default=100, help="damages with which the whole stage runs")
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--folder", type=Path, help="where the undamaged artefacts are, or are made and kept")
    chosen = parser.parse_args()
    warm_up()
    with tempfile.TemporaryDirectory() as name:
        folder = chosen.folder or Path(name)
        reference = folder / "reference"
        if not reference.exists():
            build(reference)
        ends, faults = read_all(reference, chosen.reads, chosen.seed)
        print(f"{chosen.reads} damages read: {dict(ends)}", flush=True)
        reports = [damage_one(reference, number, chosen.seed) for number in range(chosen.damages)]
        faults += [f"{report.done}: {report.fault}" for report in reports if report.fault]
        codes = Counter(report.outcome.code for report in reports)
        most = [max((getattr(report.outcome, what) for report in reports), default=0) for what in ("seconds", "memory")]
        print(f"{chosen.damages} damages run: {dict(codes)}, at most {most[0]:.1f} s of CPU, {most[1]:.2f} GiB", flush=True)
        faults += killed(reference, folder / "killed", chosen.kills, chosen.seed, lambda line: print(line, flush=True))
        print(f"{chosen.kills} kills")
    print("\n".join(faults) or "no faults")
    return len(faults)


if __name__ == "__main__":
    sys.exit(min(main(), 100))
