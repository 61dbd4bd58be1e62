"""Writer of Wavefront OBJ and MTL: the source's numbers, polygons, objects and groups, with its own UVs or the new ones.

Physically based slots (map_Pr, map_Pm) as Blender and Assimp read them: one grey picture each, the EXR masters, which are
linear by their format: Blender takes PNGs for sRGB, and shows them too smooth.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.asset.corners import authored_normals, loop_normals
from stages.asset.worn import Worn, worn_materials
from stages.core.artifact import Artifact, write_text
from stages.core.texture_sets import TextureSet, texture_sets

TEXTURES = {"map_Kd": "albedo.png", "map_Pr": "roughness.exr", "map_Pm": "metallic.exr"}
"""By their plain names, see `core.texture_sets`."""


def write_obj(path: Path, prep: Artifact, relief: bool = False) -> None:
    """Write an OBJ from prep.npz, and the MTL it names beside it.

    Numbers are written with as many digits as their float64 needs, so reading them gives the same bits.

    Args:
        relief: whether there is a normal map for the MTL to name.
    """
    uv, uv_row = obj_uv(prep)
    normals, normal_row = obj_normals(prep)
    lines = [f"mtllib {path.with_suffix('.mtl').name}"]
    lines += _rows("v", prep["source_vertices"]) + _rows("vt", uv) + _rows("vn", normals)
    lines += _faces(prep, _corners(prep["loop_vertex"], uv_row, normal_row))
    write_text(path, "\n".join(lines) + "\n")
    write_text(path.with_suffix(".mtl"), mtl(worn_materials(prep)[0], texture_sets(prep.provenance), relief))


def _faces(prep: Artifact, corners: list[str]) -> list[str]:
    """The polygons in their order, and before each the object, group and material that change there."""
    parts, groups = prep.provenance.extra["parts"], prep.provenance.extra["groups"]
    worn, of_face = worn_materials(prep)
    starts, lines = prep["loop_start"].tolist(), list[str]()
    state: dict[str, str] = {"o": "", "g": "", "usemtl": ""}
    for face, (part, group) in enumerate(zip(prep["face_part"].tolist(), prep["face_group"].tolist(), strict=True)):
        names = {"o": parts[part]["node"], "g": groups[group] if group >= 0 else ""}
        names["usemtl"] = slot_name(worn[of_face[face]].name)
        changed = [keyword for keyword in state if names[keyword] != state[keyword]]
        lines += [f"{keyword} {names[keyword]}".rstrip() for keyword in changed]
        state = names
        lines.append("f " + " ".join(corners[starts[face] : starts[face + 1]]))
    return lines


def slot_name(material: str) -> str:
    """A material slot as MTL can name it."""
    return material or "material"


def mtl(materials: list[Worn], sets: list[TextureSet], relief: bool) -> str:
    """An MTL file: the materials with the textures of their sets."""
    shown = {slot_name(worn.name): sets[worn.set] for worn in materials}
    textures = TEXTURES | ({"norm": "normal.png"} if relief else {})
    plain = ["Kd 1 1 1", "Ks 0.5 0.5 0.5", "Ni 1.5", "illum 2", "Pr 1", "Pm 1"]
    entries = [
        [f"newmtl {name}", *plain, *(f"{key} {of.file(file)}" for key, file in textures.items())]
        for name, of in shown.items()
    ]
    return "\n\n".join("\n".join(lines) for lines in entries) + "\n"


def obj_uv(prep: Artifact) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """UVs to write, v up, and the row of each loop: the source's table where kept, and below it what its loops lack.

    Returns:
        (N, 2); (L,).
    """
    kept, row = prep["source_uv"][:0], np.full(len(prep["loop_uv"]), -1, np.int64)
    if prep.provenance.extra["uv_kept"]:
        kept, row = prep["source_uv"], prep["loop_source_uv"].astype(np.int64)
        with np.errstate(over="ignore"):
            row[(kept[row].astype(np.float32) != prep["loop_uv"]).any(1)] = -1
    lacking = np.flatnonzero(row < 0)
    bits = np.ascontiguousarray(prep["loop_uv"][lacking]).view(np.uint64)[:, 0]
    _, first, made = np.unique(bits, return_index=True, return_inverse=True)
    row[lacking] = len(kept) + made
    return np.concatenate([kept, prep["loop_uv"][lacking[first]].astype(np.float64)]), row


def obj_normals(prep: Artifact) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Normals to write and the row of each loop: the source's table, and below it what its loops lack.

    Returns:
        (N, 3); (L,).
    """
    row = prep["loop_source_normal"].astype(np.int64)
    lacking = np.flatnonzero(~authored_normals(prep)[1])
    made, of_loop = np.unique(loop_normals(prep)[lacking], axis=0, return_inverse=True)
    row[lacking] = len(prep["source_normals"]) + of_loop.reshape(-1)
    return np.concatenate([prep["source_normals"], made]), row


def _rows(keyword: str, values: NDArray) -> list[str]:
    return [f"{keyword} " + " ".join(map(repr, row)) for row in values.tolist()]


def _corners(vertex: NDArray, uv: NDArray, normal: NDArray) -> list[str]:
    """v/vt/vn of each loop, counted from 1; v//vn where there is no UV."""
    rows = zip((vertex + 1).tolist(), (uv + 1).tolist(), (normal + 1).tolist(), strict=True)
    return [f"{v}/{t or ''}/{n}" for v, t, n in rows]
