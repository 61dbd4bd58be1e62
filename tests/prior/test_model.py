import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
import torch

from stages.core.artifact import Provenance, sha256_file
from stages.core.errors import ArtifactError
from stages.prior.model import VOCABULARY_FILE, WEIGHTS_FILE, Prior, PriorNetwork, load_prior, save_weights
from stages.prior.profile import SIZE

LIMIT = 32 * 2**20


@pytest.fixture(scope="module")
def prior() -> Prior:
    return load_prior("cpu")


def view(count: int, seed: int = 0) -> tuple[torch.Tensor, torch.Tensor]:
    """Noise and conditions of a sphere under plain light maps."""
    y, x = torch.meshgrid(*2 * [torch.linspace(-1.3, 1.3, SIZE)], indexing="ij")
    mask = (x * x + y * y < 1).float()[None, None]
    normal = torch.stack([x, -y, (1 - x * x - y * y).clamp(min=0).sqrt()])[None] * mask
    lights = (0.3 + 0.5 * normal[:, 1:2].clamp(min=0)).expand(1, 18, -1, -1) * mask
    conditions = Prior.prepare(3 - normal[:, 2:] * 0.5, normal, -y / 2.6 * mask, mask, lights * Prior.exposure(lights, mask))
    noise = torch.randn(count, 3, SIZE, SIZE, generator=torch.Generator().manual_seed(seed))
    return noise, conditions.expand(count, -1, -1, -1)


def test_weights_are_small_and_hold_no_pickle() -> None:
    files = list(WEIGHTS_FILE.parent.glob("*"))
    assert sum(file.stat().st_size for file in files) <= LIMIT
    with zipfile.ZipFile(WEIGHTS_FILE) as archive:
        for name in archive.namelist():
            assert b"'|O'" not in archive.read(name)[:128]
    assert (WEIGHTS_FILE.parent / "NOTICE").is_file()


def test_identity_says_where_the_weights_come_from(prior: Prior) -> None:
    assert prior.identity["weights"] == sha256_file(WEIGHTS_FILE)
    training = prior.identity["training"]
    assert training["step"] > 0 and training["hours"] > 0 and training["device"]
    assert re.fullmatch("[0-9a-f]{40}|unknown", training["commit"])


def test_noise_prediction_has_not_changed(prior: Prior, golden) -> None:
    noise, conditions = view(3)
    prompts = prior.embed(["polished gold", "red plastic", ""])
    eps = prior.denoise(noise, torch.tensor([100, 400, 800]), conditions, prompts)[0]
    reading = prior.read(["polished gold", "red plastic", "oak wood"])
    arrays = {"eps": eps[:, :, ::8, ::8].numpy(), "read": reading.numpy()}
    golden.check("prior/predict_noise", arrays, atol=0.06)  # bfloat16 differs between processors


def test_same_call_same_bytes(prior: Prior) -> None:
    noise, conditions = view(2)
    t, text = torch.tensor([200, 600]), prior.embed(["oak wood", "steel"])
    assert torch.equal(
        prior.denoise(noise, t, conditions, text)[0], prior.denoise(noise, t, conditions, text)[0]
    )


def test_conditions_may_be_missing(prior: Prior) -> None:
    noise, conditions = view(2)
    t, text = torch.tensor([200, 600]), prior.embed(["oak wood", "steel"])
    none = prior.denoise(noise, t, None, text)[0]
    dropped = prior.denoise(noise, t, prior.drop(conditions, geometry=True, light=True), text)[0]
    assert torch.equal(none, dropped)
    assert not torch.equal(none, prior.denoise(noise, t, conditions, text)[0])
    assert torch.isfinite(none).all()


def test_the_prompt_steers_the_prediction(prior: Prior) -> None:
    noise, conditions = view(1)
    t = torch.tensor([700])
    surface = {p: prior.denoise(noise, t, conditions, prior.embed([p]))[1] for p in ("polished gold", "blue fabric")}
    inside = conditions[:, :1] > 0
    metallic = {p: float(m[:, 4:][inside].mean()) for p, m in surface.items()}
    assert metallic["polished gold"] > 0.6 and metallic["blue fabric"] < 0.4


def test_words_are_read_as_what_they_name(prior: Prior) -> None:
    prompts = ["gold", "brushed steel", "red plastic", "black rubber", "polished chrome"]
    gold, steel, red, rubber, chrome = prior.read(prompts).unbind()
    assert min(gold[4], steel[4], chrome[4]) > 0.7 and max(red[4], rubber[4]) < 0.3
    assert gold[2] < gold[0] - 0.15 and red[0] > red[1] + 0.3
    assert rubber[:3].max() < 0.3 and chrome[3] < 0.25 < rubber[3]


def test_samples_are_finite_and_follow_their_seed(prior: Prior) -> None:
    _, conditions = view(1)
    first, second = (prior.sample(conditions, ["gold"], torch.Generator().manual_seed(5), steps=3) for _ in range(2))
    assert torch.equal(first, second) and torch.isfinite(first).all()


def test_weights_of_another_network_are_refused(tmp_path: Path) -> None:
    network = PriorNetwork(8)
    values = network.flat()
    inputs = {"vocabulary": sha256_file(VOCABULARY_FILE)}
    save_weights(tmp_path / "other.npz", network, values, Provenance({}, 0, inputs), {"step": 1})
    with pytest.raises(ArtifactError, match="another network"):
        load_prior("cpu", tmp_path / "other.npz")


def test_weights_with_another_vocabulary_are_refused(tmp_path: Path) -> None:
    network = PriorNetwork(64)
    save_weights(tmp_path / "w.npz", network, network.flat(), Provenance({}, 0, {"vocabulary": "0" * 64}), {"step": 1})
    with pytest.raises(ArtifactError, match="vocabulary"):
        load_prior("cpu", tmp_path / "w.npz")


def test_damaged_weights_are_one_clear_error(tmp_path: Path) -> None:
    damaged = tmp_path / "prior.npz"
    damaged.write_bytes(WEIGHTS_FILE.read_bytes()[:5000])
    with pytest.raises(ArtifactError, match=re.escape(str(damaged))):
        load_prior("cpu", damaged)


def test_a_row_of_parameters_comes_back() -> None:
    network = PriorNetwork(64)
    values = np.linspace(-1, 1, network.flat().size).astype(np.float32)
    network.set_flat(values)
    assert np.array_equal(network.flat(), values)
