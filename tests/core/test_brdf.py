"""Samplers against their densities (chi squared), inverses, reciprocity, energy and extreme values of the BRDF."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from stages.core import brdf

ALPHAS = (0.01, 0.1, 0.36, 1.0)
COSINES = (0.02, 0.3, 0.75, 1.0)


def view(cosine: float) -> tuple[float, float, float]:
    return math.sqrt(1 - cosine**2), 0.0, cosine


def chi_squared_p(counts: np.ndarray, expected: np.ndarray) -> float:
    """P-value of observed against expected counts, bins under 5 pooled."""
    small = expected < 5
    observed = np.append(counts[~small], counts[small].sum())
    predicted = np.append(expected[~small], expected[small].sum())
    keep = predicted > 0
    statistic = ((observed[keep] - predicted[keep]) ** 2 / predicted[keep]).sum()
    return float(chi2.sf(statistic, max(int(keep.sum()) - 1, 1)))


@pytest.mark.parametrize("alpha", ALPHAS)
@pytest.mark.parametrize("cosine", COSINES)
def test_vndf_samples_follow_their_density(alpha: float, cosine: float) -> None:
    """Bins are in the slope plane, where every alpha has the same extent; the density is integrated by midpoints."""
    generator = np.random.default_rng(11)
    x, y, z = view(cosine)
    count, bins, fine, reach = 40_000, 10, 24, 4.0
    u = generator.random((count, 2))
    m = np.array([brdf.sample_vndf(x, y, z, alpha, a, b) for a, b in u])
    slopes = m[:, :2] / m[:, 2:] / alpha
    edges = np.linspace(-reach, reach, bins + 1)
    counts, _, _ = np.histogram2d(slopes[:, 0], slopes[:, 1], [edges, edges])
    centres = (np.arange(bins * fine) + 0.5) / (bins * fine) * 2 * reach - reach
    sx, sy = np.meshgrid(centres * alpha, centres * alpha, indexing="ij")
    m_z = 1 / np.sqrt(1 + sx**2 + sy**2)
    reflected = brdf.vectorized(brdf.pdf_vndf)(z, sx * m_z, sy * m_z, m_z, alpha)
    towards = np.maximum(x * sx * m_z + z * m_z, 0)  # microfacets turned away are not visible
    density = reflected * 4 * towards * m_z**3  # 1/sr of wi -> of wm -> of slope
    cell = (2 * reach / (bins * fine) * alpha) ** 2
    expected = count * (density * cell).reshape(bins, fine, bins, fine).sum((1, 3))
    outside = count - counts.sum()
    p = chi_squared_p(np.append(counts.ravel(), outside), np.append(expected.ravel(), count - expected.sum()))
    assert p > 1e-4


def test_cosine_samples_follow_their_density() -> None:
    generator = np.random.default_rng(5)
    d = np.array([brdf.sample_cosine(a, b) for a, b in generator.random((40_000, 2))])
    counts, _, _ = np.histogram2d(d[:, 2] ** 2, np.arctan2(d[:, 1], d[:, 0]), [8, 8], [[0, 1], [-np.pi, np.pi]])
    assert chi_squared_p(counts.ravel(), np.full(64, 40_000 / 64)) > 1e-4


@pytest.mark.parametrize("alpha", ALPHAS)
def test_sampling_is_inverted(alpha: float) -> None:
    for u0, u1 in np.random.default_rng(1).random((50, 2)):
        wo = np.array(view(0.4))
        m = brdf.sample_vndf(*wo, alpha, u0, u1)
        assert brdf.invert_vndf(*wo, alpha, *m) == pytest.approx((u0, u1), abs=2e-6)
        assert brdf.invert_cosine(*brdf.sample_cosine(u0, u1)) == pytest.approx((u0, u1), abs=1e-9)


def test_reciprocity() -> None:
    generator = np.random.default_rng(2)
    for _ in range(100):
        wi, wo = (v / np.linalg.norm(v) for v in generator.normal(size=(2, 3)) * [1, 1, 0] + [0, 0, 0.4])
        m = (wi + wo) / np.linalg.norm(wi + wo)
        forth = brdf.specular_over_f(wo[2], wi[2], *m, 0.2) / wi[2]
        back = brdf.specular_over_f(wi[2], wo[2], *m, 0.2) / wo[2]
        assert forth == pytest.approx(back, rel=1e-12)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_specular_reflects_no_more_than_it_receives(alpha: float) -> None:
    albedo = brdf.directional_albedo(np.linspace(0.02, 1, 12), alpha, 96)
    assert np.all(albedo[:, 1] + albedo[:, 2] <= 1 + 1e-9)
    assert np.all(albedo >= 0)


def test_density_is_exact_for_sharp_lobes() -> None:
    """From the tangent frame D keeps its digits where 1 - (N·H)^2 would lose them all."""
    alpha, angle = 1e-4, 2e-4
    exact = alpha**2 / (math.pi * (math.sin(angle) ** 2 + alpha**2 * math.cos(angle) ** 2) ** 2)
    m = np.float32(math.sin(angle)), np.float32(0), np.float32(math.cos(angle))
    assert brdf.ggx_d(*map(float, m), alpha) == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("alpha", (brdf.MIN_ALPHA, 0.5, 1.0))
@pytest.mark.parametrize("cosine", (1e-3, 1e-2, 1.0))
def test_finite_at_the_ends(alpha: float, cosine: float) -> None:
    for u in (0.0, 0.5, 1 - 1e-12):
        x, y, z = view(cosine)
        m = brdf.sample_vndf(x, y, z, alpha, u, u)
        values = (*m, brdf.pdf_vndf(z, *m, alpha), brdf.specular_over_f(z, z, *m, alpha))
        assert np.isfinite(values).all()
        assert np.linalg.norm(m) == pytest.approx(1, abs=1e-9)
