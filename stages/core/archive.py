"""Reading the members of an NPZ file, in no more memory than the file has bytes.

What a damaged or hostile archive announces is checked against what its file can hold before anything is allocated.
dreammat writes its archives without compression, so every array has its own bytes in the file; a compressed member, in
which five megabytes may stand for as many gigabytes, is another program's work.
"""

import struct
import tokenize
import zipfile
from collections.abc import Collection
from pathlib import Path

from numpy.lib import format as npy
from numpy.typing import NDArray

UNREADABLE = (
    ValueError, TypeError, SyntaxError, EOFError, KeyError, OverflowError, NotImplementedError, RuntimeError,
    struct.error, tokenize.TokenError, zipfile.BadZipFile,
)  # fmt: skip
"""What zipfile and NumPy raise when they are given another kind of file, or a damaged one."""

_HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}


class ForeignMember(ValueError):
    """A member that dreammat does not write; the message says which and why."""


def read_member(path: Path, name: str) -> NDArray | None:
    """One array of an uncompressed NPZ file, or None when it has none of that name. Raises: as `read_members`."""
    with zipfile.ZipFile(path) as archive:
        entries = _checked(archive, path)
        return _read(archive, entries[name]) if name in entries else None


def read_members(path: Path, expected: Collection[str]) -> dict[str, NDArray]:
    """All arrays of an uncompressed NPZ file by name.

    Args:
        expected: the names that may occur.
    Raises: ForeignMember; OSError; one of UNREADABLE where it is no such file.
    """
    with zipfile.ZipFile(path) as archive:
        entries = _checked(archive, path)
        unknown = next((name for name in entries if name not in expected), None)
        if unknown is not None:
            raise ForeignMember(f"array '{unknown[:80]}' is not part of it")
        return {name: _read(archive, entry) for name, entry in entries.items()}


def _checked(archive: zipfile.ZipFile, path: Path) -> dict[str, zipfile.ZipInfo]:
    """The members by name, none of which stands for more than its own bytes of the file."""
    entries: dict[str, zipfile.ZipInfo] = {}
    for entry in archive.infolist():
        name = entry.filename.removesuffix(".npy")
        if name in entries:
            raise ForeignMember(f"array '{name[:80]}' is in it twice")
        if entry.compress_type != zipfile.ZIP_STORED:
            raise ForeignMember(f"array '{name[:80]}' is compressed, which dreammat's are not")
        entries[name] = entry
    announced, size = sum(entry.file_size for entry in entries.values()), path.stat().st_size
    if announced > size:
        raise ForeignMember(f"its arrays announce {announced} bytes, the file has {size}")
    return entries


def _read(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> NDArray:
    """One array, whose own header must call for exactly the bytes that it has."""
    with archive.open(entry) as stream:
        version = npy.read_magic(stream)
        if version not in _HEADERS:
            raise ForeignMember(f"'{entry.filename}' has NumPy's format {version[0]}.{version[1]}")
        shape, _, dtype = _HEADERS[version](stream)
        held = entry.file_size - stream.tell()
    needed = dtype.itemsize
    for extent in shape:
        needed *= extent
    if needed != held or min(shape, default=0) < 0:
        raise ForeignMember(f"'{entry.filename}' announces {needed} bytes of {dtype}, but has {held}")
    with archive.open(entry) as stream:
        return npy.read_array(stream, allow_pickle=False)
