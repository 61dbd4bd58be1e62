"""Text in mesh files: whatever its encoding, as bytes of which the format's own words are ASCII."""

import json
import re
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

_NO_NUMBER = re.compile(rb"[-+]?(\d+\.#\w*|nan\S*)", re.IGNORECASE)  # 1.#IND, nan(ind): as compilers print it
_COMMENT = re.compile(rb"(^|\s)#")  # not the one in 1.#IND


def plain(data: bytes) -> bytes:
    """The same text without a byte order mark; UTF-16 and UTF-32, with one or without, become UTF-8."""
    encoding = json.detect_encoding(data[:4])
    if encoding == "utf-8-sig":
        return data[3:]
    return data if encoding == "utf-8" else data.decode(encoding, "replace").removeprefix("\ufeff").encode()


def name(raw: bytes) -> str:
    """A name as its writer saw it: UTF-8, or else the code page of Western Windows."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")


def uncommented(line: bytes) -> bytes:
    """A line up to the word that begins with #."""
    comment = _COMMENT.search(line) if b"#" in line else None
    return line[: comment.start()] if comment else line


def numbers(words: Sequence[bytes]) -> NDArray[np.float64]:
    """As many of the words as are numbers, up to the first that is none; what stands for not-a-number is NaN."""
    try:
        return np.array(words, dtype="S").astype(np.float64)
    except ValueError:
        return np.array([*_leading(words)], np.float64)


def _leading(words: Sequence[bytes]) -> Iterator[float]:
    for word in words:
        try:
            yield float(word)
        except ValueError:
            if not _NO_NUMBER.fullmatch(word):
                return
            yield float("nan")
