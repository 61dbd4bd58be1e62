"""Classifier Score Distillation as a function of three predictions."""

import torch

from stages.distill.guidance.csd import (
    CSD,
    SDS,
    Weights,
    chosen_weights,
    classifier_score,
    distillation_score,
    posterior_score,
)
from stages.distill.options import DistillOptions, ScoreOptions

OWN = Weights(2.5, (0.0, 0.0), 0.5)


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


def test_what_is_left_open_is_the_models_own_or_dreamfusions() -> None:
    assert chosen_weights(DistillOptions(), OWN) == OWN
    assert chosen_weights(DistillOptions(), CSD) == Weights(1.05, (1.0, 0.5), 0.0)
    assert chosen_weights(DistillOptions(score=ScoreOptions(loss="sds")), OWN) == Weights(100.0, (0.0, 0.0), 1.0)
    assert chosen_weights(DistillOptions(score=ScoreOptions(eta1=0.0, eta2=(0.2, 0.1))), CSD) == Weights(0.0, (0.2, 0.1), 0.0)


def test_sds_is_dreamfusions_equation() -> None:
    """(1 + w) positive - w null - noise with w = 100, weighed by 1 - alpha_bar; a negative prompt is not asked."""
    alpha_bar = torch.linspace(0.999, 0.01, 1000, dtype=torch.float64)
    image, predicted, asked = noise(8), noise(9), []

    def predict(x_t: torch.Tensor, t: torch.Tensor, branches: int) -> torch.Tensor:
        asked.append((x_t, t))
        return torch.cat([predicted, -0.5 * predicted])

    generator = torch.Generator().manual_seed(3)
    found = distillation_score(predict, image, alpha_bar, SDS, 0.9, generator)
    ((x_t, t),) = asked
    assert len(x_t) == len(t) == 4 and torch.equal(x_t[:2], x_t[2:]) and torch.equal(t[:2], t[2:])
    a = alpha_bar[t[:2]][:, None, None, None]
    added = (x_t[:2] - a.sqrt() * image) / (1 - a).sqrt()
    torch.testing.assert_close(found, (1 - a) * (101 * predicted + 100 * 0.5 * predicted - added))
    assert abs(float(added.std()) - 1) < 0.3
