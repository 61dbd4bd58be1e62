"""RowAdam: Adam where there is a gradient, nothing where there is none."""

import numpy as np
import torch
from torch import nn

from stages.distill.optimizer import BETAS, EPS, RowAdam, corrected_rates, update_rows, update_rows_reference


def generator(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def state(rows: int = 300, columns: int = 2) -> tuple[torch.Tensor, ...]:
    parameter = torch.randn(rows, columns, generator=generator())
    return parameter, torch.zeros_like(parameter), torch.zeros_like(parameter), torch.zeros(rows, dtype=torch.int32)


def test_compiled_update_matches_the_plain_form() -> None:
    fast, slow = state(), tuple(t.double() if t.is_floating_point() else t for t in state())
    for step in range(1, 30):
        rows = torch.randperm(300, generator=generator(step))[:120].sort().values
        gradient = torch.randn(120, 2, generator=generator(100 + step)) * 10.0 ** (step % 7 - 5)
        rates = corrected_rates(0.01, step)
        update_rows(fast, rows, gradient, rates)  # type: ignore[arg-type]
        update_rows_reference(slow, rows, gradient.double(), rates)  # type: ignore[arg-type]
    assert torch.equal(fast[3], slow[3])
    for a, b in zip(fast[:3], slow[:3], strict=True):
        torch.testing.assert_close(a.double(), b, rtol=1e-5, atol=1e-6)


def test_equals_torch_adam_when_every_step_has_a_gradient() -> None:
    start = torch.randn(5, 3, generator=generator(1))
    ours, theirs = nn.Parameter(start.clone()), nn.Parameter(start.clone())
    optimizer, reference = RowAdam({"w": ours}, frozenset()), torch.optim.Adam([theirs], 0.01, BETAS, EPS)
    for step in range(25):
        gradient = torch.randn(5, 3, generator=generator(step))
        ours.grad, theirs.grad = gradient.clone(), gradient.clone()
        optimizer.step(0.01)
        reference.step()
    torch.testing.assert_close(ours, theirs, rtol=1e-5, atol=1e-6)


def test_a_row_without_gradient_is_left_alone_and_counts_its_own_updates() -> None:
    table = nn.Parameter(torch.randn(10, 2, generator=generator(2)))
    before = table.detach().clone()
    optimizer = RowAdam({"table": table}, frozenset({"table"}))
    for step in range(5):
        rows = torch.tensor([[3, 7]]) if step == 4 else torch.tensor([[3]])
        table.grad = torch.sparse_coo_tensor(rows, torch.ones(rows.shape[1], 2), table.shape)
        optimizer.step(0.01)
    untouched = [0, 1, 2, 4, 5, 6, 8, 9]
    assert torch.equal(table.detach()[untouched], before[untouched])
    np.testing.assert_array_equal(optimizer.to_arrays()["count.table"][[3, 7]], [5, 1])
    torch.testing.assert_close(table.detach()[7], before[7] - 0.01, rtol=1e-5, atol=1e-6)  # a first Adam step is the rate


def test_dense_gradient_of_a_table_updates_the_rows_that_have_one() -> None:
    """On a device without compiled kernels the table's gradient is dense."""
    tables = [nn.Parameter(torch.randn(20, 2, generator=generator(3))) for _ in range(2)]
    optimizers = [RowAdam({"table": t}, frozenset({"table"})) for t in tables]
    for step in range(4):
        rows = torch.randperm(20, generator=generator(step))[:6].sort().values
        values = torch.randn(6, 2, generator=generator(50 + step))
        sparse = torch.sparse_coo_tensor(rows[None], values, (20, 2))
        tables[0].grad, tables[1].grad = sparse, sparse.to_dense()
        for optimizer in optimizers:
            optimizer.step(0.01)
    assert torch.equal(tables[0], tables[1])


def test_rows_that_come_twice_or_out_of_order_are_summed_first() -> None:
    table = nn.Parameter(torch.zeros(6, 2))
    optimizer = RowAdam({"table": table}, frozenset({"table"}))
    rows, values = torch.tensor([[4, 1, 4]]), torch.tensor([[1.0, 2.0], [5.0, 6.0], [-3.0, 4.0]])
    table.grad = torch.sparse_coo_tensor(rows, values, table.shape, check_invariants=True)
    optimizer.step(0.01)
    state = optimizer.to_arrays()
    np.testing.assert_array_equal(state["count.table"], [0, 1, 0, 0, 1, 0])
    np.testing.assert_allclose(state["m.table"][[1, 4]], (1 - BETAS[0]) * np.array([[5, 6], [-2, 6]]), rtol=1e-6)


def test_state_comes_back() -> None:
    def run(optimizer: RowAdam, parameter: nn.Parameter, steps: range) -> None:
        for step in steps:
            parameter.grad = torch.randn(4, 3, generator=generator(step))
            optimizer.step(0.02)

    first = nn.Parameter(torch.zeros(4, 3))
    optimizer = RowAdam({"w": first}, frozenset())
    run(optimizer, first, range(3))
    second = nn.Parameter(first.detach().clone())
    again = RowAdam({"w": second}, frozenset())
    again.load_arrays({name: array.copy() for name, array in optimizer.to_arrays().items()}, steps=3)
    run(optimizer, first, range(3, 6))
    run(again, second, range(3, 6))
    assert torch.equal(first, second)
