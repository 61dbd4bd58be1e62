"""Textures six public meshes and puts them in one picture: python examples/gallery.py MESHES OUT.jpg

MESHES holds the files named below, fetched from their repositories on GitHub. What is made stays beside OUT, so another run
is quick.
"""

import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import OpenImageIO as oiio


class Piece(NamedTuple):
    """One picture. view: its place in preview.png, row and column."""

    file: str
    source: str
    licence: str
    prompt: str
    view: tuple[int, int]


PIECES = (
    Piece("skull.obj", "odedstein/meshes", "CC BY 3.0", "weathered bronze with verdigris in the crevices", (0, 1)),
    Piece("armchair.obj", "NVIDIAGameWorks/kaolin", "CC BY 4.0", "brown leather armchair, walnut feet", (0, 1)),
    Piece("spot.obj", "odedstein/meshes", "public domain", "white porcelain with cobalt stripes", (0, 1)),
    Piece("gazebo.obj", "jpcy/xatlas", "MIT", "white painted wood, slate roof, old brick base", (0, 0)),
    Piece("plane_holes.obj", "odedstein/meshes", "CC BY 3.0", "olive green paint chipping off aluminium", (0, 3)),
    Piece("trellis_T.ply", "microsoft/TRELLIS", "MIT", "old oak with rusty iron edges", (0, 1)),
)

PIXELS = 512


def main(meshes: Path, out: Path) -> None:
    """Make all and write the picture, three in a row."""
    tiles = [tile(piece, meshes, out.parent) for piece in PIECES]
    rows = [np.concatenate(tiles[i : i + 3], 1) for i in range(0, len(tiles), 3)]
    picture = np.concatenate(rows, 0)
    spec = oiio.ImageSpec(picture.shape[1], picture.shape[0], 3, "uint8")
    spec["jpeg:quality"] = 90
    file = oiio.ImageOutput.create(str(out))
    if not (file and file.open(str(out), spec) and file.write_image(np.ascontiguousarray(picture)) and file.close()):
        sys.exit(f"{out}: cannot be written")


def tile(piece: Piece, meshes: Path, folder: Path) -> np.ndarray:
    """One view of one piece, (PIXELS, PIXELS, 3) uint8."""
    job = folder / Path(piece.file).stem
    command = [sys.executable, "-m", "dreammat_cli", "run", str(meshes / piece.file), "--prompt", piece.prompt, "-o", str(job)]
    subprocess.run([*command, "--with", "conditions", "--views 32", "--with", "bake", f"--preview-size {PIXELS}"], check=True)
    pixels = oiio.ImageBuf(str(job / "asset/preview.png")).get_pixels(oiio.UINT8)
    row, column = piece.view
    return pixels[row * PIXELS : (row + 1) * PIXELS, column * PIXELS : (column + 1) * PIXELS, :3]


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2]))
