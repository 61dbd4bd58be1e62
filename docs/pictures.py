"""Draws the pictures of "How it works" from the artefacts of a run, such as `make demo`: python docs/pictures.py demo

light.jpg: what `conditions` knows of a view, and two materials that follow from it. layers.jpg: a material, coat by coat.
bounces.jpg: direct light alone, and with light between surfaces.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import torch
import trimesh
from numpy.typing import NDArray

from stages.asset.traced import traced_scene
from stages.bake.preview import Look, draw_view
from stages.bake.studio import backdrop, camera
from stages.core.artifact import load_npz
from stages.core.color import reinhard, srgb_encode
from stages.core.frames import look_at
from stages.core.images import labelled
from stages.core.schemas import MATERIAL, PREP
from stages.core.shading import Material, Transport, interpolate, shade
from stages.light.gbuffer import GBuffer, trace_view
from stages.light.lights import clear_sky, preview_light
from stages.light.scene import Scene
from stages.light.transport import QUALITY, light_transport
from stages.material.evaluate import evaluate
from stages.material.learnt import LearntMaterial
from stages.material.surface import Surface

HERE = Path(__file__).parent
SIZE, FOV_Y, EYE = 360, np.radians(30.0), (2.2, -0.9, 0.75)
EXPOSURE = 1.6


def main(run: Path) -> None:
    """All pictures. Args: run: a folder with prep.npz and material.npz."""
    mesh, made = load_npz(run / "prep.npz", PREP), load_npz(run / "material.npz", MATERIAL)
    scene, c2w = traced_scene(mesh), look_at(np.array(EYE), np.zeros(3), np.array([0.0, 0.0, 1.0]))
    points = trace_view(scene, c2w, float(FOV_Y), SIZE, SIZE)
    transport = light_transport(scene, points, [clear_sky()], QUALITY["high"], seed=0)[0]
    write(HERE / "light.jpg", light(points, transport, c2w), across=4)
    learnt = LearntMaterial.of(run / "material.npz", made)
    write(HERE / "layers.jpg", layers(points, transport, learnt), across=len(learnt.recipe.coats) + 1)
    write(HERE / "bounces.jpg", bounces(scene), across=3)


def bounces(scene: Scene) -> list[tuple[str, NDArray]]:
    """A mesh of chrome, its inside in white plaster, and a red cushion on a white bench: without bounces, then with four."""
    chrome, plaster, cloth = (0.55, 0.56, 0.56, 0.05, 1), (0.85, 0.83, 0.8, 0.9, 0), (0.65, 0.02, 0.03, 0.85, 0)
    bench, of_cushion = cushioned_bench()
    plain = np.zeros(len(scene.triangles), np.int64)
    looks = (*(even_look(scene, [one], plain) for one in (chrome, plaster)), even_look(bench, [plaster, cloth], of_cushion))
    cells = []
    for count, name in ((0, "direct light"), (4, "with four bounces")):
        for look, azimuth, elevation in zip(looks, (35, 35, 50), (12, 62, 24), strict=True):
            drawn = look.under([preview_light()], count)
            c2w = camera(look.scene.vertices.astype(np.float64), azimuth, elevation)
            cells.append((name, srgb_encode(draw_view(drawn, preview_light(), c2w, SIZE).over(backdrop(SIZE)))))
    return cells


def cushioned_bench() -> tuple[Scene, NDArray[np.int64]]:
    """A seat, a back and a side of white board, a cushion upon it; and which triangles are the cushion's."""
    boards = (((1, 0.6, 0.06), (0, 0, -0.12)), ((1, 0.06, 0.5), (0, -0.27, 0.16)), ((0.06, 0.6, 0.36), (-0.47, 0, 0.09)))
    parts = [trimesh.creation.box(size, trimesh.transformations.translation_matrix(at)) for size, at in boards]
    cushion = trimesh.creation.icosphere(subdivisions=5)
    v = cushion.vertices
    rounded = np.sign(v) * np.abs(v / np.abs(v).max(1, keepdims=True)) * np.linalg.norm(v, axis=1, keepdims=True)
    cushion.vertices = (0.35 * v + 0.65 * rounded) * (0.36, 0.24, 0.09) + (0.06, 0.03, 0.0)
    parts.append(cushion)
    starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    triangles = np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=True)])
    flat = [np.repeat(part.face_normals[:, None], 3, 1) for part in parts[:-1]]
    normals = np.concatenate([*flat, cushion.vertex_normals[cushion.faces]])
    of_cushion = np.repeat(np.arange(4) == 3, [len(part.faces) for part in parts]).astype(np.int64)
    return Scene(np.concatenate([part.vertices for part in parts]), triangles, normals), of_cushion


def even_look(scene: Scene, kinds: list[tuple[float, ...]], which: NDArray[np.int64]) -> Look:
    """A mesh each of whose triangles is of one of some even materials."""
    uv = np.full((len(which), 3, 2), 0.5, np.float32)
    uv[:, :, 0] = ((which + 0.5) / len(kinds))[:, None]
    return Look(scene, uv, [np.array([kinds], np.float32)], np.zeros(len(which), np.int32))


def light(points: GBuffer, transport: Transport, c2w: NDArray) -> list[tuple[str, NDArray]]:
    """Geometry, light at four roughnesses, and two materials."""
    count = len(points.n)
    depth = points.depth[points.mask][:, None]
    normal = points.n @ c2w[:3, :3].astype(np.float32)
    near = 1 - (depth - depth.min()) / np.ptp(depth)
    cells = [("depth", np.repeat(0.15 + 0.8 * near, 3, 1)), ("normal", 0.5 + 0.5 * normal), ("E, diffuse", lit(transport.E))]
    for roughness in (0.16, 0.5):
        A, _ = interpolate(transport, torch.full((count,), roughness))
        cells.append((f"A, roughness {roughness}", lit(A)))
    _, B = interpolate(transport, torch.full((count,), 0.16))
    cells.append(("B, roughness 0.16", lit(B)))
    for name, material in (("glazed blue", (0.03, 0.1, 0.4, 0.12, 0)), ("rough brass", (0.85, 0.6, 0.3, 0.36, 1))):
        values = torch.tensor(material, dtype=torch.float32).expand(count, 5)
        cells.append((name, lit(shade(transport, Material.of(values)))))
    return [(name, image(points, np.asarray(values))) for name, values in cells]


def layers(points: GBuffer, transport: Transport, learnt: LearntMaterial) -> list[tuple[str, NDArray]]:
    """The material with its base alone, then with one layer after the other, and its albedo."""
    footprint = np.full(len(points.n), 2 * np.tan(FOV_Y / 2) * np.linalg.norm(EYE) / SIZE, np.float32)
    surface = learnt.lookup.surface(points.point, points.n, footprint)
    cells = []
    for count in range(len(learnt.recipe.layers) + 1):
        recipe = replace(learnt.recipe, layers=learnt.recipe.layers[:count])
        values = torch.from_numpy(np.ascontiguousarray(pieces(recipe, surface, learnt)))
        name = recipe.coats[-1].said.split(" ")[-1] or recipe.coats[-1].look
        cells.append((name if not count else f"+ {name}", image(points, lit(shade(transport, Material.of(values))))))
    return [*cells, ("albedo alone", image(points, srgb_encode(values[:, :3].numpy())))]


def pieces(recipe, surface: Surface, learnt: LearntMaterial) -> NDArray[np.float32]:  # type: ignore[no-untyped-def]
    """Albedo, roughness and metallic of the points, (P, 5)."""
    return evaluate(recipe, surface, learnt.lookup.survey.pieces)[:, :5]


def lit(radiance: torch.Tensor) -> NDArray[np.float32]:
    """Encoded for display, all at one exposure."""
    return np.asarray(srgb_encode(reinhard(EXPOSURE * radiance)))


def image(points: GBuffer, values: NDArray) -> NDArray[np.float32]:
    """Values of the hits (P, 3) on white, (H, W, 3)."""
    canvas = np.ones((*points.mask.shape, 3), np.float32)
    canvas[points.mask] = values
    return canvas


def write(path: Path, cells: list[tuple[str, NDArray]], across: int) -> None:
    """A JPEG of pictures with their names, some in each row."""
    named = [labelled(picture, name) for name, picture in cells]
    rows = [np.concatenate(named[k : k + across], 1) for k in range(0, len(named), across)]
    pixels = (np.clip(np.concatenate(rows, 0), 0, 1) * 255 + 0.5).astype(np.uint8)
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "uint8")
    spec["jpeg:quality"] = 88
    file = oiio.ImageOutput.create(str(path))
    if not (file and file.open(str(path), spec) and file.write_image(np.ascontiguousarray(pixels)) and file.close()):
        sys.exit(f"{path}: cannot be written")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
