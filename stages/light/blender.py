"""Blender's Principled BSDF, white, as the released ControlNet was shown it: six light maps, dielectric and metal.

    dielectric, roughness r    ∫ L v (burley(r) + F D_r G_r / (4 N·V)) dw
    metal, roughness r         ∫ L v D_r G_r / (4 N·V) dw

Burley's diffuse lobe is not reduced by Fresnel's law; the dielectric reflects F0 = 0.08 (Specular 1.0) by the exact law of
the index of refraction that has it. D and G are glTF's, height-correlated; Blender's were separable until version 3.6, which
differs by less than what 8 bits show.

Source: Burley 2012, "Physically-Based Shading at Disney", 5.3; Blender 3.x, intern/cycles/kernel/closure, bsdf_util.h,
bsdf_principled_diffuse.h and bsdf_microfacet.h.
"""

import math

import numba
import numpy as np
from numpy.typing import NDArray

from stages.core.brdf import inlined, sample_cosine, sample_vndf, smith_lambda
from stages.core.parallel import compiled

F0 = 0.08
"""Normal reflectance of the dielectric."""

IOR = (1 + math.sqrt(F0)) / (1 - math.sqrt(F0))
"""The index of refraction that has it."""


@inlined
def fresnel(cosine):  # type: ignore[no-untyped-def]
    """Reflectance of the dielectric at V·H = cosine, rescaled from F0 ... 1 to 0 ... 1; what Schlick's s is to glTF."""
    g = math.sqrt(IOR * IOR - 1 + cosine * cosine)
    a, b = (g - cosine) / (g + cosine), (cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)
    return max(a * a * (1 + b * b) * 0.5 - F0, 0.0) / (1 - F0)


@inlined
def burley(wo_z, wi_z, cosine, roughness, departure):  # type: ignore[no-untyped-def]
    """Diffuse BRDF times N·L. Args: N·V, N·L, V·H; departure: 1, or 0 for Lambert's lobe."""
    x, y = 1 - min(wo_z, 1.0), 1 - min(wi_z, 1.0)
    bend = departure * (2 * roughness * cosine * cosine - 0.5)
    return (1 + bend * x * x * x * x * x) * (1 + bend * y * y * y * y * y) * wi_z / math.pi


@compiled
def open_albedo(cosines, roughness, departure, reflection, resolution):  # type: ignore[no-untyped-def]
    """What an open point reflects of an even light, by float64 midpoint quadrature as in `core.brdf.directional_albedo`.

    Args:
        cosines: (C,) N·V > 0. roughness: (K,) of the glossy lobes, > 0. departure: see `burley`. reflection: weight of the
        dielectric's. resolution: points along each side of the sampling square.
    Returns:
        (C, 1 + 2 K): Burley's lobe at roughness 0, the dielectric at each roughness, the metal at each.
    """
    knots = len(roughness)
    albedo = np.zeros((len(cosines), 1 + 2 * knots))
    for i in range(len(cosines)):
        z = cosines[i]
        x = math.sqrt(max(1 - z * z, 0.0))
        for j in range(resolution):
            for k in range(resolution):
                u0, u1 = (j + 0.5) / resolution, (k + 0.5) / resolution
                d_x, d_y, d_z = sample_cosine(u0, u1)
                half = math.sqrt((d_x + x) ** 2 + d_y**2 + (d_z + z) ** 2)
                cosine = (x * (d_x + x) + z * (d_z + z)) / half
                scale = math.pi / d_z
                albedo[i, 0] += burley(z, d_z, cosine, 0.0, departure) * scale
                for r in range(knots):
                    albedo[i, 1 + r] += burley(z, d_z, cosine, roughness[r], departure) * scale
                    alpha = roughness[r] * roughness[r]
                    m_x, _, m_z = sample_vndf(x, 0.0, z, alpha, u0, u1)
                    cosine_m = x * m_x + z * m_z
                    wi_z = 2 * cosine_m * m_z - z
                    if wi_z > 0:
                        masking = 1 + smith_lambda(z, alpha)
                        weight = masking / (masking + smith_lambda(wi_z, alpha))
                        albedo[i, 1 + r] += reflection * (F0 + (1 - F0) * fresnel(cosine_m)) * weight
                        albedo[i, 1 + knots + r] += weight
    return albedo / (resolution * resolution)


@numba.vectorize
def mirror_reflectance(cosine):  # type: ignore[no-untyped-def]
    """Reflectance of the dielectric at N·V = cosine, an array of any shape."""
    return F0 + (1 - F0) * fresnel(cosine)


LEAST_RISE = 0.01
"""Sine of the angle at which a mirror direction must leave the face, or nine tenths of the viewer's where that is less."""


def lifted(n: NDArray[np.float32], ng: NDArray[np.float32], wo: NDArray[np.float32]) -> NDArray[np.float32]:
    """Normals turned towards the face, just enough that what a mirror shows is not behind it, as Cycles does before shading.

    In the plane of face and normal the viewer stands at an angle a to the face's normal, the normal at b, and the mirror
    direction at 2 b - a; its height over the face is r cos(2 b - a), where r is the viewer's length in that plane.

    Args:
        n, ng, wo: (P, 3) shading normal, the face's normal on the viewer's side, direction to the viewer.
    """
    aside = n - (n * ng).sum(-1, keepdims=True) * ng
    length = np.linalg.norm(aside, axis=-1, keepdims=True)
    aside = aside / np.maximum(length, 1e-20)
    up, across = (wo * ng).sum(-1, keepdims=True), (wo * aside).sum(-1, keepdims=True)
    least = np.minimum(0.9 * up, LEAST_RISE)
    highest = (np.arctan2(across, up) + np.arccos(np.clip(least / np.hypot(across, up), -1, 1))) / 2
    angle = np.minimum(np.arctan2(length, (n * ng).sum(-1, keepdims=True)), highest)
    return (np.sin(angle) * aside + np.cos(angle) * ng).astype(np.float32)
