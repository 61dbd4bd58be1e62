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
from stages.core.texture_sets import TextureSet
from stages.core.tiles import flat
from stages.prep.gltf_file import companions
from stages.prep.instances import firsts, like_the_first, told, with_instances
from stages.prep.layout import Kept, keep, sharing, sound, unusable, with_neighbours
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
from stages.prep.source import Source, nothing_passed_on
from stages.prep.topology import components, edges
from stages.prep.unwrap import unwrap
from stages.prep.uv import loop_uvs, signed_area, stretch, uv_charts

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
    request = Provenance(plain_options(options), None, _inputs(mesh))
    made = None if force else peek(out, PREP)
    if made is not None and made.same_request(request):
        return PrepResult(True, made.extra["findings"])
    with run_log(out):
        progress("read", 0, 4)
        source = READERS[mesh.suffix.lower()](mesh)
        source = source if options.own_instances else with_instances(source)
        progress("mend", 1, 4)
        working = repair(source, options.up, options.weld_tolerance, mesh)
        normals, findings = oriented(source, working, options.crease_angle)
        progress("unwrap", 2, 4)
        source, layout = _with_bakeable_uv(source, working, options, mesh)
        loop_uv, way = _texture(source, working, options, layout["unusable_uv"], mesh)
        kept, uv = layout["unusable_uv"] is None, loop_uv[working.loops]
        found = _charts(source, working, uv, layout["unusable_uv"])
        chart, way["uv"] = found.chart, "; ".join(found.told)
        measured = topology(working.vertices, working.triangles)
        findings = _findings(source, working, findings, layout | way) | measured | {
            "charts": int(chart.max()) + 1,
            "texel_density": _texel_density(working, uv, options.texture_size),
            "texture_filled": round(float(np.abs(signed_area(uv)).sum()), 3),
            "stretch": round(stretch(working.vertices[working.triangles], uv), 3),
        }
        progress("write", 3, 4)
        extra = {
            "source_format": source.format,
            "source_name": mesh.name,
            "uv_kept": kept,
            "shared_texels": found.shared,
            "parts": [asdict(part) for part in source.parts],
            "sets": [TextureSet(slots=tuple(dict.fromkeys(part.material for part in source.parts))).to_json()],
            "groups": source.groups,
            "passed_on": source.passed_on if kept else nothing_passed_on(),
            "findings": findings,
        }
        arrays = _arrays(source, working, normals, uv, chart, loop_uv) | _extras(source, kept)
        save_npz(out, PREP, arrays, Provenance(request.options, None, request.inputs, extra))
        progress("write", 4, 4)
    return PrepResult(False, findings)


def _inputs(mesh: Path) -> dict[str, str]:
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
) -> tuple[Source, dict[str, Any]]:
    """The source with the first of its UV sets that can be baked, and which; or as it is, and what is wrong with it.

    Raises: InputError where a set must be kept and none can be.
    """
    if options.uv == "new":
        return source, {"unusable_uv": "new ones asked for", "uv_set": None}
    if options.own_instances and any(part.instance_of >= 0 for part in with_instances(source).parts):
        return source, {"unusable_uv": "instances are to have texels of their own", "uv_set": None}
    _, area = face_normals(working.vertices, working.triangles)
    problems, own = [], firsts(source, working.loops)
    for number, candidate in enumerate(source.by_uv_set()):
        problems.append(unusable(working.triangles[own], loop_uvs(candidate)[working.loops[own]], area[own]))
        if problems[-1] is None:
            return candidate, {"unusable_uv": None, "uv_set": number}
    if options.uv in ("keep", "mend"):
        raise InputError(f"{path}: its UVs cannot be kept: {problems[0]}; mend them or let new ones be made")
    return source, {"unusable_uv": problems[0], "uv_set": None}


def _texture(
    source: Source, working: Working, options: PrepOptions, problem: str | None, path: Path
) -> tuple[NDArray[np.float32], dict[str, Any]]:
    """UVs of all source loops (L, 2), the source's where nothing is wrong with them, and how they came about.

    Raises: InputError where some are to be mended and there is no room.
    """
    polygon = np.searchsorted(source.loop_start, working.loops[:, 0], "right") - 1
    if problem is None:
        uv = loop_uvs(source)
        uv[working.loops] = sound(uv[working.loops])
        if options.uv == "mend":
            uv[working.loops] = _mended(uv[working.loops], working, polygon, path)
        uv[working.loops] = with_neighbours(uv[working.loops], working.triangles, polygon)
        return _everywhere(like_the_first(source, uv), working), {"unwrap": "kept", "gutter": None}
    own = firsts(source, working.loops)
    seconds = options.unwrap_seconds if own.sum() <= options.unwrap_triangles else 0.0
    layout = unwrap(
        working.vertices, working.triangles[own], polygon[own], options.texture_size, options.padding, seconds
    )  # fmt: skip
    made = np.full((len(source.loop_vertex), 2), np.nan, np.float32)
    made[working.loops[own]] = np.clip(layout.uv, 0, 1)
    made = _everywhere(like_the_first(source, made), working)
    return made, {"unwrap": layout.method, "gutter": layout.packing.gutter}


def _mended(uv: NDArray, working: Working, polygon: NDArray, path: Path) -> NDArray[np.float32]:
    """UVs (F, 3, 2) in which all faces have texels. Raises: InputError."""
    made = mended(working.vertices, working.triangles, polygon, uv)
    if made is None:
        remedy = "--uv keep lets them show a neighbour's texel, --uv new makes new ones"
        raise InputError(f"{path}: its UVs leave no room for the faces that have none; {remedy}")
    return made


def _charts(source: Source, working: Working, uv: NDArray, problem: str | None) -> Kept:
    """Charts of UVs (F, 3, 2), and what was found and done."""
    area = face_normals(working.vertices, working.triangles)[1]
    if problem is not None:
        said = [f"made new: {problem}", *told(source)]
        if len(said) > 1:
            return Kept(sharing(working.triangles, uv, area), True, said)
        return Kept(uv_charts(working.triangles, uv), False, said)
    given = sound(loop_uvs(source)[working.loops])
    missing = ~np.asarray(np.isfinite(given).all((1, 2)))
    new = ~flat(uv) & (missing | (given != uv).any((1, 2)))
    found = keep(working.triangles, uv, area, missing, new)
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
        "face_set": np.zeros(len(source.face_part), np.int32),
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
