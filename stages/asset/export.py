"""`dreammat export`: an asset written for one program, complete or not at all.

Files are made in a temporary folder beside the target and moved when all are there, the manifest last.
"""

import contextlib
import errno
import importlib
import importlib.util
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from stages.asset.folder import Asset, read_asset
from stages.asset.options import ExportOptions
from stages.asset.pictures import copy_model
from stages.core.artifact import Provenance, Schema, peek, plain_options, read_manifest, reason, write_manifest
from stages.core.errors import InputError, OutputError
from stages.core.progress import Progress, silent
from stages.core.schemas import EXPORT

EXTRAS = {"web": ("DracoPy", "DracoPy"), "usd": ("pxr", "usd-core"), "materialx": ("MaterialX", "materialx")}
"""Extra of this package -> the module that it brings, and the name under which that is installed."""

AS_IT_IS = ("blender", "three", "godot")
"""Targets that show model.glb as it is meant."""


@dataclass(frozen=True)
class ExportResult:
    """What was written. sizes: bytes of each file."""

    folder: Path
    up_to_date: bool
    sizes: dict[str, int]


def export(
    asset: Path, out: Path, options: ExportOptions, force: bool = False, progress: Progress = silent
) -> ExportResult:
    """Write an asset for a target.

    Args:
        asset: a folder that `bake` wrote. out: the folder to make; what an earlier export left there is replaced.
        force: write even when the folder holds the result of the same request.
    Raises: ArtifactError, InputError when a package is missing, OutputError.
    """
    opened = read_asset(asset)
    wanted = Provenance(plain_options(options), None, {"asset": opened.sha256})
    known = peek(out, EXPORT) if out.is_dir() else None
    if known and known.same_request(wanted) and not force:
        return ExportResult(out, True, sizes_of(out, sorted(read_manifest(out, EXPORT)[1])))
    write = writer(options.target)
    progress(f"export for {options.target}", 0, 1)
    with made_beside(out) as scratch:
        files = write(opened, scratch)
        write_manifest(scratch, EXPORT, wanted, files)
        move_into(scratch, out, files, EXPORT)
    progress(f"export for {options.target}", 1, 1)
    return ExportResult(out, False, sizes_of(out, files))


def writer(target: str) -> Callable[[Asset, Path], list[str]]:
    """The function that writes for a target. Raises: InputError when the package it needs is not installed."""
    if target in EXTRAS:
        module, package = EXTRAS[target]
        if importlib.util.find_spec(module) is None:
            raise InputError(f'dreammat export --for {target}: needs {package}, not installed here; pip install ".[{target}]"')
    if target in AS_IT_IS:
        return lambda asset, out: [copy_model(asset, out)]
    room = importlib.import_module(f"stages.asset.{'engines' if target not in EXTRAS else target}")
    return getattr(room, f"write_{target.replace('-', '_')}")


def sizes_of(folder: Path, files: list[str]) -> dict[str, int]:
    """Bytes of each file."""
    return {name: (folder / name).stat().st_size for name in files}


@contextlib.contextmanager
def made_beside(out: Path) -> Iterator[Path]:
    """A temporary folder beside `out`, gone afterwards. Raises: OutputError for whatever the file system refuses."""
    scratch = None
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(prefix=f".{out.name}.", suffix=".tmp", dir=out.parent))
        scratch.chmod(0o777 & ~_umask())
        yield scratch
    except OSError as error:
        hint = "; free some space and run the same command again" if error.errno == errno.ENOSPC else ""
        raise OutputError(f"{out}: cannot be written: {reason(error)}{hint}") from error
    finally:
        if scratch:
            shutil.rmtree(scratch, ignore_errors=True)


def move_into(scratch: Path, out: Path, files: list[str], schema: Schema) -> None:
    """Put finished files in their place: the folder at once where there is none, else file by file, manifest last.

    What an earlier folder of the same schema had besides goes when the new files are there.

    Raises: OutputError where a file in the way is another's.
    """
    if not out.exists():
        os.rename(scratch, out)
        return
    old = read_manifest(out, schema)[1] if peek(out, schema) else {}
    foreign = next((name for name in files if name not in old and (out / name).exists()), None)
    if foreign or not out.is_dir():
        raise OutputError(f"{out / (foreign or '')}: is there and not this command's; move it, or give another folder")
    (out / schema.manifest).unlink(missing_ok=True)
    for name in files:
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        os.replace(scratch / name, out / name)
    for name in set(old) - set(files):
        (out / name).unlink(missing_ok=True)
    os.replace(scratch / schema.manifest, out / schema.manifest)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
