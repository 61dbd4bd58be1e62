"""Files that another file names: where they lie, and that they are files."""

import re
from pathlib import Path
from urllib.parse import unquote

from stages.core.errors import InputError

_ELSEWHERE = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:|[/\\]|.*\0", re.DOTALL)


def beside(path: Path, uri: str) -> Path:
    """The file that a URI in `path` names, as glTF means it: relative to it, a regular file.

    Raises: InputError for an address, an absolute path, a folder, a device, or nothing.
    """
    name = unquote(uri)
    if _ELSEWHERE.match(name):
        raise InputError(f"{path}: its buffer or image '{uri[:80]}' is not relative to it; keep the file beside it")
    found = path.parent / name
    if not found.is_file():
        raise InputError(f"{path}: its buffer or image '{uri[:80]}': no such file; keep the file beside it")
    return found
