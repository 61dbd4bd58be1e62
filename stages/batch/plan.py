"""What a batch will cost: the laws of `costs` for every command still to run, at the speed that this machine has shown."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from pathlib import Path
from typing import Any

from stages.batch import costs
from stages.batch.costs import Need, recorded
from stages.batch.jobs import STAGES, Job
from stages.batch.summary import outputs, run_logs

NOTHING = Need(0.0, 0.0)


@dataclass(frozen=True)
class Plan:
    """Of each command: how often it is still to run, and what that needs; how often it has run. speed: CPU time on this machine
    as a multiple of the laws', by stage, from so many records."""

    left: dict[str, int]
    needs: dict[str, Need]
    done: dict[str, int]
    speed: dict[str, float]
    records: int

    @property
    def total(self) -> Need:
        """All that is left; of memory what the hungriest command takes."""
        return reduce(add, self.needs.values(), NOTHING)


def plan(jobs: Sequence[Job], needs: Callable[[Job, Path], dict[str, Need]], out: Path, others: Iterable[Path] = ()) -> Plan:
    """Count what is left of a batch.

    Args:
        needs: of a job, given its prep.npz. out: the batch's folder. others: folders below which there are more records.
    """
    runs = {path for job in jobs for path in run_logs(job, out).values()}
    runs |= {path for folder in others for path in folder.rglob("*run.json")}
    speed, records = speeds(map(recorded, sorted(runs)))
    left, done, sums = dict[str, int](), dict[str, int](), dict[str, Need]()
    seen = set[Path]()
    for job in jobs:
        there = outputs(job, out)
        wanted = needs(job, there["prep"])
        for stage, path in there.items():
            if path in seen:
                continue
            seen.add(path)
            kind = stage.split()[0]
            count = done if path.exists() or (there["bake"].exists() and kind in STAGES) else left
            count[kind] = count.get(kind, 0) + 1
            if count is left:
                sums[kind] = sums.get(kind, NOTHING) + wanted[kind].at(speed.get(kind, 1.0))
    return Plan(left, sums, done, speed, records)


def speeds(runs: Iterable[Mapping[str, Any]]) -> tuple[dict[str, float], int]:
    """Measured CPU time over the laws', by stage, and how many records tell of it."""
    sums: dict[str, list[float]] = {}
    count = 0
    for run in runs:
        known = law(run)
        if known is not None and "cpu_seconds" in run:
            stage, cpu = known
            pair = sums.setdefault(stage, [0.0, 0.0])
            pair[0], pair[1], count = pair[0] + run["cpu_seconds"], pair[1] + cpu - costs.START, count + 1
    return {stage: round(measured / said, 2) for stage, (measured, said) in sums.items()}, count


def law(run: Mapping[str, Any]) -> tuple[str, float] | None:
    """Of which stage a run.json is, and the CPU seconds that its law gives for it; None for another command's."""
    try:
        if "views_made" in run:
            size = (run["triangles"], run["views_made"], run["pixels"], run["environments"], run["quality"])
            return "conditions", costs.conditions(*size).cpu
        if "milliseconds_per_step" in run:
            return "distill", costs.distill(run["steps"] - run["resumed"], 1, 1, 1).cpu
        if "texels" in run:
            return "bake", costs.bake(run["triangles"], run["texels"]).cpu
        return ("prep", costs.prep(run["triangles"]).cpu) if "triangles" in run else None
    except (KeyError, TypeError):  # of an earlier version
        return None
