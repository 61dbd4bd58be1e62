"""What a step with Stable Diffusion costs: the counters, the counts of the full size, and the report on a tiny model."""

import csv
from pathlib import Path

import pytest
import torch

from stages.core.errors import InputError
from stages.report import counters
from stages.report.options import DistillReportOptions
from tests.distill.examples import write_conditions

pytest.importorskip("diffusers", reason='needs pip install ".[sd]"')
from stages.report import distill
from tests.sd import tiny


def test_a_product_is_counted_by_the_book_and_a_view_costs_nothing() -> None:
    a, b = torch.empty(3, 5, device="meta"), torch.empty(5, 7, device="meta")
    cost = counters.count(lambda: (a @ b).view(7, 3))
    assert cost == counters.Cost(2 * 3 * 5 * 7, 4 * (15 + 35 + 21))
    backward = counters.count(lambda: (a.requires_grad_() @ b).sum().backward())
    assert backward.flops == 2 * cost.flops


def test_peaks_are_those_of_a_computer() -> None:
    device = torch.device("cpu")
    assert 1e9 < counters.peak_flops(device, torch.float32, 512) < 1e16
    assert 1e8 < counters.peak_bandwidth(device, 1 << 24) < 1e14


def test_networks_have_the_size_of_stable_diffusion_2() -> None:
    """866 M parameters in the UNet, 364 M in the ControlNet, 34 M in the VAE's encoder, as published."""
    unet, controlnet, vae = distill.networks(torch.device("meta"))
    sizes = [sum(p.numel() for p in network.parameters()) / 1e6 for network in (unet, controlnet, vae.encoder)]
    assert sizes == pytest.approx([865.9, 364.2, 34.2], abs=0.3)


def test_report_on_a_tiny_model(tmp_path: Path) -> None:
    models = tiny.write_models(tmp_path)
    conditions = write_conditions(tmp_path / "conditions", views=2, size=16)
    options = DistillReportOptions(str(models / "sd"), str(models / "controlnet"), warm_up=0, steps=2)
    report = distill.report_distill(conditions, tmp_path / "out", options)
    assert sum(part.share_percent for part in report.parts) == pytest.approx(100)
    assert all(part.milliseconds > 0 for part in report.parts) and report.step_milliseconds > 0
    counted = {part.part: part for part in report.parts if part.gbyte > 0}
    assert len(counted) == 6 and all(part.of_peak_percent > 0 for part in counted.values())  # in a cache, memory has no peak
    denoise = counted[distill.NAMES["denoise"]]
    assert denoise.gflop > counted[distill.NAMES["residual"]].gflop > 0
    with (tmp_path / "out" / "distill.csv").open() as stream:
        assert [row["part"] for row in csv.DictReader(stream)] == list(distill.NAMES.values())
    assert len(distill.summary(report)) == len(report.parts) + 3


@pytest.mark.parametrize("device", ["nonsense", "meta"])
def test_a_device_that_cannot_be_measured_is_named(tmp_path: Path, device: str) -> None:
    conditions = write_conditions(tmp_path / "conditions", views=1, size=16)
    with pytest.raises(InputError, match=f"--device {device}"):
        distill.report_distill(conditions, tmp_path / "out", DistillReportOptions(device=device))
    assert not (tmp_path / "out").exists()


def test_views_that_the_model_cannot_take_are_named(tmp_path: Path) -> None:
    conditions = write_conditions(tmp_path / "conditions", views=1, size=16)
    with pytest.raises(InputError, match="16 x 16 pixels, expected a multiple of 64"):
        distill.report_distill(conditions, tmp_path / "out", DistillReportOptions())
