"""Cores as a container, a quota and an affinity leave them; threads that keep order, do not nest, and survive a fork."""

import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from stages.core import parallel
from stages.core.parallel import ahead, beside, compiled, in_parallel, quota, slices


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


@pytest.mark.parametrize(
    "groups, files, expected",
    [
        ("0::/\n", {"cpu.max": "150000 100000"}, 1.5),  # a container sees its own group as the root
        ("0::/\n", {"cpu.max": "max 100000"}, math.inf),
        ("0::/user.slice/job\n", {"user.slice/job/cpu.max": "max 100000", "user.slice/cpu.max": "50000 100000"}, 0.5),
        ("0::/job\n", {"job/cpu.max": "300000 100000", "cpu.max": "800000 100000"}, 3),
        ("0::/../elsewhere\n", {}, math.inf),  # a group outside the namespace
        (
            "4:memory:/docker/1\n3:cpu,cpuacct:/docker/1\n",
            {"cpu,cpuacct/docker/1/cpu.cfs_quota_us": "200000", "cpu,cpuacct/docker/1/cpu.cfs_period_us": "100000"},
            2,
        ),
        ("3:cpu,cpuacct:/docker/1\n", {"cpu/cpu.cfs_quota_us": "50000", "cpu/cpu.cfs_period_us": "100000"}, 0.5),
        ("3:cpu:/\n0::/\n", {"cpu/cpu.cfs_quota_us": "-1", "cpu/cpu.cfs_period_us": "100000"}, math.inf),
        ("0::/\n", {"cpu.max": "no numbers"}, math.inf),
        ("0::/\n", {}, math.inf),
    ],
)
def test_quota(tmp_path: Path, groups: str, files: dict[str, str], expected: float) -> None:
    write(tmp_path / "proc/self/cgroup", groups)
    for name, text in files.items():
        write(tmp_path / "sys/fs/cgroup" / name, text + "\n")
    assert quota(tmp_path) == expected


def test_no_control_groups_no_quota(tmp_path: Path) -> None:
    assert quota(tmp_path) == math.inf


@pytest.mark.parametrize("paid, expected", [(math.inf, 4), (2.5, 3), (1.0, 1), (0.2, 1), (64.0, 4)])
def test_cores_are_the_bound_ones_that_are_paid_for(monkeypatch: pytest.MonkeyPatch, paid: float, expected: int) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {1, 3, 5, 7}, raising=False)
    monkeypatch.setattr(parallel, "quota", lambda: paid)
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    assert parallel.cores.__wrapped__() == expected
    for asked, at_most in {"2": 2, "9": 4, "2,1": 4, "0": 1, "": 4}.items():
        monkeypatch.setenv("OMP_NUM_THREADS", asked)
        assert parallel.cores.__wrapped__() == min(expected, at_most)


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="needs a system that binds processes to cores")
def test_a_process_bound_to_one_core_counts_one() -> None:
    one = min(os.sched_getaffinity(0))
    code = f"import os; os.sched_setaffinity(0, {{{one}}}); from stages.core.parallel import cores; print(cores())"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "1\n"


@pytest.fixture(params=[1, 3])
def threads(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    monkeypatch.setattr(parallel, "cores", lambda: request.param)
    yield request.param


def test_results_keep_the_order_of_the_items(threads: int) -> None:
    def late(i: int) -> int:
        time.sleep(0.002 * (5 - i))
        return i * i

    assert in_parallel(late, range(6)) == [0, 1, 4, 9, 16, 25] and in_parallel(late, []) == []


def test_a_task_that_starts_tasks_does_them_itself(threads: int) -> None:
    """A pool whose threads wait for each other never ends."""

    def outer(i: int) -> set[str]:
        return set(in_parallel(lambda j: threading.current_thread().name, range(4)))

    assert all(len(names) == 1 for names in in_parallel(outer, range(8)))


def test_an_error_in_a_task_comes_out(threads: int) -> None:
    with pytest.raises(ZeroDivisionError):
        in_parallel(lambda i: 1 // i, [1, 0, 2])


def test_beside_runs_while_the_block_does_where_there_are_cores(threads: int) -> None:
    entered = threading.Event()

    def makes() -> tuple[bool, set[str]]:
        nested = in_parallel(lambda _: threading.current_thread().name, range(3))
        return entered.wait(5.0 if threads > 1 else 0.0), set(nested)

    with beside(makes) as made:
        entered.set()
    met, names = made.result()
    assert met == (threads > 1) and len(names) == 1 if threads > 1 else not met


def test_an_error_beside_comes_out_at_the_end_of_the_block(threads: int) -> None:
    with pytest.raises(ZeroDivisionError), beside(lambda: 1 // 0):
        pass


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_a_forked_process_works_on_its_own_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel, "cores", lambda: 2)
    in_parallel(str, range(4))  # the threads of the pool, which the child does not have
    child = os.fork()
    if child == 0:
        os._exit(in_parallel(lambda i: threading.current_thread() is threading.main_thread(), range(4)).count(False))
    for _ in range(200):
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            break
        time.sleep(0.05)
    else:
        os.kill(child, 9)
        os.waitpid(child, 0)
        pytest.fail("the child waits for threads that it does not have")
    assert os.waitstatus_to_exitcode(status) == 0


def test_ahead_makes_one_thing_more_than_is_asked_for() -> None:
    made = []

    def make(i: int) -> int:
        made.append((i, threading.current_thread() is threading.main_thread()))
        return 10 * i

    asked = []
    for value in ahead(make, range(3, 6)):
        asked.append(value)
        assert len(made) <= len(asked) + 1
    assert asked == [30, 40, 50] and made == [(3, False), (4, False), (5, False)]
    assert list(ahead(make, range(0))) == []


def test_ahead_raises_what_its_thread_raised_where_its_turn_is() -> None:
    found = []
    with pytest.raises(ZeroDivisionError):
        for value in ahead(lambda i: 6 // (2 - i), range(5)):
            found.append(value)
    assert found == [3, 6]


@pytest.mark.parametrize("count", [0, 1, 4, 9])
def test_slices_cover_everything_once(count: int) -> None:
    parts = slices(count, 4)
    assert np.concatenate([np.arange(count)[part] for part in parts] + [np.zeros(0, int)]).tolist() == list(range(count))
    assert all(part.stop - part.start <= 4 for part in parts)


def test_a_kernel_compiles_where_no_folder_takes_its_code(monkeypatch: pytest.MonkeyPatch) -> None:
    import numba

    real = numba.njit

    def refuse(*args: object, **options: object) -> object:
        if options.get("cache"):
            raise RuntimeError("cannot cache function: no locator available")
        return real(*args, **options)

    monkeypatch.setattr(numba, "njit", refuse)
    assert compiled(lambda x: x + 1)(2) == 3
