"""Outgoing radiance from light transport: exact in albedo and metallic, interpolated in roughness.

With transport E, A(r), B(r) of one pixel and one environment (see `stages.light.transport`):

    radiance = (1 - m) c E + (F0 (1 - m) + m c) A(r) + B(r),   F0 = 0.04

A and B are stored at the roughness `KNOTS`. Between them, what is interpolated is the logarithm of A and B relative to
the albedo of an open point (`core.albedo`), by a cubic spline over the logarithm of the roughness: exact in a white furnace,
and right for a small lamp too, whose reflection spreads as a power of the roughness.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.core.albedo import specular_albedo
from stages.core.knots import F0, KNOTS, LIGHT_MAPS


@dataclass(frozen=True)
class Transport:
    """Light transport of P points under one environment.

    E: (P, 3) diffuse. A, B: (P, K, 3) specular at `KNOTS`. Linear radiance per unit reflectance.
    cosine: (P,) N·V in (0, 1].
    """

    E: Tensor
    A: Tensor
    B: Tensor
    cosine: Tensor

    def __getitem__(self, index: Tensor | slice) -> "Transport":
        return Transport(self.E[index], self.A[index], self.B[index], self.cosine[index])

    def to(self, *args: Any, **kwargs: Any) -> "Transport":
        """Every tensor moved or cast as `Tensor.to` does."""
        return Transport(*(t.to(*args, **kwargs) for t in (self.E, self.A, self.B, self.cosine)))

    def split(self, counts: list[int]) -> list["Transport"]:
        """As `Tensor.split`: consecutive points, so many each."""
        parts = (t.split(counts) for t in (self.E, self.A, self.B, self.cosine))
        return [Transport(*some) for some in zip(*parts, strict=True)]

    def packed(self) -> Tensor:
        """All values of a point in one row: (P, WIDTH), the order of `unpack`."""
        return torch.cat([self.E, self.A.flatten(1), self.B.flatten(1), self.cosine[:, None]], 1)

    @staticmethod
    def unpack(rows: Tensor) -> "Transport":
        """The transport whose rows `packed` made. Args: (P, WIDTH)."""
        E, A, B, cosine = rows.split([3, 3 * len(KNOTS), 3 * len(KNOTS), 1], 1)
        return Transport(E, A.unflatten(1, (-1, 3)), B.unflatten(1, (-1, 3)), cosine[:, 0])


WIDTH = 3 + 6 * len(KNOTS) + 1
"""Values of a point in packed form."""

DARK = 0.01
"""Relative A and B are raised by this share of the roughest knot's before the logarithm is taken: black is not minus
infinity."""

TINY = 6e-5
"""The least of that: the smallest normal number that is stored."""

SOFTEN = 0.1
"""The spline runs over log(roughness + SOFTEN), in which a lamp's reflection bends alike everywhere; 0 must not be far away."""

BULGE = 1.0
"""A slope of the spline is bounded by three times its interval's, between which slopes a cubic does not overshoot (Fritsch &
Carlson 1980), and this much of the logarithm more. Lamps keep within it; a mirror's light beside a dark lobe does not."""

LEAST_ALBEDO = 1e-4
"""Under this an open point's albedo is no scale to interpolate by (B, seen head-on); B itself is interpolated there."""


@dataclass(frozen=True)
class Material:
    """Metallic-roughness material of P points: albedo (P, 3), roughness (P,), metallic (P,), each in [0, 1]."""

    albedo: Tensor
    roughness: Tensor
    metallic: Tensor

    @staticmethod
    def of(columns: Tensor) -> "Material":
        """The material of columns (P, 5): albedo, roughness, metallic."""
        return Material(columns[:, :3], columns[:, 3], columns[:, 4])

    def columns(self) -> Tensor:
        """Albedo, roughness and metallic as (P, 5). Differentiable in: all three."""
        return torch.cat([self.albedo, self.roughness[:, None], self.metallic[:, None]], 1)


def shade(transport: Transport, material: Material) -> Tensor:
    """Outgoing radiance of P points, each under L lights.

    Args:
        transport: P L rows, all lights of a point after each other; L is 1 where there are as many rows as points.
    Returns:
        (P L, 3) linear. Differentiable in: albedo, roughness (once, everywhere), metallic.
    """
    inputs = (material.albedo, material.roughness, material.metallic)
    if all(t.device.type == "cpu" and t.dtype == torch.float32 for t in inputs):
        return _KernelShading.apply(transport, *inputs)
    return shade_reference(transport, material)


def shade_reference(transport: Transport, material: Material) -> Tensor:
    """`shade` in plain torch, for any device and dtype. Differentiable in: as `shade`."""
    lights = len(transport.E) // max(len(material.roughness), 1)
    c, r, m = (t.repeat_interleave(lights, 0) for t in (material.albedo, material.roughness, material.metallic))
    A, B = interpolate(transport, r)
    m = m[:, None]
    return (1 - m) * c * transport.E + (F0 * (1 - m) + m * c) * A + B


@dataclass(frozen=True)
class Derivatives:
    """Of the radiance (P L, 3), channel by channel: by the albedo of that channel, by roughness and by metallic."""

    albedo: Tensor
    roughness: Tensor
    metallic: Tensor


def derivatives(transport: Transport, material: Material) -> Derivatives:
    """Derivatives of `shade` by the material; arguments as there. Not differentiable."""
    c, r, m = (t.detach() for t in (material.albedo, material.roughness, material.metallic))
    lights = len(transport.E) // max(len(r), 1)
    if all(t.device.type == "cpu" and t.dtype == torch.float32 for t in (c, r, m)):
        A, by_roughness = _KernelShading.run(transport, c, r, m)[1:]
        c, m = c.repeat_interleave(lights, 0), m.repeat_interleave(lights)[:, None]
    else:
        c, r, m = c.repeat_interleave(lights, 0), r.repeat_interleave(lights), m.repeat_interleave(lights)[:, None]
        r.requires_grad_()
        A, B = interpolate(transport, r)
        specular = (F0 * (1 - m) + m * c) * A + B
        by_roughness = torch.stack([torch.autograd.grad(s.sum(), r, retain_graph=True)[0] for s in specular.unbind(1)], 1)
        A = A.detach()
    return Derivatives((1 - m) * transport.E + m * A, by_roughness, (c - F0) * A - c * transport.E)


class _KernelShading(torch.autograd.Function):
    """`shade_reference` on the CPU in float32, compiled."""

    @staticmethod
    def forward(  # type: ignore[override]
        ctx: Any, transport: Transport, albedo: Tensor, roughness: Tensor, metallic: Tensor
    ) -> Tensor:
        radiance, A, by_roughness = _KernelShading.run(transport, albedo, roughness, metallic)
        material = tuple(t.detach().numpy() for t in (albedo, roughness, metallic))
        ctx.saved = (transport.E.float().contiguous().numpy(), A.numpy(), by_roughness.numpy(), material)
        return radiance

    @staticmethod
    def run(transport: Transport, *material: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Radiance, interpolated A, and d radiance / d roughness: (P L, 3) each."""
        from stages.core import shading_kernels  # compiled code is loaded on first use

        light = tuple(t.float().contiguous().numpy() for t in (transport.E, transport.A, transport.B, transport.cosine))
        values = tuple(t.detach().contiguous().numpy() for t in material)
        constants = F0, LEAST_ALBEDO, DARK, TINY, SOFTEN, BULGE
        out = shading_kernels.shade(light, values, KNOTS, spline_slopes(KNOTS), constants)  # type: ignore[arg-type]
        a, b, c = map(torch.from_numpy, out)
        return a, b, c

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[None, Tensor, Tensor, Tensor]:  # type: ignore[override]
        from stages.core import shading_kernels

        E, A, by_roughness, material = ctx.saved
        gradients = shading_kernels.shade_backward(gradient.numpy(), E, A, by_roughness, material, F0)
        c, r, m = (torch.from_numpy(g) for g in gradients)
        return None, c, r, m


def interpolate(
    transport: Transport, roughness: Tensor, kept: Sequence[int] = range(len(KNOTS))
) -> tuple[Tensor, Tensor]:
    """A and B at the given roughness, from the knots of the given numbers.

    A cubic spline of log(y + DARK y_last), smooth to its second derivative wherever `BULGE` leaves it alone.

    Args:
        roughness: (P,) in [0, 1].
    Returns:
        (P, 3) each. Differentiable in: roughness.
    """
    place, last = list(kept), len(kept) - 1
    knots = torch.tensor([KNOTS[k] for k in place], dtype=roughness.dtype, device=roughness.device)
    slopes = torch.tensor(spline_slopes(tuple(KNOTS[k] for k in place)), dtype=roughness.dtype, device=roughness.device)
    left = torch.searchsorted(knots, roughness.detach().contiguous(), right=True).sub(1).clamp(0, last - 1)  # (P,)
    stored = torch.cat([transport.A[:, place], transport.B[:, place]], -1).to(roughness.dtype)  # (P, K, 6)
    scale = _knot_albedo(transport.cosine.to(roughness.dtype))[:, place].repeat_interleave(3, -1)
    relative = (stored / scale).clamp(min=0)
    dark = DARK * relative[:, -1] + TINY  # (P, 6)
    y = torch.log(relative + dark[:, None])
    slope = slopes @ y
    row, bent = torch.arange(len(roughness), device=roughness.device), torch.log(knots + SOFTEN)
    h = (bent[left + 1] - bent[left])[:, None]
    x = (torch.log(roughness + SOFTEN) - bent[left])[:, None] / h
    rise = y[row, left + 1] - y[row, left]
    least, most = 3 * rise.clamp(max=0) - BULGE, 3 * rise.clamp(min=0) + BULGE
    head, tail = ((h * slope[row, left + k]).clamp(least, most) for k in (0, 1))
    spline = y[row, left] + rise * x * x * (3 - 2 * x) + head * x * (1 - x) ** 2 - tail * x * x * (1 - x)
    relative = (torch.exp(spline) - dark).clamp(min=0)  # beside a steep fall the spline dips under black
    albedo = specular_albedo(roughness, transport.cosine.to(roughness.dtype)).clamp(min=LEAST_ALBEDO)
    A, B = (relative * albedo.repeat_interleave(3, -1)).split(3, -1)
    return A, B


@functools.lru_cache(maxsize=4)
def spline_slopes(knots: tuple[float, ...]) -> NDArray[np.float64]:
    """What a spline's slopes at its knots are made of: slopes = result @ values, by log(roughness + SOFTEN). (K, K).

    The third derivative is continuous at the last knots but one ("not a knot").
    """
    from scipy.interpolate import CubicSpline  # takes half a second, which who does not shade need not spend

    x = np.log(np.array(knots) + SOFTEN)
    return CubicSpline(x, np.eye(len(x)))(x, 1)


def _knot_albedo(cosine: Tensor) -> Tensor:
    """Open-point albedo of A and B at every knot. Args: (P,). Returns: (P, K, 2), positive."""
    albedo = [specular_albedo(torch.full_like(cosine, r), cosine) for r in KNOTS]
    return torch.stack(albedo, 1).clamp(min=LEAST_ALBEDO)


def light_maps(transport: Transport) -> Tensor:
    """The six light maps that condition a diffusion model: white albedo, metallic and roughness of `LIGHT_MAPS`.

    Returns:
        (P, 6, 3) linear radiance.
    """
    maps = []
    for m, r in LIGHT_MAPS:
        k = KNOTS.index(r)
        A, B = transport.A[:, k], transport.B[:, k]
        maps.append(A + B if m else transport.E + F0 * A + B)
    return torch.stack(maps, 1)
