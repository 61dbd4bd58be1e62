"""A mesh that materials are measured on: texels of a bake that a view saw, and the light that falls there.

What is measured of many materials on one mesh needs its texels and their light once, and no textures written.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from stages.bake.evaluate import evaluate as evaluate_residual
from stages.bake.raster import Surface, covered_samples, joined
from stages.bake.sizes import sized
from stages.bake.stage import subjects
from stages.bake.texels import texel_size
from stages.bake.visibility import Views, seen_points
from stages.conditions.stage import read_lights
from stages.core.artifact import load_npz
from stages.core.schemas import CAMERAS, MATERIAL, PREP
from stages.core.shading import Transport
from stages.core.texture_sets import texture_sets
from stages.light.environment import Environment
from stages.light.gbuffer import GBuffer
from stages.light.lights import preview_light
from stages.light.scene import Scene
from stages.light.transport import Quality, light_transport
from stages.material.evaluate import evaluate
from stages.material.learnt import LearntMaterial
from stages.material.stored import with_residual

TEXELS = 16_000
"""Texels that are looked at, of all that a view saw."""

POINTS = 3000
"""Of these, those at which light is traced."""

RAYS = Quality(96, 32, extra=False, smooth=False)
"""Points are loose: neighbours in memory are none on the surface."""

LIFT = 1e-4
"""Distance from the surface at which rays start, object sizes."""

TURNS = (0.0, 0.33, 0.67)
"""Turns of the relighting environment, shares of a circle: three lights that were never trained on."""


@dataclass(frozen=True)
class Ground:
    """T texel centres. point, normal: (T, 3) world. footprint: (T,) edge of a texel. label: (T,) of the parts. triangle: (T,);
    barycentric: (T, 3)."""

    scene: Scene
    point: NDArray[np.float32]
    normal: NDArray[np.float32]
    footprint: NDArray[np.float32]
    label: NDArray[np.int32]
    triangle: NDArray[np.int32]
    barycentric: NDArray[np.float32]

    @staticmethod
    def of(prep: Path, conditions: Path, size: int) -> "Ground":
        """Texels of a size² bake that a view of the conditions saw. Raises: ArtifactError."""
        mesh, cameras = load_npz(prep, PREP), load_npz(conditions / "cameras.npz", CAMERAS)
        corners = mesh["vertices"][mesh["triangles"]]
        views = Views(cameras["c2w"], cameras["fov_y"], int(cameras["width"]), int(cameras["height"]))
        found, widths = list[Surface](), list[NDArray[np.float32]]()
        for subject in subjects(prep, mesh, sized(texture_sets(mesh.provenance), size)):
            surface = covered_samples(subject.layout, 1, range(size))
            surface = surface.where(surface.triangle >= 0)
            found.append(surface[np.flatnonzero(seen_points(subject.scene, surface, views, subject.open))])
            widths.append(texel_size(corners, subject.layout)[found[-1].triangle])
        chosen = np.sort(np.random.default_rng(0).permutation(sum(map(len, widths)))[:TEXELS])
        some, width = joined(found)[chosen], np.concatenate(widths)[chosen]
        weights = np.c_[some.barycentric, 1 - some.barycentric.sum(1)].astype(np.float32)
        point, normal = some.interpolate(corners), some.interpolate(mesh["normals"])
        return Ground(subject.scene, point, normal, width, subject.label[some.triangle], some.triangle, weights)

    def material(self, path: Path) -> NDArray[np.float32]:
        """A material as a bake evaluates it, (T, 5) linear. Raises: ArtifactError."""
        learnt = LearntMaterial.of(path, load_npz(path, MATERIAL))
        surface = learnt.lookup.surface(self.point, self.normal, self.footprint, self.label)
        base = np.ascontiguousarray(evaluate(learnt.recipe, surface, learnt.lookup.survey.pieces)[:, :5])
        return with_residual(base, evaluate_residual(learnt.residual, self.point))

    @cached_property
    def lit(self) -> NDArray[np.int64]:
        """Rows of the texels at which light is traced."""
        return np.sort(np.random.default_rng(0).choice(len(self.point), min(POINTS, len(self.point)), replace=False))

    @cached_property
    def irradiance(self) -> NDArray[np.float32]:
        """Under all lights of the program together, (lit, 3)."""
        return torch.stack([t.E for t in self._traced(list(read_lights(())[0]))]).sum(0).numpy()

    @cached_property
    def new_lights(self) -> list[Transport]:
        """Of environments that nothing was trained on, at the lit texels."""
        light = preview_light()
        width = light.radiance.shape[1]
        turned = [Environment(f"{light.name}_{i}", np.roll(light.radiance, int(t * width), 1)) for i, t in enumerate(TURNS)]
        return [transport.to(torch.float32) for transport in self._traced(turned)]

    def _traced(self, lights: list[Environment]) -> list[Transport]:
        """The lit texels as points that are looked at from straight above."""
        triangle, weights, scene = self.triangle[self.lit], self.barycentric[self.lit], self.scene
        ng = scene.geometric_normal(triangle).astype(np.float32)
        n = scene.shading_normal(triangle, weights).astype(np.float32)
        point = self.point[self.lit].astype(np.float32)
        mask, depth = np.ones((1, len(point)), bool), np.ones((1, len(point)), np.float32)
        points = GBuffer(mask, depth, point, point + LIFT * ng, n, ng, n, triangle, weights)
        return light_transport(scene, points, lights, RAYS, 0)
