"""report.html: the asset in one file that opens from disk and asks nobody for anything.

A page of HTML with its style, a viewer in WebGL 2, pictures as WebP, and one deflated block with the geometry and the light.
What is said of the asset (`Check`, `Shot`, facts) is the caller's; how it is shown is here and in page/.
"""

import base64
import html
import json
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.asset.read_glb import Look, TexturedModel, eight_bit, read_model, resized
from stages.asset.report_mesh import page_mesh
from stages.asset.report_view import PageLight, box, groups, light_data, packed
from stages.asset.webp import encode_webp
from stages.core.artifact import sha256_file, write_text
from stages.core.parallel import in_parallel

PICTURE_SIZE, FEW = 1024, 4
"""Longest edge of a map in the page, pixels, of so many texture sets; of more, all together have as many."""

QUALITY = {"albedo": 90, "shot": 88}
"""Of lossy pictures; other maps take DATA_QUALITY, which leaves them within a few steps of 255."""

DATA_QUALITY = 94

CHECKER = 16
"""Texels of the whole texture along a square of the checker view, times 4 squares a tint: 16 texels at any size."""

SHOWN = ("shaded", "albedo", "roughness", "metallic", "normal", "occlusion", "checker")
"""What the view can show, in the order of viewer.js's numbers."""


@dataclass(frozen=True)
class Check:
    """One thing that a lead artist looks at. state: "good", "look" (closer) or "fact". note: what is expected, and why."""

    name: str
    value: str
    state: str
    note: str


@dataclass(frozen=True)
class Shot:
    """A picture of the asset: (H, W, 3) sRGB in [0, 1]."""

    caption: str
    pixels: NDArray[np.float32]


@dataclass(frozen=True)
class PageView:
    """How the view begins. azimuth, elevation: degrees. fov_y: radians. greys: linear, of the backdrop's bottom and top."""

    azimuth: float
    elevation: float
    fov_y: float
    distance: float
    greys: tuple[float, float]


@dataclass(frozen=True)
class Page:
    """What the page says. facts: how the asset was made. licences: whose work is in it."""

    name: str
    prompt: str
    meta: str
    checks: list[Check]
    shots: list[Shot]
    facts: dict[str, str]
    licences: list[str]
    light: PageLight
    view: PageView


def write_page(path: Path, page: Page, files: list[str]) -> None:
    """Write report.html beside the files that it describes, model.glb among them. Args: files: names, to be listed."""
    model = read_model(path.parent / "model.glb")
    looks = distinct(model)
    mesh, count = page_mesh(model)
    streams, blob = packed(mesh, page.light)
    sets = [maps_of(look, max(int(PICTURE_SIZE * (FEW / max(len(looks), FEW)) ** 0.5), 32)) for look in looks]
    data = {
        "streams": streams,
        "groups": groups(mesh, [looks.index(first_like(look, looks)) for look in model.looks]),
        "sets": [{"normal": "normal" in look.pictures, "normal_scale": look.normal_scale} for look in looks],
        "mesh": box(mesh),
        "light": light_data(page.light),
        "view": {
            "azimuth": page.view.azimuth, "elevation": page.view.elevation, "fov": page.view.fov_y,
            "distance": page.view.distance, "ground": page.view.greys[0], "backdrop": page.view.greys[1],
            "checker": sets[0].width / CHECKER,
        },
    }  # fmt: skip
    there = {name for maps in sets for name in maps.uris} | {"shaded", "normal", "checker"}
    shown = "" if len(mesh.triangles) == count else f"Simplified here to {len(mesh.triangles):,} of {count:,} triangles."
    room = resources.files("stages.asset") / "page"
    fill(
        path,
        (room / "page.html").read_text(encoding="utf-8"),
        title=html.escape(f"{page.name}: {page.prompt}" if page.prompt else page.name),
        name=html.escape(page.name),
        prompt=f'<p class="prompt">“{html.escape(page.prompt)}”</p>' if page.prompt else "",
        meta=html.escape(page.meta),
        shown=html.escape(shown),
        choices=choices([name for name in SHOWN if name in there]),
        checks="\n".join(map(check_row, page.checks)),
        sections="\n".join([shots(page.shots), gallery(looks, sets), file_table(path.parent, files), made_by(page)]),
        data=json.dumps(data, allow_nan=False).replace("<", "\\u003c"),
        blob=base64.b64encode(blob).decode(),
        style=(room / "page.css").read_text(encoding="utf-8"),
        script=(room / "viewer.js").read_text(encoding="utf-8"),
    )


def fill(path: Path, template: str, **parts: str) -> None:
    """Put the parts in the places {{name}} of the template, in one pass, and write the file."""
    pieces = template.split("{{")
    text = pieces[0]
    for piece in pieces[1:]:
        name, rest = piece.split("}}", 1)
        text += parts[name] + rest
    write_text(path, text)


# ---------------------------------------------------------------------------------------------------- the maps


def distinct(model: TexturedModel) -> list[Look]:
    """One look for each set of pictures."""
    found: list[Look] = []
    for look in model.looks:
        if first_like(look, found) is None:
            found.append(look)
    return found


def first_like(look: Look, among: list[Look]) -> Any:
    """The first look with the same pictures, or None."""
    return next((other for other in among if other.pictures == look.pictures), None)


@dataclass(frozen=True)
class Maps:
    """The maps of a look. uris: each as a data URI. width: texels of the albedo, in the file."""

    uris: dict[str, str]
    width: int


def maps_of(look: Look, size: int) -> Maps:
    """Each map of a look, at most so many texels wide."""
    orm = look.packed()
    albedo = eight_bit(look.pictures["albedo"].pixels())[..., :3]
    pixels = {"albedo": albedo, "roughness": orm[..., 1:2], "metallic": orm[..., 2:3]}
    if "occlusion" in look.pictures:
        pixels["occlusion"] = orm[..., 0:1]
    if "normal" in look.pictures:
        pixels["normal"] = eight_bit(look.pictures["normal"].pixels())[..., :3]
    uris = in_parallel(lambda name: image(rgb(small(pixels[name], size)), QUALITY.get(name, DATA_QUALITY)), pixels)
    return Maps(dict(zip(pixels, uris, strict=True)), albedo.shape[1])


def small(pixels: NDArray[np.uint8], size: int) -> NDArray[np.uint8]:
    """At most so many pixels along an edge."""
    height, width = pixels.shape[:2]
    share = min(1.0, size / max(height, width))
    return resized(pixels, max(1, round(width * share)), max(1, round(height * share)))


def rgb(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(H, W, 3) of (H, W, 1) or (H, W, 3)."""
    return np.repeat(pixels, 3, 2) if pixels.shape[2] == 1 else pixels


def image(pixels: NDArray[np.uint8], quality: int) -> str:
    """A data URI."""
    return "data:image/webp;base64," + base64.b64encode(encode_webp(pixels, quality)).decode()


# ---------------------------------------------------------------------------------------------------- HTML


def choices(names: list[str]) -> str:
    """The switch of what is shown."""
    row = '<label><input type="radio" name="shown" value="{}"{}><span>{}</span></label>'
    return "".join(row.format(SHOWN.index(n), " checked" if n == "shaded" else "", n.capitalize()) for n in names)


def check_row(check: Check) -> str:
    """One line of the checks."""
    spoken = {"good": "fine", "look": "look closer", "fact": ""}[check.state]
    title = f' title="{spoken}"' if spoken else ""
    return (
        f'<div class="check {check.state}"{title}><span>{html.escape(check.name)}</span>'
        f'<span class="value">{html.escape(check.value)}</span><span class="note">{html.escape(check.note)}</span></div>'
    )


def shots(pictures: list[Shot]) -> str:
    """Pictures under other lights."""
    figure = '<figure><img src="{}" alt="{}"><figcaption>{}</figcaption></figure>'
    encoded = [(image((np.clip(s.pixels, 0, 1) * 255 + 0.5).astype(np.uint8), QUALITY["shot"]), s) for s in pictures]
    body = "".join(figure.format(uri, *[html.escape(s.caption)] * 2) for uri, s in encoded)
    return f'<section><h2>Under lights it was never trained on</h2><div class="grid shots">{body}</div></section>'


def gallery(looks: list[Look], sets: list[Maps]) -> str:
    """The maps, from which the view takes its textures too."""
    notes = {"albedo": "base colour, sRGB", "roughness": "linear", "metallic": "linear", "occlusion": "linear",
             "normal": "tangent space, +Y"}  # fmt: skip
    figures = []
    for number, (look, maps) in enumerate(zip(looks, sets, strict=True)):
        slot = f"{html.escape(look.name)}: " if len(looks) > 1 else ""
        for name, uri in maps.uris.items():
            note = f"{notes[name]}; {maps.width:,} texels wide in the file"
            figures.append(
                f'<figure class="map"><img data-map="{name}" data-set="{number}" src="{uri}" alt="{name} map">'
                f"<figcaption>{slot}{name}<small>{note}</small></figcaption></figure>"
            )
    return f'<section><h2>Maps</h2><div class="grid">{"".join(figures)}</div></section>'


def file_table(folder: Path, files: list[str]) -> str:
    """Files with sizes and hashes."""
    row = '<tr><td>{}</td><td class="number">{:,.2f} MiB</td><td><code>{}</code></td></tr>'
    sizes = {name: (folder / name).stat().st_size / 2**20 for name in sorted(files)}
    body = "".join(row.format(html.escape(name), size, sha256_file(folder / name)) for name, size in sizes.items())
    head = '<tr><th>File</th><th class="number">Size</th><th>SHA-256</th></tr>'
    return f"<section><h2>Files</h2><table>{head}{body}</table></section>"


def made_by(page: Page) -> str:
    """How the asset was made, and whose work is in it."""
    facts = "".join(f"<dt>{html.escape(name)}</dt><dd>{html.escape(value)}</dd>" for name, value in page.facts.items())
    licences = "".join(f"<p>{html.escape(line)}</p>" for line in page.licences)
    return (
        f'<div class="two"><section><h2>How it was made</h2><dl>{facts}</dl></section>'
        f'<section class="licences"><h2>Licences</h2>{licences}</section></div>'
    )
