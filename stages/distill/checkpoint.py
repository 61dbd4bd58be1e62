"""The state of an unfinished run, kept beside its output so that the same command continues it.

Every step draws its random numbers from a generator made from seed and step number alone (`step_generator`), so there
is no random state to keep: parameters, moments and the number of the step are all of it, and a continued run ends in
the same bytes as an uninterrupted one.
"""

import contextlib
import signal
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from stages.core.artifact import Artifact, Field, Provenance, Schema, load_npz, save_npz
from stages.core.errors import ArtifactError
from stages.distill.moves import COLUMNS, Moves
from stages.distill.optimizer import RowAdam
from stages.material.residual import Residual

SECONDS = 60.0
"""Time between checkpoints."""

GRACE = 3.0
"""Seconds within which a second signal is taken for an echo of the first."""

_NETWORK = ("weights_0", "weights_1", "bias_0", "bias_1")
CHECKPOINT = Schema(
    "dreammat.distill.checkpoint",
    3,
    {
        "table": Field("f4", ("T", "C")),
        "m.table": Field("f4", ("T", "C")),
        "v.table": Field("f4", ("T", "C")),
        "count.table": Field("i4", ("T",)),
        "offsets": Field("f4", ("K", COLUMNS)),
        "m.offsets": Field("f4", ("K", COLUMNS)),
        "v.offsets": Field("f4", ("K", COLUMNS)),
        "count.offsets": Field("i4", ("K",)),
        **{name: Field("f4", (f"{name}.0", *(() if name.startswith("bias") else (f"{name}.1",)))) for name in _NETWORK},
        **{f"{kind}.{name}": Field("f4", (1, f"{name}.size")) for name in _NETWORK for kind in "mv"},
        **{f"count.{name}": Field("i4", (1,)) for name in _NETWORK},
        "loss": Field("f4", ("S",)),
        "seconds": Field("f8", ("S",)),
    },
)


@dataclass
class State:
    """A run between two steps: residual, moves of the recipe, optimiser, and of every step done its loss and the seconds since
    the start."""

    residual: Residual
    moves: Moves
    optimizer: RowAdam
    loss: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    def parameters(self) -> dict[str, nn.Parameter]:
        """All that is learnt, by name."""
        return {**dict(self.residual.named_parameters()), **dict(self.moves.named_parameters())}

    @property
    def step(self) -> int:
        """Steps done."""
        return len(self.loss)


def step_generator(seed: int, step: int) -> torch.Generator:
    """The random numbers of one step: a function of seed and step."""
    mixed = int(np.random.SeedSequence([seed, step]).generate_state(1, np.uint64)[0])
    return torch.Generator().manual_seed(mixed >> 1)


def checkpoint_path(out: Path) -> Path:
    """Where the state of an unfinished `out` lies."""
    return out.with_name(out.name + ".checkpoint")


def save(out: Path, state: State, request: Provenance) -> None:
    """Write the checkpoint, atomically."""
    curve: dict[str, NDArray] = {"loss": np.array(state.loss, np.float32), "seconds": np.array(state.seconds, np.float64)}
    learnt = {name: value.detach().cpu().numpy() for name, value in state.parameters().items()}
    arrays: dict[str, NDArray] = {**learnt, **state.optimizer.to_arrays(), **curve}
    save_npz(checkpoint_path(out), CHECKPOINT, arrays, request)


def resume(out: Path, state: State, request: Provenance) -> bool:
    """Bring `state` to where an interrupted run with the same request stood. Returns: whether there was one."""
    try:
        stored = load_npz(checkpoint_path(out), CHECKPOINT)
    except ArtifactError:
        return False
    if not stored.provenance.same_request(request) or not _fits(stored, state):
        return False
    with torch.no_grad():
        for name, parameter in state.parameters().items():
            parameter.copy_(torch.from_numpy(stored[name]))
    state.loss, state.seconds = stored["loss"].tolist(), stored["seconds"].tolist()
    state.optimizer.load_arrays(stored.arrays, state.step)
    return True


def _fits(stored: Artifact, state: State) -> bool:
    """Whether a checkpoint is of this residual and recipe, and its counts of steps can be counts."""
    shapes = all(stored[name].shape == tuple(p.shape) for name, p in state.parameters().items())
    counts = [array for name, array in stored.arrays.items() if name.startswith("count.")]
    return shapes and all(int(array.min()) >= 0 and int(array.max()) <= len(stored["loss"]) for array in counts)


@contextlib.contextmanager
def interruptions() -> Iterator[Callable[[], bool]]:
    """Within the block a first Ctrl-C or SIGTERM is only noted, so that a step can end; a later one acts at once.

    One that follows within `GRACE` is the same request: make and timeout signal a process and then its whole group.

    Yields: a function that tells whether one has come. Outside the main thread nothing is changed.
    """
    noted: list[float] = []
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return

    def note(number: int, frame: FrameType | None) -> None:
        if noted and time.monotonic() - noted[0] > GRACE:
            raise KeyboardInterrupt
        noted.append(time.monotonic())

    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: bool(noted)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
