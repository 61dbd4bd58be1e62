"""The swatch stage: a prompt in, a folder with the tiling maps of its material and a preview out. No mesh is needed."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.asset.eight_bits import to_8bit
from stages.asset.maps import Maps
from stages.asset.textures import write_textures
from stages.core.artifact import (
    Provenance,
    Schema,
    peek,
    plain_options,
    read_manifest,
    run_log,
    sha256_file,
    write_manifest,
)
from stages.core.images import RUNS, write_png
from stages.core.parallel import beside, cores
from stages.core.progress import Progress, silent
from stages.material.directions import WHOLE
from stages.material.library import Library, hashes
from stages.material.masks import settled
from stages.material.recipe import Recipe
from stages.material.surface import Surface
from stages.material.swatch import swatch
from stages.prior.explain import HEADINGS, explained
from stages.prior.prompt import read_prompt
from stages.prior.vocabulary import WEIGHTS_FILE, ShippedWords
from stages.swatch.kernels import tile_normals
from stages.swatch.options import SwatchOptions
from stages.swatch.render import preview

SWATCH = Schema("dreammat.swatch", 1, manifest="swatch.json")
"""A folder: albedo, roughness, metallic, normal, height as .exr and .png, orm.png; preview.png; swatch.json."""

SETTLED_AT = 128
"""Points along an edge of the square on which masks are settled."""


@dataclass(frozen=True)
class SwatchResult:
    """What was made. up_to_date: nothing had to be done. report: `extra` of swatch.json."""

    folder: Path
    up_to_date: bool
    files: list[str]
    report: dict[str, Any]


def make_swatch(out: Path, options: SwatchOptions, force: bool = False, progress: Progress = silent) -> SwatchResult:
    """Write the maps of a prompt's material. Raises: InputError, ArtifactError, OutputError."""
    library = Library(options.library) if options.library else None
    read = read_prompt(options.prompt, ShippedWords(), options.seed, options.metres, library)
    scans = library.used({coat.look for coat in read.coats}) if library else {}
    chosen = plain_options(options)
    del chosen["library"]
    wanted = Provenance(chosen, options.seed, {"prior": sha256_file(WEIGHTS_FILE), **hashes(scans)})
    known = peek(out, SWATCH)
    if known and known.same_request(wanted) and not force:
        return SwatchResult(out, True, sorted(read_manifest(out, SWATCH)[1]), known.extra)
    with run_log(out) as measured:
        recipe = flat(read)
        progress("maps", 0, 1)
        maps = tile(recipe, options.size)
        progress("preview", 0, 1)
        with beside(lambda: write_maps(out, maps)) as written:
            sheet = preview(maps, options.preview_size)
        write_png(out / "preview.png", sheet)
        files = [*written.result(), "preview.png"]
        progress("preview", 1, 1)
        rows = [dict(zip(HEADINGS, row, strict=True)) for row in explained(recipe)]
        report = {"prompt": options.prompt, "understood": rows, "metres": recipe.base.metres, "recipe": recipe.to_json()}
        report |= {"library": scans} if scans else {}
        write_manifest(out, SWATCH, Provenance(wanted.options, wanted.seed, wanted.inputs, report), files)
        measured["texture_size"] = options.size
    return SwatchResult(out, False, sorted(files), report)


def flat(recipe: Recipe) -> Recipe:
    """A recipe settled on a flat, open square, all of it as large as its base."""
    across = (np.arange(SETTLED_AT, dtype=np.float32) + np.float32(0.5)) / SETTLED_AT
    u, v = (a.ravel() for a in np.meshgrid(across, across))
    up = np.broadcast_to(np.array([0, 0, 1], np.float32), (len(u), 3))
    surface = Surface.bare(np.stack([u, v, np.zeros_like(u)], 1), up, 1 / SETTLED_AT)
    layers = tuple(replace(layer, coat=replace(layer.coat, metres=recipe.base.metres)) for layer in recipe.layers)
    return settled(replace(recipe, layers=layers), surface, WHOLE)


def tile(recipe: Recipe, size: int) -> Maps:
    """The maps of a settled recipe, tiling; height in edges of the square."""
    texels = swatch(recipe, size, cores()).texels
    return Maps(texels[..., :5], texels[..., 5], tile_normals(texels[..., 5], texels[..., 3]))


def write_maps(out: Path, maps: Maps) -> list[str]:
    """Write the maps into a folder. Returns: the files' names."""
    out.mkdir(parents=True, exist_ok=True)
    write_png(out / "height.png", height_8bit(maps), RUNS)
    return ["height.png", *write_textures(out, maps, grey=True)]


def height_8bit(maps: Maps) -> NDArray[np.uint8]:
    """The height from its lowest to its highest point, (H, W) bytes; height.exr has it to scale."""
    assert maps.height is not None
    low, high = float(maps.height.min()), float(maps.height.max())
    return to_8bit((maps.height - low) / max(high - low, 1e-12))
