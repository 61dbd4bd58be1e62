"""How a stage tells that it moves: it calls back, and knows nothing of terminals."""

from collections.abc import Callable

Progress = Callable[[str, int, int], None]
"""what is being done, units done, units in all (0 when unknown)"""


def silent(what: str, done: int, total: int) -> None:
    """Report nothing."""


Tell = Callable[[str], None]
"""takes a line for people"""


def untold(line: str) -> None:
    """Tell nobody."""
