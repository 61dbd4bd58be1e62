"""The denoiser: a UNet over pixels that also reads geometry, light maps and text.

Images are unshuffled by 2, so a 64² picture is worked on at 32², 16² and 8². Time and the pooled text scale and shift
every block; the words are attended to at 16² and 8².

The network predicts the material of every pixel. Where light maps are given, that material, lit by them, is the first
guess of the clean image, and the network adds what is missing. So what it learns about surfaces is apart from light.
"""

import math

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from stages.core.color import srgb_decode
from stages.prior.profile import CHANNELS, LIGHT, profile_tone, untone
from stages.prior.text import TextEmbedding

OUTPUTS = 3 + 5
"""What is missing in v (3); sRGB albedo (3), roughness and metallic as logits."""

LARGEST_GAIN = 2.0
"""Bound of the factor by which the first guess enters v: without it, the guess's error explodes as noise vanishes."""

GROUPS = 8


class Denoiser(nn.Module):
    """widths: channels at 32², 16² and 8² (for 64² images). text: width of the text embedding."""

    def __init__(self, widths: tuple[int, int, int] = (48, 128, 160), text: int = 128, embedding: int = 256) -> None:
        super().__init__()
        fine, middle, coarse = widths
        self.time = nn.Sequential(nn.Linear(64, embedding), nn.SiLU(), nn.Linear(embedding, embedding))
        self.text = nn.Linear(text, embedding)
        self.enter = nn.Conv2d(4 * (3 + CHANNELS), fine, 3, padding=1)
        self.down_fine = ResBlock(fine, embedding)
        self.to_middle = Downsample(fine, middle)
        self.down_middle = ResBlock(middle, embedding)
        self.to_coarse = Downsample(middle, coarse)
        self.down_coarse = nn.ModuleList([ResBlock(coarse, embedding), ResBlock(coarse, embedding)])
        self.self_attention, self.words_coarse = Attention(coarse, coarse), Attention(coarse, text)
        self.up_coarse = nn.ModuleList([ResBlock(coarse, embedding), ResBlock(coarse, embedding)])
        self.from_coarse = Upsample(coarse, middle)
        self.words_middle = Attention(middle, text)
        self.up_middle = ResBlock(middle, embedding)
        self.from_middle = Upsample(middle, fine)
        self.up_fine = ResBlock(fine, embedding)
        self.leave_norm = nn.GroupNorm(GROUPS, fine)
        self.leave = nn.Conv2d(fine, 4 * OUTPUTS, 3, padding=1)

    def forward(
        self, x: Tensor, t: Tensor, a: Tensor, conditions: Tensor, text: TextEmbedding
    ) -> tuple[Tensor, Tensor]:
        """Predict v and material.

        Args:
            x: (B, 3, S, S) noisy image. t: (B,) step. a: (B, 1, 1, 1) alpha_bar of it. conditions: (B, 23, S, S).
            S a multiple of 8.
        Returns:
            v (B, 3, S, S); sRGB albedo, roughness and metallic in (0, 1), (B, 5, S, S); float32.
        """
        missing, logits = self.features(x, t, conditions, text).float().split([3, 5], 1)
        material = torch.sigmoid(logits)
        lights = conditions[:, LIGHT]
        given = (lights >= 0).all(1, keepdim=True)
        guess = torch.where(given, profile_tone(relight(material, untone(lights.clamp(min=0)))), 0.0)
        gain = (1 - a).rsqrt().clamp(max=LARGEST_GAIN)
        return missing + gain * (a.sqrt() * x - guess), material

    def features(self, x: Tensor, t: Tensor, conditions: Tensor, text: TextEmbedding) -> Tensor:
        """The UNet proper: (B, 8, S, S)."""
        e = F.silu(self.time(sinusoids(t, 64)) + self.text(text.pooled))
        fine = self.down_fine(self.enter(F.pixel_unshuffle(torch.cat([x, conditions], 1), 2)), e)
        middle = self.down_middle(self.to_middle(fine), e)
        h = self.to_coarse(middle)
        for block in self.down_coarse:
            h = block(h, e)
        h = self.words_coarse(self.self_attention(h), text.tokens, text.present)
        for block in self.up_coarse:
            h = block(h, e)
        h = self.words_middle(middle + self.from_coarse(h), text.tokens, text.present)
        h = self.up_fine(fine + self.from_middle(self.up_middle(h, e)), e)
        return F.pixel_shuffle(self.leave(F.silu(self.leave_norm(h))), 2)


def relight(material: Tensor, lights: Tensor) -> Tensor:
    """Radiance of a material under six light maps; near `core.shading.shade`, of which the maps hold only a part.

    The Fresnel part is folded into a dielectric reflectance of 0.05, and roughness is interpolated over the three maps.

    Args:
        material: (B, 5, S, S). lights: (B, 18, S, S) linear.
    Returns:
        (B, 3, S, S). Differentiable in: material.
    """
    albedo, roughness, metallic = srgb_decode(material[:, :3]), material[:, 3:4], material[:, 4:]
    rough_white, mirror, glossy, rough = lights[:, 6:9], lights[:, 9:12], lights[:, 12:15], lights[:, 15:18]
    low = mirror + (glossy - mirror) * (2 * roughness).clamp(max=1)
    specular = low + (rough - glossy) * (2 * roughness - 1).clamp(min=0)
    diffuse = (rough_white - 0.05 * rough).clamp(min=0)
    return (1 - metallic) * albedo * diffuse + (0.05 * (1 - metallic) + metallic * albedo) * specular


class ResBlock(nn.Module):
    """Two convolutions; the embedding scales and shifts between them. The second starts at zero."""

    def __init__(self, width: int, embedding: int) -> None:
        super().__init__()
        self.norm_1, self.norm_2 = nn.GroupNorm(GROUPS, width), nn.GroupNorm(GROUPS, width, affine=False)
        self.conv_1 = nn.Conv2d(width, width, 3, padding=1)
        self.conv_2 = zeroed(nn.Conv2d(width, width, 3, padding=1))
        self.modulate = nn.Linear(embedding, 2 * width)

    def forward(self, x: Tensor, e: Tensor) -> Tensor:
        """Args: x (B, C, H, W); e (B, embedding)."""
        scale, shift = self.modulate(e)[..., None, None].chunk(2, 1)
        h = self.conv_1(F.silu(self.norm_1(x)))
        return x + self.conv_2(F.silu(self.norm_2(h) * (1 + scale) + shift))


class Attention(nn.Module):
    """Pixels attend to tokens, or to each other where no tokens are given; added to the input."""

    def __init__(self, width: int, tokens: int, head: int = 32) -> None:
        super().__init__()
        self.head = head
        self.norm = nn.GroupNorm(GROUPS, width)
        self.query, self.key_value = nn.Linear(width, width), nn.Linear(tokens, 2 * width)
        self.out = zeroed(nn.Linear(width, width))

    def forward(self, x: Tensor, tokens: Tensor | None = None, present: Tensor | None = None) -> Tensor:
        """Args: x (B, C, H, W); tokens (B, L, D); present (B, L) bool."""
        b, c, height, width = x.shape
        pixels = self.norm(x).flatten(2).transpose(1, 2)  # (B, HW, C)
        q = self._heads(self.query(pixels))
        k, v = (self._heads(part) for part in self.key_value(pixels if tokens is None else tokens).chunk(2, -1))
        mask = None if present is None else present[:, None, None, :]
        mixed = F.scaled_dot_product_attention(q, k, v, attn_mask=mask).transpose(1, 2).reshape(b, -1, c)
        return x + self.out(mixed).transpose(1, 2).reshape(b, c, height, width)

    def _heads(self, x: Tensor) -> Tensor:
        return x.view(*x.shape[:2], -1, self.head).transpose(1, 2)


class Downsample(nn.Module):
    """Half the size: 2 x 2 pixels become one."""

    def __init__(self, width: int, out: int) -> None:
        super().__init__()
        self.mix = nn.Conv2d(4 * width, out, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Args: x (B, C, H, W). Returns: (B, out, H / 2, W / 2)."""
        return self.mix(F.pixel_unshuffle(x, 2))


class Upsample(nn.Module):
    """Twice the size: one pixel becomes 2 x 2."""

    def __init__(self, width: int, out: int) -> None:
        super().__init__()
        self.mix = nn.Conv2d(width, 4 * out, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Args: x (B, C, H, W). Returns: (B, out, 2 H, 2 W)."""
        return F.pixel_shuffle(self.mix(x), 2)


def sinusoids(t: Tensor, dims: int) -> Tensor:
    """Sinusoidal features of a step, (B, dims). Source: Vaswani et al. 2017, section 3.5."""
    frequency = torch.exp(-math.log(10000.0) * torch.arange(dims // 2, device=t.device) / (dims // 2))
    angle = t[:, None].float() * frequency
    return torch.cat([angle.cos(), angle.sin()], 1)


def zeroed(layer: nn.Conv2d | nn.Linear) -> nn.Conv2d | nn.Linear:
    """The layer with all parameters at zero, so that its block starts as the identity."""
    for parameter in layer.parameters():
        nn.init.zeros_(parameter)
    return layer
