"""Sixteen numbers at once are what sixteen numbers one by one are."""

import numpy as np

from stages.core.lanes import LANES, fill, floor, larger, load, root, smaller, store, sum_of, where_positive
from stages.core.parallel import compiled


@compiled
def every_operation(a, b, result):  # type: ignore[no-untyped-def]
    """Each operation of two arrays of as many numbers as there are lanes, in a row of the result; the sum of all of a."""
    x, y = load(a, 0), load(b, 0)
    found = (x + y, x - y, x * y, x / y, x + 2, np.float32(3) - y, x * 0.5, 1.0 / y)
    for k, values in enumerate(found):
        store(result, k * LANES, values)
    store(result, 8 * LANES, larger(x, y))
    store(result, 9 * LANES, smaller(x, y))
    store(result, 10 * LANES, where_positive(x, y, fill(np.float32(7))))
    store(result, 11 * LANES, root(y))
    store(result, 12 * LANES, floor(x))
    return sum_of(x)


def test_every_operation_is_that_of_numpy() -> None:
    generator = np.random.default_rng(0)
    a, b = generator.normal(size=LANES).astype(np.float32), generator.uniform(0.1, 2, LANES).astype(np.float32)
    a[3] = 0
    result = np.empty((13, LANES), np.float32)
    whole = every_operation(a, b, result)
    expected = (
        a + b, a - b, a * b, a / b, a + 2, 3 - b, a / 2, 1 / b,
        np.maximum(a, b), np.minimum(a, b), np.where(a > 0, b, 7), np.sqrt(b), np.floor(a),
    )  # fmt: skip
    assert np.array_equal(result, np.stack(expected).astype(np.float32))
    assert abs(whole - a.sum()) < 1e-5


@compiled
def shifted(values, start, result):  # type: ignore[no-untyped-def]
    """Some of an array of two axes, written to another place of it."""
    store(result, start + 1, load(values, start))


def test_they_lie_one_after_the_other_from_any_element_on() -> None:
    values = np.arange(60, dtype=np.float32).reshape(3, 20)
    result = np.zeros_like(values)
    shifted(values, 13, result)
    assert result.ravel()[14:30].tolist() == list(range(13, 29))
    assert not result.ravel()[:14].any() and not result.ravel()[30:].any()
