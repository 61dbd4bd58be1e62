"""The texture layout of a prepared mesh beside what xatlas alone makes of it: charts, stretch, density."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.core.artifact import load_npz
from stages.core.errors import InputError
from stages.core.schemas import PREP
from stages.prep.unwrap import run_xatlas
from stages.prep.uv import signed_area, stretch, uv_charts
from stages.report.options import UnwrapReportOptions


@dataclass(frozen=True)
class UnwrapRow:
    """One layout. filled: share of the texture. stretch: 1 at best. texel_density: texels per length of the object."""

    layout: str
    charts: int
    filled: float
    stretch: float
    texel_density: float


def report_unwrap(prep: Path, options: UnwrapReportOptions) -> list[UnwrapRow]:
    """Compare at one texture size and one gutter. Raises: ArtifactError; InputError when xatlas does not finish."""
    mesh = load_npz(prep, PREP)
    vertices, triangles = mesh["vertices"], mesh["triangles"]
    size = int(mesh.provenance.options["texture_size"])
    gutter = mesh.provenance.extra["findings"]["gutter"] or options.gutter
    made, how = run_xatlas(vertices, triangles, options.seconds, (size, gutter))
    if made is None:
        raise InputError(f"{prep}: {how.removeprefix('projection: ')}, expected it to finish; give it more --seconds")
    sheet = np.nan_to_num(made[0] - np.nanmin(made[0], (0, 1)))
    alone = sheet / sheet.max()
    return [
        layout_row("dreammat", vertices, triangles, mesh["uv"], size),
        layout_row("xatlas alone", vertices, triangles, alone, size),
    ]


def layout_row(name: str, vertices: NDArray, triangles: NDArray, uv: NDArray, size: int) -> UnwrapRow:
    """Measures of UVs (F, 3, 2) in the unit square."""
    a, b, c = (vertices[triangles[:, k]].astype(np.float64) for k in range(3))
    filled = float(np.abs(signed_area(uv)).sum())
    area = float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)
    charts = int(uv_charts(triangles, uv).max()) + 1
    return UnwrapRow(name, charts, filled, stretch(vertices[triangles], uv), size * (filled / area) ** 0.5)


def summary(rows: list[UnwrapRow]) -> list[str]:
    """Lines for a reader."""
    return [
        f"{row.layout:12} {row.charts:5} charts, {100 * row.filled:.1f} % filled, stretch {row.stretch:.3f}, "
        f"{row.texel_density:.0f} texels per length of the object"
        for row in rows
    ]
