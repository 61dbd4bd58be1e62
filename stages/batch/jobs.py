"""The jobs of a batch, read from a file and checked whole before anything is done.

    jobs.csv     mesh,prompt,name,seed,parts,prep,conditions,distill,bake,export
                 chair.glb,a carved oak chair,,,,,--views 64,,--size 4096,web
    jobs.toml    [defaults]
                 conditions = "--views 64"
                 [chair]
                 mesh = "chair.glb"
                 prompt = "a carved oak chair"
    jobs/        a folder for each job with a mesh and a prompt.txt, as for `make batch`

mesh and parts are paths from where the jobs file is; parts is a file of lines such as "wheel_*" = "rubber", of which "*" stands
for the prompt. prep, conditions, distill and bake hold options of these commands, export names of programs with blanks between.
Jobs with the same mesh and options share prep.npz and conditions: seed is of `distill`, as the prompt is.
"""

import csv
import hashlib
import re
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stages.core.errors import InputError, one_line

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

STAGES = ("prep", "conditions", "distill", "bake")
COLUMNS = ("name", "mesh", "prompt", "parts", "seed", *STAGES, "export")
MESHES = (".obj", ".glb", ".gltf", ".fbx", ".usdz", ".usdc", ".usda", ".usd", ".ply", ".stl", ".off")

RESERVED = ("shapes", "logs", "benchmarks", "thumbnails")
"""Folders beside those of the jobs."""

Check = Callable[[str, list[str]], str]
"""What is wrong with the words given to a command, or "". Args: the command's name, its options."""


@dataclass(frozen=True)
class Job:
    """One asset: name, also of its folder; mesh; words of the whole and of its parts; seed of `distill`; options by stage as
    they are written; programs to export for. where: its line."""

    name: str
    mesh: Path
    prompt: str
    parts: tuple[tuple[str, str], ...] = ()
    seed: int = 0
    options: Mapping[str, str] = field(default_factory=dict)
    export: tuple[str, ...] = ()
    where: str = ""

    @property
    def shape(self) -> str:
        """Name of what jobs with this mesh and options of `prep` share."""
        return f"{safe(self.mesh.stem)}-{_digest(self.mesh.as_posix(), self.options.get('prep', ''))}"

    @property
    def lit(self) -> str:
        """Name of the conditions within that."""
        return f"conditions-{_digest(self.options.get('conditions', ''))}"

    def words(self, stage: str) -> list[str]:
        """What a command is told, but for its input and output."""
        own = []
        if stage == "distill":
            own = ["--prompt", self.prompt, *(word for part in self.parts for word in ("--part", *part))]
            own += ["--seed", str(self.seed)]
        return [*own, *shlex.split(self.options.get(stage, ""))]


def _digest(*texts: str) -> str:
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:8]


def safe(name: str) -> str:
    """A name that every file system and engine takes: letters, digits, and _ . - for the rest."""
    return re.sub(r"[^\w.-]+", "_", name).strip("_.-") or "job"


def shared(jobs: Sequence[Job]) -> tuple[dict[str, Job], dict[tuple[str, str], Job]]:
    """One job for each prep.npz that is needed, and for each conditions folder."""
    return {job.shape: job for job in jobs}, {(job.shape, job.lit): job for job in jobs}


@dataclass(frozen=True)
class Row:
    """What one line of a file says, cells without blanks around them. where: file and line or name."""

    where: str
    cells: dict[str, str]


def read_jobs(path: Path, check: Check, there: bool = True) -> tuple[list[Job], list[str]]:
    """The jobs of a file or folder that can be done, and a line for every mistake.

    Args:
        check: of options. there: whether a mesh that is not there is a mistake.
    Raises: InputError where the file as a whole cannot be read.
    """
    if path.is_dir():
        rows, unknown = _folder_rows(path), set[str]()
    else:
        rows, unknown = (_toml_rows if path.suffix.lower() == ".toml" else _csv_rows)(path)
    mistakes = [f"{path}: unknown column '{name}'; expected {', '.join(COLUMNS)}" for name in sorted(unknown)]
    if not rows:
        raise InputError(f"{path}: holds no jobs; expected a line for each, with mesh and prompt")
    jobs, taken = [], dict[str, str]()
    checked: dict[tuple[str, str], str] = {}
    for row in rows:
        job, found = _job(row, path if path.is_dir() else path.parent, there)
        found += _wrong_options(job, check, checked)
        if (first := taken.setdefault(job.name.lower(), row.where)) != row.where:
            found.append(f"name '{job.name}' is taken by {first}; give it a name of its own")
        mistakes += [f"{row.where}: {text}" for text in found]
        jobs += [] if found else [job]
    return jobs, mistakes


def _job(row: Row, beside: Path, there: bool) -> tuple[Job, list[str]]:
    """A row's job, and what is wrong with it. Args: beside: where paths start."""
    cells, found = row.cells, list[str]()
    if spare := cells.get("spare"):
        found.append(f"{spare.count(', ') + 1} cell too many ({spare}); put quotes around what holds a comma")
    mesh = beside / cells.get("mesh", "")
    found += _wrong_mesh(mesh, cells.get("mesh", ""), there)
    name = cells.get("name") or safe(mesh.stem)
    if name in RESERVED:
        found.append(f"name '{name}': the batch has a folder of that name; give it another")
    if name != safe(name):
        found.append(f"name '{name}'; expected letters, digits, _ . and -, such as '{safe(name)}'")
    parts, wrong = _read_parts(beside / cells["parts"]) if cells.get("parts") else ({}, [])
    found += wrong
    prompt = cells.get("prompt") or parts.pop("*", "")
    if not prompt:
        found.append("the prompt is empty; say what the object is made of, such as \"oak\"")
    seed = cells.get("seed") or "0"
    if not (seed.isascii() and seed.isdecimal() and int(seed) < 2**31):
        found.append(f"seed '{seed}': expected a number from 0 to {2**31 - 1}")
        seed = "0"
    options = {stage: cells[stage] for stage in STAGES if cells.get(stage)}
    export = tuple(cells.get("export", "").split())
    return Job(name, mesh, prompt, tuple(parts.items()), int(seed), options, export, row.where), found


def _wrong_mesh(mesh: Path, said: str, there: bool) -> list[str]:
    if not said:
        return ["no mesh; expected a path from where the jobs file is"]
    if mesh.suffix.lower() not in (*MESHES, ".npz"):
        return [f"mesh {mesh}: expected one of {' '.join(MESHES)}"]
    return [] if mesh.is_file() or not there else [f"mesh {mesh}: no such file"]


def _read_parts(path: Path) -> tuple[dict[str, str], list[str]]:
    """Prompts of parts, and what is wrong with their file."""
    try:
        held = _read_toml(path)
    except InputError as error:
        return {}, [str(error)]
    right = {name: words for name, words in held.items() if isinstance(words, str) and words.strip()}
    return right, [f'{path}: {name}: expected "NAME" = "prompt"' for name in held if name not in right]


def _wrong_options(job: Job, check: Check, known: dict[tuple[str, str], str]) -> list[str]:
    """What is wrong with a job's options. Args: known: what has been looked at, which this adds to."""
    asked = [*job.options.items(), *(("export", f"--for {target}") for target in job.export)]
    for stage, text in asked:
        if (stage, text) not in known:
            try:
                known[stage, text] = check(stage, shlex.split(text))
            except ValueError as error:
                known[stage, text] = f"{text!r}: {one_line(error)}"
    return [f"{stage}: {known[stage, text]}" for stage, text in asked if known[stage, text]]


def _csv_rows(path: Path) -> tuple[list[Row], set[str]]:
    """Rows and unknown columns. Raises: InputError."""
    try:
        with open(path, encoding="utf-8-sig", newline="") as stream:
            lines = csv.DictReader(stream, restkey="", restval="", strict=True)
            heads = [head.strip() for head in lines.fieldnames or []]
            if "mesh" not in heads:
                found = ",".join(heads)[:80] or "empty"
                raise InputError(f"{path}: its first line is {found}; expected names of columns, such as mesh,prompt")
            if len(set(heads)) < len(heads):
                raise InputError(f"{path}: a column is there twice: {', '.join(heads)}; expected each once")
            rows = []
            for line in lines:
                spare = [str(cell).strip() for cell in line.pop("", None) or ()]
                cells = {head: str(cell).strip() for head, cell in zip(heads, line.values(), strict=False)}
                if any(spare):
                    cells["spare"] = ", ".join(spare)
                if any(cells.values()):
                    rows.append(Row(f"{path}, line {lines.line_num}", cells))
    except OSError as error:
        raise InputError(f"{path}: {_reason(error)}; expected a jobs file (.csv, .toml) or a folder of jobs") from error
    except (csv.Error, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not CSV in UTF-8 ({one_line(error)}); expected a line a job") from error
    return rows, set(heads) - set(COLUMNS)


def _toml_rows(path: Path) -> tuple[list[Row], set[str]]:
    """Rows and unknown keys. Raises: InputError."""
    held = _read_toml(path)
    defaults = held.pop("defaults", {})
    loose = [name for name, table in [("defaults", defaults), *held.items()] if not isinstance(table, dict)]
    if loose:
        raise InputError(f"{path}: {loose[0]} is no table; expected [NAME] with mesh and prompt below it")
    rows = [Row(f"{path}, [{name}]", {"name": name} | _cells(defaults) | _cells(table)) for name, table in held.items()]
    return rows, {key for table in [defaults, *held.values()] for key in table} - set(COLUMNS)


def _cells(table: Mapping[str, Any]) -> dict[str, str]:
    return {key: " ".join(map(str, value)) if isinstance(value, list) else str(value).strip() for key, value in table.items()}


def _read_toml(path: Path) -> dict[str, Any]:
    """Raises: InputError."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: {_reason(error)}; expected a TOML file") from error
    except ValueError as error:
        raise InputError(f"{path}: not TOML ({one_line(error)})") from error


def _reason(error: OSError) -> str:
    return (error.strerror or str(error)).lower()


def _folder_rows(path: Path) -> list[Row]:
    """A row for every folder with a prompt.txt; prep.npz where there is no mesh."""
    rows = []
    for prompt in sorted(path.glob("*/prompt.txt")):
        folder = prompt.parent
        meshes = sorted(file.name for file in folder.iterdir() if file.suffix.lower() in MESHES)
        chosen = [*meshes, *(["prep.npz"] if (folder / "prep.npz").is_file() else [])][:1]
        words = " ".join(prompt.read_text(encoding="utf-8").split())
        mesh = f"{folder.name}/{chosen[0]}" if chosen else ""
        rows.append(Row(str(folder), {"name": safe(folder.name), "mesh": mesh, "prompt": words}))
    return rows
