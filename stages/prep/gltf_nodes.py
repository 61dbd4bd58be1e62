"""Nodes of a glTF scene: where they stand, which are seen, and the pose and the instances of what hangs on them.

Source: glTF 2.0 specification, sections 3.5 and 3.7.3; KHR_node_visibility, EXT_mesh_gpu_instancing.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.core.errors import InputError
from stages.prep.gltf_data import accessor
from stages.prep.gltf_file import Gltf
from stages.prep.source import check_range

_INSTANCING = "EXT_mesh_gpu_instancing"


class Nodes:
    """The nodes of a file. world: (4, 4) of each to the scene's frame. Raises: InputError when they form a loop."""

    def __init__(self, gltf: Gltf) -> None:
        self.gltf = gltf
        self.entries: list[dict[str, Any]] = gltf.root.get("nodes", [])
        self.world = [np.eye(4)] * len(self.entries)
        parents = {child for node in self.entries for child in node.get("children", [])}
        self.orphans = [index for index in range(len(self.entries)) if index not in parents]
        self.visible = [True] * len(self.entries)
        for index in self.below(self.orphans):
            node = gltf.item("nodes", index)
            self.world[index] = self.world[index] @ local_transform(node)
            self.visible[index] &= node.get("extensions", {}).get("KHR_node_visibility", {}).get("visible", True)
            for child in node.get("children", []):
                gltf.item("nodes", child)
                self.world[child], self.visible[child] = self.world[index], self.visible[index]

    def below(self, roots: list[int]) -> list[int]:
        """The roots and all their descendants, a node before its children and each subtree in one piece."""
        order: list[int] = []
        stack = list(reversed(roots))
        while stack:
            index = stack.pop()
            order.append(index)
            if len(order) > len(self.entries):
                raise InputError(f"{self.gltf.path}: its nodes form a loop; export it again")
            stack += reversed(self.gltf.item("nodes", index).get("children", []))
        return order

    def of_scene(self) -> list[int]:
        """Nodes of the default scene; of all trees where there is none."""
        return self.below(self.roots())

    def roots(self) -> list[int]:
        """Those of the default scene; of all trees where there is none."""
        if not self.gltf.root.get("scenes"):
            return self.orphans
        return list(self.gltf.item("scenes", self.gltf.root.get("scene", 0)).get("nodes", []))

    def instancing(self, index: int) -> dict[str, NDArray[np.float64]]:
        """Translations, rotations and scales of a node's instances, of what there is; empty where it has none."""
        attributes = self.entries[index].get("extensions", {}).get(_INSTANCING, {}).get("attributes") or {}
        return {name: accessor(self.gltf, attributes[name]).astype(np.float64)
                for name in ("TRANSLATION", "ROTATION", "SCALE") if name in attributes}  # fmt: skip

    def instances(self, index: int) -> tuple[list[NDArray], bool]:
        """Transforms to the scene of what hangs on a node, and whether they come from instancing."""
        columns = self.instancing(index)
        if not columns and not self.entries[index].get("extensions", {}).get(_INSTANCING, {}).get("attributes"):
            return [self.world[index]], False
        count = min((len(rows) for rows in columns.values()), default=0)
        keys = {"TRANSLATION": "translation", "ROTATION": "rotation", "SCALE": "scale"}
        rows = [{keys[name]: values[i] for name, values in columns.items()} for i in range(count)]
        return [self.world[index] @ local_transform(row) for row in rows], True

    def joints(self, skin_index: Any) -> NDArray[np.float64]:
        """(J, 4, 4) what moves a vertex of the bind pose with each joint, to the scene's frame (section 3.7.3.3)."""
        skin = self.gltf.item("skins", skin_index)
        for joint in skin["joints"]:
            self.gltf.item("nodes", joint)
        world = np.array([self.world[joint] for joint in skin["joints"]])
        if "inverseBindMatrices" not in skin:
            return world
        inverse = accessor(self.gltf, skin["inverseBindMatrices"]).astype(np.float64)
        return world @ inverse.reshape(-1, 4, 4)[: len(world)].transpose(0, 2, 1)


def local_transform(node: dict[str, Any]) -> NDArray[np.float64]:
    """A node's matrix, or translation * rotation * scale (section 3.5.3)."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), np.float64)
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, :3] *= np.array(node.get("scale", (1, 1, 1)), np.float64)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def skinned(gltf: Gltf, attributes: dict[str, NDArray], joints: NDArray[np.float64]) -> dict[str, NDArray]:
    """Attributes with POSITION (N, 3) and NORMAL (N, 3) in the pose of the joints (J, 4, 4).

    Linear blend skinning; a vertex without weights follows its first joint.
    """
    sets = sorted(name for name in attributes if name.startswith("JOINTS_"))
    index = np.concatenate([attributes[name] for name in sets], 1).astype(np.int64)
    weight = np.concatenate([attributes[name.replace("JOINTS", "WEIGHTS")] for name in sets], 1).astype(np.float64)
    check_range(index[weight != 0], len(joints), "joint", gltf.path)
    total = weight.sum(1, keepdims=True)
    weight = np.where(total > 0, weight / np.where(total > 0, total, 1), np.arange(weight.shape[1]) == 0)
    blend = np.zeros((len(index), 4, 4))
    for k in range(index.shape[1]):
        blend += weight[:, k, None, None] * joints[np.clip(index[:, k], 0, len(joints) - 1)]
    linear = blend[:, :3, :3]
    posed = dict(attributes)
    posed["POSITION"] = np.einsum("nij,nj->ni", linear, attributes["POSITION"].astype(np.float64)) + blend[:, :3, 3]
    if "NORMAL" in attributes:
        a, b, c = linear[:, :, 0], linear[:, :, 1], linear[:, :, 2]
        cofactor = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], -1)  # the inverse transpose's direction
        turned = np.einsum("nij,nj->ni", cofactor, attributes["NORMAL"].astype(np.float64))
        turned *= np.where((a * np.cross(b, c)).sum(1) < 0, -1.0, 1.0)[:, None]
        length = np.linalg.norm(turned, axis=1, keepdims=True)
        posed["NORMAL"] = turned / np.where(length > 0, length, 1)
    return posed


def morphed(gltf: Gltf, attributes: dict[str, NDArray], targets: list[dict], weights: list[float]) -> dict[str, NDArray]:
    """Attributes with each target's displacements, times its weight, added (section 3.7.2.2)."""
    result = dict(attributes)
    for target, weight in zip(targets, weights, strict=False):
        for name in target if weight else ():
            if name in result and name.split("_")[0] in ("POSITION", "NORMAL", "TEXCOORD"):
                shift = accessor(gltf, target[name]).astype(np.float64)
                if shift.shape != result[name].shape:
                    raise InputError(
                        f"{gltf.path}: a morph target is {shift.shape}, expected {result[name].shape}; export it again"
                    )
                result[name] = result[name] + weight * shift
    return result
