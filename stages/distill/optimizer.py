"""Adam that touches only what has a gradient.

A step reaches a small part of the hash grid. As in tiny-cuda-nn's Adam, an entry without a gradient is left alone: its
moments do not decay, and its bias correction counts its own updates only. Here the unit is a row of the table (one
entry, all features), and a network parameter is one single row that has a gradient in every step.

Sources: Kingma & Ba 2015, "Adam", Algorithm 1; Müller et al. 2022, Section 4, and tiny-cuda-nn's adam.h.
"""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from stages.core.parallel import compiled, in_parallel, slices

BETAS = (0.9, 0.99)
EPS = 1e-15
ROWS_PER_TASK = 1 << 15


class RowAdam:
    """Adam over named parameters; moments and update counts are kept per row (see the module)."""

    def __init__(self, parameters: dict[str, nn.Parameter], tables: frozenset[str]) -> None:
        """Args: parameters: by name; tables: names of those that are updated row by row."""
        self._parameters, self._tables, self._steps = parameters, tables, 0
        self._rows = {
            name: parameter.detach() if name in tables else parameter.detach().view(1, -1)
            for name, parameter in parameters.items()
        }
        self._m = {name: torch.zeros_like(rows) for name, rows in self._rows.items()}
        self._v = {name: torch.zeros_like(rows) for name, rows in self._rows.items()}
        self._count = {
            name: torch.zeros(len(rows), dtype=torch.int32, device=rows.device) for name, rows in self._rows.items()
        }

    def step(self, learning_rate: float) -> None:
        """Update every row that has a gradient, and drop the gradients."""
        self._steps += 1
        rates = corrected_rates(learning_rate, self._steps)
        for name, parameter in self._parameters.items():
            if parameter.grad is None:
                continue
            rows, gradient = _rows_with_gradient(parameter.grad, name in self._tables)
            state = (self._rows[name], self._m[name], self._v[name], self._count[name])
            on_cpu = parameter.device.type == "cpu" and parameter.dtype == torch.float32
            (update_rows if on_cpu else update_rows_reference)(state, rows, gradient, rates)
            parameter.grad = None

    def to_arrays(self) -> dict[str, NDArray]:
        """Moments and counts by name, for a checkpoint; not copied."""
        kinds = {"m": self._m, "v": self._v, "count": self._count}
        return {f"{kind}.{name}": t.cpu().numpy() for kind, tensors in kinds.items() for name, t in tensors.items()}

    def load_arrays(self, arrays: dict[str, NDArray], steps: int) -> None:
        """Take back what `to_arrays` gave after a number of steps."""
        self._steps = steps
        for kind, tensors in {"m": self._m, "v": self._v, "count": self._count}.items():
            for name, tensor in tensors.items():
                tensor.copy_(torch.from_numpy(arrays[f"{kind}.{name}"]))


State = tuple[Tensor, Tensor, Tensor, Tensor]
"""Parameter, first and second moment (R, C), and updates so far (R,); changed in place."""


def corrected_rates(learning_rate: float, steps: int) -> Tensor:
    """Learning rate times Adam's bias correction for a row's k-th update: (steps + 1,) float32, 0 at k = 0."""
    k = torch.arange(1, steps + 1, dtype=torch.float64)
    rates = learning_rate * torch.sqrt(1 - BETAS[1] ** k) / (1 - BETAS[0] ** k)
    return torch.cat([torch.zeros(1, dtype=torch.float64), rates]).float()


def update_rows_reference(state: State, rows: Tensor, gradient: Tensor, rates: Tensor) -> None:
    """One Adam step on some rows. Args: rows (K,), each once; gradient (K, C); rates of `corrected_rates`."""
    parameter, m, v, count = state
    count[rows] += 1
    m[rows] = BETAS[0] * m[rows] + (1 - BETAS[0]) * gradient
    v[rows] = BETAS[1] * v[rows] + (1 - BETAS[1]) * gradient**2
    rate = rates.to(parameter)[count[rows].long(), None]
    parameter[rows] -= rate * m[rows] / (v[rows].sqrt() + EPS)


def update_rows(state: State, rows: Tensor, gradient: Tensor, rates: Tensor) -> None:
    """`update_rows_reference` on the CPU in float32, compiled."""
    arrays, chosen, values = tuple(tensor.numpy() for tensor in (*state, rates)), rows.numpy(), gradient.numpy()
    in_parallel(lambda part: _update(*arrays, chosen[part], values[part]), slices(len(chosen), ROWS_PER_TASK))


@compiled
def _update(parameter, m, v, count, rates, rows, gradient):  # type: ignore[no-untyped-def]
    beta1, beta2, eps = np.float32(BETAS[0]), np.float32(BETAS[1]), np.float32(EPS)
    one = np.float32(1.0)
    for i in range(len(rows)):
        row = rows[i]
        count[row] += 1
        rate = rates[count[row]]
        for c in range(gradient.shape[1]):
            g = gradient[i, c]
            m[row, c] = beta1 * m[row, c] + (one - beta1) * g
            v[row, c] = beta2 * v[row, c] + (one - beta2) * g * g
            parameter[row, c] -= rate * m[row, c] / (np.sqrt(v[row, c]) + eps)


def _rows_with_gradient(gradient: Tensor, table: bool) -> tuple[Tensor, Tensor]:
    """Rows (K,) that have a gradient, and it (K, C)."""
    if gradient.is_sparse:
        listed = gradient._indices()[0]
        if not bool((listed[1:] > listed[:-1]).all()):  # autograd forgets that the kernels list each row once, in order
            gradient = gradient.coalesce()
        return gradient._indices()[0], gradient._values()
    rows = gradient if table else gradient.reshape(1, -1)
    touched = (rows != 0).any(1).nonzero()[:, 0]
    return touched, rows[touched]
