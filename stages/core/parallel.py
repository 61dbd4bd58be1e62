"""Compiled kernels, and the cores and threads that they run on.

Kernels release Python's lock, so ordinary threads run them side by side, each on its own rows: no atomic, no order
that depends on timing, the same bytes on any number of cores. A thread without work sleeps: pools that spin while they wait
(OpenMP's, which torch uses) gain little for one job and take the cores from all others.
"""

import contextlib
import functools
import math
import os
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def compiled(function: Callable[..., Any] | None = None, **options: Any) -> Callable[..., Any]:
    """Compile with numba; the machine code is cached where numba finds a folder to write.

    Args: options: of numba.njit, beside those that all kernels have; `@compiled` and `@compiled(inline="always")` both work.
    """
    import numba  # takes half a second, which who only wants threads need not spend

    if function is None:
        return functools.partial(compiled, **options)
    try:
        return numba.njit(nogil=True, cache=True, error_model="numpy", **options)(function)
    except RuntimeError:  # neither beside the code nor at home: compile in every process
        return numba.njit(nogil=True, error_model="numpy", **options)(function)


@functools.cache
def cores() -> int:
    """Processor cores that this process may use: those it is bound to, or fewer where a container's quota pays for fewer or
    OMP_NUM_THREADS asks for fewer, as engines do that share a machine out among jobs."""
    bound = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    asked = os.environ.get("OMP_NUM_THREADS", "")
    return max(1, math.ceil(min(bound, quota(), int(asked) if asked.isdecimal() else math.inf)))


def quota(root: Path = Path("/")) -> float:
    """Cores that the control groups of this process pay for, infinite where none limits them.

    Source: Linux, Documentation/admin-guide/cgroup-v2.rst ("cpu.max") and scheduler/sched-bwc.rst (cpu.cfs_quota_us). A group
    is bound by its parents, too; a container sees its own group as the root.
    """
    try:
        lines = (root / "proc/self/cgroup").read_text().splitlines()
    except OSError:  # not Linux
        return math.inf
    limits = [math.inf]
    for _, controllers, path in (line.split(":", 2) for line in lines):
        if not controllers:
            limits += [_share(folder / "cpu.max") for folder in _groups(root / "sys/fs/cgroup", path)]
        elif "cpu" in controllers.split(","):
            for folder in _groups(root / "sys/fs/cgroup" / controllers, path) + _groups(root / "sys/fs/cgroup/cpu", path):
                limits.append(_share(folder / "cpu.cfs_quota_us", folder / "cpu.cfs_period_us"))
    return min(limits)


def _groups(mount: Path, path: str) -> list[Path]:
    """The folder of a control group and those of its parents."""
    folder = mount / path.strip("/")
    return [folder, *(parent for parent in folder.parents if parent.is_relative_to(mount))]


def _share(*files: Path) -> float:
    """Quota over period, which one file holds or two. Infinite where there is none."""
    try:
        allowed, period = map(float, " ".join(file.read_text() for file in files).split())
    except (OSError, ValueError):  # no such file, or "max"
        return math.inf
    return allowed / period if allowed > 0 and period > 0 else math.inf


_thread = threading.local()
"""working: set in threads that are one of several already, which start no others."""


def in_parallel(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Apply a function that releases Python's lock to each item, one thread a core. Returns: the results, in order."""
    items = list(items)
    if cores() < 2 or len(items) < 2 or getattr(_thread, "working", False):
        return [function(item) for item in items]
    return list(_pool(cores()).map(function, items))


def ahead(make: Callable[[int], Result], numbers: range) -> Iterator[Result]:
    """make(i) of each number, each made on another thread while its forerunner is used."""
    with ThreadPoolExecutor(1) as pool:
        coming = [pool.submit(make, i) for i in numbers[:1]]
        for i in numbers:
            found = coming.pop().result()
            if i != numbers[-1]:
                coming.append(pool.submit(make, i + numbers.step))
            yield found


@contextlib.contextmanager
def beside(function: Callable[[], Result]) -> Iterator[Future[Result]]:
    """Call a function on another thread while the block runs, and before it where there is but one core; done at its end.

    Yields: what it returns, once asked for.
    """
    made: Future[Result] = Future()
    if cores() < 2 or getattr(_thread, "working", False):
        made.set_result(function())
        yield made
        return
    with ThreadPoolExecutor(1, initializer=_begin) as pool:
        made = pool.submit(function)
        yield made
    made.result()


def slices(count: int, size: int) -> list[slice]:
    """Parts of range(count), none longer than `size`: the same on any number of cores."""
    return [slice(i, min(i + size, count)) for i in range(0, count, size)]


@functools.cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, initializer=_begin)


def _begin() -> None:
    _thread.working = True


def _forked() -> None:
    """A forked process has none of its parent's threads, and is one of several."""
    _pool.cache_clear()
    _begin()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forked)
