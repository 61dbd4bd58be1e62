"""A baked asset read back: its maps at the texels that a view saw, and where these lie on the surface."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.bake.raster import Surface, covered_samples, joined
from stages.bake.stage import subjects, views_of
from stages.bake.visibility import seen_points
from stages.core.artifact import load_npz, read_exr, read_manifest
from stages.core.schemas import ASSET, MATERIAL, PREP
from stages.core.texture_sets import texture_sets
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
    """The seen texels of an asset folder, of all texture sets. Raises: ArtifactError."""
    made, mesh = load_npz(material, MATERIAL), load_npz(prep, PREP)
    rows, found = list[NDArray[np.float32]](), list[Surface]()
    for subject in subjects(prep, mesh, texture_sets(read_manifest(asset, ASSET)[0])):
        names = (subject.set.file(f"{name}.exr") for name in ("albedo", "roughness", "metallic"))
        maps = np.concatenate([_channels(asset / name) for name in names], -1)
        surface = covered_samples(subject.layout, 1, range(len(maps)))
        on_chart = surface.triangle >= 0
        seen = seen_points(subject.scene, surface.where(on_chart), views_of(made), subject.open)
        rows.append(maps[on_chart][seen])
        found.append(surface.where(on_chart)[np.flatnonzero(seen)])
    points = joined(found)
    weights = np.c_[points.barycentric, 1 - points.barycentric.sum(1)]
    point = subject.scene.point(points.triangle, weights)
    return Baked(np.concatenate(rows), point, points.triangle, weights.astype(np.float32), subject.scene)


def _channels(path: Path) -> NDArray[np.float32]:
    """(H, W, C) of an EXR, colours in the order R, G, B."""
    found = read_exr(path).channels
    return np.stack([found[c] for c in ("RGB" if len(found) > 1 else found)], -1).astype(np.float32)
