"""What distillation sees: the views of a conditions folder, as surface points with their light transport.

Only object pixels exist here, flattened row by row ("rows" of a view). Geometry stays in memory; transport is kept in half
precision and read from disk again when it exceeds the byte budget. Radiance above half float's largest number
(65,504, a sun seen in a mirror) is clamped to it.

What is drawn depends on the generator alone, never on what happens to be in memory.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.asset.parts import LabelledPart
from stages.core import schemas
from stages.core.artifact import MANIFEST, Provenance, intact, load_npz, read_manifest, sha256_file
from stages.core.errors import ArtifactError
from stages.core.shading import KNOTS, LIGHT_MAPS, WIDTH, Transport
from stages.core.views import SD, read_geometry, read_light_maps, read_transport
from stages.distill.bounces import Bounces
from stages.light.leaving import OwnLight
from stages.light.reconstruction import Neighbours
from stages.material.survey import Lookup, Survey

CACHE_BYTES = 2 << 30
"""Memory that light transport may take."""

READERS = 2
"""Threads that read view files."""

HALF_MAX = 65504.0

Light = TypeVar("Light", Transport, Tensor)


@dataclass(frozen=True)
class Surface:
    """Surface points: position and unit normal in the world (P, 3), planar depth (P,), view-space normal (P, 3).

    shown, shown_normals: (P, 3) where the material of each is asked for: the point itself, or what represents its texel.
    label: (P,) int64, of the parts that lie there. scale: (P,) how many times larger the texture does.
    """

    points: Tensor
    normals: Tensor
    depth: Tensor
    view_normals: Tensor
    shown: Tensor
    shown_normals: Tensor
    label: Tensor
    scale: Tensor


@dataclass(frozen=True)
class _Geometry:
    pixels: NDArray[np.int32]  # (P,) flat index of each object pixel, ascending
    depth: NDArray[np.float32]  # (P,)
    normal: NDArray[np.float16]  # (P, 3) view space
    label: NDArray[np.int32]  # (P,)
    shown: NDArray[np.float32] | None  # (P, 7) as in `core.views.Geometry`


class Views:
    """The views of a finished conditions folder.

    Raises: ArtifactError when the folder is missing, incomplete, foreign, or no view sees the object.
    """

    def __init__(self, folder: Path, cache_bytes: int = CACHE_BYTES) -> None:
        provenance, self.files = read_manifest(folder, schemas.CONDITIONS)
        cameras = load_npz(intact(folder, "cameras.npz", self.files), schemas.CAMERAS)
        self.folder = folder
        self.digest = sha256_file(folder / MANIFEST)
        self.prep = provenance.inputs.get("prep", "")
        self.survey = Lookup(Survey.from_arrays(load_npz(folder / "survey.npz", schemas.SURVEY).arrays))
        self.c2w, self.fov_y = cameras["c2w"], cameras["fov_y"]
        self.width, self.height = int(cameras["width"]), int(cameras["height"])
        self.environments: list[str] = list(provenance.extra["environments"])
        self.to_world = np.array(provenance.extra.get("to_world", np.eye(4).ravel()), np.float64).reshape(4, 4)
        self.has_light_maps = provenance.extra.get("profile") == SD
        self.parts, self.shared_labels = read_parts(folder, provenance)
        if tuple(provenance.extra["knots"]) != KNOTS:
            raise ArtifactError(f"{folder}: roughness knots differ from this version's; make the conditions again")
        asked = int(provenance.extra["bounces"])
        self.bounces = Bounces(folder, self.files, self.environments, asked) if asked else None
        self._geometry = self._read_geometry()
        self._smooth: dict[int, Tensor] = {}
        self.seen = [view for view, geometry in enumerate(self._geometry) if len(geometry.pixels)]
        if not self.seen:
            raise ArtifactError(f"{folder}: no view shows the object; make the conditions again with other cameras")
        self._cache = _Cache(self.read_transport, cache_bytes, 2 * WIDTH)
        self._maps = _Cache(self._read_maps, cache_bytes // 2, 2 * 3 * len(LIGHT_MAPS))

    def extent(self) -> float:
        """Longest edge of the object, in the units of its source."""
        return float(1 / np.cbrt(abs(np.linalg.det(self.to_world[:3, :3]))))

    def pixels(self, view: int) -> NDArray[np.int32]:
        """Flat index in the image of each object pixel of a view, ascending (P,)."""
        return self._geometry[view].pixels

    def pixel_size(self) -> float:
        """Median width of a pixel at the object, world units."""
        return float(np.median([self.footprint(view, np.array(np.median(self._geometry[view].depth))) for view in self.seen]))

    def footprint(self, view: int, depth: NDArray) -> NDArray[np.float32]:
        """Width of a pixel of a view at planar depths (P,), world units."""
        return np.asarray(2 * depth * np.tan(self.fov_y[view] / 2) / self.height, np.float32)

    def widths(self, view: int, surface: Surface) -> Tensor:
        """Footprints (P,) at which the material of surface points of a view is asked for, world units."""
        return torch.from_numpy(self.footprint(view, surface.depth.numpy())) * surface.scale

    def surface(self, view: int, rows: NDArray[np.int64]) -> Surface:
        """The points of some object pixels of a view. Args: rows (K,) into `pixels(view)`."""
        geometry = self._geometry[view]
        row, column = np.divmod(geometry.pixels[rows], self.width)
        tan = np.tan(self.fov_y[view] / 2)
        x = ((column + 0.5) / self.width * 2 - 1) * tan * self.width / self.height
        y = (1 - (row + 0.5) / self.height * 2) * tan
        local = np.stack([x, y, -np.ones(len(rows))], -1) * geometry.depth[rows, None]  # camera space
        rotation, eye = self.c2w[view][:3, :3], self.c2w[view][:3, 3]
        normal = geometry.normal[rows].astype(np.float64)
        point, turned = local @ rotation.T + eye, normal @ rotation.T
        shown = np.c_[point, turned, np.ones(len(rows))] if geometry.shown is None else geometry.shown[rows]
        arrays = (point, turned, geometry.depth[rows], normal, shown[:, :3], shown[:, 3:6], shown[:, 6])
        floats = [torch.from_numpy(np.ascontiguousarray(a, np.float32)) for a in arrays]
        label = torch.from_numpy(geometry.label[rows].astype(np.int64))
        return Surface(*floats[:6], label=label, scale=floats[6])  # type: ignore[misc]

    def transport(self, view: int, environment: int) -> Transport:
        """Light transport of all object pixels of a view, float16."""
        return self._cache.get((view, environment))

    def with_own_light(
        self,
        own: list[OwnLight],
        place: tuple[int, int],
        rows: NDArray[np.int64],
        transport: Transport,
        shape: tuple[Tensor, Tensor],
    ) -> Transport:
        """Transport of some object pixels with what the object throws on itself.

        Args: place: view and environment. shape: points and normals of the pixels' `surface`.
        """
        assert self.bounces is not None
        points, normals = (values.cpu().numpy() for values in shape)
        wo = self.c2w[place[0]][:3, 3].astype(np.float32) - points
        wo /= np.linalg.norm(wo, axis=1, keepdims=True)
        y, x = np.divmod(self.pixels(place[0])[rows], self.width)
        near = Neighbours.on_lattice(x, y, normals, points)
        return self.bounces.added(own, transport, place, rows, near, wo)

    def light_maps(self, view: int, environment: int) -> Tensor:
        """Light maps of the profile sd, of all object pixels of a view, (P, 6, 3) float16."""
        return self._maps.get((view, environment))

    def smooth_normals(self, view: int) -> Tensor:
        """View-space normals of the profile sd, of all object pixels of a view, (P, 3) float32."""
        if view not in self._smooth:
            normal = read_geometry(self.folder, view, SD, self.files).normal.reshape(-1, 3)[self.pixels(view)]
            self._smooth[view] = torch.from_numpy(np.ascontiguousarray(normal))
        return self._smooth[view]

    def prefetch(self, keys: list[tuple[int, int]]) -> None:
        """Start reading the light of (view, environment) pairs in the background."""
        for key in keys:
            self._cache.prefetch(key)
            if self.has_light_maps:
                self._maps.prefetch(key)

    def _read_geometry(self) -> list[_Geometry]:
        def read(view: int) -> _Geometry:
            geometry = read_geometry(self.folder, view, files=self.files)
            mask = geometry.mask.ravel()
            if geometry.mask.shape != (self.height, self.width):
                raise ArtifactError(f"{self.folder}: view {view} is not {self.width} x {self.height}; make it again")
            normal = geometry.normal.reshape(-1, 3)[mask].astype(np.float16)
            shown = None if geometry.shown is None else geometry.shown.reshape(-1, 7)[mask]
            depth, label = geometry.depth.ravel()[mask], geometry.label.ravel()[mask]
            return _Geometry(np.flatnonzero(mask).astype(np.int32), depth, normal, label, shown)

        with ThreadPoolExecutor(READERS) as pool:
            return list(pool.map(read, range(len(self.c2w))))

    def read_transport(self, key: tuple[int, int]) -> Transport:
        """As `transport` of a (view, environment), always from disk and not kept."""
        view, environment = key
        transport = read_transport(self.folder, view, self.environments[environment], self._mask(view), self.files)
        return Transport.unpack(transport.packed().clamp(max=HALF_MAX).half())

    def _read_maps(self, key: tuple[int, int]) -> Tensor:
        view, environment = key
        maps = read_light_maps(self.folder, view, self.environments[environment], self._mask(view), SD, self.files)
        return maps.clamp(max=HALF_MAX).half()

    def _mask(self, view: int) -> NDArray[np.bool_]:
        mask = np.zeros((self.height, self.width), bool)
        mask.ravel()[self._geometry[view].pixels] = True
        return mask


def read_parts(folder: Path, provenance: Provenance) -> tuple[list[LabelledPart], list[tuple[int, int, float]]]:
    """The parts by name, and which labels share texels, as `CONDITIONS` has them. Raises: ArtifactError."""
    try:
        parts = [LabelledPart.from_json(part) for part in provenance.extra["parts"]]
        return parts, [(int(own), int(other), float(share)) for own, other, share in provenance.extra["shared_labels"]]
    except (KeyError, TypeError, ValueError) as error:
        raise ArtifactError(f"{folder}: its list of parts cannot be read ({error}); make the conditions again") from error


class _Cache(Generic[Light]):
    """What lights the pixels, by (view, environment), the least recently used dropped first; safe from several threads.

    pixel: bytes of a pixel.
    """

    def __init__(self, read: Callable[[tuple[int, int]], Light], limit: int, pixel: int) -> None:
        self._read: Callable[[tuple[int, int]], Light] = read
        self._limit, self._pixel, self._bytes = limit, pixel, 0
        self._held: OrderedDict[tuple[int, int], Light] = OrderedDict()
        self._coming: dict[tuple[int, int], Future[Light]] = {}
        self._lock = threading.Lock()
        self._pool = ThreadPoolExecutor(READERS)

    def prefetch(self, key: tuple[int, int]) -> None:
        with self._lock:
            if key not in self._held and key not in self._coming:
                self._coming[key] = self._pool.submit(self._read, key)

    def get(self, key: tuple[int, int]) -> Light:
        with self._lock:
            if key in self._held:
                self._held.move_to_end(key)
                return self._held[key]
            coming = self._coming.pop(key, None)
        light = coming.result() if coming else self._read(key)
        with self._lock:
            self._held[key] = light
            self._bytes += self._size(light)
            while self._bytes > self._limit and len(self._held) > 1:
                self._bytes -= self._size(self._held.popitem(last=False)[1])
        return light

    def _size(self, light: Light) -> int:
        return self._pixel * len(light.E if isinstance(light, Transport) else light)
