"""The Filmic curve: Blender's at the measured points, monotone, and with the gradient of itself everywhere."""

import numpy as np
import pytest
import torch

from stages.sd.filmic import FILE, filmic

POINTS = np.loadtxt(FILE, delimiter=",")


def test_passes_through_the_measured_points() -> None:
    assert POINTS.shape == (65, 3)
    found = filmic(torch.from_numpy(POINTS[:, 1])).numpy()
    assert found == pytest.approx(POINTS[:, 2], abs=2e-6)  # the file's radiance has eight digits


def test_white_is_at_0807_and_middle_grey_lies_under_it() -> None:
    white, grey, black = filmic(torch.tensor([1.0, 0.18, 0.0])).tolist()
    assert white == pytest.approx(0.807, abs=5e-4)
    assert grey == pytest.approx(0.5, abs=5e-3)
    assert black == 0.0


def test_is_linear_in_stops_between_points() -> None:
    radiance = np.exp2(np.random.default_rng(0).uniform(-12.4, 4.0, 500))
    t = (np.log2(radiance) + 12.473931188) / 16.5
    expected = np.interp(t, POINTS[:, 0], POINTS[:, 2])
    assert filmic(torch.from_numpy(radiance)).numpy() == pytest.approx(expected, abs=1e-6)


def test_rises_without_a_step_from_black_to_the_largest_half_float() -> None:
    radiance = torch.cat([torch.zeros(1), torch.logspace(-8, np.log10(65504), 4000, dtype=torch.float64)])
    value = filmic(radiance)
    assert (value.diff() > 0).all() and value.diff().max() < 5e-3
    assert filmic(torch.tensor([16.29, 65504.0])).tolist() == pytest.approx([1.0, 1.134], abs=1e-3)


def test_gradient_is_that_of_finite_differences() -> None:
    generator = torch.Generator().manual_seed(0)
    stops = torch.rand(400, generator=generator, dtype=torch.float64) * 26 - 16  # 1.5e-5 ... 1000
    radiance = torch.exp2(stops)
    h = 1e-6 * radiance
    (gradient,) = torch.autograd.grad(filmic(radiance.requires_grad_()).sum(), radiance)
    difference = (filmic(radiance + h) - filmic(radiance - h)).detach() / (2 * h)
    assert torch.allclose(gradient, difference, rtol=1e-5)


@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16])
def test_gradient_is_finite_and_positive_everywhere(dtype: torch.dtype) -> None:
    radiance = torch.tensor([0.0, 1e-30, 1e-5, 1.7578125e-4, 1.0, 16.3, 65504.0], dtype=dtype, requires_grad=True)
    (gradient,) = torch.autograd.grad(filmic(radiance).sum(), radiance)
    assert torch.isfinite(gradient).all() and (gradient > 0).all()
