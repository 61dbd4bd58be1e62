"""Classifier Score Distillation as a function of three predictions."""

import torch

from stages.distill.guidance.csd import classifier_score, posterior_score


def noise(seed: int) -> torch.Tensor:
    return torch.randn(2, 3, 4, 4, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def test_equal_predictions_give_exactly_nothing() -> None:
    e = noise(0)
    assert torch.equal(classifier_score(e, e, e, 1.05, 0.7), torch.zeros_like(e))


def test_is_the_papers_equation() -> None:
    positive, null, negative = noise(1), noise(2), noise(3)
    expected = 1.05 * positive + (0.6 - 1.05) * null - 0.6 * negative
    torch.testing.assert_close(classifier_score(positive, null, negative, 1.05, 0.6), expected)


def test_without_a_negative_branch_it_is_the_classifier_alone() -> None:
    positive, null = noise(4), noise(5)
    torch.testing.assert_close(classifier_score(positive, null, noise(6), 1.0, 0.0), positive - null)


def test_posterior_score_vanishes_for_the_true_noise() -> None:
    assert torch.equal(posterior_score(noise(7), noise(7)), torch.zeros(2, 3, 4, 4, dtype=torch.float64))
