"""Textures six public meshes and puts them in one picture: python examples/gallery.py MESHES OUT.jpg

MESHES is a folder that holds the files named below, fetched from their repositories on GitHub. What is made stays by OUT, so
another run is quick.
"""

import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray


class Piece(NamedTuple):
    """One picture. view: its place in preview.png, row and column. parts: what some parts are made of, by their names."""

    file: str
    source: str
    licence: str
    prompt: str
    view: tuple[int, int]
    parts: tuple[tuple[str, str], ...] = ()


ENAMEL = "teal enamel chipping off iron"

PIECES = (
    Piece("vintage_fan.glb", "BabylonJS/MeshesLibrary", "CC BY 4.0", "polished brass", (0, 1),
          (("fanBase_low", ENAMEL), ("#6", ENAMEL), ("fanBlade_low", "polished copper"))),
    Piece("bob_uv.obj", "NVlabs/nvdiffrec", "CC0", "weathered bronze with verdigris in the crevices", (0, 1)),
    Piece("armchair.obj", "NVIDIAGameWorks/kaolin", "CC BY 4.0", "black steel", (0, 1),
          (("M_Armchair_Cushions", "worn brown leather"),)),
    Piece("spot.obj", "odedstein/meshes", "public domain", "white porcelain with cobalt stripes", (1, 1)),
    Piece("plane_holes.obj", "odedstein/meshes", "CC BY 3.0", "olive green paint chipping off aluminium", (0, 3)),
    Piece("skull.obj", "odedstein/meshes", "CC BY 3.0", "white marble with veins of gold", (0, 1)),
)  # fmt: skip

DRAWN, PIXELS = 480, 420
"""Side of a view as it is drawn, and as it is shown."""

MARGIN = 0.06
"""Free on each side of an object, as a share of its picture."""


def main(meshes: Path, out: Path) -> None:
    """Make all and write the picture, three in a row."""
    tiles = [framed(view_of(piece, meshes, out.parent)) for piece in PIECES]
    picture = np.concatenate([np.concatenate(tiles[row : row + 3], 1) for row in range(0, len(tiles), 3)], 0)
    buffer = oiio.ImageBuf(np.ascontiguousarray(picture))
    buffer.specmod()["jpeg:quality"] = 88
    if not buffer.write(str(out)):
        sys.exit(f"{out}: cannot be written ({buffer.geterror()})")


def view_of(piece: Piece, meshes: Path, folder: Path) -> NDArray[np.uint8]:
    """One view of a piece, (DRAWN, DRAWN, 3)."""
    mesh = next(meshes.rglob(piece.file), None)
    if mesh is None:
        sys.exit(f"{meshes}: has no {piece.file}; get it from https://github.com/{piece.source}")
    job = folder / mesh.stem
    parts = " ".join(f"--part '{name}' '{words}'" for name, words in piece.parts)
    options = {"conditions": "--views 16 --size 128", "distill": parts, "bake": f"--size 1024 --preview-size {DRAWN}"}
    with_options = [word for stage, text in options.items() for word in ("--with", stage, text)]
    command = [sys.executable, "-m", "dreammat_cli", "run", str(mesh), "--prompt", piece.prompt, "-o", str(job), *with_options]
    subprocess.run(command, check=True)
    row, column = piece.view
    pixels = oiio.ImageBuf(str(job / "asset/preview.png")).get_pixels(oiio.UINT8)
    return pixels[row * DRAWN : (row + 1) * DRAWN, column * DRAWN : (column + 1) * DRAWN, :3]


def framed(view: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The object in the middle of its picture, as large as fits, (PIXELS, PIXELS, 3). The backdrop has one colour a row."""
    seen = np.abs(view.astype(int) - view[:, :1]).max(2) > 6
    rows, columns = np.flatnonzero(seen.any(1)), np.flatnonzero(seen.any(0))
    side = round(max(np.ptp(rows), np.ptp(columns)) / (1 - 2 * MARGIN))
    top, left = (rows[0] + rows[-1] - side) // 2, (columns[0] + columns[-1] - side) // 2
    wide = np.pad(view, ((side, side), (side, side), (0, 0)), "edge")
    square = wide[top + side : top + 2 * side, left + side : left + 2 * side]
    small = oiio.ROI(0, PIXELS, 0, PIXELS, 0, 1, 0, 3)
    return oiio.ImageBufAlgo.resize(oiio.ImageBuf(np.ascontiguousarray(square)), roi=small).get_pixels(oiio.UINT8)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2]))
