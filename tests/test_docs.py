"""The pages: what follows from the code is up to date, links lead somewhere, and commands are right as they are written."""

import importlib.util
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import click
import pytest
from click.testing import CliRunner

from dreammat_cli.main import cli
from tests.pages import PAGES, ROOT, blocks, make_world, run

WITHOUT_DRY_RUN = ("doctor", "completion", "report", "eval", "train")


def leaves(group: click.Group, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    """Every command that does something, and the words that call it."""
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if isinstance(command, click.Group):
            yield from leaves(command, (*path, name))
        elif command:
            yield (*path, name), command


def commands() -> list[tuple[str, str]]:
    """Every call of dreammat in the pages' shell blocks, and in the examples of each --help: (page, line)."""
    texts = {page.name: "\n".join(block.text for block in blocks(page) if block.language == "sh") for page in PAGES}
    texts |= {f"{' '.join(path)} --help": command.epilog or "" for path, command in leaves(cli)}
    lines = [(page, line.strip()) for page, text in texts.items() for line in text.replace("\\\n", " ").splitlines()]
    return [(page, line) for page, line in lines if line.startswith("dreammat ")]


@pytest.mark.parametrize(("page", "line"), commands())
def test_commands_are_right_as_they_are_written(page: str, line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    words = shlex.split(line, comments=True)[1:]
    last = "--help" if words[0] in WITHOUT_DRY_RUN else "--dry-run"
    result = CliRunner().invoke(cli, [*words, last])
    assert result.exit_code == 0, f"{page}: {line}\n{result.output}"


def test_there_are_commands() -> None:
    assert len([page for page, _ in commands() if page.endswith(".md")]) >= 25


@pytest.mark.parametrize(("path", "command"), [pytest.param(*leaf, id=" ".join(leaf[0])) for leaf in leaves(cli)])
def test_help_ends_with_examples_of_the_command(path: tuple[str, ...], command: click.Command) -> None:
    assert any(line.strip().startswith(" ".join(("dreammat", *path))) for line in (command.epilog or "").splitlines())


def test_a_page_runs_as_it_is_written(tmp_path: Path) -> None:
    """The cheapest one; `make pages` runs all."""
    done = run(ROOT / "docs/prompts.md", make_world(tmp_path / "world"), tmp_path / "page")
    assert done.returncode == 0, done.stdout[-3000:]
    assert "leather" in done.stdout and (tmp_path / "page/rock/albedo.png").is_file()


def test_the_pages_have_blocks_that_run() -> None:
    found = [block for page in PAGES for block in blocks(page)]
    assert sum(not block.why_not for block in found) >= 20 and sum(bool(block.why_not) for block in found) <= 12
    assert not [page.name for page in PAGES if re.search(r"^    (\$ )?(dreammat|make|pip) ", page.read_text(), re.M)]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text()):
        if not target.startswith("http"):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


@pytest.fixture(scope="module")
def reference() -> ModuleType:
    """docs/reference.py, which writes the pages that follow from the code."""
    spec = importlib.util.spec_from_file_location("reference", ROOT / "docs/reference.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_error_says_what_was_expected_or_what_to_do(reference: ModuleType) -> None:
    found = list(reference.messages())
    assert len(found) > 200
    told = [text for _, room, text in found if ";" in text or "expected" in text or "⟨hint⟩" in text or room == "train"]
    assert [text for *_, text in found if text not in told] == []  # those of `train` are reasons in a manifest


def test_pages_that_follow_from_the_code_are_up_to_date(reference: ModuleType) -> None:
    for name, text in reference.pages().items():
        assert (ROOT / "docs" / name).read_text() == text, f"docs/{name}: run python docs/reference.py"


def test_the_first_page_is_short() -> None:
    assert len((ROOT / "README.md").read_text().splitlines()) <= 150
