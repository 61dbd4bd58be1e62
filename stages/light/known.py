"""What a surface of a known material sends to the camera, traced for that material alone.

`stages.light.transport` gathers A and B at every roughness, for a material that is still to be found. A picture of a
finished asset knows each point's roughness: then one diffuse and one glossy lobe are drawn, and three sums kept in place of
seventeen. Rays, lights, normalisation and smoothing are those of the transport. Albedo and metallic are multiplied
in afterwards, so that smoothing blurs light and not textures.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from stages.core.albedo import diffuse_table, open_albedo
from stages.core.brdf import alpha_from_roughness
from stages.core.knots import F0, KNOTS
from stages.light import reconstruction
from stages.light.environment import Environment
from stages.light.gbuffer import GBuffer
from stages.light.own_light import Thrown, own_sums
from stages.light.scene import Scene
from stages.light.terms import Terms, between_cosines
from stages.light.transport import Quality, cached_light_set, smoothed, trace

SMOOTHEST = KNOTS[1]
"""Roughness under which a glossy lobe is narrower than the texels of the lights; there it is mixed with a mirror."""

SHARP = KNOTS[2]
"""Roughness under which what is reflected is left as traced: it shows edges that no neighbour knows of."""


@dataclass(frozen=True)
class Known(Terms):
    """E, and A and B of a mirror and of each point's own lobe.

    own: (P,) roughness of that lobe. opened: (P, 3), see `open_albedo`.
    """

    own: NDArray[np.float32] = field(default_factory=lambda: np.zeros(0, np.float32))
    opened: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 3), np.float32))

    def alphas(self, rows: NDArray[np.int64]) -> NDArray[np.float32]:
        """(R, 1)."""
        return alpha_from_roughness(self.own[rows, None])

    def open_albedo(self, cosine: NDArray, rows: NDArray[np.int64]) -> NDArray[np.float32]:
        """(R, 3), of E, A and B."""
        return self.opened[rows]


def known(roughness: NDArray[np.float32], cosine: NDArray[np.float32]) -> Known:
    """The sums of points of this roughness and N·V, (P,) each."""
    own = np.maximum(roughness, np.float32(SMOOTHEST))
    opened = np.concatenate([between_cosines(diffuse_table()[:, None], cosine), open_albedo(own, cosine)], 1)
    made = Known(roughness=(0.0,), shares=(0.4, 0.6), stored=5, mirror=(1, 3), judged=(0, 2), sharp=(), highlights=(0,))
    return replace(made, own=own, opened=opened)


def reflected(
    scene: Scene,
    points: GBuffer,
    environments: list[Environment],
    material: NDArray[np.float32],
    quality: Quality,
    seed: int,
    thrown: Thrown | None = None,
) -> NDArray[np.float32]:
    """Outgoing radiance of every point of a view under each environment, (lights, P, 3) linear.

    Args:
        environments: `stages.light.light_set.MAX_LIGHTS` at most. material: (P, 5) albedo, roughness, metallic. quality:
        without further rays. thrown: what the object throws on itself under these environments, if that is to be seen.
    """
    assert not quality.extra, "rays are added where a view is noisy under lights of all materials"
    terms = known(material[:, 3], (points.n * points.wo).sum(-1).clip(0, 1))
    lights = cached_light_set(tuple(environments))
    sums = trace(scene, points, lights, quality, seed, terms, cells=thrown and thrown.cells).of_lights(len(environments))
    if thrown is not None and sums.ends is not None:
        more = own_sums(points.n, points.wo, sums.ends, thrown.own, thrown.sky, terms.counts(quality.lobe), terms)
        for values, added in zip((sums.mean, sums.variance), more, strict=True):
            values[:, :, : added.shape[2]] += added
    if quality.smooth:
        sums.variance[terms.own < SHARP, 1:] = 0
        sums = replace(sums, mean=smoothed(sums, points, lights, reconstruction.Neighbours.of(points), terms))
    c, m = material[:, :3], material[:, 4:5]
    rough = np.minimum(material[:, 3:4] / np.float32(SMOOTHEST), 1)
    under = []
    for light in range(len(environments)):
        E, A_mirror, A, B_mirror, B = sums.mean[:, :, 3 * light : 3 * light + 3].swapaxes(0, 1)
        A, B = A_mirror + (A - A_mirror) * rough, B_mirror + (B - B_mirror) * rough
        under.append((1 - m) * c * E + (np.float32(F0) * (1 - m) + m * c) * A + B)
    return np.stack(under)
