"""Guidance by Stable Diffusion, on a tiny random model in the real one's files. Needs the extra `sd`."""

import dataclasses
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

pytest.importorskip("diffusers", reason='needs pip install ".[sd]"')

from stages.core.artifact import load_npz, sha256_file
from stages.core.errors import InputError
from stages.core.schemas import MATERIAL
from stages.core.shading import Material, light_maps, shade
from stages.distill import schedule
from stages.distill.guidance import sd
from stages.distill.guidance.sd import StableDiffusionGuidance
from stages.distill.guidance.view_words import VIEW_WORDS, words_of
from stages.distill.options import DistillOptions, ScoreOptions
from stages.distill.parts import Claim
from stages.distill.regions import Regions, regional
from stages.distill.sampling import CropSampler, Sample
from stages.distill.stage import distill
from stages.distill.views import Views
from stages.sd import profile
from stages.sd.files import find_models
from stages.sd.memory import Plan
from stages.sd.models import StableDiffusion, load_models
from stages.sd.options import SdOptions
from tests.distill.examples import write_conditions
from tests.sd import tiny

CPU = torch.device("cpu")
SIZE = 24
LATENTS = 3


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tiny.write_models(tmp_path_factory.mktemp("sd"))
    write_conditions(folder / "conditions", size=SIZE)
    return folder


@pytest.fixture(scope="module")
def views(folder: Path) -> Views:
    return Views(folder / "conditions")


@pytest.fixture(scope="module")
def model(folder: Path) -> StableDiffusion:
    return load_models(find_models(sources(folder)), CPU, Plan())


def sources(folder: Path, **changes: Any) -> SdOptions:
    return SdOptions(str(folder / "sd"), str(folder / "controlnet"), **changes)


def guidance(model: StableDiffusion, views: Views, batch: int = 2, **options: Any) -> StableDiffusionGuidance:
    score = ScoreOptions(negative_prompt="bad", loss=options.pop("loss", "csd"), given=options.pop("given", "full"))
    chosen = DistillOptions(guidance="sd", prompt="oak", batch=batch, score=score, **options)
    return StableDiffusionGuidance(model, CropSampler(views, sd.view_size(views, model.files), batch, CPU), chosen, Regions())


def shown(made: StableDiffusionGuidance, seed: int = 0) -> tuple[Sample, Tensor]:
    sample = made.sampler.draw(torch.Generator().manual_seed(seed))
    count = len(sample.points)
    grey = Material(torch.full((count, 3), 0.3), torch.full((count,), 0.5), torch.zeros(count))
    return sample, shade(sample.transport, grey)


class Spy:
    """A model that notes what it is asked."""

    def __init__(self, model: StableDiffusion) -> None:
        self.model = model
        self.calls: list[tuple[Any, ...]] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self.model, name)

    def predict_noise(self, *arguments: Any) -> Tensor:
        self.calls.append(arguments)
        return self.model.predict_noise(*arguments)


def asked(model: StableDiffusion, views: Views, progress: float = 0.0, **options: Any) -> tuple[Any, ...]:
    """x_t, t, text, conditions and scale of the one call that a step makes, with its sample."""
    spy = Spy(model)
    made = guidance(spy, views, **options)  # type: ignore[arg-type]
    sample, radiance = shown(made)
    made.respond(radiance, sample, progress, torch.Generator().manual_seed(1))
    assert len(spy.calls) == 1
    return *spy.calls[0], sample


def test_the_profile_of_the_conditions_decides_on_normals_and_light_maps(model: StableDiffusion, tmp_path: Path) -> None:
    views = Views(write_conditions(tmp_path / "conditions", size=SIZE, profile="sd"))
    *_, conditions, _, sample = asked(model, views)
    images = sample.images
    assert images is not None and images.maps is not None
    mask = images.paint(torch.ones(len(sample.points), 1))
    lights = images.paint(2 * light_maps(sample.transport.to(torch.float32)).flatten(1))
    towards = images.paint(torch.tensor([[0.0, 0, 1]]).expand(len(sample.points), 3))
    expected = profile.prepare(images.paint(images.surface.depth[:, None]), towards, mask, lights)
    torch.testing.assert_close(conditions[: images.count], expected, rtol=0, atol=2e-3)


@pytest.mark.parametrize("loss", ["csd", "sds"])
def test_gradient_is_the_papers_from_three_separate_calls(model: StableDiffusion, views: Views, loss: str) -> None:
    """DreamMat, Eq. 7, and DreamFusion with guidance weight 100, each branch and image predicted by itself."""
    made, progress = guidance(model, views, loss=loss), 0.25
    sample, radiance = shown(made)
    response = made.respond(radiance, sample, progress, torch.Generator().manual_seed(7))

    images, leaf = sample.images, radiance.clone().requires_grad_()
    assert images is not None
    mask = images.paint(torch.ones(len(radiance), 1))
    latents = model.encode(profile.picture(images.paint(leaf), mask))
    generator = torch.Generator().manual_seed(7)
    t = torch.randint(20, 501, (2,), generator=generator)  # past step 500 of 3,000
    noise = torch.randn(latents.shape, generator=generator)
    a = model.alpha_bar[t][:, None, None, None]
    x_t = (a.sqrt() * latents + (1 - a).sqrt() * noise).detach()
    lights = images.paint(light_maps(sample.transport.to(torch.float32)).flatten(1))
    depth, normal = images.paint(images.surface.depth[:, None]), images.paint(images.surface.view_normals)
    conditions = profile.prepare(depth, normal, mask, lights)
    scale = 1.0 - 0.2 * min(1.0, 0.25 * 3000 / 700)

    def predict(prompts: list[str]) -> Tensor:
        rows = [slice(i, i + 1) for i in range(2)]
        texts = model.embed(prompts)
        return torch.cat([model.predict_noise(x_t[i], t[i], texts[i], conditions[i], scale) for i in rows])

    positive = predict([f"oak, {words}" for words in words_of(images)])
    null, negative = predict(["", ""]), predict(["bad", "bad"])
    eta2 = 1.0 - 0.5 * 0.25 * 3000 / 2000
    csd = 1.05 * positive + (eta2 - 1.05) * null - eta2 * negative
    sds = (1 + 100) * positive - 100 * null - noise
    score = (1 - a) * (csd if loss == "csd" else sds)
    (expected,) = torch.autograd.grad(latents, leaf, score)
    torch.testing.assert_close(response.gradient, expected / len(radiance), rtol=2e-3, atol=float(expected.abs().max()) * 1e-7)
    assert response.loss == pytest.approx(float(score.square().mean().sqrt()), rel=1e-4)
    assert torch.isfinite(response.gradient).all() and response.gradient.abs().mean() > 0


def test_one_call_holds_all_branches_alike(model: StableDiffusion, views: Views) -> None:
    x_t, t, text, conditions, _, sample = asked(model, views)
    assert len(x_t) == len(t) == len(text) == len(conditions) == 6
    for values in (x_t, t, conditions):
        assert torch.equal(values[:2], values[2:4]) and torch.equal(values[:2], values[4:])
    expected = model.embed([*(f"oak, {words}" for words in words_of(sample.images)), "", "", "bad", "bad"])
    torch.testing.assert_close(text, expected)


def test_prompts_follow_the_camera(model: StableDiffusion, views: Views) -> None:
    spy = Spy(model)
    made = guidance(spy, views, batch=4)  # type: ignore[arg-type]
    seen = set()
    for seed in range(6):
        sample, radiance = shown(made, seed)
        made.respond(radiance, sample, 0.0, torch.Generator().manual_seed(1))
        words = words_of(sample.images)  # type: ignore[arg-type]
        torch.testing.assert_close(spy.calls[-1][2][:4], model.embed([f"oak, {w}" for w in words]))
        seen |= set(words)
    assert seen >= {"front view", "side view", "back view"} and seen <= set(VIEW_WORDS)


@pytest.mark.parametrize("progress", [0.0, 0.1, 0.9])
def test_control_weakens(model: StableDiffusion, views: Views, progress: float) -> None:
    assert asked(model, views, progress)[4] == schedule.control_scale(progress)


def test_given_chooses_the_conditions(model: StableDiffusion, views: Views) -> None:
    full, geometry, light, none = (asked(model, views, given=g)[3] for g in ("full", "geometry", "light", "none"))
    assert none is None
    assert full[:, profile.GEOMETRY].std() > 0.05 and full[:, profile.LIGHT].std() > 0.05
    assert torch.equal(geometry[:, profile.GEOMETRY], full[:, profile.GEOMETRY]) and geometry[:, profile.LIGHT].eq(0).all()
    assert torch.equal(light[:, profile.LIGHT], full[:, profile.LIGHT]) and light[:, profile.GEOMETRY].eq(0).all()


def test_same_generator_same_gradient(model: StableDiffusion, views: Views) -> None:
    made = guidance(model, views)
    sample, radiance = shown(made)
    a, b, c = (made.respond(radiance, sample, 0.1, torch.Generator().manual_seed(s)).gradient for s in (1, 1, 2))
    assert torch.equal(a, b) and not torch.equal(a, c)


@pytest.mark.parametrize("level", [0.0, 1e-6, 1e5])
def test_gradient_is_finite_from_black_to_the_sun(folder: Path, views: Views, level: float) -> None:
    """In the precisions of a GPU."""
    cast = load_models(find_models(sources(folder)), CPU, Plan())
    cast.denoiser.half(), cast.vae.to(torch.bfloat16)
    made = guidance(cast, views, loss="sds")
    sample, radiance = shown(made)
    response = made.respond(torch.full_like(radiance, level), sample, 0.0, torch.Generator().manual_seed(1))
    assert torch.isfinite(response.gradient).all() and response.gradient.abs().max() > 0


def test_views_of_another_size_are_one_line(model: StableDiffusion, tmp_path: Path) -> None:
    odd = Views(write_conditions(tmp_path / "conditions", size=22))
    with pytest.raises(InputError, match=r"conditions: views are 22 x 22 pixels, expected a multiple of 4 .*--size 512"):
        sd.view_size(odd, model.files)


def test_crops_are_whole_views_pixel_for_pixel(model: StableDiffusion, views: Views) -> None:
    made = guidance(model, views, batch=1)
    for seed in range(4):
        sample = made.sampler.draw(torch.Generator().manual_seed(seed))
        assert sample.images is not None and sample.images.size == SIZE
        view = sample.source[0][0]
        assert np.array_equal(sample.images.pixel.numpy(), views.pixels(view))


def options(folder: Path, **changes: Any) -> DistillOptions:
    return dataclasses.replace(DistillOptions(guidance="sd", sd=sources(folder), prompt="oak", steps=4), **changes)


def test_run_records_models_and_weights(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "material.npz"
    distill(folder / "conditions", out, options(folder))
    made = load_npz(out, MATERIAL).provenance
    weights = folder / "sd/unet/diffusion_pytorch_model.safetensors"
    assert made.inputs["unet"] == sha256_file(weights)
    assert set(made.inputs) == {"conditions", "prep", "unet", "vae", "text_encoder", "controlnet"}
    identity = made.extra["guidance"]
    assert identity["sd_model"] == "sd" and identity["controlnet"] == "controlnet"
    assert identity["weights"]["unet"] == "diffusion_pytorch_model.safetensors" and identity["prediction"] == "epsilon"
    recorded = {name: made.options[name] for name in ("eta1", "eta2", "posterior", "steps", "learning_rate")}
    assert recorded == {"eta1": 1.05, "eta2": [1.0, 0.5], "posterior": 0.0, "steps": 4, "learning_rate": 0.01}
    assert str(folder) not in str(made)


def test_interrupted_run_ends_in_the_same_bytes_and_memory_does_not_matter(folder: Path, tmp_path: Path) -> None:
    whole, broken = tmp_path / "whole.npz", tmp_path / "broken.npz"

    def stop(what: str, done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    distill(folder / "conditions", whole, options(folder))
    with pytest.raises(KeyboardInterrupt):
        distill(folder / "conditions", broken, options(folder), progress=stop)
    assert distill(folder / "conditions", broken, options(folder)).resumed == 2
    assert whole.read_bytes() == broken.read_bytes()
    assert distill(folder / "conditions", whole, options(folder, sd=sources(folder, vram=8))).up_to_date


def dreammat(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "dreammat_cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, env={**os.environ, **environment})


def test_command_line_with_a_model_in_the_hubs_cache(folder: Path, tmp_path: Path) -> None:
    """HF_HOME is honoured: an id is found there without a network, and the result is that of the same folder."""
    home, commit = tmp_path / "home", "0" * 40
    for name in ("sd", "controlnet"):
        cached = home / f"hub/models--someone--{name}"
        shutil.copytree(folder / name, cached / "snapshots" / commit)
        (cached / "refs").mkdir()
        (cached / "refs/main").write_text(commit)
    out = tmp_path / "material.npz"
    common = ("distill", folder / "conditions", "-o", out, "--guidance", "sd", "--prompt", "oak", "--steps", 3)
    ids = ("--sd-model", "someone/sd", "--controlnet", "someone/controlnet", "--vram", 12)
    offline = {"HF_HOME": str(home), "HF_HUB_OFFLINE": "1"}
    result = dreammat(*common, *ids, **offline)
    assert result.returncode == 0, result.stderr
    assert load_npz(out, MATERIAL).provenance.extra["guidance"]["sd_model"] == "sd"
    again = dreammat(*common, "--sd-model", folder / "sd", "--controlnet", folder / "controlnet", **offline)
    assert "up to date" in again.stdout, again.stderr


def test_the_gradient_of_a_parts_pixels_depends_on_its_own_prompt(model: StableDiffusion, views: Views) -> None:
    """Another prompt for the upper half changes what is predicted of the latents that show it, and of no others."""
    sampler = CropSampler(views, sd.view_size(views, model.files), 2, CPU)
    sample = sampler.draw(torch.Generator().manual_seed(0))
    images = sample.images
    assert images is not None

    def asked(upper: str) -> tuple[Tensor, Tensor, Tensor]:
        regions = Regions([Claim(0, "upper", upper, (1,))])
        made = StableDiffusionGuidance(model, sampler, DistillOptions(guidance="sd", prompt="oak", batch=2), regions)
        areas = regions.areas(images, sample, LATENTS)

        def noise(x_t: Tensor, t: Tensor, prompts: list[int], others: int) -> Tensor:
            return model.predict_noise(x_t, t, made._branches(images, prompts, others), None, 1.0)

        x_t = torch.randn((2, 4, LATENTS, LATENTS), generator=torch.Generator().manual_seed(1))
        predicted = regional(noise, areas)(x_t.repeat(3, 1, 1, 1), torch.tensor([300, 500] * 3), 3)
        _, radiance = shown(made)
        return predicted, areas.weights[1], made.respond(radiance, sample, 0.0, torch.Generator().manual_seed(1)).gradient

    (steel, weight, gradient), (gold, _, other) = asked("steel"), asked("gold")
    shows = (weight > 0).expand(-1, steel.shape[1], -1, -1)
    changed = steel[:2] != gold[:2]
    assert 0.1 < float(shows.float().mean()) < 0.9
    assert not changed[~shows].any() and changed[shows].float().mean() > 0.99
    assert torch.equal(steel[2:], gold[2:])  # no prompt, and the negative one
    upper = sample.label == 1
    assert (gradient - other)[upper].abs().mean() > 0.01 * gradient[upper].abs().mean()
