"""Light in a metal that is seen in itself, by paths drawn at random: beside what a quadrature is too coarse for."""

import numpy as np
from numpy.typing import NDArray

from stages.core.brdf import alpha_from_roughness, sample_vndf, schlick_weight, smith_lambda
from stages.core.frames import tangent_frame
from stages.core.parallel import compiled
from stages.light.environment import Environment, lookup
from stages.light.gbuffer import GBuffer, surface_points
from stages.light.scene import Scene


@compiled
def reflections(wo, alpha, u):  # type: ignore[no-untyped-def]
    """Directions drawn by the visible normals, the BRDF without Fresnel over their density, and Schlick's weight."""
    wi, share, s = np.zeros(wo.shape), np.zeros(len(wo)), np.zeros(len(wo))
    for i in range(len(wo)):
        m = sample_vndf(wo[i, 0], wo[i, 1], wo[i, 2], alpha, u[i, 0], u[i, 1])
        v_h = wo[i, 0] * m[0] + wo[i, 1] * m[1] + wo[i, 2] * m[2]
        for d in range(3):
            wi[i, d] = 2 * v_h * m[d] - wo[i, d]
        if wi[i, 2] > 0:
            visible = 1 + smith_lambda(wo[i, 2], alpha)
            share[i], s[i] = visible / (visible + smith_lambda(wi[i, 2], alpha)), schlick_weight(v_h)
    return wi, share, s


def path_traced(
    scene: Scene, points: GBuffer, light: Environment, values: tuple[float, ...], bounces: int, samples: int = 512
) -> NDArray[np.float64]:
    """Radiance (P, 3) of a metal by paths drawn at random, by visible normals: what quadrature is too coarse for."""
    alpha, color, rng = alpha_from_roughness(values[3]), np.array(values[:3]), np.random.default_rng(0)
    there = points[np.arange(len(points.n)).repeat(samples)]
    origin, wo, n = there.surface(np.arange(len(there.n))), there.wo.astype(np.float64), there.n.astype(np.float64)
    ng, row, weight = there.ng.astype(np.float64), np.arange(len(n)) // samples, np.ones((len(n), 3))
    total = np.zeros((len(points.n), 3))
    for _ in range(bounces + 1):
        frame = np.stack([*tangent_frame(n), n], 1)  # (R, 3, 3)
        local = np.einsum("rij,rj->ri", frame, wo)
        local[:, 2] = local[:, 2].clip(1e-3)
        wi, share, s = reflections(local, alpha, rng.random((len(n), 2)))
        weight *= (color + (1 - color) * s[:, None]) * share[:, None]
        wi = np.einsum("rji,rj->ri", frame, wi)
        hits = scene.intersect(origin + 2e-5 * ng, wi)
        shown = weight * lookup(light.radiance, wi) * ~hits.mask[:, None]
        total += np.stack([np.bincount(row, shown[:, c], len(total)) for c in range(3)], 1) / samples
        on = surface_points(scene, hits, wi, hits.mask[None])
        row, weight, origin = row[hits.mask], weight[hits.mask], on.surface(np.arange(len(on.n)))
        wo, n, ng = on.wo.astype(np.float64), on.n.astype(np.float64), on.ng.astype(np.float64)
    return total
