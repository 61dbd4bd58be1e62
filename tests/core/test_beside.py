"""What a glTF file names is a regular file that lies relative to it; nothing else is opened, in prep and as a reference."""

import json
from pathlib import Path

import numpy as np
import pytest

from stages.core.beside import beside
from stages.core.errors import InputError
from stages.light.textured_model import TexturedModel
from stages.prep.gltf_file import companions
from stages.prep.read_gltf import read_gltf

ELSEWHERE = ("/etc/passwd", "/dev/zero", "file:///etc/passwd", "http://host/a.bin", "C:\\a.bin", "\\\\host\\a.bin",
             "%2Fdev%2Fzero", "../../../../../../dev/zero", "a\0.bin", ".", "gone.bin", "../gone.bin")  # fmt: skip


def gltf(path: Path, uri: str) -> Path:
    """A triangle whose positions lie in another file."""
    content = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": uri}],
    }
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize("uri", ELSEWHERE)
def test_elsewhere(tmp_path: Path, uri: str) -> None:
    path = gltf(tmp_path / "a.gltf", uri)
    for read in (companions, read_gltf, lambda path: TexturedModel(path, np.eye(4))):
        with pytest.raises(InputError, match=r"a\.gltf: its buffer or image") as error:
            read(path)
        assert len(str(error.value).splitlines()) == 1


def test_a_file_beside_it_or_in_a_folder_near(tmp_path: Path) -> None:
    (tmp_path / "model").mkdir()
    (tmp_path / "my mesh.bin").write_bytes(np.arange(9, dtype="<f4").tobytes())
    path = gltf(tmp_path / "model" / "a.gltf", "../my%20mesh.bin")
    assert beside(path, "../my%20mesh.bin").samefile(tmp_path / "my mesh.bin")
    assert len(read_gltf(path).vertices) == 3
