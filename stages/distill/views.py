"""What distillation sees: the views of a conditions folder, as surface points with their light transport.

Only object pixels exist here, flattened row by row ("rows" of a view). Geometry stays in memory; transport is kept in half
precision and read from disk again when it exceeds the byte budget. Radiance above half float's largest number
(65,504, a sun seen in a mirror) is clamped to it.

What is drawn depends on the generator alone, never on what happens to be in memory.
"""

import threading
from collections import OrderedDict
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.core import schemas
from stages.core.artifact import MANIFEST, load_npz, read_manifest, sha256_file
from stages.core.errors import ArtifactError
from stages.core.shading import KNOTS, WIDTH, Transport
from stages.core.views import read_geometry, read_transport

CACHE_BYTES = 2 << 30
"""Memory that light transport may take."""

READERS = 2
"""Threads that read view files."""

HALF_MAX = 65504.0


@dataclass(frozen=True)
class Surface:
    """Surface points: position and unit normal in the world (P, 3), planar depth (P,), view-space normal (P, 3)."""

    points: Tensor
    normals: Tensor
    depth: Tensor
    view_normals: Tensor


@dataclass(frozen=True)
class _Geometry:
    pixels: NDArray[np.int32]  # (P,) flat index of each object pixel, ascending
    depth: NDArray[np.float32]  # (P,)
    normal: NDArray[np.float16]  # (P, 3) view space


class Views:
    """The views of a finished conditions folder.

    Raises: ArtifactError when the folder is missing, incomplete, foreign, or no view sees the object.
    """

    def __init__(self, folder: Path, cache_bytes: int = CACHE_BYTES) -> None:
        provenance, _ = read_manifest(folder, schemas.CONDITIONS)
        cameras = load_npz(folder / "cameras.npz", schemas.CAMERAS)
        self.folder = folder
        self.digest = sha256_file(folder / MANIFEST)
        self.prep = provenance.inputs.get("prep", "")
        self.c2w, self.fov_y = cameras["c2w"], cameras["fov_y"]
        self.width, self.height = int(cameras["width"]), int(cameras["height"])
        self.environments: list[str] = list(provenance.extra["environments"])
        self.to_world = np.array(provenance.extra.get("to_world", np.eye(4).ravel()), np.float64).reshape(4, 4)
        if tuple(provenance.extra["knots"]) != KNOTS:
            raise ArtifactError(f"{folder}: roughness knots differ from this version's; make the conditions again")
        self._geometry = self._read_geometry()
        self.seen = [view for view, geometry in enumerate(self._geometry) if len(geometry.pixels)]
        if not self.seen:
            raise ArtifactError(f"{folder}: no view shows the object; make the conditions again with other cameras")
        self._cache = _Cache(self.read_transport, cache_bytes)

    def pixels(self, view: int) -> NDArray[np.int32]:
        """Flat index in the image of each object pixel of a view, ascending (P,)."""
        return self._geometry[view].pixels

    def pixel_size(self) -> float:
        """Median width of a pixel at the object, world units."""
        depth = np.array([np.median(self._geometry[view].depth) for view in self.seen])
        return float(np.median(2 * depth * np.tan(self.fov_y[self.seen] / 2) / self.height))

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
        arrays = (local @ rotation.T + eye, normal @ rotation.T, geometry.depth[rows], normal)
        return Surface(*(torch.from_numpy(np.ascontiguousarray(a, np.float32)) for a in arrays))

    def transport(self, view: int, environment: int) -> Transport:
        """Light transport of all object pixels of a view, float16."""
        return self._cache.get((view, environment))

    def prefetch(self, keys: list[tuple[int, int]]) -> None:
        """Start reading the transport of (view, environment) pairs in the background."""
        for key in keys:
            self._cache.prefetch(key)

    def _read_geometry(self) -> list[_Geometry]:
        def read(view: int) -> _Geometry:
            geometry = read_geometry(self.folder, view)
            mask = geometry.mask.ravel()
            if geometry.mask.shape != (self.height, self.width):
                raise ArtifactError(f"{self.folder}: view {view} is not {self.width} x {self.height}; make it again")
            normal = geometry.normal.reshape(-1, 3)[mask].astype(np.float16)
            return _Geometry(np.flatnonzero(mask).astype(np.int32), geometry.depth.ravel()[mask], normal)

        with ThreadPoolExecutor(READERS) as pool:
            return list(pool.map(read, range(len(self.c2w))))

    def read_transport(self, key: tuple[int, int]) -> Transport:
        """As `transport` of a (view, environment), always from disk and not kept."""
        view, environment = key
        mask = np.zeros((self.height, self.width), bool)
        mask.ravel()[self._geometry[view].pixels] = True
        transport = read_transport(self.folder, view, self.environments[environment], mask)
        return Transport.unpack(transport.packed().clamp(max=HALF_MAX).half())


class _Cache:
    """Transports by (view, environment), the least recently used dropped first; safe to use from several threads."""

    def __init__(self, read, limit: int) -> None:  # type: ignore[no-untyped-def]
        self._read, self._limit, self._bytes = read, limit, 0
        self._held: OrderedDict[tuple[int, int], Transport] = OrderedDict()
        self._coming: dict[tuple[int, int], Future[Transport]] = {}
        self._lock = threading.Lock()
        self._pool = ThreadPoolExecutor(READERS)

    def prefetch(self, key: tuple[int, int]) -> None:
        with self._lock:
            if key not in self._held and key not in self._coming:
                self._coming[key] = self._pool.submit(self._read, key)

    def get(self, key: tuple[int, int]) -> Transport:
        with self._lock:
            if key in self._held:
                self._held.move_to_end(key)
                return self._held[key]
            coming = self._coming.pop(key, None)
        transport = coming.result() if coming else self._read(key)
        with self._lock:
            self._held[key] = transport
            self._bytes += _size(transport)
            while self._bytes > self._limit and len(self._held) > 1:
                self._bytes -= _size(self._held.popitem(last=False)[1])
        return transport


def _size(transport: Transport) -> int:
    return 2 * WIDTH * len(transport.E)
