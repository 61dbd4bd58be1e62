"""A baked asset read back: its maps at the texels that a view saw, and where these lie on the surface."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.bake.raster import covered_samples
from stages.bake.stage import Subject, views_of
from stages.bake.visibility import seen_points
from stages.core.artifact import load_npz, read_exr
from stages.core.schemas import MATERIAL, PREP
from stages.light.scene import Scene


@dataclass(frozen=True)
class Baked:
    """Texels whose centre a view saw. maps: (T, 5) linear; point: (T, 3) world; triangle: (T,); barycentric: (T, 3)."""

    maps: NDArray[np.float32]
    point: NDArray[np.float32]
    triangle: NDArray[np.int32]
    barycentric: NDArray[np.float32]
    scene: Scene


def read_baked(prep: Path, material: Path, asset: Path) -> Baked:
    """The seen texels of an asset folder. Raises: ArtifactError."""
    maps = np.concatenate([_channels(asset / f"{name}.exr") for name in ("albedo", "roughness", "metallic")], -1)
    size = len(maps)
    made, mesh = load_npz(material, MATERIAL), load_npz(prep, PREP)
    subject = Subject.of(prep, mesh, size)
    surface = covered_samples(subject.layout, 1, range(size))
    on_chart = surface.triangle >= 0
    seen = seen_points(subject.scene, surface.where(on_chart), views_of(made), subject.open)
    points = surface.where(on_chart)[np.flatnonzero(seen)]
    weights = np.c_[points.barycentric, 1 - points.barycentric.sum(1)]
    point = subject.scene.point(points.triangle, weights)
    return Baked(maps[on_chart][seen], point, points.triangle, weights.astype(np.float32), subject.scene)


def _channels(path: Path) -> NDArray[np.float32]:
    """(H, W, C) of an EXR, colours in the order R, G, B."""
    found = read_exr(path).channels
    return np.stack([found[c] for c in ("RGB" if len(found) > 1 else found)], -1).astype(np.float32)
