"""MaterialX: <Name>.mtlx with its textures, and the model as GLB beside.

Every slot has two materials over the same pictures: `<slot>` by `gltf_pbr`, which is the BRDF that was optimised, and
`<slot>_standard_surface` for renderers that know only that. Colours are `srgb_texture`, everything else linear.
"""

from pathlib import Path
from typing import Any

from stages.asset.folder import Asset
from stages.asset.pictures import copy_model, write_pictures
from stages.asset.read_glb import Look
from stages.core.naming import identifier, unique


def write_materialx(asset: Asset, out: Path) -> list[str]:
    """Write <Name>.mtlx, textures/, <Name>.glb."""
    import MaterialX

    textures = write_pictures(asset, out)
    document = MaterialX.createDocument()
    document.setColorSpace("lin_rec709")
    graphs: dict[str, Any] = {}
    names = unique([identifier(look.name) for look in asset.model.looks])
    for name, look in zip(names, asset.model.looks, strict=True):
        stem = asset.stem_of(look)
        if stem not in graphs:
            graphs[stem] = graph(document, stem, look, textures[stem])
        add_materials(document, name, graphs[stem])
    MaterialX.writeToXmlFile(document, str(out / f"{asset.name}.mtlx"))
    files = [name for set_ in textures.values() for name in set_.values()]
    return [f"{asset.name}.mtlx", *dict.fromkeys(files), copy_model(asset, out)]


def graph(document: Any, stem: str, look: Look, files: dict[str, str]) -> Any:
    """The node graph that reads one set of pictures; its outputs are named as `gltf_pbr` names its inputs."""
    made = document.addNodeGraph(f"maps_{stem}")

    def image(role: str, space: str = "") -> Any:
        node = made.addNode("image", f"{role}_map", "vector3" if role == "normal" else "color3")
        file = node.setInputValue("file", files[role], "filename")
        if space:
            file.setColorSpace(space)
        for mode in ("uaddressmode", "vaddressmode"):
            node.setInputValue(mode, "periodic" if look.repeats else "clamp", "string")
        return node

    def output(name: str, kind: str, node: Any, channel: str = "") -> None:
        out = made.addOutput(name, kind)
        out.setNodeName(node.getName())
        if channel:
            out.setOutputString(channel)

    output("base_color", "color3", image("albedo", "srgb_texture"))
    packed = made.addNode("separate3", "channels", "multioutput")
    packed.addInput("in", "color3").setNodeName(image("orm").getName())
    for channel in ("outr", "outg", "outb"):
        packed.addOutput(channel, "float")
    output("roughness", "float", packed, "outg")
    output("metallic", "float", packed, "outb")
    if "occlusion" in look.pictures:
        output("occlusion", "float", packed, "outr")
    if "normal" in files:
        node = made.addNode("normalmap", "tangent_space", "vector3")
        node.addInput("in", "vector3").setNodeName(image("normal").getName())
        node.setInputValue("scale", look.normal_scale, "float")
        output("normal", "vector3", node)
    if "emission" in files:
        node = made.addNode("multiply", "emitted", "color3")
        node.addInput("in1", "color3").setNodeName(image("emission", "srgb_texture").getName())
        node.addInput("in2", "color3").setValueString(", ".join(f"{c:g}" for c in look.emissive))
        output("emissive", "color3", node)
    elif any(look.emissive):
        node = made.addNode("constant", "emitted", "color3")
        node.addInput("value", "color3").setValueString(", ".join(f"{c:g}" for c in look.emissive))
        output("emissive", "color3", node)
    return made


STANDARD = {
    "base_color": "base_color", "roughness": "specular_roughness", "metallic": "metalness", "normal": "normal",
    "emissive": "emission_color",
}  # fmt: skip
"""Input of gltf_pbr -> input of standard_surface, which knows no occlusion."""


def add_materials(document: Any, name: str, maps: Any) -> None:
    """A slot's two materials on the outputs of a graph."""
    gltf = document.addNode("gltf_pbr", f"SR_{name}", "surfaceshader")
    standard = document.addNode("standard_surface", f"SR_{name}_standard_surface", "surfaceshader")
    standard.setInputValue("base", 1.0, "float")
    for out in maps.getOutputs():
        gltf.addInput(out.getName(), out.getType()).setConnectedOutput(out)
        if out.getName() in STANDARD:
            standard.addInput(STANDARD[out.getName()], out.getType()).setConnectedOutput(out)
    if maps.getOutput("emissive"):
        standard.setInputValue("emission", 1.0, "float")
    for shader, material in ((gltf, name), (standard, f"{name}_standard_surface")):
        node = document.addNode("surfacematerial", material, "material")
        node.addInput("surfaceshader", "surfaceshader").setNodeName(shader.getName())
