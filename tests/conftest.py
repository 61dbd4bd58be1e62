"""Fixtures that every test shares: golden files and the optional real assets."""

import os
from collections.abc import Mapping
from pathlib import Path

if "PYTEST_XDIST_WORKER" in os.environ:  # a thread each, or workers wait for each other's cores: twice as long
    os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import pytest
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent
GOLDEN = ROOT / "tests" / "golden"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="rewrite the golden files instead of comparing")


class Golden:
    """Compares named arrays with `tests/golden/<name>.npz`; only `--update-golden` writes there."""

    def __init__(self, update: bool, scratch: Path) -> None:
        self.update = update
        self.scratch = scratch

    def check(self, name: str, arrays: Mapping[str, NDArray], atol: float = 0.0, rtol: float = 0.0) -> None:
        """Fail where an array differs by more than atol + rtol |reference|; output and difference are kept."""
        path = GOLDEN / f"{name}.npz"
        arrays = {key: np.asarray(value) for key, value in arrays.items()}
        if self.update:
            path.parent.mkdir(parents=True, exist_ok=True)
            np.savez_compressed(path, **arrays)
            return
        assert path.is_file(), f"{path} is missing; make it with pytest --update-golden and look at it"
        with np.load(path, allow_pickle=False) as reference:
            assert sorted(reference.files) == sorted(arrays)
            wrong = [key for key in reference.files if not self._same(reference[key], arrays[key], atol, rtol)]
            if wrong:
                kept = self.scratch / f"{path.stem}_difference.npz"
                np.savez_compressed(kept, **{f"{k}_output": arrays[k] for k in wrong})
                detail = ", ".join(self._describe(key, reference[key], arrays[key]) for key in wrong)
                pytest.fail(f"{name} differs from {path}: {detail}; the output is in {kept}")

    @staticmethod
    def _same(reference: NDArray, output: NDArray, atol: float, rtol: float) -> bool:
        if reference.shape != output.shape or reference.dtype != output.dtype:
            return False
        if reference.dtype.kind not in "fc":
            return bool(np.array_equal(reference, output))
        return bool(np.allclose(output, reference, rtol=rtol, atol=atol, equal_nan=True))

    @staticmethod
    def _describe(key: str, reference: NDArray, output: NDArray) -> str:
        if reference.shape != output.shape or reference.dtype != output.dtype:
            return f"{key} is {output.dtype}{output.shape}, expected {reference.dtype}{reference.shape}"
        if reference.dtype.kind not in "fiub":
            return f"{key} differs"
        difference = np.abs(output.astype(float) - reference.astype(float))
        return f"{key} by at most {difference.max():.3g}, in {int((difference > 0).sum())} of {difference.size} values"


@pytest.fixture
def golden(request: pytest.FixtureRequest, tmp_path: Path) -> Golden:
    return Golden(request.config.getoption("--update-golden"), tmp_path)


@pytest.fixture(scope="session")
def assets() -> Path:
    """The folder of real meshes, lights and materials beside the project; tests that need it skip without it."""
    folder = ROOT.parent / "shared" / "assets"
    if not folder.is_dir():
        pytest.skip("the optional assets are not beside the project")
    return folder


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The long files first, those that run whole stages, so that no worker is left with one at the end."""
    items.sort(key=lambda item: item.path.parent != ROOT / "tests")
