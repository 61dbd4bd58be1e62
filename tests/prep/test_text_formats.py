"""Text and binary files as other programs write them: encodings, line ends, glued words, blank and wrong counts."""

import struct
from pathlib import Path

import numpy as np
import pytest

from stages.core.errors import InputError
from stages.prep.read_obj import read_obj
from stages.prep.read_off import read_off
from stages.prep.read_ply import read_ply
from stages.prep.read_stl import read_stl
from stages.prep.source import Source
from stages.prep.stage import READERS

OBJ = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], np.float32)


def write(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def faces_of(source: Source) -> list[list[int]]:
    return [face.tolist() for face in np.split(source.loop_vertex, source.loop_start[1:-1])]


# -------------------------------------------------------------------------------------------------------- encodings

PLY = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n" \
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"  # fmt: skip
FACET = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
TEXTS = {
    ".obj": "# made by hand\no thing\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    ".off": "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    ".ply": PLY,
    ".stl": f"solid thing\n{FACET}endsolid\n",
    ".gltf": '{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": '
    '[{"attributes": {"POSITION": 0}}]}], "accessors": [{"bufferView": 0, "componentType": 5121, "type": "VEC3", "count": '
    '3}], "bufferViews": [{"buffer": 0, "byteLength": 12, "byteStride": 4}], "buffers": [{"byteLength": 12, "uri": '
    '"data:application/octet-stream;base64,AAAAAAEAAAAAAQAA"}]}',
}


@pytest.mark.parametrize("suffix", TEXTS)
@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_any_unicode_encoding_with_either_line_end(tmp_path: Path, suffix: str, encoding: str) -> None:
    """Windows writes UTF-16 with a mark, some programs without one; the mesh is the same."""
    for ending in ("\n", "\r\n", "\r"):
        text = TEXTS[suffix].replace("\n", ending)
        source = READERS[suffix](write(tmp_path / f"a{suffix}", text.encode(encoding)))
        assert source.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        assert faces_of(source) == [[0, 1, 2]]


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_obj_names_in_either_code_page(tmp_path: Path, encoding: str) -> None:
    path = write(tmp_path / "a.obj", f"{OBJ}o Körper\nusemtl Weißblech\nf 1 2 3\n".encode(encoding))
    assert [(part.node, part.material) for part in read_obj(path).parts] == [("Körper", "Weißblech")]


# -------------------------------------------------------------------------------------------------------------- OBJ


@pytest.mark.parametrize(
    "tail, faces",
    [
        ("# C:\\models\\\nf 1 2 3\n", [[0, 1, 2]]),
        ("f 1 2 3 # front\\\nf 1 3 4\n", [[0, 1, 2], [0, 2, 3]]),
        ("f 1 2 \\\n3 4\n", [[0, 1, 2, 3]]),
        ("f 1 2 \\ \r\n 3 \\\r\n 4\r\n", [[0, 1, 2, 3]]),
        ("f 1 2 \\\r3\r", [[0, 1, 2]]),
        ("mtllib C:\\models\\\nf 1 2 3\n", [[0, 1, 2]]),
        ("usemtl wood\\\nf 1 2 3\n", [[0, 1, 2]]),
        ("f 1 2 3 \\", [[0, 1, 2]]),
        ("f 1 2 3\\\n\nf 1 3 4\n", [[0, 1, 2], [0, 2, 3]]),
    ],
)
def test_obj_backslashes_join_statements_and_nothing_else(tmp_path: Path, tail: str, faces: list[list[int]]) -> None:
    assert faces_of(read_obj(write(tmp_path / "a.obj", OBJ + tail))) == faces


def test_obj_comments_after_numbers(tmp_path: Path) -> None:
    """A comment is no number, whatever stands before it; a name may begin with its sign."""
    text = "v 0 0 0 # a\nv 1 0 0# 2\nv 1.#IND 1 0 #b\nvt 0.5 # u alone\nusemtl #ff8800\nf 1/1 2/1 3/1 # c\n"
    source = read_obj(write(tmp_path / "a.obj", text.replace("0# 2", "0 # 2")))
    assert source.uv.tolist() == [[0.5, 0]] and np.isnan(source.vertices[2, 0])
    assert source.parts[0].material == "#ff8800"


def test_obj_with_many_objects_is_read_at_once(tmp_path: Path) -> None:
    leaves = "".join(f"o leaf {i}\nf 1 2 3\n" for i in range(20_000))
    assert len(read_obj(write(tmp_path / "a.obj", OBJ + leaves)).parts) == 20_000


# -------------------------------------------------------------------------------------------------------------- PLY


@pytest.mark.parametrize("ending", [b"\r", b"\r\n", b"\n"])
@pytest.mark.parametrize("first", [0x0A, 0x0D])
def test_ply_header_lines_end_as_the_first_one(tmp_path: Path, ending: bytes, first: int) -> None:
    """The body of a binary file may begin with a byte that looks like the end of a line."""
    header = b"ply\nformat binary_little_endian 1.0\ncomment end_header follows\nelement vertex 3\nproperty uchar id\n" \
             b"property float x\nproperty float y\nproperty float z\nelement face 1\n" \
             b"property list uchar int vertex_index\nend_header\n"  # fmt: skip
    body = b"".join(struct.pack("<B3f", first, *point) for point in SQUARE[:3]) + struct.pack("<B3i", 3, 0, 1, 2)
    source = read_ply(write(tmp_path / "a.ply", header.replace(b"\n", ending) + body))
    assert source.vertices.tolist() == SQUARE[:3].tolist() and faces_of(source) == [[0, 1, 2]]


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_triangle_strips(tmp_path: Path, kind: str) -> None:
    """As Stanford's scans have them: one list in which -1 ends a strip, a repeated vertex turns it, beside a face."""
    strips = [0, 1, 3, 2, -1, 2, 3, 3, 0, 1, -1, 1, 0]
    header = f"ply\nformat {kind} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n" \
             "element face 1\nproperty list uchar int vertex_indices\n" \
             "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"  # fmt: skip
    if kind == "ascii":
        rows = [*SQUARE.tolist(), [4, 0, 1, 2, 3], [len(strips), *strips]]
        body = "".join(" ".join(map(str, row)) + "\n" for row in rows).encode()
    else:
        order = "<" if "little" in kind else ">"
        body = SQUARE.astype(order + "f4").tobytes() + struct.pack(f"{order}B4i", 4, 0, 1, 2, 3)
        body += struct.pack(f"{order}{1 + len(strips)}i", len(strips), *strips)
    source = read_ply(write(tmp_path / "a.ply", header.encode() + body))
    assert faces_of(source) == [[0, 1, 2, 3], [0, 1, 3], [1, 2, 3], [3, 0, 1]]


def test_ply_what_nobody_needs_may_be_no_number(tmp_path: Path) -> None:
    text = PLY.replace("float z\n", "float z\nproperty float quality\n").replace("0 0 0\n1 0 0\n0 1 0\n", (
        "0 0 0 nan(ind)\n1 0 0 1.#QNAN\n0 1 0 -nan\n"))  # fmt: skip
    for tail in ("", "\n\n \r\n", "\x1a", "\0\0"):
        assert faces_of(read_ply(write(tmp_path / "a.ply", text + tail))) == [[0, 1, 2]]


@pytest.mark.parametrize("order", ["<", ">"])
def test_ply_lists_of_unusual_types(tmp_path: Path, order: str) -> None:
    """Lengths as int, short or float, indices as double or 64-bit integers; two properties of one name."""
    name = "little" if order == "<" else "big"
    for length, code in (("int", "i"), ("short", "h"), ("float", "f"), ("char", "b")):
        for value, letter in (("double", "d"), ("int64", "q"), ("ushort", "H")):
            header = f"ply\nformat binary_{name}_endian 1.0\nelement vertex 4\nproperty float x\nproperty float x\n" \
                     f"property float y\nproperty float z\nelement face 2\nproperty list {length} {value} vertex_index\n" \
                     "end_header\n"  # fmt: skip
            body = b"".join(struct.pack(order + "4f", x, 9, y, z) for x, y, z in SQUARE)
            body += struct.pack(f"{order}{code}4{letter}", 4, 0, 1, 2, 3) + struct.pack(f"{order}{code}3{letter}", 3, 0, 1, 2)
            source = read_ply(write(tmp_path / "a.ply", header.encode() + body))
            assert faces_of(source) == [[0, 1, 2, 3], [0, 1, 2]] and source.vertices.tolist() == SQUARE.tolist()


# -------------------------------------------------------------------------------------------------------------- OFF


@pytest.mark.parametrize(
    "head",
    [
        "OFF\n4 1 0\n", "OFF4 1 0\n", "OFF 4 1 0\n", "# made by hand\n\n  # twice\nOFF\n\n4 1 0\n", "OFF\n4\n1\n0\n",
        "COFF4 1 0 # counts\n", "4 1 0\n", "4 1\n", "OFF # a mesh\n# of four\n\n4 1\n",
    ],
)  # fmt: skip
def test_off_counts_wherever_they_stand(tmp_path: Path, head: str) -> None:
    rows = "".join(f"{x} {y} {z}\n\n# next\n" for x, y, z in SQUARE)
    source = read_off(write(tmp_path / "a.off", head + rows.replace("\n", "\r\n") + "4 0 1 2 3\n"))
    assert faces_of(source) == [[0, 1, 2, 3]] and source.vertices.tolist() == SQUARE.tolist()


def test_off_numbers_that_are_none(tmp_path: Path) -> None:
    source = read_off(write(tmp_path / "a.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 nan(ind)\n-1.#IND 1 0\n3 0 1 2\n"))
    assert np.isnan(source.vertices).sum() == 2


# -------------------------------------------------------------------------------------------------------------- STL


def binary_stl(announced: int, there: int, tail: bytes = b"") -> bytes:
    records = [struct.pack("<12fH", 0, 0, 1, *(SQUARE[:3] + i).reshape(-1), 0) for i in range(there)]
    return b"made by hand".ljust(80) + struct.pack("<I", announced) + b"".join(records) + tail


@pytest.mark.parametrize(
    "announced, there, tail, read, said",
    [
        (4, 4, b"", 4, {}),
        (4, 4, b"\0\n", 4, {}),
        (2, 4, b"", 4, {"facets_beyond_the_announced": 2}),
        (0, 4, b"", 4, {"facets_beyond_the_announced": 4}),
        (2**32 - 1, 4, b"", 4, {}),
        (4, 4, b"metadata" * 20, 4, {"bytes_after_the_last_facet": 160}),
    ],
)
def test_stl_counts_that_are_not_so(
    tmp_path: Path, announced: int, there: int, tail: bytes, read: int, said: dict[str, int]
) -> None:
    source = read_stl(write(tmp_path / "a.stl", binary_stl(announced, there, tail)))
    assert len(source.face_part) == read and source.skipped == said


@pytest.mark.parametrize("announced, there, tail", [(8, 4, b""), (5, 4, b"\0" * 49), (2**32 - 1, 4, b"\0" * 7)])
def test_stl_that_is_cut_off_is_refused(tmp_path: Path, announced: int, there: int, tail: bytes) -> None:
    with pytest.raises(InputError, match=f"{announced} facets"):
        read_stl(write(tmp_path / "a.stl", binary_stl(announced, there, tail)))
