"""The conditions stage: cameras, environments, and the light transport of every view under each of them."""

import shutil
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from stages.asset.parts import labelled_parts, labels
from stages.asset.traced import traced_scene
from stages.conditions.cameras import Cameras, place_cameras
from stages.conditions.maps import on_sheet, sheet_rows, write_maps, write_sheet
from stages.conditions.options import ConditionsOptions
from stages.conditions.predict import choose_quality
from stages.conditions.shards import SHARD, merge, views_of
from stages.core.artifact import (
    MANIFEST,
    Artifact,
    Provenance,
    is_readable_exr,
    load_npz,
    peek,
    plain_options,
    read_json,
    reason,
    run_log,
    save_npz,
    sha256_file,
    write_json,
    write_manifest,
)
from stages.core.errors import InputError, NumericalError, OutputError
from stages.core.memory import kept
from stages.core.naming import guess
from stages.core.progress import Progress, silent
from stages.core.schemas import BOUNCES, CAMERAS, CONDITIONS, PREP, SURVEY, VIEW_BOUNCES
from stages.core.shading import KNOTS, Transport
from stages.core.texture_sets import triangle_sets
from stages.core.tiles import Representatives
from stages.core.views import (
    SD,
    Geometry,
    read_geometry,
    read_transport,
    view_folder,
    write_geometry,
    write_light_maps,
    write_transport,
)
from stages.light.bounce import blender_light_maps
from stages.light.ends import Ends
from stages.light.environment import Environment, load_environment, save_environment
from stages.light.exchange import Between
from stages.light.gbuffer import GBuffer, trace_view
from stages.light.lights import BUILTIN
from stages.light.scene import Scene
from stages.light.terms import BOUNCED
from stages.light.transport import QUALITY, Quality, transport_and_ends
from stages.material.survey import make_survey

BETWEEN = "bounces.npz"
"""Of the whole folder, and of each view."""

REQUEST = "request.json"
"""What an unfinished folder was asked for; a rerun that asks for the same continues it."""


@dataclass(frozen=True)
class ConditionsResult:
    """What a run did: names of environments, views made now and found made, texels mended, already up to date.

    expected_percent: the error that was predicted for the rays chosen by `error`; None where `quality` chose them.
    """

    environments: tuple[str, ...]
    made: int
    found: int
    clamped: dict[str, int]
    up_to_date: bool
    expected_percent: float | None = None


def conditions(
    prep: Path, out: Path, options: ConditionsOptions, force: bool = False, progress: Progress = silent
) -> ConditionsResult:
    """Ray-trace what conditions the distillation: prep.npz in, a conditions folder out.

    Raises: InputError, ArtifactError, OutputError, NumericalError.
    """
    mesh = load_npz(prep, PREP)
    lights, clamped, hashes = read_lights(options.env)
    names = tuple(light.name for light in lights)
    chosen = plain_options(replace(options, env=names))
    del chosen["shard"], chosen["merge"]  # views are the same, however they were divided
    if not options.bounces:
        del chosen["bounces"]  # the same bytes as before there were any
    request = Provenance(chosen, options.seed, {"prep": sha256_file(prep), **hashes})
    mine, whole = views_of(options.shard, options.views), options.shard[1] == 1
    done = None if force else peek(out, CONDITIONS if whole else SHARD)
    if done and done.same_request(request) and (whole or done.extra["shard"] == list(options.shard)):
        return ConditionsResult(names, 0, len(mine), clamped, True)

    start_folder(out, request, force)
    if options.merge:
        merge(options.merge, out, request)
    with run_log(out) as log:
        cameras = place_cameras(mesh["vertices"].astype(np.float64), options)
        save_cameras(out, cameras, request, options)
        for light in lights:
            save_environment(out / "environments" / f"{light.name}.exr", light)
        scene = traced_scene(mesh)
        label = labels(mesh)
        smooth = scene.shaded_smooth() if options.profile == SD else None
        subject = Subject(scene, smooth, label, shared_texels(mesh))
        quality, expected = QUALITY[options.quality], None
        if options.error:
            progress("choosing rays", 0, 1)
            first = trace_view(scene, cameras.c2w[0], float(cameras.fov_y[0]), options.size, options.size)
            quality, expected = choose_quality(scene, first, lights, options.error, options.seed)
        between = between_surfaces(scene, lights, options, progress)
        options = replace(options, bounces=options.bounces if between else 0)
        missing = [view for view in mine if not view_is_there(out, view, names, options)]
        made = len(missing)
        shown: dict[int, Future[list[NDArray]]] = {}
        with kept(), ThreadPoolExecutor(1) as writer:  # a view is written while the next one is traced
            written: Future | None = writer.submit(save_survey, out, scene, label, request) if whole else None
            for i, view in enumerate(missing):
                progress("views", len(mine) - made + i, len(mine))
                traced = trace(view, subject, cameras, lights, quality, options, between)
                if written:
                    written.result()
                written = shown[view] = writer.submit(write, out, view, lights, traced, options, request)
            if written:
                written.result()
        progress("views", len(mine), len(mine))
        if whole and between is not None:
            save_npz(out / BETWEEN, BOUNCES, bounces_arrays(between, subject, quality), request)
        if whole:
            write_sheet(out, sheet(out, names, options.views, {view: rows.result() for view, rows in shown.items()}))
        log |= {"views_made": made, "pixels": options.size**2, "rays": plain_options(quality), "expected_percent": expected}
        log |= {"environments": len(lights), "triangles": len(scene.triangles), "quality": options.quality}
    extra = {
        "environments": names,
        "views": options.views,
        "knots": KNOTS,
        "profile": options.profile,
        "clamped": clamped,
        "to_world": mesh["to_world"].ravel().tolist(),
        "parts": [part.to_json() for part in labelled_parts(mesh)],
        "shared_labels": shared_labels(subject),
        "bounces": options.bounces,
    }
    if whole:
        files = expected_files(names, options)
        write_manifest(out, CONDITIONS, replace(request, extra=extra), files)
    else:
        files = [file for view in mine for file in view_files(view, names, options)]
        write_manifest(out, SHARD, replace(request, extra={"shard": options.shard}), files)
    (out / REQUEST).unlink(missing_ok=True)
    return ConditionsResult(names, made, len(mine) - made, clamped, False, expected)


def read_lights(env: tuple[str, ...]) -> tuple[list[Environment], dict[str, int], dict[str, str]]:
    """The environments asked for: built-in ones by name, files by path.

    Returns:
        lights; texels mended in each; SHA-256 of each file, by role "environment <name>".
    Raises: InputError.
    """
    lights, clamped, hashes = [], {}, {}
    for choice in env or tuple(BUILTIN):
        if choice in BUILTIN:
            light, mended = BUILTIN[choice](), 0
        elif not Path(choice).suffix:
            expected = f"expected {', '.join(BUILTIN)}, or a .hdr or .exr file"
            raise InputError(f"--env {choice}: no such light; {guess(choice, BUILTIN)}{expected}")
        else:
            light, mended = load_environment(Path(choice))
            hashes[f"environment {light.name}"] = sha256_file(Path(choice))
        if light.name in clamped or light.name == "geometry":
            raise InputError(f"{choice}: the name '{light.name}' is taken by another environment; rename the file")
        lights.append(light)
        clamped[light.name] = mended
    return lights, clamped, hashes


def start_folder(out: Path, request: Provenance, force: bool) -> None:
    """Make the folder, or clear what an earlier run with another request left in it."""
    if out.exists() and not out.is_dir():
        raise OutputError(f"{out}: a file stands there, expected a folder; give another -o")
    asked = {"options": request.options, "seed": request.seed, "inputs": request.inputs}
    try:
        out.mkdir(parents=True, exist_ok=True)
        if force or read_json(out / REQUEST) != asked:
            for name in (MANIFEST, SHARD.manifest, REQUEST, BETWEEN, "cameras.npz", "survey.npz", "sheet.png", "run.json"):
                (out / name).unlink(missing_ok=True)
            for folder in [out / "environments", *out.glob("view_[0-9][0-9][0-9]*")]:
                shutil.rmtree(folder, ignore_errors=True)
            write_json(out / REQUEST, asked)
    except OSError as error:
        raise OutputError(f"{out}: cannot be written: {reason(error)}; give a folder that can") from error


def save_survey(out: Path, scene: Scene, label: NDArray[np.int32], request: Provenance) -> None:
    """Make and write survey.npz."""
    survey = make_survey(scene.vertices, scene.triangles, scene.normals, scene.hidden, label)
    save_npz(out / "survey.npz", SURVEY, survey.to_arrays(), request)


def save_cameras(out: Path, cameras: Cameras, request: Provenance, options: ConditionsOptions) -> None:
    """Write cameras.npz."""
    size = np.array(options.size, np.int32)
    arrays: dict[str, NDArray] = {"c2w": cameras.c2w, "fov_y": cameras.fov_y, "width": size, "height": size}
    save_npz(out / "cameras.npz", CAMERAS, arrays, request)


def view_is_there(out: Path, view: int, names: tuple[str, ...], options: ConditionsOptions) -> bool:
    """Whether every file of a view has been written, and none of them damaged since: no manifest tells of it yet."""
    *images, last = view_files(view, names, options)
    there = peek(out / last, VIEW_BOUNCES) is not None if options.bounces else is_readable_exr(out / last)
    return there and all(is_readable_exr(out / name) for name in images)


def view_files(view: int, names: tuple[str, ...], options: ConditionsOptions) -> list[str]:
    """Relative paths of a view's files."""
    kinds = ["geometry", *names, *(f"maps_{name}" for name in names if options.maps)]
    if options.profile == SD:
        kinds += [f"{SD}/{kind}" for kind in ("geometry", *names)]
    return [f"{view_folder(view)}/{kind}.exr" for kind in kinds] + [f"{view_folder(view)}/{BETWEEN}"] * (options.bounces > 0)


def expected_files(names: tuple[str, ...], options: ConditionsOptions) -> list[str]:
    """Relative paths of everything a complete folder holds."""
    views = [file for view in range(options.views) for file in view_files(view, names, options)]
    between = [BETWEEN] * (options.bounces > 0)
    return ["cameras.npz", "survey.npz", "sheet.png", *between, *(f"environments/{name}.exr" for name in names), *views]


@dataclass(frozen=True)
class Subject:
    """What is traced. smooth: the scene of the profile sd, or None. label: (F,) of each triangle. shared: by what texels are
    represented, None where none is shared."""

    scene: Scene
    smooth: Scene | None
    label: NDArray[np.int32]
    shared: Representatives | None

    @property
    def area(self) -> NDArray[np.float64]:
        """(F,) of the triangles."""
        corners = self.scene.vertices[self.scene.triangles].astype(np.float64)
        return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2


@dataclass(frozen=True)
class View:
    """What is written of a view. transports: one a light. smooth, maps: of the profile sd, or None: geometry, light maps.

    ends: where blocked rays end, or None.
    """

    geometry: Geometry
    transports: list[Transport]
    smooth: Geometry | None = None
    maps: list[Tensor] | None = None
    ends: Ends | None = None


def trace(
    view: int,
    subject: Subject,
    cameras: Cameras,
    lights: list[Environment],
    quality: Quality,
    options: ConditionsOptions,
    between: Between | None = None,
) -> View:
    """One view under every environment. Raises: NumericalError."""
    scene, smooth = subject.scene, subject.smooth
    camera = cameras.c2w[view], float(cameras.fov_y[view]), options.size, options.size
    points, seed = trace_view(scene, *camera), options.seed * 1_000_003 + view
    transports, ends = transport_and_ends(scene, points, lights, quality, seed, None if between is None else between.cells)
    for light, transport in zip(lights, transports, strict=True):
        check_finite(transport, light.name, view, options.seed)
    label, shown = shown_points(subject, points)
    geometry = Geometry(points.mask, points.depth, view_normals(points, camera[0]), label, shown)
    if smooth is None:
        return View(geometry, transports, ends=ends)
    points = trace_view(smooth, *camera)
    maps = blender_light_maps(smooth, points, lights, quality, seed)
    return View(geometry, transports, replace(geometry, normal=view_normals(points, camera[0]), shown=None), maps, ends)


def write(
    out: Path, view: int, lights: list[Environment], traced: View, options: ConditionsOptions, request: Provenance
) -> list[NDArray]:
    """Write the files of one view. Returns: its rows of the contact sheet, if it is on that, as its files would give them."""
    mask = traced.geometry.mask
    write_geometry(out, view, traced.geometry)
    stored = []
    for light, transport in zip(lights, traced.transports, strict=True):
        stored.append(write_transport(out, view, light.name, mask, transport))
        if options.maps:
            write_maps(out, view, light.name, traced.geometry, transport)
    if traced.ends is not None:
        save_npz(out / view_folder(view) / BETWEEN, VIEW_BOUNCES, traced.ends.to_arrays(), request)
    if traced.smooth is not None and traced.maps is not None:
        write_geometry(out, view, traced.smooth, SD)
        for light, maps in zip(lights, traced.maps, strict=True):
            write_light_maps(out, view, light.name, mask, maps, SD)
    return sheet_rows(traced.geometry, stored) if view in on_sheet(options.views) else []


def view_normals(points: GBuffer, c2w: NDArray) -> NDArray[np.float32]:
    """Shading normals in the camera's frame. Returns: (H, W, 3), 0 off the object."""
    image = np.zeros((*points.mask.shape, 3), np.float32)
    image[points.mask] = points.n @ c2w[:3, :3].astype(np.float32)
    return image


def shown_points(subject: Subject, points: GBuffer) -> tuple[NDArray[np.int32], NDArray[np.float32] | None]:
    """Labels, and what represents each pixel, as in `Geometry.label` and `shown`."""
    shared, triangle = subject.shared, points.triangle
    label, image = np.zeros(points.mask.shape, np.int32), None
    if shared is not None:
        image = np.zeros((*points.mask.shape, 7), np.float32)
        triangle, image[points.mask] = represented(subject, points.triangle, points.barycentric)
    label[points.mask] = subject.label[triangle]
    return label, image


def represented(subject: Subject, triangle: NDArray, barycentric: NDArray) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """What represents the texels of some points: its triangle (P,); its place, normal and scale (P, 7)."""
    scene, shared, found = subject.scene, subject.shared, triangle
    scale = np.ones(len(triangle), np.float32)
    if shared is not None:
        found, barycentric = shared.of(triangle, barycentric)
        scale = shared.scale(subject.area, triangle, found)
    place, normal = scene.point(found, barycentric), scene.smooth_normal(found, barycentric)
    return found, np.c_[place, normal, scale].astype(np.float32)


def between_surfaces(
    scene: Scene, lights: list[Environment], options: ConditionsOptions, progress: Progress
) -> Between | None:
    """What is known of bounces before any view is traced; None without, or where the object sees nothing of itself."""
    if not options.bounces:
        return None
    progress("light between surfaces", 0, 1)
    found = Between.of(scene, lights, options.seed, options.bounces)
    progress("light between surfaces", 1, 1)
    return found


def bounces_arrays(between: Between, subject: Subject, quality: Quality) -> dict[str, NDArray]:
    """As `BOUNCES` has them."""
    cells, exchange = between.cells, between.exchange
    triangle, shown = represented(subject, cells.triangle, cells.barycentric)
    arrays = {"weight": exchange.weight, "angle": exchange.angle, "direct": exchange.direct, **exchange.ends.to_arrays()}
    arrays |= {"cell_point": shown[:, :3].copy(), "cell_normal": shown[:, 3:6].copy(), "cell_scale": shown[:, 6].copy()}
    arrays |= {"cell_label": subject.label[triangle], "cell_width": np.array(cells.width, np.float32)}
    return arrays | {"lobe_rays": BOUNCED.counts(quality.lobe).astype(np.int32)}


def shared_labels(subject: Subject) -> list[tuple[int, int, float]]:
    """Which labels show texels of which others, as in `CONDITIONS`, judged by the triangles' centres."""
    if subject.shared is None:
        return []
    every = np.arange(len(subject.label), dtype=np.int32)
    found, _ = subject.shared.of(every, np.full((len(every), 3), 1 / 3))
    own, theirs = subject.label, subject.label[found]
    other, area = own != theirs, subject.area
    whole = np.bincount(own, area)
    pairs, row = np.unique(np.stack([own[other], theirs[other]], 1), axis=0, return_inverse=True)
    share = np.bincount(row.reshape(-1), area[other], len(pairs)) / np.maximum(whole[pairs[:, 0]], np.finfo(float).tiny)
    return [(int(a), int(b), round(float(s), 6)) for (a, b), s in zip(pairs, share, strict=True)]


def shared_texels(mesh: Artifact) -> Representatives | None:
    """By what texels are shared, None where none is."""
    if not mesh.provenance.extra["shared_texels"]:
        return None
    return Representatives(mesh["uv"], mesh["charts"], triangle_sets(mesh))


def check_finite(transport: Transport, environment: str, view: int, seed: int) -> None:
    """Raises: NumericalError naming environment, view, pixel and seed."""
    for name, values in (("E", transport.E), ("A", transport.A), ("B", transport.B)):
        if not values.sum().isfinite():
            bad = (~values.isfinite()).reshape(len(values), -1).any(1).nonzero()
            if not len(bad):  # a sum of very large numbers
                continue
            raise NumericalError(
                f"transport {name} is not finite: environment {environment}, view {view}, pixel {int(bad[0])} of the "
                f"object, seed {seed}; please report it with the mesh"
            )


def sheet(out: Path, names: tuple[str, ...], views: int, made: dict[int, list[NDArray]]) -> list[NDArray]:
    """Rows of the contact sheet: of views that were made just now, or read back from the files."""
    rows = []
    for view in on_sheet(views):
        if view in made:
            rows += made[view]
        else:
            geometry = read_geometry(out, view)
            rows += sheet_rows(geometry, [read_transport(out, view, name, geometry.mask) for name in names])
    return rows
