"""The parts of a prepared mesh, by name: objects, material slots, and pieces that hang together. One grammar everywhere.

An *object* is a node of a scene, or an `o` or `g` of an OBJ; a *slot* a material of the source; a *piece* what hangs together.
A part is called by its name, by a shell pattern (`wheel_*`), by `slot:NAME` or `object:NAME` where both have one, or by its
number in the list (`#3`), which pieces, being without names, always are. Upper and lower case are the same where no name is
spelled exactly so.

Triangles that belong to the same of each have a *label*, a number, in common: every part is made of whole labels, and what a
view or a texel shows is told by one number.
"""

import fnmatch
import re
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from stages.core.artifact import Artifact
from stages.core.errors import InputError
from stages.core.naming import guess

KINDS = ("object", "slot", "piece")

LISTED = 12
"""Names that an error lists; it says how many more there are."""


class Called(Protocol):
    """What `find` finds."""

    @property
    def number(self) -> int: ...

    @property
    def kind(self) -> str: ...

    @property
    def name(self) -> str: ...

    @property
    def call(self) -> str: ...


Part = TypeVar("Part", bound=Called)


@dataclass(frozen=True)
class LabelledPart:
    """A part of which only its labels are known. number, kind, name, share: as of `NamedPart`."""

    number: int
    kind: str
    name: str
    share: float
    labels: tuple[int, ...]

    @property
    def call(self) -> str:
        """As of `NamedPart`."""
        return self.name or f"#{self.number}"

    def to_json(self) -> dict[str, Any]:
        """As JSON types."""
        return {
            "number": self.number, "kind": self.kind, "name": self.name, "share": self.share, "labels": list(self.labels)
        }  # fmt: skip

    @staticmethod
    def from_json(data: dict[str, Any]) -> "LabelledPart":
        """Of what `to_json` gave. Raises: KeyError, TypeError, ValueError where it is something else."""
        labels = tuple(int(label) for label in data["labels"])
        return LabelledPart(int(data["number"]), str(data["kind"]), str(data["name"]), float(data["share"]), labels)


@dataclass(frozen=True)
class NamedPart:
    """number: in the list, from 1. kind: one of KINDS. name: empty where the source gives none. triangles: rows of the working
    mesh's, ascending. faces: of the source. share: of the area. size, place: extent and centre of its box in the source's frame
    and units, (3,)."""

    number: int
    kind: str
    name: str
    triangles: NDArray[np.int64]
    faces: int
    share: float
    size: NDArray[np.float64]
    place: NDArray[np.float64]

    @property
    def call(self) -> str:
        """What calls it and nothing else of its kind."""
        return self.name or f"#{self.number}"

    def to_json(self) -> dict[str, Any]:
        """As JSON types, without its triangles."""
        return {
            "number": self.number, "kind": self.kind, "name": self.name, "call": self.call, "faces": self.faces,
            "share": round(self.share, 6), "size": _plain(self.size), "place": _plain(self.place),
        }  # fmt: skip


def named_parts(mesh: Artifact) -> list[NamedPart]:
    """All parts of a prep.npz that have a face: objects and slots in the order of the file, then pieces by their area."""
    extra, face = mesh.provenance.extra, _source_faces(mesh)
    part, group = mesh["face_part"][face], mesh["face_group"][face]
    objects = _labels([p["node"] or p["name"] for p in extra["parts"]], part)
    objects += [row for row in _labels(extra["groups"], group) if not any(_alike(row, other) for other in objects)]
    slots = _labels([p["material"] for p in extra["parts"]], part)
    area, box = _areas(mesh), _source_corners(mesh)
    rows = [("object", *row) for row in objects] + [("slot", *row) for row in slots]
    rows += [("piece", "", piece) for piece in pieces(mesh, area)]
    return [_named(number, kind, name, mine, face, area, box) for number, (kind, name, mine) in enumerate(rows, 1)]


def labels(mesh: Artifact) -> NDArray[np.int32]:
    """(F,) label of each triangle, from 0. It follows from the mesh alone: views and bakes of one prep.npz have the same."""
    face = _source_faces(mesh)
    rows = np.stack([mesh["face_part"][face], mesh["face_group"][face], _piece_of(mesh)], 1)
    return np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int32)


def labelled_parts(mesh: Artifact) -> list[LabelledPart]:
    """`named_parts` by their labels."""
    label = labels(mesh)
    return [
        LabelledPart(part.number, part.kind, part.name, part.share, tuple(np.unique(label[part.triangles]).tolist()))
        for part in named_parts(mesh)
    ]


def _source_faces(mesh: Artifact) -> NDArray[np.int64]:
    """(F,) face of the source of each triangle."""
    return np.searchsorted(mesh["loop_start"], mesh["triangle_loops"][:, 0], "right") - 1


def _named(
    number: int, kind: str, name: str, mine: NDArray, face: NDArray, area: NDArray, box: NDArray
) -> NamedPart:
    low, high = box[mine].min((0, 1)), box[mine].max((0, 1))
    share = float(area[mine].sum() / max(area.sum(), np.finfo(float).tiny))
    return NamedPart(number, kind, name, mine, len(np.unique(face[mine])), share, high - low, (low + high) / 2)


def _labels(names: list[str], row: NDArray) -> list[tuple[str, NDArray[np.int64]]]:
    """Each distinct name with the triangles (T,) that have it; those of one name belong together. Args: row: (F,), -1 none."""
    found = []
    for name in dict.fromkeys(names):
        mine = np.flatnonzero(np.isin(row, [k for k, other in enumerate(names) if other == name]))
        if len(mine):
            found.append((str(name), mine))
    return found


def _alike(one: tuple[str, NDArray], other: tuple[str, NDArray]) -> bool:
    """Whether a group says nothing that an object does not: its name, or its very triangles."""
    return one[0] == other[0] or np.array_equal(one[1], other[1])


def pieces(mesh: Artifact, area: NDArray) -> list[NDArray[np.int64]]:
    """Triangles of each piece, the largest first."""
    piece = _piece_of(mesh)
    order = np.argsort(piece, kind="stable")
    groups = np.split(order, np.cumsum(np.bincount(piece))[:-1])
    return [groups[k] for k in np.argsort(-np.bincount(piece, area), kind="stable")]


def _piece_of(mesh: Artifact) -> NDArray[np.int64]:
    """(F,) number of the piece of each triangle."""
    a, b, c = mesh["triangles"].T
    ends = np.concatenate([a, b]), np.concatenate([b, c])
    graph = coo_matrix((np.ones(2 * len(a), bool), ends), (len(mesh["vertices"]),) * 2)
    return np.unique(connected_components(graph, directed=False)[1][a], return_inverse=True)[1]


def _areas(mesh: Artifact) -> NDArray[np.float64]:
    corners = mesh["vertices"][mesh["triangles"]].astype(np.float64)
    return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2


def _source_corners(mesh: Artifact) -> NDArray[np.float64]:
    """Corners of the triangles in the source's frame, (F, 3, 3)."""
    back = np.linalg.inv(mesh["to_world"])
    return mesh["vertices"][mesh["triangles"]].astype(np.float64) @ back[:3, :3].T + back[:3, 3]


def find(parts: list[Part], pattern: str) -> list[Part]:
    """The parts that a name, pattern or number calls.

    Raises: InputError that lists what there is.
    """
    kind, _, rest = pattern.partition(":")
    of_kind = [part for part in parts if part.kind == kind] if rest and kind in KINDS else parts
    wanted = rest if rest and kind in KINDS else pattern
    if re.fullmatch(r"#\d+", wanted):
        found = [part for part in of_kind if part.number == int(wanted[1:])]
    else:
        named = [part for part in of_kind if part.name]
        found = [part for part in named if part.name == wanted]
        found = found or [part for part in named if fnmatch.fnmatchcase(part.name, wanted)]
        found = found or [part for part in named if fnmatch.fnmatchcase(part.name.lower(), wanted.lower())]
    if not found:
        meant = guess(wanted, [part.name for part in of_kind if part.name])
        raise InputError(f"part '{pattern}': there is none of this name; {meant}expected {listed(parts)}")
    return found


def listed(parts: list[Part]) -> str:
    """What parts can be called, in a line."""
    calls = list(dict.fromkeys(part.call for part in parts))
    more = f" and {len(calls) - LISTED} more (dreammat parts lists them)" if len(calls) > LISTED else ""
    return ", ".join(calls[:LISTED]) + more


def _plain(values: NDArray) -> list[float]:
    return [float(f"{value:.4g}") for value in values]
