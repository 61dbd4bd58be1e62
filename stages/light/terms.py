"""What the light transport sums over the rays of a point, and the lobes that those rays are drawn from.

`GLTF` is what the pipeline shades with: E, and A and B at every knot (`stages.light.transport`). `BLENDER` is what the
released ControlNet was shown: the six light maps of `stages.light.blender`.
"""

import functools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stages.core.albedo import COSINE_STEPS, cosines, diffuse_table, open_albedo
from stages.core.brdf import alpha_from_roughness
from stages.core.knots import KNOTS, LIGHT_MAPS
from stages.light import blender

NARROW = 0.3
"""Roughness of a lobe under which its rays are followed from mirror to mirror."""


@dataclass(frozen=True)
class Terms:
    """A set of sums: a diffuse one, then two for each glossy lobe, all the first ones before all the second.

    roughness: of the glossy lobes. shares: of the lobe rays, the cosine lobe's, then each glossy one's. stored: sums that a
    point keeps, `mirror` among them, the two of roughness 0, which are looked up and not summed. judged: by which noise is
    judged, what a picture of a rough thing is made of. sharp: those that are left as traced, for they show edges that no
    neighbour knows of. joint: those of which the differences count too, for roughness has a slope. highlights:
    glossy lobes whose known highlights are taken out while noise is averaged (`stages.light.highlights`). principled: False for
    glTF's, or weights of Burley's departure from Lambert and of the dielectric's reflection.
    """

    roughness: tuple[float, ...]
    shares: tuple[float, ...]
    stored: int
    mirror: tuple[int, int]
    judged: tuple[int, ...]
    sharp: tuple[int, ...]
    joint: tuple[int, ...] = ()
    highlights: tuple[int, ...] = ()
    principled: tuple[bool, float, float] = (False, 0.0, 0.0)

    @property
    def summed(self) -> NDArray[np.int64]:
        """Which of the stored sums are summed, in the order of the kernels."""
        return np.array([j for j in range(self.stored) if j not in self.mirror])

    def alphas(self, rows: NDArray[np.int64]) -> NDArray[np.float32]:
        """Of the glossy lobes of some points, (R, K)."""
        return np.tile(np.array([alpha_from_roughness(r) for r in self.roughness], np.float32), (len(rows), 1))

    def open_albedo(self, cosine: NDArray, rows: NDArray[np.int64]) -> NDArray[np.float32]:
        """What is summed where nothing stands in an even light, at some points with N·V = cosine: (R, summed)."""
        return between_cosines(self.albedo(), cosine)

    def places_of_highlights(self) -> NDArray[np.int64]:
        """Of the lobes with highlights: the stored places of their first sums, then of their second ones."""
        first = 1 + np.array(self.highlights, np.int64)
        return self.summed[np.concatenate([first, first + len(self.roughness)])]

    def counts(self, total: int) -> NDArray[np.int64]:
        """Rays of the cosine lobe and of each glossy one: an even number, for two halves, and not 0."""
        return 2 * np.maximum(1, np.round(np.array(self.shares) * total / 2)).astype(np.int64)

    @functools.lru_cache(maxsize=4)  # noqa: B019  (a handful of sets, which live as long as the process)
    def albedo(self) -> NDArray[np.float32]:
        """Open-point albedo of each summed one: (COSINE_STEPS, summed) float32."""
        on, departure, reflection = self.principled
        if on:
            found = blender.open_albedo(cosines(), np.array(self.roughness), departure, reflection, 128)
            return found.astype(np.float32)
        cosine = cosines().astype(np.float32)
        knots = [open_albedo(np.full_like(cosine, roughness), cosine) for roughness in self.roughness]
        return np.stack([diffuse_table(), *(k[:, 0] for k in knots), *(k[:, 1] for k in knots)], -1)

    def mirror_weights(self, cosine: NDArray[np.float64]) -> tuple[NDArray, NDArray]:
        """Of what a mirror shows at N·V = cosine, in the two sums of roughness 0."""
        on, _, reflection = self.principled
        if on:
            return np.ones_like(cosine), reflection * blender.mirror_reflectance(cosine)
        s = (1 - cosine) ** 5
        return 1 - s, s


def between_cosines(table: NDArray[np.float32], cosine: NDArray) -> NDArray[np.float32]:
    """Rows of a table over `core.albedo.cosines`. Args: (COSINE_STEPS, C); (R,) N·V. Returns: (R, C)."""
    x = np.sqrt(cosine.clip(0, 1)) * (COSINE_STEPS - 1)
    cell = np.minimum(x.astype(np.int64), COSINE_STEPS - 2)
    within = (x - cell).astype(np.float32)[:, None]
    return table[cell] * (1 - within) + table[cell + 1] * within


_K = len(KNOTS)

GLTF = Terms(
    roughness=KNOTS[1:],
    shares=(0.16, 0.05, 0.05, 0.05, 0.11, 0.16, 0.16, 0.16, 0.1),
    stored=2 * _K + 1,
    mirror=(1, 1 + _K),
    judged=(0, 1 + KNOTS.index(0.5), 1 + KNOTS.index(1.0)),
    sharp=(2, 3, 2 + _K, 3 + _K),
    joint=(*range(4, 1 + _K), *range(4 + _K, 1 + 2 * _K)),
    highlights=tuple(range(KNOTS.index(0.25) - 1, KNOTS.index(0.65))),
)
"""E, A at every knot, B at every knot."""

BOUNCED = replace(GLTF, shares=(0.16, 0.32, 0.16, 0.11, 0.16, 0.21, 0.16, 0.16, 0.1))
"""The same where the object is seen in itself too: more rays of narrow lobes, which are followed from mirror to mirror."""

BLENDER = Terms(
    roughness=(0.5, 1.0),
    shares=(0.4, 0.3, 0.3),
    stored=len(LIGHT_MAPS) + 1,
    mirror=(3, 6),
    judged=(0, 2, 4, 5),
    sharp=(),
    principled=(True, 1.0, 1.0),
)
"""The light maps in the order of `LIGHT_MAPS`, the first one without its reflection, which is the last sum."""
