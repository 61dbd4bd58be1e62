"""What is learnt on top of a recipe: a multiresolution hash grid and a small network, zero at the start.

material(p) = sigmoid(logit(recipe(p)) + residual(p)) for each of red, green, blue, roughness and metallic: see `combined`.

Sources: Müller et al. 2022, "Instant Neural Graphics Primitives", Section 3 (grid, hash, trilinear look-up);
Zhang et al. 2024, DreamMat, Section 3.1 (its sizes).

Points are world points, the object's box [-0.5, 0.5]³. A point outside is clamped to the box: it is constant
along each axis beyond it, and finite everywhere. Level l divides each axis into `resolution(l)` cells; a level whose
(resolution + 1)³ corners fit its share of the table is indexed directly, a finer one by Instant-NGP's hash.

`encode_reference` is the plain, differentiable look-up for any device and dtype. On the CPU in float32 the same is done by
`stages.material.residual_kernels`; a test holds the two together.
"""

import math
from dataclasses import asdict
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from stages.material.stored import FEATURES, HASH_PRIMES, MARGIN, OUTPUTS, ResidualConfig, StoredResidual

TABLE_SPREAD = 1e-4
"""Table entries start uniform in ± this. Source: Müller et al. 2022, Section 4."""

class Residual(nn.Module):
    """Logits to add at any point, next to 0 before the first step; parameters are float32 and start from `generator`.

    Differentiable in: its parameters. The table's gradient is a coalesced sparse tensor on the CPU path: call it
    once per step, on all points together. Not differentiable in the points on that path (see `encode_reference`).
    """

    def __init__(self, config: ResidualConfig, generator: torch.Generator) -> None:
        super().__init__()
        self.config = config
        self._layout = config.layout()
        rows, inputs = int(self._layout[:, 2].sum()), config.levels * FEATURES
        self.table = nn.Parameter(_uniform((rows, FEATURES), TABLE_SPREAD, generator))
        self.weights_0 = nn.Parameter(_uniform((config.hidden, inputs), math.sqrt(6 / inputs), generator))
        self.bias_0 = nn.Parameter(torch.zeros(config.hidden))
        self.weights_1 = nn.Parameter(_uniform((OUTPUTS, config.hidden), math.sqrt(3 / config.hidden), generator))
        self.bias_1 = nn.Parameter(torch.zeros(OUTPUTS))

    def forward(self, p: Tensor) -> Tensor:
        """Logits (N, 5) to add at points p (N, 3), world."""
        hidden = torch.relu(torch.addmm(self.bias_0[:, None], self.weights_0, self._encode(p)))
        return torch.addmm(self.bias_1[:, None], self.weights_1, hidden).T

    def _encode(self, p: Tensor) -> Tensor:
        if p.device.type == "cpu" and self.table.dtype == torch.float32:
            return _KernelEncoding.apply(p.float(), self.table, self._layout)
        return encode_reference(p, self.table, self._layout)

    def to_arrays(self) -> dict[str, NDArray[np.float32]]:
        """The parameters by name, as `stages.core.schemas.MATERIAL` wants them."""
        return {name: value.detach().cpu().numpy().copy() for name, value in self.named_parameters()}

    def stored(self) -> StoredResidual:
        """Its sizes and numbers."""
        return StoredResidual(self.config, self.to_arrays())

    @staticmethod
    def of(stored: StoredResidual) -> "Residual":
        """The residual that was stored; `stored` is its inverse."""
        made = Residual(stored.config, torch.Generator())
        with torch.no_grad():
            for name, parameter in made.named_parameters():
                parameter.copy_(torch.from_numpy(stored.arrays[name]))
        return made

    def config_dict(self) -> dict[str, Any]:
        """ResidualConfig as JSON types."""
        return asdict(self.config)


def combined(base: Tensor, residual: Tensor) -> Tensor:
    """A recipe's material and what was learnt on top: exactly the recipe where the residual is 0.

    Args:
        base: (P, 5) linear albedo, roughness and metallic in [0, 1]. residual: (P, 5) logits.
    Returns:
        (P, 5) in [0, 1]. Differentiable in: residual.
    """
    inside = base.clamp(MARGIN, 1 - MARGIN)
    moved = base + torch.sigmoid(torch.logit(inside) + residual) - inside
    return moved + (moved.clamp(0.0, 1.0) - moved).detach()  # its slope is kept beyond the ends, so that it finds back


def _uniform(shape: tuple[int, ...], limit: float, generator: torch.Generator) -> Tensor:
    return torch.empty(shape).uniform_(-limit, limit, generator=generator)


def encode_reference(p: Tensor, table: Tensor, layout: NDArray[np.int64]) -> Tensor:
    """Features of points: at each level the trilinear mean of the eight corners of the cell a point lies in.

    Args:
        p: (N, 3) world, clamped to the box. table: (T, 2). layout: of `ResidualConfig.layout`.
    Returns:
        (levels * 2, N), coarse to fine. Differentiable in: table; p, where inside the box and not on a cell border.
    """
    u = (p + 0.5).clamp(0.0, 1.0)
    return torch.cat([_encode_level(u, table[start : start + rows], int(n)) for n, start, rows in layout])


def _encode_level(u: Tensor, table: Tensor, resolution: int) -> Tensor:
    """One level of `encode_reference`. Args: u (N, 3) in [0, 1]; table (rows, 2). Returns: (2, N)."""
    x = u * resolution
    cell = x.detach().floor().clamp(max=resolution - 1).long()  # (N, 3)
    t = x - cell
    corners = torch.tensor([[c & 1, c >> 1 & 1, c >> 2 & 1] for c in range(8)], device=u.device)
    at = cell[:, None] + corners  # (N, 8, 3)
    weight = torch.where(corners.bool(), t[:, None], 1 - t[:, None]).prod(-1)  # (N, 8)
    return (table[_row(at, resolution, len(table))] * weight[..., None]).sum(1).T


def _row(at: Tensor, resolution: int, rows: int) -> Tensor:
    """Row of a level's table for integer corners (..., 3): direct where all corners fit, hashed otherwise."""
    x, y, z = at.unbind(-1)
    if (resolution + 1) ** 3 <= rows:
        return x + (resolution + 1) * (y + (resolution + 1) * z)
    return (x * HASH_PRIMES[0] ^ y * HASH_PRIMES[1] ^ z * HASH_PRIMES[2]) & (rows - 1)


class _KernelEncoding(torch.autograd.Function):
    """`encode_reference` on the CPU in float32, with a sparse, coalesced gradient for the table."""

    @staticmethod
    def forward(ctx: Any, p: Tensor, table: Tensor, layout: NDArray[np.int64]) -> Tensor:  # type: ignore[override]
        from stages.material import residual_kernels  # compiled code is loaded on first use

        ctx.save_for_backward(p, table)
        ctx.layout = layout
        return torch.from_numpy(residual_kernels.encode(p.detach().numpy(), table.detach().numpy(), layout))

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[None, Tensor, None]:  # type: ignore[override]
        from stages.material import residual_kernels

        p, table = ctx.saved_tensors
        rows, values = residual_kernels.encode_backward(p.detach().numpy(), gradient.contiguous().numpy(), ctx.layout)
        sparse = torch.sparse_coo_tensor(
            torch.from_numpy(rows)[None], torch.from_numpy(values), table.shape, is_coalesced=True, check_invariants=False
        )
        return None, sparse, None
