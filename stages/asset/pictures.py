"""Pictures and the model as files of an export."""

import shutil
from pathlib import Path

from numpy.typing import NDArray

from stages.asset.folder import MODEL, Asset
from stages.asset.read_glb import Picture
from stages.core.images import write_png


def copy_model(asset: Asset, out: Path) -> str:
    """The GLB as it is. Returns: the file's name."""
    shutil.copyfile(asset.folder / MODEL, out / f"{asset.name}.glb")
    return f"{asset.name}.glb"


def copy_picture(path: Path, picture: Picture) -> str:
    """A picture's own bytes. Args: path: without suffix. Returns: the file's name."""
    path = path.with_name(path.name + picture.suffix)
    path.write_bytes(picture.data)
    return path.name


def write_pixels(path: Path, pixels: NDArray) -> str:
    """A PNG. Returns: the file's name."""
    write_png(path, pixels)
    return path.name


def write_pictures(asset: Asset, out: Path) -> dict[str, dict[str, str]]:
    """The pictures as files. Returns: of each stem, role -> path relative to `out`."""
    folder = out / "textures"
    folder.mkdir()
    written: dict[str, dict[str, str]] = {}
    for stem, look in asset.stems():
        files: dict[str, str] = {}
        for role in ("albedo", "normal", "emission"):
            if role in look.pictures:
                files[role] = f"textures/{copy_picture(folder / f'{stem}_{role}', look.pictures[role])}"
        files["orm"] = f"textures/{write_pixels(folder / f'{stem}_orm.png', look.packed())}"
        written[stem] = files
    return written
