"""The residual: the grid reproduces constants, its kernels agree with the plain form, its bounds hold."""

import numpy as np
import pytest
import torch

from stages.core import parallel
from stages.core.schemas import MATERIAL
from stages.material.residual import Residual, ResidualConfig, combined, encode_reference
from stages.material.stored import StoredResidual, with_residual

SMALL = ResidualConfig(levels=5, log2_entries=12, base=4, growth=1.8, hidden=8)


def generator(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def points(count: int, seed: int = 1) -> torch.Tensor:
    return torch.rand(count, 3, generator=generator(seed)) - 0.5


def residual(config: ResidualConfig = SMALL) -> Residual:
    made = Residual(config, generator())
    with torch.no_grad():
        made.table.uniform_(-1, 1, generator=generator(2))
    return made


def test_constant_table_is_reproduced_everywhere() -> None:
    made = residual()
    with torch.no_grad():
        made.table.copy_(torch.tensor([0.3, -2.0]).expand_as(made.table))
    features = made._encode(points(500))
    expected = torch.tensor([0.3, -2.0]).repeat(SMALL.levels)[:, None].expand_as(features)
    torch.testing.assert_close(features, expected, rtol=1e-6, atol=1e-6)


def test_dense_level_is_exact_at_its_corners() -> None:
    """On the corners of a level that fits, look-up returns the corner's own entry: no two corners share one."""
    config = ResidualConfig(levels=1, log2_entries=12, base=4)
    made = residual(config)
    corners = torch.cartesian_prod(*[torch.arange(5.0)] * 3) / 4 - 0.5
    rows = {tuple(f.tolist()) for f in made._encode(corners).T}
    assert len(rows) == 125 == len(made.table)


def test_hashed_level_uses_no_more_rows_than_its_table() -> None:
    layout = SMALL.layout()
    assert (layout[:, 2] <= 4096).all() and layout[-1, 2] == 4096 and layout[0, 2] == 125
    assert layout[-1, 1] + layout[-1, 2] == len(residual().table)


@pytest.mark.parametrize("count", [0, 1, 777])
def test_kernels_match_the_plain_form(count: int) -> None:
    made, p = residual(), points(count) * 1.1
    features = made._encode(p)
    expected = encode_reference(p.double(), made.table.double(), SMALL.layout())
    assert features.shape == (2 * SMALL.levels, count)
    torch.testing.assert_close(features.double(), expected, rtol=1e-4, atol=1e-5)
    weight = torch.randn(features.shape, generator=generator(3))
    (gradient,) = torch.autograd.grad((features * weight).sum(), made.table)
    (plain,) = torch.autograd.grad((encode_reference(p, made.table, SMALL.layout()) * weight).sum(), made.table)
    torch.testing.assert_close(gradient.to_dense(), plain, rtol=1e-4, atol=1e-4)


def test_table_gradient_lists_each_row_once_in_order() -> None:
    made = residual()
    (gradient,) = torch.autograd.grad(made._encode(points(400)).sum(), made.table)
    rows = gradient.coalesce().indices()[0]
    assert gradient.is_coalesced() and (rows[1:] > rows[:-1]).all()


def test_result_does_not_depend_on_the_number_of_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    made, p = residual(), points(5000)
    results = []
    for threads in (1, 2, 3):
        monkeypatch.setattr(parallel, "cores", lambda threads=threads: threads)
        features = made._encode(p)
        results.append((features, torch.autograd.grad(features.sin().sum(), made.table)[0].to_dense()))
    for features, gradient in results[1:]:
        assert torch.equal(features, results[0][0]) and torch.equal(gradient, results[0][1])


def test_gradcheck_of_the_plain_form() -> None:
    config = ResidualConfig(levels=2, log2_entries=6, base=2, growth=2.2)
    table = torch.randn(int(config.layout()[:, 2].sum()), 2, dtype=torch.float64, generator=generator(4))
    p = points(4).double() * 0.93
    inputs = (p.requires_grad_(), table.requires_grad_())
    assert torch.autograd.gradcheck(lambda p, table: encode_reference(p, table, config.layout()), inputs)


def test_it_is_finite_and_clamped_at_and_beyond_the_box() -> None:
    made = residual()
    corners = torch.cartesian_prod(*[torch.tensor([-0.5, 0.5])] * 3)
    for scale in (1.0, 1.0001, 3.0, 1e30):
        found = made(corners * scale)
        assert torch.isfinite(found).all()
        torch.testing.assert_close(found, made(corners))


def test_it_starts_next_to_nothing() -> None:
    assert Residual(ResidualConfig(), generator())(points(100)).abs().max() < 2e-3


def test_without_a_residual_the_recipe_is_the_material() -> None:
    base = torch.rand(200, 5, generator=generator())
    base[0], base[1] = 0.0, 1.0
    torch.testing.assert_close(combined(base, torch.zeros(200, 5)), base, rtol=0, atol=1e-6)


def test_a_residual_is_added_to_the_logit() -> None:
    base = 0.1 + 0.8 * torch.rand(50, 5, generator=generator())
    added = torch.randn(50, 5, generator=generator(1))
    torch.testing.assert_close(combined(base, added), torch.sigmoid(torch.logit(base) + added), rtol=0, atol=1e-6)


def test_it_stays_in_range_and_finds_back_from_beyond_the_ends() -> None:
    base = torch.tensor([[0.0, 1.0, 0.01, 0.99, 0.5]])
    for value in (-9.0, -0.5, 0.5, 9.0):
        added = torch.full((1, 5), value, requires_grad=True)
        found = combined(base, added)
        assert float(found.detach().min()) >= 0 and float(found.detach().max()) <= 1
        (slope,) = torch.autograd.grad(found.sum(), added)
        assert (slope > 0).all()


def test_arrays_are_combined_as_tensors_are() -> None:
    base = torch.rand(400, 5, generator=generator())
    base[0], base[1] = 0.0, 1.0
    added = 6 * torch.randn(400, 5, generator=generator(1))
    added[2], added[3] = 1e4, -1e4
    found = with_residual(base.numpy(), added.numpy())
    np.testing.assert_allclose(found, combined(base, added).numpy(), rtol=0, atol=1e-6)


def test_arrays_fit_the_schema_and_come_back_equal() -> None:
    made, p = residual(), points(50)
    arrays = made.to_arrays()
    for name, array in arrays.items():
        assert array.dtype == np.float32 and array.ndim == len(MATERIAL.fields[name].shape)
    again = Residual.of(StoredResidual.of(made.config_dict(), arrays))
    assert torch.equal(again(p), made(p)) and again.config == made.config
    with pytest.raises(ValueError, match="table"):
        StoredResidual.of(made.config_dict(), {**arrays, "table": arrays["table"][1:]})


def test_same_seed_same_residual() -> None:
    a, b, c = (Residual(SMALL, generator(seed)).to_arrays() for seed in (5, 5, 6))
    assert all(np.array_equal(a[name], b[name]) for name in a)
    assert not np.array_equal(a["table"], c["table"])


@pytest.mark.parametrize("spacing", [0.05, 0.004, 0.0011])
def test_levels_end_where_the_detail_does(spacing: float) -> None:
    config = ResidualConfig.for_detail(spacing)
    finest = config.resolution(config.levels - 1)
    assert finest * 1.01 >= 1 / spacing
    assert config.levels == 1 or config.resolution(config.levels - 2) < 1 / spacing


def test_no_more_levels_than_the_paper() -> None:
    assert ResidualConfig.for_detail(1e-6) == ResidualConfig()
