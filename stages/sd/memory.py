"""How Stable Diffusion fits a GPU's memory: what to save where there is less.

Counted for one image of 512 x 512 a step: the weights of UNet and ControlNet take 2.3 GiB in half precision; what the
gradient through the VAE's encoder keeps, 1.6, with checkpoints 0.1 and one block at a time. Text encoder and VAE decoder
never go to the GPU. Attention needs little everywhere, since torch's own kernel does not hold the attention matrix.

| GiB | saves |
|---|---|
| 24 | nothing |
| 16 | the VAE encoder's activations are computed again for its gradient |
| 12 | and images are encoded, and branches denoised, one after the other |
| 8 | and UNet and ControlNet wait in host memory, from which each block comes when it is needed |
"""

from dataclasses import dataclass

import torch


@dataclass(frozen=True)
class Plan:
    """What is done to save memory; see the module."""

    checkpoint: bool = False
    slices: bool = False
    offload: bool = False


def plan(vram: int | None, device: torch.device) -> Plan:
    """The plan that stays within so many GiB. Args: vram: None for what the device has; a CPU has enough.

    Off a GPU there is nowhere else to wait than in host memory.
    """
    if vram is None:
        if device.type != "cuda":
            return Plan()
        vram = round(torch.cuda.get_device_properties(device).total_memory / 2**30)
    return Plan(checkpoint=vram < 24, slices=vram < 16, offload=vram < 12 and device.type == "cuda")
