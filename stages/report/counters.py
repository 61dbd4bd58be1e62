"""FLOPs and bytes of tensor programs, counted on the meta device, where nothing is computed and nothing takes memory."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_leaves
from torch.utils.flop_counter import FlopCounterMode


@dataclass(frozen=True)
class Cost:
    """flops: of matrix products, convolutions and attention, a multiply and an add being two. bytes: that operators read and
    write, each operator by itself; fused ones touch fewer."""

    flops: float
    bytes: float

    def __add__(self, other: "Cost") -> "Cost":
        return Cost(self.flops + other.flops, self.bytes + other.bytes)

    def __sub__(self, other: "Cost") -> "Cost":
        return Cost(self.flops - other.flops, self.bytes - other.bytes)


class _Bytes(TorchDispatchMode):
    """Sums the tensors that go into operators and come out of them; a view moves none."""

    def __init__(self) -> None:
        super().__init__()
        self.bytes = 0

    def __torch_dispatch__(self, func, types, args=(), kwargs=None):  # type: ignore[no-untyped-def]
        result = func(*args, **(kwargs or {}))
        if not func.is_view:
            tensors = [t for t in tree_leaves((args, kwargs, result)) if isinstance(t, Tensor)]
            self.bytes += sum(t.numel() * t.element_size() for t in tensors)
        return result


def count(program: Callable[[], Any]) -> Cost:
    """What a program of meta tensors costs, its backward pass included if it asks for one."""
    operators = _Bytes()
    with FlopCounterMode(display=False) as flops, operators:
        program()
    return Cost(float(flops.get_total_flops()), float(operators.bytes))


def peak_flops(device: torch.device, dtype: torch.dtype, size: int, repeats: int = 5) -> float:
    """FLOP/s of a square matrix product, the best of some."""
    a, b = (torch.randn(size, size, device=device, dtype=dtype) for _ in range(2))
    return 2 * size**3 / _fastest(lambda: a @ b, device, repeats)


def peak_bandwidth(device: torch.device, size: int, repeats: int = 5) -> float:
    """Bytes/s read and written by a copy of `size` bytes, the best of some."""
    source = torch.zeros(size // 4, device=device)
    target = torch.empty_like(source)
    return 2 * size / _fastest(lambda: target.copy_(source), device, repeats)


def _fastest(work: Callable[[], Any], device: torch.device, repeats: int) -> float:
    times = []
    work()
    for _ in range(repeats):
        clock = Stopwatch(device)
        work()
        times.append(clock.seconds())
    return min(times)


class Stopwatch:
    """Seconds since it was made, of what the device has then finished."""

    def __init__(self, device: torch.device) -> None:
        self._device = device
        self._start = self._now()

    def seconds(self) -> float:
        """Waits for the device."""
        return self._now() - self._start

    def _now(self) -> float:
        if self._device.type == "cuda":
            torch.cuda.synchronize(self._device)
        return time.perf_counter()
