"""What a glTF source's materials have besides colour comes out again, and its normal map is what light is traced with."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stages.asset.gltf import Look, Pictures, write_glb
from stages.asset.model import source_model
from stages.asset.passed_on import PassedOn
from stages.asset.traced import traced_scene, uv_matrix
from stages.asset.worn import Worn
from stages.core.artifact import Artifact, load_npz
from stages.core.frames import Y_UP_TO_WORLD, look_at
from stages.core.images import write_png
from stages.core.schemas import PREP
from stages.light.gbuffer import trace_view
from stages.prep.options import PrepOptions
from stages.prep.stage import prep
from tests.asset.glb import Glb
from tests.asset.test_models import assert_same_bits, khronos_issues
from tests.prep.shapes import GltfBuilder

LEANING = np.array([153, 179, 217])
"""Bytes of a normal of (0.2, 0.4, 0.7), nearly."""

QUAD = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], "f4")  # faces +y
UV = np.array([[0.1, 0.9], [0.9, 0.9], [0.9, 0.1], [0.1, 0.1]], "f4")  # u along x, v up along -z
UP = np.array([[0, 1, 0]] * 4, "f4")


def png(folder: Path, colour: Any, name: str = "map.png") -> bytes:
    """A PNG of 4 x 4 texels."""
    write_png(folder / name, np.broadcast_to(np.array(colour, np.uint8), (4, 4, len(colour))))
    return (folder / name).read_bytes()


class Textured(GltfBuilder):
    """One quad with a material whose textures the tests choose."""

    def image(self, data: bytes, **more: Any) -> int:
        """Embed an image file. Returns: its row."""
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        self.data += data.ljust(-(-len(data) // 4) * 4, b"\0")
        self.root["bufferViews"].append(view)
        images = self.root.setdefault("images", [])
        images.append({"bufferView": len(self.root["bufferViews"]) - 1, "mimeType": "image/png", **more})
        return len(images) - 1

    def texture(self, image: int, **sampler: int) -> int:
        """A texture and its sampler. Returns: its row."""
        textures = self.root.setdefault("textures", [])
        textures.append({"source": image})
        if sampler:
            self.root.setdefault("samplers", []).append(sampler)
            textures[-1]["sampler"] = len(self.root["samplers"]) - 1
        return len(textures) - 1

    def quad(self, material: dict[str, Any], tangents: Any = None, **node: Any) -> "Textured":
        attributes = {"POSITION": self.accessor(QUAD, "VEC3"), "NORMAL": self.accessor(UP, "VEC3"),
                      "TEXCOORD_0": self.accessor(UV, "VEC2")}  # fmt: skip
        if tangents is not None:
            attributes["TANGENT"] = self.accessor(np.array(tangents, "f4"), "VEC4")
        indices = self.accessor(np.array([0, 1, 2, 0, 2, 3], np.uint16), "SCALAR")
        materials = self.root.setdefault("materials", [])
        materials.append(material)
        primitive = {"attributes": attributes, "indices": indices, "material": len(materials) - 1}
        self.mesh([primitive], **node)
        self.root["scenes"] = [{"nodes": list(range(len(self.root["nodes"])))}]
        return self


def prepared(built: GltfBuilder, folder: Path, **options: Any) -> Artifact:
    source = built.write(folder / "source.glb")
    prep(source, folder / "prep.npz", PrepOptions(**options))
    return load_npz(folder / "prep.npz", PREP)


def written(mesh: Artifact, folder: Path, kind: str = "") -> Glb:
    """model.glb, without one kind of the source's textures if named."""
    passed_on = PassedOn.of(mesh).without(kind)
    model = source_model(mesh, True, passed_on.normal_maps())
    baked = png(folder, (128, 128, 128))
    write_glb(folder / "model.glb", model, Look([Pictures({"albedo": baked, "orm": baked})], passed_on=passed_on))
    issues = khronos_issues(folder / "model.glb")
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]
    return Glb.read(folder / "model.glb")


def everything(folder: Path) -> tuple[Textured, dict[str, Any], list[bytes]]:
    """A material with all that is passed on; its properties; its images."""
    built = Textured()
    files = [png(folder, LEANING), png(folder, (200, 0, 0)), png(folder, (9, 8, 7))]
    normal, occlusion, emission = (built.image(data, name=name) for data, name in zip(files, "noe", strict=True))
    material = {
        "name": "skin",
        "normalTexture": {"index": built.texture(normal, wrapS=33071, magFilter=9728), "scale": 0.5},
        "occlusionTexture": {"index": built.texture(occlusion), "strength": 0.3},
        "emissiveTexture": {
            "index": built.texture(emission, wrapT=33648),
            "extensions": {"KHR_texture_transform": {"scale": [2, 3], "offset": [0.5, 0], "rotation": 0.25}},
        },
        "emissiveFactor": [1, 0.5, 0.25],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}, "KHR_materials_ior": {"ior": 1.4}},
    }
    built.root["extensionsUsed"] = ["KHR_texture_transform", "KHR_materials_emissive_strength", "KHR_materials_ior"]
    return built.quad(material), material, files


def test_textures_come_out_with_their_bytes_samplers_and_settings(tmp_path: Path) -> None:
    built, source, files = everything(tmp_path)
    glb = written(prepared(built, tmp_path), tmp_path)
    (made,) = glb.root["materials"]
    for (kind, was), data in zip([(k, source[k]) for k in source if k.endswith("Texture")], files, strict=True):
        texture = glb.root["textures"][made[kind]["index"]]
        assert {k: v for k, v in made[kind].items() if k != "index"} == {k: v for k, v in was.items() if k != "index"}
        assert glb.view(glb.root["images"][texture["source"]]["bufferView"]) == data
        sampler = built.root["textures"][was["index"]].get("sampler")
        wanted = None if sampler is None else built.root["samplers"][sampler]
        assert (glb.root["samplers"][texture["sampler"]] if "sampler" in texture else None) == wanted
    assert made["emissiveFactor"] == source["emissiveFactor"]
    assert made["extensions"] == {"KHR_materials_emissive_strength": {"emissiveStrength": 4}}
    assert glb.root["extensionsUsed"] == ["KHR_materials_emissive_strength", "KHR_texture_transform"]
    assert [image["name"] for image in glb.root["images"]] == ["albedo", "orm", "n", "o", "e"]


def test_what_is_made_anew_is_not_passed_on_nor_are_its_bytes(tmp_path: Path) -> None:
    built, _, files = everything(tmp_path)
    glb = written(prepared(built, tmp_path), tmp_path, "normalTexture")
    assert "normalTexture" not in glb.root["materials"][0]
    assert [image["name"] for image in glb.root["images"]] == ["albedo", "orm", "o", "e"]
    texture = glb.root["textures"][glb.root["materials"][0]["emissiveTexture"]["index"]]
    assert glb.view(glb.root["images"][texture["source"]]["bufferView"]) == files[2]


def test_nothing_is_passed_on_to_new_uvs(tmp_path: Path) -> None:
    built, _, _ = everything(tmp_path)
    mesh = prepared(built, tmp_path, uv="new")
    assert PassedOn.of(mesh) == PassedOn() and not len(mesh["source_images"])
    assert traced_scene(mesh).bumps is None


def test_authored_tangents_are_kept_and_missing_ones_computed(tmp_path: Path) -> None:
    turned = np.array([[0.6, 0, 0.8, -1]] * 4, "f4")
    for tangents, wanted in ((turned, turned), (None, np.array([[1, 0, 0, 1]] * 4, "f4"))):
        built = Textured()
        normal = built.texture(built.image(png(tmp_path, LEANING)))
        mesh = prepared(built.quad({"normalTexture": {"index": normal}}, tangents), tmp_path)
        glb = written(mesh, tmp_path)
        (primitive,) = glb.primitives()
        found = glb.attribute(primitive, "TANGENT")
        if tangents is not None:
            assert_same_bits(found, wanted)
        np.testing.assert_allclose(found, wanted, atol=1e-6)
        assert len(found) == 4  # not split


def two_quads(folder: Path, *materials: dict[str, Any]) -> Artifact:
    """Side by side in space and in UV, a material each."""
    built = Textured()
    for row, material in enumerate(materials):
        if (colour := material.pop("map", None)) is not None:
            material["normalTexture"] = {"index": built.texture(built.image(png(folder, colour)))}
        built.quad(material, translation=[3.0 * row, 0, 0])
        attributes = built.root["meshes"][row]["primitives"][0]["attributes"]
        attributes["TEXCOORD_0"] = built.accessor((UV * [0.4, 1] + [0.5 * row, 0]).astype("f4"), "VEC2")
    return prepared(built, folder)


def test_tangents_only_where_there_is_a_normal_map(tmp_path: Path) -> None:
    mesh = two_quads(tmp_path, {"name": "bumpy", "map": LEANING}, {"name": "plain"})
    bumpy, plain = written(mesh, tmp_path).primitives()
    assert "TANGENT" in bumpy["attributes"] and "TANGENT" not in plain["attributes"]


def test_other_uv_sets_foreign_formats_missing_and_torn_files_are_counted(tmp_path: Path) -> None:
    built = Textured()
    good, foreign = built.image(png(tmp_path, LEANING)), built.image(b"RIFF....WEBP")
    built.root["images"].append({"uri": "gone.png"})
    torn = built.image(png(tmp_path, LEANING)[:60])
    material = {
        "normalTexture": {"index": built.texture(good), "texCoord": 1},
        "occlusionTexture": {"index": built.texture(foreign)},
        "emissiveTexture": {"index": built.texture(2)},
        "emissiveFactor": [1, 1, 1],
    }
    built.root["materials"] = [{"normalTexture": {"index": built.texture(torn)}}]
    mesh = prepared(built.quad(material), tmp_path)
    skipped = mesh.provenance.extra["findings"]["skipped"]
    assert skipped == {"textures_of_other_uv_sets": 1, "textures_not_png_or_jpeg": 1, "textures_missing": 1,
                       "textures_damaged": 1}  # fmt: skip
    assert PassedOn.of(mesh).materials == {}


def test_images_beside_a_gltf_are_read_and_hashed(tmp_path: Path) -> None:
    built = Textured()
    data = png(tmp_path, LEANING, "my map.png")
    built.root["images"] = [{"uri": "my%20map.png"}]
    source = built.quad({"normalTexture": {"index": built.texture(0)}}).write(tmp_path / "source.gltf")
    prep(source, tmp_path / "prep.npz", PrepOptions())
    mesh = load_npz(tmp_path / "prep.npz", PREP)
    assert PassedOn.of(mesh).images == [("", "image/png", data)]
    assert "mesh:my%20map.png" in mesh.provenance.inputs
    png(tmp_path, (128, 128, 255), "my map.png")
    assert not prep(source, tmp_path / "prep.npz", PrepOptions()).up_to_date


def test_materials_of_one_name_stay_apart(tmp_path: Path) -> None:
    mesh = two_quads(tmp_path, {"name": "same", "map": LEANING}, {"name": "same", "map": (100, 128, 250)})
    glb = written(mesh, tmp_path)
    assert [material["name"] for material in glb.root["materials"]] == ["same", "same_1"]
    pictures = [glb.root["textures"][m["normalTexture"]["index"]]["source"] for m in glb.root["materials"]]
    assert len(set(pictures)) == 2


@pytest.mark.parametrize("node", [{}, {"scale": [-1, 1, 1]}, {"rotation": [0, 0.6, 0, 0.8]}, {"scale": [1, 2, 3]}])
def test_light_is_traced_with_the_sources_normal_map(tmp_path: Path, node: dict[str, Any]) -> None:
    """Seen from above, the normal is the map's in the quad's own frame, placed as the node says."""
    built = Textured()
    normal = built.texture(built.image(png(tmp_path, LEANING)))
    mesh = prepared(built.quad({"normalTexture": {"index": normal, "scale": 0.5}}, **node), tmp_path)
    above = look_at(np.array([0.0, 0, 3]), np.zeros(3), np.array([0.0, 1, 0]))
    points = trace_view(traced_scene(mesh), above, 0.2, 4, 4)
    x, y, z = (LEANING / 255 * 2 - 1) * [0.5, 0.5, 1]
    (part,) = mesh.provenance.extra["parts"]
    linear = np.reshape(part["transform"], (4, 4))[:3, :3]
    tangent = linear @ [1, 0, 0]  # u is along the quad's x, v along -z, its normal +y
    along, across = tangent / np.linalg.norm(tangent), np.cross([0, 1, 0], tangent / np.linalg.norm(tangent))
    across = across * np.sign(across @ (linear @ [0, 0, -1]))
    wanted = Y_UP_TO_WORLD[:3, :3] @ (x * along + y * across + z * np.array([0, 1, 0]))
    np.testing.assert_allclose(points.n, np.broadcast_to(wanted / np.linalg.norm(wanted), points.n.shape), atol=2e-3)


def test_texture_transform_turns_as_three_js_does() -> None:
    matrix = uv_matrix({"offset": [0.5, 0.25], "rotation": np.pi / 2, "scale": [2, 3]})
    np.testing.assert_allclose(matrix @ [1, 0, 1], [0.5, -1.75], atol=1e-12)
    np.testing.assert_allclose(matrix @ [0, 1, 1], [3.5, 0.25], atol=1e-12)


def test_a_sources_own_occlusion_goes_before_the_baked_one(tmp_path: Path) -> None:
    built, source, _ = everything(tmp_path)
    look = Look([Pictures({"albedo": b"", "orm": b""})], occlusion=True, passed_on=PassedOn.of(prepared(built, tmp_path)))
    own = look.material(Worn("skin", "skin", 0))["occlusionTexture"]
    assert (own["index"] > 1, own["strength"]) == (True, source["occlusionTexture"]["strength"])
    assert look.material(Worn("other", "other", 0))["occlusionTexture"] == {"index": 1}
