"""Imports run one way, the four stages do not know each other, and only one module knows the file formats."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent

ALLOWED = {
    "core": set(),
    "batch": {"core"},
    "light": {"core"},
    "material": {"core"},
    "asset": {"core", "light"},
    "prior": {"core", "material"},
    "sd": {"core"},
    "prep": {"core", "light", "material", "prior"},
    "swatch": {"core", "light", "material", "prior", "asset"},
    "conditions": {"core", "light", "material", "prior", "asset"},
    "distill": {"core", "light", "material", "prior", "sd", "asset"},
    "bake": {"core", "light", "material", "prior", "asset"},
    "edit": {"core", "asset", "bake"},
    "train": {"core", "light", "material", "prior", "sd", "asset", "prep", "conditions", "distill", "bake"},
    "report": {"core", "light", "material", "prior", "sd", "asset", "prep", "conditions", "distill", "bake", "train"},
}

SOURCES = sorted(path for package in ("stages", "dreammat_cli") for path in (ROOT / package).rglob("*.py"))


def imported(path: Path) -> set[str]:
    """Full names of the modules that a file imports, wherever in it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: a relative import"
            names.add(node.module or "")
    return names


def test_every_package_is_listed() -> None:
    found = {path.parent.name for path in (ROOT / "stages").glob("*/__init__.py")}
    assert found == set(ALLOWED)


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_run_one_way(path: Path) -> None:
    parts = path.relative_to(ROOT).parts
    names = imported(path)
    if parts[0] == "dreammat_cli":
        return
    assert not any(name.split(".")[0] == "dreammat_cli" for name in names)
    own = parts[1]
    for name in names:
        if name.startswith("stages."):
            assert name.split(".")[1] in ALLOWED.get(own, set()) | {own}, f"{path} imports {name}"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_one_module_knows_the_formats(path: Path) -> None:
    if path == ROOT / "stages" / "core" / "artifact.py":
        return
    assert "OpenEXR" not in imported(path)
    tree = ast.parse(path.read_text(encoding="utf-8"))
    calls = [node.func for node in ast.walk(tree) if isinstance(node, ast.Call)]
    called = {function.attr for function in calls if isinstance(function, ast.Attribute)}
    assert not called & {"savez", "savez_compressed"}


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_house_rules(path: Path) -> None:
    """No print below the command line, no bare except, no pickle, no global seed; kernels compile where nothing can be kept."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        assert not (isinstance(node, ast.ExceptHandler) and node.type is None), f"{path}: bare except"
        if isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            assert called not in {"print", "torch.manual_seed", "np.random.seed", "random.seed"}, f"{path}: {called}"
            cached = "numba" in called and any(word.arg == "cache" for word in node.keywords)
            assert not cached or path.name == "parallel.py", f"{path}: {called}; use core.parallel.compiled"
    assert not imported(path) & {"pickle", "random"}


def test_options_are_light() -> None:
    """What --help needs imports neither torch nor numpy."""
    allowed = {"dataclasses", "pathlib", "typing", "stages", "collections"}
    for path in ROOT.glob("stages/*/options.py"):
        for name in imported(path):
            assert name.split(".")[0] in allowed, f"{path}: {name}"
