"""`prep --split`: a scene as one job for each of its objects, in place, the others kept as shadow casters.

Nodes that share a mesh are one object, made where the first of them stands. Every job knows the scene's nodes, so that
`dreammat assemble` needs nothing but assets.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from stages.core.artifact import Provenance, peek, plain_options, run_log, save_npz, write_manifest, write_text
from stages.core.errors import InputError
from stages.core.progress import Progress, silent
from stages.core.schemas import PREP, SCENE
from stages.light.scene import Scene
from stages.prep.casters import Placed, casters, placed
from stages.prep.instances import with_instances
from stages.prep.objects import Object, objects, only, told_scene, tree_of
from stages.prep.options import PrepOptions
from stages.prep.prompts import prompts_of, read_prompts
from stages.prep.source import Source
from stages.prep.stage import READERS, inputs_of, prepared

PROMPT = "prompt.txt"


@dataclass(frozen=True)
class SplitResult:
    """objects: names of the jobs. unusable: name -> why there is no job. unprompted: those that no prompt names; None where
    there are no prompts."""

    up_to_date: bool
    objects: list[str]
    unusable: dict[str, str]
    unprompted: list[str] | None


def split(
    mesh: Path, folder: Path, options: PrepOptions, prompts: Path | None = None, force: bool = False,
    progress: Progress = silent,
) -> SplitResult:  # fmt: skip
    """Write <folder>/<object>/prep.npz for each object of a scene, and scene.json.

    Args:
        prompts: a prompts.toml, whose prompts are written beside as <object>/prompt.txt; names are checked first.
    Raises: InputError, OutputError.
    """
    wanted = read_prompts(prompts) if prompts else None
    request = Provenance(plain_options(options), None, inputs_of(mesh))
    known = None if force else peek(folder, SCENE)
    if known is not None and known.same_request(request):
        return _with_prompts(folder, known, wanted, prompts, True)
    progress("read", 0, 1)
    source = with_instances(READERS[mesh.suffix.lower()](mesh))
    found = objects(source, options.own_instances)
    told = [{"name": one.name, "title": one.title} for one in found]
    if wanted is not None and prompts is not None:
        prompts_of(told, wanted, prompts)
    with run_log(folder):
        unusable = _jobs(source, found, (mesh, folder), options, request, progress)
        made = replace(request, extra={"objects": told, "unusable": unusable})
        write_manifest(folder, SCENE, made, [f"{one.name}/prep.npz" for one in found if one.name not in unusable])
    return _with_prompts(folder, made, wanted, prompts, False)


def _jobs(
    source: Source, found: list[Object], paths: tuple[Path, Path], options: PrepOptions, request: Provenance, progress: Progress
) -> dict[str, str]:
    """Write the jobs. Args: paths: of the scene, of the folder. Returns: why some objects have none, by name."""
    mesh, folder = paths
    folder.mkdir(parents=True, exist_ok=True)
    (folder / SCENE.manifest).unlink(missing_ok=True)
    tree, unusable = tree_of(source), dict[str, str]()
    of_place: dict[tuple[int, int], list[int]] = {}
    for number, place in enumerate(tree.places):
        of_place.setdefault(place, []).append(number)
    surfaces = dict(zip(of_place, placed(source, list(of_place.values())), strict=True))
    scene = told_scene(tree, found) | {"name": mesh.name, "source": request.inputs["mesh"]}
    for row, one in enumerate(found):
        progress("objects", row, len(found))
        try:
            arrays, extra = prepared(only(source, one.parts), mesh, options)
        except InputError as error:
            unusable[one.name] = str(error)
            continue
        others = [surface for place, surface in surfaces.items() if place != tree.places[one.parts[0]]]
        extra |= {"source_name": f"{one.name}{mesh.suffix}", "scene": scene | {"object": row}}
        extra["findings"] |= _surround(arrays, others)
        provenance = replace(request, options=request.options | {"object": one.name}, extra=extra)
        save_npz(folder / one.name / "prep.npz", PREP, arrays, provenance)
    if len(unusable) == len(found):
        raise InputError(next(iter(unusable.values())))
    return unusable


def _surround(arrays: dict[str, Any], others: list[Placed]) -> dict[str, int]:
    """Put casters into the arrays of a prep.npz. Returns: what is said of it."""
    scene = Scene(arrays["vertices"], arrays["triangles"], arrays["normals"])
    usable = [of for of in others if len(of.triangles)]
    vertices, triangles, left_out = casters(usable, arrays["to_world"], scene)
    arrays |= {"caster_vertices": vertices, "caster_triangles": triangles}
    return {"caster_triangles": len(triangles), "objects_around_it_that_cast_no_shadow": left_out}


def _with_prompts(
    folder: Path, made: Provenance, wanted: dict[str, str] | None, prompts: Path | None, up_to_date: bool
) -> SplitResult:
    """Write prompt.txt where an object has a prompt, and take it away where it has none."""
    told, unusable = made.extra["objects"], made.extra["unusable"]
    names = [one["name"] for one in told if one["name"] not in unusable]
    if wanted is None or prompts is None:
        return SplitResult(up_to_date, names, unusable, None)
    found = prompts_of(told, wanted, prompts)
    for name in names:
        if name in found:
            write_text(folder / name / PROMPT, found[name])
        else:
            (folder / name / PROMPT).unlink(missing_ok=True)
    return SplitResult(up_to_date, names, unusable, [name for name in names if name not in found])


