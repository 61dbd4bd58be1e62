"""The USD opens in Blender and looks like the GLB; so does the small GLB for the web."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.asset.export import EXTRAS, export
from stages.asset.options import ExportOptions
from stages.core.artifact import read_exr
from stages.core.color import srgb_encode
from tests.asset.examples import gradient, save_asset
from tests.conftest import ROOT

BLENDER = ROOT / ".venv" / "cycles" / "bin" / "python"
"""A Python with bpy, as `make bench` sets it up."""

RENDER = """
import sys, bpy, mathutils
path, out = sys.argv[-2:]
bpy.ops.wm.read_factory_settings(use_empty=True)
if path.endswith(".glb"):
    bpy.ops.import_scene.gltf(filepath=path)
else:
    bpy.ops.wm.usd_import(filepath=path)
meshes = [o for o in bpy.data.objects if o.type == "MESH"]
corners = [o.matrix_world @ mathutils.Vector(c) for o in meshes for c in o.bound_box]
low, high = ([f(c[k] for c in corners) for k in range(3)] for f in (min, max))
low, high = mathutils.Vector(low), mathutils.Vector(high)
middle, radius = (low + high) / 2, (high - low).length / 2
scene = bpy.context.scene
for name, at, energy in (("key", (1, -2, 2), 3.0), ("fill", (-2, -1, 0.5), 1.0)):
    lamp = bpy.data.objects.new(name, bpy.data.lights.new(name, "SUN"))
    lamp.data.energy, lamp.data.angle = energy, 0.2
    lamp.rotation_euler = mathutils.Vector(at).to_track_quat("Z", "Y").to_euler()
    scene.collection.objects.link(lamp)
scene.world = bpy.data.worlds.new("world")
scene.world.use_nodes = True
scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.4, 0.45, 0.5, 1)
scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
scene.collection.objects.link(scene.camera)
scene.camera.data.angle = 0.5
towards = mathutils.Vector((0.5, -1, 0.4)).normalized()
scene.camera.location = middle + towards * radius / 0.24
scene.camera.rotation_euler = towards.to_track_quat("Z", "Y").to_euler()
scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 32, False, False
scene.render.resolution_x = scene.render.resolution_y = 128
scene.render.film_transparent = True
scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
scene.render.filepath = out
bpy.ops.render.render(write_still=True)
"""


def render(path: Path, out: Path) -> tuple[NDArray, NDArray]:
    """Blender's picture of a file. Returns: sRGB (H, W, 3), and where the object is."""
    result = subprocess.run([str(BLENDER), "-c", RENDER, str(path), str(out)], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    image = read_exr(out)
    rgb = np.stack([image.full(c) for c in "RGB"], -1)
    return srgb_encode(rgb.astype(np.float64)), image.full("A") > 0.99


@pytest.mark.skipif(not BLENDER.is_file(), reason="no Python with bpy; make bench sets one up")
@pytest.mark.parametrize("target", ["usd", "web"])
@pytest.mark.parametrize("maps", [("albedo", "orm"), ("albedo", "orm", "normal")], ids=["plain", "normal"])
def test_blender_shows_the_same_picture(tmp_path: Path, target: str, maps: tuple[str, ...]) -> None:
    pytest.importorskip(EXTRAS[target][0])
    asset = save_asset(tmp_path / "asset", maps, albedo=gradient())
    export(asset, tmp_path / "out", ExportOptions(target))
    (model,) = [*(tmp_path / "out").glob("*.usdz"), *(tmp_path / "out").glob("*.glb")]
    wanted, on_object = render(asset / "model.glb", tmp_path / "glb.exr")
    found, also = render(model, tmp_path / "found.exr")
    assert on_object.mean() > 0.1
    assert (on_object == also).mean() > 0.998
    both = on_object & also
    assert -10 * np.log10(np.square(wanted - found)[both].mean()) > 32
