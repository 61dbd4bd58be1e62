"""The bake stage: prep.npz and material.npz in, a folder with textures, models and a preview out."""

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from stages.asset.gltf import Look, write_glb
from stages.asset.maps import Maps
from stages.asset.model import source_model
from stages.asset.passed_on import PassedOn
from stages.asset.textures import write_textures
from stages.asset.traced import baked_bumps, traced_scene, world_frames
from stages.asset.wavefront import write_obj
from stages.bake.fill import fill_unseen, pad
from stages.bake.occlusion import occlusion_map
from stages.bake.options import BakeOptions
from stages.bake.page import report_page
from stages.bake.preview import contact_sheet
from stages.bake.raster import Layout, Surface, touched_texels
from stages.bake.relief import relief_normals
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
)
from stages.core.errors import ArtifactError, OutputError
from stages.core.images import write_png
from stages.core.progress import Progress, silent
from stages.core.schemas import ASSET, MATERIAL, PREP
from stages.core.tiles import repeats, signed_area
from stages.light.lookup import CLAMP, REPEAT
from stages.light.scene import Scene
from stages.material.learnt import LearntMaterial
from stages.material.relief import bounded
from stages.material.residual import combined


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

    open: whether the backs of its triangles can be seen. touched: (size, size) the surface point of each texel.
    """

    mesh: Artifact
    scene: Scene
    open: bool
    layout: Layout
    touched: Surface

    @staticmethod
    def of(prep: Path, mesh: Artifact, size: int) -> "Subject":
        """From prep.npz. Raises: ArtifactError when no texel of the texture would show any surface."""
        layout = Layout.of(mesh["uv"], size, mesh["charts"])
        touched = touched_texels(layout)
        if not signed_area(mesh["uv"]).any() or not (touched.triangle >= 0).any():
            raise ArtifactError(f"{prep}: its UVs cover no texel of {size}; make it again with new UVs")
        scene = traced_scene(mesh)
        return Subject(mesh, scene, is_open(mesh["triangles"]), layout, touched)

    def points(self, surface: Surface) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """World positions and interpolated normals of surface points, (N, 3) each."""
        corners = self.mesh["vertices"][self.mesh["triangles"]]
        return surface.interpolate(corners), surface.interpolate(self.mesh["normals"])


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
        subject = Subject.of(prep, mesh, options.size)
        open_folder(out)
        maps, coverage = bake_maps(subject, made, learnt, options, progress)
        maps = with_normals(subject, maps)
        subject = replace(subject, scene=shown_scene(subject, maps))
        files, notes = write_asset(out, subject, maps, options, progress)
        report = {**describe(mesh, made), **coverage, **notes}
        where = (subject.scene, subject.touched)
        files.append(report_page(out, mesh, made, *where, maps.material, files, report, options.preview_size, progress))
        write_manifest(out, ASSET, Provenance(wanted.options, wanted.seed, inputs, report), files)
        measured["texture_size"] = options.size
    return BakeResult(out, False, sorted(files), report)


def open_folder(out: Path) -> None:
    """Make the folder; where it holds an earlier asset, of whatever version, take that away, its manifest first.

    Raises: OutputError, also where a file of another program has the manifest's name.
    """
    manifest = out / ASSET.manifest
    old = read_json(manifest) or {}
    if manifest.exists() and not (isinstance(old, dict) and old.get("schema") == ASSET.name):
        raise OutputError(f"{manifest}: not a file of dreammat's; give another folder, or move that file away")
    try:
        out.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=out).close()
        manifest.unlink(missing_ok=True)
        for name in old.get("files") or {}:
            (out / Path(name).name).unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{out}: cannot be written: {reason(error)}; give a folder that can") from error


def bake_maps(
    subject: Subject, made: Artifact, learnt: LearntMaterial, options: BakeOptions, progress: Progress
) -> tuple[Maps, dict[str, Any]]:
    """The material of every texel, to the last one.

    Returns:
        the maps; the shares of texels on charts and, of these, that no view saw.
    """
    on_chart = subject.touched.triangle >= 0
    mesh = subject.mesh
    texels = Texels(learnt, mesh["vertices"][mesh["triangles"]], mesh["normals"], subject.layout, subject.touched)
    residual = texels.residual()
    groups = patches(subject.touched, mesh["charts"])
    unseen = mend_unseen(subject, groups, views_of(made), residual, progress)
    maps = texels.recipe(options.supersample, groups, progress)
    values = combined(*(torch.from_numpy(a[on_chart]) for a in (maps[..., :5], residual)))
    maps[on_chart, :5] = values.numpy()
    charts, rays = mesh["charts"], options.occlusion_rays
    occlusion = occlusion_map(subject.scene, subject.touched, charts, rays, subject.open, progress)
    progress("padding", 0, 1)
    pad(on_chart, maps, occlusion)
    height = bounded(maps[..., 5], options.relief) if learnt.recipe.has_relief and options.relief else None
    shares = {"coverage": round(float(on_chart.mean()), 6), "unseen": round(unseen, 6)}
    return Maps(np.ascontiguousarray(maps[..., :5]), height, occlusion=occlusion), shares


def with_normals(subject: Subject, maps: Maps) -> Maps:
    """The maps with the normal map of their height, which lies on the source's own where it has one."""
    if maps.height is None:
        return maps
    mesh, touched = subject.mesh, subject.touched
    corners, frames = mesh["vertices"][mesh["triangles"]], world_frames(mesh)
    normals = relief_normals(
        maps.height, touched, subject.layout, mesh["charts"], (corners, mesh["normals"]), frames, subject.scene.bumps
    )  # fmt: skip
    pad(touched.triangle >= 0, normals)
    return replace(maps, normal=normals)


def shown_scene(subject: Subject, maps: Maps) -> Scene:
    """The scene with the normals that the asset's own normal map gives."""
    return subject.scene if maps.normal is None else subject.scene.bumped(baked_bumps(subject.mesh, maps.normal))


def mend_unseen(
    subject: Subject, groups: Patches, views: Views, residual: NDArray[np.float32], progress: Progress
) -> float:
    """Fill, in place, what was learnt at texels that no view saw from seen surface nearby; all stay when none was seen.

    Args:
        groups: the texels, by which sight is decided. residual: (H, W, 5).
    Returns:
        the share of texels on charts that no view saw.
    """
    progress("visibility", 0, 1)
    on_chart = subject.touched.triangle >= 0
    surface = subject.touched.where(on_chart)
    first = surface[groups.first]
    seen = seen_points(subject.scene, first, views, subject.open)
    if subject.mesh.provenance.extra["shared_texels"]:
        seen |= seen_elsewhere(subject.scene, subject.layout, subject.mesh["charts"], groups, views, subject.open)
    texel_seen = seen[groups.of_texel]
    if seen.any() and not seen.all():
        progress("filling", 0, 1)
        values = residual[on_chart]
        known, wanted = subject.points(first[seen]), subject.points(surface[~texel_seen])
        values[~texel_seen] = fill_unseen(known, groups.mean(values)[seen], wanted)
        residual[on_chart] = values
    return float((~texel_seen).mean())


def views_of(made: Artifact) -> Views:
    """The views that distillation saw."""
    width, height = made["size"].tolist()
    return Views(made["c2w"], made["fov_y"], width, height)


def write_asset(
    out: Path, subject: Subject, maps: Maps, options: BakeOptions, progress: Progress
) -> tuple[list[str], dict[str, int]]:
    """Write textures, models and preview. Returns: the files' names; what the models could not hold."""
    progress("files", 0, 1)
    mesh, scene = subject.mesh, subject.scene
    is_obj = mesh.provenance.extra["source_format"] == "obj"
    files = write_textures(out, maps, grey=is_obj)
    names = {part["material"] for part in mesh.provenance.extra["parts"]}
    look = look_of(out, maps, PassedOn.of(mesh), REPEAT if repeats(mesh["uv"]) else CLAMP)
    normal_mapped = set(look.passed_on.normal_maps()) if maps.normal is None else names
    model = source_model(mesh, subject.open, normal_mapped)
    write_glb(out / "model.glb", model, look)
    files.append("model.glb")
    if is_obj:
        write_obj(out / "model.obj", mesh, relief=maps.normal is not None)
        files += ["model.obj", "model.mtl"]
    write_png(out / "preview.png", contact_sheet(scene, mesh["uv"], maps.material, options.preview_size, progress))
    files += ["preview.png", *write_studio(out, mesh, options.preview_size)]
    return files, model.notes


def look_of(folder: Path, maps: Maps, passed_on: PassedOn, wrap: int = CLAMP) -> Look:
    """What model.glb's materials show: the PNGs in the folder, and what the source brings that they do not replace.

    Args:
        wrap: how the textures go on beyond their edges, glTF's number.
    """
    names = ["albedo", "orm"] + ["normal"] * (maps.normal is not None)
    passed_on = passed_on if maps.normal is None else passed_on.without("normalTexture")
    images = {name: (folder / f"{name}.png").read_bytes() for name in names}
    return Look(images, maps.occlusion is not None, passed_on, wrap)


def describe(mesh: Artifact, made: Artifact) -> dict[str, Any]:
    """What bake.json says of the inputs."""
    source, material = mesh.provenance.extra, made.provenance.extra
    return {
        **{key: source[key] for key in ("source_name", "source_format", "uv_kept", "findings")},
        **{key: material[key] for key in ("prompt", "guidance", "environments")},
        "material_slots": list(dict.fromkeys(part["material"] for part in source["parts"])),
    }
