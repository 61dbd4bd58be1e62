"""Writer of Wavefront OBJ and MTL: the source's numbers, polygons and normals, with its own UVs or the new ones.

Physically based slots (map_Pr, map_Pm) as Blender and Assimp read them: one grey picture each, so roughness and
metallic are written apart from orm.png.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.core.artifact import Artifact, write_text

TEXTURES = {"map_Kd": "albedo.png", "map_Pr": "roughness.png", "map_Pm": "metallic.png"}


def write_obj(path: Path, prep: Artifact) -> None:
    """Write an OBJ from prep.npz, and the MTL it names beside it.

    Numbers are written with as many digits as their float64 needs, so reading them gives the same bits.
    """
    parts = prep.provenance.extra["parts"]
    uv, uv_row = obj_uv(prep)
    lines = [f"mtllib {path.with_suffix('.mtl').name}"]
    lines += _rows("v", prep["source_vertices"]) + _rows("vt", uv)
    lines += _rows("vn", prep["source_normals"])
    corners = _corners(prep["loop_vertex"], uv_row, prep["loop_source_normal"])
    starts = prep["loop_start"].tolist()
    state = ("", "")
    for face, part in enumerate(prep["face_part"].tolist()):
        name, slot = parts[part]["name"], slot_name(parts[part]["material"])
        if (name, slot) != state:
            lines += [f"o {name}"] * (name != state[0]) + [f"usemtl {slot}"] * (slot != state[1])
            state = (name, slot)
        lines.append("f " + " ".join(corners[starts[face] : starts[face + 1]]))
    write_text(path, "\n".join(lines) + "\n")
    write_text(path.with_suffix(".mtl"), mtl([part["material"] for part in parts]))


def slot_name(material: str) -> str:
    """A material slot as MTL can name it."""
    return material or "material"


def mtl(materials: list[str]) -> str:
    """An MTL file: one material per slot, all with the same textures."""
    body = ["Kd 1 1 1", "Ks 0.5 0.5 0.5", "Ni 1.5", "illum 2", "Pr 1", "Pm 1"]
    body += [f"{key} {file}" for key, file in TEXTURES.items()]
    names = dict.fromkeys(slot_name(material) for material in materials)
    return "\n\n".join("\n".join([f"newmtl {name}", *body]) for name in names) + "\n"


def obj_uv(prep: Artifact) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """UVs to write, v up, and the row of each loop: the source's table where kept, else the distinct new ones.

    Returns:
        (N, 2); (L,), -1 for a loop without UV.
    """
    if prep.provenance.extra["uv_kept"]:
        return prep["source_uv"], prep["loop_source_uv"].astype(np.int64)
    bits = np.ascontiguousarray(prep["loop_uv"]).view(np.uint64)[:, 0]
    _, first, row = np.unique(bits, return_index=True, return_inverse=True)
    return prep["loop_uv"][first].astype(np.float64), row


def _rows(keyword: str, values: NDArray) -> list[str]:
    return [f"{keyword} " + " ".join(map(repr, row)) for row in values.tolist()]


def _corners(vertex: NDArray, uv: NDArray, normal: NDArray) -> list[str]:
    """v/vt/vn of each loop, counted from 1."""
    corners = []
    for v, t, n in zip((vertex + 1).tolist(), (uv + 1).tolist(), (normal + 1).tolist(), strict=True):
        tail = f"/{n}" if n else ""
        corners.append(f"{v}/{t or ''}{tail}" if t or tail else str(v))
    return corners
