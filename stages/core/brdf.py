"""The glTF 2.0 metallic-roughness BRDF: GGX, height-correlated Smith, Schlick Fresnel.

Directions are given in the local frame of the shading normal (z up) and point away from the surface: `wo` to the
viewer, `wi` to the light, `wm` the microfacet normal. Scalar functions are compiled by numba, work in float64
and can be called from other compiled code; NumPy callers use `vectorized`.

Source: Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces"; Heitz 2014, "Understanding the
Masking-Shadowing Function", Eq. 99; Heitz 2018, "Sampling the GGX Distribution of Visible Normals"; glTF 2.0, App. B.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.core.parallel import compiled

MIN_ALPHA = 1e-4
"""Floor of alpha where a density is evaluated; roughness below 0.01 is treated as a mirror by the samplers."""

inlined = compiled(inline="always")


def alpha_from_roughness(roughness: Any) -> Any:
    """alpha = roughness squared, the one place where it is made."""
    return roughness * roughness


def rougher(roughness: NDArray, spread: NDArray) -> NDArray:
    """Roughness of patches whose normals differ by `spread`, a variance of slopes along one axis.

    Source: Toksvig 2005, "Mipmapping Normal Maps"; for GGX, alpha² grows by twice the variance: Kaplanyan et al. 2016,
    "Filtering Distributions of Normals for Shading Antialiasing".
    """
    return np.minimum(roughness**4 + 2 * spread, 1) ** np.float32(0.25)


@inlined
def roughened(roughness, spread):  # type: ignore[no-untyped-def]
    """`rougher` of one patch."""
    return math.sqrt(math.sqrt(min(roughness**4 + 2 * spread, 1.0)))


@inlined
def schlick_weight(cosine):  # type: ignore[no-untyped-def]
    """s = (1 - V·H)^5."""
    x = 1 - cosine
    x2 = x * x
    return x2 * x2 * x


@inlined
def ggx_d(x, y, z, alpha):  # type: ignore[no-untyped-def]
    """GGX density of microfacet normals (x, y, z), 1/sr; the form has no cancellation at small alpha."""
    a2 = alpha * alpha
    q = x * x + y * y + a2 * z * z
    return a2 / (math.pi * q * q)


@inlined
def smith_lambda(z, alpha):  # type: ignore[no-untyped-def]
    """Smith's Lambda of a direction whose cosine with the normal is z > 0."""
    z2 = z * z
    a2 = alpha * alpha
    half = 0.5
    return half * (math.sqrt(1 + a2 * (1 - z2) / z2) - 1)


@inlined
def specular_over_f(wo_z, wi_z, m_x, m_y, m_z, alpha):  # type: ignore[no-untyped-def]
    """D G / (4 N·V) = BRDF times N·L without Fresnel, height-correlated G; wo_z, wi_z > 0."""
    D = ggx_d(m_x, m_y, m_z, alpha)
    G = 1 / (1 + smith_lambda(wo_z, alpha) + smith_lambda(wi_z, alpha))
    return D * G / (4 * wo_z)


@inlined
def pdf_vndf(wo_z, m_x, m_y, m_z, alpha):  # type: ignore[no-untyped-def]
    """Density, in 1/sr of wi, of reflecting wo at a visible microfacet normal: D G1(wo) / (4 N·V)."""
    return ggx_d(m_x, m_y, m_z, alpha) / (1 + smith_lambda(wo_z, alpha)) / (4 * wo_z)


@inlined
def sample_vndf(wo_x, wo_y, wo_z, alpha, u0, u1):  # type: ignore[no-untyped-def]
    """A visible microfacet normal. Source: Dupuy & Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps".

    Args:
        wo: unit; alpha; u0, u1: uniform in [0, 1).
    Returns:
        wm as three scalars.
    """
    x, y, z = wo_x * alpha, wo_y * alpha, wo_z
    s = 1.0 / math.sqrt(x * x + y * y + z * z)
    x, y, z = x * s, y * s, z * s
    phi = 2 * math.pi * u0
    c_z = (1.0 - u1) * (1.0 + z) - z
    sin = math.sqrt(max(1.0 - c_z * c_z, 0.0))
    h_x, h_y, h_z = sin * math.cos(phi) + x, sin * math.sin(phi) + y, c_z + z
    m_x, m_y = h_x * alpha, h_y * alpha
    s = 1.0 / math.sqrt(m_x * m_x + m_y * m_y + h_z * h_z)
    return m_x * s, m_y * s, h_z * s


@inlined
def invert_vndf(wo_x, wo_y, wo_z, alpha, m_x, m_y, m_z):  # type: ignore[no-untyped-def]
    """The (u0, u1) that `sample_vndf` turns into this microfacet normal."""
    x, y, z = wo_x * alpha, wo_y * alpha, wo_z
    s = 1 / math.sqrt(x * x + y * y + z * z)
    x, y, z = x * s, y * s, z * s
    # the sampled cap point c satisfies h = c + i with h parallel to (m_x / alpha, m_y / alpha, m_z)
    h_x, h_y, h_z = m_x / alpha, m_y / alpha, m_z
    t = 2 * (h_x * x + h_y * y + h_z * z) / (h_x * h_x + h_y * h_y + h_z * h_z)
    c_x, c_y, c_z = t * h_x - x, t * h_y - y, t * h_z - z
    u0 = math.atan2(c_y, c_x) / (2 * math.pi)
    return (u0 if u0 >= 0 else u0 + 1), 1 - (c_z + z) / (1 + z)


@inlined
def sample_cosine(u0, u1):  # type: ignore[no-untyped-def]
    """A direction with density cos/pi over the upper hemisphere."""
    r = math.sqrt(u0)
    phi = 2 * math.pi * u1
    return r * math.cos(phi), r * math.sin(phi), math.sqrt(max(1.0 - u0, 0.0))


@inlined
def pdf_cosine(wi_z):  # type: ignore[no-untyped-def]
    """cos/pi, 1/sr."""
    return wi_z / math.pi


@inlined
def invert_cosine(x, y, z):  # type: ignore[no-untyped-def]
    """The (u0, u1) that `sample_cosine` turns into this direction."""
    u1 = math.atan2(y, x) / (2 * math.pi)
    return x * x + y * y, (u1 if u1 >= 0 else u1 + 1)


@compiled
def directional_albedo(cosines, alpha, resolution):  # type: ignore[no-untyped-def]
    """Energy that an unoccluded, uniformly lit point of each term reflects, by float64 midpoint quadrature.

    The quadrature runs over the unit square of `sample_vndf` for A and B and of `sample_cosine` for E, where the
    integrands are smooth.

    Args:
        cosines: (C,) N·V > 0. alpha: GGX width; the E term has none but its Fresnel weight. resolution: points a side.
    Returns:
        (C, 3): E, A, B of a unit environment.
    """
    albedo = np.zeros((len(cosines), 3))
    for i in range(len(cosines)):
        z = cosines[i]
        x = math.sqrt(max(1 - z * z, 0.0))
        for j in range(resolution):
            for k in range(resolution):
                u0, u1 = (j + 0.5) / resolution, (k + 0.5) / resolution
                m_x, _, m_z = sample_vndf(x, 0.0, z, alpha, u0, u1)
                cosine = x * m_x + z * m_z
                wi_z = 2 * cosine * m_z - z
                if wi_z > 0:
                    masking = 1 + smith_lambda(z, alpha)
                    weight = masking / (masking + smith_lambda(wi_z, alpha))
                    s = schlick_weight(cosine)
                    albedo[i, 1] += (1 - s) * weight
                    albedo[i, 2] += s * weight
                d_x, d_y, d_z = sample_cosine(u0, u1)
                half = math.sqrt((d_x + x) ** 2 + d_y**2 + (d_z + z) ** 2)
                cosine = (x * (d_x + x) + z * (d_z + z)) / half
                albedo[i, 0] += 0.96 * (1 - schlick_weight(cosine))
    return albedo / (resolution * resolution)


def vectorized(function):  # type: ignore[no-untyped-def]
    """A NumPy version of one of the scalar functions above, for tests and for code where speed does not matter."""

    def call(*arguments: float | NDArray) -> tuple[NDArray, ...] | NDArray:
        arrays = np.broadcast_arrays(*[np.asarray(a, dtype=np.float64) for a in arguments])
        rows = [function(*row) for row in zip(*[a.ravel() for a in arrays], strict=True)]
        result = np.array(rows, dtype=np.float64)
        shape = arrays[0].shape
        if result.ndim == 1:
            return result.reshape(shape)
        return tuple(result[:, i].reshape(shape) for i in range(result.shape[1]))

    return call
