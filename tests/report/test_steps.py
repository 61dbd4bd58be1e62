"""Shading by Monte Carlo, from the transport and by quadrature agree, and so do their gradients."""

import numpy as np
import pytest
import torch

from stages.core.shading import Material
from stages.light.light_set import light_set
from stages.report import steps
from stages.report.monte_carlo import shade_monte_carlo
from tests.light import scenes

VALUES = torch.tensor([0.8, 0.4, 0.2, 0.55, 0.3])


def test_monte_carlo_averages_to_the_quadrature(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, light = scenes.box_in_corner(), scenes.sunny_light()
    points = scenes.view_of(scene, 24)[np.array([40, 200])]
    materials = VALUES.repeat(2, 1)
    exact = steps.exact_gradient(scene, points, light.radiance, materials, np.arange(2))
    generator = np.random.default_rng(0)
    runs = []
    for _ in range(200):
        values = materials.clone().requires_grad_()
        shade_monte_carlo(scene, points, light, Material.of(values), generator).sum().backward()
        assert values.grad is not None
        runs.append(values.grad)
    stacked = torch.stack(runs)
    noise = stacked.std(0) / len(runs) ** 0.5
    assert ((stacked.mean(0) - exact).abs() < 4 * noise + 0.02 * exact.abs()).all()


def test_transport_is_faster_and_more_exact(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(steps, "PIXELS", 64)
    scene = scenes.box_in_corner()
    points = scenes.view_of(scene, 48)
    rows = steps.measure(scene, points, light_set([scenes.sunny_light()]), 0)
    ours, rays = rows
    assert ours.gradient_error_percent < 0.2 * rays.gradient_error_percent
    assert ours.milliseconds < 0.05 * rays.milliseconds
