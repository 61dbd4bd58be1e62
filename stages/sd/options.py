"""Which Stable Diffusion to use, and within how much memory."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SdOptions:
    """Models are folders in the layout of diffusers, or ids of the Hugging Face hub."""

    sd_model: str = ""  # the base: unet, vae, text_encoder, tokenizer, scheduler
    controlnet: str = ""  # 22 channels, trained on that base
    vram: int | None = None  # GiB of the GPU to stay within (see `stages.sd.memory`); None: what it has
