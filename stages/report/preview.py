"""An asset in Cycles and in three.js beside preview.png: the same light, cameras and exposure, PSNR over the object.

What is rendered is what others would open: model.glb with its own textures, normals and tangents, and preview_light.exr
as the world; preview.json has the cameras. Blender has a Python of its own, in which this file is run as a script.
Cycles: direct light alone, as the preview; Principled's GGX without multiple scattering, as in glTF.
three.js: its standard material and image-based lighting as they come, in headless Chromium (`three.html`).
"""

import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from stages.report.options import PreviewReportOptions

SAMPLES = 256
"""Of Cycles, a pixel: with a quarter of them its noise is most of the difference where it is dark."""

VIEWS = (0, 3, 6)
"""Which of the preview's views are compared: from before, from above, from below."""

COVER = 0.5
"""A pixel counts as the object where that covers more of it."""

NEEDED = ("model.glb", "preview.png", "preview.json", "preview_light.exr")
"""Files of the asset that the comparison reads."""

GAIN = 8
"""Of the difference, in the picture that shows it."""

FROM_GLTF = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""Blender turns +y up to +z when it imports."""


@dataclass(frozen=True)
class Beside:
    """One view in another renderer. psnr: dB of the encoded picture over the object."""

    renderer: str
    view: int
    psnr: float


def report_preview(asset: Path, out: Path, options: "PreviewReportOptions") -> list[Beside]:
    """Render model.glb elsewhere and compare; writes preview.csv and, for each renderer, a picture: ours, theirs, difference.

    Raises: ArtifactError, InputError.
    """
    from stages.core.artifact import (
        intact,
        read_json,
        read_manifest,
        write_text,
    )  # not to be had where this file runs as a script
    from stages.core.errors import InputError
    from stages.core.images import read_image, write_png
    from stages.core.schemas import ASSET
    from stages.report.three import draw

    if not (options.cycles or options.three):
        raise InputError("nothing to compare with; give --cycles PYTHON, --three FOLDER, or both")
    files = read_manifest(asset, ASSET)[1]
    for name in NEEDED:
        intact(asset, name, files)
    studio, ours = read_json(asset / "preview.json"), read_image(asset / "preview.png")[..., :3]
    out.mkdir(parents=True, exist_ok=True)
    rows = []
    for renderer, given, drawing in (("cycles", options.cycles, in_blender), ("three", options.three, draw)):
        if given:
            theirs = drawing(given, asset, [studio["views"][view] for view in VIEWS], studio)
            pairs = [(cell(ours, studio, view), *shown(picture, studio)) for view, picture in zip(VIEWS, theirs, strict=True)]
            rows += [Beside(renderer, view, psnr(a, b, on)) for view, (a, b, on) in zip(VIEWS, pairs, strict=True)]
            strips = [np.concatenate([a, b, np.abs(a - b).clip(0, 1 / GAIN) * GAIN], 0) for a, b, _ in pairs]
            write_png(out / f"preview_{renderer}.png", np.concatenate(strips, 1))
    lines = ["renderer,view,psnr_db", *(f"{row.renderer},{row.view},{row.psnr:.2f}" for row in rows)]
    write_text(out / "preview.csv", "\n".join(lines) + "\n")
    return rows


def cell(sheet: np.ndarray, studio: dict, view: int) -> np.ndarray:
    """One view of preview.png, (S, S, 3) encoded."""
    size, place = studio["size"], studio["views"][view]
    row, column = place["row"] * size, place["column"] * size
    return sheet[row : row + size, column : column + size]


def shown(picture: np.ndarray, studio: dict) -> tuple[np.ndarray, np.ndarray]:
    """Radiance and alpha (S, S, 4), premultiplied, as the preview shows it. Returns: (S, S, 3) encoded; where the object is."""
    from stages.core.color import srgb_encode

    alpha, ends = picture[..., 3:], studio["background"]
    backdrop = np.linspace(ends["top"], ends["bottom"], len(picture))[:, None, None]
    return srgb_encode(picture[..., :3] * studio["exposure"] + (1 - alpha) * backdrop), alpha[..., 0] > COVER


def psnr(a: np.ndarray, b: np.ndarray, on: np.ndarray) -> float:
    """dB between two encoded pictures where `on`."""
    return float(-10 * np.log10(np.square(a[on] - b[on]).mean()))


def in_blender(python: str, asset: Path, views: list[dict], studio: dict) -> list[np.ndarray]:
    """The views in Cycles: radiance and alpha (S, S, 4), premultiplied. Raises: InputError."""
    from stages.core.errors import InputError

    with tempfile.TemporaryDirectory() as folder:
        job = {"views": [view["c2w"] for view in views], "size": studio["size"], "fov_y": studio["fov_y"]}
        (Path(folder) / "job.json").write_text(json.dumps(job))
        try:
            subprocess.run([python, __file__, str(asset), folder], check=True, capture_output=True)
        except (OSError, subprocess.CalledProcessError) as error:
            said = (getattr(error, "stderr", None) or str(error).encode()).decode(errors="replace").strip()
            raise InputError(f"{python}: {said.splitlines()[-1]}; expected a Python with bpy, 4.2 or newer") from error
        return [np.load(Path(folder) / f"{k}.npy", allow_pickle=False) for k in range(len(views))]


def cycles(asset: str, folder: str) -> None:
    """What runs inside of Blender's environment."""
    import bpy  # type: ignore[import-not-found]

    job = json.loads((Path(folder) / "job.json").read_text())
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = job["size"]
    scene.render.film_transparent = scene.render.use_persistent_data = True
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.max_bounces, scene.cycles.samples, scene.cycles.pixel_filter_type = 0, SAMPLES, "BOX"
    bpy.ops.import_scene.gltf(filepath=str(Path(asset) / "model.glb"))
    for material in bpy.data.materials:
        material.cycles.emission_sampling = "NONE"  # what shines lights nothing else, as in the preview and in engines
        for node in material.node_tree.nodes if material.use_nodes else ():
            if node.type == "BSDF_PRINCIPLED":
                node.distribution = "GGX"
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    nodes, links = scene.world.node_tree.nodes, scene.world.node_tree.links
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image = bpy.data.images.load(str((Path(asset) / "preview_light.exr").resolve()))
    links.new(texture.outputs["Color"], nodes["Background"].inputs["Color"])
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle_y, camera.clip_start, camera.clip_end = "VERTICAL", job["fov_y"], 1e-4, 1e6
    scene.camera = bpy.data.objects.new("camera", camera)
    scene.collection.objects.link(scene.camera)
    for k, c2w in enumerate(job["views"]):
        scene.camera.matrix_world = (FROM_GLTF @ np.array(c2w)).T.tolist()  # Blender takes columns
        scene.render.filepath = f"{folder}/{k}.exr"
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        np.save(f"{folder}/{k}.npy", np.array(image.pixels, np.float32).reshape(job["size"], job["size"], 4)[::-1])
        bpy.data.images.remove(image)


if __name__ == "__main__":
    cycles(*sys.argv[1:])
