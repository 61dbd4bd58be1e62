"""A small scene: a tree of nodes, meshes that stand in several of them, a floor."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.prep.shapes import GltfBuilder, cube, sphere


def solid(built: GltfBuilder, shape: tuple[NDArray, NDArray], size: tuple[float, float, float]) -> dict[str, object]:
    """A primitive of a shape of that size, its lowest point at height 0."""
    vertices, faces = np.asarray(shape[0], float), np.asarray(shape[1])
    low, high = vertices.min(0), vertices.max(0)
    placed = ((vertices - low) / (high - low) - (0.5, 0, 0.5)) * size
    return {
        "attributes": {"POSITION": built.accessor(placed.astype(np.float32), "VEC3")},
        "indices": built.accessor(faces.reshape(-1).astype(np.uint32), "SCALAR"),
    }


def room(path: Path) -> Path:
    """Ten objects, three of them one mesh: a floor, a table with a vase and a cup, three stools, a lamp in two nodes, a ball,
    below groups that move and turn; one name twice, one that is no file's, one missing."""
    built = GltfBuilder()
    ball = sphere(8, 12)
    shapes: list[tuple[tuple[NDArray, NDArray], tuple[float, float, float]]] = [
        (cube(), (6, 0.05, 6)), (cube(), (1.6, 0.8, 0.9)), (ball, (0.25, 0.5, 0.25)), (ball, (0.1, 0.1, 0.1)),
        (cube(), (0.4, 0.45, 0.4)), (cube(), (0.1, 1.5, 0.1)), (ball, (0.5, 0.4, 0.5)), (ball, (0.4, 0.4, 0.4)),
    ]  # fmt: skip
    built.root["meshes"] = [{"name": f"mesh_{k}", "primitives": [solid(built, *shape)]} for k, shape in enumerate(shapes)]
    half = float(np.sqrt(0.5))
    built.root["nodes"] = [
        {"name": "room", "children": [1, 2, 6, 10, 12]},
        {"name": "floor", "mesh": 0, "translation": [0, -0.05, 0]},
        {"name": "dining", "children": [3, 4, 5], "translation": [0.5, 0, 0.2], "rotation": [0, half, 0, half]},
        {"name": "table", "mesh": 1, "extras": {"price": 120}},
        {"name": "vase/blue", "mesh": 2, "translation": [0, 0.8, 0]},
        {"name": "cup", "mesh": 3, "translation": [0.4, 0.8, 0.1]},
        {"name": "stools", "children": [7, 8, 9], "scale": [1.1, 1, 1.1]},
        {"name": "stool", "mesh": 4, "translation": [1.6, 0, 1.2]},
        {"name": "stool", "mesh": 4, "translation": [-1.4, 0, 1.0]},
        {"name": "stool.001", "mesh": 4, "matrix": [0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, -1.5, 0, -1.2, 1]},
        {"name": "lamp", "mesh": 5, "children": [11], "translation": [2, 0, -2]},
        {"name": "lamp", "mesh": 6, "translation": [0, 1.5, 0]},
        {"mesh": 7, "translation": [-2, 0, 2]},
    ]
    built.root["scenes"] = [{"nodes": [0]}]
    return built.write(path)


OBJECTS = ["floor", "table", "vase_blue", "cup", "stool", "lamp", "lamp_2", "mesh_7"]
"""Names of the jobs that it makes."""
