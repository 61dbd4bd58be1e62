"""The files of one view in a conditions folder: geometry and, per environment, light transport.

    view_007/geometry.exr       depth (planar, 0 off the object), normal.R|G|B (view space), mask, and label, the number of
                                the part that each pixel belongs to (`asset.parts.labels`); float32
                                and, where places of the surface share texels, the point that represents each pixel's:
                                shown.X|Y|Z, shown_normal.X|Y|Z (world), shown_scale; see `Geometry`
    view_007/<environment>.exr  E.R|G|B, A<k>.R|G|B, B<k>.R|G|B for knot k of `core.shading.KNOTS`,
                                and N·V as `cosine`; half float
    view_007/sd/geometry.exr, sd/<environment>.exr
                                of the profile sd: geometry with normals that are smooth everywhere, and the light maps of
                                `core.shading.LIGHT_MAPS` as light_m<m>_r<r>.R|G|B, half float

The data window is cropped to the object. Half floats end at 65,504, so radiance is stored divided by a power of two
that the attribute "dreammat_scale" names.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.core.artifact import ExrImage, intact, read_exr, write_exr
from stages.core.errors import ArtifactError
from stages.core.shading import KNOTS, LIGHT_MAPS, Transport

SD = "sd"
"""The profile of the released ControlNet, and the folder of its files within a view's."""

LARGEST_STORED = 32768.0
"""Stored radiance stays at or under this, well inside half float's range."""


LARGEST_VIEW = 4096
"""Pixels along a side of the largest view that `conditions` makes."""

DROPPED = 3
"""Bits of a half float's significand that are not stored: what is left errs by 0.2 % and packs a third smaller."""


@dataclass(frozen=True)
class Geometry:
    """What a camera sees of the object: mask (H, W) bool, planar depth (H, W), view-space unit normal (H, W, 3).

    label: (H, W) of what is seen, or of what represents it; 0 off the object. shown: (H, W, 7) or None where every place has
    texels of its own: the point of the surface that the texel of each pixel represents, world, its normal there, and how many
    times larger the texture lies there.
    """

    mask: NDArray[np.bool_]
    depth: NDArray[np.float32]
    normal: NDArray[np.float32]
    label: NDArray[np.int32]
    shown: NDArray[np.float32] | None = None


SHOWN = (*(f"shown.{axis}" for axis in "XYZ"), *(f"shown_normal.{axis}" for axis in "XYZ"), "shown_scale")
"""Channels of `Geometry.shown`."""


def view_folder(view: int) -> str:
    """Folder name of a view within a conditions folder."""
    return f"view_{view:03d}"


def object_window(mask: NDArray[np.bool_]) -> tuple[slice, slice]:
    """The smallest rows and columns that hold the object; one pixel when it is not seen."""
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    if rows.size == 0:
        return slice(0, 1), slice(0, 1)
    return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)


def write_geometry(folder: Path, view: int, geometry: Geometry, profile: str = "") -> None:
    """Write view_NNN/<profile>/geometry.exr."""
    window = object_window(geometry.mask)
    channels = {"depth": geometry.depth[window], "mask": geometry.mask[window].astype(np.float32)}
    channels |= {f"normal.{c}": geometry.normal[window][..., i] for i, c in enumerate("RGB")}
    channels["label"] = geometry.label[window].astype(np.float32)
    if geometry.shown is not None:
        channels |= {name: geometry.shown[window][..., i] for i, name in enumerate(SHOWN)}
    _write(folder / view_folder(view) / profile / "geometry.exr", channels, geometry.mask.shape, window, {})


def read_geometry(folder: Path, view: int, profile: str = "", files: Mapping[str, str] | None = None) -> Geometry:
    """Read view_NNN/<profile>/geometry.exr.

    Args:
        files: hashes from the manifest of a finished folder, which the file must have.
    Raises: ArtifactError.
    """
    path = _checked(folder, Path(view_folder(view), profile, "geometry.exr"), files)
    image = read_exr(path)
    names = ["depth", "mask", "label", *(f"normal.{c}" for c in "RGB")]
    _expect(path, image, names + [*SHOWN] * (SHOWN[0] in image.names))
    if max(image.display) > LARGEST_VIEW:
        raise ArtifactError(f"{path}: announces {image.display[1]} x {image.display[0]} pixels; make the conditions again")
    depth, mask, label, *normal = (image.full(name) for name in names)
    shown = np.stack([image.full(name) for name in SHOWN], -1) if SHOWN[0] in image.names else None
    return Geometry(mask > 0.5, depth, np.stack(normal, -1), np.rint(label).astype(np.int32), shown)


def transport_channels() -> list[str]:
    """Channel names of a transport file, in the order of `Transport.packed`."""
    terms = ["E", *(f"{term}{k}" for term in "AB" for k in range(len(KNOTS)))]
    return [*(f"{term}.{c}" for term in terms for c in "RGB"), "cosine"]


def light_map_names() -> list[str]:
    """Names of the six light maps, as channels carry them: light_m0_r0, light_m0_r0.5, ..."""
    return [f"light_m{m}_r{r:g}" for m, r in LIGHT_MAPS]


def write_transport(
    folder: Path, view: int, environment: str, mask: NDArray[np.bool_], transport: Transport
) -> Transport:
    """Write view_NNN/<environment>.exr; `transport` holds the mask's pixels row by row. Returns: what reading it gives."""
    path = folder / view_folder(view) / f"{environment}.exr"
    return Transport.unpack(_write_radiance(path, transport_channels(), mask, transport.packed(), plain=1))


def read_transport(
    folder: Path, view: int, environment: str, mask: NDArray[np.bool_], files: Mapping[str, str] | None = None
) -> Transport:
    """Transport of the mask's pixels, row by row, as float32 (or float16 where the file's scale is 1).

    Args:
        files: as for `read_geometry`.
    Raises: ArtifactError.
    """
    path = _checked(folder, Path(view_folder(view), f"{environment}.exr"), files)
    return Transport.unpack(_read_radiance(path, transport_channels(), mask, plain=1))


def write_light_maps(folder: Path, view: int, environment: str, mask: NDArray[np.bool_], maps: Tensor, profile: str) -> None:
    """Write view_NNN/<profile>/<environment>.exr. Args: maps: (P, 6, 3), of the mask's pixels row by row."""
    path = folder / view_folder(view) / profile / f"{environment}.exr"
    _write_radiance(path, _light_map_channels(), mask, maps.flatten(1).clone(), plain=0)


def read_light_maps(
    folder: Path,
    view: int,
    environment: str,
    mask: NDArray[np.bool_],
    profile: str,
    files: Mapping[str, str] | None = None,
) -> Tensor:
    """Light maps of the mask's pixels, (P, 6, 3) as `read_transport`. Raises: ArtifactError."""
    path = _checked(folder, Path(view_folder(view), profile, f"{environment}.exr"), files)
    return _read_radiance(path, _light_map_channels(), mask, plain=0).unflatten(1, (-1, 3))


def _light_map_channels() -> list[str]:
    return [f"{name}.{c}" for name in light_map_names() for c in "RGB"]


def _write_radiance(path: Path, names: list[str], mask: NDArray[np.bool_], values: Tensor, plain: int) -> Tensor:
    """Write radiance, changing it. Args: values: (P, channels), of which the last `plain` are no radiance.

    Returns: as `_read_radiance`.
    """
    scaled = values[:, : values.shape[1] - plain]
    largest = float(scaled.max()) if len(scaled) else 0.0
    scale = 2.0 ** max(0, int(np.ceil(np.log2(max(largest, 1.0) / LARGEST_STORED))))
    scaled /= scale
    window = object_window(mask)
    inside = mask[window]
    image = np.zeros((values.shape[1], *inside.shape), np.float16)
    stored = rounded(values, plain)
    image[:, inside] = stored.T.contiguous().numpy()
    channels = dict(zip(names, image, strict=True))
    _write(path, channels, mask.shape, window, {"dreammat_scale": repr(scale)}, quickly=True)
    return _scaled(stored, scale, plain)


def _scaled(stored: Tensor, scale: float, plain: int) -> Tensor:
    """What half floats of a file stand for. Args: (P, channels)."""
    if scale == 1.0:
        return stored
    values = stored.float()
    values[:, : values.shape[1] - plain] *= scale
    return values


def rounded(values: Tensor, plain: int) -> Tensor:
    """As half floats with DROPPED bits of the significand rounded away, but for the last `plain` columns. Args: (P, C)."""
    half = values.half()
    bits = half[:, : values.shape[1] - plain].view(torch.int16)
    bits.add_(1 << (DROPPED - 1)).bitwise_and_(-1 << DROPPED)
    return half


def _read_radiance(path: Path, names: list[str], mask: NDArray[np.bool_], plain: int) -> Tensor:
    """What `_write_radiance` wrote, (P, channels). Raises: ArtifactError."""
    image = read_exr(path)
    _expect(path, image, names)
    window = object_window(mask)
    inside = mask[window]
    if image.pixels.shape[:2] != inside.shape or image.display != mask.shape:
        raise ArtifactError(f"{path}: does not cover the object of its geometry.exr; make the conditions again")
    values = image.select(names, inside)
    if not np.isfinite(values).all():
        raise ArtifactError(f"{path}: holds values that are not finite; make the conditions again")
    return _scaled(torch.from_numpy(values), _scale(path, image), plain)


def _scale(path: Path, image: ExrImage) -> float:
    """What stored radiance is to be multiplied by. Raises: ArtifactError."""
    told = str(image.attributes.get("dreammat_scale", "1.0"))
    try:
        scale = float(told)
    except ValueError:
        scale = math.nan
    if not 0.0 < scale < math.inf:
        raise ArtifactError(f"{path}: its radiance is scaled by '{told[:20]}', expected a number; make the conditions again")
    return scale


def _checked(folder: Path, name: Path, files: Mapping[str, str] | None) -> Path:
    return folder / name if files is None else intact(folder, name.as_posix(), files)


def _write(
    path: Path,
    channels: dict[str, NDArray],
    display: tuple[int, ...],
    window: tuple[slice, slice],
    attributes: dict[str, str],
    quickly: bool = False,
) -> None:
    write_exr(path, channels, (display[0], display[1]), (window[0].start, window[1].start), attributes, quickly)


def _expect(path: Path, image: ExrImage, names: list[str]) -> None:
    missing = next((name for name in names if name not in image.names), None)
    if missing:
        raise ArtifactError(f"{path}: channel '{missing}' is missing; make the conditions again")
