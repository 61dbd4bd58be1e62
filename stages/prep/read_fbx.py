"""Autodesk FBX, binary and ASCII, by ufbx: polygons, normals, all UV sets, node and material names, transforms.

Skins and blend shapes are applied as the file's nodes stand. Of a group of levels of detail the first is taken; hidden
nodes are left out, and subdivision surfaces are taken as their cages.
"""

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.core.errors import InputError
from stages.prep.extras import missing
from stages.prep.pieces import Indexed, Piece, joined
from stages.prep.source import Source


def read_fbx(path: Path) -> Source:
    """Read an FBX file. Raises: InputError."""
    if find_spec("ufbx") is None:
        raise missing("ufbx", "fbx", "FBX", path)
    worker = Path(__file__).with_name("fbx_worker.py")
    answer = subprocess.run([sys.executable, str(worker), str(path)], capture_output=True, check=False)
    if answer.returncode:
        said = " ".join(answer.stderr.decode("utf-8", "replace").split())[-160:] or "ufbx ended without a word"
        raise InputError(f"{path}: cannot be read as FBX ({said}); export it again")
    scene = json.loads(answer.stdout[: answer.stdout.index(b"\n")])
    offset, arrays = answer.stdout.index(b"\n") + 1, {}
    for name, dtype, shape in scene["arrays"]:
        arrays[name] = np.frombuffer(answer.stdout, dtype, int(np.prod(shape)), offset).reshape(shape)
        offset += arrays[name].nbytes
    return _source(scene, arrays, path)


def _source(scene: dict[str, Any], arrays: dict[str, NDArray], path: Path) -> Source:
    skipped = {what: count for what, count in scene["skipped"].items() if count}
    applied: dict[str, int] = {}
    pieces = []
    for node in scene["nodes"]:
        mesh = scene["meshes"][str(node["mesh"])]
        if not node["visible"] or not node["first_level"]:
            _count(skipped, "lower_levels_of_detail" if node["visible"] else "hidden_nodes")
            continue
        _count(applied, "skins_in_their_default_pose", mesh["skins"])
        _count(applied, "blend_shapes_with_their_default_weights", mesh["blend_shapes"])
        _count(skipped, "subdivision_levels", int(mesh["subdivided"]))
        pieces.append(_piece(node, mesh, {name.partition("_")[2]: values for name, values in arrays.items()
                                          if name.partition("_")[0] == str(node["mesh"])}))  # fmt: skip
    return joined("fbx", pieces, skipped, applied, path)


def _count(counts: dict[str, int], what: str, count: int = 1) -> None:
    if count:
        counts[what] = counts.get(what, 0) + count


def _piece(node: dict[str, Any], mesh: dict[str, Any], arrays: dict[str, NDArray]) -> Piece:
    transform = np.eye(4)
    transform[:3] = np.reshape(node["columns"], (4, 3)).T
    first, lengths = arrays["faces"].astype(np.int64).reshape(-1, 2).T
    corners = np.repeat(first - (np.cumsum(lengths) - lengths), lengths) + np.arange(int(lengths.sum()))

    def layer(name: str) -> Indexed | None:
        values, rows = arrays.get(f"{name}_values"), arrays.get(f"{name}_rows")
        return None if values is None or rows is None else (values, rows.astype(np.int64)[corners])

    position = layer("position")
    vertices, corner = position if position else (np.zeros((0, 3)), np.zeros(0, np.int64))
    material = arrays["material"].astype(np.int64)
    sets = sorted(int(name[2:].partition("_")[0]) for name in arrays if name.startswith("uv") and name.endswith("_rows"))
    return Piece(
        mesh["name"] or node["name"], node["name"] or mesh["name"], transform, vertices.astype(np.float64), lengths, corner,
        node["materials"], material if len(material) == len(lengths) else np.zeros(len(lengths), np.int64), layer("normal"),
        [uv for k in sets if (uv := layer(f"uv{k}"))],
    )  # fmt: skip
