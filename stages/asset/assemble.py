"""`dreammat assemble`: the assets of a scene's objects as one GLB, with the scene's own nodes.

Names, hierarchy and places are the scene's, as its file wrote them; nodes that shared a mesh share it again. An object
without an asset stands there in grey, if the job that `prep --split` made of it is still beside the others, else its nodes
are empty.
"""

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stages.asset.folder import MESH, MODEL, asset_manifest
from stages.asset.gltf import ARRAY, bare, generator, write_chunks
from stages.asset.model import source_model, upright
from stages.asset.read_glb import read_model
from stages.core.artifact import Artifact, intact, load_npz, peek, sha256_file
from stages.core.errors import InputError, OutputError
from stages.core.progress import Progress, silent
from stages.core.schemas import ASSET, PREP

INSTANCING = "EXT_mesh_gpu_instancing"


@dataclass(frozen=True)
class AssembleResult:
    """objects: names of those with an asset, in grey: of those without, empty: of those of which nothing is there."""

    path: Path
    up_to_date: bool
    objects: list[str]
    grey: list[str]
    empty: list[str]


@dataclass(frozen=True)
class Job:
    """An object of a scene. folder: its asset, or its job where that is not baked. sha256: of bake.json, or of prep.npz."""

    folder: Path
    prep: Path
    baked: bool
    sha256: str

    @property
    def mesh(self) -> Artifact:
        """Its prep.npz."""
        return load_npz(self.prep, PREP)


def assemble(assets: list[Path], out: Path, force: bool = False, progress: Progress = silent) -> AssembleResult:
    """Write a scene of assets that were made of one scene's objects.

    Args:
        assets: folders that `bake` or `edit` wrote. out: a .glb.
    Raises: ArtifactError, InputError, OutputError.
    """
    if out.suffix.lower() != ".glb" or out.is_dir():
        raise OutputError(f"{out}: expected the name of a .glb file")
    scene, jobs = _jobs(assets)
    names = [str(name) for name in scene["objects"]]
    jobs |= _beside(assets, scene, jobs)
    wanted = {"scene": scene["source"], "objects": {names[row]: jobs[row].sha256 for row in sorted(jobs)}}
    baked = [names[row] for row in sorted(jobs) if jobs[row].baked]
    grey = [names[row] for row in sorted(jobs) if not jobs[row].baked]
    empty = [name for row, name in enumerate(names) if row not in jobs]
    if not force and _made_from(out) == wanted:
        return AssembleResult(out, True, baked, grey, empty)
    merged = _Merged()
    meshes: dict[int, int] = {}
    for number, row in enumerate(sorted(jobs)):
        progress("assemble", number, len(jobs))
        meshes[row] = merged.add(*_model(jobs[row]))
    turn = upright(next(iter(jobs.values())).mesh["to_world"])
    merged.write(out, scene, meshes, turn.T.reshape(-1).tolist(), wanted)
    return AssembleResult(out, False, baked, grey, empty)


def _jobs(assets: list[Path]) -> tuple[dict[str, Any], dict[int, Job]]:
    """The scene of some assets, and the job of each object. Raises: ArtifactError, InputError."""
    first: tuple[Path, dict[str, Any]] | None = None
    jobs: dict[int, Job] = {}
    for folder in assets:
        _, files = asset_manifest(folder)
        prep = intact(folder, MESH, files)
        intact(folder, MODEL, files)
        said = load_npz(prep, PREP).provenance.extra.get("scene")
        if not said:
            raise InputError(f"{folder}: no object of a scene; expected assets of jobs that `dreammat prep --split` made")
        first = first or (folder, said)
        if said["source"] != first[1]["source"] or said["objects"] != first[1]["objects"]:
            raise InputError(
                f"{folder}: of another scene ({said['name']}) than {first[0]} ({first[1]['name']}); assemble each by itself"
            )
        if said["object"] in jobs:
            name, other = said["objects"][said["object"]], jobs[said["object"]].folder
            raise InputError(f"{folder}: is {name} of {said['name']}, and so is {other}; give one of them")
        jobs[said["object"]] = Job(folder, prep, True, sha256_file(folder / ASSET.manifest))
    assert first is not None
    return first[1], jobs


def _beside(assets: list[Path], scene: dict[str, Any], known: dict[int, Job]) -> dict[int, Job]:
    """Jobs of objects without an asset, in the folder that holds those of the assets."""
    found: dict[int, Job] = {}
    for row, name in enumerate(scene["objects"]):
        for root in dict.fromkeys(folder.resolve().parent.parent for folder in assets):
            prep = root / name / "prep.npz"
            made = peek(prep, PREP) if row not in known and prep.is_file() else None
            said = made.extra.get("scene") if made else None
            if said and (said["source"], said["object"]) == (scene["source"], row):
                found[row] = Job(root / name, prep, False, sha256_file(prep))
    return found


def _model(job: Job) -> tuple[dict[str, Any], bytes]:
    """JSON and binary part of an object's model."""
    if not job.baked:
        return bare(source_model(job.mesh, True))
    model = read_model(job.folder / MODEL)
    return model.root, model.chunk


def _made_from(path: Path) -> dict[str, Any] | None:
    """What a scene that this wrote was assembled from; None of any other file."""
    try:
        with open(path, "rb") as stream:
            magic, _, _, size, kind = struct.unpack("<4sIII4s", stream.read(20))
            if (magic, kind) != (b"glTF", b"JSON"):
                return None
            return json.loads(stream.read(size))["asset"]["extras"]["dreammat"]
    except (OSError, struct.error, ValueError, KeyError, TypeError):
        return None


class _Merged:
    """A GLB into which others' meshes are put, with all that they show."""

    LISTS = ("accessors", "bufferViews", "images", "samplers", "textures", "materials", "meshes")

    def __init__(self) -> None:
        self.root: dict[str, list[Any]] = {name: [] for name in self.LISTS}
        self.extensions: set[str] = set()
        self.pieces: list[bytes] = []
        self.length = 0

    def add(self, root: dict[str, Any], chunk: bytes) -> int:
        """Put in a model that stands on one node. Returns: its mesh."""
        first = {name: len(self.root[name]) for name in self.LISTS}
        put = self.root
        start = self._append(chunk)
        put["bufferViews"] += [view | {"byteOffset": view.get("byteOffset", 0) + start} for view in root["bufferViews"]]
        put["accessors"] += [of | {"bufferView": of["bufferView"] + first["bufferViews"]} for of in root["accessors"]]
        put["images"] += [of | {"bufferView": of["bufferView"] + first["bufferViews"]} for of in root.get("images", [])]
        put["samplers"] += root.get("samplers", [])
        for of in root.get("textures", []):
            sampler = {"sampler": of["sampler"] + first["samplers"]} if "sampler" in of else {}
            put["textures"].append(of | {"source": of["source"] + first["images"]} | sampler)
        put["materials"] += [_showing(of, first["textures"]) for of in root["materials"]]
        primitives = [_moved(of, first) for mesh in root["meshes"] for of in mesh["primitives"]]
        put["meshes"].append({"name": root["meshes"][0]["name"], "primitives": primitives})
        self.extensions |= set(root.get("extensionsUsed", []))
        return len(put["meshes"]) - 1

    def _append(self, data: bytes) -> int:
        """Add to the binary part. Returns: where it begins."""
        start, filling = self.length, b"\0" * (-len(data) % 4)
        self.pieces += [data, filling]
        self.length += len(data) + len(filling)
        return start

    def _column(self, rows: list[list[float]]) -> int:
        """An accessor of numbers, of an instance each."""
        values = np.array(rows, "<f4")
        view = {"buffer": 0, "byteOffset": self._append(values.tobytes()), "byteLength": values.nbytes, "target": ARRAY}
        self.root["bufferViews"].append(view)
        kind = f"VEC{values.shape[1]}"
        entry = {"bufferView": len(self.root["bufferViews"]) - 1, "componentType": 5126, "count": len(values), "type": kind}
        self.root["accessors"].append(entry)
        return len(self.root["accessors"]) - 1

    def nodes(self, scene: dict[str, Any], meshes: dict[int, int]) -> tuple[list[dict[str, Any]], list[int]]:
        """The scene's nodes with meshes on them; a mesh in another pose than its node's hangs on a node of its own."""
        nodes, roots = list[dict[str, Any]](), list(scene["roots"])
        for entry in scene["nodes"]:
            node = {key: value for key, value in entry.items() if key not in ("object", "instances")}
            if "instances" in entry:
                columns = {name: self._column(rows) for name, rows in entry["instances"].items()}
                node["extensions"] = {INSTANCING: {"attributes": columns}}
                self.extensions.add(INSTANCING)
            nodes.append(node)
        for row, entry in enumerate(scene["nodes"]):
            mesh = meshes.get(entry.get("object", -1))
            if mesh is None:
                continue
            if row in scene["posed"]:
                nodes.append({"name": f"{entry.get('name', 'node')} (posed)", "mesh": mesh})
                roots.append(len(nodes) - 1)
            else:
                nodes[row]["mesh"] = mesh
        return nodes, roots

    def write(
        self, path: Path, scene: dict[str, Any], meshes: dict[int, int], turn: list[float], made_from: dict[str, Any]
    ) -> None:
        """Write the scene. Args: turn: glTF's matrix from the source's frame to +y up."""
        nodes, roots = self.nodes(scene, meshes)
        if not np.array_equal(turn, np.eye(4).reshape(-1)):
            nodes.append({"name": "upright", "children": roots, "matrix": turn})
            roots = [len(nodes) - 1]
        document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": generator(), "extras": {"dreammat": made_from}},
            "scene": 0,
            "scenes": [{"nodes": roots}],
            "nodes": nodes,
            **{name: entries for name, entries in self.root.items() if entries},
            "buffers": [{"byteLength": self.length}],
        }
        if self.extensions:
            document["extensionsUsed"] = sorted(self.extensions)
        write_chunks(path, document, self.pieces)


def _moved(primitive: dict[str, Any], first: dict[str, int]) -> dict[str, Any]:
    """A primitive whose accessors and material come after others."""
    attributes = {name: index + first["accessors"] for name, index in primitive["attributes"].items()}
    indices, material = primitive["indices"] + first["accessors"], primitive["material"] + first["materials"]
    return primitive | {"attributes": attributes, "indices": indices, "material": material}


def _showing(content: Any, first: int) -> Any:
    """A material whose textures come after others."""
    if not isinstance(content, dict):
        return content
    return {
        key: value | {"index": value["index"] + first} if key.endswith("Texture") else _showing(value, first)
        for key, value in content.items()
    }


