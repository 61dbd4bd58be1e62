"""The materials of a model: one for each material slot and texture set that meet on a face."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stages.core.artifact import Artifact
from stages.core.texture_sets import texture_sets


@dataclass(frozen=True)
class Worn:
    """A material. name: in the model's files. slot: the source's name. set: number of its texture set."""

    name: str
    slot: str
    set: int


def worn_materials(mesh: Artifact) -> tuple[list[Worn], NDArray[np.int32]]:
    """The materials of a model, in the order of the source's parts, and that of each face of the source, (P,).

    A slot keeps its name; one that shows several sets has a material for each, with the set's tile or suffix behind its name.
    """
    slots = [str(part["material"] or "") for part in mesh.provenance.extra["parts"]]
    names, sets = list(dict.fromkeys(slots)), texture_sets(mesh.provenance)
    slot = np.array([names.index(name) for name in slots], np.int64)[mesh["face_part"]]
    pairs, of_face = np.unique(slot * len(sets) + mesh["face_set"], return_inverse=True)
    found = [Worn(names[pair // len(sets)], names[pair // len(sets)], pair % len(sets)) for pair in pairs.tolist()]
    shown = [worn.slot for worn in found]
    for k, worn in enumerate(found):
        if shown.count(worn.slot) > 1:
            chosen = sets[worn.set]
            ending = chosen.suffix if chosen.tile is None else f".{chosen.tile}"
            found[k] = replace(worn, name=(worn.slot or "material") + ending)
    return _told_apart(found), of_face.reshape(-1).astype(np.int32)


def _told_apart(found: list[Worn]) -> list[Worn]:
    """The same, numbers behind names under which files would know another set's material."""
    taken: dict[str, int] = {}
    result = []
    for worn in found:
        number, name = 2, worn.name
        while taken.setdefault(name or "material", worn.set) != worn.set:
            number, name = number + 1, f"{worn.name or 'material'}_{number}"
        result.append(replace(worn, name=name))
    return result
