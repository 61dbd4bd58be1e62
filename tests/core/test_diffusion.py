import torch

from stages.core import diffusion


def test_schedule_falls_from_clean_to_noise() -> None:
    alpha_bar = diffusion.cosine_schedule()
    assert alpha_bar.shape == (diffusion.STEPS,)
    assert (alpha_bar.diff() < 0).all()
    assert alpha_bar[0] > 0.999 and 0 < alpha_bar[-1] < 1e-4


def test_noise_and_image_come_back_from_velocity() -> None:
    generator = torch.Generator().manual_seed(0)
    alpha_bar = diffusion.cosine_schedule()
    x0, noise = torch.randn(2, 4, 3, 8, 8, generator=generator)
    t = torch.tensor([0, 100, 500, 950])
    x_t = diffusion.add_noise(alpha_bar, x0, noise, t)
    v = diffusion.velocity(alpha_bar, x0, noise, t)
    assert torch.allclose(diffusion.noise_from_velocity(alpha_bar, x_t, v, t), noise, atol=1e-5)
    assert torch.allclose(diffusion.image_from_velocity(alpha_bar, x_t, v, t), x0, atol=1e-5)


def test_ddim_with_the_true_noise_returns_the_image() -> None:
    generator = torch.Generator().manual_seed(0)
    alpha_bar = diffusion.cosine_schedule()
    x0 = torch.rand(2, 3, 8, 8, generator=generator) * 2 - 1

    def true_noise(x_t: torch.Tensor, t: torch.Tensor) -> torch.Tensor:
        a = diffusion.per_image(alpha_bar, t)
        return (x_t - a.sqrt() * x0) / (1 - a).sqrt()

    sampled = diffusion.ddim(alpha_bar, true_noise, torch.randn(2, 3, 8, 8, generator=generator), steps=10)
    assert torch.allclose(sampled, x0, atol=1e-3)
