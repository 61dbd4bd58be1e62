"""The paper's measures on tiny models: random networks in the files of the real ones. Needs the extra `sd`."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor, nn

pytest.importorskip("diffusers", reason='needs pip install ".[sd]"')
pytest.importorskip("torchmetrics", reason='needs pip install ".[sd]"')

from stages.core.artifact import Provenance, load_npz, sha256_file, write_manifest
from stages.core.errors import ArtifactError, InputError
from stages.core.schemas import ASSET
from stages.report import evaluate as stage
from stages.report.evaluate import PICTURES, evaluate
from stages.report.metrics import clip_score, frechet_distance
from stages.report.options import EvalOptions
from tests.distill.examples import painted_sphere
from tests.sd import tiny

CPU = torch.device("cpu")
SIZE = 16


class Features(nn.Module):
    """Mean colours of the four quarters of a picture, 12 numbers, called as the Inception of TorchScript is."""

    def forward(self, pictures: Tensor, return_features: bool = False) -> Tensor:
        assert return_features
        return nn.functional.adaptive_avg_pool2d(pictures.float() / 255, 2).flatten(1)


def write_clip(folder: Path) -> Path:
    """A CLIP of random weights, with the tokenizer of the tiny Stable Diffusion beside it."""
    from transformers import CLIPConfig, CLIPImageProcessor, CLIPModel, CLIPProcessor, CLIPTokenizer

    size = {"hidden_size": 16, "num_hidden_layers": 1, "num_attention_heads": 2, "intermediate_size": 16}
    text = {**size, "vocab_size": 515, "max_position_embeddings": tiny.TOKENS, "eos_token_id": 1, "bos_token_id": 0}
    with torch.random.fork_rng():
        torch.manual_seed(0)
        config = CLIPConfig(text_config=text, vision_config={**size, "image_size": SIZE, "patch_size": 8}, projection_dim=8)
        CLIPModel(config).save_pretrained(folder)
    pixels = CLIPImageProcessor(size={"shortest_edge": SIZE}, crop_size={"height": SIZE, "width": SIZE})
    CLIPProcessor(pixels, CLIPTokenizer.from_pretrained(folder.parent / "sd/tokenizer")).save_pretrained(folder)
    return folder


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tiny.write_models(tmp_path_factory.mktemp("models"))
    write_clip(folder / "clip")
    torch.jit.script(Features()).save(folder / "inception.pt")
    for name, prompt in (("ball", "a red ball"), ("orb", 'a "golden" orb')):
        asset = folder / name / "asset"
        asset.mkdir(parents=True)
        painted_sphere(asset / "model.glb")
        write_manifest(asset, ASSET, Provenance({}, 0, {"material": name}, {"prompt": prompt}), ["model.glb"])
    return folder


def options(models: Path, **changes: object) -> EvalOptions:
    given = {"sd_model": str(models / "sd"), "clip": str(models / "clip"), "inception": str(models / "inception.pt")}
    return EvalOptions(**(given | {"views": 4, "samples": 3, "size": SIZE} | changes))


def assets(models: Path) -> tuple[Path, Path]:
    return models / "ball/asset", models / "orb/asset"


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stage, "STEPS", 3)


def test_a_table_of_two_assets(models: Path, tmp_path: Path, quick: None, monkeypatch: pytest.MonkeyPatch) -> None:
    result = evaluate(assets(models), tmp_path, options(models))
    assert [score.prompt for score in result.scores] == ["a red ball", 'a "golden" orb']
    assert json.loads((tmp_path / "eval.json").read_text()) == result.summary
    assert result.summary["clip_score_2.5"] == pytest.approx(2.5 * np.mean([s.clip_score for s in result.scores]))
    assert result.summary["fid"] > 0 and (tmp_path / "assets.csv").read_text().count("\n") == 3
    folder = next(tmp_path.glob("ball_*"))
    renders, samples = (load_npz(folder / name, PICTURES)["pictures"] for name in ("renders.npz", "samples.npz"))
    assert renders.shape == (4, SIZE, SIZE, 3) and samples.shape == (3, SIZE, SIZE, 3)
    assert (renders[:, 0, 0] == 255).all() and renders.std() > 10 and len(np.unique(samples.reshape(3, -1), axis=0)) == 3

    monkeypatch.setattr(stage, "render", None)  # nothing is made again
    monkeypatch.setattr(stage, "draw", None)
    assert evaluate(assets(models), tmp_path, options(models)) == result


def test_clip_score_is_a_hundred_cosines(models: Path) -> None:
    from transformers import CLIPModel, CLIPProcessor

    picture = torch.randint(0, 256, (2, 3, SIZE, SIZE), dtype=torch.uint8, generator=torch.Generator().manual_seed(0))
    metric, prompts = clip_score(models / "clip", CPU), ["gold", "a red ball"]
    with torch.no_grad():
        metric.update(picture, prompts)
        processor = CLIPProcessor.from_pretrained(models / "clip")
        inputs = processor(text=prompts, images=list(picture), return_tensors="pt", padding=True)
        out = CLIPModel.from_pretrained(models / "clip")(**inputs)
    cosine = nn.functional.cosine_similarity(out.image_embeds, out.text_embeds)
    assert float(metric.compute()) == pytest.approx(max(float(100 * cosine.mean()), 0), abs=1e-3)


def test_fid_of_gaussians_is_that_of_the_formula(models: Path) -> None:
    """|m1 - m2|² + tr(C1 + C2 - 2 (C1 C2)^1/2), by scipy."""
    from scipy.linalg import sqrtm

    rng, metric = np.random.default_rng(0), frechet_distance(models / "inception.pt", CPU)
    sets = [rng.integers(low, high, (40, 3, 4, 4)).astype(np.uint8) for low, high in ((0, 200), (50, 256))]
    for pictures, real in zip(sets, (True, False), strict=True):
        metric.update(torch.from_numpy(pictures), real=real)
    features = [Features()(torch.from_numpy(x), True).double().numpy() for x in sets]
    (m1, c1), (m2, c2) = ((f.mean(0), np.cov(f.T)) for f in features)
    expected = ((m1 - m2) ** 2).sum() + np.trace(c1 + c2 - 2 * sqrtm(c1 @ c2).real)
    assert float(metric.compute()) == pytest.approx(expected, rel=1e-3)


def test_what_is_missing_is_one_line(models: Path, tmp_path: Path) -> None:
    both = assets(models)
    for changes, words in (
        ({"clip": str(tmp_path)}, r"--clip .*: not a readable CLIP model"),
        ({"inception": str(models / "clip/config.json")}, r"--inception .*: not a TorchScript feature network"),
        ({"sd_model": ""}, "--sd-model: not given"),
    ):
        with pytest.raises(InputError, match=words):
            evaluate(both, tmp_path / "out", options(models, **changes))
    with pytest.raises(InputError, match="2 assets, but 1 different ones"):
        evaluate((both[0], both[0]), tmp_path / "out", options(models))
    with pytest.raises(ArtifactError, match=r"bake\.json"):
        evaluate((tmp_path,), tmp_path / "out", options(models))


def test_an_asset_is_told_by_its_file(models: Path, tmp_path: Path, quick: None) -> None:
    """A model that was baked again is rendered again."""
    evaluate(assets(models)[:1], tmp_path, options(models))
    renders = next(tmp_path.rglob("renders.npz"))
    assert load_npz(renders, PICTURES).provenance.inputs == {"model": sha256_file(models / "ball/asset/model.glb")}
