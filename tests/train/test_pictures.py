"""Training pictures: which objects they are made of, and what they hold."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from numpy.typing import NDArray
from PIL import Image

from stages.core.artifact import load_npz, sha256_file
from stages.core.errors import InputError
from stages.sd.profile import LIGHT
from stages.train.objects import Entry, read_captions, read_object
from stages.train.options import PicturesOptions
from stages.train.picture_batches import Pictures
from stages.train.pictures import VIEW, render_pictures
from tests.distill.examples import painted_sphere

SIZE = 32


def model(path: Path, mesh: trimesh.Trimesh, **material: object) -> Path:
    """A GLB of a grey material."""
    grey = Image.new("RGB", (2, 2), (188, 188, 188))
    pbr = trimesh.visual.material.PBRMaterial(baseColorTexture=grey, metallicFactor=0.0, **material)
    mesh.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(mesh.vertices), 2)), material=pbr)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(trimesh.Scene(mesh).export(file_type="glb"))
    return path


def sphere() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=2)


def sheet() -> trimesh.Trimesh:
    """A tilted square of many triangles."""
    flat = trimesh.creation.box((1, 1, 0.001)).subdivide().subdivide().subdivide()
    flat.apply_transform(trimesh.transformations.rotation_matrix(0.5, (1, 1, 0)))
    return flat


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two spheres that pass, three things that do not, and captions."""
    folder = tmp_path_factory.mktemp("models")
    painted_sphere(folder / "painted.glb")
    model(folder / "deep" / "grey.glb", sphere())
    model(folder / "glass.glb", sphere(), alphaMode="BLEND")
    model(folder / "unnamed.glb", sphere())
    (folder / "broken.glb").write_bytes(b"glTF")
    captions = {"painted.glb": "a ball", "deep/grey.glb": {"caption": "a stone", "tags": ["rock"]}, "glass.glb": "a vase"}
    (folder / "captions.json").write_text(json.dumps({**captions, "broken.glb": "a wreck"}))
    return folder


def options(models: Path, **changes: object) -> PicturesOptions:
    chosen = {"captions": models / "captions.json", "env": ("overcast", "studio"), "views": 2, "size": SIZE, **changes}
    return PicturesOptions(**chosen)


def hashes(folder: Path) -> dict[str, str]:
    return {str(path.relative_to(folder)): sha256_file(path) for path in sorted(folder.rglob("*.*"))}


@pytest.fixture(scope="module")
def made(models: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("made")
    render_pictures(models, out, options(models))
    return out


@pytest.mark.parametrize(
    ("mesh", "entry", "material", "reason"),
    [
        (sphere, Entry("a", ("Pixel-Art",)), {}, "is tagged pixelart"),
        (sphere, Entry("a"), {"alphaMode": "MASK", "alphaCutoff": 0.5}, "is transparent"),
        (trimesh.creation.box, Entry("a"), {}, "is too simple, 12 triangles"),
        (sheet, Entry("a"), {}, "is a single plane"),
    ],
)
def test_unfit_objects_are_refused_with_the_reason(
    tmp_path: Path, mesh: object, entry: Entry, material: dict, reason: str
) -> None:
    path = model(tmp_path / "thing.glb", mesh(), **material)
    with pytest.raises(InputError, match=rf"thing\.glb: {reason}"):
        read_object(path, entry)


def test_a_sheet_with_a_box_on_it_is_no_plane(tmp_path: Path) -> None:
    read_object(model(tmp_path / "thing.glb", sheet() + trimesh.creation.box((0.1, 0.1, 0.3))), Entry("a", ("wood",)))


def test_captions_of_another_shape_are_one_line_errors(tmp_path: Path) -> None:
    path = tmp_path / "captions.json"
    for content, problem in (("[]", "expected JSON"), ('{"a.glb": 3}', '"a.glb" has 3'), ("{", "expected JSON")):
        path.write_text(content)
        with pytest.raises(InputError, match=rf"captions\.json: {problem}"):
            read_captions(path)


def test_the_manifest_counts_and_gives_reasons(made: Path) -> None:
    manifest = json.loads((made / "manifest.json").read_text())
    assert (manifest["files"], manifest["objects"], manifest["pictures"]) == (5, 2, 2 * 2 * 2)
    assert set(manifest["refused"]) == {"glass.glb", "unnamed.glb", "broken.glb"}
    assert manifest["refused"]["glass.glb"] == "is transparent" and manifest["refused"]["unnamed.glb"] == "has no caption"


def test_a_view_holds_what_the_controlnet_expects(made: Path) -> None:
    pictures = Pictures(made)
    assert len(pictures) == 8 and pictures.size == SIZE and {pictures[i][2] for i in range(8)} == {"a ball", "a stone"}
    for i in range(8):
        picture, conditions, _ = pictures[i]
        mask = conditions[0] > 0
        assert conditions.shape == (22, SIZE, SIZE) and picture.shape == (3, SIZE, SIZE)
        assert 0.2 < mask.float().mean() < 0.8
        assert picture[:, ~mask].eq(1).all() and conditions[4:, ~mask].eq(0).all()
        torch.testing.assert_close(conditions[1:4, ~mask].mean(1), torch.tensor([0.5, 0.5, 1.0]))
        assert conditions[0, mask].min() == pytest.approx(0.3, abs=0.002) and conditions[0].max() == 1
        direction = 2 * conditions[1:4, mask] - 1
        torch.testing.assert_close(direction.norm(dim=0), torch.ones(int(mask.sum())), atol=0.02, rtol=0)
        assert direction[2].min() > -0.01  # facing the viewer


def test_a_grey_dielectric_is_a_darker_white(made: Path) -> None:
    """The stone is rough and half as bright as the white of light map (0, 1), at every pixel: the tone curve's own order."""
    pictures = Pictures(made)
    for i in range(8):
        picture, conditions, caption = pictures[i]
        if caption == "a stone":
            mask, white = conditions[0] > 0, conditions[LIGHT][6:9]
            assert (picture < white)[:, mask].float().mean() > 0.99
            assert np.corrcoef(picture[:, mask].flatten(), white[:, mask].flatten())[0, 1] > 0.95


def test_interrupted_and_divided_work_ends_in_the_same_bytes(models: Path, made: Path, tmp_path: Path) -> None:
    def stop_at_the_second(what: str, done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    stopped = tmp_path / "stopped"
    with pytest.raises(KeyboardInterrupt):
        render_pictures(models, stopped, options(models), progress=stop_at_the_second)
    assert not (stopped / "manifest.json").exists()
    again = render_pictures(models, stopped, options(models))
    assert again.made == 3 and hashes(stopped) == hashes(made)
    assert render_pictures(models, stopped, options(models)).made == 0
    shared = tmp_path / "shared"
    parts = [render_pictures(models, shared, options(models, shard=(i, 2))).content for i in (1, 2)]
    assert sum(part["objects"] for part in parts) == 2 and sum(part["files"] for part in parts) == 5
    assert hashes(shared / "objects") == hashes(made / "objects")


def test_another_caption_or_option_makes_an_object_again(models: Path, made: Path, tmp_path: Path) -> None:
    painted = tmp_path / "models"
    painted.mkdir()
    (painted / "painted.glb").write_bytes((models / "painted.glb").read_bytes())
    for caption, seed, expected in (("a ball", 0, 1), ("a ball", 0, 0), ("an orb", 0, 1), ("an orb", 1, 1)):
        (painted / "captions.json").write_text(json.dumps({"painted.glb": caption}))
        result = render_pictures(painted, tmp_path / "out", options(painted, seed=seed, views=1, env=("overcast",)))
        assert result.made == expected and result.content["pictures"] == 1


def test_without_environments_each_object_gets_its_own(models: Path, tmp_path: Path) -> None:
    result = render_pictures(models, tmp_path, options(models, env=(), lights=3, views=1, size=16))
    assert result.content["pictures"] == 6
    views = [load_npz(path, VIEW) for path in sorted(tmp_path.rglob("view_00.npz"))]
    assert [len(view["light"]) for view in views] == [3, 3]
    ambience = [view["light"].mean((1, 2)) for view in views]
    assert np.ptp(np.concatenate(ambience)) > 5


def test_a_folder_without_models_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no \.glb files"):
        render_pictures(tmp_path, tmp_path / "out", PicturesOptions())


def test_blip_names_what_has_no_name(models: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[NDArray] = []

    class Names:
        def __init__(self, folder: Path) -> None:
            assert folder == tmp_path / "blip"

        def caption(self, picture: NDArray) -> str:
            seen.append(picture)
            return "a thing"

    monkeypatch.setattr("stages.train.pictures.Captioner", Names)
    chosen = options(models, captioner=tmp_path / "blip", views=1)
    assert render_pictures(models, tmp_path / "out", chosen).content["objects"] == 3
    assert len(seen) == 1 and seen[0].shape == (SIZE, SIZE, 3) and (seen[0][0, 0] == 255).all()
    assert "a thing" in {Pictures(tmp_path / "out")[i][2] for i in range(6)}
