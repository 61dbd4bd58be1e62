"""`dreammat edit`: an asset changed afterwards, with every file that depends on what was changed.

The manifest keeps the list of edits. An edited asset keeps the masters that it was made from, as `base_<map>.exr`, and the
mesh, so that it needs neither the asset that it comes from nor any other file: the list is evaluated from these masters each
time, and without its last entry gives back the bytes that were there before.
"""

import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from stages.asset.export import made_beside, move_into
from stages.asset.folder import MESH, asset_manifest
from stages.asset.maps import Maps
from stages.asset.textures import read_masters
from stages.bake.stage import Shown, Subject, subjects, write_asset, write_set
from stages.core.artifact import Provenance, intact, load_npz, run_log
from stages.core.errors import ArtifactError, InputError, OutputError
from stages.core.progress import Progress, silent
from stages.core.schemas import ASSET, PREP
from stages.core.texture_sets import texture_sets
from stages.edit.change import MAPS, changed
from stages.edit.options import EditOptions
from stages.edit.texels import Chosen, chosen_triangles, texels_of

BASE = "base_"
"""Before the name of a master that edits have changed, as it was before the first of them."""


@dataclass(frozen=True)
class EditResult:
    """What was made. edits: all that the asset has now, first to last, in words. clamped: texels brought back into [0, 1]."""

    folder: Path
    up_to_date: bool
    edits: list[str]
    clamped: dict[str, int]
    shared_texels: int


def edits_of(asset: Path) -> list[EditOptions]:
    """The edits of an asset, first to last. Raises: ArtifactError."""
    return [EditOptions.of(entry) for entry in asset_manifest(asset)[0].options.get("edits", [])]


def edit(
    asset: Path, out: Path | None, change: EditOptions, force: bool = False, progress: Progress = silent
) -> EditResult:
    """Write an asset with one more edit.

    Args:
        asset: a folder that `bake` or this wrote. out: the folder to make; None: the asset itself, if it is an edited one.
        force: write even when the folder holds the result of the same request.
    Raises: ArtifactError, InputError, OutputError.
    """
    change.changes()  # refuses one that changes nothing
    return _write(asset, out, [*edits_of(asset), change], force, progress)


def undo(asset: Path, out: Path | None, force: bool = False, progress: Progress = silent) -> EditResult:
    """Write an asset without its last edit. Raises: as `edit`, and InputError where there is none."""
    edits = edits_of(asset)
    if not edits:
        raise InputError(f"{asset}: has no edits to take away; expected an asset that `dreammat edit` wrote")
    return _write(asset, out, edits[:-1], force, progress)


def _write(asset: Path, out: Path | None, edits: list[EditOptions], force: bool, progress: Progress) -> EditResult:
    """Write an asset whose edits are these."""
    made, files = asset_manifest(asset)
    out = _target(asset, made, out)
    wanted = _wanted(made, edits)
    if not force and out.is_dir() and (known := _known(out)) and known.same_request(wanted):
        return _result(out, True, known)
    prep = intact(asset, MESH, files)
    mesh = load_npz(prep, PREP)
    chosen = [chosen_triangles(mesh, edit.part) for edit in edits]
    with run_log(out), made_beside(out) as scratch:
        shown, told, kept = list[Shown](), list[Told](), list[str]()
        for subject in subjects(prep, mesh, texture_sets(made)):
            progress("edit", len(shown), len(texture_sets(made)))
            before = _masters(asset, subject, files)
            after, said = _evaluated(subject, before, edits, chosen)
            kept += _keep_masters((asset, scratch), subject, files, (before, after))
            shown.append(write_set(scratch, subject, after, progress))
            told.append(said)
        extra = wanted.extra | ({"edited": _summed(edits, told)} if edits else {})
        names, _ = write_asset(scratch, (prep, subject), shown, replace(wanted, extra=extra), progress, kept)
        move_into(scratch, out, names, ASSET)
    return _result(out, False, replace(wanted, extra=extra))


def _target(asset: Path, made: Provenance, out: Path | None) -> Path:
    """The folder to write. Raises: InputError, OutputError where it holds an asset as it was baked, which is never touched."""
    if out is None and not made.options.get("edits"):
        raise InputError(f"{asset}: an asset as it was baked, which stays as it is; give the folder to write with -o")
    if out is None:
        return asset
    known = _known(out) if out.is_dir() else None
    if known and not known.options.get("edits"):
        raise OutputError(f"{out}: an asset as it was baked, which stays as it is; give another folder with -o")
    return out


def _known(folder: Path) -> Provenance | None:
    try:
        return asset_manifest(folder)[0]
    except ArtifactError:
        return None


def _wanted(made: Provenance, edits: list[EditOptions]) -> Provenance:
    """How an asset with these edits is made; without any, as `bake` says."""
    options = {key: value for key, value in made.options.items() if key != "edits"}
    extra = {key: value for key, value in made.extra.items() if key != "edited"}
    if edits:
        options["edits"] = [edit.changes() for edit in edits]
    return replace(made, options=options, extra=extra)


def _masters(asset: Path, subject: Subject, files: dict[str, str]) -> Maps:
    """The maps of a texture set as they were before any edit."""
    named = {name: subject.set.file(f"{name}.exr") for name in (*MAPS, "normal", "occlusion", "height")}
    stored = {name: next((n for n in (BASE + file, file) if n in files), None) for name, file in named.items()}
    return read_masters({name: intact(asset, file, files) for name, file in stored.items() if file})


@dataclass(frozen=True)
class Told:
    """Of a texture set: texels on charts that each edit changes, texels brought back into [0, 1] by map, and how many of those
    that are changed show other parts too."""

    changed: list[int]
    clamped: dict[str, int]
    shared: int


def _evaluated(subject: Subject, maps: Maps, edits: list[EditOptions], chosen: list[Chosen]) -> tuple[Maps, Told]:
    """The maps of a set after all edits, as its masters will hold them."""
    found = [texels_of(subject, triangles) for triangles in chosen]
    on_chart = (subject.touched.triangle >= 0).reshape(-1)
    rows, where = maps.material.reshape(-1, 5), [mask.reshape(-1) for mask, _ in found]
    material, clamped = changed(rows, edits, where)
    told = Told(
        [int((mask & on_chart).sum()) for mask in where],
        {name: int((flags & on_chart).sum()) for name, flags in clamped.items()},
        max((shared for _, shared in found), default=0),
    )
    return replace(maps, material=material.reshape(maps.material.shape)).stored(), told


def _summed(edits: list[EditOptions], told: list[Told]) -> dict[str, Any]:
    """What bake.json says of the edits. Raises: InputError where one changes no texel of any set."""
    for number, edit in enumerate(edits):
        if not any(of.changed[number] for of in told):
            raise InputError(f"part {', '.join(edit.part)}: shows no texel of any texture; name another part")
    return {
        "list": [edit.told() for edit in edits],
        "clamped": {name: sum(of.clamped[name] for of in told) for name in MAPS},
        "shared_texels": sum(of.shared for of in told),
    }


def _keep_masters(
    folders: tuple[Path, Path], subject: Subject, files: dict[str, str], maps: tuple[Maps, Maps]
) -> list[str]:
    """Copy the masters that edits change, as they were. Args: folders: from, to. maps: before, after. Returns: their names."""
    names = []
    before, after = (m.material for m in maps)
    for name, columns in MAPS.items():
        if not np.array_equal(before[..., columns], after[..., columns]):
            file = subject.set.file(f"{name}.exr")
            names.append(BASE + file)
            shutil.copyfile(folders[0] / (names[-1] if names[-1] in files else file), folders[1] / names[-1])
    return names


def _result(folder: Path, up_to_date: bool, made: Provenance) -> EditResult:
    told = made.extra.get("edited", {"list": [], "clamped": {}, "shared_texels": 0})
    return EditResult(folder, up_to_date, told["list"], told["clamped"], told["shared_texels"])


