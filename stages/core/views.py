"""The files of one view in a conditions folder: geometry and, per environment, light transport.

    view_007/geometry.exr       depth (planar, 0 off the object), normal.R|G|B (view space), mask; float32
    view_007/<environment>.exr  E.R|G|B, A<k>.R|G|B, B<k>.R|G|B for knot k of `core.shading.KNOTS`,
                                and N·V as `cosine`; half float

The data window is cropped to the object. Half floats end at 65,504, so radiance is stored divided by a power of two
that the attribute "dreammat_scale" names.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.core.artifact import ExrImage, read_exr, write_exr
from stages.core.errors import ArtifactError
from stages.core.shading import KNOTS, Transport

LARGEST_STORED = 32768.0
"""Stored radiance stays at or under this, well inside half float's range."""


DROPPED = 3
"""Bits of a half float's significand that are not stored: what is left errs by 0.2 % and packs a third smaller."""


@dataclass(frozen=True)
class Geometry:
    """What a camera sees of the object: mask (H, W) bool, planar depth (H, W), view-space unit normal (H, W, 3)."""

    mask: NDArray[np.bool_]
    depth: NDArray[np.float32]
    normal: NDArray[np.float32]


def view_folder(view: int) -> str:
    """Folder name of a view within a conditions folder."""
    return f"view_{view:03d}"


def object_window(mask: NDArray[np.bool_]) -> tuple[slice, slice]:
    """The smallest rows and columns that hold the object; one pixel when it is not seen."""
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    if rows.size == 0:
        return slice(0, 1), slice(0, 1)
    return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)


def write_geometry(folder: Path, view: int, geometry: Geometry) -> None:
    """Write view_NNN/geometry.exr."""
    window = object_window(geometry.mask)
    channels = {"depth": geometry.depth[window], "mask": geometry.mask[window].astype(np.float32)}
    channels |= {f"normal.{c}": geometry.normal[window][..., i] for i, c in enumerate("RGB")}
    _write(folder / view_folder(view) / "geometry.exr", channels, geometry.mask.shape, window, {})


def read_geometry(folder: Path, view: int) -> Geometry:
    """Read view_NNN/geometry.exr. Raises: ArtifactError."""
    path = folder / view_folder(view) / "geometry.exr"
    image = read_exr(path)
    names = ["depth", "mask", *(f"normal.{c}" for c in "RGB")]
    _expect(path, image, names)
    depth, mask, *normal = (image.full(name) for name in names)
    return Geometry(mask > 0.5, depth, np.stack(normal, -1))


def transport_channels() -> list[str]:
    """Channel names of a transport file, in the order of `Transport.packed`."""
    terms = ["E", *(f"{term}{k}" for term in "AB" for k in range(len(KNOTS)))]
    return [*(f"{term}.{c}" for term in terms for c in "RGB"), "cosine"]


def write_transport(folder: Path, view: int, environment: str, mask: NDArray[np.bool_], transport: Transport) -> None:
    """Write view_NNN/<environment>.exr; `transport` holds the mask's pixels row by row."""
    values = transport.packed()
    largest = float(values.max()) if len(values) else 0.0
    scale = 2.0 ** max(0, int(np.ceil(np.log2(max(largest, 1.0) / LARGEST_STORED))))
    values[:, :-1] /= scale
    window = object_window(mask)
    inside = mask[window]
    image = np.zeros((values.shape[1], *inside.shape), np.float16)
    image[:, inside] = rounded(values).T.contiguous().numpy()
    channels = dict(zip(transport_channels(), image, strict=True))
    path = folder / view_folder(view) / f"{environment}.exr"
    _write(path, channels, mask.shape, window, {"dreammat_scale": repr(scale)})


def rounded(values: Tensor) -> Tensor:
    """As half floats with DROPPED bits of the significand rounded away, but for the last column, N·V. Args: (P, WIDTH)."""
    half = values.half()
    bits = half[:, :-1].view(torch.int16)
    bits.add_(1 << (DROPPED - 1)).bitwise_and_(-1 << DROPPED)
    return half


def read_transport(folder: Path, view: int, environment: str, mask: NDArray[np.bool_]) -> Transport:
    """Transport of the mask's pixels, row by row, as float32 (or float16 where the file's scale is 1).

    Raises: ArtifactError.
    """
    path = folder / view_folder(view) / f"{environment}.exr"
    image = read_exr(path)
    names = transport_channels()
    _expect(path, image, names)
    window = object_window(mask)
    inside = mask[window]
    if image.channels[names[0]].shape != inside.shape or image.display != mask.shape:
        raise ArtifactError(f"{path}: does not cover the object of its geometry.exr; make the conditions again")
    values = np.stack([image.channels[name][inside] for name in names], 1)  # (P, 3 + 6 K)
    if not np.isfinite(values).all():
        raise ArtifactError(f"{path}: holds values that are not finite; make the conditions again")
    scale = float(image.attributes.get("dreammat_scale", "1.0"))
    if scale != 1.0:
        values = values.astype(np.float32)
        values[:, :-1] *= scale
    return Transport.unpack(torch.from_numpy(values))


def _write(
    path: Path,
    channels: dict[str, NDArray],
    display: tuple[int, ...],
    window: tuple[slice, slice],
    attributes: dict[str, str],
) -> None:
    write_exr(path, channels, (display[0], display[1]), (window[0].start, window[1].start), attributes)


def _expect(path: Path, image: ExrImage, names: list[str]) -> None:
    missing = next((name for name in names if name not in image.channels), None)
    if missing:
        raise ArtifactError(f"{path}: channel '{missing}' is missing; make the conditions again")
