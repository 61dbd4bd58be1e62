"""Every substance as a swatch: contact sheets to look at, and how its contrast lies beside that of real textures."""

import csv
import io
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.core.artifact import write_text
from stages.core.color import luminance, srgb_decode, srgb_encode
from stages.core.errors import InputError
from stages.core.images import labelled, read_image, write_png
from stages.core.parallel import cores
from stages.core.progress import Progress, silent
from stages.material.recipe import Coat, Recipe
from stages.material.substances import LOOKS, METRES
from stages.material.swatch import Swatch, swatch
from stages.report.contrast import SIZE, Contrast, distance, kind, measure, spread
from stages.report.flicker import flicker

CELL = 192
"""Pixels along an edge of a picture of the sheets."""

COLUMNS = 12
TEXELS = 24
"""Texels along an edge of the closest picture."""

FLICKER_SHARE = 1 / 16
"""Of a square's edge: the part on which flicker is measured."""

RAKING = np.array([0.75, 0.5, 0.43])
"""Towards the light of the relief's picture: right, up, out."""


@dataclass(frozen=True)
class Row:
    """One substance. seconds: of its swatch. nearest: of the references, and how far away.

    own: how far away the nearest of its own kinds is, kinds: those. flicker: how much a view changes with the textures' size.
    """

    name: str
    seconds: float
    contrast: Contrast
    nearest: str = ""
    distance: float = float("nan")
    own: float = float("nan")
    kinds: tuple[str, ...] = ()
    flicker: float = float("nan")


def report_materials(out: Path, references: Path | None, progress: Progress = silent) -> list[Row]:
    """Write whole.png, raking.png, close.png and materials.csv into the folder `out`.

    Args:
        references: a folder of real sets, NAME_01/basecolor.png each, to measure beside.
    Raises: InputError, OutputError.
    """
    known = {} if references is None else read_references(references)
    scale = spread(known) if known else np.ones(0)
    rows: list[Row] = []
    cells: dict[str, list[NDArray[np.float32]]] = {"whole": [], "raking": [], "close": []}
    for number, name in enumerate(LOOKS):
        progress("swatches", number, len(LOOKS))
        begun = time.perf_counter()
        made = swatch(Recipe(Coat(name, metres=METRES[name])), 2 * SIZE, cores(), supersample=1)
        small = halved(made)
        seconds = time.perf_counter() - begun
        contrast = measure(luminance(small.albedo), small.roughness, small.height)
        steady = flicker(name, FLICKER_SHARE, supersample=2, relief=0.0)
        rows.append(replace(placed(name, seconds, contrast, known, scale), flicker=steady))
        for sheet, picture in pictures(made).items():
            cells[sheet].append(labelled(picture, name))
    progress("swatches", len(LOOKS), len(LOOKS))
    out.mkdir(parents=True, exist_ok=True)
    for sheet, drawn in cells.items():
        write_png(out / f"{sheet}.png", tiled(drawn))
    write_text(out / "materials.csv", table(rows))
    return rows


def read_references(folder: Path) -> dict[str, Contrast]:
    """Contrast of each set of a folder. Raises: InputError where it holds none."""
    known = {}
    for path in sorted(folder.glob("*/basecolor.png")):
        color = srgb_decode(read_image(path)[..., :3].astype(np.float64))
        step = len(color) // SIZE
        if step:
            whole = color[: SIZE * step, : SIZE * step].reshape(SIZE, step, SIZE, step, 3).mean((1, 3))
            known[path.parent.name] = measure(luminance(whole))
    if len({kind(name) for name in known}) == len(known):
        raise InputError(f"{folder}: {len(known)} real sets; expected folders NAME_01, NAME_02, … with a basecolor.png each")
    return known


def placed(name: str, seconds: float, contrast: Contrast, known: dict[str, Contrast], scale: NDArray) -> Row:
    """A substance among the references."""
    if not known:
        return Row(name, seconds, contrast)
    away = {other: distance(contrast, found, scale) for other, found in known.items()}
    nearest = min(away, key=lambda other: away[other])
    own = {other: d for other, d in away.items() if kind(other) in kinds(name)}
    least = min(own.values(), default=float("nan"))
    return Row(name, seconds, contrast, nearest, away[nearest], least, tuple(sorted({kind(other) for other in own})))


KIN = {
    "wood": ("oak", "walnut", "pine", "cherry", "mahogany", "maple", "birch", "ebony", "teak", "cedar"),
    "metal": ("steel", "iron", "aluminium"), "weave": ("fabric", "canvas", "linen"),
}  # fmt: skip
"""Kinds of references, and substances of them whose names do not say so."""


def kinds(name: str) -> set[str]:
    """Kinds of references to which a substance may be compared."""
    words = set(name.split())
    return words | {kind for kind, kin in KIN.items() if words & set(kin)}


def by_kind(rows: list[Row]) -> dict[str, float]:
    """Distance to the nearest real set of each kind, the median of the substances that are of it."""
    found: dict[str, list[float]] = {}
    for row in rows:
        for one in row.kinds:
            found.setdefault(one, []).append(row.own)
    return {one: float(np.median(distances)) for one, distances in found.items()}


def halved(made: Swatch) -> Swatch:
    """The same at half the texels along each edge."""
    size = len(made.texels) // 2
    return Swatch(made.texels.reshape(size, 2, size, 2, -1).mean((1, 3)))


def pictures(made: Swatch) -> dict[str, NDArray[np.float32]]:
    """Encoded pictures (CELL, CELL, 3): whole, a hand's breadth of it in raking light, and its texels."""
    size = len(made.albedo)
    step = size // CELL
    whole = made.albedo[: CELL * step, : CELL * step].reshape(CELL, step, CELL, step, 3).mean((1, 3))
    part = slice(0, CELL)
    right = (np.roll(made.height, -1, 1) - np.roll(made.height, 1, 1)) * (size / 2)
    up = (np.roll(made.height, 1, 0) - np.roll(made.height, -1, 0)) * (size / 2)
    normal = np.stack([-right, -up, np.ones_like(right)], -1)[part, part]
    lit = np.clip(normal @ (RAKING / np.linalg.norm(RAKING)) / np.linalg.norm(normal, axis=-1), 0, 1)
    raking = made.albedo[part, part] * (0.25 + 1.5 * lit[..., None])
    close = np.kron(made.albedo[:TEXELS, :TEXELS], np.ones((CELL // TEXELS, CELL // TEXELS, 1), np.float32))
    return {name: srgb_encode(color) for name, color in {"whole": whole, "raking": raking, "close": close}.items()}


def tiled(cells: list[NDArray[np.float32]]) -> NDArray[np.float32]:
    """Pictures in rows of `COLUMNS`."""
    missing = -len(cells) % COLUMNS
    filled = [*cells, *[np.zeros_like(cells[0])] * missing]
    return np.concatenate([np.concatenate(filled[k : k + COLUMNS], 1) for k in range(0, len(filled), COLUMNS)], 0)


def table(rows: list[Row]) -> str:
    """All rows as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = "substance seconds slope finest patchiness with_roughness with_height flicker nearest distance own"
    writer.writerow(names.split())
    for row in rows:
        c = row.contrast
        figures = (row.seconds, c.slope, c.deviation[0], c.patchiness, c.with_roughness, c.with_height, row.flicker)
        writer.writerow([row.name, *(f"{x:.4g}" for x in figures), row.nearest, f"{row.distance:.3g}", f"{row.own:.3g}"])
    return text.getvalue()


def summary(rows: list[Row]) -> list[str]:
    """What all of it comes to, for people."""
    slopes = np.array([row.contrast.slope for row in rows])
    related = [np.nanmax(np.abs([row.contrast.with_roughness, row.contrast.with_height, 0.0])) for row in rows]
    lines = [
        f"{len(rows)} substances; slope of contrast an octave {np.median(slopes):.2f} in the median, "
        f"{np.mean((slopes >= -0.7) & (slopes <= 0.05)):.0%} in -0.7 … 0.05",
        f"luminance goes with roughness or height (over 0.3) in {np.mean(np.array(related) > 0.3):.0%}",
    ]
    flickers = np.array([row.flicker for row in rows])
    lines.append(f"textures of 1024² and 4096² look alike to 1 % RMSE in {np.mean(flickers <= 0.01):.0%}")
    own = np.array(list(by_kind(rows).values()))
    if len(own):
        lines.append(
            f"distance to the nearest real set of the kind: {np.median(own):.2f} in the median of {len(own)} kinds, "
            f"{np.mean(own <= 1.1):.0%} within 1.1"
        )
    return lines
