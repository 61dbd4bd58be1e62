"""A folder of scanned materials: which sets it holds, what they are called, and looks made of them.

A set is a folder of maps (ambientCG: `Bark014_1K-PNG_Color.png`) or files that share the beginning of their names (Poly Haven:
`rust_coarse_01_diff_1k.jpg`). A set that is used becomes one more look, named by the set and by the hash of its files, so
that a recipe that was read with it is never shown with another. """

import hashlib
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from stages.core.artifact import sha256_file
from stages.core.errors import InputError
from stages.material.scan import Scan
from stages.material.substances import LOOKS, METRES

ROLES = {
    "color": ("color", "col", "diff", "diffuse", "basecolor", "albedo", "base"), "roughness": ("roughness", "rough", "rgh"),
    "normal": ("normalgl", "gl", "normal", "nor", "nrm"), "normal_dx": ("normaldx", "dx"),
    "height": ("displacement", "disp", "height", "bump"), "metallic": ("metalness", "metallic", "metal", "met"),
    "packed": ("arm", "orm"), "occlusion": ("ambientocclusion", "ao", "occlusion"),
}  # fmt: skip
"""What a map is → the last words of its name."""

ROLE_OF = {word: role for role, words in ROLES.items() for word in words}
PICTURES = (".png", ".jpg", ".jpeg", ".exr", ".tif", ".tiff", ".tga", ".webp")
SILENT = re.compile(r"\d+k?|[ab]|png|jpg|jpeg|exr|tif|tiff|tga|texture|textures|pbr|seamless|hd|maps?|map|lit|final")
"""Words of a file's name that say nothing of the material."""

RESOLUTION = re.compile(r"\d+k|png|jpg|exr", re.IGNORECASE)
"""Words of a file's name that are none of its set's."""

TILE = 1.0
"""Edge of a scanned tile, metres, where nobody says."""

SHOWN = 2.0
"""Metres of a thing of unknown size that is made of a scan."""

LEAST_MATCH = 0.5
"""Share of a set's words that a prompt must name."""


@dataclass(frozen=True)
class ScannedSet:
    """name: of the set. maps: what each file is. licence: a file that says under what terms, if there is one."""

    name: str
    maps: dict[str, Path]
    licence: Path | None

    @cached_property
    def words(self) -> frozenset[str]:
        """What its name says of the material, singular."""
        return frozenset(w.removesuffix("s") for w in _words(self.name) if not SILENT.fullmatch(w))

    @cached_property
    def hashes(self) -> dict[str, str]:
        """SHA-256 of each of its files by name."""
        files = [*self.maps.values(), *([self.licence] if self.licence else [])]
        return {path.name: sha256_file(path) for path in files}

    @property
    def look(self) -> str:
        """The name of its look: the set's, and eight digits of a hash of all its maps."""
        maps = "".join(f"{role} {self.hashes[path.name]} " for role, path in sorted(self.maps.items()))
        return f"{self.name} {hashlib.sha256(maps.encode()).hexdigest()[:8]}"

    def described(self) -> dict[str, Any]:
        """What a manifest says of it."""
        return {"files": self.hashes, "licence": self.licence.name if self.licence else None}


class Library:
    """The sets of a folder by name. Raises: InputError where it is none or holds none."""

    def __init__(self, folder: Path) -> None:
        if not folder.is_dir():
            raise InputError(f"{folder}: not a folder; expected one of scanned maps, as Poly Haven and ambientCG give them")
        self.folder, self.sets = folder, _found(folder)
        if not self.sets:
            raise InputError(f"{folder}: no set of maps in it; expected names like rust_01_diff_1k.jpg, Bark014_1K_Color.png")

    def match(self, words: set[str], head: set[str]) -> ScannedSet | None:
        """The set whose name says most of what words say, if one names the stuff itself.

        Args:
            words: all that is said of a coat. head: those of them that name its substance.
        """
        best: tuple[float, ScannedSet] | None = None
        for name in sorted(self.sets):
            found = self.sets[name]
            share = len(found.words & words) / max(len(found.words), 1)
            if found.words & head and share >= LEAST_MATCH and (best is None or share > best[0]):
                best = share, found
        return best[1] if best else None

    def use(self, found: ScannedSet) -> str:
        """Make a set's look one of all looks. Returns: its name. Raises: InputError."""
        if found.look not in LOOKS:
            LOOKS[found.look] = Scan.read(found.maps, TILE)
            METRES[found.look] = SHOWN
        return found.look

    def used(self, looks: set[str]) -> dict[str, Any]:
        """What a manifest says of the sets among some looks."""
        names = {look.rsplit(" ", 1)[0] for look in looks} & set(self.sets)
        return {name: self.sets[name].described() for name in sorted(names) if self.sets[name].look in looks}

    def restore(self, looks: set[str]) -> list[str]:
        """Make looks that are not there those of the sets that they name. Returns: those that no set of the folder has."""
        missing = []
        for look in sorted(looks - set(LOOKS)):
            found = self.sets.get(look.rsplit(" ", 1)[0])
            if found is None or self.use(found) != look:
                missing.append(look)
        return missing


def hashes(used: dict[str, Any]) -> dict[str, str]:
    """What `Library.used` tells as the inputs of an artefact: each file's SHA-256."""
    return {f"library {name} {file}": sha for name, about in used.items() for file, sha in about["files"].items()}


def _found(folder: Path) -> dict[str, ScannedSet]:
    """The sets in a folder and below: files of one folder whose names differ in what they are alone."""
    groups: dict[tuple[Path, str], dict[str, Path]] = {}
    for path in sorted(folder.rglob("*")):
        if path.suffix.lower() not in PICTURES or not path.is_file():
            continue
        name, role = _role(path)
        if role:
            groups.setdefault((path.parent, name or path.parent.name), {}).setdefault(role, path)
    sets: dict[str, ScannedSet] = {}
    for (parent, name), maps in groups.items():
        if "color" in maps and name not in sets:
            sets[name] = ScannedSet(name, maps, _licence(parent, folder))
    return sets


def _role(path: Path) -> tuple[str, str]:
    """A file's set and what it is, or "" where it is none: "rust_01_nor_gl_1k" is ("rust_01", "normal")."""
    parts = [part for part in re.split(r"[_\-. ]+", path.stem) if part]
    words = [part.lower() for part in parts]
    for k in range(len(words) - 1, max(-1, len(words) - 5), -1):
        if words[k] in ROLE_OF:
            role = ROLE_OF[words[k]]
            start = k - 1 if words[k] in ("gl", "dx") and k and words[k - 1] in ("nor", "normal", "nrm") else k
            return "_".join(part for part in parts[:start] if not RESOLUTION.fullmatch(part)), role
    return "", ""


def _words(name: str) -> list[str]:
    """The words of a set's name: "WoodFloor051" is wood and floor."""
    return re.findall(r"[a-z]+|\d+", re.sub(r"([a-z])([A-Z])", r"\1 \2", name).lower())


def _licence(folder: Path, top: Path) -> Path | None:
    """The nearest file that says under what terms a folder's files may be used."""
    for place in (folder, *folder.parents):
        for path in sorted(place.iterdir()):
            if re.match(r"(licen[cs]e|copying|sources)", path.name, re.IGNORECASE) and path.is_file():
                return path
        if place == top:
            break
    return None
