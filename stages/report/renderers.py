"""The same view in Mitsuba 3 and in Cycles, for comparison: speed and error of one light map, each against its own
converged result.

Each renderer has a Python environment of its own. This file is run there as a script, which reads and writes folders of
.npy files. The material is each renderer's principled one, white, roughness 0.5, with direct light alone: the integral is
the same kind, not the same to the last digit, which is why each is compared with itself.
"""

import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SAMPLES = (16, 64)
"""Samples a pixel that are timed."""

CONVERGED = 512
"""Samples a pixel of the result that errors are taken against: its own noise adds 6 % to the error of 64 samples."""

BATCH = 256
"""Samples a pixel of one pass, which bounds memory."""

NEEDS = {
    "mitsuba": "the packages mitsuba and numpy and LLVM 15 or newer (DRJIT_LIBLLVM_PATH names its library)",
    "cycles": "the package bpy, 4.2 or newer",
}
"""What each renderer's environment must have."""

MAPS = 6
"""Light maps of one environment, each a rendering of its own there."""

MAP = "m0_r0.5"
"""The one that is rendered."""


@dataclass(frozen=True)
class Render:
    """One timed rendering of the white dielectric of roughness 0.5. Errors in percent, tone-mapped, over the object.

    all_maps_seconds: of the six light maps of every environment, at this many samples. times_as_long: as dreammat, for all
    of them, with as many samples as the error of our same map takes: error falls with the root of the samples.
    """

    renderer: str
    environment: str
    samples: int
    seconds: float
    all_maps_seconds: float
    rmse_percent: float
    p999_percent: float
    times_as_long: float


@dataclass(frozen=True)
class Job:
    """A view: `stages.light.scene.Scene`, camera to world, fov in radians, pixels, environments."""

    scene: "object"
    c2w: np.ndarray
    fov_y: float
    size: int
    environments: tuple


def measure(
    renderer: str, python: str, job: Job, mask: np.ndarray, ours: dict[str, tuple[float, float]]
) -> list[Render]:
    """Render every environment with the given interpreter.

    Args:
        renderer: one of NEEDS. ours: of each environment, our seconds for all maps and the RMSE of MAP, percent.
    Raises: InputError when the interpreter or the renderer fails.
    """
    from stages.core.color import reinhard  # not to be had where this file runs as a script
    from stages.core.errors import InputError

    renders = []
    with tempfile.TemporaryDirectory() as folder:
        for environment in job.environments:
            given, made = Path(folder) / f"{environment.name}_job", Path(folder) / f"{environment.name}_result"
            mesh = {name: getattr(job.scene, name) for name in ("vertices", "triangles", "normals")}
            write_arrays(given, mesh | {"c2w": job.c2w, "fov_y": job.fov_y, "size": job.size, "radiance": environment.radiance})
            try:
                subprocess.run([python, __file__, renderer, str(given), str(made)], check=True, capture_output=True)
            except (OSError, subprocess.CalledProcessError) as error:
                said = (getattr(error, "stderr", None) or str(error).encode()).decode(errors="replace").strip()
                raise InputError(f"{python}: {said.splitlines()[-1]}; expected a Python with {NEEDS[renderer]}") from error
            result = read_arrays(made)
            tone = {samples: reinhard(result[str(samples)][mask]) for samples in (*SAMPLES, CONVERGED)}
            seconds = dict(zip(SAMPLES, result["seconds"].tolist(), strict=True))
            for samples in SAMPLES:
                off = np.abs(tone[samples] - tone[CONVERGED])
                rmse, p999 = float(np.sqrt(np.square(off).mean())), float(np.quantile(off, 0.999))
                everything = seconds[samples] * MAPS * len(job.environments)
                own_seconds, own_rmse = ours[environment.name]
                ratio = everything / own_seconds * (rmse * 100 / own_rmse) ** 2
                row = (samples, seconds[samples], everything, rmse * 100, p999 * 100, ratio)
                renders.append(Render(renderer, environment.name, *row))
    return renders


def write_arrays(folder: Path, arrays: dict) -> None:
    """Each array as <name>.npy."""
    folder.mkdir()
    for name, array in arrays.items():
        np.save(folder / f"{name}.npy", array, allow_pickle=False)


def read_arrays(folder: Path) -> dict[str, np.ndarray]:
    """What `write_arrays` wrote."""
    return {path.stem: np.load(path, allow_pickle=False) for path in folder.glob("*.npy")}


def pole_to_pole(image: np.ndarray) -> np.ndarray:
    """A light as Mitsuba's `envmap` reads it: its first and last rows lie on the poles, ours half a row away from them.

    Bilinear look-ups are the same everywhere, for ours are linear between rows that are among those of the result.
    Args: (H, W, 3). Returns: (2 H + 1, W, 3).
    """
    rows = np.repeat(image, 2, 0)
    padded = np.concatenate([rows[:1], rows, rows[-1:]])
    return ((padded[1:] + padded[:-1]) / 2).astype(np.float32)


def mitsuba(given: str, made: str) -> None:
    """What runs inside of Mitsuba's environment."""
    import mitsuba as mi  # type: ignore[import-not-found]

    mi.set_variant("llvm_ad_rgb")
    job = read_arrays(Path(given))
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "hide_emitters": True},
            "mesh": mitsuba_mesh(mi, job),
            "light": {
                "type": "envmap",
                "bitmap": mi.Bitmap(pole_to_pole(job["radiance"])),
                "to_world": mi.ScalarTransform4f([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),
            },
            "sensor": {
                "type": "perspective",
                "fov": float(np.degrees(job["fov_y"])),
                "fov_axis": "y",
                "to_world": mi.ScalarTransform4f((job["c2w"] @ np.diag([-1.0, 1.0, -1.0, 1.0])).tolist()),
                "film": {
                    "type": "hdrfilm",
                    "width": int(job["size"]),
                    "height": int(job["size"]),
                    "pixel_format": "rgb",
                    "rfilter": {"type": "box"},
                },
            },
        }
    )
    images, seconds = {}, []
    np.array(mi.render(scene, spp=4, seed=999))  # compiles
    for samples in SAMPLES:
        start = time.perf_counter()
        images[str(samples)] = np.array(mi.render(scene, spp=samples, seed=samples))
        seconds.append(time.perf_counter() - start)
    batches = [np.array(mi.render(scene, spp=BATCH, seed=10_000 + i)) for i in range(CONVERGED // BATCH)]
    write_arrays(Path(made), images | {"seconds": np.array(seconds), str(CONVERGED): np.mean(batches, 0)})


def mitsuba_mesh(mi, job):  # type: ignore[no-untyped-def]
    """The working mesh, its corners apart so that each keeps its normal."""
    corners = job["triangles"].reshape(-1)
    properties = mi.Properties()
    material = {"type": "principled", "base_color": {"type": "rgb", "value": 1.0}, "roughness": 0.5, "metallic": 0.0}
    properties["bsdf"] = mi.load_dict({"type": "twosided", "nested": material})
    mesh = mi.Mesh("mesh", len(corners), len(job["triangles"]), has_vertex_normals=True, props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = job["vertices"][corners].ravel()
    parameters["vertex_normals"] = job["normals"].reshape(-1, 3).ravel()
    parameters["faces"] = np.arange(len(corners), dtype=np.uint32)
    parameters.update()
    return mesh


def cycles(given: str, made: str) -> None:
    """What runs inside of Blender's environment."""
    import bpy  # type: ignore[import-not-found]

    job = read_arrays(Path(given))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    cycles_scene(bpy, scene, job)
    size, images, seconds = int(job["size"]), {}, []
    cycles_render(bpy, scene, 1, 999, made)  # builds what later renders keep
    for samples in SAMPLES:
        start = time.perf_counter()
        picture = cycles_render(bpy, scene, samples, samples, made)
        seconds.append(time.perf_counter() - start)
        images[str(samples)] = picture.reshape(size, size, 3)
    images[str(CONVERGED)] = cycles_render(bpy, scene, CONVERGED, 10_000, made).reshape(size, size, 3)
    write_arrays(Path(made), images | {"seconds": np.array(seconds)})


def cycles_render(bpy, scene, samples: int, seed: int, made: str) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Linear radiance, (pixels, 3), the first row on top. Reading the file back is a few hundredths of a second."""
    scene.cycles.samples, scene.cycles.seed = samples, seed
    scene.render.filepath = f"{made}.exr"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    rows = np.array(image.pixels, np.float32).reshape(image.size[1], -1, 4)[::-1, :, :3].reshape(-1, 3)
    bpy.data.images.remove(image)
    return rows


def cycles_scene(bpy, scene, job) -> None:  # type: ignore[no-untyped-def]
    """The view: mesh, white material, environment, camera; direct light only, no denoiser."""
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = int(job["size"])
    scene.render.film_transparent = scene.render.use_persistent_data = True
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0
    scene.cycles.pixel_filter_type = "BOX"
    mesh = bpy.data.meshes.new("mesh")
    mesh.from_pydata(job["vertices"].tolist(), [], job["triangles"].tolist())
    mesh.shade_smooth()
    mesh.normals_split_custom_set(job["normals"].reshape(-1, 3).tolist())
    material = bpy.data.materials.new("white")
    material.use_nodes = True
    principled = material.node_tree.nodes["Principled BSDF"].inputs
    principled["Base Color"].default_value, principled["Roughness"].default_value = (1, 1, 1, 1), 0.5
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("mesh", mesh))
    height, width, _ = job["radiance"].shape
    light = bpy.data.images.new("light", width, height, float_buffer=True, is_data=True)
    light.pixels.foreach_set(np.dstack([job["radiance"], np.ones((height, width))])[::-1].astype(np.float32).ravel())
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    nodes, links = scene.world.node_tree.nodes, scene.world.node_tree.links
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image = light
    links.new(texture.outputs["Color"], nodes["Background"].inputs["Color"])
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle_y = "VERTICAL", float(job["fov_y"])
    camera.clip_start = 0.01
    scene.camera = bpy.data.objects.new("camera", camera)
    scene.collection.objects.link(scene.camera)
    scene.camera.matrix_world = job["c2w"].T.tolist()  # Blender takes columns


if __name__ == "__main__":
    {"mitsuba": mitsuba, "cycles": cycles}[sys.argv[1]](*sys.argv[2:])
