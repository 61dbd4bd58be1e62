"""The bake stage: prep.npz and material.npz in, a folder with textures, models and a preview out."""

import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.asset import gltf
from stages.asset.folder import MESH
from stages.asset.gltf import write_glb
from stages.asset.maps import Maps
from stages.asset.model import source_model
from stages.asset.parts import labels
from stages.asset.passed_on import PassedOn
from stages.asset.report_page import write_page
from stages.asset.textures import write_textures
from stages.asset.traced import baked_bumps, traced_scene, triangle_parts, world_frames
from stages.asset.wavefront import write_obj
from stages.bake.checks import Facts, islands
from stages.bake.evaluate import evaluate
from stages.bake.fill import Nearest, fill_groups
from stages.bake.occlusion import occlusion_map
from stages.bake.options import BakeOptions
from stages.bake.page import page_of
from stages.bake.preview import Look, contact_sheet
from stages.bake.raster import Layout, Surface, joined, touched_texels
from stages.bake.relief import relief_normals
from stages.bake.sizes import block, means, sized
from stages.bake.studio import write_studio
from stages.bake.texels import Texels
from stages.bake.visibility import Patches, Views, is_open, patches, seen_elsewhere, seen_points
from stages.core.artifact import (
    Artifact,
    Provenance,
    expect_input,
    load_npz,
    peek,
    plain_options,
    read_json,
    read_manifest,
    reason,
    run_log,
    sha256_file,
    write_manifest,
    written_atomically,
)
from stages.core.errors import ArtifactError, OutputError
from stages.core.images import write_png
from stages.core.parallel import beside
from stages.core.progress import Progress, silent
from stages.core.schemas import ASSET, MATERIAL, PREP
from stages.core.texture_sets import ONE_SET, TextureSet, texture_sets, triangle_sets
from stages.core.tiles import signed_area
from stages.light.scene import Scene
from stages.material.learnt import LearntMaterial
from stages.material.relief import bounded
from stages.material.stored import with_residual

SAID_OF_OPTIONS = ("quality", "steps")
"""Options of `distill` that bake.json repeats."""

STREWN, FEWEST = 1 << 17, 1 << 12
"""Points on what the other texture sets show, of all sets together, and of each at least."""


@dataclass(frozen=True)
class BakeResult:
    """What was made. up_to_date: nothing had to be done. report: `extra` of bake.json."""

    folder: Path
    up_to_date: bool
    files: list[str]
    report: dict[str, Any]


@dataclass(frozen=True)
class Subject:
    """The mesh, ready to trace and to bake.

    open: whether the backs of its triangles can be seen. label: (F,) of the parts. set: the texture set that is baked,
    triangles: (F,) whether they show it, layout: what lies on its texture, touched: (size, size) the surface point of each of
    its texels. block: texels along an edge of the blocks whose means pictures show.
    """

    mesh: Artifact
    scene: Scene
    open: bool
    label: NDArray[np.int32]
    triangles: NDArray[np.bool_]
    layout: Layout
    touched: Surface
    set: TextureSet = ONE_SET
    block: int = 1

    @staticmethod
    def of(prep: Path, mesh: Artifact, size: int) -> "Subject":
        """From prep.npz, with its first texture set. Raises: ArtifactError."""
        return next(subjects(prep, mesh, [replace(texture_sets(mesh.provenance)[0], size=size)]))

    def points(self, surface: Surface) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """World positions and interpolated normals of surface points, (N, 3) each."""
        return surface.interpolate(self.corners), surface.interpolate(self.mesh["normals"])

    @cached_property
    def corners(self) -> NDArray[np.float32]:
        """World positions of the triangles' corners, (F, 3, 3)."""
        return self.mesh["vertices"][self.mesh["triangles"]]

    def pad(self, *maps: NDArray[np.float32]) -> None:
        """Give every texel off the charts the values of the nearest texel on one, in place; see `Nearest`."""
        self._nearest.pad(*maps)

    @cached_property
    def _nearest(self) -> Nearest:
        return Nearest.of(self.touched.triangle >= 0)


def subjects(prep: Path, mesh: Artifact, sets: list[TextureSet]) -> Iterator[Subject]:
    """The mesh with one texture set after the other.

    Args:
        prep: what the mesh is from. sets: the mesh's first ones, with sizes.
    Raises: ArtifactError when no texel of a texture would show any surface.
    """
    of_triangle = triangle_sets(mesh)
    area = np.bincount(of_triangle, np.abs(signed_area(mesh["uv"])), len(sets))
    for chosen, of_set in zip(sets, area.tolist(), strict=False):
        if not of_set:
            named = f" of set {chosen.name}" if chosen.name else ""
            raise ArtifactError(f"{prep}: its UVs cover no texel of {chosen.size}{named}; make it again with new UVs")
    scene, open_mesh, label = traced_scene(mesh), is_open(mesh["triangles"]), labels(mesh)
    for number, chosen in enumerate(sets):
        mine = of_triangle == number
        layout = Layout.of(mesh["uv"], chosen.size, mesh["charts"], mine)
        touched = touched_texels(layout)
        yield Subject(mesh, scene, open_mesh, label, mine, layout, touched, chosen, block(sets))


def bake(
    prep: Path,
    material: Path,
    out: Path,
    options: BakeOptions,
    force: bool = False,
    progress: Progress = silent,
) -> BakeResult:
    """Bake the material of a mesh into textures and write the textured model.

    Args:
        prep, material: artefacts of the stages before; the material must be of this very mesh. out: folder.
        force: bake even when the folder holds the result of the same request.
    Raises: ArtifactError, OutputError.
    """
    mesh, made = load_npz(prep, PREP), load_npz(material, MATERIAL)
    inputs = {"prep": sha256_file(prep), "material": sha256_file(material)}
    expect_input(material, made.provenance, "prep", inputs["prep"], prep)
    chosen = plain_options(options)
    del chosen["library"]  # the material says by hash what it uses of it
    wanted = Provenance(chosen, made.provenance.seed, inputs)
    known = peek(out, ASSET)
    if known and known.same_request(wanted) and not force:
        return BakeResult(out, True, sorted(read_manifest(out, ASSET)[1]), known.extra)
    learnt = LearntMaterial.of(material, made, options.library)
    with run_log(out) as measured:
        sets = sized(texture_sets(mesh.provenance), options.size)
        open_folder(out, prep)
        shown, covered = list[Shown](), list[Covered]()
        for subject in subjects(prep, mesh, sets):
            maps, on_charts = bake_maps(subject, made, learnt, options, progress)
            shown.append(write_set(out, subject, with_normals(subject, maps).stored(), progress))
            covered.append(on_charts)
        extra = {**describe(mesh, made), **shares(covered), "sets": [of.to_json() for of in sets]}
        files, report = write_asset(out, (prep, subject), shown, replace(wanted, extra=extra), progress)
        measured |= {"texture_size": max(of.size for of in sets), "texels": sum(of.size**2 for of in sets)}
        measured["triangles"] = len(mesh["triangles"])
    return BakeResult(out, False, sorted(files), report)


def open_folder(out: Path, prep: Path) -> None:
    """Make the folder; where it holds an earlier asset, of whatever version, take that away, its manifest first.

    Args:
        prep: what is baked, which stays if it lies there.
    Raises: OutputError; ArtifactError where a foreign file has the manifest's name, or a damaged one.
    """
    manifest = out / ASSET.manifest
    old = read_json(manifest) or {}
    if manifest.exists() and not (isinstance(old, dict) and old.get("schema") == ASSET.name):
        raise ArtifactError(f"{manifest}: not a file of dreammat's; give another folder, or move that file away")
    try:
        out.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=out).close()
        manifest.unlink(missing_ok=True)
        for name in old.get("files") or {}:
            file = out / Path(name).name
            if not (file.exists() and file.samefile(prep)):
                file.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{out}: cannot be written: {reason(error)}; give a folder that can") from error


@dataclass(frozen=True)
class Covered:
    """Texels of a texture, those on its charts, and of these those that no view saw."""

    texels: int
    on_charts: int
    unseen: int


def shares(covered: list[Covered]) -> dict[str, float]:
    """The shares of texels on charts and, of these, that no view saw, over all sets."""
    on_charts = sum(of.on_charts for of in covered)
    texels, unseen = sum(of.texels for of in covered), sum(of.unseen for of in covered)
    return {"coverage": round(on_charts / texels, 6), "unseen": round(unseen / on_charts, 6)}


def bake_maps(
    subject: Subject, made: Artifact, learnt: LearntMaterial, options: BakeOptions, progress: Progress
) -> tuple[Maps, Covered]:
    """The material of every texel of a set, to the last one."""
    on_chart = subject.touched.triangle >= 0
    mesh, charts, rays = subject.mesh, subject.mesh["charts"], options.occlusion_rays
    texels = Texels(learnt, subject.corners, mesh["normals"], subject.label, subject.layout, subject.touched)
    groups = patches(subject.touched, charts)
    with beside(lambda: learnt_of(subject, groups, views_of(made), learnt, texels)) as known:
        maps = texels.recipe(options.supersample, groups, progress)
        occlusion = occlusion_map(subject.scene, subject.touched, charts, rays, subject.open, progress)
    residual, unseen = known.result()
    maps[on_chart, :5] = with_residual(maps[on_chart][:, :5], residual)
    progress("padding", 0, 1)
    subject.pad(maps, occlusion)
    height = bounded(maps[..., 5], options.relief) if learnt.recipe.has_relief and options.relief else None
    covered = Covered(on_chart.size, int(on_chart.sum()), unseen)
    return Maps(np.ascontiguousarray(maps[..., :5]), height, occlusion=occlusion), covered


def with_normals(subject: Subject, maps: Maps) -> Maps:
    """The maps with the normal map of their height, which lies on the source's own where it has one; their roughness is raised,
    in place, by what normals differ within a texel."""
    if maps.height is None:
        return maps
    mesh, touched = subject.mesh, subject.touched
    frames = world_frames(mesh, set(np.unique(triangle_parts(mesh)[subject.triangles]).tolist()))
    corners, own = (subject.corners, mesh["normals"]), subject.scene.bumps
    normals = relief_normals(
        maps.height, maps.roughness, touched, subject.layout, mesh["charts"], corners, frames, own
    )  # fmt: skip
    subject.pad(normals, maps.roughness)
    return replace(maps, normal=normals)


@dataclass(frozen=True)
class Shown:
    """What remains of a texture set when its maps are written.

    files: their names. material: (H, W, 5), normal: (H, W, 3) or None, as pictures show them. occlusion: whether there is any.
    facts: for the report.
    """

    set: TextureSet
    files: list[str]
    material: NDArray[np.float32]
    normal: NDArray[np.float32] | None
    occlusion: bool
    facts: Facts


def write_set(out: Path, subject: Subject, maps: Maps, progress: Progress) -> Shown:
    """Write the maps of a texture set."""
    progress("files", 0, 1)
    mesh, part = subject.mesh, subject.set.share
    with beside(lambda: Facts.of(maps.material, subject.touched, islands(mesh, subject.triangles), part)) as facts:
        files = write_textures(out, maps, subject.set)
    normal = None if maps.normal is None else means(maps.normal, subject.block)
    return Shown(subject.set, files, means(maps.material, subject.block), normal, maps.occlusion is not None, facts.result())


def shown_look(subject: Subject, shown: list[Shown]) -> Look:
    """The mesh by itself, as a viewer has it, with the materials and the normals that the asset's own maps give it."""
    normals = [of.normal for of in shown if of.normal is not None]
    scene = subject.scene.alone()
    scene = scene.bumped(baked_bumps(subject.mesh, normals)) if normals else scene
    return Look.of(subject.mesh, scene, [of.material for of in shown])


def learnt_of(
    subject: Subject, groups: Patches, views: Views, learnt: LearntMaterial, texels: Texels
) -> tuple[NDArray[np.float32], int]:
    """What was learnt at the texels on charts, where no view saw them that of seen surface nearby, if any was seen.

    What other texture sets show is nearby too.

    Args:
        groups: the texels, by which sight is decided.
    Returns:
        (N, 5) logits, row by row; how many of these texels no view saw.
    """
    values = texels.residual()
    surface = subject.touched.where(subject.touched.triangle >= 0)
    first = surface[groups.first]
    seen = seen_points(subject.scene, first, views, subject.open)
    if subject.mesh.provenance.extra["shared_texels"]:
        seen |= seen_elsewhere(subject.scene, subject.layout, subject.mesh["charts"], groups, views, subject.open)
    texel_seen = seen[groups.of_texel]
    if seen.all():
        return values, 0
    others = seen_of_others(subject, views)
    known = subject.points(joined([first[seen], others]))
    of_known = np.concatenate([groups.mean(values)[seen], evaluate(learnt.residual, others.interpolate(subject.corners))])
    if len(of_known):
        hidden = np.flatnonzero(~texel_seen)
        _, nearby, group = np.unique(groups.of_texel[hidden], return_index=True, return_inverse=True)
        values[hidden] = fill_groups(known, of_known, subject.points(surface[hidden]), nearby, group)
    return values, int((~texel_seen).sum())


def seen_of_others(subject: Subject, views: Views) -> Surface:
    """Points, strewn evenly, of surface that other texture sets show and a view saw."""
    a, b, c = (subject.corners[:, k].astype(np.float64) for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    area[subject.triangles] = 0
    if not area.any():
        return Surface(np.zeros(0, np.int32), np.zeros((0, 2), np.float32))
    rng = np.random.default_rng(0)
    face = rng.choice(len(area), max(STREWN // len(texture_sets(subject.mesh.provenance)), FEWEST), p=area / area.sum())
    surface = Surface(face.astype(np.int32), rng.dirichlet((1, 1, 1), len(face))[:, :2].astype(np.float32))
    return surface[np.flatnonzero(seen_points(subject.scene, surface, views, subject.open))]


def views_of(made: Artifact) -> Views:
    """The views that distillation saw."""
    width, height = made["size"].tolist()
    return Views(made["c2w"], made["fov_y"], width, height)


def write_asset(
    out: Path, of: tuple[Path, Subject], shown: list[Shown], made: Provenance, progress: Progress, kept: Sequence[str] = ()
) -> tuple[list[str], dict[str, Any]]:
    """Write all that follows from the maps of texture sets that are written, the mesh, and the manifest.

    Args:
        of: prep.npz and what it holds. made: how the asset is made, and what is known of it so far. kept: further files of the
        asset that are there already.
    Returns:
        the files' names, textures too; what bake.json says, with what the models could not hold.
    """
    prep, subject = of
    size, look = int(made.options["preview_size"]), shown_look(subject, shown)
    progress("preview", 0, 1)
    with beside(lambda: page_of(subject.mesh, made, look, [one.facts for one in shown], size)) as page:
        files, notes = write_models(out, subject, shown, look, size, made.extra.get("bounces", 0))
    files += [keep_mesh(out, prep), *kept]
    progress("report", 0, 1)
    write_page(out / "report.html", page.result(), files)
    progress("report", 1, 1)
    files.append("report.html")
    made = replace(made, extra={**made.extra, **notes})
    write_manifest(out, ASSET, made, files)
    return files, made.extra


def keep_mesh(out: Path, prep: Path) -> str:
    """Leave what was baked in the asset too, by which it is edited: the same file where the file system can, else a copy."""
    kept = out / MESH
    if not (kept.exists() and kept.samefile(prep)):
        with written_atomically(kept) as temporary:
            try:
                os.link(prep, temporary)
            except OSError:  # another file system, or one without links
                shutil.copyfile(prep, temporary)
    return MESH


def write_models(
    out: Path, subject: Subject, shown: list[Shown], look: Look, preview_size: int, bounces: int
) -> tuple[list[str], dict[str, int]]:
    """Write models and preview of texture sets that are written.

    Args:
        look: what the preview shows. bounces: of light between surfaces, there.
    Returns:
        the files' names, textures too; what the models could not hold.
    """
    mesh, relief = subject.mesh, shown[0].normal is not None
    files = [name for of in shown for name in of.files]
    passed_on = PassedOn.of(mesh).without("normalTexture") if relief else PassedOn.of(mesh)
    names = {part["material"] for part in mesh.provenance.extra["parts"]}
    model = source_model(mesh, subject.open, names if relief else set(passed_on.normal_maps()))
    pictures = [pictures_of(out, of, wrap) for of, wrap in zip(shown, look.wraps, strict=True)]
    write_glb(out / "model.glb", model, gltf.Look(pictures, shown[0].occlusion, passed_on))
    files.append("model.glb")
    if mesh.provenance.extra["source_format"] == "obj":
        write_obj(out / "model.obj", mesh, relief)
        files += ["model.obj", "model.mtl"]
    write_png(out / "preview.png", contact_sheet(look, preview_size, bounces))
    return [*files, "preview.png", *write_studio(out, mesh, preview_size, bounces)], model.notes


def pictures_of(folder: Path, shown: Shown, wrap: int) -> gltf.Pictures:
    """The PNGs in the folder that model.glb takes. Args: wrap: how they go on beyond their edges, glTF's number."""
    names = ["albedo", "orm"] + ["normal"] * (shown.normal is not None)
    images = {name: (folder / shown.set.file(f"{name}.png")).read_bytes() for name in names}
    return gltf.Pictures(images, shown.set.suffix, wrap)


def describe(mesh: Artifact, made: Artifact) -> dict[str, Any]:
    """What bake.json says of the inputs."""
    source, material = mesh.provenance.extra, made.provenance.extra
    return {
        **{key: source[key] for key in ("source_name", "source_format", "uv_kept", "findings")},
        **{key: material[key] for key in ("prompt", "parts", "guidance", "environments")},
        **{key: material[key] for key in ("bounces",) if key in material},
        "distilled_with": {key: made.provenance.options[key] for key in SAID_OF_OPTIONS if key in made.provenance.options},
        "material_slots": list(dict.fromkeys(part["material"] for part in source["parts"])),
    }
