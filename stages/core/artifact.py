"""Artefacts: the NPZ and EXR files that stages hand each other. No other module knows either format.

An artefact says what it is (schema name and version), what it was made with (options, seed) and from (SHA-256 of
each input). Its bytes are a function of exactly these: seconds and memory go to a run log beside it, `<name>.run.json`,
so that the same inputs give the same hash on every run. Files are written under a temporary name in the same folder and
renamed, so a reader, or Make, never sees half a file. A folder artefact is complete when its `manifest.json` is there,
which is written last.
"""

import contextlib
import dataclasses
import errno
import hashlib
import json
import os
import re
import resource
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import OpenImageIO as oiio
from numpy.typing import NDArray

from stages.core.archive import UNREADABLE, ForeignMember, read_member, read_members
from stages.core.errors import ArtifactError, InputError, OutputError, one_line

MANIFEST = "manifest.json"
SEAL = "sha256"
"""The manifest's key for the hash of all its other content."""

oiio.attribute("threads", 1)  # who reads files has threads of their own


@dataclass(frozen=True)
class Field:
    """One array of an artefact.

    dtype: NumPy dtype string, such as "f4". shape: sizes; a letter stands for any size, the same wherever it recurs.
    rows_of: where the values are row numbers, the letter of the size that they stay below. least: the smallest of them.
    """

    dtype: str
    shape: tuple[int | str, ...]
    finite: bool = True
    rows_of: str = ""
    least: int = 0


@dataclass(frozen=True)
class Schema:
    """Name, version and arrays of an artefact; `extra` names the keys that its provenance must carry.

    manifest: the file that completes a folder artefact.
    """

    name: str
    version: int
    fields: Mapping[str, Field] = field(default_factory=dict)
    extra: tuple[str, ...] = ()
    manifest: str = MANIFEST


@dataclass(frozen=True)
class Provenance:
    """What an artefact was made with and from.

    options: the stage's options, JSON types only. inputs: role -> SHA-256 in hex. extra: what the stage has to say
    about its result (JSON types); it must be a function of options, seed and inputs.
    """

    options: dict[str, Any]
    seed: int | None
    inputs: dict[str, str]
    extra: dict[str, Any] = field(default_factory=dict)

    def same_request(self, other: "Provenance") -> bool:
        """Whether both were asked for alike: equal options, seed and inputs."""
        return (self.options, self.seed, self.inputs) == (other.options, other.seed, other.inputs)


@dataclass(frozen=True)
class Artifact:
    """A loaded artefact: its arrays and its provenance."""

    arrays: dict[str, NDArray]
    provenance: Provenance

    def __getitem__(self, name: str) -> NDArray:
        return self.arrays[name]


# ---------------------------------------------------------------------------------------------------- hashing


def sha256_file(path: Path) -> str:
    """SHA-256 of a file's bytes, in hex. Raises: InputError when it cannot be read."""
    digest = hashlib.sha256()
    try:
        with open(path, "rb") as stream:
            while block := stream.read(1 << 20):
                digest.update(block)
    except OSError as error:
        raise InputError(f"{path}: {reason(error)}; give a file that can be read") from error
    return digest.hexdigest()


def plain_options(options: Any) -> dict[str, Any]:
    """A stage's options dataclass as JSON types, ready for `Provenance.options`."""
    return json.loads(json.dumps(dataclasses.asdict(options), default=str))


def reason(error: OSError) -> str:
    """What the operating system says, without path or number."""
    return (error.strerror or str(error)).lower()


# ---------------------------------------------------------------------------------------------------- writing


@contextlib.contextmanager
def written_atomically(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`; rename it on success, remove it on any failure.

    The temporary name keeps the suffix, since some writers choose the format by it. What a killed run left of this
    very file is removed first; should that run be alive after all, its rename fails with an error of its own.

    Raises: OutputError with the cause when the file system refuses.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.tmp{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        leftover = re.compile(rf"\.{re.escape(path.stem)}\.\d+\.tmp{re.escape(path.suffix)}")
        for beside in path.parent.iterdir():
            if leftover.fullmatch(beside.name):
                beside.unlink(missing_ok=True)
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        full = error.errno == errno.ENOSPC
        hint = "free some space and run the same command again" if full else "give a place that can"
        raise OutputError(f"{path}: cannot be written: {reason(error)}; {hint}") from error
    finally:
        with contextlib.suppress(OSError):  # gone when all went well; its folder may never have existed
            temporary.unlink()


def write_text(path: Path, text: str) -> None:
    """Write a UTF-8 text file atomically."""
    with written_atomically(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_json(path: Path, content: Any) -> None:
    """Write a JSON file atomically, keys in the order given, indented by one space."""
    write_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")


def read_json(path: Path) -> Any:
    """The content of a JSON file, or None when there is none that can be read."""
    try:
        return _parsed(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def _parsed(text: str) -> Any:
    """JSON's content. Raises: ValueError, also where brackets are nested without end."""
    try:
        return json.loads(text)
    except RecursionError as error:
        raise ValueError("nested too deeply") from error


def save_npz(path: Path, schema: Schema, arrays: Mapping[str, NDArray], provenance: Provenance) -> None:
    """Write an NPZ artefact atomically; the arrays must fit the schema.

    Raises: OutputError; AssertionError when our own arrays break the schema.
    """
    problem = schema_problem(schema, arrays) or extra_problem(schema, provenance)
    assert problem is None, f"{path}: {problem}"
    header = json.dumps(_header(schema, provenance), allow_nan=False)
    with written_atomically(path) as temporary, open(temporary, "wb") as stream:
        np.savez(stream, header=np.array(header), **dict(arrays), allow_pickle=False)


@contextlib.contextmanager
def run_log(artifact: Path) -> Iterator[dict[str, Any]]:
    """Measure the block and write `<artifact>.run.json` (inside it for a folder): seconds, CPU seconds (with those of processes
    that it started), peak memory, extras.

    Yields: a dict to which the stage adds what else it measured. Nothing is written when the block fails.
    """
    measured: dict[str, Any] = {}
    start, before = time.perf_counter(), sum(os.times()[:4])
    yield measured
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    clocks = {"seconds": time.perf_counter() - start, "cpu_seconds": sum(os.times()[:4]) - before, "peak_memory_gib": peak}
    log = {**{name: round(value, 3) for name, value in clocks.items()}, **measured}
    write_json(artifact / "run.json" if artifact.is_dir() else artifact.with_name(artifact.name + ".run.json"), log)


# ---------------------------------------------------------------------------------------------------- reading


MAKER = {"prep": "prep", "conditions": "conditions", "material": "distill", "asset": "bake", "scene": "prep --split"}
"""The command that writes what is called so."""


def wanted(schema: Schema) -> str:
    """What should be there, and how it is made: "a dreammat.prep artefact, which `dreammat prep` writes"."""
    maker = MAKER.get(schema.name.removeprefix("dreammat."))
    return f"a {schema.name} artefact" + (f", which `dreammat {maker}` writes" if maker else "")


def load_npz(path: Path, schema: Schema) -> Artifact:
    """Read an NPZ artefact and check it against its schema; it takes no more memory than the file has bytes.

    Raises: ArtifactError that says what is wrong with which file.
    """
    try:
        header = read_member(path, "header")
        if header is None:
            raise ArtifactError(f"{path}: not a dreammat artefact; expected {wanted(schema)}")
        provenance = _provenance(path, schema, _parsed(str(header)))
        arrays = read_members(path, {"header", *schema.fields})
    except OSError as error:
        raise ArtifactError(f"{path}: {reason(error)}; expected {wanted(schema)}") from error
    except ForeignMember as error:
        raise ArtifactError(f"{path}: not a {schema.name} artefact: {error}; make it again") from error
    except UNREADABLE as error:
        raise ArtifactError(
            f"{path}: not a readable {schema.name} artefact (damaged, or another kind of file); make it again"
        ) from error
    del arrays["header"]
    problem = schema_problem(schema, arrays) or extra_problem(schema, provenance)
    if problem:
        raise ArtifactError(f"{path}: {problem}; make it again with the stage before")
    return Artifact(arrays, provenance)


def peek(path: Path, schema: Schema) -> Provenance | None:
    """The provenance of an intact artefact (NPZ file or folder), or None when there is none of this schema."""
    try:
        return read_manifest(path, schema)[0] if path.is_dir() else load_npz(path, schema).provenance
    except ArtifactError:
        return None


def expect_input(path: Path, provenance: Provenance, role: str, found: str, found_path: Path) -> None:
    """Check that an artefact was made from the given input.

    Args:
        path, provenance: the artefact. role: the input's name in it. found, found_path: hash and path of what is given.
    Raises: ArtifactError.
    """
    made_from = provenance.inputs.get(role)
    if made_from != found:
        raise ArtifactError(
            f"{path}: made from another {role} ({(made_from or 'none')[:12]}) than {found_path} ({found[:12]}); "
            f"give the {role} it was made from, or make it again"
        )


def schema_problem(schema: Schema, arrays: Mapping[str, NDArray]) -> str | None:
    """The first way in which the arrays break the schema, or None."""
    sizes: dict[str, int] = {}
    for name, spec in schema.fields.items():
        if name not in arrays:
            return f"array '{name}' is missing"
        array = arrays[name]
        if array.dtype != np.dtype(spec.dtype):
            return f"array '{name}' is {array.dtype}, expected {np.dtype(spec.dtype)}"
        expected = tuple(sizes.get(s, s) if isinstance(s, str) else s for s in spec.shape)
        fits = array.ndim == len(expected) and all(
            isinstance(e, str) or e == n for e, n in zip(expected, array.shape, strict=True)
        )
        if not fits:
            return f"array '{name}' has shape {array.shape}, expected {expected}"
        sizes |= {e: n for e, n in zip(expected, array.shape, strict=True) if isinstance(e, str)}
        if spec.finite and array.dtype.kind == "f" and not np.isfinite(array).all():
            return f"array '{name}' holds {int((~np.isfinite(array)).sum())} values that are not finite"
    unknown = set(arrays) - set(schema.fields)
    if unknown:
        return f"array '{sorted(unknown)[0]}' is not part of {schema.name}"
    return next(filter(None, (_row_problem(name, spec, arrays[name], sizes) for name, spec in schema.fields.items())), None)


def _row_problem(name: str, spec: Field, array: NDArray, sizes: Mapping[str, int]) -> str | None:
    """Whether an array that holds row numbers points outside the rows that there are."""
    if not spec.rows_of or not array.size:
        return None
    low, high, count = int(array.min()), int(array.max()), sizes[spec.rows_of]
    wrong = low if low < spec.least else high
    return f"array '{name}' points at row {wrong} of {count}" if low < spec.least or high >= count else None


def extra_problem(schema: Schema, provenance: Provenance) -> str | None:
    """The first key of `schema.extra` that the provenance lacks, as a message, or None."""
    return next((f"'{key}' is missing from the header" for key in schema.extra if key not in provenance.extra), None)


def _header(schema: Schema, provenance: Provenance) -> dict[str, Any]:
    return {"schema": schema.name, "version": schema.version, **dataclasses.asdict(provenance)}


def _provenance(path: Path, schema: Schema, header: Any) -> Provenance:
    if not isinstance(header, dict) or header.get("schema") != schema.name:
        found = header.get("schema") if isinstance(header, dict) else None
        raise ArtifactError(f"{path}: a {found or 'foreign'} artefact, expected {schema.name}; check the paths' order")
    if header.get("version") != schema.version:
        raise ArtifactError(
            f"{path}: {schema.name} version {header.get('version')}, expected {schema.version}; make it again"
        )
    for key, kind in (("options", dict), ("seed", int | None), ("inputs", dict), ("extra", dict)):
        if key not in header or not isinstance(header[key], kind):
            raise ArtifactError(f"{path}: its header has no usable '{key}'; make it again with the stage before")
    return Provenance(**{key: header[key] for key in ("options", "seed", "inputs", "extra")})


# ---------------------------------------------------------------------------------------------------- folders


def write_manifest(folder: Path, schema: Schema, provenance: Provenance, files: list[str]) -> None:
    """Complete a folder artefact: record provenance, the SHA-256 of each of its files (relative paths), and its own."""
    hashes = {name: sha256_file(folder / name) for name in sorted(files)}
    content = {**_header(schema, provenance), "files": hashes}
    write_json(folder / schema.manifest, {**content, SEAL: seal_of(content)})


def read_manifest(folder: Path, schema: Schema) -> tuple[Provenance, dict[str, str]]:
    """Provenance and file hashes of a complete folder artefact whose files are all there.

    Raises: ArtifactError.
    """
    path = folder / schema.manifest
    try:
        header = _parsed(path.read_text(encoding="utf-8"))
    except OSError as error:
        hint = "an interrupted run continues with the same command" if folder.is_dir() else f"expected {wanted(schema)}"
        raise ArtifactError(f"{path}: {reason(error)}; {hint}") from error
    except ValueError as error:
        raise ArtifactError(f"{path}: not readable ({error}); make it again with the stage before") from error
    provenance = _provenance(path, schema, header)
    if header.pop(SEAL, None) != seal_of(header):
        raise ArtifactError(f"{path}: changed since it was written; make it again with the stage before")
    files = header.get("files")
    if not isinstance(files, dict):
        raise ArtifactError(f"{path}: lists no files; make it again with the stage before")
    outside = next((name for name in files if Path(name).is_absolute() or ".." in Path(name).parts), None)
    if outside:
        raise ArtifactError(f"{path}: lists '{outside[:80]}', which is not within the folder; make it again")
    missing = next((name for name in files if not (folder / name).is_file()), None)
    if missing:
        raise ArtifactError(f"{folder / missing}: missing, though the manifest lists it; make it again with --force")
    return provenance, files


def seal_of(content: dict[str, Any]) -> str:
    """SHA-256 of a manifest's content, so that a flipped bit in a name or number does not pass for another request."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def intact(folder: Path, name: str, files: Mapping[str, str]) -> Path:
    """The path of a file of a folder artefact, once its bytes are known to be those that the manifest lists.

    Args:
        files: of `read_manifest`.
    Raises: ArtifactError.
    """
    path = folder / name
    if name not in files:
        raise ArtifactError(f"{path}: not listed in the folder's manifest; make it again with --force")
    try:
        found = sha256_file(path)
    except InputError as error:
        raise ArtifactError(str(error)) from error
    if found != files[name]:
        raise ArtifactError(f"{path}: damaged, its bytes are not those that the manifest lists; make it again with --force")
    return path


# ---------------------------------------------------------------------------------------------------- EXR


def write_exr(
    path: Path,
    channels: Mapping[str, NDArray],
    display: tuple[int, int] | None = None,
    offset: tuple[int, int] = (0, 0),
    attributes: Mapping[str, str] | None = None,
    quickly: bool = False,
) -> None:
    """Write named channels as one scan-line EXR, atomically and without loss.

    By ZIP, or quickly by PIZ: half floats of light in half to two thirds of the time, read in as much, but 2 to 14 % larger.

    Args:
        channels: name -> (h, w) float16 or float32, all of one shape.
        display: (height, width) of the whole image when the channels are a crop of it. offset: (row, column) of
        the crop. attributes: strings for the header.
    """
    h, w = next(iter(channels.values())).shape
    rows, columns = display or (h, w)
    (top, left) = offset
    header = {
        "compression": OpenEXR.PIZ_COMPRESSION if quickly else OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "dataWindow": (np.array([left, top], "i4"), np.array([left + w - 1, top + h - 1], "i4")),
        "displayWindow": (np.array([0, 0], "i4"), np.array([columns - 1, rows - 1], "i4")),
        **(attributes or {}),
    }
    pixels = {name: np.ascontiguousarray(value) for name, value in channels.items()}
    with written_atomically(path) as temporary:
        try:
            with OpenEXR.File(header, pixels) as file:
                file.write(str(temporary))
        except RuntimeError as error:
            raise OSError(errno.EIO, str(error)) from error


@dataclass(frozen=True)
class ExrImage:
    """An EXR file: pixels (h, w, C), their channels' names, the crop's (row, column) offset, the whole image's size, strings.

    Channels of several types are all given in the widest.
    """

    pixels: NDArray
    names: tuple[str, ...]
    offset: tuple[int, int]
    display: tuple[int, int]
    attributes: dict[str, Any]

    @property
    def channels(self) -> dict[str, NDArray]:
        """Name -> (h, w)."""
        return {name: self.pixels[..., i] for i, name in enumerate(self.names)}

    def select(self, names: list[str], mask: NDArray[np.bool_]) -> NDArray:
        """Values of some channels at the crop's pixels in a mask, row by row. Args: mask: (h, w). Returns: (P, len(names))."""
        at = {name: i for i, name in enumerate(self.names)}
        return np.take(self.pixels[mask], [at[name] for name in names], axis=1)

    def full(self, name: str) -> NDArray:
        """A channel at the whole image's size, 0 outside the crop."""
        channel = self.channels[name]
        image = np.zeros(self.display, channel.dtype)
        h, w = channel.shape
        top, left = self.offset
        image[top : top + h, left : left + w] = channel
        return image


def read_exr(path: Path) -> ExrImage:
    """Read all channels of an EXR artefact.

    By OpenImageIO, which keeps what it finds wrong for its caller, where OpenEXR prints; and which refuses a header that
    announces more than the file can hold.

    Raises: ArtifactError that names file and cause.
    """
    try:
        with open(path, "rb"):
            pass
    except OSError as error:
        raise ArtifactError(f"{path}: {reason(error)}; make it again") from error
    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise ArtifactError(f"{path}: not a readable EXR file ({one_line(oiio.geterror())}); make it again")
    spec = source.spec()
    pixels = source.read_image(spec.format)
    problem = source.geterror()
    source.close()
    if pixels is None:
        raise ArtifactError(f"{path}: not a readable EXR file ({one_line(problem)}); make it again")
    top, left = spec.y - spec.full_y, spec.x - spec.full_x
    if top < 0 or left < 0 or top + spec.height > spec.full_height or left + spec.width > spec.full_width:
        raise ArtifactError(f"{path}: its data window is not within its display window; make it again")
    attributes = {attribute.name: attribute.value for attribute in spec.extra_attribs}
    return ExrImage(pixels, spec.channelnames, (top, left), (spec.full_height, spec.full_width), attributes)


def is_readable_exr(path: Path) -> bool:
    """Whether a file is there of which every pixel can be read."""
    try:
        read_exr(path)
    except ArtifactError:
        return False
    return True
