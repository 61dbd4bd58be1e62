"""How far a run of several stages is, and how long the rest of it will take.

What a stage takes is foretold from its options, in seconds of the machine that docs/numbers.md measures. As soon as a stage has
counted some of its units, their pace tells how long it takes here; that of `conditions` also how fast this machine is.
"""

import time
from collections.abc import Mapping
from typing import Any

COUNTED = {"conditions": "views", "distill": "distill"}
"""What takes nearly all of a stage's time, of the stages that count it out."""

RAYS = {"draft": 0.6, "standard": 1.0, "high": 2.5}
"""How much longer views take."""

SLOWNESS = (0.3, 5.0)
"""Seconds here for a foretold one: what is believed of a machine."""


def foretold(stage: str, options: Mapping[str, Any]) -> float:
    """Seconds that a stage takes on the two cores of docs/numbers.md, the mesh being nothing unusual."""
    if stage == "conditions":
        return 1.2 * RAYS[options["quality"]] * options["views"] * (options["size"] / 256) ** 2
    if stage == "distill":
        return 6.0 + 0.1 * (options["steps"] or 60)
    if stage == "bake":
        return 11.0 + 27.0 * ((options["size"] or 2048) / 2048) ** 2
    return 7.0


class Whole:
    """A run of stages. seconds: what each is foretold to take, by its name, in their order."""

    def __init__(self, seconds: Mapping[str, float]) -> None:
        self.foretold = dict(seconds)
        self.seconds = dict(seconds)
        self.start = time.monotonic()
        self.slowness = 1.0
        self.stage = next(iter(seconds))
        self.begun = self.start
        self.first: tuple[float, int] | None = None
        """When the stage first told how many units it has, and how many were there already."""

    def begin(self, stage: str) -> str:
        """A stage begins. Returns: a line that says so."""
        self.stage, self.begun, self.first = stage, time.monotonic(), None
        return f"[{list(self.seconds).index(stage) + 1} of {len(self.seconds)}] {stage}, {told(self.left())} left in all"

    def heed(self, what: str, done: int, total: int) -> None:
        """Learn from the progress of the present stage what it takes."""
        if what != COUNTED.get(self.stage):
            return
        now = time.monotonic()
        start, before = self.first = self.first or (now, done)
        if done == before:
            return
        whole = now - self.begun + (now - start) / (done - before) * (total - done)
        if self.stage == "conditions":
            here = whole / (self.foretold[self.stage] * (total - before) / total)
            self.slowness = min(max(here, SLOWNESS[0]), SLOWNESS[1])
        self.seconds[self.stage] = whole / self.slowness

    def left(self) -> float:
        """Seconds to the end of the last stage."""
        names = list(self.seconds)
        later = sum(self.seconds[name] for name in names[names.index(self.stage) + 1 :])
        present = self.slowness * self.seconds[self.stage] - (time.monotonic() - self.begun)
        return max(present, 0.0) + self.slowness * later

    def elapsed(self) -> float:
        """Seconds since the run began."""
        return time.monotonic() - self.start


def told(seconds: float) -> str:
    """A span of time as people say it: "about 3 min"."""
    if seconds < 60:
        return f"about {max(10, 10 * round(seconds / 10))} s"
    minutes = round(seconds / 60)
    return f"about {minutes} min" if minutes < 120 else f"about {minutes / 60:.0f} h"
