"""The command line as a user meets it: help, plans, one-line errors, exit codes, and nothing half-written."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from dreammat_cli.whole import Whole
from tests.processes import Command

OK, USAGE, INPUT, ARTIFACT, OUTPUT = 0, 2, 3, 4, 5

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def dreammat(*arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own."""
    result = Command(arguments, cwd).done()
    assert result is not None
    return result


def expect_error(result: subprocess.CompletedProcess[str], code: int, *words: str) -> None:
    """One line on stderr that starts with "error:" and holds the words; nothing on stdout; the exit code."""
    assert result.returncode == code, result.stderr
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1, result.stderr
    assert lines[0].startswith("error: ")
    for word in words:
        assert word in lines[0]
    assert result.stdout == ""


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    path = tmp_path / "triangle.obj"
    path.write_text(TRIANGLE)
    return path


STAGES = ("run", "prep", "conditions", "distill", "bake", "export", "doctor", "completion")
TRAINING = ("train prior", "train pictures", "train controlnet")


@pytest.mark.parametrize("command", ("", *STAGES, "report conditions", "report distill", "report prior", "eval", *TRAINING))
def test_help_shows_usage(command: str) -> None:
    result = dreammat(*command.split(), "--help")
    assert result.returncode == OK
    assert result.stdout.startswith("Usage: ")


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys, importlib\n"
        "from dreammat_cli.main import COMMANDS\n"
        "for name in COMMANDS: importlib.import_module(f'dreammat_cli.{name}')\n"
        "print([m for m in ('torch', 'numpy', 'numba', 'OpenEXR', 'pymeshlab') if m in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def test_dry_run_writes_nothing(mesh: Path, tmp_path: Path) -> None:
    result = dreammat("prep", mesh, "-o", tmp_path / "prep.npz", "--dry-run", "--json")
    assert json.loads(result.stdout)["texture_size"] == 2048
    assert [p.name for p in tmp_path.iterdir()] == ["triangle.obj"]


def test_what_is_understood_of_a_prompt_is_shown(tmp_path: Path) -> None:
    words = ("distill", "c", "-o", "m.npz", "--prompt", "a boot, brown leather with a black rubber sole")
    told = dreammat(*words, "--explain", cwd=tmp_path)
    assert [line.split("  ")[0] for line in told.stdout.splitlines()] == ["what", "brown leather", "black rubber"]
    assert "lowest 8 % (sole)" in told.stdout and told.stderr == ""
    planned = dreammat(*words, "--dry-run", cwd=tmp_path)
    assert planned.stdout.startswith("would distill m.npz") and planned.stdout.endswith(told.stdout)
    data = json.loads(dreammat(*words, "--explain", "--json", "--object-size", "0.5", cwd=tmp_path).stdout)
    assert data["metres"] == 0.5 and data["coats"][1]["what"] == "black rubber"
    expect_error(dreammat("distill", "c", "-o", "m.npz", "--explain", cwd=tmp_path), INPUT, "--prompt")
    assert not list(tmp_path.iterdir())


def test_json_is_all_that_stdout_holds(mesh: Path, tmp_path: Path) -> None:
    result = dreammat("prep", mesh, "-o", tmp_path / "prep.npz", "--json")
    assert json.loads(result.stdout)["findings"]["triangles"] == 1
    again = dreammat("prep", mesh, "-o", tmp_path / "prep.npz", "--json")
    assert json.loads(again.stdout)["up_to_date"] is True


@pytest.mark.parametrize(
    "arguments",
    [
        ("prep",),
        ("prep", "MESH"),
        ("prep", "MESH", "-o", "x.npz", "--up", "w"),
        ("prep", "MESH", "-o", "x.npz", "--nonsense"),
        ("conditions", "p.npz", "-o", "c", "--views", "0"),
        ("conditions", "p.npz", "-o", "c", "--fov", "45", "25"),
        ("distill", "c", "-o", "m.npz", "--guidance", "magic"),
        ("bake", "p.npz", "m.npz", "-o", "a", "--size", "1000"),
        ("export", "a", "-o", "e", "--for", "maya"),
        ("export", "a", "-o", "e"),
        ("train", "pictures", "m", "-o", "p", "--shard", "3/2"),
        ("train", "pictures", "m", "-o", "p", "--shard", "half"),
        ("nonsense",),
        ("run", "MESH", "-o", "r"),
        ("run", "MESH", "-o", "r", "--prompt", "oak", "--with", "paint", "--size 512"),
        ("run", "MESH", "-o", "r", "--prompt", "oak", "--with", "prep", "--up 'z"),
        ("run", "MESH", "-o", "r", "--prompt", "oak", "--with", "bake", "--sise 512"),
        ("completion", "tcsh"),
    ],
)
def test_wrong_usage(arguments: tuple[str, ...], tmp_path: Path) -> None:
    expect_error(dreammat(*arguments, cwd=tmp_path), USAGE, "--help")


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("empty.obj", b""),
        ("words.obj", b"no mesh at all\n"),
        ("points.obj", b"v 0 0 0\nv 1 0 0\n"),
        ("range.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
        ("noise.glb", b"glTF" + bytes(40)),
        ("noise.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 1000\nproperty float x\nend_header\n"),
        ("noise.stl", bytes(100)),
        ("mesh.fbx", b"Kaydara"),
    ],
)
def test_bad_meshes(name: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    expect_error(dreammat("prep", name, "-o", "prep.npz", cwd=tmp_path), INPUT, name)
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_missing_and_foreign_artefacts(mesh: Path, tmp_path: Path) -> None:
    prep = tmp_path / "prep.npz"
    assert dreammat("prep", mesh, "-o", prep, "-q").returncode == OK
    expect_error(dreammat("prep", "gone.obj", "-o", prep, cwd=tmp_path), INPUT, "gone.obj")
    expect_error(dreammat("conditions", "gone.npz", "-o", "c", cwd=tmp_path), ARTIFACT, "gone.npz")
    expect_error(dreammat("conditions", mesh, "-o", "c", cwd=tmp_path), ARTIFACT, "triangle.obj")
    expect_error(dreammat("conditions", prep, "-o", "c", "--env", "studoi", cwd=tmp_path), INPUT, "did you mean 'studio'?")
    distill = dreammat("distill", tmp_path, "--prompt", "gold", "-o", "m.npz", cwd=tmp_path)
    expect_error(distill, ARTIFACT, "manifest.json")
    expect_error(dreammat("bake", prep, prep, "-o", "a", cwd=tmp_path), ARTIFACT, "dreammat.prep", "dreammat.material")
    expect_error(dreammat("export", tmp_path, "-o", "e", "--for", "unreal", cwd=tmp_path), ARTIFACT, "bake.json")
    prep.write_bytes(prep.read_bytes()[:-200])
    expect_error(dreammat("conditions", prep, "-o", "c", cwd=tmp_path), ARTIFACT, "prep.npz")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["prep.npz", "prep.npz.run.json", "triangle.obj"]


def test_output_that_cannot_be_written(mesh: Path, tmp_path: Path) -> None:
    expect_error(dreammat("prep", mesh, "-o", mesh / "prep.npz"), OUTPUT, "prep.npz")


def test_full_disk(mesh: Path) -> None:
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("needs Linux's /dev/full")
    from stages.core.artifact import written_atomically
    from stages.core.errors import OutputError

    with pytest.raises(OutputError, match="no space"), written_atomically(mesh.with_name("a.txt")):
        full.write_text("x" * 100_000)


def test_a_command_that_is_not_there_is_guessed(tmp_path: Path) -> None:
    expect_error(dreammat("bkae", cwd=tmp_path), USAGE, "'bkae'", "did you mean 'bake'")
    expect_error(dreammat("train", "picutres", cwd=tmp_path), USAGE, "'picutres'", "did you mean 'pictures'")
    expect_error(dreammat("prep", "--texture-sise", "64", cwd=tmp_path), USAGE, "--texture-size")


def test_run_hands_each_stage_its_options(mesh: Path, tmp_path: Path) -> None:
    options = (("conditions", "--views 3 --env night"), ("bake", "--size 512"), ("bake", "--supersample 2"))
    further = [word for stage, text in options for word in ("--with", stage, text)]
    planned = dreammat("run", mesh, "--prompt", "oak", "-o", "it's #1 (50%)", *further, "--dry-run", "--json", cwd=tmp_path)
    prep, conditions, distill, bake = map(json.loads, planned.stdout.splitlines())
    assert prep["output"] == "it's #1 (50%)/prep.npz" and distill["prompt"] == "oak"
    assert (conditions["views"], conditions["env"]) == (3, ["night"])
    assert (bake["size"], bake["supersample"]) == (512, 2)
    assert [p.name for p in tmp_path.iterdir()] == ["triangle.obj"]


def test_a_run_tells_how_long_all_of_it_will_take(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    whole = Whole({"prep": 10, "conditions": 100, "distill": 20, "bake": 30})
    assert whole.begin("prep") == "[1 of 4] prep, about 3 min left in all"
    clock[0] = 10.0
    whole.begin("conditions")
    assert whole.left() == 150
    for views, now in ((0, 15.0), (10, 35.0)):  # two seconds a view, after five of reading
        clock[0] = now
        whole.heed("views", views, 100)
    assert whole.left() == pytest.approx(180 + 2.05 * 50)
    clock[0] = 215.0
    assert whole.begin("distill") == "[3 of 4] distill, about 2 min left in all"
    whole.heed("texels", 1, 2)
    assert whole.left() == pytest.approx(2.05 * 50)
    clock[0] = 1000.0
    whole.begin("bake")
    clock[0] = 2000.0
    assert whole.left() == 0


def test_a_run_tells_each_stage_and_what_is_left(mesh: Path, tmp_path: Path) -> None:
    told = dreammat("run", mesh, "--prompt", "oak", "-o", tmp_path / "x", "--dry-run", cwd=tmp_path).stderr.splitlines()
    assert [line.split(",")[0] for line in told] == [f"[{k} of 4] {name}" for k, name in enumerate(STAGES[1:5], 1)]
    assert all(line.endswith("left in all") for line in told)


def test_verbose_tells_the_seconds_of_each_part(mesh: Path, tmp_path: Path) -> None:
    told = dreammat("prep", mesh, "-o", tmp_path / "prep.npz", "-v").stderr.splitlines()
    assert told and all(line.split()[1] == "s" and float(line.split()[0]) >= 0 for line in told)


@pytest.mark.parametrize("shell", ("bash", "zsh", "fish"))
def test_completion_prints_a_script(shell: str) -> None:
    assert f"{shell}_complete" in dreammat("completion", shell).stdout


def test_options_complete() -> None:
    asked = {"_DREAMMAT_COMPLETE": "bash_complete", "COMP_WORDS": "dreammat bake --super", "COMP_CWORD": "2"}
    code = "import sys; sys.argv[0] = 'dreammat'; from dreammat_cli.main import main; main()"
    result = subprocess.run([sys.executable, "-c", code], env=os.environ | asked, capture_output=True, text=True, check=False)
    assert result.stdout.strip() == "plain,--supersample"
