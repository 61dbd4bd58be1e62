"""Reads an FBX file in a process of its own: ufbx's binding frees objects that it still hands out, and may crash.

Here nothing is freed: no collector runs, every object that was handed out is kept, and the process ends at once.
`python fbx_worker.py MESH.fbx` writes to stdout a line of JSON (the nodes that carry meshes; the name, type and shape of
each array, those of mesh M as M_faces and so on), then the bytes of the arrays. What is wrong is one line on stderr.
"""

import gc
import json
import os
import sys
from typing import Any

import numpy as np
import ufbx

_KEPT: list[Any] = []


def kept(handed_out: Any) -> Any:
    """The same object, never to be freed."""
    _KEPT.append(handed_out)
    return handed_out


def items(handed_out: Any) -> list[Any]:
    """The elements of a list of ufbx's."""
    return [kept(handed_out[i]) for i in range(len(kept(handed_out)))]


def mesh_arrays(number: int, mesh: Any) -> dict[str, Any]:
    """A mesh as arrays; UVs and normals as values and the row of each corner."""
    posed = len(kept(mesh.all_deformers)) > 0
    position = kept(mesh.skinned_position if posed else mesh.vertex_position)
    normal = kept(mesh.skinned_normal if posed else mesh.vertex_normal)
    layers = {"position": position, "normal": normal}
    layers |= {f"uv{k}": kept(layer.vertex_uv) for k, layer in enumerate(items(mesh.uv_sets))}
    arrays = {"faces": np.array(kept(mesh.faces)).reshape(-1, 2), "material": np.array(kept(mesh.face_material))}
    for name, layer in layers.items():
        if layer.exists:
            arrays[f"{name}_values"] = np.array(kept(layer.values))
            arrays[f"{name}_rows"] = np.array(kept(layer.indices))
    return {f"{number}_{name}": values for name, values in arrays.items()}


def read(path: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the line of JSON says, but for the arrays, and the arrays."""
    scene = kept(ufbx.load_file(path, target_axes=kept(ufbx.axes_right_handed_y_up), target_unit_meters=1.0,
                                evaluate_skinning=True, ignore_missing_external_files=True))  # fmt: skip
    nodes, arrays, meshes = list[dict[str, Any]](), dict[str, Any](), dict[int, dict[str, Any]]()
    stack = [(kept(scene.root_node), True, True)]
    while stack:
        node, visible, first_level = stack.pop()
        visible = visible and node.visible
        mesh = kept(node.mesh)
        if mesh is not None:
            number = mesh.typed_id
            if number not in meshes:
                arrays |= mesh_arrays(number, mesh)
                skins, blends = len(kept(mesh.skin_deformers)), len(kept(mesh.blend_deformers))
                subdivided = mesh.subdivision_display_mode.name not in ("DISABLED", "HULL")
                meshes[number] = {"name": mesh.name, "skins": skins, "blend_shapes": blends, "subdivided": subdivided}
            world = bool(kept(mesh.all_deformers)) and not mesh.skinned_is_local
            matrix = [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0] if world else [x for column in node.geometry_to_world for x in column]
            nodes.append({"name": node.name, "mesh": number, "visible": visible, "first_level": first_level,
                          "materials": [material.name for material in items(node.materials)], "columns": matrix})  # fmt: skip
        levels = node.attrib_type.name == "LOD_GROUP"
        children = items(node.children)
        stack += [(child, visible, first_level and not (levels and k)) for k, child in reversed(list(enumerate(children)))]
    curves = len(kept(scene.nurbs_curves)) + len(kept(scene.line_curves))
    left = {"nurbs_surfaces": len(kept(scene.nurbs_surfaces)), "curves": curves}
    return {"nodes": nodes, "meshes": meshes, "skipped": left}, arrays


def main() -> int:
    """Returns: 0, or 1 with the reason on stderr."""
    gc.disable()
    try:
        scene, arrays = read(sys.argv[1])
    except (ufbx.UfbxError, OSError, ValueError) as error:
        sys.stderr.write(f"{type(error).__name__}: {error}")
        return 1
    scene["arrays"] = [(name, values.dtype.str, values.shape) for name, values in arrays.items()]
    sys.stdout.buffer.write(json.dumps(scene).encode() + b"\n")
    for values in arrays.values():
        sys.stdout.buffer.write(values.tobytes())
    return 0


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
