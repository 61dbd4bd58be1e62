"""Running compiled kernels, which release the interpreter lock, on as many threads as torch uses."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

import torch


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads)


def run_parallel(task: Callable[..., Any], arguments: Iterable[tuple[Any, ...]]) -> list[Any]:
    """Call `task` on each tuple of arguments. Returns: the results, in order."""
    if torch.get_num_threads() < 2:
        return [task(*a) for a in arguments]
    return list(_pool(torch.get_num_threads()).map(lambda a: task(*a), arguments))


def slices(count: int, most: int) -> list[slice]:
    """Parts of range(count), one per thread or more, none longer than `most`."""
    step = max(1, min(most, -(-count // torch.get_num_threads())))
    return [slice(i, min(i + step, count)) for i in range(0, count, step)]
