"""glTF 2.0, as .glb and as .gltf with data URIs or files beside it: the geometry of the default scene, bit for bit, and
the textures of its materials that are not made anew.

Own reader, because general ones flip v and re-index vertices. Source: glTF 2.0 specification, sections 3.5 to 3.7. A
part is one primitive of one mesh on one node, or on one instance of it; vertices keep the order of their accessors, v = 0
is the top row. Skins are applied in their default pose and morph targets with their default weights; animations are left
out, and so is what is hidden.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.core.errors import InputError
from stages.prep.gltf_data import accessor, unpacked
from stages.prep.gltf_file import DRACO, Gltf, open_gltf
from stages.prep.gltf_nodes import Nodes, morphed, skinned
from stages.prep.gltf_textures import material_name, pass_on
from stages.prep.source import IDENTITY, Part, Source, Tree, check_range, polygons

_POINTS, _TRIANGLES, _STRIP, _FAN = 0, 4, 5, 6


@dataclass(frozen=True)
class _Block:
    """Vertices that primitives share: the first rows of positions, normals, tangents (-1: none), UV sets; the count.

    triangles: (T, 3) vertices, where they are packed together with them.
    """

    position: int
    normal: int
    tangent: int
    uv: list[int]
    count: int
    triangles: NDArray[np.int64] | None


@dataclass
class _Rows:
    """Arrays of one kind, joined at the end. count: rows so far."""

    blocks: list[NDArray]
    count: int = 0

    def add(self, values: NDArray | None, shape: tuple[int, int], what: str, path: Path) -> int:
        """Append values. Returns: the first of their rows, -1 for none. Raises: InputError."""
        if values is None:
            return -1
        if values.shape != shape:
            raise InputError(f"{path}: a primitive's {what} is {values.shape}, expected {shape}; export it again")
        self.blocks.append(values.astype(self.blocks[0].dtype))
        self.count += len(values)
        return self.count - len(values)

    def joined(self) -> NDArray:
        return np.concatenate(self.blocks)


@dataclass
class _Geometry:
    """What is gathered while the scene is walked."""

    positions: _Rows = field(default_factory=lambda: _Rows([np.zeros((0, 3))]))
    uv: _Rows = field(default_factory=lambda: _Rows([np.zeros((0, 2))]))  # of all sets
    normals: _Rows = field(default_factory=lambda: _Rows([np.zeros((0, 3), np.float32)]))
    tangents: _Rows = field(default_factory=lambda: _Rows([np.zeros((0, 4), np.float32)]))
    corners: list[tuple[NDArray, _Block]] = field(default_factory=list)  # vertices within the block
    parts: list[Part] = field(default_factory=list)
    places: list[tuple[int, int]] = field(default_factory=list)  # node and instance of each part
    skipped: dict[str, int] = field(default_factory=dict)
    applied: dict[str, int] = field(default_factory=dict)
    blocks: dict[tuple, _Block] = field(default_factory=dict)


def read_gltf(path: Path) -> Source:
    """Read a .glb or .gltf file. Raises: InputError."""
    gltf = open_gltf(path)
    try:
        geometry = _gather(gltf)
        tree = _tree(gltf, geometry)
        passed_on, images = pass_on(gltf, lambda what: _count(geometry.skipped, what))
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise InputError(f"{path}: not valid glTF 2.0 ({type(error).__name__}: {error}); export it again") from None
    vertex, positions = _loops(geometry, lambda block: block.position), geometry.positions.joined()
    start, loop_vertex = polygons(np.full(len(vertex) // 3, 3), len(positions), vertex, path)
    sets = max((len(block.uv) for _, block in geometry.corners), default=0)
    uv = geometry.uv.joined()
    first, *more = [_loops(geometry, lambda block, k=k: (*block.uv[k : k + 1], -1)[0]) for k in range(max(sets, 1))]
    face_part = np.repeat(np.arange(len(geometry.parts)), [len(corner) // 3 for corner, _ in geometry.corners])
    return Source(
        "glb", positions, uv, geometry.normals.joined(), start, loop_vertex,
        first, _loops(geometry, lambda block: block.normal), face_part.astype(np.int32), geometry.parts, v_down=True,
        skipped=geometry.skipped, applied=geometry.applied, more_uv=[(uv, rows) for rows in more],
        tangents=geometry.tangents.joined(), loop_tangent=_loops(geometry, lambda block: block.tangent),
        passed_on=passed_on, images=images, tree=tree,
    )  # fmt: skip


def _loops(geometry: _Geometry, first: Any) -> NDArray[np.int32]:
    """(L,) the row of each corner, where first(block) is a block's first one, or -1."""
    rows = [np.where(first(block) >= 0, first(block) + corner, -1) for corner, block in geometry.corners]
    return np.concatenate([np.zeros(0, np.int64), *rows]).astype(np.int32)


def _gather(gltf: Gltf) -> _Geometry:
    """Walk the default scene, depth first, in the order of the file."""
    nodes, geometry = Nodes(gltf), _Geometry()
    for index in nodes.of_scene():
        if "mesh" in nodes.entries[index]:
            if nodes.visible[index]:
                _add_node(gltf, geometry, nodes, index)
            else:
                _count(geometry.skipped, "hidden_nodes")
    for kind in ("animations", "cameras"):
        if gltf.root.get(kind):
            _count(geometry.skipped, kind, len(gltf.root[kind]))
    return geometry


def _tree(gltf: Gltf, geometry: _Geometry) -> Tree:
    """The scene's nodes, for who gives them back."""
    nodes, kept = Nodes(gltf), ("name", "children", "translation", "rotation", "scale", "matrix", "extras")
    entries, meshes, posed = list[dict[str, Any]](), list[int](), list[int]()
    with_parts = {node for node, _ in geometry.places}
    for index, node in enumerate(nodes.entries):
        entries.append({key: node[key] for key in kept if key in node})
        if columns := nodes.instancing(index):
            entries[-1]["instances"] = {name: rows.tolist() for name, rows in columns.items()}
        alone = "skin" in node or "weights" in node  # another pose of the mesh
        meshes.append(-1 if index not in with_parts else len(gltf.root["meshes"]) + index if alone else node["mesh"])
        posed += [index] * ("skin" in node and index in with_parts)
    return Tree(entries, nodes.roots(), geometry.places, meshes, posed)


def _count(counts: dict[str, int], what: str, count: int = 1) -> None:
    counts[what] = counts.get(what, 0) + count


def _add_node(gltf: Gltf, geometry: _Geometry, nodes: Nodes, index: int) -> None:
    """Add the parts of a node's mesh, once for each of its instances."""
    node = nodes.entries[index]
    name = node.get("name") or f"node_{index}"
    joints = nodes.joints(node["skin"]) if "skin" in node else None
    transforms, instanced = nodes.instances(index)
    if joints is not None:
        _count(geometry.applied, "skins_in_their_default_pose")
    if instanced:
        _count(geometry.applied, "instances", len(transforms))
    for number, transform in enumerate(transforms):
        part = Part("", "", f"{name}_{number}" if instanced else name, tuple(float(x) for x in transform.reshape(-1)))
        _add_mesh(gltf, geometry, (index, number), node, joints, part)


def _add_mesh(
    gltf: Gltf, geometry: _Geometry, key: tuple[int, int], node: dict, joints: NDArray | None, at: Part
) -> None:
    """Add the parts of a mesh on the node and with the transform of `at`. key: (node, instance)."""
    mesh = gltf.item("meshes", node["mesh"])
    name = mesh.get("name") or f"mesh_{node['mesh']}"
    weights = node.get("weights") or mesh.get("weights") or []
    for primitive in mesh["primitives"]:
        mode = primitive.get("mode", _TRIANGLES)
        if mode < _TRIANGLES:
            _count(geometry.skipped, "points" if mode == _POINTS else "lines")
            continue
        if "POSITION" not in primitive["attributes"]:
            _count(geometry.skipped, "primitives_without_positions")
            continue
        if "targets" in primitive:
            _count(geometry.applied, "morph_targets_with_their_default_weights", len(primitive["targets"]))
        material = ""
        if "material" in primitive:
            gltf.item("materials", primitive["material"])
            material = material_name(gltf.root["materials"], primitive["material"])
        posed = joints if "JOINTS_0" in primitive["attributes"] else None
        block = _block(gltf, geometry, key, primitive, weights, posed)
        triangles = _triangles(gltf, primitive, mode, block.count) if block.triangles is None else block.triangles
        corner = triangles.reshape(-1)
        check_range(corner, block.count, "vertex", gltf.path)
        gltf.bounded(geometry.positions.count, "vertices")
        geometry.corners.append((corner, block))
        geometry.places.append(key)
        geometry.parts.append(Part(name, material, at.node, at.transform if posed is None else IDENTITY))


def _block(
    gltf: Gltf, geometry: _Geometry, at: tuple[int, int], primitive: dict, weights: list, joints: NDArray | None
) -> _Block:
    """A primitive's vertices, morphed and posed. Primitives of one node that share their accessors share them."""
    needed = {name: index for name, index in primitive["attributes"].items() if _is_needed(name)}
    key = (*at, repr([sorted(needed.items()), primitive.get("targets"), primitive.get("extensions", {}).get(DRACO)]))
    if key not in geometry.blocks:
        draco = unpacked(gltf, primitive)
        attributes = draco[0] if draco else {name: accessor(gltf, index) for name, index in needed.items()}
        attributes = morphed(gltf, attributes, primitive.get("targets", []), weights)
        if joints is not None:
            attributes = skinned(gltf, attributes, joints)
        if joints is not None or any(weights):
            attributes.pop("TANGENT", None)  # those of another pose
        count = len(attributes["POSITION"])
        sets = sorted(name for name in attributes if name.startswith("TEXCOORD_"))
        geometry.blocks[key] = _Block(
            geometry.positions.add(attributes["POSITION"], (count, 3), "POSITION", gltf.path),
            geometry.normals.add(attributes.get("NORMAL"), (count, 3), "NORMAL", gltf.path),
            geometry.tangents.add(attributes.get("TANGENT"), (count, 4), "TANGENT", gltf.path),
            [geometry.uv.add(attributes[name], (count, 2), name, gltf.path) for name in sets],
            count,
            draco[1] if draco else None,
        )
    return geometry.blocks[key]


def _is_needed(attribute: str) -> bool:
    return attribute in ("POSITION", "NORMAL", "TANGENT") or attribute.startswith(("TEXCOORD_", "JOINTS_", "WEIGHTS_"))


def _triangles(gltf: Gltf, primitive: dict, mode: int, count: int) -> NDArray[np.int64]:
    """Vertex indices (T, 3) of a triangle list, strip or fan (section 3.7.2.1)."""
    indexed = "indices" in primitive
    index = accessor(gltf, primitive["indices"])[:, 0].astype(np.int64) if indexed else np.arange(count)
    if mode == _TRIANGLES:
        return index[: len(index) // 3 * 3].reshape(-1, 3)
    i = np.arange(max(len(index) - 2, 0))
    if mode == _STRIP:
        return np.stack([index[i], index[i + 1 + i % 2], index[i + 2 - i % 2]], -1)
    if mode == _FAN:
        return np.stack([index[i + 1], index[i + 2], np.broadcast_to(index[:1], i.shape)], -1)
    raise InputError(f"{gltf.path}: primitive mode {mode}, expected 0 to 6; export it again")
