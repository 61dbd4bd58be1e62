"""A GLB taken apart by the letter of the specification, for the tests: nothing is merged, flipped or guessed."""

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

TYPES = {5126: "<f4", 5123: "<u2", 5125: "<u4"}
WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


@dataclass(frozen=True)
class Glb:
    root: dict[str, Any]
    chunk: bytes

    @staticmethod
    def read(path: Path) -> "Glb":
        data = path.read_bytes()
        magic, version, length, size, kind = struct.unpack_from("<4sIII4s", data)
        assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON")
        binary_size, binary_kind = struct.unpack_from("<I4s", data, 20 + size)
        assert binary_kind == b"BIN\0" and 28 + size + binary_size == len(data)
        return Glb(json.loads(data[20 : 20 + size]), data[28 + size :])

    def view(self, index: int) -> bytes:
        view = self.root["bufferViews"][index]
        return self.chunk[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]

    def accessor(self, index: int) -> NDArray:
        entry = self.root["accessors"][index]
        values = np.frombuffer(self.view(entry["bufferView"]), TYPES[entry["componentType"]])
        return values.reshape(entry["count"], WIDTH[entry["type"]])

    def primitives(self) -> list[dict[str, Any]]:
        return [primitive for mesh in self.root["meshes"] for primitive in mesh["primitives"]]

    def attribute(self, primitive: dict[str, Any], name: str) -> NDArray:
        return self.accessor(primitive["attributes"][name])

    def triangles(self, primitive: dict[str, Any]) -> NDArray:
        return self.accessor(primitive["indices"]).reshape(-1, 3)
