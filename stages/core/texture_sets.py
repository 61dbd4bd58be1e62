"""Texture sets: the groups of maps that an asset has, which faces show which, and the files of each.

Most meshes have one set, whose files have plain names (`albedo.png`). A material slot whose layout is its own has a set of
its own (`albedo_visor.png`), and so has each UDIM tile, by Mari's number (`albedo.1001.png`, `albedo_visor.1002.png`).
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.core.artifact import Artifact, Provenance

MAPS = ("albedo", "roughness", "metallic", "occlusion", "normal", "height", "orm")
"""Maps that a set may have."""


@dataclass(frozen=True)
class TextureSet:
    """suffix: behind the names of its maps, "" where there is one set. tile: UDIM number, or None. slots: names of the material
    slots whose faces show it. share: of the surface, 0 to 1. size: texels along an edge, 0 before it is baked."""

    suffix: str = ""
    tile: int | None = None
    slots: tuple[str, ...] = ()
    share: float = 1.0
    size: int = 0

    @property
    def name(self) -> str:
        """For people, "" where there is one set."""
        return self.suffix[1:]

    def file(self, plain: str) -> str:
        """What a file is called in this set. Args: plain: where there is one set, such as "albedo.exr"."""
        stem, _, ending = plain.partition(".")
        return f"{stem}{self.suffix}.{ending}"

    def to_json(self) -> dict[str, Any]:
        """As prep.npz and bake.json have it."""
        return {
            "suffix": self.suffix, "tile": self.tile, "slots": list(self.slots), "share": self.share, "size": self.size,
        }  # fmt: skip

    @staticmethod
    def from_json(said: Mapping[str, Any]) -> "TextureSet":
        """What `to_json` gave."""
        return TextureSet(said["suffix"], said["tile"], tuple(said["slots"]), said["share"], said["size"])


ONE_SET = TextureSet()
"""Of a mesh that has one."""


def texture_sets(made: Provenance) -> list[TextureSet]:
    """The sets of a prep.npz or of an asset, in the order of their numbers."""
    return [TextureSet.from_json(said) for said in made.extra["sets"]]


def map_files(chosen: TextureSet, files: Collection[str]) -> dict[str, str]:
    """The files of a set's maps by their plain names ("albedo.exr"). Args: files: names of all that the asset has."""
    plain = [f"{name}.{ending}" for name in MAPS for ending in ("exr", "png")]
    return {name: chosen.file(name) for name in plain if chosen.file(name) in files}


def triangle_sets(mesh: Artifact) -> NDArray[np.int32]:
    """The set of each triangle of a prep.npz's working mesh, (F,)."""
    face = np.searchsorted(mesh["loop_start"], mesh["triangle_loops"][:, 0], "right") - 1
    return mesh["face_set"][face]
