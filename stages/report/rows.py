"""Lines of the tables that reports write."""

import csv
import dataclasses
import io
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stages.core.artifact import write_text


@dataclass(frozen=True)
class Row:
    """One measurement. seconds: of the whole view and all environments. Errors in percent.

    floor_percent: how far the converged result itself may be off, from its two seeds.
    """

    setting: str
    lobe_rays: int
    light_rays: int
    environment: str
    map: str
    seconds: float
    rmse_percent: float
    p999_percent: float
    floor_percent: float


def write_csv(path: Path, rows: Iterable[Any]) -> None:
    """One line a dataclass, its fields as columns."""
    rows = list(rows)
    stream = io.StringIO()
    writer = csv.DictWriter(stream, [f.name for f in dataclasses.fields(rows[0])], lineterminator="\n")
    writer.writeheader()
    writer.writerows({k: f"{v:.4g}" if isinstance(v, float) else v for k, v in dataclasses.asdict(row).items()} for row in rows)
    write_text(path, stream.getvalue())
