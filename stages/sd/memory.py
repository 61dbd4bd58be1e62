"""How Stable Diffusion fits a GPU's memory: what to save where there is less.

Counted for one 512 x 512 image a step, half precision: UNet and ControlNet 2.4 GiB, the VAE's encoder with what its gradient
needs 1.8, three branches 0.6, field and optimiser 0.3, the driver 0.5. Text encoder and VAE decoder never go there. What
attention needs is small everywhere, since torch's own kernel never holds the attention matrix.

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
    """The plan that stays within so many GiB. Args: vram: None for what the device has; a CPU has enough."""
    if vram is None:
        if device.type != "cuda":
            return Plan()
        vram = round(torch.cuda.get_device_properties(device).total_memory / 2**30)
    return Plan(checkpoint=vram < 24, slices=vram < 16, offload=vram < 12)
