"""Assets in Cycles and in three.js beside preview.png: the same light, cameras and exposure, PSNR over the object.

What is rendered is what others would open: model.glb with its own textures, normals and tangents, and preview_light.exr
as the world; preview.json has the cameras. Blender has a Python of its own, in which this file is run as a script.
Cycles: with as many bounces as the preview has, none by default; Principled's GGX without multiple scattering, as in glTF.
What shines is seen and lights nothing else, as in the preview and in engines.
three.js: its standard material and image-based lighting as they come, in headless Chromium (`stages.report.three`).
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from stages.report.options import PreviewReportOptions

SAMPLES = 128
"""Of Cycles, a pixel: with half of them its noise is most of the difference where it is dark."""

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

    asset: str
    renderer: str
    view: int
    psnr: float


def report_preview(assets: Sequence[Path], out: Path, options: "PreviewReportOptions") -> list[Beside]:
    """Render each model.glb elsewhere and compare; writes preview.csv and pictures: ours, theirs, difference.

    Raises: ArtifactError, InputError.
    """
    from stages.core.artifact import read_json, write_text  # not to be had where this file runs as a script
    from stages.core.errors import InputError
    from stages.core.images import read_image, write_png
    from stages.report.three import draw

    if not (options.cycles or options.three):
        raise InputError("nothing to compare with; give --cycles PYTHON, --three FOLDER, or both")
    named = {named_asset(asset): asset for asset in assets}
    if len(named) < len(assets):
        raise InputError("two assets of one name, which their pictures would share; compare one after the other")
    out.mkdir(parents=True, exist_ok=True)
    rows = []
    for name, asset in named.items():
        studio, ours = read_json(asset / "preview.json"), read_image(asset / "preview.png")[..., :3]
        for renderer, given, drawing in (("cycles", options.cycles, in_blender), ("three", options.three, draw)):
            if given:
                theirs = drawing(given, asset, [studio["views"][view] for view in VIEWS], studio)
                found, picture = compared(ours, theirs, studio)
                rows += [Beside(name, renderer, view, psnr) for view, psnr in zip(VIEWS, found, strict=True)]
                write_png(out / f"preview_{name}_{renderer}.png", picture)
        write_text(out / "preview.csv", table(rows))  # after each asset: some take minutes
    return rows


def compared(sheet: np.ndarray, theirs: list[np.ndarray], studio: dict) -> tuple[list[float], np.ndarray]:
    """PSNR of each view, and one picture: a column a view, ours, theirs, difference. Args: sheet: preview.png."""
    found, strips = [], []
    for view, picture in zip(VIEWS, theirs, strict=True):
        a, (b, on) = cell(sheet, studio, view), shown(picture, studio)
        found.append(psnr(a, b, on))
        strips.append(np.concatenate([a, b, np.abs(a - b).clip(0, 1 / GAIN) * GAIN], 0))
    return found, np.concatenate(strips, 1)


def named_asset(asset: Path) -> str:
    """The name of an asset's mesh. Raises: ArtifactError where a file that is compared is not as it was written."""
    from stages.core.artifact import intact, read_manifest
    from stages.core.schemas import ASSET

    provenance, files = read_manifest(asset, ASSET)
    for name in NEEDED:
        intact(asset, name, files)
    return Path(provenance.extra["source_name"]).stem


def table(rows: list[Beside]) -> str:
    """preview.csv."""
    lines = ["asset,renderer,view,psnr_db", *(f"{row.asset},{row.renderer},{row.view},{row.psnr:.2f}" for row in rows)]
    return "\n".join(lines) + "\n"


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


def in_blender(python: str, asset: Path, views: list[dict], studio: dict, model: str = "model.glb") -> list[np.ndarray]:
    """The views in Cycles: radiance and alpha (S, S, 4), premultiplied. Args: model: .glb or .obj. Raises: InputError."""
    from stages.core.errors import InputError

    with tempfile.TemporaryDirectory() as folder:
        size, fov_y = studio["size"], studio["fov_y"]
        job = {"model": model, "views": [view["c2w"] for view in views], "size": size, "fov_y": fov_y}
        job["bounces"] = studio.get("bounces", 0)
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
    scene.cycles.samples, scene.cycles.pixel_filter_type = SAMPLES, "BOX"
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = scene.cycles.glossy_bounces = job["bounces"]
    scene.cycles.sample_clamp_indirect = 0
    load = bpy.ops.wm.obj_import if job["model"].endswith(".obj") else bpy.ops.import_scene.gltf
    load(filepath=str(Path(asset) / job["model"]))
    for material in bpy.data.materials:
        material.cycles.emission_sampling = "NONE"  # else each triangle that might shine takes samples from the light
        for node in material.node_tree.nodes if material.use_nodes else ():
            if node.type == "BSDF_PRINCIPLED":
                node.distribution = "GGX"
                only_seen(material.node_tree, node.inputs["Emission Strength"])
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


def only_seen(tree: Any, strength: Any) -> None:
    """Let a material shine for the camera alone: a ray that leaves a surface would find its light even at no bounces."""
    seen = tree.nodes.new("ShaderNodeMath")
    seen.operation, seen.inputs[1].default_value = "MULTIPLY", strength.default_value
    tree.links.new(tree.nodes.new("ShaderNodeLightPath").outputs["Is Camera Ray"], seen.inputs[0])
    tree.links.new(seen.outputs[0], strength)


if __name__ == "__main__":
    cycles(*sys.argv[1:])
