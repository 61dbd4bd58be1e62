"""Objects to train on: the textured GLB files of a folder that pass the paper's filters.

Refused, with the reason: what is transparent, unlit or coloured by vertices, holds points or lines, is a single plane or
too simple, has tags of a style, or no caption.

Source: Zhang et al. 2024, "DreamMat", appendix, "Different shading models in Objaverse".
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.core.artifact import read_json
from stages.core.errors import InputError
from stages.light.scene import Scene
from stages.light.textured_model import TexturedModel
from stages.prep.options import PrepOptions
from stages.prep.read_gltf import read_gltf
from stages.prep.repair import repair
from stages.prep.source import Source
from stages.prep.stage import oriented

UNFIT = {
    "is transparent": rb'"alphaMode"\s*:\s*"(BLEND|MASK)"|KHR_materials_(transmission|volume)',
    "is unlit": rb"KHR_materials_unlit",
    "is coloured by its vertices": rb'"COLOR_0"',
}
"""What the text of a glTF file gives away."""

STYLES = {"stylized", "stylised", "style", "handpainted", "pixelart", "npr", "nonphotorealistic"}
"""Tags of objects that no renderer of ours makes look as they should, without spaces and hyphens."""

FEWEST = 100
"""Triangles of which an object has at least so many."""

THINNEST = 0.01
"""Least extent in any direction, in longest edges of the bounding box."""


@dataclass(frozen=True)
class TrainingObject:
    """A shape as `prep` would hand it on, and its material."""

    scene: Scene
    model: TexturedModel


@dataclass(frozen=True)
class Entry:
    """What the captions file says of an object; caption is "" where it says nothing."""

    caption: str = ""
    tags: tuple[str, ...] = ()


def read_captions(path: Path | None) -> dict[str, Entry]:
    """Entries by file name, relative to the models' folder. Raises: InputError."""
    if path is None:
        return {}
    content = read_json(path)
    if not isinstance(content, dict):
        raise InputError(f"{path}: expected JSON of file names and captions: {{\"chair.glb\": \"an oak chair\"}}")
    return {name: _entry(path, name, value) for name, value in content.items()}


def _entry(path: Path, name: str, value: Any) -> Entry:
    value = {"caption": value} if isinstance(value, str) else value
    if not isinstance(value, dict):
        raise InputError(f'{path}: "{name}" has {value!r}; expected a caption, or {{"caption": ..., "tags": [...]}}')
    return Entry(str(value.get("caption", "")).strip(), tuple(map(str, value.get("tags", []))))


def read_object(path: Path, entry: Entry) -> TrainingObject:
    """An object that passes the filters. Raises: InputError with the reason why not."""
    if styles := sorted({re.sub("[^a-z]", "", tag.lower()) for tag in entry.tags} & STYLES):
        raise InputError(f"{path}: is tagged {', '.join(styles)}")
    model_file = path.read_bytes()
    for reason, pattern in UNFIT.items():
        if re.search(pattern, model_file):
            raise InputError(f"{path}: {reason}")
    source = read_gltf(path)
    if others := sorted(source.skipped.keys() & {"points", "lines"}):
        raise InputError(f"{path}: holds {' and '.join(others)}")
    thing = place(path, source)
    if (count := len(thing.scene.triangles)) < FEWEST:
        raise InputError(f"{path}: is too simple, {count} triangles")
    if thickness(thing.scene.vertices[np.unique(thing.scene.triangles)]) < THINNEST:
        raise InputError(f"{path}: is a single plane")
    return thing


def place(path: Path, source: Source) -> TrainingObject:
    """An object in the world frame, mended as `prep` does. Raises: InputError."""
    chosen = PrepOptions()
    working = repair(source, chosen.up, chosen.weld_tolerance, path)
    normals, _ = oriented(source, working, chosen.crease_angle)
    return TrainingObject(Scene(working.vertices, working.triangles, normals), TexturedModel(path, working.to_world))


def thickness(points: NDArray) -> float:
    """Extent along the direction in which the points (V, 3) spread least."""
    across = np.linalg.eigh(np.cov(points.T))[1][:, 0]
    return float(np.ptp(points @ across))
