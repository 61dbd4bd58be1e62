"""The pages: what follows from the code is up to date, links lead somewhere, and commands are right as they are written."""

import importlib.util
import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from dreammat_cli.main import cli

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
WITHOUT_DRY_RUN = ("doctor", "completion", "report", "eval", "train")


def commands() -> list[tuple[str, str]]:
    """Every call of dreammat in the pages' shell blocks: (page, line)."""
    found = []
    for page in PAGES:
        text = page.read_text()
        blocks = re.findall(r"```sh\n(.*?)```", text, re.S) + re.findall(r"(?:^    .*\n)+", text, re.M)
        for line in "\n".join(blocks).replace("\\\n", " ").splitlines():
            if line.strip().startswith("dreammat ") and "…" not in line:
                found.append((page.name, line.strip()))
    return found


@pytest.mark.parametrize(("page", "line"), commands())
def test_commands_are_right_as_they_are_written(page: str, line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    words = shlex.split(line, comments=True)[1:]
    last = "--help" if words[0] in WITHOUT_DRY_RUN else "--dry-run"
    result = CliRunner().invoke(cli, [*words, last])
    assert result.exit_code == 0, f"{page}: {line}\n{result.output}"


def test_there_are_commands() -> None:
    assert len(commands()) >= 12


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text()):
        if not target.startswith("http"):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_pages_that_follow_from_the_code_are_up_to_date() -> None:
    spec = importlib.util.spec_from_file_location("reference", ROOT / "docs/reference.py")
    assert spec and spec.loader
    reference = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(reference)
    for name, text in reference.pages().items():
        assert (ROOT / "docs" / name).read_text() == text, f"docs/{name}: run python docs/reference.py"


def test_the_first_page_is_short() -> None:
    assert len((ROOT / "README.md").read_text().splitlines()) <= 150
