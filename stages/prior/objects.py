"""Things by name: how large they are, and what everybody knows that they are made of (things.tsv)."""

from pathlib import Path
from typing import NamedTuple


class Thing(NamedTuple):
    """metres: its longest edge. made: words for what it is made of when nobody says."""

    metres: float
    made: str


def rows(name: str) -> list[list[str]]:
    """The columns of each line of a table of this folder; lines that begin with # say what they are."""
    lines = (Path(__file__).parent / name).read_text(encoding="utf-8").splitlines()
    return [line.split("\t") for line in lines if line and not line.startswith("#")]


def words(text: str) -> list[str]:
    """What commas separate, as prompts are read: "ship wheel"."""
    return [word.strip().replace("'s ", " ") for word in text.split(",") if word.strip()]


OBJECTS = {name: Thing(float(metres), made) for metres, made, names in rows("things.tsv") for name in words(names)}
