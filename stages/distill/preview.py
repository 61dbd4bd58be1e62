"""A small picture of a material on its object: a row per view, showing it shaded, its albedo, roughness and metallic."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.core.color import reinhard, srgb_encode
from stages.core.images import write_png
from stages.core.shading import Material, shade
from stages.distill.base import Base
from stages.distill.views import Surface, Views
from stages.material.residual import Residual

ROWS = 4
"""Views shown, evenly spread over those there are."""

SIZE = 192
"""Most pixels along an edge of a picture; a larger view is point-sampled."""

EXPOSURE = 1.5
"""Radiance before the tone curve, relative to a mean of 1 on a white diffuse object."""


def write_preview(path: Path, views: Views, base: Base, residual: Residual) -> None:
    """Write the contact sheet as a PNG."""
    chosen = [views.seen[i * len(views.seen) // ROWS] for i in range(min(ROWS, len(views.seen)))]
    device = residual.table.device

    def learnt(surface: Surface, width: Tensor) -> Material:
        where = (surface.shown, surface.shown_normals, width, surface.label)
        return base.material(residual, *(t.to(device) for t in where))

    rows = [pictures(views, view, i % len(views.environments), learnt) for i, view in enumerate(chosen)]
    write_png(path, np.concatenate(rows, 0))


@torch.no_grad()
def pictures(
    views: Views, view: int, environment: int, material_of: Callable[[Surface, Tensor], Material]
) -> NDArray[np.float32]:
    """Four pictures of one view side by side, (S, 4 S, 3), encoded for display.

    Args: material_of: the material of surface points, whose pictures' pixels are so wide (P,).
    """
    stride = math.ceil(max(views.width, views.height) / SIZE)
    row, column = np.divmod(views.pixels(view), views.width)
    shown = np.flatnonzero((row % stride == 0) & (column % stride == 0))
    surface = views.surface(view, shown)
    material = material_of(surface, stride * views.widths(view, surface))
    transport = views.read_transport((view, environment))[torch.from_numpy(shown)].to(material.albedo.device, torch.float32)
    scale = EXPOSURE / transport.E.mean().clamp(min=1e-6)
    pictures = (
        srgb_encode(reinhard(scale * shade(transport, material))),
        srgb_encode(material.albedo),
        material.roughness[:, None].expand(-1, 3),
        material.metallic[:, None].expand(-1, 3),
    )
    size = (math.ceil(views.height / stride), math.ceil(views.width / stride))
    canvas = np.ones((*size, 4, 3), np.float32)
    for i, picture in enumerate(pictures):
        canvas[row[shown] // stride, column[shown] // stride, i] = picture.cpu().numpy()
    return canvas.transpose(0, 2, 1, 3).reshape(size[0], -1, 3)
