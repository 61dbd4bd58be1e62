"""The slow, obvious light transport: float64 quadrature over every texel of the light, for a handful of points.

Each texel is cut into subdivision x subdivision cells; at each cell's centre the bilinear radiance, the BRDF and a
shadow ray are evaluated and summed. Nothing is sampled, split, filtered or shared. A mirror (roughness 0) is a delta
and is looked up once.

`reference_light_maps` does the same for Blender's light maps and their bounce: a cell in which the surface stands shows what
that point of it reflects, by the same sum. `reference_radiance` does it for any material and any number of bounces.
"""

from collections.abc import Callable

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


MaterialAt = Callable[[GBuffer], NDArray]
"""Albedo, roughness and metallic of points: (P, 5)."""

AT_ONCE = 1 << 20
"""Directions that are looked along together."""


def reference_radiance(
    scene: Scene, points: GBuffer, environment: Environment, subdivision: int, material: MaterialAt, bounces: int
) -> NDArray[np.float64]:
    """What all points of a view send to its camera, (P, 3), over paths that meet the object `bounces` times more at most.

    Where the surface stands in the way, it shows the same of its own point, by a quadrature of half as many rows, of the light
    halved likewise. Arguments as `reference_transport`; roughness 0 is a mirror alone.
    """
    height, width, _ = environment.radiance.shape
    directions, row_angle = directions_of_texels(height * subdivision, width * subdivision)
    wi, angle = directions.reshape(-1, 3), np.repeat(row_angle, width * subdivision)
    values = material(points).astype(np.float64)
    result = np.empty((len(points.n), 3))
    for first in range(0, len(points.n), max(1, AT_ONCE // len(wi))):
        rows = np.arange(first, min(first + max(1, AT_ONCE // len(wi)), len(points.n)))
        result[rows] = _reflected(scene, points[rows], environment, wi, angle, values[rows], material, bounces)
    return result


def _reflected(
    scene: Scene,
    points: GBuffer,
    environment: Environment,
    wi: NDArray,
    angle: NDArray,
    values: NDArray,
    material: MaterialAt,
    bounces: int,
) -> NDArray[np.float64]:
    """`reference_radiance` of some points. Args: wi, angle: (D, 3), (D,). values: (P, 5)."""
    n, wo = points.n.astype(np.float64), points.wo.astype(np.float64)
    point, ray = np.nonzero(wi @ n.T > 0)[::-1]
    order = np.lexsort((ray, point))
    point, ray = point[order], ray[order]
    shown = _radiance_along(scene, points, point, environment, wi[ray], material, bounces)
    weight = brdf(n[point], wo[point], wi[ray], values[point]) * angle[ray, None]
    result: NDArray[np.float64] = np.stack([np.bincount(point, weight[:, c] * shown[:, c], len(n)) for c in range(3)], 1)
    mirrors = np.flatnonzero(values[:, 3] == 0)
    if len(mirrors):
        n_v = (n * wo).sum(-1)[mirrors, None]
        along = 2 * n_v * n[mirrors] - wo[mirrors]
        c, m = values[mirrors, :3], values[mirrors, 4:5]
        f0 = F0 * (1 - m) + m * c
        shown = _radiance_along(scene, points, mirrors, environment, along, material, bounces)
        result[mirrors] += (f0 + (1 - f0) * (1 - n_v) ** 5) * shown
    return result


def _radiance_along(
    scene: Scene, points: GBuffer, point: NDArray, environment: Environment, wi: NDArray, material: MaterialAt, bounces: int
) -> NDArray[np.float64]:
    """What comes along rays (R, 3) from points of these numbers (R,): the light, or what the surface there sends."""
    ng, surface = points.ng[point].astype(np.float64), points.surface(point).astype(np.float64)
    lifted = 1 - ((wi * ng).sum(-1) / GRAZING).clip(0, 1)[:, None]
    origin = surface + lifted * (points.origin[point] - surface)
    hits = scene.intersect(origin, wi)
    result: NDArray[np.float64] = lookup(environment.radiance, wi) * ~(hits.mask | scene.occluded(origin, wi))[:, None]
    if bounces and hits.mask.any():
        there = surface_points(scene, hits, wi, hits.mask[None])
        result[hits.mask] = reference_radiance(scene, there, halved(environment), 1, material, bounces - 1)
    return result


def halved(environment: Environment) -> Environment:
    """At half as many rows and columns."""
    height, width, _ = environment.radiance.shape
    if height < 8:
        return environment
    mean = environment.radiance.reshape(height // 2, 2, width // 2, 2, 3).mean((1, 3), np.float64)
    return Environment(environment.name, mean.astype(np.float32))


def brdf(n: NDArray, wo: NDArray, wi: NDArray, values: NDArray) -> NDArray[np.float64]:
    """glTF's BRDF times N·L, without the mirror of roughness 0. Args: (R, 3) each; values: (R, 5). Returns: (R, 3)."""
    c, r, m = values[:, :3], values[:, 3], values[:, 4:5]
    n_l, n_v = (n * wi).sum(-1), (n * wo).sum(-1)
    wm = wi + wo
    wm = wm / np.linalg.norm(wm, axis=-1, keepdims=True)
    s = (1 - (wm * wo).sum(-1)) ** 5
    a2 = np.where(r > 0, alpha_from_roughness(r) ** 2, 1.0)
    D = a2 / (np.pi * ((np.cross(wm, n) ** 2).sum(-1) + a2 * (wm * n).sum(-1) ** 2) ** 2)
    lambda_o, lambda_i = (0.5 * (np.sqrt(1 + a2 * (1 - x**2) / x**2) - 1) for x in (n_v, n_l))
    gloss = np.where(r > 0, D / (1 + lambda_o + lambda_i) / (4 * n_v), 0.0)[:, None]
    diffuse = ((1 - F0) * (1 - s) * n_l / np.pi)[:, None]
    s = s[:, None]
    return (1 - m) * c * diffuse + ((F0 * (1 - m) + m * c) * (1 - s) + s) * gloss


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
