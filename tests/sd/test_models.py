"""The loaded models against diffusers' own classes, called one by one. Needs the extra `sd`."""

from pathlib import Path

import pytest
import torch
from torch import Tensor

pytest.importorskip("diffusers", reason='needs pip install ".[sd]"')

from stages.core.errors import InputError
from stages.sd import memory, models
from stages.sd.files import find_models
from stages.sd.memory import Plan
from stages.sd.models import StableDiffusion, load_models
from stages.sd.options import SdOptions
from tests.sd import tiny

CPU = torch.device("cpu")
S = 16


def load(folder: Path, plan: Plan = Plan()) -> StableDiffusion:  # noqa: B008
    return load_models(find_models(SdOptions(str(folder / "sd"), str(folder / "controlnet"))), CPU, plan)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tiny.write_models(tmp_path_factory.mktemp("models"))


@pytest.fixture(scope="module")
def model(folder: Path) -> StableDiffusion:
    return load(folder)


def inputs(count: int = 2) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """x_t, t, text, conditions."""
    generator = torch.Generator().manual_seed(0)
    x_t = torch.randn(count, 4, S // 2, S // 2, generator=generator)
    text = torch.randn(count, tiny.TOKENS, tiny.WIDTH, generator=generator)
    return x_t, torch.tensor([3, 900, 500])[:count], text, torch.rand(count, 22, S, S, generator=generator)


def pictures(count: int = 2) -> Tensor:
    return torch.rand(count, 3, S, S, generator=torch.Generator().manual_seed(1), requires_grad=True)


def test_prediction_is_that_of_controlnet_and_unet(model: StableDiffusion) -> None:
    x_t, t, text, conditions = inputs()
    unet, controlnet = model.denoiser.unet, model.denoiser.controlnet
    with torch.no_grad():
        down, middle = controlnet(x_t, t, text, conditions, conditioning_scale=0.8, return_dict=False)
        steered = {"down_block_additional_residuals": down, "mid_block_additional_residual": middle}
        expected = unet(x_t, t, encoder_hidden_states=text, **steered).sample
        alone = unet(x_t, t, encoder_hidden_states=text).sample
    torch.testing.assert_close(model.predict_noise(x_t, t, text, conditions, 0.8), expected)
    assert torch.equal(model.predict_noise(x_t, t, text, None, 0.8), alone)
    assert (expected - alone).abs().mean() > 0.01  # or the ControlNet would not be seen to matter


def test_velocity_becomes_noise(model: StableDiffusion, tmp_path: Path) -> None:
    """v = sqrt(a) eps - sqrt(1 - a) x_0: the same networks, read as predicting v."""
    other = load(tiny.write_models(tmp_path, prediction="v_prediction"))
    x_t, t, text, conditions = inputs()
    v = model.predict_noise(x_t, t, text, conditions, 1.0)  # of a base that is said to predict eps
    a = model.alpha_bar[t].double()[:, None, None, None]
    x0 = a.sqrt() * x_t - (1 - a).sqrt() * v
    noise = (x_t - a.sqrt() * x0) / (1 - a).sqrt()
    found = other.predict_noise(x_t, t, text, conditions, 1.0)
    torch.testing.assert_close(found.double(), noise, rtol=1e-3, atol=1e-3)
    assert (found - v).abs().max() > 0.1


def test_schedule_is_stable_diffusions(model: StableDiffusion) -> None:
    beta = torch.linspace(0.00085**0.5, 0.012**0.5, 1000, dtype=torch.float64) ** 2
    torch.testing.assert_close(model.alpha_bar.double(), (1 - beta).cumprod(0), rtol=1e-5, atol=0)


def test_text_is_that_of_diffusers_own_pipeline(folder: Path, model: StableDiffusion) -> None:
    from diffusers import StableDiffusionPipeline
    from transformers import CLIPTextModel, CLIPTokenizer

    tokenizer = CLIPTokenizer.from_pretrained(folder / "sd/tokenizer")
    encoder = CLIPTextModel.from_pretrained(folder / "sd/text_encoder")
    parts = {"vae": None, "unet": model.denoiser.unet, "scheduler": None, "safety_checker": None, "feature_extractor": None}
    pipeline = StableDiffusionPipeline(tokenizer=tokenizer, text_encoder=encoder, **parts, requires_safety_checker=False)
    prompts = ["gold, front view", "", "zzz"]
    expected, _ = pipeline.encode_prompt(prompts, CPU, 1, False)
    found = model.embed(prompts)
    assert found.shape == (3, tiny.TOKENS, tiny.WIDTH) and torch.equal(found, expected)
    assert (found[0] - found[1]).abs().max() > 0.1


def test_a_prompt_that_is_too_long_is_one_line(model: StableDiffusion) -> None:
    with pytest.raises(InputError, match=rf'--prompt "abcdefgh.*longer than the {tiny.TOKENS - 2} tokens'):
        model.embed(["gold", 3 * "abcdefghijklmnopqrstuvwxyz"])


def test_latents_are_the_encoders_mean(folder: Path, model: StableDiffusion) -> None:
    from diffusers import AutoencoderKL

    vae = AutoencoderKL.from_pretrained(folder / "sd/vae")
    picture = pictures()
    expected = vae.encode(2 * picture - 1).latent_dist.mean * vae.config.scaling_factor
    assert torch.equal(model.encode(picture), expected)


def test_latents_gradient_is_that_of_finite_differences(folder: Path) -> None:
    model = load(folder)
    model.vae.double()
    picture = pictures(1).detach().double().requires_grad_()
    direction = torch.randn(picture.shape, generator=torch.Generator().manual_seed(2), dtype=torch.float64)
    score = torch.randn(1, 4, S // 2, S // 2, generator=torch.Generator().manual_seed(3))
    (gradient,) = torch.autograd.grad(model.encode(picture), picture, score)
    h = 1e-3  # latents are handed on in float32
    with torch.no_grad():
        rise = (model.encode(picture + h * direction) - model.encode(picture - h * direction)) / (2 * h)
    assert float((gradient * direction).sum()) == pytest.approx(float((rise * score).sum()), rel=1e-2)


def test_precisions_of_a_gpu_stay_finite_and_near_float32(folder: Path, model: StableDiffusion) -> None:
    """As `load_models` casts them there: half for the denoiser, bfloat16 for the VAE; with strong and with weak scores."""
    cast = load(folder)
    cast.denoiser.half(), cast.vae.to(torch.bfloat16)
    x_t, t, text, conditions = inputs()
    exact = model.predict_noise(x_t, t, text, conditions, 1.0)
    found = cast.predict_noise(x_t, t, text.half(), conditions, 1.0)
    assert found.dtype == torch.float32 and (found - exact).abs().max() < 0.01 * exact.abs().max()
    score = torch.randn(2, 4, S // 2, S // 2, generator=torch.Generator().manual_seed(3))
    for size in (1e-7, 1.0, 1e6):  # half would vanish at the first and overflow at the last
        gradients = []
        for one in (model, cast):
            picture = pictures()
            gradients += torch.autograd.grad(one.encode(picture), picture, size * score)
        assert torch.isfinite(gradients[1]).all()
        away = (gradients[1] - gradients[0]).norm() / gradients[0].norm()
        assert away < 0.05


PLANS = {
    24: Plan(),
    16: Plan(checkpoint=True),
    12: Plan(checkpoint=True, slices=True),
    8: Plan(checkpoint=True, slices=True, offload=True),
}


@pytest.mark.parametrize("plan", PLANS.values(), ids=str)
def test_saving_memory_changes_nothing_else(folder: Path, model: StableDiffusion, plan: Plan) -> None:
    saving = load(folder, plan)
    x_t, t, text, conditions = inputs(3)
    expected = model.predict_noise(x_t, t, text, conditions, 0.9)
    torch.testing.assert_close(saving.predict_noise(x_t, t, text, conditions, 0.9), expected, rtol=1e-4, atol=1e-5)
    gradients = []
    for one in (model, saving):
        picture = pictures(3)
        gradients += torch.autograd.grad(one.encode(picture).square().sum(), picture)
    torch.testing.assert_close(gradients[1], gradients[0], rtol=1e-4, atol=1e-6)


def test_less_memory_saves_more() -> None:
    gpu = torch.device("cuda")
    assert {vram: memory.plan(vram, gpu) for vram in PLANS} == PLANS
    assert memory.plan(None, CPU) == Plan() and not memory.plan(8, CPU).offload


@pytest.mark.parametrize(("total", "like"), [(7.8, 8), (11.76, 12), (15.7, 16), (23.6, 24), (139.8, 24)])
def test_a_gpu_decides_by_what_it_has(monkeypatch: pytest.MonkeyPatch, total: float, like: int) -> None:
    """Cards report a little less than their name says."""

    class Properties:
        total_memory = int(total * 2**30)

    monkeypatch.setattr(torch.cuda, "get_device_properties", lambda device: Properties)
    assert memory.plan(None, torch.device("cuda")) == PLANS[like]


def test_plans_reach_the_networks(folder: Path) -> None:
    small, large = load(folder, PLANS[8]), load(folder, PLANS[24])
    assert small.vae.use_slicing and small.vae.encoder.gradient_checkpointing
    assert any(hasattr(module, "_diffusers_hook") for module in small.denoiser.modules())
    assert not large.vae.use_slicing and not large.vae.encoder.gradient_checkpointing
    assert not any(hasattr(module, "_diffusers_hook") for module in large.denoiser.modules())


def test_nothing_is_compiled_off_a_gpu(model: StableDiffusion, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = []
    monkeypatch.setattr(torch.nn.Module, "compile", lambda module: compiled.append(module))
    models._compile(model.denoiser, CPU)
    assert not compiled
    monkeypatch.setattr("importlib.util.find_spec", lambda name: name)
    monkeypatch.setattr("shutil.which", lambda name: name)
    models._compile(model.denoiser, torch.device("cuda"))
    assert compiled and {type(module).__name__ for module in compiled} == {"BasicTransformerBlock"}


def test_nothing_is_trained(model: StableDiffusion) -> None:
    for network in (model.denoiser, model.vae):
        assert not any(parameter.requires_grad for parameter in network.parameters())
        assert not any(module.training for module in network.modules())
