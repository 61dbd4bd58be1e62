"""The slow, obvious light transport: float64 quadrature over every texel of the light, for a handful of points.

Each texel is cut into subdivision x subdivision cells; at each cell's centre the bilinear radiance, the BRDF and a
shadow ray are evaluated and summed. Nothing is sampled, split, filtered or shared. A mirror (roughness 0) is a delta
and is looked up once.

`reference_light_maps` does the same for Blender's light maps and their bounce: a cell in which the surface stands shows what
that point of it reflects, by the same sum.
"""

import numpy as np
import torch
from numpy.typing import NDArray

from stages.core.brdf import alpha_from_roughness
from stages.core.shading import F0, KNOTS, LIGHT_MAPS, Transport
from stages.light.blender import F0 as BLENDER_F0
from stages.light.environment import Environment, directions_of_texels, lookup
from stages.light.gbuffer import GBuffer, surface_points
from stages.light.scene import Scene
from stages.light.transport_kernels import GRAZING


def reference_transport(
    scene: Scene, points: GBuffer, environment: Environment, subdivision: int, pixels: NDArray
) -> Transport:
    """E, A and B of some points of a view.

    Args:
        subdivision: cells along each side of a texel; the error falls with its square, and a lobe is resolved when a
        cell is smaller than alpha / 4. pixels: (N,) rows of `points`.
    Returns:
        Transport of N points, float64.
    """
    height, width, _ = environment.radiance.shape
    directions, row_angle = directions_of_texels(height * subdivision, width * subdivision)
    angle = np.repeat(row_angle, width * subdivision)
    wi = directions.reshape(-1, 3)
    light = lookup(environment.radiance, wi)  # (D, 3)
    lit = light.any(-1)
    wi, light = wi[lit], light[lit] * angle[lit, None]
    terms = [_point(scene, points, environment, int(i), wi, light) for i in pixels]
    E, A, B = (torch.from_numpy(np.stack(parts)) for parts in zip(*terms, strict=True))
    cosine = torch.from_numpy((points.n[pixels].astype(np.float64) * points.wo[pixels]).sum(-1))
    return Transport(E, A, B, cosine)


def starts(points: GBuffer, i: int, wi: NDArray) -> NDArray[np.float64]:
    """Where rays from point i start, (D, 3): the steeper to its triangle, the nearer to that. Args: wi: (D, 3)."""
    lifted = 1 - (wi @ points.ng[i].astype(np.float64) / GRAZING).clip(0, 1)[:, None]
    surface = points.surface(np.array([i])).astype(np.float64)
    return surface + lifted * (points.origin[i] - surface)


def _point(
    scene: Scene, points: GBuffer, environment: Environment, i: int, wi: NDArray, light: NDArray
) -> tuple[NDArray, NDArray, NDArray]:
    n, wo = points.n[i].astype(np.float64), points.wo[i].astype(np.float64)
    above = wi @ n > 0
    wi, light = wi[above], light[above]
    visible = ~scene.occluded(starts(points, i, wi), wi)
    wi, light = wi[visible], light[visible]
    n_l, n_v = wi @ n, float(wo @ n)
    wm = wi + wo
    wm = wm / np.linalg.norm(wm, axis=-1, keepdims=True)
    n_h, s = wm @ n, (1 - wm @ wo) ** 5
    diffuse = (1 - (F0 + (1 - F0) * s)) * n_l / np.pi
    E = diffuse @ light
    A, B = np.zeros((2, len(KNOTS), 3))
    for k, roughness in enumerate(KNOTS):
        if roughness == 0:
            A[k], B[k] = _mirror(scene, environment, points, i, n, wo)
            continue
        a2 = alpha_from_roughness(roughness) ** 2
        sin2 = (np.cross(wm, n) ** 2).sum(-1)
        D = a2 / (np.pi * (sin2 + a2 * n_h**2) ** 2)
        lambda_o, lambda_i = (0.5 * (np.sqrt(1 + a2 * (1 - c**2) / c**2) - 1) for c in (n_v, n_l))
        f = D / (1 + lambda_o + lambda_i) / (4 * n_v)
        A[k], B[k] = ((1 - s) * f) @ light, (s * f) @ light
    return E, A, B


def _mirror(
    scene: Scene, environment: Environment, points: GBuffer, i: int, n: NDArray, wo: NDArray
) -> tuple[NDArray, NDArray]:
    n_v = float(wo @ n)
    wi = (2 * n_v * n - wo)[None]
    radiance = lookup(environment.radiance, wi)[0] * (not scene.occluded(starts(points, i, wi), wi)[0])
    s = (1 - n_v) ** 5
    return (1 - s) * radiance, s * radiance


def reference_light_maps(
    scene: Scene, points: GBuffer, environment: Environment, subdivision: int, pixels: NDArray, bounce: bool = True
) -> NDArray[np.float64]:
    """The light maps of `stages.light.blender` at some points of a view, (N, 6, 3). Arguments as `reference_transport`."""
    height, width, _ = environment.radiance.shape
    directions, row_angle = directions_of_texels(height * subdivision, width * subdivision)
    wi, angle = directions.reshape(-1, 3), np.repeat(row_angle, width * subdivision)
    return np.stack([_light_maps(scene, points, int(i), environment, wi, angle, bounce) for i in pixels])


def _light_maps(
    scene: Scene, points: GBuffer, i: int, environment: Environment, wi: NDArray, angle: NDArray, bounce: bool
) -> NDArray[np.float64]:
    """(6, 3) at point i."""
    n, wo = points.n[i].astype(np.float64), points.wo[i].astype(np.float64)
    above = wi @ n > 0
    shown = _shown(scene, starts(points, i, wi[above]), environment, wi[above], bounce)  # (D, 6, 3)
    mirror = 2 * float(wo @ n) * n - wo
    reflected = _shown(scene, starts(points, i, mirror[None]), environment, mirror[None], bounce)[0]  # (6, 3)
    maps = np.zeros((len(LIGHT_MAPS), 3))
    for j, (metallic, roughness) in enumerate(LIGHT_MAPS):
        diffuse, glossy, fresnel = _principled(n, wo, wi[above], roughness)
        weight = glossy if metallic else diffuse + fresnel * glossy
        maps[j] = (weight * angle[above]) @ shown[:, j]
        if roughness == 0:
            maps[j] += reflected[j] * (1.0 if metallic else _dielectric(float(wo @ n)))
    return maps


def _shown(
    scene: Scene, origin: NDArray, environment: Environment, wi: NDArray, bounce: bool
) -> NDArray[np.float64]:
    """What a point sees along rays, origin and wi (D, 3), for each map: the light, or what the surface there reflects of it."""
    hits = scene.intersect(origin, wi)
    result = np.repeat(lookup(environment.radiance, wi)[:, None] * ~hits.mask[:, None, None], len(LIGHT_MAPS), 1)
    if bounce and hits.mask.any():
        there = surface_points(scene, hits, wi, hits.mask[None])
        result[hits.mask] = reference_light_maps(scene, there, environment, 1, np.arange(len(there.n)), bounce=False)
    return result


def _principled(n: NDArray, wo: NDArray, wi: NDArray, roughness: float) -> tuple[NDArray, NDArray, NDArray]:
    """Burley's lobe and D G / (4 N·V), times N·L, and Fresnel's factor, along directions (D, 3)."""
    n_l, n_v = wi @ n, float(wo @ n)
    wm = wi + wo
    wm = wm / np.linalg.norm(wm, axis=-1, keepdims=True)
    v_h = wm @ wo
    bend = 2 * roughness * v_h**2 - 0.5
    diffuse = (1 + bend * (1 - n_l) ** 5) * (1 + bend * (1 - n_v) ** 5) * n_l / np.pi
    if roughness == 0:
        return diffuse, np.zeros_like(diffuse), np.zeros_like(diffuse)
    a2 = alpha_from_roughness(roughness) ** 2
    D = a2 / (np.pi * ((np.cross(wm, n) ** 2).sum(-1) + a2 * (wm @ n) ** 2) ** 2)
    lambda_o, lambda_i = (0.5 * (np.sqrt(1 + a2 * (1 - c**2) / c**2) - 1) for c in (n_v, n_l))
    return diffuse, D / (1 + lambda_o + lambda_i) / (4 * n_v), _dielectric(v_h)


def _dielectric(cosine: NDArray | float) -> NDArray:
    """Fresnel reflectance of the index of refraction that reflects BLENDER_F0 head-on, by its two polarisations."""
    c = np.asarray(cosine, np.float64)
    eta = (1 + BLENDER_F0**0.5) / (1 - BLENDER_F0**0.5)
    inside = np.sqrt(1 - (1 - c**2) / eta**2)
    parallel, across = (eta * c - inside) / (eta * c + inside), (c - eta * inside) / (c + eta * inside)
    return (parallel**2 + across**2) / 2
