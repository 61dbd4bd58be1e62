"""Textures as Unreal and Unity take them, with a model beside.

Unreal: `T_<Name>_BC` sRGB, `T_<Name>_ORM` linear masks, `T_<Name>_N` with green turned down (-Y, DirectX).
Unity: base map sRGB; HDRP's mask map has R metallic, G occlusion, B detail mask, A smoothness; URP has metallic in R and
smoothness in A of one picture and occlusion in one of its own; normals are +Y. Smoothness is 1 - roughness.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.asset.folder import Asset
from stages.asset.pictures import copy_model, copy_picture, write_pixels
from stages.asset.read_glb import Look, Primitive
from stages.core.artifact import write_text
from stages.core.naming import identifier, unique

WHITE = 255


def write_unreal(asset: Asset, out: Path) -> list[str]:
    """Unreal's three textures for each set of pictures, and a GLB, which Unreal 5 imports by itself."""
    files = [copy_model(asset, out)]
    for stem, look in asset.stems():
        files.append(copy_picture(out / f"T_{stem}_BC", look.pictures["albedo"]))
        files.append(write_pixels(out / f"T_{stem}_ORM.png", look.packed()))
        if "normal" in look.pictures:
            files.append(write_pixels(out / f"T_{stem}_N.png", directx(look.scaled_normal())))
        if "emission" in look.pictures:
            files.append(copy_picture(out / f"T_{stem}_E", look.pictures["emission"]))
    return [*files, _how_to(out, UNREAL)]


def write_unity_hdrp(asset: Asset, out: Path) -> list[str]:
    """HDRP/Lit: base map, mask map and normal map of each set of pictures, an OBJ and a GLB."""
    files = _unity_models(asset, out)
    for stem, look in asset.stems():
        files += _unity_common(out, stem, look)
        files.append(write_pixels(out / f"{stem}_MaskMap.png", mask_map(look.packed())))
    return [*files, _how_to(out, HDRP)]


def write_unity_urp(asset: Asset, out: Path) -> list[str]:
    """URP/Lit: base map, metallic and smoothness, occlusion and normal map of each set, an OBJ and a GLB."""
    files = _unity_models(asset, out)
    for stem, look in asset.stems():
        files += _unity_common(out, stem, look)
        packed = look.packed()
        files.append(write_pixels(out / f"{stem}_MetallicSmoothness.png", metallic_smoothness(packed)))
        if "occlusion" in look.pictures:
            files.append(write_pixels(out / f"{stem}_Occlusion.png", packed[..., 0]))
    return [*files, _how_to(out, URP)]


def mask_map(packed: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """HDRP's mask map of R occlusion, G roughness, B metallic. Args: (H, W, 3). Returns: (H, W, 4)."""
    occlusion, roughness, metallic = (packed[..., k] for k in range(3))
    return np.stack([metallic, occlusion, np.full_like(metallic, WHITE), WHITE - roughness], -1)


def metallic_smoothness(packed: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """URP's metallic map: metallic in red (and green and blue), smoothness in alpha. Args: (H, W, 3). Returns: (H, W, 4)."""
    metallic = packed[..., 2]
    return np.stack([metallic, metallic, metallic, WHITE - packed[..., 1]], -1)


def directx(normal: NDArray) -> NDArray:
    """A +Y normal map with green turned down, and back. Args: (H, W, 3) uint8 or uint16."""
    turned = normal.copy()
    turned[..., 1] = np.iinfo(normal.dtype).max - normal[..., 1]
    return turned


def _unity_common(out: Path, stem: str, look: Look) -> list[str]:
    files = [copy_picture(out / f"{stem}_BaseMap", look.pictures["albedo"])]
    if "normal" in look.pictures:
        files.append(write_pixels(out / f"{stem}_Normal.png", look.scaled_normal()))
    if "emission" in look.pictures:
        files.append(copy_picture(out / f"{stem}_Emission", look.pictures["emission"]))
    return files


def _unity_models(asset: Asset, out: Path) -> list[str]:
    write_text(out / f"{asset.name}.obj", obj_text(asset))
    return [copy_model(asset, out), f"{asset.name}.obj"]


def _how_to(out: Path, text: str) -> str:
    write_text(out / "IMPORT.txt", text)
    return "IMPORT.txt"


# ---------------------------------------------------------------------------------------------------- OBJ


def obj_text(asset: Asset) -> str:
    """The model as OBJ, which Unity reads without a package: triangles in the scene's frame, v up, one group a slot."""
    slots = unique([identifier(look.name) for look in asset.model.looks])
    lines, base = [], np.ones(3, np.int64)
    names = unique([identifier(node.name) for node in asset.model.nodes])
    for name, node in zip(names, asset.model.nodes, strict=True):
        lines.append(f"o {name}")
        for part in node.primitives:
            rows, faces = _obj_part(part, node.matrix, base)
            lines += [*rows, f"usemtl {slots[part.look]}", *faces]
            count = len(part.positions)
            base += np.array([count, count, count if part.normals is not None else 0])
    return "\n".join(lines) + "\n"


def _obj_part(part: Primitive, matrix: NDArray[np.float64], base: NDArray[np.int64]) -> tuple[list[str], list[str]]:
    """Lines of the vertices, and of the faces; a matrix that mirrors turns the faces round."""
    linear = matrix[:3, :3]
    rows = _rows("v", part.positions @ linear.T + matrix[:3, 3])
    rows += _rows("vt", np.stack([part.uv[:, 0], 1 - part.uv[:, 1].astype(np.float64)], 1))
    if part.normals is not None:
        n = part.normals @ np.linalg.pinv(linear)  # by the inverse transpose
        rows += _rows("vn", n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-30))
    corners = part.triangles.astype(np.int64)[..., None] + base[: 2 if part.normals is None else 3]
    if np.linalg.det(linear) < 0:
        corners = corners[:, ::-1]
    return rows, ["f " + " ".join("/".join(map(str, corner)) for corner in face) for face in corners.tolist()]


def _rows(keyword: str, values: NDArray) -> list[str]:
    return [f"{keyword} " + " ".join(f"{x:.9g}" for x in row) for row in values.tolist()]


UNREAL = """Unreal Engine 5
Drag the GLB into the content browser (Interchange brings its material along), or use the textures with a material of yours:
T_*_BC   base colour     sRGB on
T_*_ORM  R occlusion, G roughness, B metallic     sRGB off, compression "Masks"
T_*_N    normal, -Y (DirectX), where there is one     compression "Normalmap", green not flipped
T_*_E    emission, where there is one     sRGB on
"""

UNITY = """Copy this folder into Assets. The OBJ needs no package; the GLB needs glTFast, and brings its material along.
*_BaseMap   base colour     sRGB on
*_Normal    normal, +Y, where there is one     texture type "Normal map"
*_Emission  emission, where there is one     sRGB on
"""

HDRP = f"""Unity, HDRP/Lit
{UNITY}*_MaskMap   R metallic, G occlusion, B detail mask (none: white), A smoothness     sRGB off
"""

URP = f"""Unity, URP/Lit (workflow "Metallic", smoothness from "Metallic Alpha")
{UNITY}*_MetallicSmoothness   R metallic, A smoothness     sRGB off
*_Occlusion   occlusion, where there is one     sRGB off
"""
