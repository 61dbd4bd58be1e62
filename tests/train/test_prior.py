"""A miniature training run: tiny, but every part of the real one."""

import dataclasses
import itertools
from pathlib import Path

import numpy as np
import pytest
import torch

from stages.core.artifact import Provenance, load_npz, sha256_file
from stages.core.errors import NumericalError
from stages.core.images import read_image
from stages.core.progress import silent
from stages.prior.model import VOCABULARY_FILE, PriorNetwork, load_prior, save_weights
from stages.prior.vocabulary import Vocabulary
from stages.train import batches, prior, render, samples
from stages.train.batches import CaptionBatches, PictureBatches, Tiles
from stages.train.options import TrainPriorOptions

OPTIONS = TrainPriorOptions(
    steps=6, text_steps=2, batch=2, shards=1, tiles=3, seed=3, checkpoint_every=3, sample_every=100
)


@pytest.fixture(scope="module")
def shards(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(render, "LIGHTS", 2)
        return render.render_shards(tmp_path_factory.mktemp("tiles") / "shards", 1, 3, 3, silent)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch, shards: list[Path]) -> None:
    monkeypatch.setattr(prior, "render_shards", lambda *_: shards)
    monkeypatch.setattr(prior, "CAPTIONS", 4)
    monkeypatch.setattr(prior, "write_samples", lambda *_: None)


def test_batches_depend_on_seed_and_step_alone(shards: list[Path]) -> None:
    tiles = Tiles(shards)
    one, again, other = (PictureBatches(tiles, 2, 0)[step] for step in (5, 5, 6))
    assert torch.equal(one.image, again.image) and one.captions == again.captions
    assert not torch.equal(one.image, other.image)
    assert one.image.shape == (2, 3, 64, 64) and one.conditions.shape == (2, 23, 64, 64)
    outside = one.mask.expand_as(one.image) == 0
    assert one.image[outside].eq(-1).all() and torch.isfinite(one.image).all()
    assert one.material.min() >= 0 and one.material.max() <= 1


def test_a_material_is_seen_in_tiles_of_its_shape_under_lights_of_their_own(shards: list[Path]) -> None:
    tiles = Tiles(shards)
    assert sum(len(tiles[k].mask) for k in range(len(tiles))) == 3, "each tile belongs to one shape"
    shape = max((tiles[k] for k in range(len(tiles))), key=lambda shape: len(shape.mask))
    caption, some = batches.pictures(shape, np.random.default_rng(4))
    assert caption and len(some) == batches.TILES * batches.LIGHTINGS and len(shape.mask) >= batches.TILES
    assert all(not np.allclose(a, b) for a, b in itertools.combinations(some, 2))
    for first in range(0, len(some), batches.LIGHTINGS):
        one, other = (np.sort(dense[-5:].reshape(5, -1), 1) for dense in some[first : first + 2])
        assert np.array_equal(one, other), "a tile's material does not know its light, mirrored or not"
        assert any((some[first][0].sum(0) == mask.sum(0)).all() or (some[first][0].sum(0) == mask.sum(0)[::-1]).all()
                   for mask in shape.mask)  # fmt: skip


def test_phrases_and_their_materials_agree_in_number() -> None:
    batch = CaptionBatches(40, 0)[0]
    assert len(batch.captions) == 40 and batch.coats.shape == (40, 5)
    assert batch.coats.min() >= 0 and batch.coats.max() <= 1 and 0 < batch.coats[:, 4].mean() < 1


def test_training_resumes_to_the_same_bytes(tmp_path: Path, quick: None) -> None:
    whole = prior.train_prior(tmp_path / "whole", OPTIONS)
    stopped = tmp_path / "stopped"

    def stop_after_four(what: str, done: int, total: int) -> None:
        if done == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        prior.train_prior(stopped, OPTIONS, progress=stop_after_four)
    resumed = prior.train_prior(stopped, OPTIONS)
    assert whole.step == resumed.step == OPTIONS.steps
    first, second = (load_npz(folder / "checkpoint.npz", prior.CHECKPOINT) for folder in (tmp_path / "whole", stopped))
    for name in ("parameters", "average", "moment_1", "moment_2"):
        assert np.array_equal(first[name], second[name]), name
    assert np.array_equal(first["curve"][:, :4], second["curve"][:, :4])


def test_more_steps_go_on_from_where_a_run_ended(tmp_path: Path, quick: None) -> None:
    prior.train_prior(tmp_path, OPTIONS)
    first = load_npz(tmp_path / "checkpoint.npz", prior.CHECKPOINT)
    longer = prior.train_prior(tmp_path, dataclasses.replace(OPTIONS, steps=8))
    second = load_npz(tmp_path / "checkpoint.npz", prior.CHECKPOINT)
    assert longer.step == 8 and np.array_equal(second["curve"][:6], first["curve"])
    assert prior.train_prior(tmp_path, OPTIONS).up_to_date, "fewer were done long ago"


def test_training_begins_with_what_fits_of_earlier_weights(tmp_path: Path) -> None:
    earlier, wider = PriorNetwork(8), PriorNetwork(12)  # of other word vectors
    save_weights(tmp_path / "w.npz", earlier, earlier.flat(), Provenance({}, 0, {}), {"step": 1})
    prior.begin_with(wider, tmp_path / "w.npz")
    assert torch.equal(wider.denoiser.enter.weight, earlier.denoiser.enter.weight.half().float())
    project = wider.text.project.weight
    assert torch.equal(project[:, :8], earlier.text.project.weight.half().float()) and bool((project[:, 8:] == 0).all())


def test_a_finished_run_is_up_to_date_and_its_weights_load(tmp_path: Path, quick: None) -> None:
    done = prior.train_prior(tmp_path, OPTIONS)
    before = sha256_file(done.weights)
    assert prior.train_prior(tmp_path, OPTIONS).up_to_date
    assert sha256_file(done.weights) == before
    loaded = load_prior("cpu", done.weights)
    assert loaded.identity["training"]["step"] == OPTIONS.steps
    assert (tmp_path / "curve.csv").read_text().count("\n") == OPTIONS.steps + 1


def test_losses_fall_on_one_batch(shards: list[Path]) -> None:
    torch.manual_seed(0)
    vocabulary = Vocabulary.load(VOCABULARY_FILE)
    state = prior.State(PriorNetwork(vocabulary.vectors.shape[1]), torch.device("cpu"))
    batch, captions = PictureBatches(Tiles(shards), 2, 0)[0], CaptionBatches(8, 0)[0]
    alpha_bar = prior.diffusion.cosine_schedule()
    losses = []
    for _ in range(12):
        generator = torch.Generator().manual_seed(1)
        noise, material = prior.picture_losses(state.network, vocabulary, batch, alpha_bar, generator)
        text = prior.reader_loss(state.network, vocabulary, captions, generator)
        (noise + material + text).backward()
        state.update(2e-3)
        losses.append([float(noise.detach()), float(material.detach()), float(text.detach())])
    assert (np.array(losses[-1]) < 0.8 * np.array(losses[0])).all(), losses


def test_a_gradient_that_is_not_finite_stops_the_run() -> None:
    state = prior.State(PriorNetwork(64), torch.device("cpu"))
    state.gradient[0] = torch.inf
    with pytest.raises(NumericalError, match="step 0"):
        state.update(1e-3)


def test_the_rate_warms_up_in_both_phases_and_falls() -> None:
    options = TrainPriorOptions(steps=4000, text_steps=500)
    rate = np.array([prior.learning_rate(step, options) for step in range(4000)])
    assert rate[0] < 0.01 * rate[400] and rate[500] < 0.01 * rate[400]
    assert rate.max() == options.learning_rate and rate[-1] < 0.06 * rate.max() and rate.min() > 0


def test_sample_sheets_are_pictures(tmp_path: Path, quick: None, shards: list[Path], monkeypatch) -> None:
    done = prior.train_prior(tmp_path, OPTIONS)
    monkeypatch.setattr(samples, "PROMPTS", ("gold", "oak"))
    monkeypatch.setattr(samples, "ROWS", 1)
    samples.write_samples(tmp_path / "sheet.png", done.weights, Tiles(shards), OPTIONS)
    sheet = read_image(tmp_path / "sheet.png")
    assert sheet.shape == (64, 3 * 64, 3) and sheet.std() > 0.01
