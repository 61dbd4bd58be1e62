"""Names for files and for what other programs call things."""

import difflib
import re
from collections.abc import Iterable


def identifier(name: str) -> str:
    """A name as every target takes it: letters, digits and underscores, the first one no digit."""
    safe = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_") or "asset"
    return f"_{safe}" if safe[0].isdigit() else safe


def unique(names: list[str]) -> list[str]:
    """The same names, a number behind each that came before (whatever its case: some file systems know none)."""
    taken: set[str] = set()
    result = []
    for name in names:
        number, candidate = 2, name
        while candidate.lower() in taken:
            number, candidate = number + 1, f"{name}_{number}"
        taken.add(candidate.lower())
        result.append(candidate)
    return result


def guess(name: str, known: Iterable[str]) -> str:
    """What was probably meant by a name that nothing has, for an error to say: "did you mean 'seat'? ", or nothing."""
    called = {one.lower(): one for one in known}
    near = difflib.get_close_matches(name.lower(), called, 1)
    return f"did you mean '{called[near[0]]}'? " if near else ""
