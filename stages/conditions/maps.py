"""The condition maps for a person or another program: one EXR per view and environment, and a contact sheet."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from stages.core.artifact import write_exr
from stages.core.color import srgb_encode
from stages.core.images import write_png
from stages.core.shading import LIGHT_MAPS, Transport, light_maps
from stages.core.views import Geometry, light_map_names, view_folder

SHEET_TILE = 160
"""Pixels along each side of a tile on the contact sheet, at most."""

SHEET_WHITE = 0.7
"""Each row is exposed so that the bright parts of its rough white map come out at this value."""

SHEET_VIEWS = 2
"""Views on the contact sheet."""


def on_sheet(views: int) -> list[int]:
    """Which of so many views are on the contact sheet, in its order."""
    return sorted({i * views // SHEET_VIEWS for i in range(SHEET_VIEWS)})


def light_images(geometry: Geometry, transport: Transport) -> NDArray[np.float32]:
    """The six light maps as pictures. Returns: (6, H, W, 3) linear radiance, 0 off the object."""
    images = np.zeros((len(LIGHT_MAPS), *geometry.mask.shape, 3), np.float32)
    images[:, geometry.mask] = light_maps(transport.to(dtype=transport.E.dtype)).permute(1, 0, 2).float().numpy()
    return images


def write_maps(folder: Path, view: int, environment: str, geometry: Geometry, transport: Transport) -> None:
    """Write view_NNN/maps_<environment>.exr, float32 over the whole view."""
    channels = {"depth": geometry.depth}
    channels |= {f"normal.{c}": geometry.normal[..., i] for i, c in enumerate("RGB")}
    for name, image in zip(light_map_names(), light_images(geometry, transport), strict=True):
        channels |= {f"{name}.{c}": image[..., i] for i, c in enumerate("RGB")}
    write_exr(folder / view_folder(view) / f"maps_{environment}.exr", channels)


def sheet_rows(geometry: Geometry, transports: list[Transport]) -> list[NDArray[np.float32]]:
    """Rows of the contact sheet for one view: per environment, depth, normal and the six light maps.

    Returns:
        One (tile, 8 tile, 3) row an environment, encoded for display.
    """
    step = max(1, -(-geometry.mask.shape[0] // SHEET_TILE))
    shown = np.zeros_like(geometry.mask)
    shown[::step, ::step] = geometry.mask[::step, ::step]
    some = torch.from_numpy(shown[geometry.mask])
    small = replace(geometry, mask=shown[::step, ::step], depth=geometry.depth[::step, ::step])
    depth = np.where(small.mask, small.depth, np.nan)
    near, far = (np.nanmin(depth), np.nanmax(depth)) if small.mask.any() else (0.0, 1.0)
    grey = np.nan_to_num(1 - 0.8 * (depth - near) / max(far - near, 1e-6))[..., None] * np.ones(3)
    normal = (geometry.normal[::step, ::step] * 0.5 + 0.5) * small.mask[..., None]
    rows = []
    for transport in transports:
        images = light_images(small, transport[some])
        bright = np.percentile(images[2][small.mask], 95) if small.mask.any() else 1.0
        lights = srgb_encode(images * (SHEET_WHITE / max(float(bright), 1e-6)))
        rows.append(np.concatenate([grey, normal, *lights], 1).astype(np.float32))
    return rows


def write_sheet(folder: Path, rows: list[NDArray]) -> None:
    """Write sheet.png: rows from `sheet_rows`, a thin gap between environments."""
    gap = np.full((4, rows[0].shape[1], 3), 0.2, np.float32)
    stacked = [part for row in rows for part in (row, gap)][:-1]
    write_png(folder / "sheet.png", np.concatenate(stacked))
