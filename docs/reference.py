"""Writes the pages that follow from the code: exit-codes.md and map.md. `make docs` runs it; a test holds them up to date."""

import ast
from pathlib import Path

from dreammat_cli.main import INTERRUPTED
from stages.core import errors

HERE = Path(__file__).resolve().parent
STAGES = HERE.parent / "stages"


def pages() -> dict[str, str]:
    """Text of each page, by its file's name."""
    return {"exit-codes.md": exit_codes(), "map.md": map_of_the_house()}


def exit_codes() -> str:
    """What each exit code means, from the errors that end with it."""
    kinds = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, errors.DreammatError)]
    meanings = {
        0: "Done, or up to date.",
        2: "Wrong usage: an unknown option or value.",
        INTERRUPTED: "Interrupted by Ctrl-C or a signal; the same command continues where it stopped.",
    }
    meanings |= {kind.exit_code: (kind.__doc__ or "").strip() for kind in kinds if kind is not errors.DreammatError}
    rows = [f"| {code} | {meaning} |" for code, meaning in sorted(meanings.items())]
    head = "Every error is one line on stderr: the file, what was found, what was expected, what to do."
    return "\n".join(["# Exit codes", "", head, "", "| code | meaning |", "|---|---|", *rows]) + "\n"


def map_of_the_house() -> str:
    """Rooms with what they hold, and arrows to what each imports, as far as no other room brings it along."""
    uses = {room.parent.name: imported(room.parent) for room in sorted(STAGES.glob("*/__init__.py"))}
    rows = [f"| `{room}` | {holds(room)} |" for room in ordered(uses)]
    arrows = [f"    {room} --> {other}" for room in ordered(uses) for other in sorted(direct(room, uses))]
    head = "One folder of `stages/` is one room. `dreammat_cli/` has a file for each command, which parses, calls and prints."
    text = "An arrow means *imports*; what follows along arrows is left out. `tests/test_architecture.py` holds imports to it."
    table = ["| room | holds |", "|---|---|", *rows]
    diagram = ["```mermaid", "graph TD", *arrows, "```"]
    return "\n".join(["# Map of the house", "", head, "", *table, "", text, "", *diagram]) + "\n"


def imported(folder: Path) -> set[str]:
    """Other rooms that a room's files import."""
    nodes = [node for file in folder.rglob("*.py") for node in ast.walk(ast.parse(file.read_text()))]
    names = {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}
    return {name.split(".")[1] for name in names if name.startswith("stages.")} - {folder.name}


def reachable(room: str, uses: dict[str, set[str]]) -> set[str]:
    """All rooms that a room's imports lead to."""
    return uses[room].union(*(reachable(other, uses) for other in uses[room]))


def direct(room: str, uses: dict[str, set[str]]) -> set[str]:
    """The rooms that a room imports, less those which another of them leads to."""
    return uses[room] - set().union(*(reachable(other, uses) for other in uses[room]))


def ordered(uses: dict[str, set[str]]) -> list[str]:
    """Rooms, those that others stand on first."""
    return sorted(uses, key=lambda room: (len(reachable(room, uses)), room))


def holds(room: str) -> str:
    """The docstring of a room."""
    return ast.get_docstring(ast.parse((STAGES / room / "__init__.py").read_text())) or ""


if __name__ == "__main__":
    for file, text in pages().items():
        (HERE / file).write_text(text)
