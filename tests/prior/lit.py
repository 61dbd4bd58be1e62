"""Points under an even light, for which transport is known without tracing a ray."""

import torch
from torch import Tensor

from stages.core.albedo import specular_albedo
from stages.core.shading import KNOTS, Transport, light_maps


def lit_points(count: int) -> tuple[Transport, Tensor]:
    """Transport of open points under radiance 1 from everywhere, N·V from 0.2 to 1, and its light maps (P, 6, 3)."""
    cosine = torch.linspace(0.2, 1.0, count)
    albedo = torch.stack([specular_albedo(torch.full_like(cosine, r), cosine) for r in KNOTS], 1)  # (P, K, 2)
    specular = albedo[..., None].expand(-1, -1, -1, 3).contiguous()
    transport = Transport(torch.full((count, 3), 0.9), specular[:, :, 0], specular[:, :, 1], cosine)
    return transport, light_maps(transport)
