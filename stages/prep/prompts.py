"""prompts.toml: what each object of a scene is made of, by name or pattern.

    chair = "a carved oak chair"
    "lamp_*" = "brushed brass"

Of several that fit an object the last counts. An object that none fits is not made; it only casts shadows.
"""

import fnmatch
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stages.core.artifact import reason
from stages.core.errors import InputError, one_line
from stages.core.naming import guess

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

LISTED = 12
"""Names that an error lists."""


def read_prompts(path: Path) -> dict[str, str]:
    """Prompts by name or pattern, in the file's order. Raises: InputError."""
    try:
        held = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: {reason(error)}; expected a file of lines such as chair = \"oak\"") from error
    except ValueError as error:
        raise InputError(f"{path}: not TOML ({one_line(error)}); expected lines such as chair = \"oak\"") from error
    for name, prompt in held.items():
        if isinstance(prompt, dict):
            raise InputError(f'{path}: {name} is a table; expected "NAME" = "prompt", names with dots in quotes')
        if not isinstance(prompt, str) or not prompt.strip():
            raise InputError(f'{path}: {name} is {prompt!r}; expected a prompt in quotes')
    if not held:
        raise InputError(f"{path}: holds no prompt; expected lines such as chair = \"oak\"")
    return held


def prompts_of(objects: Sequence[dict[str, Any]], prompts: dict[str, str], path: Path) -> dict[str, str]:
    """The prompt of each object that has one, by its name.

    Args:
        objects: {"name", "title"} of each.
    Raises: InputError that lists what there is, where a name fits none.
    """
    found: dict[str, str] = {}
    for pattern, prompt in prompts.items():
        called = _called(objects, pattern)
        if not called:
            names = [str(one["title"]) for one in objects]
            more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
            there = f"{guess(pattern, names)}expected {', '.join(names[:LISTED])}{more}"
            raise InputError(f"{path}: '{pattern}' names no object of the scene; {there}")
        found |= dict.fromkeys(called, prompt)
    return found


def _called(objects: Sequence[dict[str, Any]], pattern: str) -> list[str]:
    """Names of the objects that a name, pattern or number calls; upper and lower case are the same where none is exact."""
    wanted = pattern.removeprefix("object:")
    if wanted.startswith("#") and wanted[1:].isdigit():
        return [str(one["name"]) for number, one in enumerate(objects, 1) if number == int(wanted[1:])]
    for fits in (
        lambda name: name == wanted,
        lambda name: fnmatch.fnmatchcase(name, wanted),
        lambda name: fnmatch.fnmatchcase(name.lower(), wanted.lower()),
    ):
        found = [str(one["name"]) for one in objects if fits(str(one["title"])) or fits(str(one["name"]))]
        if found:
            return found
    return []
