"""What a job needs before it runs: CPU time, memory, disk, files; laws whose numbers were measured, see docs/numbers.md.

CPU time is that of one core of the machine where the numbers were measured; `speed` compares another with it.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

START = 2.0
"""CPU seconds in which a command imports what it needs."""

TRIANGLE_BYTES = {".glb": 30, ".gltf": 30, ".fbx": 30, ".stl": 50, ".ply": 30, ".usdc": 20, ".usdz": 20}
"""Bytes of a mesh file for each triangle, textures aside; of text formats 80."""

QUALITY = {"draft": 0.7, "standard": 1.0, "high": 3.8}
"""Time of conditions, as a multiple."""

STEPS = {"prior": 60, "reference": 16_000, "sd": 4000}
"""Of distillation, by guidance, and their multiple by quality."""
MORE = {"draft": 0.25, "standard": 1.0, "high": 4.0}

ENVIRONMENTS = 5
"""Those that are built in."""

SD_STEP = 0.053
"""GPU seconds a step of Stable Diffusion: 5.5 TFLOP at a third of an A100's half-precision peak; counted, not measured."""


UNSEEN = 16e6
"""Bytes that a mesh is taken to have which is not to be seen here."""


@dataclass(frozen=True)
class Need:
    """CPU seconds; GPU seconds; peak GiB of memory; GiB and number of the files that stay."""

    cpu: float
    memory: float
    disk: float = 0.0
    files: int = 0
    gpu: float = 0.0

    def __add__(self, other: "Need") -> "Need":
        """One after the other: of memory the larger."""
        sums = (self.disk + other.disk, self.files + other.files, self.gpu + other.gpu)
        return Need(self.cpu + other.cpu, max(self.memory, other.memory), *sums)

    def at(self, speed: float) -> "Need":
        """The same where work takes so many times as long."""
        return replace(self, cpu=START + speed * (self.cpu - START))


def prep(triangles: float) -> Need:
    """Of a mesh without UVs; one that has them takes a sixth of the time."""
    millions = triangles / 1e6
    return Need(START + 1 + 300 * millions, 0.3 + 1.5 * millions, 0.19 * millions, 2)


def conditions(triangles: float, views: int, pixels: int, environments: int, quality: str = "standard") -> Need:
    """Of so many views of so many pixels each."""
    millions, seen = triangles / 1e6, views * pixels / 2**18  # views of 512²
    cpu = START + 3 + 0.5 * environments + 12 * millions + seen * (2 + 1.33 * environments) * QUALITY[quality]
    memory = 0.5 + 0.04 * environments + 0.35 * pixels / 2**18 + 0.3 * millions
    disk = 0.001 + 0.0012 * environments + 0.05 * millions + seen * (0.001 + 0.003 * environments)
    return Need(cpu, memory, disk, 6 + environments + views * (1 + environments))


def distill(steps: float, views: int, pixels: int, environments: int, guidance: str = "prior") -> Need:
    """Of so many steps; views are read whole."""
    memory = 0.6 + 0.007 * views * pixels / 2**18 * environments
    if guidance == "sd":
        return Need(START + 20 + SD_STEP * steps, memory + 8, 0.02, 4, gpu=SD_STEP * steps)
    return Need(START + 1 + 0.15 * steps, memory, 0.02, 4)


def bake(triangles: float, texels: float) -> Need:
    """Of textures of so many texels in all."""
    millions, squares = triangles / 1e6, texels / 2**22  # squares of 2048²
    cpu, memory = START + 32 + 50 * squares + 60 * millions, 0.9 + 0.3 * squares + 0.4 * millions
    return Need(cpu, memory, 0.005 + 0.075 * squares + 0.22 * millions, 20)


def export(texels: float) -> Need:
    """Of an asset for one program."""
    squares = texels / 2**22
    return Need(START + 1 + 4 * squares, 0.4 + 0.3 * squares, 0.003 + 0.04 * squares, 8)


def of(given: Mapping[str, Mapping[str, Any]], triangles: float) -> dict[str, Need]:
    """What each command of a job needs.

    Args:
        given: the options of each of the four stages, as their commands know them.
    """
    seen, learnt = given["conditions"], given["distill"]
    view = (seen["views"], seen["size"] ** 2, len(seen["env"]) or ENVIRONMENTS)
    guidance = learnt["guidance"]
    steps = learnt["steps"] or round(STEPS[guidance] * MORE[learnt["quality"]])
    texels = (given["bake"]["size"] or 2048) ** 2
    return {
        "prep": prep(triangles),
        "conditions": conditions(triangles, *view, seen["quality"]),
        "distill": distill(steps, *view, guidance),
        "bake": bake(triangles, texels),
        "export": export(texels),
    }


def triangles_of(mesh: Path, prepared: Path) -> float:
    """Triangles of a mesh: as `prep` recorded them, or else guessed by the file's size."""
    known = recorded(prepared.with_name(prepared.name + ".run.json")).get("triangles")
    size = mesh.stat().st_size if mesh.is_file() else UNSEEN
    return float(known or size / TRIANGLE_BYTES.get(mesh.suffix.lower(), 80))


def recorded(path: Path) -> dict[str, Any]:
    """What a run.json says, nothing where there is none."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}
