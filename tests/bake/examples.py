"""Small meshes and materials as the stages before would hand them over."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from stages.core.artifact import Provenance, save_npz, sha256_file
from stages.core.frames import Y_UP_TO_WORLD, look_at, transform_points
from stages.core.polygons import triangulate
from stages.core.schemas import MATERIAL, PREP
from stages.core.texture_sets import TextureSet
from stages.material.recipe import EVEN, Recipe
from stages.material.residual import Residual, ResidualConfig
from stages.material.survey import EMPTY, Survey
from stages.prep.source import nothing_passed_on

IDENTITY = np.eye(4).reshape(-1).tolist()


@dataclass(frozen=True)
class Example:
    """A source mesh: vertices (V, 3), faces as lists of vertices, a UV (2,) per loop with v up, a chart per face."""

    vertices: NDArray
    faces: list[list[int]]
    loop_uv: NDArray
    chart: list[int]
    part: list[int]
    parts: list[dict[str, Any]]
    source_format: str = "ply"
    uv_kept: bool = False
    shared_texels: bool = False
    to_world: NDArray = field(default_factory=lambda: Y_UP_TO_WORLD)
    loop_normal: NDArray | None = None
    group: list[int] | None = None
    groups: tuple[str, ...] = ()
    set: list[int] | None = None
    sets: tuple[TextureSet, ...] = (TextureSet(),)

    def with_(self, **changes: Any) -> "Example":
        return replace(self, **changes)


def one_part(name: str = "thing", material: str = "", node: str = "") -> list[dict[str, Any]]:
    return [{"name": name, "material": material, "node": node, "transform": IDENTITY}]


def cube(gap: float = 0.02) -> Example:
    """A unit cube of six quads, one chart each, in a 3 x 2 atlas whose charts keep `gap` to their cell's border."""
    vertices = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    uv = [(np.array([k % 3, k // 3]) + gap + (1 - 2 * gap) * corners) / 3 for k in range(6)]
    return Example(vertices, faces, np.concatenate(uv).astype(np.float32), list(range(6)), [0] * 6, one_part())


def grid(n: int, height: Any = lambda x, y: 0 * x) -> Example:
    """An open sheet of n x n quads over the whole UV square but a rim; height: z of x and y in [0, 1]."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    vertices = np.stack([x - 0.5, y - 0.5, height(x, y)], -1).reshape(-1, 3)
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], -1).reshape(-1, 4)
    uv = (0.05 + 0.9 * np.stack([x, y], -1)).reshape(-1, 2)[quads.reshape(-1)]
    count = len(quads)
    identity = np.eye(4)
    return Example(vertices, quads.tolist(), uv.astype("f4"), [0] * count, [0] * count, one_part(), to_world=identity)


def prep_arrays(example: Example) -> dict[str, NDArray]:
    """The arrays of prep.npz."""
    size = np.array([len(face) for face in example.faces])
    loop_start = np.concatenate([[0], np.cumsum(size)]).astype("i4")
    loop_vertex = np.concatenate(example.faces).astype("i4")
    fan, face = triangulate(loop_start, example.vertices[loop_vertex])
    transforms = np.stack([np.reshape(part["transform"], (4, 4)) for part in example.parts])
    mirrored = np.linalg.det(transforms[:, :3, :3]) < 0
    fan = np.where(mirrored[np.array(example.part)[face], None], fan[:, [0, 2, 1]], fan)  # as a renderer sees them
    world = np.zeros_like(example.vertices, np.float64)
    for loop, part in zip(range(len(loop_vertex)), np.repeat(example.part, size), strict=True):
        vertex = loop_vertex[loop]
        if np.isfinite(example.vertices[vertex]).all():
            world[vertex] = transform_points(example.to_world @ transforms[part], example.vertices[vertex])
    world = world.astype("f4")
    corners = world[loop_vertex[fan]].astype("f8")
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    loops = np.arange(len(loop_vertex), dtype="i4")
    uv = example.loop_uv.astype("f4")
    has_normal = example.loop_normal is not None
    return {
        "vertices": world,
        "triangles": loop_vertex[fan].astype("i4"),
        "normals": np.repeat(normal[:, None], 3, 1).astype("f4"),
        "uv": uv[fan],
        "charts": np.array(example.chart, "i4")[face],
        "triangle_loops": fan.astype("i4"),
        "to_world": np.array(example.to_world, "f8"),
        "source_vertices": np.array(example.vertices, "f8"),
        "source_uv": (uv * (1, -1) + (0, 1) if example.source_format == "glb" else uv).astype("f4").astype("f8"),
        "source_normals": np.array(example.loop_normal if has_normal else np.zeros((0, 3)), "f4"),
        "loop_start": loop_start,
        "loop_vertex": loop_vertex,
        "loop_source_uv": loops if example.uv_kept else np.full(len(loops), -1, "i4"),
        "loop_source_normal": loops if has_normal else np.full(len(loops), -1, "i4"),
        "face_part": np.array(example.part, "i4"),
        "face_group": np.array(example.group or [-1] * len(example.faces), "i4"),
        "caster_vertices": np.zeros((0, 3), "f4"),
        "caster_triangles": np.zeros((0, 3), "i4"),
        "face_set": np.array(example.set or [0] * len(example.faces), "i4"),
        "loop_uv": uv,
        "source_tangents": np.zeros((0, 4), "f4"),
        "loop_source_tangent": np.full(len(loops), -1, "i4"),
        "source_images": np.zeros(0, "u1"),
    }


def save_prep(path: Path, example: Example) -> Path:
    """Write prep.npz."""
    extra = {
        "source_format": example.source_format,
        "source_name": f"thing.{example.source_format}",
        "uv_kept": example.uv_kept,
        "shared_texels": example.shared_texels,
        "parts": example.parts,
        "sets": [of.to_json() for of in example.sets],
        "groups": list(example.groups),
        "passed_on": nothing_passed_on(),
        "findings": {"vertices": len(example.vertices)},
    }
    save_npz(path, PREP, prep_arrays(example), Provenance({}, None, {"mesh": "0" * 64}, extra))
    return path


def small_residual(seed: int = 0, variation: float = 3.0) -> Residual:
    """A residual of four levels; variation: how far its features spread."""
    made = Residual(ResidualConfig(levels=4, log2_entries=12, base=4), torch.Generator().manual_seed(seed))
    with torch.no_grad():
        made.table.mul_(variation * 1e4)
    return made


EVEN_VALUES = torch.tensor((0.27, 0.27, 0.27, 0.55, 0.12))


def constant(material: tuple[float, ...]) -> Residual:
    """What makes one material of an even recipe, everywhere: albedo, roughness, metallic."""
    made = small_residual()
    with torch.no_grad():
        made.weights_1.zero_()
        made.bias_1.copy_(torch.logit(torch.tensor(material)) - torch.logit(EVEN_VALUES))
    return made


def ring_of_cameras(count: int, elevation: float = 0.5, distance: float = 3.0) -> NDArray[np.float64]:
    """c2w (N, 4, 4) of cameras around the z axis that look at the origin; elevation in radians."""
    azimuth = np.arange(count) * 2 * np.pi / max(count, 1)
    e = np.full(count, elevation)
    eye = distance * np.stack([np.cos(e) * np.cos(azimuth), np.cos(e) * np.sin(azimuth), np.sin(e)], -1)
    return look_at(eye, np.zeros(3), np.array([0.0, 0.0, 1.0]))


def cameras_around() -> NDArray[np.float64]:
    """c2w (N, 4, 4) of cameras from which all of a convex thing is seen."""
    return np.concatenate([ring_of_cameras(4, 0.6), ring_of_cameras(4, -0.6)])


def save_material(
    path: Path, prep: Path, residual: Residual, c2w: NDArray | None = None, recipe: Recipe = EVEN, survey: Survey = EMPTY
) -> Path:
    """Write material.npz for a prep.npz."""
    cameras = cameras_around() if c2w is None else c2w  # surface that no view saw takes long to fill
    arrays = {
        **survey.to_arrays(),
        **residual.to_arrays(),
        "curve_step": np.arange(2, dtype="i4"),
        "curve_loss": np.ones(2, "f4"),
        "c2w": cameras,
        "fov_y": np.full(len(cameras), 0.7),
        "size": np.array([64, 64], "i4"),
    }
    extra = {"recipe": recipe.to_json(), "residual": residual.config_dict()}
    extra |= {"prompt": "a thing", "parts": [{"name": "seat", "prompt": "velvet"}]}
    extra |= {"guidance": {"name": "none"}, "environments": []}
    save_npz(path, MATERIAL, arrays, Provenance({}, 5, {"prep": sha256_file(prep)}, extra))
    return path
