"""The `prep` stage: from a mesh file to `prep.npz`."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.core.artifact import Provenance, peek, plain_options, run_log, save_npz, sha256_file
from stages.core.errors import InputError
from stages.core.progress import Progress, silent
from stages.core.schemas import PREP
from stages.core.tiles import flat
from stages.prep.gltf_file import companions
from stages.prep.instances import firsts, like_the_first, told, with_instances
from stages.prep.layout import Kept, keep, set_charts, sharing, sound, unusable, with_neighbours
from stages.prep.measure import topology
from stages.prep.mend import mended
from stages.prep.normals import authored, face_normals, shading_normals
from stages.prep.options import PrepOptions
from stages.prep.orient import outward
from stages.prep.read_fbx import read_fbx
from stages.prep.read_gltf import read_gltf
from stages.prep.read_obj import read_obj
from stages.prep.read_off import read_off
from stages.prep.read_ply import read_ply
from stages.prep.read_stl import read_stl
from stages.prep.read_usd import layers, read_usd
from stages.prep.repair import Working, repair
from stages.prep.sets import NO_NUMBERS, Divided, by_slots, divided
from stages.prep.source import Source, nothing_passed_on, rows_of
from stages.prep.topology import components, edges
from stages.prep.unwrap import unwrap
from stages.prep.uv import loop_uvs, signed_area, stretch

READERS: dict[str, Callable[[Path], Source]] = {
    ".obj": read_obj, ".ply": read_ply, ".stl": read_stl, ".off": read_off, ".glb": read_gltf, ".gltf": read_gltf,
    ".fbx": read_fbx, ".usd": read_usd, ".usda": read_usd, ".usdc": read_usd, ".usdz": read_usd,
}  # fmt: skip

# files that a mesh is spread over
BESIDE: dict[str, Callable[[Path], dict[str, Path]]] = {
    ".gltf": companions, ".usd": layers, ".usda": layers, ".usdc": layers,
}  # fmt: skip


@dataclass(frozen=True)
class PrepResult:
    """up_to_date: whether nothing had to be done. findings: what was found and mended."""

    up_to_date: bool
    findings: dict[str, Any]


def prep(mesh: Path, out: Path, options: PrepOptions, force: bool = False, progress: Progress = silent) -> PrepResult:
    """Make a mesh ready: read, mend, orient, give it normals and UVs, and write it beside its untouched source.

    Raises: InputError, OutputError.
    """
    request = Provenance(plain_options(options), None, inputs_of(mesh))
    made = None if force else peek(out, PREP)
    if made is not None and made.same_request(request):
        return PrepResult(True, made.extra["findings"])
    with run_log(out) as log:
        progress("read", 0, 4)
        arrays, extra = prepared(READERS[mesh.suffix.lower()](mesh), mesh, options, progress)
        save_npz(out, PREP, arrays, Provenance(request.options, None, request.inputs, extra))
        progress("write", 4, 4)
        log["triangles"] = len(arrays["triangles"])
    return PrepResult(False, extra["findings"])


def prepared(
    source: Source, mesh: Path, options: PrepOptions, progress: Progress = silent
) -> tuple[dict[str, NDArray], dict[str, Any]]:
    """Arrays of prep.npz, and what its header says. Args: mesh: the file, for its name. Raises: InputError."""
    source = source if options.own_instances else with_instances(source)
    progress("mend", 1, 4)
    working = repair(source, options.up, options.weld_tolerance, mesh)
    normals, findings = oriented(source, working, options.crease_angle)
    progress("unwrap", 2, 4)
    source, sets, layout = _with_bakeable_uv(source, working, options, mesh)
    loop_uv, way = _texture(source, working, sets, options, layout["unusable_uv"], mesh)
    kept, uv = layout["unusable_uv"] is None, loop_uv[working.loops]
    found = _charts(source, working, sets, uv, layout["unusable_uv"])
    chart, way["uv"], way["texture_sets"] = found.chart, "; ".join(found.told), sets.told
    measured = topology(working.vertices, working.triangles)
    findings = _findings(source, working, findings, layout | way) | measured | {
        "charts": int(chart.max()) + 1,
        "texel_density": _texel_density(working, uv, options.texture_size),
        "texture_filled": round(float(np.abs(signed_area(uv)).sum()) / len(sets.sets), 3),
        "stretch": round(stretch(working.vertices[working.triangles], uv), 3),
    }
    progress("write", 3, 4)
    extra = {
        "source_format": source.format,
        "source_name": mesh.name,
        "uv_kept": kept,
        "shared_texels": found.shared,
        "parts": [asdict(part) for part in source.parts],
        "sets": [one.to_json() for one in sets.sets],
        "groups": source.groups,
        "passed_on": source.passed_on if kept else nothing_passed_on(),
        "findings": findings,
    }
    arrays = _arrays(source, working, normals, uv, chart, loop_uv) | _extras(source, kept)
    arrays["face_set"] = sets.of_face
    return arrays, extra


def inputs_of(mesh: Path) -> dict[str, str]:
    """SHA-256 of the mesh and of the files that it is spread over."""
    suffix = mesh.suffix.lower()
    if suffix not in READERS:
        raise InputError(f"{mesh}: format '{suffix}' is not read; expected one of {', '.join(READERS)}")
    if mesh.is_dir():
        raise InputError(f"{mesh}: is a folder; expected a mesh file")
    inputs = {"mesh": sha256_file(mesh)}
    if mesh.stat().st_size == 0:
        raise InputError(f"{mesh}: is empty; export the mesh again")
    if suffix in BESIDE:
        inputs |= {f"mesh:{name}": sha256_file(path) for name, path in BESIDE[suffix](mesh).items()}
    return inputs


def oriented(source: Source, working: Working, crease_angle: float) -> tuple[NDArray, dict[str, Any]]:
    """Turn faces outward, in place. Returns: shading normals (F, 3, 3), and what was found."""
    winding = outward(working.vertices, working.triangles)
    turn = winding.flip[:, None]
    working.triangles = np.where(turn, working.triangles[:, [0, 2, 1]], working.triangles)
    working.loops = np.where(turn, working.loops[:, [0, 2, 1]], working.loops)
    given = authored(source, working.loops, working.to_world)
    normals, kept = shading_normals(given, working.vertices, working.triangles, winding.patch, crease_angle)
    return normals, {
        "inverted_winding": int(winding.flip.sum()),
        "non_orientable_edges": winding.non_orientable,
        "corners": int(working.loops.size),
        "authored_normals": kept,
    }


def _with_bakeable_uv(
    source: Source, working: Working, options: PrepOptions, path: Path
) -> tuple[Source, Divided, dict[str, Any]]:
    """The source with the first of its UV sets that can be baked, its texture sets, and which UVs they are; or the source as it
    is, and what is wrong with its UVs.

    Raises: InputError where a UV set must be kept and none can be.
    """
    _, area = face_normals(working.vertices, working.triangles)
    polygon, own, problems = polygons_of(source, working), firsts(source, working.loops), list[str]()
    refused = refused_uvs(source, options)
    for number, candidate in enumerate([] if refused else source.by_uv_set()):
        uv = sound(loop_uvs(candidate)[working.loops])
        sets = divided(candidate, working.triangles, uv, area, polygon, options.textures)
        of_triangle = None if sets is None else sets.of_face[polygon]
        problem = NO_NUMBERS if of_triangle is None else unusable(working.triangles[own], uv[own], area[own], of_triangle[own])
        if sets is not None and problem is None:
            return candidate, sets, {"unusable_uv": None, "uv_set": number}
        problems.append(str(problem))
    problem = refused or problems[0]
    if options.uv in ("keep", "mend"):
        raise InputError(f"{path}: its UVs cannot be kept: {problem}; mend them or let new ones be made")
    if options.textures == "udim":
        raise InputError(f"{path}: has no UDIM tiles: {problem}; lay it out in tiles 1001 and on, or choose other textures")
    return source, by_slots(source, area, polygon, options.textures), {"unusable_uv": problem, "uv_set": None}


def refused_uvs(source: Source, options: PrepOptions) -> str | None:
    """Why a source's UVs are not wanted, or None."""
    if options.uv == "new":
        return "new ones asked for"
    if options.own_instances and any(part.instance_of >= 0 for part in with_instances(source).parts):
        return "instances are to have texels of their own"
    return None


def polygons_of(source: Source, working: Working) -> NDArray[np.int64]:
    """The source face of each triangle, (F,)."""
    return np.searchsorted(source.loop_start, working.loops[:, 0], "right") - 1


def _texture(
    source: Source, working: Working, sets: Divided, options: PrepOptions, problem: str | None, path: Path
) -> tuple[NDArray[np.float32], dict[str, Any]]:
    """UVs of all source loops (L, 2), the source's where nothing is wrong with them, and how they came about; each texture set
    by itself.

    Raises: InputError where some are to be mended and there is no room.
    """
    polygon = polygons_of(source, working)
    mine = rows_of(sets.of_face[polygon], len(sets.sets))
    if problem is None:
        uv = loop_uvs(source)
        uv[working.loops] = sound(uv[working.loops])
        for rows, home in zip(mine, sets.homes(), strict=True):
            loops, triangles = working.loops[rows], working.triangles[rows]
            if options.uv == "mend":
                uv[loops] = _mended(uv[loops], working.vertices, triangles, polygon[rows], path, home)
            uv[loops] = with_neighbours(uv[loops], triangles, polygon[rows])
        return _everywhere(like_the_first(source, uv), working), {"unwrap": "kept", "gutter": None}
    made, ways = np.full((len(source.loop_vertex), 2), np.nan, np.float32), list[tuple[str, int]]()
    own = firsts(source, working.loops)
    for rows in filter(len, (rows[own[rows]] for rows in mine)):
        seconds = options.unwrap_seconds if len(rows) <= options.unwrap_triangles else 0.0
        layout = unwrap(
            working.vertices, working.triangles[rows], polygon[rows], options.texture_size, options.padding, seconds
        )  # fmt: skip
        made[working.loops[rows]] = np.clip(layout.uv, 0, 1)
        ways.append((layout.method, layout.packing.gutter))
    method = "; ".join(dict.fromkeys(method for method, _ in ways))
    made = _everywhere(like_the_first(source, made), working)
    return made, {"unwrap": method, "gutter": min(gutter for _, gutter in ways)}


def _mended(
    uv: NDArray, vertices: NDArray, triangles: NDArray, polygon: NDArray, path: Path, home: NDArray
) -> NDArray[np.float32]:
    """UVs (F, 3, 2) in which all faces have texels, new ones in the tile (2,) that is their home. Raises: InputError."""
    made = mended(vertices, triangles, polygon, uv)
    if made is None:
        remedy = "--uv keep lets them show a neighbour's texel, --uv new makes new ones"
        raise InputError(f"{path}: its UVs leave no room for the faces that have none; {remedy}")
    new = ~np.asarray((made == uv).all((1, 2)))
    return made + np.float32(home) * new[:, None, None]


def _charts(source: Source, working: Working, sets: Divided, uv: NDArray, problem: str | None) -> Kept:
    """Charts of UVs (F, 3, 2), and what was found and done."""
    area, of_triangle = face_normals(working.vertices, working.triangles)[1], sets.of_face[polygons_of(source, working)]
    if problem is not None:
        said = [f"made new: {problem}", *told(source)]
        if len(said) > 1:
            return Kept(sharing(working.triangles, uv, area, of_triangle), True, said)
        return Kept(set_charts(working.triangles, uv, of_triangle), False, said)
    given = sound(loop_uvs(source)[working.loops])
    missing = ~np.asarray(np.isfinite(given).all((1, 2)))
    new = ~flat(uv) & (missing | (given != uv).any((1, 2)))
    found = keep(working.triangles, uv, area, of_triangle, missing, new, sets.homes()[of_triangle])
    return replace(found, told=[*found.told, *told(source)])


def _everywhere(uv: NDArray, working: Working) -> NDArray[np.float32]:
    """(L, 2) UVs where loops without finite ones (of faces left out) take their stand-in's; 0 where there is none."""
    replaced = ~np.isfinite(uv).all(1) & (working.stand_in >= 0)
    result = np.where(replaced[:, None], uv[np.maximum(working.stand_in, 0)], uv)
    return np.nan_to_num(result, nan=0.0, posinf=0.0, neginf=0.0)


def _findings(source: Source, working: Working, more: dict[str, Any], layout: dict[str, Any]) -> dict[str, Any]:
    """What was found in the source and what was done about it, flat."""
    faces = edges(working.triangles).faces
    joints = np.concatenate([working.triangles[:, :2], working.triangles[:, 1:]])
    parts = int(components(len(working.vertices), joints).max()) + 1
    return {
        "vertices": len(source.vertices),
        "faces": len(source.face_part),
        "welded_vertices": len(working.vertices),
        "triangles": len(working.triangles),
        "parts": parts,
        "watertight": bool((faces == 2).all()),
        "boundary_edges": int((faces == 1).sum()),
        "non_manifold_edges": int((faces > 2).sum()),
        **working.findings,
        **more,
        **layout,
        "skipped": source.skipped,
        "applied": source.applied,
    }


def _texel_density(working: Working, uv: NDArray, texture_size: int) -> float:
    """Texels per unit of length in the world frame, from the areas of all faces together."""
    _, area = face_normals(working.vertices, working.triangles)
    return round(texture_size * float(np.sqrt(np.abs(signed_area(uv)).sum() / area.sum())), 3)


def _extras(source: Source, kept: bool) -> dict[str, NDArray]:
    """Arrays that only some formats fill. Args: kept: whether the UVs were."""
    none = np.full(len(source.loop_vertex), -1, np.int32)
    return {
        "face_group": none[: len(source.face_part)] if source.face_group is None else source.face_group,
        "caster_vertices": np.zeros((0, 3), np.float32),
        "caster_triangles": np.zeros((0, 3), np.int32),
        "source_tangents": source.tangents,
        "loop_source_tangent": none if source.loop_tangent is None else source.loop_tangent,
        "source_images": np.frombuffer(b"".join(source.images if kept else []), np.uint8),
    }


def _arrays(
    source: Source, working: Working, normals: NDArray, uv: NDArray, chart: NDArray, loop_uv: NDArray
) -> dict[str, NDArray]:
    return {
        "vertices": working.vertices.astype(np.float32),
        "triangles": working.triangles,
        "normals": normals,
        "uv": uv,
        "charts": chart,
        "triangle_loops": working.loops,
        "to_world": working.to_world,
        "source_vertices": source.vertices,
        "source_uv": source.uv,
        "source_normals": source.normals,
        "loop_start": source.loop_start,
        "loop_vertex": source.loop_vertex,
        "loop_source_uv": source.loop_uv,
        "loop_source_normal": source.loop_normal,
        "face_part": source.face_part,
        "loop_uv": loop_uv,
    }
