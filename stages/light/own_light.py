"""The light that an object throws on itself, for any material: what a view's points see of its cells, added to their transport.

What a point receives from the object is linear in what its other points send out. Where its blocked rays end is known
(`stages.light.ends`), and what the sides of cells send along them (`stages.light.leaving`), once the light between them is
(`stages.light.exchange`). E, A and B of the point grow by what its rays bring, weighted as the transport weighs them. So the
point's own albedo, metallic and roughness enter exactly.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stages.core.frames import tangent_frame
from stages.core.knots import KNOTS
from stages.core.lanes import LANES
from stages.core.parallel import in_parallel, slices
from stages.light import reconstruction
from stages.light.cells import Cells
from stages.light.ends import STEPS, Ends
from stages.light.leaving import POINTS_PER_TASK, OwnLight, Sky, arriving
from stages.light.terms import GLTF, Terms
from stages.light.transport_kernels import fast, in_lanes, on_square, weigh

if TYPE_CHECKING:
    from stages.core.shading import Transport

AVERAGED = (0, *(k for k in GLTF.joint if k <= len(KNOTS)))
"""Sums over whose neighbours noise is averaged: E and A of wide lobes. Narrower ones show edges, and B brings little."""


class Thrown(NamedTuple):
    """What an object of known materials throws on itself under some environments."""

    cells: Cells
    own: OwnLight
    sky: Sky


def own_sums(
    n: NDArray[np.float32],
    wo: NDArray[np.float32],
    ends: Ends,
    own: OwnLight,
    sky: Sky,
    counts: NDArray[np.int64],
    terms: Terms = GLTF,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """What P points receive from the object, by the sums of `terms`, and its variance: (P, stored, 3 L) each.

    Args:
        n, wo: (P, 3) world. ends: of these points. counts: rays of each lobe, as they were traced.
    """
    points = len(n)
    result, variance = np.zeros((2, points, terms.stored, own.light.shape[1]), np.float32)
    frame = (n, *tangent_frame(n))
    cosine = (n * wo).sum(-1).astype(np.float64).clip(0, 1)
    where = np.array(terms.summed), np.array(terms.mirror)
    mirrors = np.stack(terms.mirror_weights(cosine), 1).astype(np.float32)
    mirror = ends.mirror

    def task(part: slice) -> None:
        rows = np.arange(part.start, part.stop)
        some = tuple(np.ascontiguousarray(a[part]) for a in (*frame, wo))
        alphas = terms.alphas(rows)
        blur = np.zeros((len(rows), len(counts)), np.float32)  # of so many rays, each stands for that share of its lobe
        blur[:, 1:] = np.sqrt(alphas / np.sqrt(counts[1:]))
        brings = arriving(ends, own, sky, part, blur)
        rays = (ends.start[part.start : part.stop + 1], mirror[part], ends.towards, brings)
        scales = (mirrors[part], ends.scale[part].astype(np.float32))
        _gather(*some, rays, alphas, scales, counts, where, result[part], variance[part])

    in_parallel(task, slices(points, POINTS_PER_TASK))
    return result, variance


def with_own_light(
    transport: "Transport",
    n: NDArray,
    wo: NDArray,
    ends: Ends,
    own: OwnLight,
    sky: Sky,
    counts: NDArray[np.int64],
    near: reconstruction.Neighbours | None = None,
) -> "Transport":
    """Transport of P points, all L lights of a point after each other, with what the object itself adds.

    Args: near: how the points lie in a picture, over which the noise of what is added is averaged; None to leave it.
    """
    import torch

    from stages.core.shading import Transport

    some = np.ascontiguousarray(n, np.float32), np.ascontiguousarray(wo, np.float32)
    sums, noise = own_sums(*some, ends, own, sky, counts)
    if near is not None:
        among = reconstruction.variance(2 * np.sqrt(noise[:, AVERAGED]), near)  # its block's too: some see nothing by chance
        sums[:, AVERAGED] = reconstruction.smoothed(sums[:, AVERAGED], among, near, tuple(range(1, len(AVERAGED))))
    lights = sums.shape[2] // 3
    rows = torch.from_numpy(sums).unflatten(2, (lights, 3)).movedim(2, 1).flatten(0, 1)  # (P L, stored, 3)
    E, A, B = rows.to(transport.E.device).split([1, len(KNOTS), len(KNOTS)], 1)
    return Transport(transport.E + E[:, 0], transport.A + A, transport.B + B, transport.cosine)


@fast
def _gather(n, t, b, wo, rays, alphas, scales, counts, where, out, noise):  # type: ignore[no-untyped-def]
    """`own_sums` of some points. rays: start of `Ends`, whether the last one is a mirror's, towards, what they bring. alphas:
    (P, K). scales: weights of the mirror, and of `Ends`.
    """
    f32 = np.float32
    start, mirror, towards, radiance = rays
    mirrors, scale = scales
    summed, mirrored = where
    points, knots = alphas.shape
    channels, terms, lobe_rays = out.shape[2], 1 + 2 * knots, f32(counts.sum())
    most = 1
    for p in range(points):
        most = max(most, start[p + 1] - start[p])
    most = in_lanes(most)
    dx, dy, dz, scratch = np.empty(most, f32), np.empty(most, f32), np.empty(most, f32), np.empty((6, LANES), f32)
    density, inverse, weight = np.empty(most, f32), np.empty(most, f32), np.empty(terms * most, f32)
    seen = np.empty((channels, most), f32)
    step = f32(1 / STEPS)
    for p in range(points):
        first, count = start[p], start[p + 1] - start[p]
        lobes = count - (1 if mirror[p] else 0)
        brings = radiance[first - start[0] :]
        for i in range(lobes):
            dx[i], dy[i], dz[i] = on_square(towards[first + i, 0] * step, towards[first + i, 1] * step)
        if lobes:
            filled = in_lanes(lobes)
            dx[lobes:filled], dy[lobes:filled], dz[lobes:filled] = n[p, 0], n[p, 1], n[p, 2]
            for c in range(channels):
                for i in range(filled):
                    seen[c, i] = brings[i, c] if i < lobes else f32(0)
            w = weight[: terms * filled].reshape((terms, filled))
            weigh(n, t, b, wo, p, (dx, dy, dz), filled, alphas, counts, (False, 0.0, 0.0), scratch, density, inverse, w)
            for j in range(terms):
                whole = scale[p, 1 + (j - 1) % knots if j > 0 else 0]
                for c in range(channels):
                    total, squares = f32(0), f32(0)
                    for i in range(filled):
                        brought = w[j, i] * seen[c, i]
                        total += brought
                        squares += brought * brought
                    out[p, summed[j], c] = whole * total
                    noise[p, summed[j], c] = max(squares - total * total / lobe_rays, f32(0)) * whole * whole
        if mirror[p]:
            for c in range(channels):
                for j in range(2):
                    out[p, mirrored[j], c] = mirrors[p, j] * brings[lobes, c]
