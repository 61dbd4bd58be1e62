"""Artefacts that are damaged, foreign or hostile: one line says which, and no more memory is taken than files have bytes."""

import io
import json
import struct
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from stages.core.artifact import (
    Field,
    Provenance,
    Schema,
    intact,
    load_npz,
    read_exr,
    read_json,
    read_manifest,
    save_npz,
    write_exr,
    write_manifest,
)
from stages.core.errors import ArtifactError

SCHEMA = Schema("test", 1, {"points": Field("f4", ("V", 3)), "triangles": Field("i4", ("F", 3), rows_of="V")})
FOLDER = Schema("test.folder", 1)
MADE = Provenance({"size": 3}, 0, {"mesh": "0" * 64})


def arrays() -> dict[str, np.ndarray]:
    return {"points": np.zeros((4, 3), "f4"), "triangles": np.array([[0, 1, 2], [1, 2, 3]], "i4")}


def repacked(path: Path, members: dict[str, bytes], compression: int = zipfile.ZIP_STORED) -> Path:
    """The artefact with some members replaced or added."""
    save_npz(path, SCHEMA, arrays(), MADE)
    with zipfile.ZipFile(path) as archive:
        held = {name: archive.read(name) for name in archive.namelist()} | members
    with zipfile.ZipFile(path, "w", compression) as archive:
        for name, data in held.items():
            archive.writestr(name, data)
    return path


def npy(shape: tuple[int, ...], dtype: str, data: bytes) -> bytes:
    """An array file whose header may say what it likes."""
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": dtype, "fortran_order": False, "shape": shape})
    return stream.getvalue() + data


def refusal(path: Path, schema: Schema = SCHEMA) -> str:
    """The one line, which takes less than 4 MB to find."""
    tracemalloc.start()
    try:
        with pytest.raises(ArtifactError) as error:
            load_npz(path, schema)
        assert tracemalloc.get_traced_memory()[1] < 4e6
    finally:
        tracemalloc.stop()
    assert str(error.value).startswith(f"{path}: ")
    assert len(str(error.value).splitlines()) == 1
    return str(error.value)


def test_a_bomb_of_zeros_is_not_unpacked(tmp_path: Path) -> None:
    path = repacked(tmp_path / "a.npz", {"points.npy": npy((1 << 22, 3), "<f4", bytes(12 << 22))}, zipfile.ZIP_DEFLATED)
    assert path.stat().st_size < 1 << 20
    assert "is compressed" in refusal(path)


@pytest.mark.parametrize("shape", [(400_000_000, 3), (-4, -3), (2**62, 2**62), (1 << 40, 0)])
def test_an_array_that_announces_more_than_it_has(tmp_path: Path, shape: tuple[int, ...]) -> None:
    refusal(repacked(tmp_path / "a.npz", {"points.npy": npy(shape, "<f4", bytes(48))}))


def test_a_directory_that_announces_more_than_the_file_has(tmp_path: Path) -> None:
    path = repacked(tmp_path / "a.npz", {})
    data = bytearray(path.read_bytes())
    for signature, at in ((b"PK\1\2", 20), (b"PK\3\4", 18)):
        entry = data.index(b"points.npy", data.index(signature)) - (46 if at == 20 else 30)
        data[entry + at : entry + at + 8] = struct.pack("<II", 1 << 31, 1 << 31)
    path.write_bytes(data)
    assert "announce" in refusal(path)


def test_members_that_overlap_are_not_read_many_times(tmp_path: Path) -> None:
    """As in Fifield's zip bomb (2019): many names of the same bytes."""
    path = tmp_path / "a.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("header.npy", npy((), "<U2", "{}".encode("utf-32-le")))
        archive.writestr("points.npy", npy((100_000, 3), "<f4", bytes(1_200_000)))
        info = archive.infolist()[1]
        archive.filelist += [info] * 100
    refusal(path)


@pytest.mark.parametrize("name", ["/etc/passwd", "../../points.npy", "points/../../../x.npy", "readme.txt"])
def test_names_that_lead_elsewhere(tmp_path: Path, name: str) -> None:
    assert "is not part of it" in refusal(repacked(tmp_path / "a.npz", {name: npy((1,), "<f4", bytes(4))}))


def test_pickles_other_formats_and_nested_headers(tmp_path: Path) -> None:
    refusal(repacked(tmp_path / "object.npz", {"points.npy": npy((2,), "|O", b"\x80\4N.")}))
    refusal(repacked(tmp_path / "noise.npz", {"points.npy": b"no array"}))
    refusal(repacked(tmp_path / "text.npz", {"points.npy": npy((2,), "<f4", b"").replace(b"(2,)", b"((2,")}))
    deep = "[" * 100_000
    refusal(repacked(tmp_path / "deep.npz", {"header.npy": npy((), f"<U{len(deep)}", deep.encode("utf-32-le"))}))
    (tmp_path / "deep.json").write_text(deep)
    assert read_json(tmp_path / "deep.json") is None


@pytest.mark.parametrize("row", [4, -1, 2**31 - 1])
def test_rows_that_point_outside(tmp_path: Path, row: int) -> None:
    path = repacked(tmp_path / "a.npz", {"triangles.npy": npy((1, 3), "<i4", struct.pack("<3i", 0, 1, row))})
    assert f"'triangles' points at row {row} of 4" in refusal(path)


@pytest.mark.parametrize("change", [{"options": 3}, {"inputs": []}, {"extra": None}, {"seed": "x"}, {"inputs": ...}])
def test_a_header_of_other_types(tmp_path: Path, change: dict) -> None:
    header = {"schema": "test", "version": 1, "options": {}, "seed": 0, "inputs": {}, "extra": {}, **change}
    text = json.dumps({key: value for key, value in header.items() if value is not ...})
    path = repacked(tmp_path / "a.npz", {"header.npy": npy((), f"<U{len(text)}", text.encode("utf-32-le"))})
    assert f"no usable '{next(iter(change))}'" in refusal(path)


# ---------------------------------------------------------------------------------------------------- folders


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "a.txt").write_text("one")
    write_manifest(tmp_path, FOLDER, MADE, ["a.txt"])
    return tmp_path


def manifest_refusal(folder: Path) -> str:
    with pytest.raises(ArtifactError) as error:
        read_manifest(folder, FOLDER)
    return str(error.value)


def test_an_intact_folder_is_read(folder: Path) -> None:
    provenance, files = read_manifest(folder, FOLDER)
    assert provenance == MADE
    assert intact(folder, "a.txt", files) == folder / "a.txt"


def test_any_flipped_bit_of_a_manifest_is_noticed(folder: Path) -> None:
    """Unless it is between two values, where JSON does not look."""
    whole = (folder / "manifest.json").read_bytes()
    content = json.loads(whole)
    unnoticed = 0
    for at in range(len(whole)):
        changed = bytearray(whole)
        changed[at] ^= 1 << at % 7
        (folder / "manifest.json").write_bytes(changed)
        try:
            read_manifest(folder, FOLDER)
            unnoticed += 1
            assert json.loads(changed) == content
        except ArtifactError as error:
            assert len(str(error).splitlines()) == 1
    assert unnoticed < len(whole) / 20


def test_a_changed_file_is_noticed_when_it_is_read(folder: Path) -> None:
    _, files = read_manifest(folder, FOLDER)
    (folder / "a.txt").write_text("two")
    with pytest.raises(ArtifactError, match=r"a\.txt: damaged"):
        intact(folder, "a.txt", files)
    with pytest.raises(ArtifactError, match=r"b\.txt: not listed"):
        intact(folder, "b.txt", files)
    (folder / "a.txt").unlink()
    assert "missing" in manifest_refusal(folder)


@pytest.mark.parametrize("name", ["/etc/hostname", "../elsewhere.txt", "inner/../../elsewhere.txt"])
def test_a_manifest_lists_nothing_outside_of_its_folder(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "folder"
    (folder / "inner").mkdir(parents=True)
    (tmp_path / "elsewhere.txt").write_text("private")
    write_manifest(folder, FOLDER, MADE, [name])
    assert "not within the folder" in manifest_refusal(folder)


# ---------------------------------------------------------------------------------------------------- EXR


def test_damaged_exr_files_end_in_one_error_and_no_print(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """OpenEXR itself prints what it finds on stderr."""
    path = tmp_path / "a.exr"
    write_exr(path, {c: np.random.default_rng(i).random((40, 48), np.float32) for i, c in enumerate("RGB")})
    whole = path.read_bytes()
    window = whole.index(b"dataWindow\0box2i\0") + 21
    damaged = [whole[:end] for end in range(0, len(whole), len(whole) // 40)]
    damaged += [whole[:at] + bytes([whole[at] ^ 16]) + whole[at + 1 :] for at in range(0, 420, 7)]
    for size in (1 << 14, 1 << 20, (1 << 31) - 2):
        damaged += [whole[:window] + struct.pack("<4i", 0, 0, *box) + whole[window + 16 :] for box in ((size,) * 2, (47, size))]
    errors = 0
    tracemalloc.start()
    for data in damaged:
        path.write_bytes(data)
        try:
            read_exr(path)
        except ArtifactError as error:
            errors += 1
            assert str(error).startswith(f"{path}: ")
            assert len(str(error).splitlines()) == 1
    assert errors >= 60
    assert tracemalloc.get_traced_memory()[1] < 64e6
    tracemalloc.stop()
    assert capfd.readouterr().err == ""


def test_channels_of_several_types_and_a_crop(tmp_path: Path) -> None:
    fine, coarse = np.random.default_rng(0).random((3, 5), np.float32), np.full((3, 5), 0.1, np.float16)
    write_exr(tmp_path / "a.exr", {"b": fine, "a": coarse}, (9, 8), (2, 1), {"note": "x"})
    image = read_exr(tmp_path / "a.exr")
    assert (image.offset, image.display, image.attributes["note"]) == ((2, 1), (9, 8), "x")
    np.testing.assert_array_equal(image.channels["b"], fine)
    np.testing.assert_array_equal(image.select(["a", "b"], fine > 0.5), np.stack([coarse[fine > 0.5], fine[fine > 0.5]], 1))
    assert image.full("b").sum() == pytest.approx(fine.sum())
    header = {"dataWindow": (np.array([0, 0], "i4"), np.array([4, 2], "i4")), "displayWindow": (np.array([3, 3], "i4"),) * 2}
    OpenEXR.File({"type": OpenEXR.scanlineimage, **header}, {"b": fine}).write(str(tmp_path / "a.exr"))
    with pytest.raises(ArtifactError, match="not within its display window"):
        read_exr(tmp_path / "a.exr")
