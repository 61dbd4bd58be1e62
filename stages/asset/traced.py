"""The mesh of a prep.npz as light meets it, with the normal maps that its source keeps."""

from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.asset.corners import flipped_loops, gltf_uv, loop_normals, loop_parts, loop_tangents, part_frames, unit
from stages.asset.passed_on import PassedOn
from stages.core.artifact import Artifact
from stages.core.color import srgb_decode
from stages.core.images import decode_image
from stages.core.texture_sets import triangle_sets
from stages.light.emission import Emission
from stages.light.lookup import REPEAT, Texture
from stages.light.normal_maps import NormalMap, NormalMaps
from stages.light.scene import Scene


def traced_scene(prep: Artifact) -> Scene:
    """The scene of a prepared mesh; normals lean by the source's normal maps, and it emits, where its UVs were kept."""
    around = prep["caster_vertices"], prep["caster_triangles"]
    return Scene(prep["vertices"], prep["triangles"], prep["normals"], source_bumps(prep), source_emission(prep), around)


def source_bumps(prep: Artifact) -> NormalMaps | None:
    """The normal maps that the source brings along, or None."""
    passed_on = PassedOn.of(prep)
    textures = passed_on.normal_maps()
    if not textures:
        return None
    names = list(textures)
    maps = [normal_map(passed_on, textures[name]) for name in names]
    of_part = _rows(prep, names)
    bumps = world_frames(prep, set(np.flatnonzero(of_part >= 0).tolist()))
    return replace(bumps, maps=maps, of_triangle=of_part[triangle_parts(prep)])


def source_emission(prep: Artifact) -> Emission | None:
    """What the source's materials emit, or None."""
    passed_on = PassedOn.of(prep)
    shining = {name: of for name, of in passed_on.materials.items() if any(of.get("emissiveFactor", ()))}
    if not shining:
        return None
    textures = [emissive_texture(passed_on, of) for of in shining.values()]
    of_triangle = _rows(prep, list(shining))[triangle_parts(prep)]
    return Emission(textures, of_triangle, gltf_uv(prep)[prep["triangle_loops"]])


def emissive_texture(passed_on: PassedOn, material: dict[str, Any]) -> Texture:
    """glTF's emission of a material: texture times factor times strength, linear."""
    extension = material.get("extensions", {}).get("KHR_materials_emissive_strength", {})
    factor = np.array(material["emissiveFactor"], np.float32) * np.float32(extension.get("emissiveStrength", 1.0))
    if "emissiveTexture" not in material:
        return Texture(factor[None, None])
    worn = source_texture(passed_on, material["emissiveTexture"])
    return replace(worn, image=srgb_decode(worn.image[..., :3]).astype(np.float32) * factor)


def baked_bumps(prep: Artifact, normals: list[NDArray[np.float32]]) -> NormalMaps:
    """Baked normal maps on the whole mesh. Args: normals: (H, W, 3) of each texture set."""
    return replace(world_frames(prep), maps=[NormalMap(normal) for normal in normals], of_triangle=triangle_sets(prep))


def world_frames(prep: Artifact, parts: Collection[int] | None = None) -> NormalMaps:
    """UVs and tangent frames of the working mesh, on its outer side, without maps; every triangle shows row 0.

    Args:
        parts: those whose frames are wanted, all where None.
    """
    uv = gltf_uv(prep)
    tangents = loop_tangents(prep, loop_normals(prep), uv, range(len(_parts(prep))) if parts is None else parts)
    loops, frames, part = prep["triangle_loops"], part_frames(prep), loop_parts(prep)
    direction = np.einsum("lij,lj->li", frames[part], tangents[:, :3].astype(np.float64))
    sign = tangents[:, 3] * np.sign(np.linalg.det(frames))[part]  # a mirror turns cross products round
    turned = np.where(flipped_loops(prep), -1.0, 1.0)  # the back of the file's surface is this surface's front
    world = np.concatenate([unit(direction) * turned[:, None], (sign * turned)[:, None]], 1).astype(np.float32)
    return NormalMaps([], np.zeros(len(loops), np.int32), uv[loops], world[loops])


def normal_map(passed_on: PassedOn, info: dict[str, Any]) -> NormalMap:
    """A source's normal map, decoded. Args: info: glTF's normalTexture."""
    worn = source_texture(passed_on, info)
    return NormalMap(worn.image[..., :3] * np.float32(2) - np.float32(1), info.get("scale", 1.0), worn.matrix, worn.wrap)


def source_texture(passed_on: PassedOn, info: dict[str, Any]) -> Texture:
    """A texture of the source, its values as stored, in [0, 1]. Args: info: glTF's reference to it."""
    texture = passed_on.textures[info["index"]]
    sampler = texture.get("sampler", {})
    transform = info.get("extensions", {}).get("KHR_texture_transform")
    return Texture(
        decode_image(passed_on.images[texture["image"]][2]),
        None if transform is None else uv_matrix(transform),
        (sampler.get("wrapS", REPEAT), sampler.get("wrapT", REPEAT)),
    )


def uv_matrix(transform: dict[str, Any]) -> NDArray[np.float64]:
    """KHR_texture_transform as an affine (2, 3) matrix, rotating as the Khronos viewer and three.js do."""
    c, s = np.cos(transform.get("rotation", 0.0)), np.sin(transform.get("rotation", 0.0))
    linear = np.array([[c, s], [-s, c]]) * np.array(transform.get("scale", (1.0, 1.0)))
    return np.concatenate([linear, np.array(transform.get("offset", (0.0, 0.0)), float)[:, None]], 1)


def _rows(prep: Artifact, names: list[str]) -> NDArray[np.int32]:
    """For each part the place of its material among some names, or -1."""
    return np.array([names.index(part["material"]) if part["material"] in names else -1 for part in _parts(prep)], np.int32)


def triangle_parts(prep: Artifact) -> NDArray[np.int32]:
    """Part of each triangle of the working mesh, (F,)."""
    return loop_parts(prep)[prep["triangle_loops"][:, 0]]


def _parts(prep: Artifact) -> list[dict[str, Any]]:
    return prep.provenance.extra["parts"]
