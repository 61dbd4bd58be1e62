"""Runs the shell and Python blocks of the pages as they are written: python -m tests.pages [PAGE …]

Each page runs from top to bottom in a folder of its own, a copy of this tree that holds what the pages name: a chair and what
the four stages make of it, a scene, lights, scans, jobs. Commands work at a small setting, SMALL; what a page says has the last
word. A block that cannot run here says why in a comment before it: <!-- not run: needs a GPU -->
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
import OpenImageIO as oiio

from tests.prep.scenes import solid
from tests.prep.shapes import GltfBuilder, cube

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
TREE = ("dreammat_cli", "stages", "docs", "examples", "Makefile", "pyproject.toml", "constraints.txt", "README.md", "LICENSE")

SMALL = {
    "prep": {"texture_size": 512},
    "conditions": {"views": 4, "size": 64, "quality": "draft"},
    "distill": {"steps": 2},
    "bake": {"size": 512, "supersample": 1, "occlusion_rays": 4, "preview_size": 32},
    "material": {"size": 256, "preview_size": 32},
    "parts": {"size": 64},
    "train": {"pictures": {"views": 1, "lights": 1, "size": 64, "quality": "draft"}},
}

DREAMMAT = """#!{python}
import sys
sys.path.insert(0, {tree!r})
from dreammat_cli.main import cli, main
cli.context_settings["default_map"] = {small!r}
sys.argv[0] = "dreammat"
main()
"""

FEET = ((-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2))
CHAIR = {  # a box each: centre and size
    "Seat_LP": ((0, 0.45, 0), (0.5, 0.06, 0.5)), "Back_LP": ((0, 0.8, -0.22), (0.5, 0.5, 0.04)),
    "seat": ((0, 0.5, 0), (0.44, 0.05, 0.44)), "rail": ((0, 0.2, 0), (0.4, 0.03, 0.03)),
    **{f"leg_{k}": ((x, 0.2, z), (0.05, 0.4, 0.05)) for k, (x, z) in enumerate(FEET)},
}  # fmt: skip


class Block(NamedTuple):
    """What stands between fences. language: sh or python. why_not: why it is not run, or empty."""

    language: str
    text: str
    why_not: str


def blocks(page: Path) -> list[Block]:
    """The shell and Python blocks of a page, in order."""
    found = re.findall(r"^(?:<!-- not run: ([^>]+?) -->\n+)?```(sh|python)\n(.*?)^```", page.read_text(), re.M | re.S)
    return [Block(language, text, why) for why, language, text in found]


def run(page: Path, world: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a page's blocks in a copy of the world. Args: folder: where the copy goes to."""
    shutil.copytree(world, folder, dirs_exist_ok=True)
    install(folder)
    script = ["set -euxo pipefail"]
    for language, text, why_not in blocks(page):
        if not why_not:
            script.append(text if language == "sh" else f"python - <<'END'\n{text}END\n")
    text = "\n".join(script)
    if "<this repository>" in text:
        commit(folder)
    environment = os.environ | {
        "PATH": f"{folder / '.venv/bin'}{os.pathsep}{os.environ['PATH']}", "VENV": str(folder / ".venv"),
        "PIP_NO_DEPS": "1", "PIP_NO_BUILD_ISOLATION": "0", "PIP_TARGET": str(folder / "site"), "PYTHONPATH": str(folder),
    }  # fmt: skip
    command = ["bash", "-c", text.replace("<this repository>", str(folder))]
    return subprocess.run(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )


def make_world(folder: Path) -> Path:
    """The files that pages name, as people bring them. Returns: the folder."""
    folder.mkdir()
    for name in TREE:
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy2
        copy(ROOT / name, folder / name)
    install(folder)
    write_chair(folder / "chair.obj")
    shutil.copy(folder / "chair.obj", folder / "André's chair #2 (50%).obj")
    (folder / "jobs.csv").write_text("mesh,prompt\nchair.obj,oak\n")
    write_room(folder / "room.glb")
    table = re.search(r"```toml\n(.*?)```", (ROOT / "docs/parts.md").read_text(), re.S)
    assert table
    (folder / "prompts.toml").write_text(table[1])
    (folder / "helmet.obj").write_text(HELMET)
    noise = np.random.default_rng(0)
    picture(folder / "my_office.hdr", noise.uniform(0.1, 2, (32, 64, 3)))
    for name in ("rock_01", "moss_01"):
        for suffix, level in (("diff", 0.4), ("rough", 0.8), ("nor_gl", 0.5)):
            picture(folder / f"scans/{name}_{suffix}_1k.png", np.clip(level + noise.normal(0, 0.05, (64, 64, 3)), 0, 1))
    for number in "12":
        (folder / "jobs" / number).mkdir(parents=True)
        shutil.copy(folder / "chair.obj", folder / "jobs" / number)
        (folder / "jobs" / number / "prompt.txt").write_text("oak\n")
    return folder


def add_artefacts(folder: Path) -> None:
    """What pages have from earlier ones: the chair, textured, under the names that they give it."""
    dreammat = folder / ".venv/bin/dreammat"
    subprocess.run([dreammat, "run", "chair.obj", "--prompt", "oak", "-o", "chair", "-q"], cwd=folder, check=True)
    shutil.copytree(folder / "chair", folder / "assets/chair")
    shutil.copytree(folder / "chair/conditions", folder / "other/conditions")
    shutil.copy(folder / "chair/asset/model.glb", folder / "textured.glb")
    (folder / "models").mkdir()
    shutil.copy(folder / "chair/asset/model.glb", folder / "models/chair.glb")
    (folder / "captions.json").write_text('{"chair.glb": "an oak chair"}')


def install(folder: Path) -> None:
    """A virtual environment that is set up, as far as Make and a shell can tell, with the folder's tree and this Python."""
    bin = folder / ".venv/bin"
    bin.mkdir(parents=True, exist_ok=True)
    python = f'#!/bin/sh\nPYTHONPATH="{folder}" exec {sys.executable} '
    programs = {
        "dreammat": DREAMMAT.format(python=sys.executable, tree=str(folder), small=SMALL),
        "python": f'{python}"$@"\n', "pip": f'{python}-m pip "$@"\n',
    }  # fmt: skip
    for name, text in programs.items():
        (bin / name).write_text(text)
        (bin / name).chmod(0o755)
    (bin / "activate").write_text(f'PATH="{bin}:$PATH"\n')
    ready = bin.parent / ".ready"
    ready.touch()
    os.utime(ready, (time.time() + 86400,) * 2)  # newer than whatever it is made from


def commit(folder: Path) -> None:
    """Make the folder a repository that can be cloned."""
    git = ["git", "-C", str(folder), "-c", "user.name=x", "-c", "user.email=x@example.org", "-c", "init.defaultBranch=main"]
    for words in (["init", "-q"], ["add", "-f", *TREE, ".venv", ":(glob)*.obj"], ["commit", "-q", "-m", "A tree"]):
        subprocess.run([*git, *words], check=True)


def write_chair(path: Path) -> None:
    """A chair of eight boxes, each an object of its own."""
    corners, faces = cube()
    unit = np.asarray(corners, float)
    unit = (unit - unit.min(0)) / np.ptp(unit, axis=0) - 0.5
    lines: list[str] = []
    for row, (name, (centre, size)) in enumerate(CHAIR.items()):
        lines.append(f"o {name}")
        lines += ["v {:.5f} {:.5f} {:.5f}".format(*point) for point in unit * size + centre]
        lines += ["f {} {} {}".format(*(face + 1 + row * len(unit))) for face in np.asarray(faces)]
    path.write_text("\n".join(lines) + "\n")


def write_room(path: Path) -> None:
    """A floor, a table, two chairs and a vase."""
    built = GltfBuilder()
    boxes = {
        "floor": ((0, -0.05, 0), (4, 0.05, 4)), "table": ((0, 0, 0), (1.6, 0.8, 0.9)),
        "chair_1": ((1.3, 0, 0), (0.4, 0.9, 0.4)), "chair_2": ((-1.3, 0, 0), (0.5, 0.9, 0.4)),
        "Vase.001": ((0, 0.8, 0), (0.2, 0.4, 0.2)),
    }  # fmt: skip
    built.root["meshes"] = [{"primitives": [solid(built, cube(), size)]} for _, size in boxes.values()]
    built.root["nodes"] = [
        {"name": name, "mesh": row, "translation": list(place)} for row, (name, (place, _)) in enumerate(boxes.items())
    ]
    built.root["scenes"] = [{"nodes": list(range(len(boxes)))}]
    built.write(path)


HELMET = """v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 2 0 0
v 2 1 0
vt 0.1 0.1
vt 0.9 0.1
vt 0.9 0.9
vt 0.1 0.9
vt 1.1 0.1
vt 1.9 0.1
vt 1.9 0.9
vt 1.1 0.9
f 1/1 2/2 3/3 4/4
f 2/5 5/6 6/7 3/8
"""
"""Two squares in two UDIM tiles."""


def picture(path: Path, pixels: np.ndarray) -> None:
    """Write a picture (H, W, 3)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    buffer = oiio.ImageBuf(np.ascontiguousarray(pixels, np.float32))
    buffer.set_write_format("float" if path.suffix == ".hdr" else "uint8")
    assert buffer.write(str(path)), buffer.geterror()


def main(names: list[str]) -> int:
    """Run the pages of these names, or all. Returns: how many failed."""
    failed = 0
    with tempfile.TemporaryDirectory() as scratch:
        world = make_world(Path(scratch) / "world")
        add_artefacts(world)
        for page in PAGES:
            found = blocks(page)
            if not found or (names and page.name not in names):
                continue
            begin = time.perf_counter()
            folder = Path(scratch) / page.stem
            done = run(page, world, folder)
            state = "ok" if done.returncode == 0 else f"FAILED\n{done.stdout[-4000:]}"
            count = sum(not block.why_not for block in found)
            print(f"{page.name}: {count} of {len(found)} blocks, {time.perf_counter() - begin:.0f} s: {state}", flush=True)
            failed += done.returncode != 0
            shutil.rmtree(folder)
    return failed


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
