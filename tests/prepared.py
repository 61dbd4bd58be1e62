"""A prepared mesh made in the test, for the stages that read prep.npz."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.core.artifact import Provenance, save_npz
from stages.core.schemas import PREP
from stages.core.texture_sets import TextureSet
from stages.prep.source import nothing_passed_on


def save_prep(path: Path, vertices: NDArray, triangles: NDArray, normals: NDArray, seed: str = "") -> Path:
    """Write a prep.npz whose source is the working mesh itself; UVs are one small triangle a face, unused here."""
    count = len(triangles)
    loops = np.arange(3 * count, dtype=np.int32)
    arrays = {
        "vertices": vertices.astype(np.float32),
        "triangles": triangles.astype(np.int32),
        "normals": normals.astype(np.float32),
        "uv": np.zeros((count, 3, 2), np.float32),
        "charts": np.zeros(count, np.int32),
        "triangle_loops": loops.reshape(-1, 3),
        "to_world": np.eye(4),
        "source_vertices": vertices.astype(np.float64),
        "source_uv": np.zeros((0, 2)),
        "source_normals": np.zeros((0, 3), np.float32),
        "loop_start": 3 * np.arange(count + 1, dtype=np.int32),
        "loop_vertex": triangles.astype(np.int32).ravel(),
        "loop_source_uv": np.full(3 * count, -1, np.int32),
        "loop_source_normal": np.full(3 * count, -1, np.int32),
        "source_tangents": np.zeros((0, 4), np.float32),
        "loop_source_tangent": np.full(3 * count, -1, np.int32),
        "source_images": np.zeros(0, np.uint8),
        "face_part": np.zeros(count, np.int32),
        "face_group": np.full(count, -1, np.int32),
        "caster_vertices": np.zeros((0, 3), "f4"),
        "caster_triangles": np.zeros((0, 3), "i4"),
        "face_set": np.zeros(count, np.int32),
        "loop_uv": np.zeros((3 * count, 2), np.float32),
    }
    part = {"name": "mesh", "material": "material", "node": "mesh", "transform": np.eye(4).ravel().tolist()}
    extra = {"source_format": "obj", "source_name": "mesh", "uv_kept": False, "parts": [part], "groups": []}
    extra |= {"sets": [TextureSet().to_json()]}
    extra |= {"shared_texels": False, "passed_on": nothing_passed_on(), "findings": {}}
    save_npz(path, PREP, arrays, Provenance({}, None, {"mesh": seed or "0" * 64}, extra))
    return path
