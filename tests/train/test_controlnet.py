"""A ControlNet trained on the tiny base: the run itself, and that what comes out follows the light. Needs the extra `sd`."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

pytest.importorskip("diffusers", reason='needs pip install ".[sd]"')

from stages.core import diffusion
from stages.core.artifact import MANIFEST, load_npz, read_manifest, sha256_file
from stages.core.errors import ArtifactError, InputError, NumericalError
from stages.core.images import read_image
from stages.core.schemas import MATERIAL
from stages.distill.options import DistillOptions
from stages.distill.stage import distill
from stages.light.environment import Environment, directions_of_texels, save_environment
from stages.sd.files import find_base, find_models
from stages.sd.memory import Plan
from stages.sd.models import (
    StableDiffusion,
    load_for_training,
    load_models,
    load_text_encoder,
    write_untrained_controlnet,
)
from stages.sd.options import SdOptions
from stages.sd.profile import GEOMETRY, LIGHT
from stages.train import controlnet
from stages.train.controlnet import train_controlnet
from stages.train.controlnet_state import CHECKPOINT, TRAINED
from stages.train.options import PicturesOptions, TrainControlnetOptions
from stages.train.picture_batches import Draws, Pictures, batch_of
from stages.train.pictures import render_pictures
from tests.distill.examples import painted_sphere, write_conditions
from tests.sd import tiny

CPU = torch.device("cpu")
SIZE = 16
VIEWS, LIGHTS = 4, 2
LATENT_SCALE = 4.5
"""Brings the latents of the tiny VAE to a deviation of 1, as Stable Diffusion's have it."""


def write_base(folder: Path, prediction: str) -> Path:
    tiny.write_models(folder, prediction)
    tiny.change_config(folder / "sd/vae/config.json", scaling_factor=LATENT_SCALE)
    return folder / "sd"


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_base(tmp_path_factory.mktemp("base"), "v_prediction")


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight: four views of a ball, lit warm from above and cold from below."""
    folder = tmp_path_factory.mktemp("pictures")
    painted_sphere(folder / "ball.glb")
    (folder / "captions.json").write_text('{"ball.glb": "a ball"}')
    z = directions_of_texels(32, 64)[0][..., 2:]
    for name, where, color in (("above", z > 0.3, (2, 0.6, 0.2)), ("below", z < -0.3, (0.2, 0.6, 2))):
        save_environment(folder / f"{name}.exr", Environment(name, (0.05 + where * np.array(color)).astype(np.float32)))
    env = (str(folder / "above.exr"), str(folder / "below.exr"))
    options = PicturesOptions(folder / "captions.json", env=env, lights=LIGHTS, views=VIEWS, size=SIZE)
    render_pictures(folder, folder / "out", options)
    return folder / "out"


@pytest.fixture(autouse=True)
def fresh_accelerate() -> Iterator[None]:
    """Accelerate keeps its state for the life of a process, which trains once outside tests."""
    from accelerate.state import AcceleratorState

    AcceleratorState._reset_state(True)
    yield
    AcceleratorState._reset_state(True)


def options(base: Path, **changes: object) -> TrainControlnetOptions:
    chosen = {"sd_model": str(base), "steps": 4, "batch": 4, "at_once": 4, "learning_rate": 8e-3, "sample_every": 10**6}
    return TrainControlnetOptions(**(chosen | changes))


@pytest.fixture(scope="module")
def trained(base: Path, pictures: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("trained")
    train_controlnet(pictures, out, options(base, steps=200, batch=8, at_once=8))
    return out


def load(base: Path, folder: Path) -> StableDiffusion:
    """As `distill` does."""
    return load_models(find_models(SdOptions(str(base), str(folder))), CPU, Plan())


def curve(out: Path) -> np.ndarray:
    return np.loadtxt(out / "curve.csv", delimiter=",", skiprows=1)


# ------------------------------------------------------------------------------------- what is learnt


def test_the_loss_falls(trained: Path) -> None:
    loss = curve(trained)[:, 1]
    assert len(loss) == 200 and loss[-20:].mean() < 0.75 * loss[:20].mean()


def followed(model: StableDiffusion, data: Pictures, t: int) -> Tensor:
    """How far a predicted clean picture goes, from halfway between the pictures in both lights, to that of its own light.

    What is denoised is halfway, too, so that the conditions alone tell the light. Returns: (VIEWS,), mean over the lights: 1
    is all the way, -1 to the other light's, and 0 what a model gets that does the same in either light.
    """
    a, text, result = model.alpha_bar[t], model.embed(["a ball"]), []
    for view in range(VIEWS):
        shown = [data[LIGHTS * view + k] for k in range(LIGHTS)]
        warm, cold = (model.encode(picture[None]) for picture, _, _ in shown)
        noise = torch.randn(warm.shape, generator=torch.Generator().manual_seed(view))
        halfway, across = (warm + cold) / 2, (warm - cold) / 2
        x_t = a.sqrt() * halfway + (1 - a).sqrt() * noise
        for (_, conditions, _), side in zip(shown, (1, -1), strict=True):
            predicted = model.predict_noise(x_t, torch.tensor([t]), text, conditions[None], 1.0)
            x_0 = (x_t - (1 - a).sqrt() * predicted) / a.sqrt()
            result.append(side * ((x_0 - halfway) * across).sum() / across.square().sum())
    return torch.stack(result).view(VIEWS, LIGHTS).mean(1)


@pytest.mark.parametrize("t", [500, 800, 950])
def test_the_light_is_followed(base: Path, pictures: Path, trained: Path, tmp_path: Path, t: int) -> None:
    data = Pictures(pictures)
    assert followed(load(base, trained / "controlnet"), data, t).min() > 0.1
    untrained = train_controlnet(pictures, tmp_path, options(base, steps=1, batch=1, at_once=1, learning_rate=0.0))
    assert followed(load(base, untrained.controlnet), data, t).abs().max() < 1e-4


def test_distill_takes_it(base: Path, trained: Path, tmp_path: Path) -> None:
    conditions = write_conditions(tmp_path / "conditions", size=24)
    sources = SdOptions(str(base), str(trained / "controlnet"))
    distill(conditions, tmp_path / "m.npz", DistillOptions(prompt="gold", guidance="sd", sd=sources, steps=2))
    recorded = load_npz(tmp_path / "m.npz", MATERIAL).provenance
    files = read_manifest(trained / "controlnet", TRAINED)[1]
    assert files["diffusion_pytorch_model.safetensors"] in recorded.inputs.values()


def test_a_sample_sheet_is_left(trained: Path) -> None:
    sheet = read_image(trained / "samples_000200.png")
    assert sheet.shape == (4 * SIZE, 4 * SIZE, 3) and sheet.std() > 0.05


# ------------------------------------------------------------------------------------- the run


def test_a_stopped_run_ends_in_the_same_bytes(base: Path, pictures: Path, tmp_path: Path) -> None:
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    chosen = options(base, steps=5, at_once=2, checkpoint_every=2)
    train_controlnet(pictures, whole, chosen)

    def stop_after_three(what: str, done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train_controlnet(pictures, stopped, chosen, progress=stop_after_three)
    assert train_controlnet(pictures, stopped, chosen).step == 5
    first, second = (load_npz(folder / "checkpoint.npz", CHECKPOINT) for folder in (whole, stopped))
    for name in ("parameters", "average", "moment_1", "moment_2"):
        assert np.array_equal(first[name], second[name]), name
    assert np.array_equal(first["curve"][:, :2], second["curve"][:, :2])
    for name in ("diffusion_pytorch_model.safetensors", "config.json", MANIFEST):
        assert sha256_file(whole / "controlnet" / name) == sha256_file(stopped / "controlnet" / name)


def test_how_a_batch_is_divided_makes_no_difference(base: Path, pictures: Path, tmp_path: Path) -> None:
    for at_once in (1, 4):
        train_controlnet(pictures, tmp_path / str(at_once), options(base, at_once=at_once))
    np.testing.assert_allclose(curve(tmp_path / "1")[:, 1], curve(tmp_path / "4")[:, 1], rtol=1e-3)


def test_more_steps_continue_and_done_is_done(base: Path, pictures: Path, tmp_path: Path) -> None:
    train_controlnet(pictures, tmp_path, options(base, steps=2))
    before = curve(tmp_path)
    assert train_controlnet(pictures, tmp_path, options(base, steps=3)).step == 3
    assert np.array_equal(curve(tmp_path)[:2], before)
    again = train_controlnet(pictures, tmp_path, options(base, steps=3))
    assert again.up_to_date and again.step == 3


def test_another_run_does_not_overwrite_a_checkpoint(base: Path, pictures: Path, tmp_path: Path) -> None:
    train_controlnet(pictures, tmp_path, options(base, steps=1))
    with pytest.raises(ArtifactError, match="another -o, or --force"):
        train_controlnet(pictures, tmp_path, options(base, steps=1, seed=1))
    assert train_controlnet(pictures, tmp_path, options(base, steps=1, seed=1), force=True).step == 1
    assert load_npz(tmp_path / "checkpoint.npz", CHECKPOINT).provenance.seed == 1


def test_mixed_precision_learns_the_same(base: Path, pictures: Path, tmp_path: Path) -> None:
    from accelerate.state import AcceleratorState

    for precision in ("no", "bf16"):
        AcceleratorState._reset_state(True)
        train_controlnet(pictures, tmp_path / precision, options(base, precision=precision))
    found, exact = curve(tmp_path / "bf16")[:, 1], curve(tmp_path / "no")[:, 1]
    np.testing.assert_allclose(found, exact, rtol=0.05)
    assert not np.array_equal(found, exact)


def test_what_cannot_be_trained_is_one_line(
    base: Path, pictures: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ACCELERATE_USE_CPU", "1")
    with pytest.raises(InputError, match="--batch 4: not a multiple of 3"):
        train_controlnet(pictures, tmp_path, options(base, at_once=3))
    with pytest.raises(InputError, match="--precision fp16: not on this machine"):
        train_controlnet(pictures, tmp_path, options(base, precision="fp16"))
    with pytest.raises(InputError, match="--sd-model: not given"):
        train_controlnet(pictures, tmp_path, TrainControlnetOptions())
    with pytest.raises(ArtifactError, match="dreammat train pictures"):
        train_controlnet(tmp_path, tmp_path / "out", options(base))
    with pytest.raises(InputError, match=r"pictures of 18 pixels, expected a multiple of 4"):
        controlnet.check_size(pictures, 18, find_models(SdOptions(str(base), str(base.parent / "controlnet"))))


def test_a_loss_that_is_not_finite_stops_the_run(
    base: Path, pictures: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    true_loss = controlnet.noise_loss
    monkeypatch.setattr(controlnet, "noise_loss", lambda *given: torch.nan * true_loss(*given))
    with pytest.raises(NumericalError, match="step 0: the loss is not finite, seed 0"):
        train_controlnet(pictures, tmp_path, options(base))
    assert not (tmp_path / "checkpoint.npz").exists()


# ------------------------------------------------------------------------------------- its parts


def test_draws_follow_from_seed_and_number_alone(base: Path, pictures: Path) -> None:
    draws = Draws(Pictures(pictures), (4, 8, 8), options(base))
    one, again, other = draws[5], draws[5], draws[6]
    assert torch.equal(one.noise, again.noise) and torch.equal(one.picture, again.picture) and one.t == again.t
    assert not torch.equal(one.noise, other.noise)
    assert batch_of([one, other]).noise.shape == (2, 4, 8, 8)


def test_conditions_and_prompts_are_dropped_as_often_as_asked(base: Path, pictures: Path) -> None:
    dropped = {"no_prompt": 0.5, "no_geometry": 0.25, "no_light": 0.125}
    draws = Draws(Pictures(pictures), (4, 8, 8), options(base, **dropped))
    seen = [draws[i] for i in range(300)]
    found = {
        "no_prompt": [d.caption == "" for d in seen],
        "no_geometry": [not d.conditions[GEOMETRY].any() for d in seen],
        "no_light": [not d.conditions[LIGHT].any() for d in seen],
    }
    for name, share in dropped.items():
        assert abs(np.mean(found[name]) - share) < 4 * np.sqrt(share * (1 - share) / 300), name
    assert abs(np.mean([float(d.t) for d in seen]) - 500) < 4 * 289 / np.sqrt(300)


@pytest.mark.parametrize("prediction", ["epsilon", "v_prediction"])
def test_the_loss_is_of_what_the_scheduler_says(pictures: Path, tmp_path: Path, prediction: str) -> None:
    """A ControlNet that is not trained yet leaves the base alone, whose error is easily told."""
    base = write_base(tmp_path, prediction)
    _, (unet, vae, _) = find_base(str(base))
    write_untrained_controlnet(tmp_path / "new", unet, vae, 0)
    model = load_for_training(find_models(SdOptions(str(base), str(tmp_path / "new"))), CPU, torch.float32)
    text = load_text_encoder(model.files)
    draws = Draws(Pictures(pictures), (4, 8, 8), options(base))
    batch = batch_of([draws[i] for i in range(3)])
    with torch.no_grad():
        loss = controlnet.noise_loss(model, text, batch)
        clean, a = model.encode(batch.picture), model.alpha_bar[batch.t][:, None, None, None]
        x_t = a.sqrt() * clean + (1 - a).sqrt() * batch.noise
        predicted = model.denoiser.unet(x_t, batch.t, text.embed(batch.captions)).sample
    v = a.sqrt() * batch.noise - (1 - a).sqrt() * clean
    target: Tensor = v if prediction == "v_prediction" else batch.noise
    assert float(loss) == pytest.approx(float((predicted - target).square().mean()), rel=1e-5)
    trainable = {name for name, p in model.denoiser.named_parameters() if p.requires_grad}
    assert trainable == {name for name, _ in model.denoiser.named_parameters() if name.startswith("controlnet.")}


def test_ddim_without_limits_undoes_a_known_noise() -> None:
    """The limits of toned pictures would cut latents of 5."""
    alpha_bar, clean = diffusion.cosine_schedule(), torch.full((1, 1, 2, 2), 5.0)

    def predict(x_t: Tensor, t: Tensor) -> Tensor:
        a = alpha_bar[t][:, None, None, None]
        return (x_t - a.sqrt() * clean) / (1 - a).sqrt()

    found = diffusion.ddim(alpha_bar, predict, torch.randn(1, 1, 2, 2, generator=torch.Generator()), 5, (-9.0, 9.0))
    torch.testing.assert_close(found, clean, rtol=1e-3, atol=1e-3)


def test_options_that_do_not_shape_the_result_may_change() -> None:
    shaping = set(controlnet.learnt_from(TrainControlnetOptions()))
    assert shaping == {"batch", "learning_rate", "no_prompt", "no_geometry", "no_light", "seed"}
    assert set(controlnet.FREE) | shaping == {f.name for f in dataclasses.fields(TrainControlnetOptions)}
