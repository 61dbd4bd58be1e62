"""Packages that only some files need: imported when such a file comes, or named with the way to get them."""

from importlib import import_module
from pathlib import Path
from typing import Any

from stages.core.errors import InputError

_DISTRIBUTIONS = {"pxr": "usd-core"}


def package(module: str, extra: str, what: str, path: Path) -> Any:
    """The module that reads `what`. Raises: InputError, with the extra that installs it."""
    try:
        return import_module(module)
    except ImportError:
        raise missing(module, extra, what, path) from None


def missing(module: str, extra: str, what: str, path: Path) -> InputError:
    """What to say of a package that is not there."""
    name = _DISTRIBUTIONS.get(module.split(".")[0], module)
    return InputError(f'{path}: {what} needs {name}, not installed here; pip install ".[{extra}]"')
