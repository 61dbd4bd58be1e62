"""Transport in files: rounding and what it costs."""

from pathlib import Path

import numpy as np
import torch

from stages.core.shading import KNOTS, Transport
from stages.core.views import Geometry, read_geometry, read_transport, write_geometry, write_transport


def test_stored_transport_errs_by_less_than_half_a_percent(tmp_path: Path) -> None:
    """Seven bits of significand: 2^-8 at most; N·V keeps all ten; values over a half float's range come back."""
    generator = torch.Generator().manual_seed(0)
    count = 64
    E = torch.rand(count, 3, generator=generator) * 1e6
    A, B = torch.rand(2, count, len(KNOTS), 3, generator=generator) * 1e6
    cosine = torch.rand(count, generator=generator)
    mask = np.ones((8, 8), bool)
    (tmp_path / "view_000").mkdir()
    label = np.arange(64, dtype=np.int32).reshape(8, 8) + 2**24 - 64
    write_geometry(tmp_path, 0, Geometry(mask, mask.astype(np.float32), np.zeros((8, 8, 3), np.float32), label))
    assert np.array_equal(read_geometry(tmp_path, 0).label, label)
    told = write_transport(tmp_path, 0, "sky", mask, Transport(E, A, B, cosine))
    found = read_transport(tmp_path, 0, "sky", mask)
    assert torch.equal(told.packed(), found.packed())
    for stored, exact in ((found.E, E), (found.A, A), (found.B, B)):
        assert float(((stored.float() - exact).abs() / exact).max()) <= 2**-8 + 2**-11
    assert float((found.cosine.float() - cosine).abs().max()) <= 2**-11
