"""The objects of a scene: what hangs on a node, once for all nodes that share it; and one of them taken out of its source."""

import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.core.naming import identifier, unique
from stages.prep.source import IDENTITY, Source, Tree

TEXTURES = ("normalTexture", "occlusionTexture", "emissiveTexture")


@dataclass(frozen=True)
class Object:
    """name: a file's. title: the first node's. parts: those of the first place where it stands. nodes: all that show it."""

    name: str
    title: str
    parts: list[int]
    nodes: list[int]


def tree_of(source: Source) -> Tree:
    """The scene's nodes; a flat tree, a node for each place, where the format has none."""
    if source.tree is not None:
        return source.tree
    row: dict[tuple, int] = {}
    places = [(row.setdefault((part.node or part.name, part.transform), len(row)), 0) for part in source.parts]
    nodes, shared = list[dict[str, Any]](), list[list[int]]([] for _ in row)
    for name, transform in row:
        nodes.append({"name": name} if name else {})
        if transform != IDENTITY:
            nodes[-1]["matrix"] = np.reshape(transform, (4, 4)).T.reshape(-1).tolist()
    for number, (part, (node, _)) in enumerate(zip(source.parts, places, strict=True)):
        shared[node].append(part.instance_of if part.instance_of >= 0 else number)
    known: dict[tuple, int] = {}
    return Tree(nodes, list(range(len(nodes))), places, [known.setdefault(tuple(firsts), len(known)) for firsts in shared])


def objects(source: Source, own_instances: bool = False) -> list[Object]:
    """The objects, by their first places. Args: own_instances: whether nodes that share a mesh are objects apart."""
    tree = tree_of(source)
    of_mesh: dict[int, Object] = {}
    for number, (node, instance) in enumerate(tree.places):
        title = str(tree.nodes[node].get("name") or source.parts[number].name or f"node_{node}")
        made = of_mesh.setdefault(node if own_instances else tree.meshes[node], Object("", title, [], [node]))
        if node not in made.nodes:
            made.nodes.append(node)
        if node == made.nodes[0] and instance == 0:
            made.parts.append(number)
    found = list(of_mesh.values())
    plain = [one.title if re.search("[A-Za-z0-9]", one.title) else f"object_{number}" for number, one in enumerate(found, 1)]
    names = unique([identifier(title) for title in plain])
    return [replace(one, name=name) for one, name in zip(found, names, strict=True)]


def told_scene(tree: Tree, found: list[Object]) -> dict[str, Any]:
    """The nodes as JSON, each with the row of the object that it shows."""
    of_node = {node: row for row, one in enumerate(found) for node in one.nodes}
    nodes = [entry | ({"object": of_node[k]} if k in of_node else {}) for k, entry in enumerate(tree.nodes)]
    return {"nodes": nodes, "roots": tree.roots, "posed": tree.posed, "objects": [one.name for one in found]}


def only(source: Source, parts: list[int]) -> Source:
    """The source with some of its parts alone, its rows in their order."""
    faces = np.flatnonzero(np.isin(source.face_part, parts))
    lengths = np.diff(source.loop_start)[faces]
    loops = np.repeat(source.loop_start[faces] - (np.cumsum(lengths) - lengths), lengths) + np.arange(lengths.sum())
    vertices, loop_vertex = _fewer(source.vertices, source.loop_vertex[loops])
    uv, loop_uv = _fewer(source.uv, source.loop_uv[loops])
    normals, loop_normal = _fewer(source.normals, source.loop_normal[loops])
    tangents, loop_tangent = source.tangents[:0], None
    if source.loop_tangent is not None:
        tangents, loop_tangent = _fewer(source.tangents, source.loop_tangent[loops])
    kept = [source.parts[number] for number in parts]
    passed_on, images = _passed_on(source, {part.material for part in kept})
    return replace(
        source, vertices=vertices, uv=uv, normals=normals, tangents=tangents, loop_vertex=loop_vertex, loop_uv=loop_uv,
        loop_normal=loop_normal, loop_tangent=loop_tangent, parts=[replace(part, instance_of=-1) for part in kept],
        loop_start=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32),
        face_part=np.searchsorted(parts, source.face_part[faces]).astype(np.int32),
        face_group=None if source.face_group is None else source.face_group[faces],
        more_uv=[_fewer(table, rows[loops]) for table, rows in source.more_uv],
        passed_on=passed_on, images=images, tree=None,
    )  # fmt: skip


def _fewer(table: NDArray, rows: NDArray) -> tuple[NDArray, NDArray[np.int32]]:
    """The rows of a table that are used, in their order, and where each is now; -1 stays."""
    used, now = np.unique(rows[rows >= 0], return_inverse=True)
    made = np.full(len(rows), -1, np.int32)
    made[rows >= 0] = now.reshape(-1)
    return table[used], made


def _passed_on(source: Source, slots: set[str]) -> tuple[dict[str, Any], list[bytes]]:
    """What the materials of some slots bring along, and no other's."""
    given = source.passed_on
    materials = {name: dict(of) for name, of in given["materials"].items() if name in slots}
    shown = sorted({of[key]["index"] for of in materials.values() for key in TEXTURES if key in of})
    files = sorted({given["textures"][row]["image"] for row in shown})
    for of in materials.values():
        of.update({key: of[key] | {"index": shown.index(of[key]["index"])} for key in TEXTURES if key in of})
    textures = [given["textures"][row] | {"image": files.index(given["textures"][row]["image"])} for row in shown]
    return (
        {"materials": materials, "textures": textures, "images": [given["images"][row] for row in files]},
        [source.images[row] for row in files],
    )
