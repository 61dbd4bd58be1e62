"""Schedules: the paper's numbers at the paper's steps."""

import itertools

import pytest

from stages.distill import schedule


@pytest.mark.parametrize("step, expected", [(0, 1.0), (1000, 0.75), (2000, 0.5), (2999, 0.5)])
def test_eta2_falls_over_the_first_two_thirds(step: int, expected: float) -> None:
    assert schedule.eta2(step / schedule.STEPS, 1.0, 0.5) == pytest.approx(expected)


@pytest.mark.parametrize("step, expected", [(0, (200, 800)), (499, (200, 800)), (500, (20, 500)), (2999, (20, 500))])
def test_times_go_from_structure_to_detail(step: int, expected: tuple[int, int]) -> None:
    assert schedule.time_range(step / schedule.STEPS) == expected


@pytest.mark.parametrize("step, expected", [(0, 1.0), (350, 0.9), (700, 0.8), (2999, 0.8)])
def test_control_weakens_gradually(step: int, expected: float) -> None:
    assert schedule.control_scale(step / schedule.STEPS) == pytest.approx(expected)


def test_learning_rate_is_held_then_falls_to_its_end() -> None:
    rates = [schedule.learning_rate(i / 1000) for i in range(1000)]
    assert rates[0] == rates[399] == 1.0
    assert all(a >= b for a, b in itertools.pairwise(rates))
    assert rates[-1] == pytest.approx(schedule.RATE_END, rel=0.01)


def test_the_pull_on_metallic_sets_in_late() -> None:
    assert schedule.bimodal(0.4) == 0 and schedule.bimodal(1.0) == 1
