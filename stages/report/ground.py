"""A mesh that materials are measured on: texels of a bake that a view saw, and the light that falls there.

What is measured of many materials on one mesh needs its texels and their light once, and no textures written.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

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
from stages.core.color import luminance
from stages.core.schemas import CAMERAS, MATERIAL, PREP
from stages.core.shading import Transport
from stages.core.texture_sets import texture_sets
from stages.light.environment import Environment
from stages.light.gbuffer import GBuffer, trace_view
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

PICTURES, PICTURE = 3, 256
"""Views in which a material is looked at as a picture, and the pixels along their edges."""


class Pictures(NamedTuple):
    """Linear luminance of albedo, (H, W) a view, of a material and of its recipe alone; masks: where the object is."""

    found: list[NDArray[np.float32]]
    recipe: list[NDArray[np.float32]]
    masks: list[NDArray[np.bool_]]


@dataclass(frozen=True)
class Ground:
    """T texel centres, and the views that saw them. point, normal: (T, 3) world. footprint: (T,) edge of a texel. label: (T,)
    of the parts. triangle: (T,); barycentric: (T, 3)."""

    scene: Scene
    views: Views
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
        return Ground(subject.scene, views, point, normal, width, subject.label[some.triangle], some.triangle, weights)

    def material(self, path: Path) -> NDArray[np.float32]:
        """A material as a bake evaluates it, (T, 5) linear. Raises: ArtifactError."""
        return _values(_read(path), self.point, self.normal, self.footprint, self.label)

    def pictures(self, path: Path) -> Pictures:
        """A material of an object without parts, in some of the views. Raises: ArtifactError."""
        learnt, found, recipe = _read(path), list[NDArray](), list[NDArray]()
        for view, footprint in self._seen:
            at = view.point.astype(np.float32), view.n, footprint, np.zeros(len(footprint), np.int32)
            for into, values in ((found, _values(learnt, *at)), (recipe, _recipe(learnt, *at))):
                into.append(np.zeros(view.mask.shape, np.float32))
                into[-1][view.mask] = luminance(values[:, :3])
        return Pictures(found, recipe, [view.mask for view, _ in self._seen])

    @cached_property
    def _seen(self) -> list[tuple[GBuffer, NDArray[np.float32]]]:
        """Views from all around, and the width of each of their object pixels."""
        found = []
        for k in self.views.spread_out()[:PICTURES]:
            view = trace_view(self.scene, self.views.c2w[k], float(self.views.fov_y[k]), PICTURE, PICTURE)
            width = 2 * np.tan(float(self.views.fov_y[k]) / 2) / PICTURE
            found.append((view, (width * view.depth[view.mask]).astype(np.float32)))
        return found

    @cached_property
    def lit(self) -> NDArray[np.int64]:
        """Rows of the texels at which light is traced."""
        return np.sort(np.random.default_rng(0).choice(len(self.point), min(POINTS, len(self.point)), replace=False))

    @cached_property
    def irradiance(self) -> NDArray[np.float32]:
        """Under all lights of the program together, (lit, 3)."""
        return torch.stack([t.E for t in self._traced(list(read_lights(())[0]))]).sum(0).numpy()

    @cached_property
    def openness(self) -> NDArray[np.float32]:
        """What matt white gives back of an even sky, (lit, 3): 0.96 in the open, since it mirrors the rest."""
        return self._traced([Environment("even", np.ones((16, 32, 3), np.float32))])[0].E.numpy()

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


def _read(path: Path) -> LearntMaterial:
    return LearntMaterial.of(path, load_npz(path, MATERIAL))


def _recipe(learnt: LearntMaterial, point: NDArray, normal: NDArray, footprint: NDArray, label: NDArray) -> NDArray[np.float32]:
    """The recipe's material of points, (P, 5) linear."""
    surface = learnt.lookup.surface(point, normal, footprint, label)
    return np.ascontiguousarray(evaluate(learnt.recipe, surface, learnt.lookup.survey.pieces)[:, :5])


def _values(learnt: LearntMaterial, point: NDArray, normal: NDArray, footprint: NDArray, label: NDArray) -> NDArray[np.float32]:
    """The same with what was learnt on top."""
    base = _recipe(learnt, point, normal, footprint, label)
    return with_residual(base, evaluate_residual(learnt.residual, point))
