"""Compiled kernels and the threads they run on.

Kernels release Python's lock, so ordinary threads run them side by side, each on its own rows: no atomic, no order
that depends on timing, the same bytes on any number of cores.
"""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numba

Item = TypeVar("Item")
Result = TypeVar("Result")


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile with numba, without Python's lock; the machine code is cached where numba finds a folder to write."""
    try:
        return numba.njit(nogil=True, cache=True, error_model="numpy")(function)
    except RuntimeError:  # no folder for the cache: compile in every process
        return numba.njit(nogil=True, error_model="numpy")(function)


def cores() -> int:
    """Processor cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_parallel(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Apply a function that releases Python's lock to each item, one thread a core; results in the items' order."""
    with ThreadPoolExecutor(cores()) as pool:
        return list(pool.map(function, items))
