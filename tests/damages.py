"""What can happen to a file: bits, cuts, zeros, swaps; and what a hostile one holds: bombs, gigabytes, paths elsewhere."""

import io
import json
import random
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from stages.core.artifact import MANIFEST, SEAL, seal_of, sha256_file

Damage = Callable[[bytes, random.Random], bytes]

HOSTILE = (None, -1, 0, 10**12, 1e300, "", "../../elsewhere", "/etc/passwd", [], {}, [[]], True, "x" * 100_000)
"""What a value of a header may have become."""

FOLDER = "a folder in place"

ELSEWHERE = ("/etc/passwd", "../../elsewhere.npy", "inner/../../../x.npy")


# ---------------------------------------------------------------------------------------------------- any file


def flip(data: bytes, dice: random.Random, count: int = 1) -> bytes:
    """One bit, or some."""
    changed = bytearray(data)
    for _ in range(count if data else 0):
        changed[dice.randrange(len(data))] ^= 1 << dice.randrange(8)
    return bytes(changed)


def flips(data: bytes, dice: random.Random) -> bytes:
    return flip(data, dice, 20)


def flip_at_the_start(data: bytes, dice: random.Random) -> bytes:
    """Where headers are."""
    return flip(data[:400], dice) + data[400:]


def flip_at_the_end(data: bytes, dice: random.Random) -> bytes:
    """Where an archive has its directory."""
    return data[:-400] + flip(data[-400:], dice)


def cut(data: bytes, dice: random.Random) -> bytes:
    return data[: dice.randrange(max(len(data), 1))]


def cut_a_little(data: bytes, dice: random.Random) -> bytes:
    return data[: -dice.randrange(1, 30)]


def empty(data: bytes, dice: random.Random) -> bytes:
    return b""


def zeros(data: bytes, dice: random.Random) -> bytes:
    """A stretch of zeros, as a lost block of a disk."""
    begin, length = dice.randrange(max(len(data), 1)), dice.randrange(1, 4096)
    return data[:begin] + bytes(len(data[begin : begin + length])) + data[begin + length :]


def all_zeros(data: bytes, dice: random.Random) -> bytes:
    return bytes(len(data))


def swap_blocks(data: bytes, dice: random.Random) -> bytes:
    """Two halves the wrong way round."""
    middle = dice.randrange(max(len(data), 1))
    return data[middle:] + data[:middle]


def longer(data: bytes, dice: random.Random) -> bytes:
    return data + dice.randbytes(1000)


def noise(data: bytes, dice: random.Random) -> bytes:
    return dice.randbytes(max(len(data), 1))


ANY: tuple[Damage, ...] = (
    flip, flip, flips, flip_at_the_start, flip_at_the_end, cut, cut_a_little, empty, zeros, all_zeros, swap_blocks, longer,
    noise,
)  # fmt: skip


# ---------------------------------------------------------------------------------------------------- NPZ


def bomb(data: bytes, dice: random.Random) -> bytes:
    """An array of 64 MiB of zeros, deflated, that announces 400 million vertices."""
    return _replaced(data, dice, _npy((400_000_000, 3), bytes(1 << 26)), zipfile.ZIP_DEFLATED)


def announces_too_much(data: bytes, dice: random.Random) -> bytes:
    return _replaced(data, dice, _npy((dice.choice((1 << 20, 400_000_000, 1 << 62)), 3), bytes(120)))


def directory_lies(data: bytes, dice: random.Random) -> bytes:
    """Sizes in the archive's directory that are larger than the file."""
    try:
        entry = data.index(b"PK\1\2", len(data) - 4000 if len(data) > 4000 else 0)
    except ValueError:
        return b""
    return data[: entry + 20] + struct.pack("<II", 1 << 31, 1 << 31) + data[entry + 28 :]


def member_elsewhere(data: bytes, dice: random.Random) -> bytes:
    """An array with a path for a name."""
    return _packed(_members(data) | {dice.choice(ELSEWHERE): _npy((3,), bytes(12))})


def other_shape(data: bytes, dice: random.Random) -> bytes:
    """An array that is right in itself, but not in its place."""
    return _replaced(data, dice, _npy((4, 3), np.arange(12, dtype="f4").tobytes()))


def header_forged(data: bytes, dice: random.Random) -> bytes:
    """A value of the header replaced."""
    members = _members(data)
    text = str(np.lib.format.read_array(io.BytesIO(members["header.npy"])))
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.array(json.dumps(forged(json.loads(text), dice))))
    return _packed(members | {"header.npy": stream.getvalue()})


def _npy(shape: tuple[int, ...], data: bytes) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "<f4", "fortran_order": False, "shape": shape})
    return stream.getvalue() + data


def _members(data: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _packed(members: dict[str, bytes], compression: int = zipfile.ZIP_STORED) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", compression) as archive:
        for name, held in members.items():
            archive.writestr(name, held)
    return stream.getvalue()


def _replaced(data: bytes, dice: random.Random, array: bytes, compression: int = zipfile.ZIP_STORED) -> bytes:
    members = _members(data)
    return _packed(members | {dice.choice([name for name in members if name != "header.npy"]): array}, compression)


NPZ: tuple[Damage, ...] = (
    bomb, announces_too_much, directory_lies, member_elsewhere, other_shape, header_forged, header_forged,
)  # fmt: skip


# ---------------------------------------------------------------------------------------------------- EXR


def gigabytes(data: bytes, dice: random.Random) -> bytes:
    """Windows of up to the largest size that can be written."""
    width, height = dice.choice(((1 << 14,) * 2, (1 << 17,) * 2, (47, 1 << 30), (1 << 30, 47), ((1 << 31) - 2,) * 2))
    for name in dice.choice(((b"dataWindow",), (b"displayWindow",), (b"dataWindow", b"displayWindow"))):
        begin = data.index(name + b"\0box2i\0") + len(name) + 11
        data = data[:begin] + struct.pack("<4i", 0, 0, width, height) + data[begin + 16 :]
    return data


def channels_renamed(data: bytes, dice: random.Random) -> bytes:
    begin = data.index(b"chlist\0") + 11
    return data[:begin] + bytes([data[begin] + dice.randrange(1, 5)]) + data[begin + 1 :]


EXR: tuple[Damage, ...] = (gigabytes, gigabytes, channels_renamed)


# ---------------------------------------------------------------------------------------------------- JSON


def forged(content: Any, dice: random.Random) -> Any:
    """The content with one of its values replaced, at any depth."""
    if isinstance(content, dict) and content and dice.random() < 0.9:
        key = dice.choice(sorted(content))
        return {**content, key: forged(content[key], dice)}
    if isinstance(content, list) and content and dice.random() < 0.9:
        at = dice.randrange(len(content))
        return [*content[:at], forged(content[at], dice), *content[at + 1 :]]
    return dice.choice(HOSTILE)


def json_forged(data: bytes, dice: random.Random) -> bytes:
    """A value replaced; what has a hash of itself gets the right one."""
    return _resealed(forged(json.loads(data), dice))


def lists_elsewhere(data: bytes, dice: random.Random) -> bytes:
    """A file or an environment outside of the folder."""
    content = json.loads(data)
    if isinstance(content.get("files"), dict):
        content["files"] |= {dice.choice(ELSEWHERE): "0" * 64}
    if dice.random() < 0.5 and "environments" in content.get("extra", {}):
        content["extra"]["environments"][0] = dice.choice(ELSEWHERE)
    return _resealed(content)


def nested(data: bytes, dice: random.Random) -> bytes:
    return dice.choice((b"[", b'{"a":')) * 100_000


def _resealed(content: Any) -> bytes:
    if isinstance(content, dict) and SEAL in content:
        rest = {key: value for key, value in content.items() if key != SEAL}
        content = {**rest, SEAL: seal_of(rest)}
    return json.dumps(content, indent=1).encode()


JSON: tuple[Damage, ...] = (json_forged, json_forged, json_forged, lists_elsewhere, nested)


# ---------------------------------------------------------------------------------------------------- folders


def unfinish(conditions: Path) -> None:
    """Make of a finished conditions folder what a run leaves that is stopped before its last view."""
    content = json.loads((conditions / MANIFEST).read_text())
    asked = {key: content[key] for key in ("options", "seed", "inputs")}
    (conditions / "request.json").write_text(json.dumps(asked))
    (conditions / MANIFEST).unlink()
    (conditions / "sheet.png").unlink()
    last = max(conditions.glob("view_*"))
    for path in last.iterdir():
        path.unlink()


def reseal(path: Path, scratch: Path) -> None:
    """Let the manifest of the folder that a file is in know its hash."""
    for manifest in (scratch / "conditions" / MANIFEST, scratch / "asset" / "bake.json"):
        if manifest.exists() and manifest != path and manifest.parent in path.parents:
            content = json.loads(manifest.read_text())
            name = str(path.relative_to(manifest.parent))
            if name in content["files"]:
                content["files"][name] = sha256_file(path)
                manifest.unlink()  # it may be a link to the reference
                manifest.write_bytes(_resealed(content))


def damage(path: Path, scratch: Path, reference: Path, dice: random.Random) -> tuple[str, bool]:
    """Damage a file, which may be a hard link, in one of the ways that its kind can be.

    Returns:
        what was done; whether no hash tells of it any more.
    """
    data, kinds = path.read_bytes(), {".npz": NPZ, ".checkpoint": NPZ, ".exr": EXR, ".json": JSON}
    path.unlink()
    draw = dice.random()
    if draw < 0.05:
        return "gone", False
    if draw < 0.1:
        path.mkdir()
        return FOLDER, False
    if draw < 0.2:
        other = dice.choice(sorted(p for p in reference.rglob("*") if p.is_file() and p.read_bytes() != data))
        path.write_bytes(other.read_bytes())
        return f"{other.relative_to(reference)} in place", False
    special = kinds.get(path.suffix, ())
    how = dice.choice(special) if special and draw < 0.6 else dice.choice(ANY)
    path.write_bytes(how(data, dice))
    sealed = how in special
    if sealed and dice.random() < 0.7:
        reseal(path, scratch)
    return how.__name__, sealed
