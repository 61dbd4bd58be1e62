"""report.html of a baked asset: what `bake` knows of it, gathered for `stages.asset.report_page`."""

import functools
import importlib.metadata
from pathlib import Path

import numpy as np

from stages.asset.report_page import Page, PageView, Shot
from stages.asset.report_view import PageLight
from stages.bake.checks import Facts, checks
from stages.bake.preview import Look, draw_views
from stages.bake.studio import BACKDROP, EXPOSURE, FOV_Y, GROUND, VIEWS, backdrop, camera
from stages.core.artifact import Artifact, Provenance
from stages.core.color import srgb_encode
from stages.core.parallel import in_parallel
from stages.core.texture_sets import TextureSet
from stages.light.environment import Environment, directions_of_texels
from stages.light.lights import BUILTIN, direction, disc, gradient, panel, preview_light
from stages.light.prefilter import cosine_harmonics, mip_levels, split_lamp
from stages.light.scene import Scene
from stages.light.transport import cached_light_set

LIGHT_ROWS = 128
"""Of the lights that are made here."""

SUSPECTS = 2
"""Lights of distillation, the first ones, whose trace is looked for in the albedo."""

SHOT_VIEWS = {"front": (35.0, 16.0), "back": (205.0, 24.0)}
"""Azimuth and elevation of the pictures, degrees."""

PACKAGES = ("dreammat", "numpy", "torch", "embreex", "xatlas", "OpenImageIO")
"""Whose versions the page names."""

LICENCES = [
    "The textures are yours. Geometry, and UVs where they were kept, stay under the licence of the source mesh.",
    "dreammat is Apache-2.0. Its prior learnt from pictures that the project renders itself; the vectors by which it reads "
    "words come from all-MiniLM-L6-v2 (Apache-2.0) and WordNet 3.1 (WordNet licence).",
]

SD_LICENCE = "Distilled with Stable Diffusion: the licence of the weights that were given applies to what they made."


@functools.cache
def dusk() -> Environment:
    """A red sun on the horizon under a deep blue sky."""
    w = directions_of_texels(LIGHT_ROWS, 2 * LIGHT_ROWS)[0]
    sun = direction(20, 6)
    light = gradient(w, (0.05, 0.04, 0.05), (0.55, 0.32, 0.22), (0.05, 0.08, 0.22), 0.4)
    glow = np.exp(-np.degrees(np.arccos((w @ sun).clip(-1, 1))) / 16.0)[..., None] * np.array([2.2, 0.9, 0.35])
    lamp = disc(w, sun, 1.4, 1.0)[..., None] * np.array([520.0, 210.0, 80.0])
    return Environment("dusk", (light + glow + lamp).astype(np.float32))


@functools.cache
def softbox() -> Environment:
    """A dark room with one large soft light at the side and a weak one behind."""
    w = directions_of_texels(LIGHT_ROWS, 2 * LIGHT_ROWS)[0]
    light = np.full((*w.shape[:2], 3), 0.04)
    light = light + panel(w, direction(75, 40), 1.6, 1.6, 0.1)[..., None] * np.array([4.2, 4.2, 4.2])
    light = light + panel(w, direction(-130, 20), 0.4, 1.4, 0.1)[..., None] * np.array([2.2, 2.5, 3.0])
    return Environment("softbox", light.astype(np.float32))


def page_of(mesh: Artifact, made: Provenance, look: Look, facts: list[Facts], size: int) -> Page:
    """What report.html says and shows.

    Args:
        made: what bake.json says. look: the mesh as it is shown. facts: of each texture set. size: pixels of a picture.
    """
    said = made.extra
    source = str(said["source_name"])
    lights, sets = suspects(tuple(said["environments"])), [TextureSet.from_json(of) for of in said["sets"]]
    return Page(
        name=Path(source).stem,
        prompt=str(said["prompt"] or ""),
        meta=f"{source}, {len(mesh['triangles']):,} triangles, {extent(sets)}",
        checks=checks(mesh, sets, facts, look.scene, lights, said),
        shots=pictures(look, max(32, 4 * size // 5 // 2 * 2), said.get("bounces", 0)),
        facts=how_made(mesh, made),
        licences=[*LICENCES, *([SD_LICENCE] if str(said["guidance"].get("name")) == "sd" else [])],
        light=page_light(),
        view=first_view(look.scene),
    )


def extent(sets: list[TextureSet]) -> str:
    """How large the textures are, in words."""
    low, high = min(of.size for of in sets), max(of.size for of in sets)
    if len(sets) == 1:
        return f"{high} × {high} texels"
    return f"{len(sets)} texture sets of {f'{low} to ' if low < high else ''}{high} texels along an edge"


def pictures(look: Look, size: int, bounces: int = 0) -> list[Shot]:
    """The asset from two sides under lights that nothing was trained on; the view in 3-D has a third one, preview.png's.

    Args: bounces: of light between surfaces, which the view in 3-D shows none of.
    """
    used = look.scene.vertices[np.unique(look.scene.triangles)].astype(np.float64)
    lights, places = (dusk(), softbox()), [camera(used, *view) for view in SHOT_VIEWS.values()]
    cached_light_set(lights)  # once, not in every thread
    look = look.under(lights, bounces)
    sides = in_parallel(lambda c2w: draw_views(look, lights, c2w, size), places)
    return [
        Shot(f"{light.name.capitalize()}, {name}", srgb_encode(picture.over(backdrop(size))))
        for light, pictures in zip(lights, zip(*sides, strict=True), strict=True)
        for name, picture in zip(SHOT_VIEWS, pictures, strict=True)
    ]


@functools.cache
def suspects(names: tuple[str, ...]) -> list[Environment]:
    """The first lights of distillation, as far as they are the project's own."""
    known = [BUILTIN[name]() for name in names if name in BUILTIN]
    return known[:SUSPECTS] or [BUILTIN["overcast"]()]


@functools.cache
def page_light() -> PageLight:
    """preview.png's light for a rasteriser."""
    rest, lamp = split_lamp(preview_light().radiance)
    harmonics = cosine_harmonics(rest)
    return PageLight(mip_levels(rest), harmonics, lamp.towards, lamp.power, lamp.spread, EXPOSURE)


def first_view(scene: Scene) -> PageView:
    """The first view of preview.png, at the distance from which the object fills the picture from any side."""
    used = scene.vertices[np.unique(scene.triangles)].astype(np.float64)
    azimuth, elevation = VIEWS[1]
    distances = [np.linalg.norm(camera(used, a, e)[:3, 3] - (used.min(0) + used.max(0)) / 2) for a, e in VIEWS]
    return PageView(azimuth, elevation, float(FOV_Y), float(max(distances)), (GROUND, BACKDROP))


def how_made(mesh: Artifact, made: Provenance) -> dict[str, str]:
    """How the asset was made, in words."""
    said = made.extra
    guidance = dict(said["guidance"])
    name = str(guidance.pop("name", ""))
    found = {key: value for key, value in said["findings"].items() if isinstance(value, int | float) and value}
    options = {**mesh.provenance.options, **said["distilled_with"]}
    chosen = ("quality", "steps", "views", "up", "uv", "padding", "texture_size", "crease_angle")
    edits = {"Edits": "; ".join(said["edited"]["list"])} if "edited" in said else {}
    parts = "; ".join(f"{part['name']}: {part['prompt']}" for part in said.get("parts", ()))
    return {
        "Prompt": str(said["prompt"] or "none"),
        **({"Parts": parts} if parts else {}),
        **edits,
        "Seed": str(made.seed),
        "Guidance": ", ".join([name, *(f"{key} {value[:12]}" for key, value in guidance.items() if isinstance(value, str))]),
        "Lights": ", ".join(said["environments"]) or "none",
        **({"Light between surfaces": f"{said['bounces']} bounces"} if said.get("bounces") else {}),
        "UVs": "the source's own" if said["uv_kept"] else "made new",
        "Material slots": ", ".join(slot or "(unnamed)" for slot in said["material_slots"]),
        "Found in the mesh": ", ".join(f"{key.replace('_', ' ')} {value:,}" for key, value in found.items()) or "nothing",
        "Options": ", ".join(f"{key.replace('_', ' ')} {options[key]}" for key in chosen if options.get(key) is not None),
        "Made from": ", ".join(f"{role} {digest[:12]}" for role, digest in mesh.provenance.inputs.items()),
        "Versions": ", ".join(f"{package} {version(package)}" for package in PACKAGES),
    }


def version(package: str) -> str:
    """Of an installed package."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:  # dreammat itself, run from a source tree
        return "(source tree)"
