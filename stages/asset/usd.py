"""USD through usd-core: <Name>.usdc with its textures, and all of it in one <Name>.usdz.

+y up, one unit a metre, as in glTF. Each material is UsdPreviewSurface, which every viewer knows; MaterialX is a target of
its own, for usd-core comes without MaterialX's nodes and its validators refuse them as unknown. Colours say
`sourceColorSpace` sRGB, everything else raw. v is up in USD. A normal map is read as 2 x - 1.
"""

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.asset.folder import Asset
from stages.asset.pictures import write_pictures
from stages.asset.read_glb import Look, Node, Primitive
from stages.core.naming import identifier, unique

EPOCH = 400_000_000
"""Seconds since 1970 of every file in a package (September 1982: ZIP begins in 1980), so that equal assets are equal bytes."""


def write_usd(asset: Asset, out: Path) -> list[str]:
    """Write <Name>.usdc, textures/, <Name>.usdz."""
    from pxr import Sdf, UsdUtils

    textures = write_pictures(asset, out)
    scene, package = out / f"{asset.name}.usdc", out / f"{asset.name}.usdz"
    make_stage(asset, scene, textures)
    files = list(dict.fromkeys(name for set_ in textures.values() for name in set_.values()))
    for name in (scene.name, *files):  # a package holds the times of its files
        os.utime(out / name, (EPOCH, EPOCH))
    if not UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(scene)), str(package)):
        raise OSError(f"usd-core could not write {package.name}")
    return [scene.name, package.name, *files]


def make_stage(asset: Asset, path: Path, textures: dict[str, dict[str, str]]) -> None:
    """The scene: /<Name>/Materials/<slot>, and a mesh for each primitive."""
    from pxr import Kind, Usd, UsdGeom, UsdShade

    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    root = UsdGeom.Xform.Define(stage, f"/{asset.name}")
    stage.SetDefaultPrim(root.GetPrim())
    Usd.ModelAPI(root).SetKind(Kind.Tokens.component)
    UsdGeom.Scope.Define(stage, f"/{asset.name}/Materials")
    materials = []
    for name, look in zip(unique([identifier(look.name) for look in asset.model.looks]), asset.model.looks, strict=True):
        material = UsdShade.Material.Define(stage, f"/{asset.name}/Materials/{name}")
        preview_surface(stage, material, look, textures[asset.stem_of(look)])
        materials.append(material)
    taken = ["Materials", *(identifier(node.name) for node in asset.model.nodes)]
    for name, node in zip(unique(taken)[1:], asset.model.nodes, strict=True):
        _node(stage, f"/{asset.name}/{name}", node, materials, asset.model.looks)
    stage.GetRootLayer().Save()


def _node(stage: Any, path: str, node: Node, materials: list, looks: list[Look]) -> None:
    """A transform and below it one mesh for each material."""
    from pxr import Gf, UsdGeom, UsdShade

    xform = UsdGeom.Xform.Define(stage, path)
    if not np.array_equal(node.matrix, np.eye(4)):
        xform.AddTransformOp().Set(Gf.Matrix4d(*node.matrix.T.reshape(-1).tolist()))  # USD multiplies rows
    names = unique([identifier(looks[p.look].name) for p in node.primitives])
    for name, part in zip(names, node.primitives, strict=True):
        mesh = UsdGeom.Mesh.Define(stage, f"{path}/{name}")
        geometry(mesh, part)
        mesh.CreateDoubleSidedAttr(looks[part.look].double_sided)
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(materials[part.look])


def geometry(mesh: Any, part: Primitive) -> None:
    """Points, faces, normals and UVs of a mesh; without normals its facets are flat."""
    from pxr import Sdf, UsdGeom, Vt

    def vectors(kind: Any, values: NDArray) -> Any:
        return kind.FromNumpy(np.ascontiguousarray(values, np.float32))

    mesh.CreatePointsAttr(vectors(Vt.Vec3fArray, part.positions))
    mesh.CreateExtentAttr(vectors(Vt.Vec3fArray, np.stack([part.positions.min(0), part.positions.max(0)])))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(part.triangles), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(part.triangles.reshape(-1).astype(np.int32)))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    if part.normals is not None:
        mesh.CreateNormalsAttr(vectors(Vt.Vec3fArray, part.normals))
        mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    uv = np.stack([part.uv[:, 0], 1 - part.uv[:, 1]], 1)
    kind = Sdf.ValueTypeNames.TexCoord2fArray
    UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", kind, UsdGeom.Tokens.vertex).Set(vectors(Vt.Vec2fArray, uv))


def preview_surface(stage: Any, material: Any, look: Look, files: dict[str, str]) -> None:
    """UsdPreviewSurface with its textures, below a material."""
    from pxr import Sdf, UsdShade

    path, types = material.GetPath(), Sdf.ValueTypeNames
    reader = UsdShade.Shader.Define(stage, f"{path}/uv")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", types.String).Set("st")
    st = reader.CreateOutput("result", types.Float2)
    surface = UsdShade.Shader.Define(stage, f"{path}/surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    material.CreateSurfaceOutput().ConnectToSource(surface.CreateOutput("surface", types.Token))

    def texture(role: str, space: str, scale: tuple = (), bias: tuple = ()) -> Any:
        shader = UsdShade.Shader.Define(stage, f"{path}/{role}")
        shader.CreateIdAttr("UsdUVTexture")
        shader.CreateInput("file", types.Asset).Set(f"./{files[role]}")
        shader.CreateInput("sourceColorSpace", types.Token).Set(space)
        for wrap in ("wrapS", "wrapT"):
            shader.CreateInput(wrap, types.Token).Set("repeat" if look.repeats else "clamp")
        for name, value in (("scale", scale), ("bias", bias)):
            if value:
                shader.CreateInput(name, types.Float4).Set(value)
        shader.CreateInput("st", types.Float2).ConnectToSource(st)
        return shader

    def connect(name: str, kind: Any, shader: Any, channel: str) -> None:
        output = shader.CreateOutput(channel, types.Float3 if channel == "rgb" else types.Float)
        surface.CreateInput(name, kind).ConnectToSource(output)

    connect("diffuseColor", types.Color3f, texture("albedo", "sRGB"), "rgb")
    orm = texture("orm", "raw")
    connect("roughness", types.Float, orm, "g")
    connect("metallic", types.Float, orm, "b")
    if "occlusion" in look.pictures:
        connect("occlusion", types.Float, orm, "r")
    if "normal" in files:
        s = look.normal_scale
        connect("normal", types.Normal3f, texture("normal", "raw", (2 * s, 2 * s, 2, 1), (-s, -s, -1, 0)), "rgb")
    if "emission" in files:
        connect("emissiveColor", types.Color3f, texture("emission", "sRGB", (*look.emissive, 1)), "rgb")
    elif any(look.emissive):
        surface.CreateInput("emissiveColor", types.Color3f).Set(look.emissive)
