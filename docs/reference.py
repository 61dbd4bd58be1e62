"""Writes the pages that follow from the code: exit-codes.md, errors.md and map.md. A test holds them up to date."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from dreammat_cli.main import INTERRUPTED
from stages.core import errors

HERE = Path(__file__).resolve().parent
STAGES = HERE.parent / "stages"

KINDS = {
    name: kind
    for name, kind in vars(errors).items()
    if isinstance(kind, type) and issubclass(kind, errors.DreammatError) and kind is not errors.DreammatError
}
"""The errors of users, by their names in the code."""


def pages() -> dict[str, str]:
    """Text of each page, by its file's name."""
    return {"exit-codes.md": exit_codes(), "errors.md": all_errors(), "map.md": map_of_the_house()}


def exit_codes() -> str:
    """What each exit code means, from the errors that end with it."""
    meanings = {
        0: "Done, or up to date.",
        2: "Wrong usage: an unknown option or value.",
        INTERRUPTED: "Interrupted by Ctrl-C or a signal; the same command continues where it stopped.",
    }
    meanings |= {kind.exit_code: (kind.__doc__ or "").strip() for kind in KINDS.values()}
    rows = [f"| {code} | {meaning} |" for code, meaning in sorted(meanings.items())]
    head = "Every [error](errors.md) is one line on stderr: the file, what was found, what was expected, what to do."
    return "\n".join(["# Exit codes", "", head, "", "| code | meaning |", "|---|---|", *rows]) + "\n"


def all_errors() -> str:
    """Every message that the code can end with, by exit code and room; what stands in for a value is in angle brackets."""
    head = "Every message that dreammat can end with, taken from its code. ⟨…⟩ stands for a name or a number of yours."
    lines = ["# Errors", "", head]
    found = sorted(set(messages()))
    for name, kind in KINDS.items():
        lines += ["", f"## {kind.exit_code}: {(kind.__doc__ or '').split(':')[0].strip().rstrip('.')}"]
        for room in sorted({where for which, where, _ in found if which == name}):
            lines += ["", f"In `{room}`:", ""]
            lines += [f"- `{text}`" for which, where, text in found if (which, where) == (name, room)]
    return "\n".join(lines) + "\n"


def messages() -> Iterator[tuple[str, str, str]]:
    """Kind, room and text of each error that the code raises in so many words."""
    for file in sorted(STAGES.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in KINDS and node.args:
                text = spoken(node.args[0])
                if re.search(r"\w+ \w+ \w+", re.sub("⟨[^⟩]*⟩", "", text)):
                    yield node.func.id, file.relative_to(STAGES).parts[0], text


def spoken(node: ast.expr) -> str:
    """A text as it is in the code, with ⟨names⟩ where it has values."""
    if isinstance(node, ast.Constant):
        return str(node.value).replace("`", "'")
    if isinstance(node, ast.JoinedStr):
        return "".join(spoken(part) for part in node.values)
    if isinstance(node, ast.FormattedValue):
        return f"⟨{(named(node.value) or '…').strip('_').replace('_', ' ').lower()}⟩"
    return ""


def named(node: ast.expr) -> str:
    """What a value is called: its last name, that of what a function is called with, or nothing."""
    if isinstance(node, ast.Attribute):
        return node.attr
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Call):
        within = [*node.args, node.func.value] if isinstance(node.func, ast.Attribute) else node.args
    else:
        within = [child for child in ast.iter_child_nodes(node) if isinstance(child, ast.expr)]
    return next((name for name in map(named, within) if name), "")


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
