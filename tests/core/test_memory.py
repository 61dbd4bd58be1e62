"""Memory is kept while that is asked for, and given back after."""

import ctypes
import resource
import sys

import numpy as np
import pytest

from stages.core.memory import kept

COUNT = 8_000_000


def new_pages() -> int:
    """Pages that the system hands out for a large array that is made and freed."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    np.full(COUNT, 1.0)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before


@pytest.mark.skipif(
    not sys.platform.startswith("linux") or not hasattr(ctypes.CDLL(None), "mallopt"), reason="the C library is not glibc"
)
def test_memory_is_kept_and_given_back() -> None:
    before = new_pages()
    with kept():
        new_pages()
        assert new_pages() < 0.1 * before
    assert new_pages() > 0.5 * before


def test_an_error_gives_it_back_too() -> None:
    with pytest.raises(ValueError, match="wrong"), kept():
        raise ValueError("wrong")
