"""Stable Diffusion steered by a ControlNet: loaded, and all that a guidance asks of it.

On a GPU UNet and ControlNet run in half precision, whose 11 bits a score needs, being the difference of predictions that
nearly agree; the VAE runs in bfloat16, whose range is that of float32, so that no gradient through it overflows or
vanishes (in float32 itself on a GPU that does not know bfloat16). Elsewhere everything is float32. The text encoder always
is, on the CPU: it runs once.
"""

import importlib.util
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from stages.core import diffusion
from stages.core.errors import InputError, one_line
from stages.sd.files import ModelFiles, Network
from stages.sd.memory import Plan
from stages.sd.profile import CHANNELS

EMBEDDING = (16, 32, 96, 256)
"""Widths of a ControlNet's condition encoder, level by level: diffusers' default."""


class Denoiser(nn.Module):
    """A UNet and the ControlNet that steers it."""

    unet: Any
    controlnet: Any

    def __init__(self, unet: nn.Module, controlnet: nn.Module) -> None:
        super().__init__()
        self.unet, self.controlnet = unet, controlnet

    def forward(self, x_t: Tensor, t: Tensor, text: Tensor, conditions: Tensor | None, scale: Tensor) -> Tensor:
        """What the model predicts; arguments as in `StableDiffusion.predict_noise`, scale (), all in the UNet's dtype."""
        if conditions is None:
            return self.unet(x_t, t, text, return_dict=False)[0]
        down, middle = self.controlnet(x_t, t, text, conditions, return_dict=False)
        return self.unet(
            x_t,
            t,
            text,
            down_block_additional_residuals=[(scale * residual).to(x_t.dtype) for residual in down],
            mid_block_additional_residual=(scale * middle).to(x_t.dtype),
            return_dict=False,
        )[0]


@dataclass(frozen=True)
class StableDiffusion:
    """The models on a device. See `load_models`."""

    files: ModelFiles
    denoiser: Denoiser
    vae: Any  # diffusers' AutoencoderKL without its decoder
    alpha_bar: Tensor  # (1000,) float32
    hashes: dict[str, str]  # SHA-256 of each network's weights
    device: torch.device
    plan: Plan

    @property
    def identity(self) -> dict[str, Any]:
        """Names of the models and of the weight files that were used, and what the model predicts."""
        sources = {key: Path(getattr(self.files.sources, key)).resolve().name for key in ("sd_model", "controlnet")}
        weights = {name: network.weights.name for name, network in self.files.networks.items()}
        return {"name": "stable-diffusion", **sources, "weights": weights, "prediction": self.files.prediction}

    def embed(self, prompts: list[str]) -> Tensor:
        """Text embeddings (N, T, D) of N prompts; "" is the null prompt. The text encoder is loaded for this call alone.

        Raises: InputError when a prompt is too long to be read whole.
        """
        text = load_text_encoder(self.files)
        if long := [prompt for prompt in prompts if len(text.tokenizer(prompt).input_ids) > text.longest]:
            raise InputError(f'--prompt "{long[0][:40]}…": longer than the {text.longest - 2} tokens that are read; shorten it')
        return text.embed(prompts).to(self.device, self.denoiser.unet.dtype)

    def encode(self, picture: Tensor) -> Tensor:
        """Latents of pictures: the mean of what the encoder holds likely.

        Args:
            picture: (B, 3, H, W) in [0, 1].
        Returns:
            (B, C, H / 8, W / 8) float32. Differentiable in: picture.
        """
        posterior = self.vae.encode((2 * picture - 1).to(self.vae.dtype)).latent_dist
        return self.vae.config.scaling_factor * posterior.mode().float()

    def decode(self, latents: Tensor) -> Tensor:
        """Pictures (B, 3, H, W) in [0, 1] of latents; of models loaded for training, whose VAE is whole."""
        decoded = self.vae.decode((latents / self.vae.config.scaling_factor).to(self.vae.dtype)).sample
        return (decoded.float() / 2 + 0.5).clamp(0, 1)

    def predict_noise(self, x_t: Tensor, t: Tensor, text: Tensor, conditions: Tensor | None, scale: float) -> Tensor:
        """The noise in x_t.

        Args:
            x_t: (B, C, h, w) latents. t: (B,) long, 0 ... 999. text: (B, T, D). conditions: (B, 22, 8 h, 8 w), or None
            for the base alone. scale: of the ControlNet's residuals.
        Returns:
            (B, C, h, w) float32. No gradient is kept.
        """
        dtype = self.denoiser.unet.dtype
        strength = torch.full((), scale, dtype=dtype, device=self.device)
        given = None if conditions is None else conditions.to(dtype)
        count = 1 if self.plan.slices else len(x_t)
        rows = [slice(i, i + count) for i in range(0, len(x_t), count)]
        with torch.no_grad():
            parts = [
                self.denoiser(x_t[i].to(dtype), t[i], text[i], None if given is None else given[i], strength) for i in rows
            ]
        predicted = torch.cat(parts).float()
        if self.files.prediction == "v_prediction":
            return diffusion.noise_from_velocity(self.alpha_bar, x_t, predicted, t)
        return predicted


@dataclass(frozen=True)
class TextEncoder:
    """CLIP's tokenizer and text encoder. longest: tokens that are read, the first and the last one included."""

    tokenizer: Any
    encoder: Any
    longest: int

    def embed(self, prompts: list[str]) -> Tensor:
        """Text embeddings (N, T, D) float32 of N prompts, each cut to `longest`."""
        cut = {"padding": "max_length", "truncation": True, "max_length": self.longest}
        tokens = torch.tensor([self.tokenizer(prompt, **cut).input_ids for prompt in prompts])
        with torch.no_grad():
            return self.encoder(tokens.to(self.encoder.device)).last_hidden_state


def load_text_encoder(files: ModelFiles) -> TextEncoder:
    """On the CPU. Raises: InputError when a file is damaged."""
    from transformers import CLIPTextModel, CLIPTokenizer

    folder = files.base / "tokenizer"
    try:
        tokenizer = CLIPTokenizer.from_pretrained(folder, local_files_only=True)
    except Exception as error:  # whatever a malformed file makes it trip over
        raise InputError(f"{folder}: not a readable tokenizer ({one_line(error)}); get it again") from error
    encoder = load_network(CLIPTextModel, files.text_encoder)
    return TextEncoder(tokenizer, encoder, files.text_encoder["max_position_embeddings"])


def load_models(files: ModelFiles, device: torch.device, plan: Plan) -> StableDiffusion:
    """The models, ready for inference on a device. Raises: InputError when a file is damaged or of another network."""
    from diffusers import AutoencoderKL, ControlNetModel, UNet2DConditionModel

    be_quiet()
    unet, controlnet = load_network(UNet2DConditionModel, files.unet), load_network(ControlNetModel, files.controlnet)
    parts = place(unet, controlnet, load_network(AutoencoderKL, files.vae), device, plan)
    return StableDiffusion(files, *parts, _alpha_bar(files, device), files.hashes(), device, plan)


def place(unet: Any, controlnet: Any, vae: Any, device: torch.device, plan: Plan) -> tuple[Denoiser, Any]:
    """Networks for inference on a device, as the module says: denoiser, and VAE without its decoder."""
    del vae.decoder
    if device.type == "cuda":
        unet, controlnet = unet.half(), controlnet.half()
        if torch.cuda.is_bf16_supported(including_emulation=False):
            vae = vae.to(torch.bfloat16)
    if plan.checkpoint:
        vae.enable_gradient_checkpointing()
    if plan.slices:
        vae.enable_slicing()
    denoiser = Denoiser(unet, controlnet).eval()
    if plan.offload:
        _offload(denoiser, device)
    else:
        denoiser.to(device)
        _compile(denoiser, device)
    return denoiser, vae.to(device)


def load_for_training(files: ModelFiles, device: torch.device, dtype: torch.dtype) -> StableDiffusion:
    """The models with a ControlNet that learns, in float32; the rest is frozen, in a dtype, the VAE never in half precision.

    Raises: InputError when a file is damaged or of another network.
    """
    from diffusers import AutoencoderKL, ControlNetModel, UNet2DConditionModel

    be_quiet()
    unet, vae = load_network(UNet2DConditionModel, files.unet), load_network(AutoencoderKL, files.vae)
    controlnet = load_network(ControlNetModel, files.controlnet).train().requires_grad_()
    denoiser = Denoiser(unet.to(dtype), controlnet).to(device)
    vae.to(device, torch.float32 if dtype == torch.float16 else dtype)
    return StableDiffusion(files, denoiser, vae, _alpha_bar(files, device), files.hashes(), device, Plan())


def write_untrained_controlnet(folder: Path, unet: Network, vae: Network, seed: int) -> None:
    """Write a ControlNet for 22 channels that begins as a copy of the UNet's encoder and as yet changes nothing.

    Source: Zhang et al. 2023, "Adding Conditional Control to Text-to-Image Diffusion Models", Section 3.
    """
    from diffusers import ControlNetModel, UNet2DConditionModel

    be_quiet()
    levels = len(vae["block_out_channels"])  # conditions shrink as pictures do
    with torch.random.fork_rng():  # nn.Module initialisation knows only the global generator, which is put back
        torch.default_generator.manual_seed(seed)
        controlnet = ControlNetModel.from_unet(
            load_network(UNet2DConditionModel, unet),
            conditioning_channels=CHANNELS,
            conditioning_embedding_out_channels=EMBEDDING[:levels],
        )
    controlnet.save_pretrained(folder)


def _alpha_bar(files: ModelFiles, device: torch.device) -> Tensor:
    from diffusers import DDPMScheduler

    scheduler = DDPMScheduler.from_pretrained(files.base / "scheduler", local_files_only=True)
    return scheduler.alphas_cumprod.to(device)


def load_network(kind: Any, network: Network) -> Any:
    """A network with the weights of its file, all of them, in float32 on the CPU."""
    name = network.weights.name
    try:
        model, found = kind.from_pretrained(
            network.folder,
            use_safetensors=name.endswith(".safetensors"),
            variant="fp16" if ".fp16." in name else None,
            local_files_only=True,
            output_loading_info=True,
        )
    except Exception as error:  # the loaders raise whatever a damaged file makes them trip over
        raise InputError(f"{network.weights}: not readable as {kind.__name__} ({one_line(error)}); get it again") from error
    if lacking := sorted(map(str, (*found["missing_keys"], *found["mismatched_keys"]))):
        raise InputError(
            f"{network.weights}: {len(lacking)} weights are missing or of another shape ({lacking[0]}); "
            "expected those of the config.json beside it"
        )
    return model.float().eval().requires_grad_(False)


def _offload(denoiser: Denoiser, device: torch.device) -> None:
    """Keep the networks in host memory; each block is fetched while the one before it runs."""
    for network in (denoiser.unet, denoiser.controlnet):
        network.enable_group_offload(
            onload_device=device,
            offload_device=torch.device("cpu"),
            offload_type="block_level",
            num_blocks_per_group=1,
            use_stream=device.type == "cuda",
        )


def _compile(denoiser: Denoiser, device: torch.device) -> None:
    """On a GPU with a compiler at hand, compile the transformer blocks alone: once a width, not once a block."""
    if device.type == "cuda" and importlib.util.find_spec("triton") and any(map(shutil.which, ("cc", "gcc", "clang"))):
        for module in denoiser.modules():
            if type(module).__name__ == "BasicTransformerBlock":
                module.compile()


def be_quiet() -> None:
    """Keep the libraries' remarks and progress bars off the terminal; errors come as exceptions."""
    import diffusers.utils.logging
    import transformers.utils.logging

    for logging in (diffusers.utils.logging, transformers.utils.logging):
        logging.set_verbosity_error()
        logging.disable_progress_bar()
