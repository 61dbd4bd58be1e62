"""Makes the references of `tests/light/test_blender_references.py` in Blender: a one-off, not a test.

    python -m tests.light.blender.references PYTHON [SHAPE]...        where PYTHON has the package bpy, 4.2 or newer

Each shape is seen by one camera under each environment. Blender renders depth, normal, a white Diffuse BSDF and white Glossy
BSDFs (GGX) of roughness 0, 0.5 and 1, shaded smooth, with one diffuse and one glossy bounce, 4,096 samples a pixel and no
denoiser; pictures leave it through its own Filmic view transform, 16 bit. Inside of Blender this file is run as a script.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[3]
GOLDEN = ROOT / "tests" / "golden" / "light"

SHAPES = ("knot", "shell", "totem")
ENVIRONMENTS = ("clear_sky", "studio", "interior")
SIZE = 64
SAMPLES = 4096
CAMERA = (1.5, 0.9, 1.0)
FOV = 40.0

TERMS = ("diffuse", "glossy_0", "glossy_0.5", "glossy_1")
"""White closures: Lambert's, and GGX by roughness."""


def job(shape: str) -> dict[str, np.ndarray]:
    """Mesh, largest extent 1, and camera."""
    from stages.core.frames import look_at
    from stages.report import shapes

    mesh = getattr(shapes, shape)()
    vertices = mesh.vertices - mesh.bounds.mean(0)
    vertices = (vertices / np.ptp(vertices, axis=0).max()).astype(np.float32)
    c2w = look_at(np.array(CAMERA), np.zeros(3), np.array([0.0, 0.0, 1.0]))
    view = {"c2w": c2w, "fov_y": np.radians(FOV), "size": np.array(SIZE)}
    return {"vertices": vertices, "triangles": mesh.faces.astype(np.int32), **view}


def main(python: str, *shapes: str) -> None:
    """Make the golden files of these shapes, or of all."""
    from stages.core.artifact import read_exr
    from stages.core.images import read_image
    from stages.light.lights import BUILTIN
    from stages.light.scene import Scene
    from stages.report.renderers import write_arrays

    GOLDEN.mkdir(exist_ok=True)
    for shape in shapes or SHAPES:
        given = job(shape)
        scene = Scene(given["vertices"], given["triangles"], np.zeros((len(given["triangles"]), 3, 3))).shaded_smooth()
        golden: dict[str, np.ndarray] = {}
        for environment in ENVIRONMENTS:
            with tempfile.TemporaryDirectory() as folder:
                inputs, made = Path(folder) / "job", Path(folder) / "made"
                radiance = BUILTIN[environment]().radiance
                write_arrays(inputs, given | {"normals": scene.normals, "radiance": radiance})
                made.mkdir()
                subprocess.run([python, __file__, "inside", str(inputs), str(made)], check=True, stdout=subprocess.DEVNULL)
                passes = read_exr(made / "passes.exr").channels
                names = {name.split(".", 1)[1]: name for name in passes}
                mask = passes[names["Combined.A"]] > 0.5
                golden["mask"] = mask
                golden["depth"] = passes[names["Depth.Z"]][mask].astype(np.float32)
                golden["normal"] = np.stack([passes[names[f"Normal.{c}"]][mask] for c in "XYZ"], -1).astype(np.float32)
                for term in TERMS:
                    picture = read_image(made / f"{term}.png")[..., :3]
                    golden[f"{environment}_{term}"] = np.round(picture[mask] * 65535).astype(np.uint16)
            print(shape, environment, flush=True)
        np.savez_compressed(GOLDEN / f"blender_{shape}.npz", **golden)  # type: ignore[arg-type]


def inside_blender(given: str, made: str) -> None:
    """Render all terms of one job."""
    sys.path.insert(0, str(ROOT))
    import bpy  # type: ignore[import-not-found]

    from stages.report.renderers import cycles_scene, read_arrays

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    cycles_scene(bpy, scene, read_arrays(Path(given)))
    mesh = bpy.data.meshes["mesh"]
    for name in ("custom_normal", "sharp_edge"):  # Blender's own normals instead, smooth over every edge
        if name in mesh.attributes:
            mesh.attributes.remove(mesh.attributes[name])
    cycles = scene.cycles
    cycles.samples, cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = SAMPLES, 12, 1, 1
    cycles.pixel_filter_type, cycles.filter_width = "GAUSSIAN", 0.01
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = cycles.light_sampling_threshold = 0
    cycles.caustics_reflective = True
    scene.view_settings.view_transform, scene.view_settings.look = "Filmic", "None"
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = True
    material = bpy.data.materials["white"].node_tree
    output = next(node for node in material.nodes if node.type == "OUTPUT_MATERIAL")
    for term in TERMS:
        kind, _, roughness = term.partition("_")
        closure = material.nodes.new("ShaderNodeBsdfDiffuse" if kind == "diffuse" else "ShaderNodeBsdfAnisotropic")
        closure.inputs["Color"].default_value = (1, 1, 1, 1)
        closure.inputs["Roughness"].default_value = float(roughness or 0)
        if kind == "glossy":
            closure.distribution = "GGX"
        material.links.new(closure.outputs["BSDF"], output.inputs["Surface"])
        bpy.ops.render.render()
        settings = scene.render.image_settings
        settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGBA", "16"
        bpy.data.images["Render Result"].save_render(f"{made}/{term}.png", scene=scene)
    settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
    bpy.data.images["Render Result"].save_render(f"{made}/passes.exr", scene=scene)


if __name__ == "__main__":
    inside_blender(*sys.argv[2:]) if sys.argv[1] == "inside" else main(*sys.argv[1:])
