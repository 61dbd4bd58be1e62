"""Which part of the views a step shows to its guidance: square crops for an image model, loose pixels for a target.

A crop is point-sampled at a stride, with no filter: its pixels are pixels of the stored view, so that field points, light
transport and conditions belong together exactly. The stride of the whole view is the smallest that fits it into the
square; zoomed crops halve it down to single pixels and are centred on an object pixel.
"""

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.core.shading import WIDTH, Transport
from stages.distill.views import HALF_MAX, Surface, Views
from stages.light.leaving import OwnLight

WHOLE_VIEW_SHARE = 0.5
"""Share of crops that show the whole view; the others are zoomed in, each stride as likely as the next."""


@dataclass(frozen=True)
class Images:
    """How a sample's P points lie in its B square images of S pixels.

    pixel: (P,) flat index into B x S x S. surface: of the points that are seen. azimuth, elevation: (B,) of the
    cameras, radians, the front of the object at azimuth 0. maps: where the conditions have the profile sd, view-space
    normals (P, 3) and light maps (P, 6, 3) of it.
    """

    count: int
    size: int
    pixel: Tensor
    surface: Surface
    azimuth: NDArray[np.float64]
    elevation: NDArray[np.float64]
    maps: tuple[Tensor, Tensor] | None = None

    def paint(self, values: Tensor) -> Tensor:
        """Values (P, C) as images (B, C, S, S), 0 off the object. Differentiable in: values."""
        flat = values.new_zeros(self.count * self.size**2, values.shape[1]).index_copy(0, self.pixel, values)
        return flat.view(self.count, self.size, self.size, -1).permute(0, 3, 1, 2)


@dataclass(frozen=True)
class Sample:
    """What one step shows: P points, each under `lights` = L lights. points, normals: (P, 3) world, where their material is
    asked for (on shared texels what represents them). footprint, label: (P,) there.

    transport: of P L rows, all lights of a point after each other. source: (view, environment) of each image, and where:
    which of that view's object pixels it shows, in their order.
    images: the layout of crops; rows: (P,) of loose pixels in their pool. The one that does not apply is None. given: what the
    guidance makes of the rest before it is asked.
    """

    points: Tensor
    normals: Tensor
    footprint: Tensor
    label: Tensor
    lights: int
    transport: Transport
    source: tuple[tuple[int, int], ...] = ()
    where: tuple[NDArray[np.int64], ...] = ()
    images: Images | None = None
    rows: Tensor | None = None
    given: Any = None


class Sampler(Protocol):
    """Draws samples; what it draws is a function of the generator alone."""

    def draw(self, generator: torch.Generator) -> Sample:
        """The sample of a step."""

    def prefetch(self, generator: torch.Generator) -> None:
        """Get ready for the draw with an equal generator."""


class CropSampler:
    """Square crops of size S, each of a random view under a random environment."""

    def __init__(self, views: Views, size: int, batch: int, device: torch.device, lights: str = "all") -> None:
        """Args: lights: "all", or "one" for the first environment alone."""
        self._views, self._size, self._batch, self._device = views, size, batch, device
        self._lights = 1 if lights == "one" else len(views.environments)
        whole = math.ceil(max(views.width, views.height) / size)
        self._strides = [whole // 2**i for i in range(whole.bit_length())]

    def draw(self, generator: torch.Generator) -> Sample:
        keys = self._keys(generator)
        crops = [self._crop(view, generator) for view, _ in keys]
        lights = [self._views.transport(*key)[torch.from_numpy(rows)] for key, (rows, *_) in zip(keys, crops, strict=True)]
        surfaces = [self._views.surface(key[0], rows) for key, (rows, *_) in zip(keys, crops, strict=True)]
        footprint = [
            stride * self._views.widths(key[0], surface)
            for key, surface, (*_, stride) in zip(keys, surfaces, crops, strict=True)
        ]
        surface = Surface(*(self._join(surfaces, name) for name in Surface.__annotations__))
        transport = Transport(*(self._join(lights, name) for name in Transport.__annotations__))
        pixel = np.concatenate([at + i * self._size**2 for i, (_, at, _) in enumerate(crops)])
        eyes = self._views.c2w[[view for view, _ in keys], :3, 3]
        azimuth, elevation = np.arctan2(eyes[:, 1], eyes[:, 0]), np.arcsin(eyes[:, 2] / np.linalg.norm(eyes, axis=1))
        where = torch.from_numpy(pixel).to(self._device)
        images = Images(self._batch, self._size, where, surface, azimuth, elevation, self._maps(keys, crops))
        width = torch.cat(footprint).to(self._device)
        points, normals, label = surface.shown, surface.shown_normals, surface.label
        where_in_views = tuple(rows for rows, *_ in crops)
        return Sample(points, normals, width, label, 1, transport, tuple(keys), where_in_views, images=images)

    def with_own_light(self, own: list[OwnLight], sample: Sample) -> Transport:
        """Transport of a sample's points with what the object throws on itself."""
        assert sample.images is not None
        counts, surface = [len(rows) for rows in sample.where], sample.images.surface
        shapes = zip(surface.points.split(counts), surface.normals.split(counts), strict=True)
        jobs = zip(sample.source, sample.where, sample.transport.split(counts), shapes, strict=True)
        lit = [self._views.with_own_light(own, *job) for job in jobs]
        return Transport(*(self._join(lit, name) for name in Transport.__annotations__))

    def _maps(
        self, keys: list[tuple[int, int]], crops: list[tuple[NDArray[np.int64], NDArray[np.int64], int]]
    ) -> tuple[Tensor, Tensor] | None:
        """Of the profile sd, as in `Images`."""
        if not self._views.has_light_maps:
            return None
        rows = [torch.from_numpy(rows) for rows, *_ in crops]
        normals = [self._views.smooth_normals(view)[chosen] for (view, _), chosen in zip(keys, rows, strict=True)]
        lights = [self._views.light_maps(*key)[chosen] for key, chosen in zip(keys, rows, strict=True)]
        return torch.cat(normals).to(self._device), torch.cat(lights).to(self._device, torch.float32)

    def prefetch(self, generator: torch.Generator) -> None:
        self._views.prefetch(self._keys(generator))

    def _keys(self, generator: torch.Generator) -> list[tuple[int, int]]:
        """(view, environment) of each image: the first numbers that a step draws."""
        seen = self._views.seen
        view = torch.randint(len(seen), (self._batch,), generator=generator).tolist()
        environment = torch.randint(self._lights, (self._batch,), generator=generator).tolist()
        return [(seen[v], e) for v, e in zip(view, environment, strict=True)]

    def _crop(self, view: int, generator: torch.Generator) -> tuple[NDArray[np.int64], NDArray[np.int64], int]:
        """Rows of the view's object pixels that a random crop shows, and their flat place in the square, (K,) each; its
        stride."""
        views, size = self._views, self._size
        whole = len(self._strides) < 2 or float(torch.rand((), generator=generator)) < WHOLE_VIEW_SHARE
        stride = self._strides[0 if whole else int(torch.randint(1, len(self._strides), (), generator=generator))]
        pixels = views.pixels(view)
        hit = np.array(np.divmod(pixels[int(torch.randint(len(pixels), (), generator=generator))], views.width))
        centre = np.array([views.height, views.width]) // 2 if whole else hit
        first = centre - stride * (size // 2)
        first = first + (hit - first) % stride  # the lattice passes through an object pixel
        row, column = (first[axis] + stride * np.arange(size) for axis in (0, 1))
        inside = ((row >= 0) & (row < views.height))[:, None] & (column >= 0) & (column < views.width)  # (S, S)
        flat = row[:, None] * views.width + column
        rows = np.searchsorted(pixels, flat).clip(max=len(pixels) - 1)
        shown = inside & (pixels[rows] == flat)
        return rows[shown].astype(np.int64), np.flatnonzero(shown), stride

    def _join(self, parts: list, name: str) -> Tensor:  # type: ignore[type-arg]
        return torch.cat([getattr(part, name) for part in parts]).to(self._device)


UNLIT = Transport.unpack(torch.zeros(0, WIDTH))
"""The light of pixels that are not shaded."""

CELL = 2.0
"""Edge of the cells within which pixels share their chance of being drawn, in pixels."""


MOST = 2_000_000
"""Pixels of a pool: each is solved once, which takes a tenth of a millisecond."""


class PixelSampler:
    """Loose object pixels of all views, without light: for a guidance that knows what they are made of.

    The pool holds all of them, or `MOST`, as large a share of each view, chosen at random. Draws are even over
    the surface, not over the pixels: a crevice that few views see counts as much as a flank that all of them do.

    points, eyes: (M, 3) world, what is seen and the cameras' positions. seen: numbers of the views that see something.
    """

    def __init__(self, views: Views, count: int, generator: torch.Generator, device: torch.device) -> None:
        self._views, self._count, self.device, self.seen = views, count, device, views.seen
        share = min(1.0, MOST / sum(len(views.pixels(view)) for view in views.seen))
        self._rows = rows = [_subset(len(views.pixels(view)), share, generator) for view in views.seen]
        surfaces = [views.surface(view, chosen) for view, chosen in zip(views.seen, rows, strict=True)]
        names = ("points", "shown", "shown_normals", "label")
        self.points, *shown, label = (torch.cat([getattr(s, name) for s in surfaces]) for name in names)
        widths = [views.widths(view, s) for view, s in zip(views.seen, surfaces, strict=True)]
        self._where = (*shown, torch.cat(widths), label)  # points, normals, footprints and labels of the material
        eyes = views.c2w[views.seen, :3, 3].repeat([len(chosen) for chosen in rows], 0)
        self.eyes = torch.from_numpy(eyes.astype(np.float32))
        self._chance = even_chance(self.points, CELL * views.pixel_size())  # (M,)

    def draw(self, generator: torch.Generator) -> Sample:
        u = torch.rand(self._count, generator=generator, dtype=torch.float64)
        return self.at(torch.searchsorted(self._chance, u).clamp(max=len(self.points) - 1))

    def at(self, rows: Tensor) -> Sample:
        """The sample of given rows (P,) of the pool."""
        points, normals, footprint, label = (t.index_select(0, rows).to(self.device) for t in self._where)
        return Sample(points, normals, footprint, label, 0, UNLIT, rows=rows)

    def lit(self, number: int, own: list[OwnLight] | None = None) -> tuple[slice, Transport]:
        """The pool's pixels of one of the seen views: its rows (P of them), and their light transport (P L rows).

        Args: own: what the object throws on itself, to be added.
        """
        views, view, rows = self._views, self._views.seen[number], self._rows[number]
        first = sum(map(len, self._rows[:number]))
        surface, lights = views.surface(view, rows), []
        for environment in range(len(views.environments)):
            transport = views.read_transport((view, environment))[torch.from_numpy(rows)]
            if own is not None:
                shape = surface.points, surface.normals
                transport = views.with_own_light(own, (view, environment), rows, transport, shape)
            lights.append(transport.packed().clamp(max=HALF_MAX).half())
        return slice(first, first + len(rows)), Transport.unpack(torch.stack(lights, 1).float().flatten(0, 1))

    def prefetch(self, generator: torch.Generator) -> None:
        """Nothing to do."""


def even_chance(points: Tensor, cell: float) -> Tensor:
    """Cumulative chance (M,) of points (M, 3) that makes every occupied cell of a grid as likely as the next."""
    index = (points / cell).floor().long() + (1 << 20)
    key = (index[:, 0] << 42) + (index[:, 1] << 21) + index[:, 2]
    _, cell_of, count = torch.unique(key, return_inverse=True, return_counts=True)
    chance = (1.0 / count.double())[cell_of].cumsum(0)
    return chance / chance[-1]


def _subset(count: int, share: float, generator: torch.Generator) -> NDArray[np.int64]:
    """Ascending indices of a random share of `count` things, one at least."""
    chosen = torch.randperm(count, generator=generator)[: max(1, int(count * share))]
    return chosen.sort().values.numpy()
