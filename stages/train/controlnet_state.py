"""What changes while a ControlNet is trained, and the checkpoint it is kept in."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.core.artifact import (
    Artifact,
    Field,
    Provenance,
    Schema,
    load_npz,
    save_npz,
    write_manifest,
    write_text,
    written_atomically,
)
from stages.core.errors import ArtifactError

CURVE = ("step", "loss", "seconds")

CHECKPOINT = Schema(
    "dreammat.controlnet_checkpoint",
    1,
    {
        "parameters": Field("f4", ("N",)),
        "average": Field("f4", ("N",)),  # exponential moving average of the parameters
        "moment_1": Field("f4", ("N",)),
        "moment_2": Field("f4", ("N",)),
        "curve": Field("f8", ("S", len(CURVE))),
    },
)

TRAINED = Schema("dreammat.controlnet", 1, extra=("step",))
"""A folder in the layout of diffusers: config.json and WEIGHTS."""

WEIGHTS = "diffusion_pytorch_model.safetensors"

AVERAGE = 0.999
"""Share of the average that a step keeps, once there have been many."""


class State:
    """What changes in a run: ControlNet, optimiser, average, and the curve, one row for each step done."""

    def __init__(self, controlnet: Any, learning_rate: float) -> None:
        self.controlnet = controlnet
        self.parameters = list(controlnet.parameters())
        self.average = [p.detach().clone() for p in self.parameters]
        self.optimizer = torch.optim.AdamW(self.parameters, learning_rate)
        self.curve: list[tuple[float, ...]] = []

    @property
    def step(self) -> int:
        return len(self.curve)

    def follow(self) -> None:
        """Take the average one step further."""
        share = 1 - min(AVERAGE, self.step / (self.step + 10))
        with torch.no_grad():
            for average, parameter in zip(self.average, self.parameters, strict=True):
                average.lerp_(parameter, share)

    def exchange(self) -> None:
        """Let the network have the averaged weights, and keep its own as the average; twice undoes it."""
        for i, parameter in enumerate(self.parameters):
            self.average[i], parameter.data = parameter.data, self.average[i]

    def arrays(self) -> dict[str, NDArray]:
        """As a checkpoint's arrays."""
        moments = [self.optimizer.state[p] for p in self.parameters]
        rows = {
            "parameters": self.parameters,
            "average": self.average,
            "moment_1": [m["exp_avg"] for m in moments],
            "moment_2": [m["exp_avg_sq"] for m in moments],
        }
        return {name: _row(tensors) for name, tensors in rows.items()} | {"curve": np.array(self.curve)}

    def restore(self, stored: Artifact) -> None:
        """Go on from a checkpoint."""
        self.curve = [tuple(row) for row in stored["curve"].tolist()]
        names = ("parameters", "average", "moment_1", "moment_2")
        columns = [torch.from_numpy(stored[name]).split([p.numel() for p in self.parameters]) for name in names]
        for i, (parameter, rows) in enumerate(zip(self.parameters, zip(*columns, strict=True), strict=True)):
            value, average, first, second = (row.view_as(parameter).to(parameter.device) for row in rows)
            parameter.data.copy_(value)
            self.average[i] = average
            step = torch.tensor(float(self.step))
            self.optimizer.state[parameter] = {"step": step, "exp_avg": first, "exp_avg_sq": second}


def _row(tensors: Iterable[Tensor]) -> NDArray[np.float32]:
    return torch.cat([t.detach().cpu().flatten() for t in tensors]).numpy()


def load_checkpoint(path: Path, request: Provenance) -> Artifact | None:
    """The checkpoint of a run that was stopped, None where there is none. Raises: ArtifactError when it is of another run."""
    if not path.exists():
        return None
    stored = load_npz(path, CHECKPOINT)
    if not stored.provenance.same_request(request):
        raise ArtifactError(
            f"{path}: of a run with other pictures, base or options; give another -o, or --force to begin again here"
        )
    return stored


def save(state: State, out: Path, request: Provenance) -> None:
    """Write the averaged weights, the checkpoint and the curve."""
    from safetensors.torch import save_file

    folder = out / "controlnet"
    state.exchange()
    with written_atomically(folder / WEIGHTS) as temporary:
        weights = {name: w.detach().cpu().contiguous() for name, w in state.controlnet.state_dict().items()}
        save_file(weights, temporary, {"format": "pt"})
    state.exchange()
    trained = Provenance(request.options, request.seed, request.inputs, {"step": state.step})
    write_manifest(folder, TRAINED, trained, ["config.json", WEIGHTS])
    save_npz(out / "checkpoint.npz", CHECKPOINT, state.arrays(), request)
    lines = [",".join(CURVE), *(f"{int(step)},{loss:.6f},{seconds:.1f}" for step, loss, seconds in state.curve)]
    write_text(out / "curve.csv", "\n".join(lines) + "\n")
