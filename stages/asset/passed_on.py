"""What a glTF source's materials had that is not made anew: normal map, occlusion, emission, in the file's own bytes.

`prep.npz` carries it where the source's UVs were kept. It is glTF's own JSON: `materials` by name, whose textures are
rows of `textures` ({"image": row, "sampler": {…} or absent}), and `images` ({"name", "mimeType", "length"}), whose bytes
lie one after the other in the array `source_images`.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stages.core.artifact import Artifact

TEXTURES = ("normalTexture", "occlusionTexture", "emissiveTexture")


@dataclass(frozen=True)
class PassedOn:
    """materials: name -> glTF properties. textures: as above. images: (name, MIME type, bytes)."""

    materials: dict[str, dict[str, Any]] = field(default_factory=dict)
    textures: list[dict[str, Any]] = field(default_factory=list)
    images: list[tuple[str, str, bytes]] = field(default_factory=list)

    @staticmethod
    def of(prep: Artifact) -> "PassedOn":
        """From prep.npz; empty where new UVs were made."""
        held = prep.provenance.extra["passed_on"]
        ends = np.cumsum([0, *(image["length"] for image in held["images"])])
        data = prep["source_images"]
        images = [
            (image["name"], image["mimeType"], data[start:stop].tobytes())
            for image, start, stop in zip(held["images"], ends[:-1], ends[1:], strict=True)
        ]
        return PassedOn(held["materials"], held["textures"], images)

    def normal_maps(self) -> dict[str, dict[str, Any]]:
        """glTF's normalTexture by material name, of the materials that have one."""
        return {name: of["normalTexture"] for name, of in self.materials.items() if "normalTexture" in of}

    def without(self, kind: str) -> "PassedOn":
        """The same without one of `TEXTURES`, which is made anew, and without the images that only it showed."""
        kept = {name: {k: v for k, v in of.items() if k != kind} for name, of in self.materials.items()}
        shown = sorted({of[k]["index"] for of in kept.values() for k in TEXTURES if k in of})
        files = sorted({self.textures[row]["image"] for row in shown})
        for of in kept.values():
            of.update({k: of[k] | {"index": shown.index(of[k]["index"])} for k in TEXTURES if k in of})
        textures = [self.textures[row] | {"image": files.index(self.textures[row]["image"])} for row in shown]
        return PassedOn(kept, textures, [self.images[row] for row in files])
